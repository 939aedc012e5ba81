//! What the head tells its owner.

use eel_protocol::emergency::EmergencyReport;
use eel_protocol::{NodeId, State};
use heapless::Deque;

/// How many events wait to be polled: what ten nodes may do within a beat, twice.
const EVENTS: usize = 64;

/// Something that happened on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A node booted and is being started.
    Booted(NodeId),
    /// A node follows the gait.
    Running(NodeId),
    /// A node fell silent.
    Lost(NodeId),
    /// A node stopped and latched, or has a fault; it stays so until [`reset`](crate::Head::reset).
    Latched(NodeId, State),
    /// A node sent an emergency.
    Emergency(NodeId, EmergencyReport),
    /// The gait began.
    GaitStarted,
    /// Every vertebra is off and out of operation.
    Stopped,
}

/// Events in order. When it is full the oldest is forgotten, and counted.
#[derive(Clone, Debug, Default)]
pub(crate) struct EventQueue {
    events: Deque<Event, EVENTS>,
    dropped: u32,
}

impl EventQueue {
    pub fn push(&mut self, event: Event) {
        if self.events.is_full() {
            self.events.pop_front();
            self.dropped = self.dropped.saturating_add(1);
        }
        // There is room now.
        let _ = self.events.push_back(event);
    }

    pub fn pop(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    pub const fn dropped(&self) -> u32 {
        self.dropped
    }
}
