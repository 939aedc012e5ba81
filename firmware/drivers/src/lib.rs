//! Drivers of a vertebra's bridges and sensors over embedded-hal.
//!
//! They hold no timing and no state of the vertebra; a board gives them its pins and timers.
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]

#[cfg(test)]
extern crate std;

mod backoff;
mod bridge;
mod counter;
mod encoder;
mod thermistor;

pub use backoff::Backoff;
pub use bridge::{Bridge, BridgeError, Output};
pub use counter::WideCounter;
pub use encoder::{AbsoluteEncoder, EncoderError};
pub use thermistor::thermistor;
