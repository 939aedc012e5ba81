//! One vertebra without a clock, a bus or a motor of its own.
//!
//! Frames and samples go in with the time, drives and frames come out. The same crate runs on the
//! board, in QEMU and in the simulator, and gives the same bits.
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]

mod io;

pub use io::{Drive, Sample};
