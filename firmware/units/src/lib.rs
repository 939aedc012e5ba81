//! Quantities of the control path in fixed point, and the arithmetic they need.
//!
//! A quantity is a type; its raw integer is reachable only by a name that carries the unit. Every
//! operator saturates: an overload ends at the end of the range, never on the other side of it.
//! The functions state their error, and the tests hold them to it.
//! What is deliberately absent: floats, clocks, and quantities that no firmware crate uses.
//!
//! `unsafe` is denied, not forbidden, for two multiply instructions in `multiply.rs`.
#![no_std]
#![deny(unsafe_code)]
#![deny(clippy::float_arithmetic)]

mod arithmetic;
#[rustfmt::skip]
mod coefficients;
mod multiply;
mod quantity;
mod time;
mod trigonometry;

pub use arithmetic::{
    Reciprocal, divide_q31, invert_normal, root_q30, round_shift, round_shift_saturating, saturate,
    shift_left_high,
};
pub use multiply::{multiply_high, multiply_high_add};
pub use quantity::{Angle, AngularVelocity, Current, Duty, Temperature, Torque, Voltage};
pub use time::{Duration, Instant};
pub use trigonometry::{SIN_COS_NEAR, angle_over_sine, arctangent, sin_cos_near};
