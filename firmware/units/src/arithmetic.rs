//! Rounding shifts, quotients and roots in fixed point, each with its error.

use crate::machine::{divide, divide_unsigned, multiply_high_add};

/// Returns the nearest `i32`.
#[inline(always)]
pub const fn saturate(value: i64) -> i32 {
    let low = value as i32;
    if low as i64 == value {
        low
    } else {
        // The end on the side of the sign.
        (value >> 63) as i32 ^ i32::MAX
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

/// Returns `number / divisor` in Q30 for a divisor from 2²⁸ on and |number| ≤ divisor.
///
/// Wrong towards zero by at most 4.25 steps, 4e-9, for a divisor from 2²⁹ on, and 17.1, 1.6e-8, below; away
/// from zero by at most 2.1 and 4.1 steps (proven, and nearly reached). The number may pass the divisor by a
/// sixteenth. Beyond that the answer is meaningless, and no more than that.
///
/// Long division with two digits of 15 bits, each by one SDIV; the remainder between them is exact.
#[inline(always)]
pub fn ratio_q30(number: i32, divisor: i32) -> i32 {
    let leading = divisor >> 15;
    let first = divide(number, leading);
    // Between the divisor and −1.1 · 2³⁰ for a positive number: the low half is all of it.
    let rest = (number << 15).wrapping_sub(first.wrapping_mul(divisor));
    (first << 15).wrapping_add(divide(rest, leading))
}

/// Where the line starts that is within 12 % of the root; one instruction makes it, as the slope.
#[doc(hidden)]
pub const ROOT_START_Q15: i32 = 5_214;
/// The line's slope.
#[doc(hidden)]
pub const ROOT_SLOPE_Q16: i32 = 0x9C << 9;

/// Returns the square root in Q30 of a Q31 number in 1/32..0.55, wrong by at most 2e-9; from ⅛ on by
/// at most 1.2e-9 (measured; proven are 2.9e-9 and 1.8e-9).
///
/// Beyond that range the answer is meaningless, and no more than that; [`root_q30`] takes every number.
///
/// A straight line, two steps of Heron with a UDIV each, then the exact residual.
#[inline(always)]
pub fn root_near(square: i32) -> i32 {
    let rough = multiply_high_add(ROOT_START_Q15, square, ROOT_SLOPE_Q16) as u32;
    // The sum of the two sides of Heron is twice the root, in Q16: to 0.8 %.
    let twice = (rough << 1).wrapping_add(divide_unsigned(square as u32, rough));
    let doubled = (square as u32) << 1; // Q32
    // Q16: to 3 parts in 10⁵ and 1.5 steps.
    let fine = (twice >> 2).wrapping_add(divide_unsigned(doubled, twice));
    // |residual| < 2¹⁸ in Q32: the low half is all of it.
    let residual = doubled.wrapping_sub(fine.wrapping_mul(fine)) as i32;
    ((fine << 14) as i32).wrapping_add(divide(residual << 13, fine as i32))
}

/// Returns the square root of a Q30 number in 0..4, in Q30, wrong by at most 4 parts in 10⁹ of itself
/// and one step.
#[inline]
pub fn root_q30(square: u32) -> i32 {
    if square == 0 {
        return 0;
    }
    let shift = square.leading_zeros() & !1;
    // In ⅛..½, Q31.
    let root = root_near((square << shift >> 2) as i32) as u32;
    // √½ of the mantissa's root, which belongs to Q30 shifted left by `shift`: √2 brings it back.
    let root = root as u64 * 3_037_000_500;
    let down = 30 + (shift >> 1);
    let rounded = (root + (1 << (down - 1))) >> down;
    if rounded > i32::MAX as u64 {
        i32::MAX
    } else {
        rounded as i32
    }
}

/// Returns `number / divisor` in Q30 for |number| ≤ divisor of any size, wrong by at most 2e-9.
///
/// Beyond that range the answer is meaningless; a divisor of zero or less counts as 1.
#[inline]
pub fn quotient_q30(number: i32, divisor: i32) -> i32 {
    let divisor = divisor.max(1);
    // The divisor to 2³⁰..2³¹, where a ratio is most exact.
    let lead = divisor.leading_zeros().wrapping_sub(1) & 31;
    ratio_q30(number << lead, divisor << lead)
}
