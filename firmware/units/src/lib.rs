//! Quantities of the control path in fixed point, and the arithmetic they need.
//!
//! A quantity is a type; its raw integer is reachable only by a name that carries the unit. Every
//! operator saturates: an overload ends at the end of the range, never on the other side of it.
//! The functions state their error, and the tests hold them to it.
//! What is deliberately absent: floats, clocks, and quantities that no firmware crate uses.
//!
//! `unsafe` is denied, not forbidden, for `machine.rs`: two multiply and two divide
//! instructions, and a table whose place is hidden from the compiler.
#![no_std]
#![deny(unsafe_code)]
#![deny(clippy::float_arithmetic)]

mod arithmetic;
#[rustfmt::skip]
mod coefficients;
mod machine;
mod quantity;
mod time;
mod trigonometry;

#[doc(hidden)]
pub use arithmetic::{ROOT_SLOPE_Q16, ROOT_START_Q15};
pub use arithmetic::{
    quotient_q30, ratio_q30, root_near, root_q30, round_shift, round_shift_saturating, saturate,
};
pub use machine::{multiply_high, multiply_high_add};
pub use quantity::{Angle, AngularVelocity, Current, Duty, Temperature, Torque, Voltage};
pub use time::{Duration, Instant};
pub use trigonometry::{
    angle_over_sine, arctangents, arctangents_of, quadruple_square, sin_cos_near,
};
