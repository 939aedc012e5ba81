//! What a crank's friction takes, given along the motion of the reference.
//!
//! The reference's speed and not the measured one: the compensation then can't feed back, and a wrist
//! that is held stays as it is.

use eel_units::{AngularVelocity, Torque, saturate};

use crate::settings::Friction;

/// A friction, prepared for the tick.
#[derive(Clone, Copy, Debug)]
pub struct Compensation {
    coulomb: Torque,
    /// Coulomb torque per speed below the speed at which it is whole, Q16 N·m·s/rad.
    slope: i64,
    /// Q16 N·m·s/rad.
    viscous: i64,
}

impl Compensation {
    /// Prepares a friction.
    pub const fn new(friction: &Friction) -> Self {
        let speed = friction.speed.to_q24();
        let speed = if speed < 1 { 1 } else { speed } as i64;
        Self {
            coulomb: friction.coulomb,
            slope: ((friction.coulomb.to_q24() as i64) << 16) / speed,
            viscous: ((friction.viscous as i64) << 16) / 1_000,
        }
    }

    /// Returns the torque at a speed of the reference.
    pub fn torque(&self, speed: AngularVelocity) -> Torque {
        let speed = i64::from(speed.to_q24());
        let part = |slope: i64| Torque::from_q24(saturate(speed.saturating_mul(slope) >> 16));
        part(self.slope).bounded(-self.coulomb, self.coulomb) + part(self.viscous)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Motor;

    #[test]
    fn is_coulomb_and_viscous_friction_with_a_slope_about_rest() {
        let Friction {
            coulomb,
            viscous,
            speed,
        } = Motor::PROTOTYPE.friction;
        let exact = |omega: f64| {
            let whole = f64::from(speed.to_q24()) / f64::from(1 << 24);
            let coulomb = f64::from(coulomb.to_millinewton_metres()) / 1e3;
            coulomb * (omega / whole).clamp(-1.0, 1.0) + f64::from(viscous) / 1e3 * omega
        };
        let compensation = Compensation::new(&Motor::PROTOTYPE.friction);
        for milli in [-20_000, -500, -51, -50, -49, -1, 0, 1, 25, 50, 700, 9_000] {
            let omega = AngularVelocity::from_milliradians_per_second(milli);
            let torque = f64::from(compensation.torque(omega).to_q24()) / f64::from(1 << 24);
            let error = torque - exact(f64::from(milli) / 1e3);
            assert!(
                error.abs() < 2e-5 + 2e-8 * f64::from(milli).abs(),
                "{torque} at {milli} mrad/s"
            );
        }
    }

    #[test]
    fn any_speed_and_friction_has_a_torque() {
        for raw in [i32::MIN, -1, 0, 1, i32::MAX] {
            let friction = Friction {
                coulomb: Torque::from_q24(raw),
                viscous: u32::MAX,
                speed: AngularVelocity::from_q24(raw),
            };
            for speed in [i32::MIN, 0, i32::MAX] {
                Compensation::new(&friction).torque(AngularVelocity::from_q24(speed));
            }
        }
    }
}
