//! The vertebra on the wire: identifiers, frames, object dictionary, fault catalogue.
//!
//! A number on the wire is written here and nowhere else. EDS, DBC and the tables of the
//! documentation are generated from this crate.
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]

#[cfg(test)]
extern crate std;

pub mod communication;
mod crc;
pub mod dictionary;
pub mod eds;
pub mod emergency;
pub mod export;
mod frames;
pub mod freeze;
pub mod identity;
mod ids;
pub mod messages;
pub mod pdo;
pub mod procedure;
pub mod scope;
mod states;
mod status;

pub use crc::{Crc32, crc8, protection};
pub use eel_canopen::{Frame, Id};
pub use frames::{Counter, Effort, Flags, FrameError, Moment, PoseReport, Target};
pub use ids::{
    Cob, ERROR_BEHAVIOUR, HEAD_HEARTBEAT_MS, HEAD_HEARTBEAT_TIMEOUT_MS, HEAD_NODE, NodeId,
    SYNC_COUNTER_OVERFLOW, SYNC_PERIOD_US, VERTEBRA_HEARTBEAT_MS, VERTEBRAE,
};
pub use states::{LimitCode, Mode, State};
pub use status::{Condition, Status};
