//! CAN buses as the host sees them: SocketCAN, candump files, memory.
//!
//! One [`Bus`] trait and one URL syntax ([`open`]) for all of them, the text format of can-utils'
//! candump ([`candump`]) and the exact length of a frame on the wire ([`frame_bits`]).
#![forbid(unsafe_code)]

mod bits;
mod bus;
pub mod candump;
mod error;
mod file;
mod interfaces;
mod memory;
#[cfg(target_os = "linux")]
mod socket;

pub use bits::{INTERFRAME_BITS, TAIL_BITS, frame_bits, frame_bits_max, frame_bits_max_extended};
pub use bus::{Bus, Content, ErrorFrame, Received, open};
pub use error::BusError;
pub use file::FileBus;
pub use interfaces::{Interface, interfaces};
pub use memory::{MemoryBus, pair};
#[cfg(target_os = "linux")]
pub use socket::SocketBus;
