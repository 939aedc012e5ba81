//! Sine, cosine and arctangent in fixed point, each with its error.

use crate::Angle;
use crate::arithmetic::quotient_q30;
use crate::coefficients::{ANGLE_OVER_SINE, COEFFICIENTS};
use crate::machine::{from_memory, multiply_high, multiply_high_add};

/// Returns sine and cosine in Q30 of angles within −1..1 rad, wrong by at most 2.8e-9 each (proven: the
/// sine by 1.77e-9, the cosine by 2.81e-9).
///
/// Neither passes 2³⁰ − 1. Beyond that range the answer is meaningless (and no more than that);
/// [`Angle::sin_cos`] takes every angle. All angles go through the polynomial together, so that each
/// coefficient is loaded once.
#[inline(always)]
pub fn sin_cos_near<const N: usize>(angles: [Angle; N]) -> [(i32, i32); N] {
    sin_cos_q31(angles.map(|angle| angle.to_q29() << 2))
}

/// Sine and cosine in Q30 of angles in Q31 radians.
#[inline(always)]
fn sin_cos_q31<const N: usize>(angles: [i32; N]) -> [(i32, i32); N] {
    let table = from_memory(&COEFFICIENTS);
    let [s0, s1, s2, s3, s4] = table.sine;
    let [c1, c2, c3, c4] = table.cosine;
    // a² in Q30.
    let squares = angles.map(|angle| multiply_high(angle, angle));
    let step = |sums: [i32; N], coefficient: i32| -> [i32; N] {
        core::array::from_fn(|k| multiply_high_add(coefficient, sums[k], squares[k]))
    };
    let sums = step([s4; N], s3);
    let sums = step(sums, s2);
    let sums = step(sums, s1);
    let sums = step(sums, s0);
    let sines: [i32; N] = core::array::from_fn(|k| multiply_high(angles[k], sums[k]));
    let sums = step([c4; N], c3);
    let sums = step(sums, c2);
    let sums = step(sums, c1);
    // One step below one, so that twice the cosine is a number too.
    let cosines = step(sums, (1 << 30) - 1);
    core::array::from_fn(|k| (sines[k], cosines[k]))
}

/// Returns the arctangents in Q30 radians of Q31 tangents within ±17/32, wrong by at most 1.4e-9
/// (measured; 1.8e-9 is proven).
///
/// The same integer read in Q29 is twice the arctangent. Beyond the range the answer is meaningless, and
/// no more than that.
#[inline(always)]
pub fn arctangents<const N: usize>(tangents: [i32; N]) -> [i32; N] {
    arctangents_of(tangents, tangents.map(quadruple_square))
}

/// Returns (2t)² in Q30 of a Q31 number within ±17/32.
#[inline(always)]
pub fn quadruple_square(tangent: i32) -> i32 {
    multiply_high(tangent, tangent) << 2
}

/// Returns the same as [`arctangents`], given each tangent's [`quadruple_square`].
#[inline(always)]
pub fn arctangents_of<const N: usize>(tangents: [i32; N], squares: [i32; N]) -> [i32; N] {
    let [p0, p1, p2, p3, p4, p5, p6] = from_memory(&COEFFICIENTS).arctangent;
    let step = |sums: [i32; N], coefficient: i32| -> [i32; N] {
        core::array::from_fn(|k| multiply_high_add(coefficient, sums[k], squares[k]))
    };
    let sums = step([p6; N], p5);
    let sums = step(sums, p4);
    let sums = step(sums, p3);
    let sums = step(sums, p2);
    let sums = step(sums, p1);
    let sums = step(sums, p0);
    core::array::from_fn(|k| multiply_high(tangents[k], sums[k]))
}

impl Angle {
    /// Returns sine and cosine in Q30, wrong by at most 3 parts in 10⁹ each, for every angle.
    #[inline]
    pub fn sin_cos(self) -> (i32, i32) {
        const TWO_OVER_PI_Q31: i32 = 1_367_130_551;
        const HALF_PI_Q31: u32 = 3_373_259_426;
        // The nearest quarter turn, −3..=3.
        let quarters = (multiply_high(self.to_q29(), TWO_OVER_PI_Q31) + (1 << 27)) >> 28;
        // Modulo 2³²: the true difference is within ±0.79 rad, which Q31 holds.
        let rest = (self.to_q29() << 2).wrapping_sub(quarters.wrapping_mul(HALF_PI_Q31 as i32));
        let [(sine, cosine)] = sin_cos_q31([rest]);
        match quarters & 3 {
            0 => (sine, cosine),
            1 => (cosine, -sine),
            2 => (-sine, -cosine),
            _ => (-cosine, sine),
        }
    }

    /// Returns the angle of the vector (x, y), in −π..=π, wrong by at most 5 nrad.
    ///
    /// Any scale, any bits; short vectors are as exact as their own digits. (0, 0) gives zero.
    #[inline]
    pub fn from_sides(y: i32, x: i32) -> Self {
        let (height, width) = (y.unsigned_abs(), x.unsigned_abs());
        let (small, big) = if height > width {
            (width, height)
        } else {
            (height, width)
        };
        if big == 0 {
            return Self::ZERO;
        }
        // Both to below 2³⁰, the longer one to at least 2²⁹.
        let lead = big.leading_zeros();
        let (small, big) = if lead >= 2 {
            (small << (lead - 2), big << (lead - 2))
        } else {
            (small >> (2 - lead), big >> (2 - lead))
        };
        let (small, big) = (small as i32, big as i32);
        // The tangent in Q31 is twice the quotient in Q30; the arctangent in Q30 has one bit more.
        let octant = if small > big >> 1 {
            // atan t = π/4 + atan((t − 1)/(t + 1)), within ±⅓.
            let [rest] = arctangents([quotient_q30(small - big, (small + big) >> 1)]);
            Self::FRAC_PI_4.to_q29() + (rest >> 1)
        } else {
            let [whole] = arctangents([quotient_q30(small << 1, big)]);
            (whole + 1) >> 1
        };
        let quadrant = if height > width {
            Self::FRAC_PI_2.to_q29() - octant
        } else {
            octant
        };
        let half = if x < 0 {
            Self::PI.to_q29() - quadrant
        } else {
            quadrant
        };
        Self::from_q29(if y < 0 { -half } else { half })
    }
}

/// Returns α / sin α in Q29 from cos α in Q30, relative error at most 4 parts in 10⁶.
///
/// α from 0 to a right angle; for a cosine below zero the value at the right angle, π/2.
#[inline]
pub fn angle_over_sine(cosine: i32) -> i32 {
    // h = (1 − cos α)/2 in Q32, in 0..½.
    let difference = (1i64 << 30) - cosine as i64;
    let h = if difference < 0 {
        0
    } else if difference >= 1 << 30 {
        i32::MAX
    } else {
        (difference << 1) as i32
    };
    let [c0, c1, c2, c3, c4, c5, c6] = *from_memory(&ANGLE_OVER_SINE);
    let p = multiply_high_add(c4, multiply_high_add(c5, c6, h), h);
    let p = multiply_high_add(c2, multiply_high_add(c3, p, h), h);
    multiply_high_add(c0, multiply_high_add(c1, p, h), h)
}
