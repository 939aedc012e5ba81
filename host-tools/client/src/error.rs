//! What can go wrong with a node, and what to do about it.

use std::fmt;

use eel_transport::BusError;

use crate::abort::abort;

/// The place of an object in the dictionary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Multiplexor {
    /// Its index.
    pub index: u16,
    /// Its subindex.
    pub subindex: u8,
}

/// Why a node could not be read, written or given an id.
#[derive(Debug)]
pub enum ClientError {
    /// The node refused.
    Aborted {
        /// The node.
        node: u8,
        /// What it was asked for.
        object: Multiplexor,
        /// The abort code; [`abort`] knows its meaning.
        code: u32,
    },
    /// The node did not answer in time.
    Timeout {
        /// The node.
        node: u8,
        /// What it was asked for.
        object: Multiplexor,
    },
    /// The node answered what the standard does not allow; the transfer was aborted.
    Protocol {
        /// The node.
        node: u8,
        /// What it was asked for.
        object: Multiplexor,
        /// What was wrong.
        violation: Violation,
    },
    /// The node did not report the state that was waited for.
    NoState {
        /// The node.
        node: u8,
    },
    /// Layer setting services failed.
    Lss(LssFailure),
    /// The bus failed.
    Bus(BusError),
}

/// How an answer broke the rules of SDO (CiA 301, 7.2.4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Violation {
    /// The toggle bit did not alternate.
    Toggle,
    /// The command byte is not one of those that may come here.
    Command(u8),
    /// The acknowledged sequence number was never sent.
    Sequence(u8),
    /// The block size is not within 1–127.
    BlockSize(u8),
    /// The CRC does not match the data.
    Crc,
    /// Another number of bytes came than was announced.
    Length {
        /// What was announced.
        announced: usize,
        /// What came.
        came: usize,
    },
    /// More bytes came than [`Settings::longest`](crate::Settings::longest).
    TooLong,
    /// The same segments got lost again and again.
    Losses,
}

/// Why a layer setting service failed (CiA 305).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LssFailure {
    /// No node answered.
    Silence,
    /// A node answered with an error code and a code of its maker's.
    Refused {
        /// The service's command.
        service: u8,
        /// The error code, 1–255.
        code: u8,
        /// The maker's own code.
        detail: u8,
    },
    /// The scan's steps contradicted each other, though repeated with longer waits.
    Unsteady,
}

impl Multiplexor {
    /// Names an object.
    #[must_use]
    pub const fn new(index: u16, subindex: u8) -> Self {
        Self { index, subindex }
    }

    /// Returns the three bytes on the wire.
    pub(crate) const fn bytes(self) -> [u8; 3] {
        let [low, high] = self.index.to_le_bytes();
        [low, high, self.subindex]
    }
}

impl Violation {
    /// Returns the abort code that tells the server.
    pub(crate) const fn code(self) -> u32 {
        match self {
            Self::Toggle => 0x0503_0000,
            Self::Command(_) => 0x0504_0001,
            Self::BlockSize(_) => 0x0504_0002,
            Self::Sequence(_) => 0x0504_0003,
            Self::Crc => 0x0504_0004,
            Self::TooLong => 0x0504_0005,
            Self::Length { .. } => 0x0607_0010,
            Self::Losses => 0x0504_0000,
        }
    }
}

impl fmt::Display for Multiplexor {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:04X}:{}", self.index, self.subindex)
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Toggle => write!(out, "a segment came twice or was lost (toggle bit)"),
            Self::Command(byte) => write!(out, "command 0x{byte:02X} can't come here"),
            Self::Sequence(number) => {
                write!(out, "segment {number} was acknowledged and never sent")
            }
            Self::BlockSize(size) => write!(out, "a block of {size} segments"),
            Self::Crc => write!(out, "the CRC does not match the data"),
            Self::Length { announced, came } => {
                write!(out, "{announced} bytes were announced, {came} came")
            }
            Self::TooLong => write!(out, "it sends more than is taken"),
            Self::Losses => write!(out, "the same segments got lost again and again"),
        }
    }
}

impl fmt::Display for ClientError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Aborted { node, object, code } => {
                let known = abort(*code);
                write!(
                    out,
                    "node {node} refuses {object}: {} (0x{code:08X}); {}",
                    known.meaning,
                    known.cure.replace("NODE", &node.to_string())
                )
            }
            Self::Timeout { node, object } => write!(
                out,
                "node {node} does not answer ({object}): it is off, stopped (`eel nmt {node} \
                 pre-operational`), has another id (`eel nodes`), or none yet (`eel lss scan`)"
            ),
            Self::Protocol {
                node,
                object,
                violation,
            } => write!(
                out,
                "node {node} breaks the rules of SDO ({object}): {violation}; frames got lost or \
                 another client speaks to it, try again"
            ),
            Self::NoState { node } => write!(
                out,
                "node {node} did not report the state in time: it is off, has another id (`eel \
                 nodes`), or sends no heartbeat (`eel write {node} heartbeat.producer=0.2`)"
            ),
            Self::Lss(failure) => failure.fmt(out),
            Self::Bus(error) => error.fmt(out),
        }
    }
}

impl fmt::Display for LssFailure {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Silence => write!(
                out,
                "no node answers to LSS: it has another identity (`eel lss scan`), or is not on the \
                 bus"
            ),
            Self::Refused {
                service,
                code,
                detail,
            } => {
                let what = match (service, code) {
                    (0x11, 1) => "the node id is outside of what it takes (a vertebra: 1 to 10)",
                    (0x13, 1) => "it does not know this bit rate",
                    (0x17, 1) => "it can't store",
                    (0x17, 2) => "its memory failed",
                    (_, 0xFF) => "a reason of its maker's",
                    _ => "an unknown reason",
                };
                write!(
                    out,
                    "the node refuses the setting: {what} (code {code}, detail {detail})"
                )
            }
            Self::Unsteady => write!(
                out,
                "the scan's answers contradict each other: is another LSS master on the bus, or the \
                 bus overloaded?"
            ),
        }
    }
}

impl std::error::Error for ClientError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Bus(error) => error.source(),
            _ => None,
        }
    }
}

impl From<BusError> for ClientError {
    fn from(error: BusError) -> Self {
        Self::Bus(error)
    }
}

impl From<LssFailure> for ClientError {
    fn from(failure: LssFailure) -> Self {
        Self::Lss(failure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_abort_is_told_with_its_cure() {
        let error = ClientError::Aborted {
            node: 3,
            object: Multiplexor::new(0x2020, 1),
            code: 0x0800_0022,
        };
        assert_eq!(
            error.to_string(),
            "node 3 refuses 2020:1: the node's state forbids it (0x08000022); stop it first: \
             `eel nmt 3 pre-operational`, or switch the wrist off"
        );
    }
}
