//! A CiA 301 node without a clock or a bus of its own.
//!
//! Frames and the time go in, frames and events come out; many nodes live in one process. What a
//! node serves beyond the communication area (0x1000–0x1FFF) is an [`Application`].
//!
//! ```
//! # use eel_canopen::*;
//! # struct Nothing;
//! # impl Application for Nothing {
//! #     fn entry(&self, _: u16, _: u8) -> Result<Entry, Abort> { Err(Abort::NoObject) }
//! #     fn read(&self, _: u16, _: u8, _: &mut [u8]) -> Result<usize, Abort> { Err(Abort::NoObject) }
//! #     fn write(&mut self, _: u16, _: u8, _: &[u8]) -> Result<(), Abort> { Err(Abort::NoObject) }
//! #     fn rpdo_applied(&mut self, _: u8, _: u16) {}
//! # }
//! # let mut application = Nothing;
//! # let identity = Identity { vendor: 1, product: 2, revision: 3, serial: 4 };
//! let mut node = Node::new(
//!     Config {
//!         node_id: 5,
//!         node_ids: (1, 127),
//!         identity,
//!         device_type: 0,
//!         device_name: "example",
//!         hardware_version: "1",
//!         software_version: "1",
//!         heartbeat_ms: 200,
//!         consumer: Some((127, 300)),
//!         sync_cob_id: 0x080,
//!         sync_counter_overflow: 0,
//!         time_cob_id: 0x100,
//!         error_behaviour: 0,
//!         rpdos: &[],
//!         tpdos: &[],
//!     },
//!     &[],
//!     &application,
//!     0,
//! );
//! let boot_up = node.poll_transmit();
//! assert_eq!(boot_up, Frame::standard(0x705, &[0]));
//!
//! let start = Frame::standard(0, &[1, 5]).ok_or("nine bytes")?;
//! node.handle_frame(1_000, &start, &mut application);
//! assert_eq!(node.nmt_state(), NmtState::Operational);
//!
//! node.tick(200_000, &mut application);
//! assert_eq!(node.poll_transmit(), Frame::standard(0x705, &[5]));
//! # Ok::<(), &str>(())
//! ```
//!
//! Served: NMT, heartbeats sent and watched (0x1016, 0x1017), SYNC with counter (0x1005, 0x1019),
//! TIME (0x1012), four RPDOs and four TPDOs with mapping at run time, inhibit and event times,
//! emergencies (0x1001, 0x1003, 0x1014, 0x1015), what follows a failure (0x1029), parameters stored and
//! restored (0x1010, 0x1011), LSS, and one SDO server, expedited, segmented and in blocks with CRC, for
//! values of up to 889 bytes and for domains of any length. What is to be stored goes to the node's
//! owner as an [`Event::Store`]. Deliberately absent: remote frames and node guarding, identifiers of
//! 29 bits, single bits in PDOs, other bit rates.
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]

mod application;
mod cob_id;
mod communication;
mod config;
mod deadline;
mod emergency;
mod event;
mod frame;
mod heartbeat;
mod lss;
mod nmt;
mod node;
mod objects;
mod pdo;
mod queue;
mod sdo;
mod stored;
mod sync;
mod time;
mod transmit;

pub use application::{Abort, Access, Application, Entry};
pub use config::{Config, Identity, Mapped, PDOS, PdoDefault};
pub use emergency::{REGISTER_COMMUNICATION, REGISTER_GENERIC};
pub use event::{Event, Group, StoreRequest};
pub use frame::{Frame, Id};
pub use nmt::{NmtCommand, NmtState};
pub use node::{Counters, Identifiers, Node};
pub use queue::EventQueue;
pub use sdo::SDO_BUFFER;
pub use stored::STORED_PARAMETERS;
