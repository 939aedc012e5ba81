//! Sine, cosine and arctangent in fixed point, each with its error.

use crate::Angle;
use crate::arithmetic::divide_q31;
use crate::coefficients::{ANGLE_OVER_SINE, ARCTANGENT, COSINE, SINE};
use crate::multiply::{multiply_high, multiply_high_add};

/// The largest magnitude for [`sin_cos_near`]: 1.125 rad.
pub const SIN_COS_NEAR: Angle = Angle::from_q29(603_979_776);

/// Returns sine and cosine in Q30 of an angle within ±1.125 rad, wrong by at most 1.5e-9 each.
///
/// Beyond that range the answer is meaningless (and no more than that); [`Angle::sin_cos`] takes
/// every angle.
#[inline(always)]
pub fn sin_cos_near(angle: Angle) -> (i32, i32) {
    sin_cos_q30(angle.to_q29() << 1)
}

/// Sine and cosine in Q30 of an angle in Q30, within ±1.125 rad.
#[inline(always)]
fn sin_cos_q30(angle: i32) -> (i32, i32) {
    // w = a²/4 in Q32.
    let w = ((angle as i64 * angle as i64 + (1 << 29)) >> 30) as i32;
    let [s0, s1, s2, s3] = SINE;
    let sine = multiply_high_add(
        s0,
        multiply_high_add(s1, multiply_high_add(s2, s3, w), w),
        w,
    );
    // S · w in Q32: within −0.2..0.
    let sine = multiply_high_add(angle, angle, multiply_high(sine, w) << 1);
    let [c0, c1, c2, c3, c4] = COSINE;
    let cosine = multiply_high_add(c2, multiply_high_add(c3, c4, w), w);
    let cosine = multiply_high_add(c0, multiply_high_add(c1, cosine, w), w);
    (sine, multiply_high_add(1 << 30, cosine, w))
}

/// Returns the arctangent in Q30 radians of a Q31 tangent within ±0.625, wrong by at most 1.2e-9.
///
/// The same integer read in Q29 is twice the arctangent. Beyond the range the error grows, to
/// 0.01 rad at ±1.
#[inline(always)]
pub fn arctangent(tangent: i32) -> i32 {
    // u = t² in Q32; from √½ up it would pass the sign bit, so that it stops there.
    let square = (tangent as i64 * tangent as i64 + (1 << 29)) >> 30;
    let u = if square > i32::MAX as i64 {
        i32::MAX
    } else {
        square as i32
    };
    let [c0, c1, c2, c3, c4, c5, c6] = ARCTANGENT;
    let p = multiply_high_add(c4, multiply_high_add(c5, c6, u), u);
    let p = multiply_high_add(c2, multiply_high_add(c3, p, u), u);
    let p = multiply_high_add(c0, multiply_high_add(c1, p, u), u);
    // P · u in Q32: within −0.34..0.
    let q31 = multiply_high_add(tangent, tangent, multiply_high(p, u) << 1);
    (q31 >> 1).wrapping_add(q31 & 1)
}

impl Angle {
    /// Returns sine and cosine in Q30, wrong by at most 2 parts in 10⁹ each, for every angle.
    #[inline]
    pub fn sin_cos(self) -> (i32, i32) {
        const TWO_OVER_PI_Q31: i32 = 1_367_130_551;
        const HALF_PI_Q30: i32 = 1_686_629_713;
        // The nearest quarter turn, −3..=3.
        let quarters = (multiply_high(self.to_q29(), TWO_OVER_PI_Q31) + (1 << 27)) >> 28;
        // Modulo 2³²: the true difference is within ±0.79 rad, which Q30 holds.
        let rest = (self.to_q29() << 1).wrapping_sub(quarters.wrapping_mul(HALF_PI_Q30));
        let (sine, cosine) = sin_cos_q30(rest);
        match quarters & 3 {
            0 => (sine, cosine),
            1 => (cosine, -sine),
            2 => (-sine, -cosine),
            _ => (-cosine, sine),
        }
    }

    /// Returns the angle of the vector (x, y), in −π..=π, wrong by at most 3.5 nrad.
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
        let octant = if small > big >> 1 {
            // atan t = π/4 + atan((t − 1)/(t + 1)), within ±⅓.
            let rest = arctangent(divide_q31(small - big, small + big));
            Self::FRAC_PI_4.to_q29() + (rest >> 1)
        } else {
            (arctangent(divide_q31(small, big)) + 1) >> 1
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
    let [c0, c1, c2, c3, c4, c5, c6] = ANGLE_OVER_SINE;
    let p = multiply_high_add(c4, multiply_high_add(c5, c6, h), h);
    let p = multiply_high_add(c2, multiply_high_add(c3, p, h), h);
    multiply_high_add(c0, multiply_high_add(c1, p, h), h)
}
