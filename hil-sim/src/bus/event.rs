//! What happens on the bus, by the names of FMI-LS-BUS.

use eel_protocol::Frame;

use super::ControllerId;

/// Something that happened, in the order of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A controller won the bus and its frame begins.
    Transmit {
        /// Start of frame in ns.
        start_ns: u64,
        /// Who sends.
        sender: ControllerId,
        /// What it sends.
        frame: Frame,
    },
    /// A controller that began a frame at the same instant gave way.
    ArbitrationLost {
        /// Start of frame in ns.
        start_ns: u64,
        /// Who gave way.
        loser: ControllerId,
        /// The frame that has to wait.
        frame: Frame,
    },
    /// A frame was sent, acknowledged and received.
    Confirm(Delivery),
    /// A frame was destroyed; it is sent again unless its sender is off.
    BusError {
        /// Start of the destroyed frame in ns.
        start_ns: u64,
        /// End of the error delimiter in ns.
        end_ns: u64,
        /// Who sent it.
        sender: ControllerId,
        /// What it was.
        frame: Frame,
        /// Why.
        kind: BusErrorKind,
    },
}

/// A frame that went over the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Delivery {
    /// Start of frame in ns.
    pub start_ns: u64,
    /// End of the end of frame in ns: when it is received and confirmed.
    pub end_ns: u64,
    /// Who sent it; of several with equal frames the one attached first.
    pub sender: ControllerId,
    /// What was sent.
    pub frame: Frame,
    /// Bit times from the start of frame to the end of the interframe space.
    pub bits: u32,
}

/// Why a frame was destroyed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusErrorKind {
    /// Nobody acknowledged it.
    Acknowledge,
    /// Another controller sent the same arbitration field with different content.
    Collision,
    /// Its sender went off in the middle.
    Cut,
}
