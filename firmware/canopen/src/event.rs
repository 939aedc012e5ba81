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
