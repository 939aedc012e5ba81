//! What may go wrong during a run.

use eel_protocol::{Cob, Frame, NodeId};

use crate::plant::Defect;

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
    /// The head's heartbeat is missing; all else that it says goes on.
    HeartbeatLost,
    /// A vertebra's targets are missing; SYNC and heartbeat go on.
    TargetsLost(NodeId),
    /// A bit of each of a vertebra's targets is wrong.
    TargetsBent(NodeId),
    /// Somebody tells all vertebrae to stop: NMT "stop remote node", node 0.
    StopByNmt,
    /// A vertebra's microcontroller starts anew.
    NodeReset(NodeId),
    /// A vertebra's program hangs, until its watchdog starts it anew.
    NodeHung(NodeId),
    /// A vertebra's controller leaves the bus after too many errors, and rejoins after its board's pause.
    BusOff(NodeId),
    /// Something breaks in a vertebra.
    Broken(NodeId, Defect),
    /// The battery has this voltage without load from now on, mV; below 6 V no vertebra runs.
    Battery(u32),
}

/// What the head's frames suffer on their way to its controller.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Muffle {
    pub heartbeat: bool,
    /// Whose targets are lost, bit 0 the first.
    pub lost: u16,
    /// Whose targets are bent.
    pub bent: u16,
}

impl Muffle {
    /// Returns what becomes of a frame.
    pub fn pass(self, frame: Frame) -> Option<Frame> {
        let has = |set: u16, node: u8| (1..=16).contains(&node) && set & (1 << (node - 1)) != 0;
        match frame.cob_id().map(Cob::from_id) {
            Some(Cob::Heartbeat(_)) if self.heartbeat => None,
            Some(Cob::Target(node)) if has(self.lost, node) => None,
            Some(Cob::Target(node)) if has(self.bent, node) => {
                let mut data = frame.data().to_vec();
                data.iter_mut().take(1).for_each(|byte| *byte ^= 1);
                Frame::new(frame.id(), &data)
            }
            _ => Some(frame),
        }
    }
}
