//! From the motors' angles to the platform, with its Jacobian.

use eel_units::{
    Angle, SIN_COS_NEAR, invert_normal, root_q30, round_shift, shift_left_high, sin_cos_near,
};

use crate::jacobian::Jacobian;
use crate::pose::{Joints, PoseError};
use crate::rotation::Rotation;
use crate::vector::{ROOT_HALF_Q30, Vector, dot, times, times_minus, times_plus};
use crate::wrist::{Leg, Wrist};

/// The least assembly margin of a leg, W = ½ (√2 at home), squared, in Q30; a little more, so that
/// one over it stays below 2.
const LEAST_ASSEMBLY_SQUARE: i64 = (1 << 28) + (1 << 18);
/// The least serial margin: ⅛ in Q29.
const LEAST_SERIAL: i32 = 1 << 26;

/// What the direct kinematics gives for three motor angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Direct {
    /// The platform's orientation, in the home assembly mode.
    pub rotation: Rotation,
    /// Rates and torques there.
    pub jacobian: Jacobian,
    /// The serial margin, Q30: the lesser (l×r)·i / ρ of the two legs, as the inverse gives it.
    pub margin: i32,
}

/// One leg with its crank turned: what the platform has to meet.
struct Crank {
    sine: i32,
    cosine: i32,
    /// The crank's end over ρ, Q29.
    end: Vector,
    /// (1 + B·B − s²) / 2ρ, which C · B / ρ must equal; Q29.
    offset: i32,
}

/// A root of K cos α + M sin α = N, with the margin W = √(K² + M² − N²) in Q30.
struct Root {
    sine: i32,
    cosine: i32,
    margin: i32,
}

impl Wrist {
    /// Returns the platform for the motors' angles, in the home assembly mode.
    ///
    /// The orientation is wrong by at most 0.02 µrad in the paper's workspace.
    ///
    /// # Errors
    /// [`PoseError::OutOfReach`] where the parts can't be joined at these angles, or they lie beyond
    /// the range of the kernel; [`PoseError::Singular`] where an assembly margin has shrunk to about
    /// a third of home's or a serial margin to ⅛.
    #[inline]
    pub fn direct(&self, joints: &Joints) -> Result<Direct, PoseError> {
        let [first, second, third] = joints.0;
        let first = self.legs[0].turned(first)?;
        let second = self.legs[1].turned(second)?;
        let (sine, cosine) = near(third - Angle::FRAC_PI_4)?;
        let half = ROOT_HALF_Q30;
        let c3 = times_minus(cosine, half, sine, half);
        let s3 = times_plus(cosine, half, sine, half);

        // Leg 1 fixes φ, where C1 = (C3 cos φ, S3 cos φ, −sin φ).
        let ahead = round_shift::<30>(
            i64::from(c3) * i64::from(first.end[0]) + i64::from(s3) * i64::from(first.end[1]),
        );
        let phi = Root::find(ahead, -first.end[2], first.offset, 1)?;
        let x = [times(c3, phi.cosine), times(s3, phi.cosine), -phi.sine];
        let y = [-s3, c3, 0];
        let z = [times(c3, phi.sine), times(s3, phi.sine), phi.cosine];

        // Leg 2 fixes ψ, where C2 = y' cos ψ + z'' sin ψ.
        let ahead = round_shift::<30>(dot(&second.end, &y));
        let across = round_shift::<30>(dot(&second.end, &z));
        let psi = Root::find(ahead, across, second.offset, -1)?;
        let point = mixed(&y, psi.cosine, &z, psi.sine);
        let axis = mixed(&z, psi.cosine, &y, -psi.sine);

        let serial = [
            self.legs[0].serial(&first, &x),
            self.legs[1].serial(&second, &point),
        ];
        let margin = serial[0].min(serial[1]);
        if margin < LEAST_SERIAL || phi.cosine >> 1 < LEAST_SERIAL {
            return Err(PoseError::Singular);
        }
        let along = round_shift::<30>(dot(&second.end, &x));
        let jacobian = Jacobian::new(
            [x, y, z],
            [phi.margin, psi.margin],
            round_shift::<30>(dot(&first.end, &y)),
            [
                round_shift::<30>(i64::from(along) * i64::from(psi.sine)),
                round_shift::<30>(i64::from(along) * i64::from(psi.cosine)),
            ],
            [serial[0], serial[1], phi.cosine >> 1],
            self.cranks,
        )
        .ok_or(PoseError::Singular)?;
        // A margin of 1.1 at most, so that Q30 holds it.
        Ok(Direct {
            rotation: Rotation::from_columns([x, point, axis]),
            jacobian,
            margin: margin.saturating_mul(2),
        })
    }
}

impl Leg {
    /// Turns the crank to the motor's angle.
    #[inline(always)]
    fn turned(&self, motor: Angle) -> Result<Crank, PoseError> {
        let (sine, cosine) = near(motor + self.zero)?;
        let end = [
            self.slope[0],
            self.slope[1] + ((cosine + 1) >> 1),
            self.slope[2] + ((sine + 1) >> 1),
        ];
        let lever = i64::from(self.center[0]) * i64::from(cosine)
            + i64::from(self.center[1]) * i64::from(sine);
        Ok(Crank {
            sine,
            cosine,
            end,
            offset: self.offset + round_shift::<30>(lever),
        })
    }

    /// Returns (l×r)·i / ρ in Q29: F cos θ − E sin θ, with E and F of the inverse.
    #[inline(always)]
    fn serial(&self, crank: &Crank, point: &Vector) -> i32 {
        let e = ((point[1] + 1) >> 1) - self.center[0];
        let f = ((point[2] + 1) >> 1) - self.center[1];
        round_shift::<30>(
            i64::from(f) * i64::from(crank.cosine) - i64::from(e) * i64::from(crank.sine),
        )
    }
}

impl Root {
    /// Finds the root on the given side (±1) for K, M, N in Q29.
    ///
    /// cos α = (K N ± M W)/H, sin α = (M N ∓ K W)/H, with H = K² + M².
    #[inline(always)]
    fn find(k: i32, m: i32, n: i32, side: i32) -> Result<Self, PoseError> {
        let (k, m, n) = (i64::from(k), i64::from(m), i64::from(n));
        // |K| ≤ 2.2, |M| ≤ 2.6, |N| ≤ 2.6 by the kernel's range: Q58 holds the squares.
        let whole = k * k + m * m;
        let square = (whole - n * n + (1 << 27)) >> 28; // Q30
        if square < LEAST_ASSEMBLY_SQUARE {
            return Err(if square < 0 {
                PoseError::OutOfReach
            } else {
                PoseError::Singular
            });
        }
        if whole >= 8 << 58 {
            return Err(PoseError::OutOfReach);
        }
        let margin = root_q30(square.min(i64::from(u32::MAX)) as u32);
        let w = i64::from(margin) * i64::from(side);
        // H in ¼..8, in Q58: its high half has 3 to 8 leading zeros.
        let shift = ((whole >> 32) as u32).leading_zeros().wrapping_sub(1);
        let inverse = i64::from(invert_normal(shift_left_high(whole, shift)));
        // |numerator| ≤ H, brought to ±2³⁰ beside H in 2³⁰..2³¹.
        let over = |numerator: i64| {
            let normal = shift_left_high(numerator, shift.wrapping_sub(1));
            round_shift::<30>(i64::from(normal) * inverse)
        };
        let cosine = over(k * n + ((m * w) >> 1));
        let sine = over(m * n - ((k * w) >> 1));
        Ok(Self {
            sine,
            cosine,
            margin,
        })
    }
}

/// Sine and cosine of an angle within the kernel's range.
#[inline(always)]
fn near(angle: Angle) -> Result<(i32, i32), PoseError> {
    if angle.abs() > SIN_COS_NEAR {
        return Err(PoseError::OutOfReach);
    }
    Ok(sin_cos_near(angle))
}

/// Returns a · cosine + b · sine, all in Q30.
#[inline(always)]
fn mixed(a: &Vector, cosine: i32, b: &Vector, sine: i32) -> Vector {
    [
        times_plus(a[0], cosine, b[0], sine),
        times_plus(a[1], cosine, b[1], sine),
        times_plus(a[2], cosine, b[2], sine),
    ]
}
