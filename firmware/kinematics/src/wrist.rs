//! The constants of one unit's kernel.

use eel_units::Angle;

/// One crank-and-rod leg of the kernel, scaled so that the platform's arm is 1.
///
/// With C the platform's point, A the crank's centre, ρ the crank, s the rod, and the crank's end
/// B = A + ρ(0, cos θ, sin θ), the closed forms need only these seven numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leg {
    /// A's y and z, Q29.
    pub center: [i32; 2],
    /// A / ρ, Q29.
    pub slope: [i32; 3],
    /// (1 + A·A + ρ² − s²) / 2ρ, Q29.
    pub offset: i32,
    /// The geometric crank angle at which the motor reads zero.
    pub zero: Angle,
}

/// The kernel of one wrist: a unit's geometry as fixed-point constants.
///
/// The architecture is the prototype's, with parallel actuators; the parts may differ from the
/// paper's ideal by ±2 % ([`crate::design::Geometry::kernel`] makes the constants and keeps that
/// limit). The range of the kernel is every pose whose angles are within ±1.125 rad, whose crank
/// angles are within ±1.117 rad, the third motor's within as much of its home, and whose margins are
/// not too small: twice the paper's yaw, and more than the mechanism allows in pitch and roll with it
/// (a leg lines up where the corners of the paper's workspace are scaled by 1.26).
///
/// Margins are 1 at home on the ideal geometry and 0 at the singularity. The serial one is the
/// lesser √D of the two legs; an answer is refused below ¼ (inverse) or ⅛ (direct), where the
/// workspace has at least 0.57 on the ideal geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wrist {
    pub(crate) legs: [Leg; 2],
    /// ρ1 ρ2, Q30, which turns the margins of the two legs into det A.
    pub(crate) cranks: i32,
}

impl Wrist {
    /// The paper's ideal geometry: crank centres (±√½, 0, −1), cranks √½, rods 1, zeros 0.
    pub const PAPER: Self = Self {
        legs: [
            Leg {
                center: [0, -536_870_912],
                slope: [536_870_912, 0, -759_250_125],
                offset: 759_250_125,
                zero: Angle::ZERO,
            },
            Leg {
                center: [0, -536_870_912],
                slope: [-536_870_912, 0, -759_250_125],
                offset: 759_250_125,
                zero: Angle::ZERO,
            },
        ],
        cranks: 536_870_912,
    };
}

impl Default for Wrist {
    fn default() -> Self {
        Self::PAPER
    }
}
