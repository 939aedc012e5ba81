//! What a node tells its owner.

use crate::{NmtCommand, NmtState};

/// Something that happened, for the application, for logs and for tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event {
    /// An NMT command changed the state, or reset the node. After `ResetNode` the application
    /// starts anew; the node has done so already.
    Nmt {
        /// The command.
        command: NmtCommand,
        /// The state that the node is in now.
        state: NmtState,
    },
    /// SYNC came; synchronous RPDOs have been applied just before.
    Sync {
        /// The counter, where SYNC carries one.
        counter: Option<u8>,
    },
    /// SYNC came with another length than object 0x1019 says, and was ignored.
    SyncLength,
    /// TIME came.
    Time {
        /// Days since 1 January 1984.
        days: u16,
        /// Milliseconds since midnight.
        ms: u32,
    },
    /// Parameters, as they are at this moment, or the node id are to be stored. Whoever has done it,
    /// or can't, calls [`Node::finish_store`](crate::Node::finish_store); until then the client waits.
    Store(StoreRequest),
    /// LSS gave an unconfigured node its id, with which it has just booted, or a reset of the
    /// communication took over one that LSS had given.
    NodeId(u8),
    /// The watched node fell silent.
    HeartbeatLost(u8),
    /// The watched node is heard again.
    HeartbeatBack(u8),
    /// The watched node reports another state than before; `Initialising` is its boot-up.
    RemoteState {
        /// The watched node.
        node: u8,
        /// Its state.
        state: NmtState,
    },
    /// An RPDO was shorter than its mapping and was not applied.
    RpdoLength {
        /// The RPDO, 1–4.
        number: u8,
    },
    /// The application refused to write an object of an RPDO; those after it were not written.
    RpdoRefused {
        /// The RPDO, 1–4.
        number: u8,
    },
}

/// What is to be stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreRequest {
    /// Object 0x1010: the parameters as they are.
    Save(Group),
    /// Object 0x1011: the defaults, to be taken at the next reset.
    Restore(Group),
    /// LSS: this node id; any but 1–127 stands for none.
    NodeId(u8),
}

/// A group of parameters: the subindex of objects 0x1010 and 0x1011.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Group {
    /// Subindex 1: all that can be stored.
    All = 1,
    /// Subindex 2: the communication area, 0x1000–0x1FFF.
    Communication = 2,
    /// Subindex 3: the application's parameters.
    Application = 3,
}

impl Group {
    /// Returns the group of a subindex.
    pub const fn from_subindex(subindex: u8) -> Option<Self> {
        match subindex {
            1 => Some(Self::All),
            2 => Some(Self::Communication),
            3 => Some(Self::Application),
            _ => None,
        }
    }

    /// Tells whether the communication area belongs to the group.
    pub const fn has_communication(self) -> bool {
        matches!(self, Self::All | Self::Communication)
    }

    /// Tells whether the application's parameters belong to the group.
    pub const fn has_application(self) -> bool {
        matches!(self, Self::All | Self::Application)
    }
}
