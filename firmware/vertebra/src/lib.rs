//! One vertebra without a clock, a bus or a motor of its own.
//!
//! Frames and samples go in with the time, drives and frames come out. The same crate runs on the
//! board, in QEMU and in the simulator, and gives the same bits.
//!
//! A turn of the control tick goes: frames to the node ([`eel_canopen`]), which hands process data
//! to the core at SYNC; the sample, in the senses of the cranks, to the encoders, the direct kinematics and the checks; the
//! states; the impedance that pulls the pose to a spline through the targets; the torque sharing
//! within the bounds of each motor; the duties of the bridges. What is deliberately absent: the
//! clock, the bus, the bridges, and the current loop that a board closes faster than the tick.
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]

#[cfg(test)]
extern crate std;

mod calibration;
mod command;
mod core;
mod current;
mod discipline;
mod encoder;
mod events;
mod following;
mod freezing;
mod friction;
mod impedance;
mod io;
mod keepsake;
mod limits;
pub mod lockstep;
mod machine;
mod objects;
mod pending;
mod procedure;
mod protection;
mod pushing;
mod records;
mod served;
mod settings;
mod sharing;
mod spare;
mod spline;
pub mod store;
mod storing;
mod thermal;
mod vertebra;
mod workspace;

pub use calibration::{Calibration, Sense, Senses};
pub use command::TARGET_TIMEOUT;
pub use current::{CURRENT_LOOP_HZ, CurrentLoop, Switching};
pub use discipline::SYNC_AGE;
pub use eel_canopen::Identifiers;
pub use events::Event;
pub use io::{Drive, Sample, Setpoint};
pub use keepsake::{KEEPSAKE_BYTES, Keepsake};
pub use machine::{STOP_BRAKE, STOP_DAMPED};
pub use procedure::Hands;
pub use settings::{Friction, Gains, Limits, Motor, Ramp, Settings, ThermalData, Travel};
pub use vertebra::{Vertebra, turn};
