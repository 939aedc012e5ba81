//! The spherical parallel wrist of a vertebra: inverse, direct, Jacobian, torque sharing.
//!
//! Source: D. Chablat, P. Wenger, "Design of a Spherical Wrist with Parallel Architecture:
//! Application to Vertebrae of an Eel Robot". Two crank-and-rod legs and a serial third leg turn
//! the platform about one point. [`Wrist`] is the firmware's kernel, in integers, for the
//! architecture with parallel actuators: it holds the constants of one unit and answers in closed
//! form, without iteration. [`design`] is the general model in double precision, for the simulator,
//! the tests, and the making of a kernel from a unit's measured geometry.
//!
//! Base frame: z along the body, x dorsoventral, y lateral. A pose is
//! R = Rx(yaw) Ry(pitch) Rz(roll) Rz(π/4). Moments and angular velocities are in the base frame.
//!
//! Deliberately absent: state, time, and floats outside [`design`].
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]

#[expect(
    clippy::float_arithmetic,
    reason = "the general model; never on the control path"
)]
pub mod design;
mod direct;
mod inverse;
mod jacobian;
mod pose;
mod reach;
mod rotation;
mod share;
mod vector;
mod wrist;

pub use direct::Direct;
pub use inverse::Inverse;
pub use jacobian::Jacobian;
pub use pose::{Joints, Pose, PoseError};
pub use reach::{Nearest, Obstacle, Reach, Search};
pub use rotation::Rotation;
pub use share::{Bounds, Policy, Shared, Side};
pub use wrist::Wrist;
