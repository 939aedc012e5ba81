//! Rounding shifts, quotients and roots in fixed point, each with its error.

use crate::coefficients::INVERSE_ROOT;
use crate::multiply::{multiply_high, multiply_high_add};

/// Returns the nearest `i32`.
#[inline(always)]
pub const fn saturate(value: i64) -> i32 {
    if value > i32::MAX as i64 {
        i32::MAX
    } else if value < i32::MIN as i64 {
        i32::MIN
    } else {
        value as i32
    }
}

/// Returns `value / 2^BITS` rounded to nearest (halves upwards), modulo 2³².
///
/// BITS is in 1..=62; `value` may be anything, a sum beyond 2⁶³ wraps.
#[inline(always)]
pub const fn round_shift<const BITS: u32>(value: i64) -> i32 {
    const { assert!(BITS >= 1 && BITS <= 62) };
    (value.wrapping_add(1 << (BITS - 1)) >> BITS) as i32
}

/// Returns `value / 2^BITS` rounded to nearest (halves upwards), saturated to `i32`.
#[inline(always)]
pub const fn round_shift_saturating<const BITS: u32>(value: i64) -> i32 {
    const { assert!(BITS >= 1 && BITS <= 62) };
    saturate(value.saturating_add(1 << (BITS - 1)) >> BITS)
}

/// Returns 2⁶¹ / `normal` for `normal` in 2³⁰..2³¹, wrong by at most 1.2 parts in 10⁹.
///
/// The answer is in 2³⁰..2³¹ too. One 32-bit division and one Newton step. Outside that range the
/// answer is meaningless, and no more than that.
#[inline(always)]
pub const fn invert_normal(normal: i32) -> i32 {
    // 17 bits with the lowest set: the middle of the interval that was cut off, never zero.
    let Some(seed) = u32::MAX.checked_div(normal as u32 >> 14 | 1) else {
        return i32::MAX;
    };
    // 2⁶¹ / normal to 15 bits, the middle again of what the division cut off; below 2³¹ since the
    // divisor above is at least 2¹⁶ + 1.
    let rough = seed << 15 | 1 << 14;
    // The residual 2⁶¹ − normal · rough is within ±2⁴⁶: what both products hold.
    let residual = (1i64 << 61).wrapping_sub((normal as i64).wrapping_mul(rough as i64));
    let step = (residual >> 16)
        .wrapping_mul(rough as i64)
        .wrapping_add(1 << 44)
        >> 45;
    // At a power of two the rounding reaches 2³¹, one more than the sign bit allows.
    let inverse = rough.wrapping_add(step as u32);
    (inverse - (inverse >> 31)) as i32
}

/// Returns bits 32..64 of `value · 2^shift`, for a shift in 1..=31.
#[inline(always)]
pub const fn shift_left_high(value: i64, shift: u32) -> i32 {
    let (high, low) = ((value >> 32) as u32, value as u32);
    // Masked, so that no shift can be out of range.
    (high << (shift & 31) | low >> (32u32.wrapping_sub(shift) & 31)) as i32
}

/// One over a positive number, ready to multiply by; relative error at most 1.2 parts in 10⁹.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reciprocal {
    /// 2⁶¹ / (divisor · 2^shift), in 2³⁰..2³¹.
    mantissa: i32,
    /// The shift that brings the divisor to 2³⁰..2³¹, in 0..=30.
    shift: u32,
}

impl Reciprocal {
    /// Makes one over `divisor`; a divisor of zero or less counts as 1.
    #[inline(always)]
    pub const fn new(divisor: i32) -> Self {
        let divisor = if divisor < 1 { 1 } else { divisor };
        let shift = divisor.leading_zeros() - 1;
        Self {
            mantissa: invert_normal(divisor << shift),
            shift,
        }
    }

    /// Returns `number · 2^29 / divisor`, saturated: Qn over a divisor in Q29 stays in Qn.
    #[inline(always)]
    pub const fn times_over_q29(self, number: i32) -> i32 {
        // shift ≤ 30, so that the right shift is at least 2; |product| < 2⁶².
        let down = 32 - self.shift;
        saturate((number as i64 * self.mantissa as i64 + (1i64 << (down - 1))) >> down)
    }

    /// Returns 1 / divisor in Q30, the divisor in Q30 and at least ½; wrong by 2 parts in 10⁹.
    #[inline(always)]
    pub const fn to_q30(self) -> i32 {
        // The shift is 0 or 1 there.
        self.mantissa >> (1u32.wrapping_sub(self.shift) & 31)
    }
}

/// Returns `number / divisor` in Q31 for |number| ≤ 0.99 divisor, wrong by at most 1.3e-9.
///
/// Beyond that range the answer is meaningless; a divisor of zero or less counts as 1.
#[inline(always)]
pub const fn divide_q31(number: i32, divisor: i32) -> i32 {
    let Reciprocal { mantissa, shift } = Reciprocal::new(divisor);
    round_shift::<30>((number << shift) as i64 * mantissa as i64)
}

/// Returns the square root of a Q30 number in 0..4, in Q30, wrong by at most one step of 2⁻³⁰.
#[inline(always)]
pub fn root_q30(square: u32) -> i32 {
    if square == 0 {
        return 0;
    }
    let shift = square.leading_zeros() & !1;
    // In Q32, ¼..1; and in Q31 with a sign.
    let mantissa = square << shift;
    let signed = (mantissa >> 1) as i32;
    let [c0, c1, c2, c3, c4] = INVERSE_ROOT;
    // A quartic seed of 1/√m: each step of Horner's rule loses one bit of the format. Q24.
    let seed = multiply_high_add(
        c0,
        multiply_high_add(
            c1,
            multiply_high_add(c2, multiply_high_add(c3, c4, signed), signed),
            signed,
        ),
        signed,
    );
    let seed = seed << 5; // Q29
    // One Newton step: 2.1e-3 becomes 7e-6.
    let square_q28 = multiply_high(seed, seed) << 2;
    let defect_q27 = (1i32 << 27).wrapping_sub(multiply_high(square_q28, signed));
    let inverse = seed.wrapping_add(multiply_high(seed, defect_q27 << 7) >> 3);
    // The root to 7e-6, then corrected by its exact residual.
    let rough = multiply_high(signed, inverse) << 3; // Q31
    let residual = ((mantissa as i64) << 30).wrapping_sub(rough as i64 * rough as i64); // Q62
    let correction = multiply_high((residual >> 16) as i32, inverse); // Q43, twice too much
    let root = (rough as u32).wrapping_add(((correction.wrapping_add(1 << 12)) >> 13) as u32);
    // The shift is even; half of it comes back, rounded.
    let half = shift >> 1;
    let rounded = (root as u64 + ((1u64 << half) >> 1)) >> half;
    if rounded > i32::MAX as u64 {
        i32::MAX
    } else {
        rounded as i32
    }
}
