//! The commands that send: bring-up of nodes, their faults and signals, and the head.

mod bus;
mod calibrate;
mod drive;
mod events;
mod faults;
mod head;
mod live;
mod lss;
mod map;
mod nmt;
mod nodes;
mod read;
mod scope;
mod store;
mod write;

use std::fmt;
use std::str::FromStr;

use eel_client::ClientError;
use eel_protocol::{HEAD_NODE, VERTEBRAE};

use crate::usage::Usage;

pub use calibrate::{Calibrate, SelfTest};
pub use drive::Drive;
pub use faults::Faults;
pub use head::Head;
pub use lss::Lss;
pub use map::Map;
pub use nmt::Nmt;
pub use nodes::Nodes;
pub use read::Read;
pub use scope::Scope;
pub use store::Store;
pub use write::Write;

/// The abort code of an object that exists and holds nothing now.
const NO_DATA: u32 = 0x0800_0024;

/// No bus to work on: exit code 3.
#[derive(Debug)]
pub struct NoBus(pub String);

/// A node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node(pub u8);

impl fmt::Display for NoBus {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&self.0)
    }
}

impl std::error::Error for NoBus {}

impl FromStr for Node {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = match text {
            "head" => Some(HEAD_NODE),
            _ => text.parse().ok().filter(|node| (1..=127).contains(node)),
        };
        number
            .map(Self)
            .ok_or_else(|| format!("{text:?} is no node: write head or a number 1 to 127"))
    }
}

impl fmt::Display for Node {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            HEAD_NODE => write!(out, "head"),
            node if node <= VERTEBRAE => write!(out, "vertebra {node}"),
            node => write!(out, "node {node}"),
        }
    }
}

/// Returns the exit code of an error of these commands: 1 for a node that refuses or is silent, 2 for
/// a wrong use, 3 for a bus that fails.
pub fn exit_code(error: &anyhow::Error) -> u8 {
    match error.downcast_ref::<ClientError>() {
        Some(ClientError::Bus(_)) => 3,
        Some(_) => 1,
        None if error.is::<Usage>() => 2,
        None => 3,
    }
}
