//! What the head commands and what the motors do: poses, joints, and why a pose is refused.

use eel_units::{Angle, AngularVelocity, round_shift_saturating};

use crate::vector::{dot, times};

/// The anatomical angles of a vertebra: R = Rx(yaw) Ry(pitch) Rz(roll) Rz(π/4).
///
/// The paper's range is yaw ±30°, pitch ±15°, roll ±4°. Home is all zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pose {
    /// Lateral bending, the swimming motion, about the base's x.
    pub yaw: Angle,
    /// Dorsoventral bending, the diving motion, about the yawed y.
    pub pitch: Angle,
    /// Torsion, about the yawed and pitched z.
    pub roll: Angle,
}

/// The angles of the three motors; home is (0, 0, π/4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Joints(pub [Angle; 3]);

/// Why there is no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseError {
    /// No configuration reaches the pose (or joins the joints), or it lies beyond the range of the
    /// kernel (see [`crate::Wrist`]).
    OutOfReach,
    /// The configuration exists but lies too near a singularity to be trusted.
    Singular,
}

impl Pose {
    /// Home: the platform straight.
    pub const HOME: Self = Self {
        yaw: Angle::ZERO,
        pitch: Angle::ZERO,
        roll: Angle::ZERO,
    };

    /// Makes a pose of yaw, pitch and roll.
    pub const fn from_angles([yaw, pitch, roll]: [Angle; 3]) -> Self {
        Self { yaw, pitch, roll }
    }

    /// Returns yaw, pitch and roll.
    pub const fn angles(&self) -> [Angle; 3] {
        [self.yaw, self.pitch, self.roll]
    }

    /// Returns the platform's angular velocity in the base frame for (yaw', pitch', roll').
    ///
    /// ω = yaw' eₓ + pitch' Rx e_y + roll' Rx Ry e_z; wrong by at most 5 parts in 10⁹ of the rates
    /// and a step; a component beyond ±128 rad/s saturates.
    pub fn angular_velocity(&self, rates: [AngularVelocity; 3]) -> [AngularVelocity; 3] {
        let (sy, cy) = self.yaw.sin_cos();
        let (sp, cp) = self.pitch.sin_cos();
        let rates = rates.map(AngularVelocity::to_q24);
        let rows = [
            [1 << 30, 0, sp],
            [0, cy, times(sy, cp).wrapping_neg()],
            [0, sy, times(cy, cp)],
        ];
        rows.map(|row| AngularVelocity::from_q24(round_shift_saturating::<30>(dot(&row, &rates))))
    }
}

impl Joints {
    /// The motors' angles at home.
    pub const HOME: Self = Self([Angle::ZERO, Angle::ZERO, Angle::FRAC_PI_4]);
}

impl Default for Joints {
    fn default() -> Self {
        Self::HOME
    }
}
