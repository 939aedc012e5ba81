//! The text format of can-utils' `candump -L`: one frame a line,
//! `(1609459200.123456) vcan0 123#DEADBEEF`, then `R` or `T` where the direction was recorded.
//!
//! Identifiers have 3 hexadecimal digits (11 bits) or 8 (29 bits), `#R` or `#R4` is a remote frame,
//! `##` a CAN FD frame, and 8 digits with bit 29 set are Linux's report of an error. The ninth to
//! fifteenth length code of a classic frame (`_9` to `_F`) and CAN XL are refused by name.

mod parse;
mod write;

use eel_protocol::Frame;

use crate::bus::ErrorFrame;

pub use parse::{ParseError, ParseErrorKind, parse_frame, parse_line};
pub use write::{format_line, write_frame, write_line};

/// One line of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record<'a, F = Frame> {
    /// Nanoseconds since 1970, or since the start of a simulation.
    pub time_ns: u64,
    /// The interface, 1–32 printable characters without a blank.
    pub interface: &'a str,
    /// What was on the bus.
    pub frame: F,
    /// Whether the recording machine received or sent it, where the line says so.
    pub direction: Option<Direction>,
}

/// Which way a frame went, seen from the machine that recorded it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// It came from another node.
    Received,
    /// It was sent.
    Transmitted,
}

/// What a line holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line<'a> {
    /// A classic data or remote frame.
    Frame(Record<'a>),
    /// A CAN FD frame.
    Flexible(Record<'a, FlexibleFrame>),
    /// An error that the interface reported.
    Error(Record<'a, ErrorFrame>),
}

/// A CAN FD frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlexibleFrame {
    /// Identifier and data.
    pub frame: Frame<64>,
    /// Bit 0: the data went at the higher rate; bit 1: the sender was error passive.
    pub flags: u8,
}

#[cfg(test)]
mod tests;
