//! What a vertebra tells its platform, for logs and tests.

use eel_protocol::State;
use eel_protocol::emergency::{Emergency, Source};
use heapless::Deque;

/// How many events wait to be polled.
const EVENTS: usize = 16;

/// Something that happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The state changed.
    State {
        /// The state before.
        from: State,
        /// The state now.
        to: State,
    },
    /// An emergency frame was handed to the node.
    Emergency {
        /// Which one of the catalogue.
        emergency: Emergency,
        /// Where it comes from.
        source: Source,
    },
    /// An NMT command reset the node; the vertebra starts anew.
    Reset,
}

/// Events in order. When it is full the oldest is forgotten, and counted.
#[derive(Clone, Debug, Default)]
pub struct EventQueue {
    events: Deque<Event, EVENTS>,
    dropped: u32,
}

impl EventQueue {
    /// Adds an event.
    pub fn push(&mut self, event: Event) {
        if self.events.is_full() {
            self.events.pop_front();
            self.dropped = self.dropped.saturating_add(1);
        }
        // There is room now.
        let _ = self.events.push_back(event);
    }

    /// Takes the oldest event.
    pub fn pop(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Returns how many events were forgotten.
    pub const fn dropped(&self) -> u32 {
        self.dropped
    }
}
