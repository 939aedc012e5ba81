//! A CANopen client over any bus: it reads and writes objects, commands states, finds nodes and gives
//! node ids.
//!
//! Everything here waits until it is done, with a bound on every wait. Frames of others that come
//! meanwhile are no errors: heartbeats and emergencies among them are remembered
//! ([`Client::heard`], [`Client::take_emergencies`]), the rest is passed over. Deliberately absent:
//! SYNC and PDOs, which are the head's, and any decision on what may be written to whom.
//!
//! ```no_run
//! use eel_client::{Client, Method, Multiplexor};
//!
//! let mut client = Client::new(eel_transport::open("vcan0")?);
//! let period = client.upload(3, Multiplexor::new(0x1017, 0), Method::Automatic, &mut |_| ())?;
//! assert_eq!(period, [200, 0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

mod abort;
mod client;
mod error;
mod history;
mod lss;
mod nmt;
#[cfg(test)]
mod noise;
mod scan;
#[cfg(test)]
mod script;
mod sdo;

pub use abort::{ABORTS, AbortCode, abort};
pub use client::{Client, Heard, Settings};
pub use eel_canopen::{Access, NmtCommand, NmtState};
pub use error::{ClientError, LssFailure, Multiplexor, Violation};
pub use history::PastError;
pub use lss::{Lss, LssAddress};
pub use scan::{Found, Identification};
pub use sdo::{Method, Progress};
