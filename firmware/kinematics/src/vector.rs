//! Three-vectors in fixed point.

use eel_units::round_shift;

/// A vector of three numbers in one Q format.
pub(crate) type Vector = [i32; 3];

/// √½ in Q30.
pub(crate) const ROOT_HALF_Q30: i32 = 759_250_125;

/// Returns a · b in full width.
///
/// Free of overflow where one side is at most 2³⁰ in every component; otherwise it wraps.
#[inline(always)]
pub(crate) const fn dot(a: &Vector, b: &Vector) -> i64 {
    (a[0] as i64 * b[0] as i64)
        .wrapping_add(a[1] as i64 * b[1] as i64)
        .wrapping_add(a[2] as i64 * b[2] as i64)
}

/// Returns a · b of two Q30 numbers in Q30.
#[inline(always)]
pub(crate) const fn times(a: i32, b: i32) -> i32 {
    round_shift::<30>(a as i64 * b as i64)
}

/// Returns a · b + c · d of Q30 numbers in Q30.
#[inline(always)]
pub(crate) const fn times_plus(a: i32, b: i32, c: i32, d: i32) -> i32 {
    round_shift::<30>((a as i64 * b as i64).wrapping_add(c as i64 * d as i64))
}

/// Returns a · b − c · d of Q30 numbers in Q30.
#[inline(always)]
pub(crate) const fn times_minus(a: i32, b: i32, c: i32, d: i32) -> i32 {
    round_shift::<30>((a as i64 * b as i64).wrapping_sub(c as i64 * d as i64))
}

/// Adds a × b to the sums, in full width.
#[inline(always)]
pub(crate) const fn add_cross(sum: &mut [i64; 3], a: &Vector, b: &Vector) {
    sum[0] = sum[0]
        .wrapping_add(a[1] as i64 * b[2] as i64)
        .wrapping_sub(a[2] as i64 * b[1] as i64);
    sum[1] = sum[1]
        .wrapping_add(a[2] as i64 * b[0] as i64)
        .wrapping_sub(a[0] as i64 * b[2] as i64);
    sum[2] = sum[2]
        .wrapping_add(a[0] as i64 * b[1] as i64)
        .wrapping_sub(a[1] as i64 * b[0] as i64);
}
