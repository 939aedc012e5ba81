//! What may go wrong during a run.

use eel_protocol::NodeId;

/// One thing that goes wrong at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// When, in ns since the start; it happens with the head's next tick.
    pub at_ns: u64,
    /// What.
    pub kind: FaultKind,
}

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// The head loses its power: no SYNC, no targets, no heartbeat any more.
    HeadSilent,
    /// A vertebra's microcontroller starts anew.
    NodeReset(NodeId),
}
