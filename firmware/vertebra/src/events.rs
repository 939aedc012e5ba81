//! What a vertebra tells its platform, for logs and tests.

use eel_protocol::emergency::{Emergency, Source};
use eel_protocol::{NodeId, State};

/// How many events wait to be polled.
pub const EVENTS: usize = 16;

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
    /// LSS gave the vertebra another place in the chain, or took it away. A platform whose controller
    /// filters identifiers must let the new ones pass.
    NodeId(Option<NodeId>),
}
