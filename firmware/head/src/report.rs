//! What the head tells its owner.

use eel_protocol::emergency::EmergencyReport;
use eel_protocol::{NodeId, State};

/// How many events wait to be polled: what ten nodes may do within a beat, twice.
const EVENTS: usize = 64;

/// Something that happened on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A node booted, or was found outside operation; it is started unless the head is stopping.
    Booted(NodeId),
    /// A node does its task.
    Running(NodeId),
    /// A node fell silent.
    Lost(NodeId),
    /// A node stopped and latched, or has a fault; it stays so until [`reset`](crate::Head::reset).
    Latched(NodeId, State),
    /// A node sent an emergency.
    Emergency(NodeId, EmergencyReport),
    /// The gait began.
    GaitStarted,
    /// Every vertebra that is there reports its drives off, and all leave operation.
    Stopped,
    /// A vertebra was told to switch off and still reports to be driven; all leave operation.
    NotStopped(NodeId),
}

/// The head's events on their way to its owner.
pub(crate) type EventQueue = eel_canopen::EventQueue<Event, EVENTS>;
