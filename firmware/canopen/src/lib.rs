//! A CiA 301 node without a clock or a bus of its own.
//!
//! Frames and the time go in, frames and events come out; many nodes live in one process. What a
//! node serves beyond the communication area (0x1000–0x1FFF) is an [`Application`].
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]

mod application;
mod cob_id;
mod communication;
mod config;
mod emergency;
mod event;
mod frame;
mod heartbeat;
mod nmt;
mod node;
mod objects;
mod pdo;
mod sdo;
mod sync;
mod transmit;

pub use application::{Abort, Access, Application, Entry};
pub use config::{Config, Identity, Mapped, PDOS, PdoDefault};
pub use emergency::{REGISTER_COMMUNICATION, REGISTER_GENERIC};
pub use event::Event;
pub use frame::{Frame, Id};
pub use nmt::{NmtCommand, NmtState};
pub use node::{Counters, Node};
pub use sdo::SDO_BUFFER;
