//! What can go wrong with a bus, and what to do about it.

use std::fmt;
use std::io;

use crate::candump::ParseError;

/// Why a bus could not be opened or did not carry a frame.
#[derive(Debug)]
pub enum BusError {
    /// There is no network interface of this name.
    NoInterface {
        /// The name that was asked for.
        name: String,
    },
    /// The interface exists and is down.
    InterfaceDown {
        /// The name of the interface.
        name: String,
    },
    /// This kernel or this user may not open CAN sockets.
    NoSocketCan {
        /// The name that was asked for.
        name: String,
        /// What the system said.
        source: io::Error,
    },
    /// The URL names a kind of bus that this build can't open.
    Unsupported {
        /// The URL as it was given.
        url: String,
        /// What is possible instead.
        reason: &'static str,
    },
    /// The file can't be opened or read.
    File {
        /// The path as it was given.
        path: String,
        /// What the system said.
        source: io::Error,
    },
    /// A line of a candump file is not one.
    Line {
        /// The path as it was given.
        path: String,
        /// The number of the line, counted from 1.
        line: u64,
        /// What is wrong with it.
        source: ParseError,
    },
    /// The bus can only be read.
    ReadOnly,
    /// The transmit queue is full; the frame was not taken and may be sent again.
    Full,
    /// No frame will come any more: the file has ended or the peer is gone.
    Ended,
    /// The system refused a read or a write.
    Io(io::Error),
}

impl fmt::Display for BusError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoInterface { name } if name.starts_with("vcan") => write!(
                f,
                "no interface {name}: `ip link add dev {name} type vcan && ip link set {name} up` \
                 as root makes one (kernel module vcan), or run the command as \
                 `cargo xtask vcan -- COMMAND`"
            ),
            Self::NoInterface { name } => write!(
                f,
                "no interface {name}: `ip link` lists those that exist; a CAN adapter comes up \
                 with `ip link set {name} up type can bitrate 1000000`"
            ),
            Self::InterfaceDown { name } if name.starts_with("vcan") => {
                write!(
                    f,
                    "interface {name} is down: `ip link set {name} up` as root"
                )
            }
            Self::InterfaceDown { name } => write!(
                f,
                "interface {name} is down: `ip link set {name} up type can bitrate 1000000` as \
                 root"
            ),
            Self::NoSocketCan { name, source } => write!(
                f,
                "no CAN socket for {name} ({source}): load the kernel modules can and can_raw, or \
                 run the command as `cargo xtask vcan -- COMMAND`"
            ),
            Self::Unsupported { url, reason } => write!(f, "can't open {url}: {reason}"),
            Self::File { path, source } => write!(f, "can't read {path}: {source}"),
            Self::Line { path, line, source } => write!(f, "{path}:{line}:{source}"),
            Self::ReadOnly => {
                write!(
                    f,
                    "a recording can't be sent to: name an interface such as vcan0"
                )
            }
            Self::Full => write!(
                f,
                "the transmit queue is full: no other node acknowledges, or more is sent than the \
                 bus carries"
            ),
            Self::Ended => write!(f, "the bus has ended"),
            Self::Io(source) => write!(f, "the bus failed: {source}"),
        }
    }
}

impl std::error::Error for BusError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::NoSocketCan { source, .. } | Self::File { source, .. } | Self::Io(source) => {
                Some(source)
            }
            Self::Line { source, .. } => Some(source),
            _ => None,
        }
    }
}
