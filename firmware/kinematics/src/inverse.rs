//! From a pose to the motors' angles.

use eel_units::{Angle, SIN_COS_NEAR, arctangent, divide_q31, root_q30, round_shift, sin_cos_near};

use crate::pose::{Joints, Pose, PoseError};
use crate::rotation::Rotation;
use crate::vector::{Vector, dot};
use crate::wrist::{Leg, Wrist};

/// The least D = margin² of a leg, Q30: a margin of ¼.
const LEAST_SQUARE: i64 = 1 << 26;

/// What the inverse kinematics gives for a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inverse {
    /// The motors' angles, in the home working mode.
    pub joints: Joints,
    /// The platform's orientation.
    pub rotation: Rotation,
    /// The serial margin, Q30: the lesser √D = (l×r)·i / ρ of the two legs.
    ///
    /// 1 at home, at least 0.57 in the paper's workspace, 0 where a crank and its rod line up.
    pub margin: i32,
}

impl Wrist {
    /// Returns the motors' angles for a pose, wrong by at most 0.02 µrad in the paper's workspace.
    ///
    /// # Errors
    /// [`PoseError::OutOfReach`] where no configuration of the home working mode reaches the pose,
    /// or it lies beyond the range of the kernel; [`PoseError::Singular`] where the margin is below ¼.
    #[inline]
    pub fn inverse(&self, pose: &Pose) -> Result<Inverse, PoseError> {
        let near = SIN_COS_NEAR.to_q29() as u32;
        if [pose.yaw, pose.pitch, pose.roll]
            .iter()
            .any(|angle| angle.to_q29().unsigned_abs() > near)
        {
            return Err(PoseError::OutOfReach);
        }
        let rotation = Rotation::from_sines(
            sin_cos_near(pose.yaw),
            sin_cos_near(pose.pitch),
            sin_cos_near(pose.roll),
        );
        let [first, second, _] = rotation.columns();
        let (theta1, margin1) = self.legs[0].inverse(first)?;
        let (theta2, margin2) = self.legs[1].inverse(second)?;
        // θ3 = π/4 + atan((y − x)/(y + x)) of C1. Within the workspace both are 0.4 and more.
        let (x, y) = (first[0], first[1]);
        let third =
            small_ratio(y.saturating_sub(x), y.saturating_add(x)).ok_or(PoseError::OutOfReach)?;
        let turn = arctangent(third);
        let theta3 = Angle::FRAC_PI_4.to_q29() + ((turn >> 1) + (turn & 1));
        let joints = Joints([theta1, theta2, Angle::from_q29(theta3)]);
        Ok(Inverse {
            joints,
            rotation,
            margin: margin1.min(margin2),
        })
    }
}

impl Leg {
    /// Returns the crank's angle and the margin √D (Q30) for the platform's point C (Q30).
    #[inline(always)]
    fn inverse(&self, point: &Vector) -> Result<(Angle, i32), PoseError> {
        // E cos θ + F sin θ = G, all over 2ρ. |E| ≤ 1.1, |F| ≤ 2.1, |G| ≤ 3.4: within Q29.
        let e = ((point[1] + 1) >> 1) - self.center[0];
        let f = ((point[2] + 1) >> 1) - self.center[1];
        let g = self.offset - round_shift::<30>(dot(point, &self.slope));
        let (e64, f64, g64) = (i64::from(e), i64::from(f), i64::from(g));
        // D = E² + F² − G², Q58 to Q30; each square is below 2⁶².
        let square = (e64 * e64 + f64 * f64 - g64 * g64 + (1 << 27)) >> 28;
        if square < LEAST_SQUARE {
            return Err(if square < 0 {
                PoseError::OutOfReach
            } else {
                PoseError::Singular
            });
        }
        let margin = root_q30(square.min(i64::from(u32::MAX)) as u32);
        // tan(θ/2) = (G − E)/(F + √D): the home working mode by construction.
        let below = f + ((margin >> 1) + (margin & 1));
        let half = small_ratio(g.saturating_sub(e), below).ok_or(PoseError::OutOfReach)?;
        // The arctangent in Q30, read in Q29, is twice itself.
        Ok((Angle::from_q29(arctangent(half)) - self.zero, margin))
    }
}

/// Returns `number / divisor` in Q31 where it is within the arctangent's ±0.625.
#[inline(always)]
fn small_ratio(number: i32, divisor: i32) -> Option<i32> {
    if number.saturating_abs() >= (divisor >> 1) + (divisor >> 3) {
        return None;
    }
    Some(divide_q31(number, divisor))
}
