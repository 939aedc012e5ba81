//! Quantities of the control path in fixed point, and the arithmetic they need.
//!
//! A quantity is a type; its raw integer is reachable only by a name that carries the unit. Every
//! operator saturates: an overload ends at the end of the range, never on the other side of it.
//! What is deliberately absent: floats, clocks, and quantities that no firmware crate uses.
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]

mod quantity;
mod time;

pub use quantity::{Angle, AngularVelocity, Current, Duty, Temperature, Torque, Voltage};
pub use time::{Duration, Instant};
