//! The moment that pulls the wrist to its reference: M = K e + D (ω_ref − ω) + M_ff.

use eel_kinematics::{Direct, Pose, Rotation};
use eel_units::{Angle, AngularVelocity, Torque, saturate};

use crate::settings::Gains;

/// Gains as the tick uses them, Q16 N·m/rad and N·m·s/rad.
#[derive(Clone, Copy, Debug)]
pub struct Impedance {
    stiffness: [i64; 3],
    damping: [i64; 3],
}

/// What the wrist does now, in the base frame.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Its kinematics.
    pub direct: Direct,
    /// Its angular velocity.
    pub omega: [AngularVelocity; 3],
}

/// Feed-forward from the head.
#[derive(Clone, Copy, Debug)]
pub struct FeedForward {
    /// Moment to add.
    pub moment: [Torque; 3],
    /// Scale of the stiffness in 2⁻¹⁵.
    pub stiffness: u16,
}

impl FeedForward {
    /// Adds nothing and leaves the stiffness as it is set.
    pub const NEUTRAL: Self = Self {
        moment: [Torque::ZERO; 3],
        stiffness: 1 << 15,
    };
}

impl Impedance {
    /// Prepares gains.
    pub fn new(gains: &Gains) -> Self {
        let prepare = |milli: u32| (i64::from(milli) << 16) / 1_000;
        Self {
            stiffness: gains.stiffness.map(prepare),
            damping: gains.damping.map(prepare),
        }
    }

    /// Returns the moment towards `pose` with the angular velocity `omega`, and the rotation vector that
    /// leads there.
    pub fn moment(
        &self,
        motion: &Motion,
        pose: &Pose,
        omega: [AngularVelocity; 3],
        feed: &FeedForward,
    ) -> ([Torque; 3], [Angle; 3]) {
        let target = Rotation::from_pose(pose);
        let error = motion.direct.rotation.error_to(&target);
        let scale = i64::from(feed.stiffness);
        let spring = product(self.stiffness, error.map(Angle::to_q29), |torque| {
            // Q16 × Q29 is Q45; the torque is Q24. The scale is Q15.
            ((torque >> 21) * scale) >> 15
        });
        let damper = self.damper(omega, motion.omega);
        let [s, d, f] = [spring, damper, feed.moment];
        (
            [s[0] + d[0] + f[0], s[1] + d[1] + f[1], s[2] + d[2] + f[2]],
            error,
        )
    }

    /// Returns the moment that brings the motion to rest.
    pub fn damping(&self, motion: &Motion) -> [Torque; 3] {
        self.damper([AngularVelocity::ZERO; 3], motion.omega)
    }

    fn damper(&self, wanted: [AngularVelocity; 3], measured: [AngularVelocity; 3]) -> [Torque; 3] {
        let [w, m] = [wanted, measured];
        let slip = [w[0] - m[0], w[1] - m[1], w[2] - m[2]];
        product(self.damping, slip.map(AngularVelocity::to_q24), |torque| {
            torque >> 16
        })
    }
}

/// Multiplies gains and deviations axis by axis and brings the products to Q24 N·m.
fn product(gains: [i64; 3], values: [i32; 3], scale: impl Fn(i64) -> i64) -> [Torque; 3] {
    let axis = |gain: i64, value: i32| {
        Torque::from_q24(saturate(scale(gain.saturating_mul(i64::from(value)))))
    };
    [
        axis(gains[0], values[0]),
        axis(gains[1], values[1]),
        axis(gains[2], values[2]),
    ]
}
