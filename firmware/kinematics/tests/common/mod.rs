//! What the tests share: a seeded generator, conversions, the paper's workspace.
#![allow(dead_code, reason = "each test file uses its part")]

use eel_kinematics::design::{self, Geometry, Matrix3, Vector3};
use eel_kinematics::{Joints, Pose, Rotation};
use eel_units::{Angle, AngularVelocity, Torque};

pub const Q24: f64 = (1u64 << 24) as f64;
pub const Q29: f64 = (1u64 << 29) as f64;
pub const Q30: f64 = (1u64 << 30) as f64;

/// The paper's workspace: yaw ±30°, pitch ±15°, roll ±4°, in radians.
pub const WORKSPACE: [f64; 3] = [
    core::f64::consts::PI / 6.0,
    core::f64::consts::PI / 12.0,
    core::f64::consts::PI / 45.0,
];

/// The three mechanisms of the paper.
pub const ARCHITECTURES: [Geometry; 3] = [
    Geometry::PARALLEL_AXES,
    Geometry::ORTHOGONAL_AXES,
    Geometry::PARALLEL_ACTUATORS,
];

/// A seeded generator (xorshift64*); print the seed.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        println!("seed {seed:#x}");
        Self(seed)
    }

    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    pub fn bits(&mut self) -> i32 {
        (self.next() >> 32) as i32
    }

    /// A number in −1..1.
    pub fn sign(&mut self) -> f64 {
        f64::from(self.bits()) / 2_147_483_648.0
    }

    /// A pose in the workspace scaled by `scale`; every eighth coordinate at its end.
    pub fn pose(&mut self, scale: f64) -> [f64; 3] {
        WORKSPACE.map(|limit| {
            let share = if self.next().is_multiple_of(8) {
                self.sign().signum()
            } else {
                self.sign()
            };
            limit * scale * share
        })
    }

    pub fn vector(&mut self, size: f64) -> [f64; 3] {
        [0; 3].map(|_| self.sign() * size)
    }
}

/// A unit whose every length and zero is off by up to 2 %, half of them by all of it.
pub fn within_tolerance(random: &mut Random) -> Geometry {
    let mut geometry = Geometry::PARALLEL_ACTUATORS;
    let mut part = || {
        let part = random.sign();
        0.02 * if random.next().is_multiple_of(2) {
            part.signum()
        } else {
            part
        }
    };
    for leg in &mut geometry.legs {
        for k in 0..3 {
            leg.center[k] += part();
        }
        leg.crank *= 1.0 + part();
        leg.rod *= 1.0 + part();
        let zero = part();
        leg.zero = Vector3::new(0.0, zero.cos(), zero.sin());
    }
    geometry
}

pub fn angle(radians: f64) -> Angle {
    Angle::from_q29((radians * Q29).round() as i32)
}

pub fn radians(angle: Angle) -> f64 {
    f64::from(angle.to_q29()) / Q29
}

pub fn pose_of(angles: [f64; 3]) -> Pose {
    let [yaw, pitch, roll] = angles.map(angle);
    Pose { yaw, pitch, roll }
}

/// The exact orientation of a fixed-point pose.
pub fn exact_rotation(pose: &Pose) -> Matrix3<f64> {
    design::rotation(radians(pose.yaw), radians(pose.pitch), radians(pose.roll))
}

pub fn exact_joints(joints: &Joints) -> [f64; 3] {
    joints.0.map(radians)
}

pub fn matrix(rotation: &Rotation) -> Matrix3<f64> {
    let columns = rotation.columns();
    Matrix3::from_fn(|row, column| f64::from(columns[column][row]) / Q30)
}

/// The angle between two orientations, for small ones.
pub fn angle_between(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    let mut twice = Vector3::zeros();
    for k in 0..3 {
        twice += a.column(k).cross(&b.column(k));
    }
    twice.norm() / 2.0
}

pub fn torque(newton_metres: f64) -> Torque {
    Torque::from_q24((newton_metres * Q24).round() as i32)
}

pub fn newton_metres(torque: Torque) -> f64 {
    f64::from(torque.to_q24()) / Q24
}

pub fn rate(radians_per_second: f64) -> AngularVelocity {
    AngularVelocity::from_q24((radians_per_second * Q24).round() as i32)
}

pub fn rate_of(rate: AngularVelocity) -> f64 {
    f64::from(rate.to_q24()) / Q24
}
