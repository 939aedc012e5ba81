//! The constants of one unit's kernel.

use eel_units::Angle;

use crate::vector::Vector;

/// One crank-and-rod leg of the kernel, scaled so that the platform's arm is 1.
///
/// With C the platform's point, A the crank's centre, ρ the crank, s the rod, and the crank's end
/// B = A + ρ(0, cos θ, sin θ), the closed forms need only these numbers. Each is in the format in which
/// one instruction uses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leg {
    /// The geometric crank angle at which the motor reads zero.
    pub zero: Angle,
    /// For the inverse.
    pub pull: Pull,
    /// For the direct kinematics.
    pub push: Push,
}

/// A leg as the platform pulls its crank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pull {
    /// A's y and z over √2, Q30.
    pub center: [i32; 2],
    /// A / ρ, Q30.
    pub slope: Vector,
    /// (1 + A·A + ρ² − s²) / 2ρ over √2, Q30.
    pub offset: i32,
}

/// A leg as its crank pushes the platform.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Push {
    /// −A / ρ, Q29.
    pub back: Vector,
    /// (1 + A·A + ρ² − s²) / 2ρ, Q29.
    pub offset: i32,
    /// A's y, and 1 plus A's z, Q31: how far the centre is from (0, −1).
    pub shift: [i32; 2],
    /// A's y and z, Q29.
    pub center: [i32; 2],
}

/// The kernel of one wrist: a unit's geometry as fixed-point constants.
///
/// The architecture is the prototype's, with parallel actuators; the parts may differ from the
/// paper's ideal by ±2 % ([`crate::design::Geometry::kernel`] makes the constants and keeps that
/// limit). The range of the kernel is every pose within ±1 rad of yaw and ±½ rad of pitch and roll,
/// whose crank angles are within ±0.97 rad, the third motor's within ±½ rad of its home, and whose
/// margins are not too small: nearly twice the paper's yaw and pitch, and more than the mechanism allows
/// together (a leg lines up where the corners of the paper's workspace are scaled by 1.26).
///
/// Margins are 1 at home on the ideal geometry and 0 at the singularity, and vary continuously between.
/// The serial one is the lesser √D of the two legs; an answer is refused below ¼ (inverse) or ⅛ (direct),
/// where the workspace has at least 0.57 on the ideal geometry. The parallel one is det A.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wrist {
    pub(crate) legs: [Leg; 2],
    /// ρ1 ρ2, Q31, which turns the margins of the two legs into det A.
    pub(crate) cranks: i32,
}

impl Wrist {
    /// The paper's ideal geometry: crank centres (±√½, 0, −1), cranks √½, rods 1, zeros 0.
    pub const PAPER: Self = Self {
        legs: [Self::paper_leg(1), Self::paper_leg(-1)],
        cranks: 1 << 30,
    };

    const fn paper_leg(side: i32) -> Leg {
        Leg {
            zero: Angle::ZERO,
            pull: Pull {
                center: [0, -759_250_125],
                slope: [side << 30, 0, -1_518_500_250],
                offset: 1 << 30,
            },
            push: Push {
                back: [-side << 29, 0, 759_250_125],
                offset: 759_250_125,
                shift: [0, 0],
                center: [0, -1 << 29],
            },
        }
    }
}

impl Default for Wrist {
    fn default() -> Self {
        Self::PAPER
    }
}
