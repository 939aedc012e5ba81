//! What a node listens to, for the filters of its controller.

use heapless::Vec;

use super::{Node, heartbeat_cob_id};
use crate::config::PDOS;
use crate::{NmtState, lss};

/// The identifiers that a node listens to.
pub type Identifiers = Vec<u16, { 6 + PDOS }>;

impl Node {
    /// Tells whether a search for nodes without an id (LSS fastscan, "identify non-configured") is for this
    /// one: an application may know its place by a line beside the bus. It is, unless told otherwise.
    pub const fn take_part_in_search(&mut self, is_next: bool) {
        self.lss.set_next(is_next);
    }

    /// Returns the identifiers that the node listens to, for a controller's filters. They change with the
    /// parameters of the communication area, the state of LSS, and at a reset.
    pub fn identifiers(&self) -> Identifiers {
        let communication = &self.communication;
        let mut identifiers = Vec::new();
        let mut hear = |cob_id| {
            // As many as there can be.
            let _ = identifiers.push(cob_id);
        };
        hear(lss::REQUEST);
        if self.state == NmtState::Initialising {
            return identifiers;
        }
        hear(0);
        hear(communication.sync.cob_id());
        communication.time.cob_id().into_iter().for_each(&mut hear);
        let watched = communication.consumer.node().map(heartbeat_cob_id);
        watched.into_iter().for_each(&mut hear);
        hear(0x600 + u16::from(self.config.node_id));
        let rpdos = communication.rpdos.iter().map(|rpdo| &rpdo.parameters);
        rpdos
            .filter(|parameters| parameters.is_enabled())
            .for_each(|parameters| hear(parameters.cob_id()));
        identifiers
    }
}
