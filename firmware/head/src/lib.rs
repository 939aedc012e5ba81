//! The head's side of the bus: NMT master, SYNC producer, and the gait as target frames.
//!
//! Like a vertebra, the head has no clock and no bus of its own: frames and the time go in, frames
//! and events come out. It starts the nodes, watches them, leads each from where it is to where
//! the gait wants it, and stops them in order. What is deliberately absent: forces, the robot's
//! path, and any decision to acknowledge a latched stop while the robot moves.
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]

mod gait;
mod head;
mod node;
mod report;

pub use gait::{Gait, GaitError, Plane};
pub use head::{Config, Head, Phase, Task};
pub use node::{NodeStatus, Stage};
pub use report::Event;
