//! From motors to a joint: motor angles and the exact matrix of their rates.
//!
//! The wrist is eel-kinematics' general model in f64, never the firmware's own kernel: a wrong
//! kernel shows up as wrong swimming.

use eel_kinematics::design::{Geometry, Matrix3};

use super::algebra::{Mat3, Vec3, pose_of, pose_rate_matrix};

/// How three motors move a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "one for the whole plant, among its settings"
)]
pub enum Transmission {
    /// The spherical parallel wrist, with the geometry of the unit.
    Wrist(Geometry),
    /// Each motor turns one angle of the pose: yaw, pitch, roll. For tests of the plant alone.
    Direct,
}

/// A transmission at one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Motor angles, rad.
    pub angles: [f64; 3],
    /// Motor rates for the joint's rates in the tail-side frame; moments go by its transpose.
    pub rates: Mat3,
}

impl Transmission {
    /// Returns the link at a joint's rotation; `None` where the motors cannot reach it or one
    /// moves without turning the joint.
    pub fn link(&self, rotation: &Mat3) -> Option<Link> {
        match self {
            Self::Wrist(geometry) => wrist_link(geometry, rotation),
            Self::Direct => Some(Link {
                angles: pose_of(rotation),
                rates: pose_rate_matrix(rotation),
            }),
        }
    }

    /// Returns the motor angles at a joint's rotation; `None` where they cannot reach it.
    pub fn angles(&self, rotation: &Mat3) -> Option<[f64; 3]> {
        match self {
            Self::Wrist(geometry) => geometry.inverse(&platform(rotation)),
            Self::Direct => Some(pose_of(rotation)),
        }
    }
}

/// Returns the wrist's link: θ̇ = B⁻¹ A ω with ω = R · rates, from the tail-side frame to the
/// wrist's base frame.
fn wrist_link(geometry: &Geometry, rotation: &Mat3) -> Option<Link> {
    let platform = platform(rotation);
    let angles = geometry.inverse(&platform)?;
    let jacobians = geometry.jacobians(&platform, &angles);
    let mut rows = [[0.0; 3]; 3];
    for (i, row) in rows.iter_mut().enumerate() {
        let margin = jacobians.b[i];
        if margin <= 0.0 {
            return None;
        }
        let a = &jacobians.a;
        *row = (Vec3::new(a[(i, 0)], a[(i, 1)], a[(i, 2)]) * (1.0 / margin)).0;
    }
    Some(Link {
        angles,
        rates: Mat3(rows) * *rotation,
    })
}

/// Returns the wrist's platform orientation R · Rz(π/4) at a joint's rotation R.
fn platform(rotation: &Mat3) -> Matrix3<f64> {
    const HALF_ROOT: f64 = std::f64::consts::FRAC_1_SQRT_2;
    let [[a, b, c], [d, e, f], [g, h, i]] = rotation.0;
    let turn = |x: f64, y: f64| ((x + y) * HALF_ROOT, (y - x) * HALF_ROOT);
    let ((a, b), (d, e), (g, h)) = (turn(a, b), turn(d, e), turn(g, h));
    Matrix3::new(a, b, c, d, e, f, g, h, i)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::algebra::Quat;

    const WRIST: Transmission = Transmission::Wrist(Geometry::PARALLEL_ACTUATORS);

    #[test]
    fn motor_rates_agree_with_finite_differences_of_the_inverse() {
        for transmission in [WRIST, Transmission::Direct] {
            let joint = Quat::from_pose([0.45, -0.2, 0.06]);
            let rate = Vec3::new(0.8, -0.5, 0.3);
            let at = |h: f64| {
                let turned = joint.plus_scaled(joint.rate(rate), h).normalised();
                transmission.angles(&turned.matrix()).unwrap()
            };
            let link = transmission.link(&joint.matrix()).unwrap();
            let (after, before) = (at(1e-5), at(-1e-5));
            for (i, found) in (link.rates * rate).0.into_iter().enumerate() {
                let slope = (after[i] - before[i]) / 2e-5;
                assert!((found - slope).abs() < 1e-8, "motor {i}: {found} {slope}");
            }
        }
    }

    #[test]
    fn two_motors_share_a_yaw_moment_at_home() {
        // WRIST.md: M_x = τ1 + τ2, M_y = τ2 − τ1, M_z = τ3.
        let link = WRIST.link(&Mat3::IDENTITY).unwrap();
        let moment = link.rates.transpose_mul(Vec3::new(1.0, 2.0, 4.0));
        for (found, expected) in moment.0.into_iter().zip([3.0, 1.0, 4.0]) {
            assert!((found - expected).abs() < 1e-12, "{moment:?}");
        }
    }

    #[test]
    fn pure_yaw_turns_both_cranks_by_the_yaw() {
        let yaw = 0.4;
        let rotation = Quat::from_pose([yaw, 0.0, 0.0]).matrix();
        let angles = WRIST.angles(&rotation).unwrap();
        assert!((angles[0] - yaw).abs() < 1e-12 && (angles[1] - yaw).abs() < 1e-12);
        assert!((angles[2] - libm::atan(libm::cos(yaw))).abs() < 1e-12);
    }

    #[test]
    fn the_stops_lie_inside_the_reach_of_the_motors() {
        let stops = crate::plant::Config::default().stops_rad;
        for corner in 0..8 {
            let sign = |bit: i32| if corner & bit == 0 { 1.02 } else { -1.02 };
            let pose = [stops[0] * sign(1), stops[1] * sign(2), stops[2] * sign(4)];
            assert!(
                WRIST.link(&Quat::from_pose(pose).matrix()).is_some(),
                "{pose:?}"
            );
        }
    }
}
