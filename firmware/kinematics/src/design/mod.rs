//! The general model of the wrist in double precision: all three architectures of the paper.
//!
//! For design work, for the simulator's transmission, for tests, and for the making of a kernel from
//! a unit's measured geometry. Only `libm`'s functions, so that every machine gives the same bits.
//! [`Geometry`] holds lengths, scale and travel; all inverse and direct solutions have names
//! ([`WorkingMode`], [`AssemblyMode`]); [`Jacobians`] holds the maps of rates and torques and how evenly
//! they work; [`Margins`] says how far each singularity is. Angles are in radians and, like margins and
//! condition numbers, do not depend on the scale.

mod closed;
mod condition;
mod geometry;
mod jacobians;
pub(crate) mod kernel;
mod margins;
mod modes;
mod travel;

pub use condition::{GlobalIsotropy, condition, singular_values};
pub use geometry::{Geometry, Leg};
pub use jacobians::Jacobians;
pub use margins::Margins;
pub use modes::{AssemblyMode, WorkingMode};
pub use nalgebra::{Matrix3, Vector3};
pub use travel::{Coordinate, Limit, Range, Travel};

use libm::{asin, atan2, cos, sin};

/// Returns R = Rx(yaw) Ry(pitch) Rz(roll) Rz(π/4), angles in radians.
pub fn rotation(yaw: f64, pitch: f64, roll: f64) -> Matrix3<f64> {
    let quarter = core::f64::consts::FRAC_PI_4;
    about_x(yaw) * about_y(pitch) * about_z(roll + quarter)
}

/// Returns (yaw, pitch, roll) in radians of an orientation, pitch within ±π/2.
pub fn pose(rotation: &Matrix3<f64>) -> [f64; 3] {
    let r = rotation;
    let yaw = atan2(-r[(1, 2)], r[(2, 2)]);
    let pitch = asin(r[(0, 2)].clamp(-1.0, 1.0));
    let roll = atan2(-r[(0, 1)] - r[(0, 0)], r[(0, 0)] - r[(0, 1)]);
    [yaw, pitch, roll]
}

/// Returns the paper's R = Rz(θ3) Ry(φ) Rx(ψ), angles in radians.
pub fn rotation_from_platform(theta3: f64, phi: f64, psi: f64) -> Matrix3<f64> {
    about_z(theta3) * about_y(phi) * about_x(psi)
}

/// Returns the paper's (θ3, φ, ψ) in radians of an orientation, φ within ±π/2.
pub fn platform(rotation: &Matrix3<f64>) -> [f64; 3] {
    let r = rotation;
    let theta3 = atan2(r[(1, 0)], r[(0, 0)]);
    let phi = asin((-r[(2, 0)]).clamp(-1.0, 1.0));
    let psi = atan2(r[(2, 1)], r[(2, 2)]);
    [theta3, phi, psi]
}

fn about_x(angle: f64) -> Matrix3<f64> {
    let (s, c) = (sin(angle), cos(angle));
    Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)
}

fn about_y(angle: f64) -> Matrix3<f64> {
    let (s, c) = (sin(angle), cos(angle));
    Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
}

fn about_z(angle: f64) -> Matrix3<f64> {
    let (s, c) = (sin(angle), cos(angle));
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}
