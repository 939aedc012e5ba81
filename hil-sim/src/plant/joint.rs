//! What acts at a joint besides its motors: hard stops, and an ideal drive for reference runs.

use super::algebra::{Mat3, Quat, Vec3, pose_of, pose_rate_matrix};
use super::chain::Load;
use super::config::Config;

/// The hard stops of a joint: springs and dampers on yaw, pitch and roll.
#[derive(Clone, Debug)]
pub struct Stops {
    limits_rad: [f64; 3],
    /// Tangent of yaw, sine of pitch and tangent of roll at the stops.
    slopes: [f64; 3],
    stiffness: f64,
    damping: f64,
}

/// Where an ideal drive holds a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Target {
    /// Yaw, pitch, roll, rad.
    pub pose: [f64; 3],
    /// Rates of the three, rad/s.
    pub rates: [f64; 3],
}

/// An ideal drive: a spring and a damper to the target, taken at the end of the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracking {
    /// Stiffness, N·m/rad.
    pub stiffness: f64,
    /// Damping, N·m·s/rad.
    pub damping: f64,
    /// Rotor inertia about every axis, kg·m².
    pub inertia: f64,
}

/// The line on which an ideal drive's moment moves within a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pull {
    moment: Vec3,
    slope: f64,
    inertia: f64,
    rate: Vec3,
}

impl Stops {
    /// Takes the stops of a configuration.
    pub fn new(config: &Config) -> Self {
        let [yaw, pitch, roll] = config.stops_rad;
        Self {
            limits_rad: config.stops_rad,
            slopes: [libm::tan(yaw), libm::sin(pitch), libm::tan(roll)],
            stiffness: config.stop_stiffness,
            damping: config.stop_damping,
        }
    }

    /// Adds the stops that a joint touches to its load.
    #[inline(always)]
    pub fn add(&self, load: &mut Load, rotation: &Mat3, rate: Vec3, step: f64) {
        if !self.clear(rotation) {
            self.push(load, rotation, rate, step);
        }
    }

    /// Returns whether a joint is inside all its stops, without a trigonometric call.
    #[inline(always)]
    fn clear(&self, rotation: &Mat3) -> bool {
        let [[r00, r01, r02], [_, _, r12], [_, _, r22]] = rotation.0;
        let [yaw, pitch, roll] = self.slopes;
        r12.abs() <= yaw * r22 && r02.abs() <= pitch && r01.abs() <= roll * r00
    }

    /// Adds spring and damper at the end of the step, so that they may be stiff.
    #[inline(never)]
    fn push(&self, load: &mut Load, rotation: &Mat3, rate: Vec3, step: f64) {
        let (pose, to_rates) = (pose_of(rotation), pose_rate_matrix(rotation));
        let rates = to_rates * rate;
        let (mut torques, mut shares) = ([0.0; 3], [0.0; 3]);
        for i in 0..3 {
            let excess = pose[i].abs() - self.limits_rad[i];
            if excess > 0.0 {
                let slope = self.damping + step * self.stiffness;
                let push = self.stiffness * excess;
                torques[i] = -push.copysign(pose[i]) - slope * rates.0[i];
                shares[i] = step * slope;
            }
        }
        load.moment += to_rates.transpose_mul(Vec3(torques));
        load.implicit += to_rates.gram(Vec3(shares));
    }
}

impl Default for Tracking {
    fn default() -> Self {
        Self {
            stiffness: 2000.0,
            damping: 40.0,
            inertia: 2.03e-3,
        }
    }
}

impl Tracking {
    /// Returns the pull towards a target and what it does in the coming step.
    pub fn load(&self, target: &Target, rotation: &Mat3, rate: Vec3, step: f64) -> (Pull, Load) {
        let wanted = Quat::from_pose(target.pose).matrix();
        // R = R_target · exp(e): the skew part of R_targetᵀ R is e for small errors.
        let error = wanted.transpose() * *rotation;
        let [[_, e01, e02], [e10, _, e12], [e20, e21, _]] = error.0;
        let e = Vec3::new(e21 - e12, e02 - e20, e10 - e01) * 0.5;
        let to_velocity = velocity_matrix(&wanted, target.pose[2]);
        let slope = self.damping + step * self.stiffness;
        let pull = Pull {
            moment: -e * self.stiffness,
            slope,
            inertia: self.inertia,
            rate: to_velocity * Vec3(target.rates),
        };
        let share = self.inertia + step * slope;
        let load = Load {
            moment: pull.moment - (rate - pull.rate) * slope,
            implicit: Mat3::diagonal(share, share, share),
        };
        (pull, load)
    }
}

impl Pull {
    /// Returns the moment passed to the bodies once the step is done, N·m.
    pub fn settle(&self, rate: Vec3, acceleration: Vec3) -> Vec3 {
        self.moment - (rate - self.rate) * self.slope - acceleration * self.inertia
    }
}

/// Returns the matrix from the rates of yaw, pitch and roll to the angular velocity in the
/// tail-side frame.
fn velocity_matrix(rotation: &Mat3, roll: f64) -> Mat3 {
    let (sin, cos) = (libm::sin(roll), libm::cos(roll));
    let [x, y, z] = rotation.0[0];
    Mat3([[x, sin, 0.0], [y, cos, 0.0], [z, 0.0, 1.0]])
}
