//! Three-vectors in fixed point.

use eel_units::{multiply_high_add, round_shift};

/// A vector of three numbers in one Q format.
pub(crate) type Vector = [i32; 3];

/// Returns a · b in full width.
///
/// Free of overflow where one side is at most 2³⁰ in every component; otherwise it wraps.
#[inline(always)]
pub(crate) const fn dot(a: &Vector, b: &Vector) -> i64 {
    wide(a[0], b[0])
        .wrapping_add(wide(a[1], b[1]))
        .wrapping_add(wide(a[2], b[2]))
}

/// Returns a · b in full width.
#[inline(always)]
pub(crate) const fn wide(a: i32, b: i32) -> i64 {
    a as i64 * b as i64
}

/// Returns the high half of a sum of products, rounded down: Qm + Qn − 32.
#[inline(always)]
pub(crate) const fn high(sum: i64) -> i32 {
    (sum >> 32) as i32
}

/// √½ − 1 in Q32.
pub(crate) const ROOT_HALF_LESS_ONE_Q32: i32 = -1_257_966_796;
/// √2 − 1 in Q32.
pub(crate) const ROOT_TWO_LESS_ONE_Q32: i32 = 1_779_033_704;

/// Returns √½ of a number: itself less 1 − √½ of it.
#[inline(always)]
pub(crate) fn over_root_two(number: i32) -> i32 {
    multiply_high_add(number, number, ROOT_HALF_LESS_ONE_Q32)
}

/// Returns √2 times a number: itself and √2 − 1 of it.
#[inline(always)]
pub(crate) fn times_root_two(number: i32) -> i32 {
    multiply_high_add(number, number, ROOT_TWO_LESS_ONE_Q32)
}

/// Returns a · b of two Q30 numbers in Q30.
#[inline(always)]
pub(crate) const fn times(a: i32, b: i32) -> i32 {
    round_shift::<30>(wide(a, b))
}

/// Returns a · b + c · d of Q30 numbers in Q30.
#[inline(always)]
pub(crate) const fn times_plus(a: i32, b: i32, c: i32, d: i32) -> i32 {
    round_shift::<30>(wide(a, b).wrapping_add(wide(c, d)))
}

/// Returns a · b − c · d of Q30 numbers in Q30.
#[inline(always)]
pub(crate) const fn times_minus(a: i32, b: i32, c: i32, d: i32) -> i32 {
    round_shift::<30>(wide(a, b).wrapping_sub(wide(c, d)))
}

/// Adds a × b to the sums, in full width.
#[inline(always)]
pub(crate) const fn add_cross(sum: &mut [i64; 3], a: &Vector, b: &Vector) {
    sum[0] = sum[0]
        .wrapping_add(wide(a[1], b[2]))
        .wrapping_sub(wide(a[2], b[1]));
    sum[1] = sum[1]
        .wrapping_add(wide(a[2], b[0]))
        .wrapping_sub(wide(a[0], b[2]));
    sum[2] = sum[2]
        .wrapping_add(wide(a[0], b[1]))
        .wrapping_sub(wide(a[1], b[0]));
}
