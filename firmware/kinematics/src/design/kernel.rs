//! Making of the firmware's kernel from a unit's geometry.

use core::f64::consts::FRAC_1_SQRT_2;

use eel_units::Angle;
use libm::{atan2, fabs, round};

use super::{Geometry, Leg};
use crate::wrist::{self, Pull, Push};

/// How far each length and zero may be from the paper's: 2 % of the platform's arm (or of itself).
/// A hair more, so that a part at exactly 2 % passes.
pub(crate) const TOLERANCE: f64 = 0.02 + 1e-12;

impl Geometry {
    /// Returns the kernel of a unit with parallel actuators, of whatever scale.
    ///
    /// Nothing where a crank axis isn't x, or where a crank's centre, a length or a zero differs
    /// from [`Geometry::PARALLEL_ACTUATORS`] by more than 2 % (of the arm, of itself, of a radian).
    pub fn kernel(&self) -> Option<wrist::Wrist> {
        let [ideal1, ideal2] = &Self::PARALLEL_ACTUATORS.legs;
        let [first, second] = &self.scaled(1.0)?.legs;
        let cranks = fixed(first.crank * second.crank, 31)?;
        Some(wrist::Wrist {
            legs: [first.kernel(ideal1)?, second.kernel(ideal2)?],
            cranks,
        })
    }
}

impl Leg {
    fn kernel(&self, ideal: &Self) -> Option<wrist::Leg> {
        let near = |value: f64, wanted: f64| fabs(value - wanted) <= TOLERANCE;
        let zero = atan2(self.zero[2], self.zero[1]);
        let straight = fabs(self.axis[0] - 1.0) <= 1e-12
            && fabs(self.axis[1]) + fabs(self.axis[2]) <= 1e-12
            && fabs(self.zero[0]) <= 1e-12
            && fabs(self.zero.norm_squared() - 1.0) <= 1e-12;
        let true_to_size = (0..3).all(|k| near(self.center[k], ideal.center[k]))
            && near(self.crank / ideal.crank, 1.0)
            && near(self.rod / ideal.rod, 1.0)
            && near(zero, 0.0);
        if !straight || !true_to_size {
            return None;
        }
        let slope = self.center / self.crank;
        let square = self.center.dot(&self.center) + self.crank * self.crank;
        let offset = (1.0 + square - self.rod * self.rod) / (2.0 * self.crank);
        let [_, y, z] = self.center.into();
        Some(wrist::Leg {
            zero: Angle::from_q29(fixed(zero, 29)?),
            pull: Pull {
                center: [fixed(y * FRAC_1_SQRT_2, 30)?, fixed(z * FRAC_1_SQRT_2, 30)?],
                slope: [
                    fixed(slope[0], 30)?,
                    fixed(slope[1], 30)?,
                    fixed(slope[2], 30)?,
                ],
                offset: fixed(offset * FRAC_1_SQRT_2, 30)?,
            },
            push: Push {
                back: [
                    fixed(-slope[0], 29)?,
                    fixed(-slope[1], 29)?,
                    fixed(-slope[2], 29)?,
                ],
                offset: fixed(offset, 29)?,
                shift: [fixed(y, 31)?, fixed(1.0 + z, 31)?],
                center: [fixed(y, 29)?, fixed(z, 29)?],
            },
        })
    }
}

/// Returns the number in a Q format, rounded to nearest; nothing where it does not fit.
fn fixed(value: f64, bits: u32) -> Option<i32> {
    let scaled = round(value * (1u64 << bits) as f64);
    if fabs(scaled) < 2_147_483_648.0 {
        Some(scaled as i32)
    } else {
        None
    }
}
