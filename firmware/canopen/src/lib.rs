//! A CiA 301 node without a clock or a bus of its own.
//!
//! Frames and the time go in, frames and events come out; many nodes live in one process. What a
//! node serves beyond the communication area (0x1000–0x1FFF) is an [`Application`].
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]

mod application;
mod frame;

pub use application::{Abort, Access, Application, Entry};
pub use frame::{Frame, Id};
