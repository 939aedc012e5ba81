//! A receive PDO: applied at once, or kept until SYNC.

use super::{Direction, Parameters};
use crate::{Application, PdoDefault};

/// What became of a received PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Received {
    /// Not this PDO's frame.
    Other,
    /// Shorter than the mapping.
    Short,
    /// Kept until SYNC; an older one that waited is forgotten.
    Kept,
    /// To be applied at once.
    Due,
}

/// A receive PDO.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rpdo {
    pub parameters: Parameters,
    pending: Option<[u8; 8]>,
}

impl Rpdo {
    pub const fn absent() -> Self {
        Self {
            parameters: Parameters::absent(),
            pending: None,
        }
    }

    /// Returns to the default for node `node_id`, if the node has the PDO.
    pub fn reset(&mut self, default: Option<&PdoDefault>, node_id: u8) {
        self.pending = None;
        if let Some(default) = default {
            self.parameters.reset(Direction::Receive, default, node_id);
        }
    }

    /// Looks at a frame and keeps its data if it is this PDO's.
    #[inline(never)] // One copy in flash.
    pub fn receive(&mut self, cob_id: u16, data: &[u8]) -> Received {
        if !self.parameters.is_enabled() || cob_id != self.parameters.cob_id() {
            return Received::Other;
        }
        if data.len() < usize::from(self.parameters.bytes()) {
            return Received::Short;
        }
        let mut kept = [0; 8];
        for (slot, byte) in kept.iter_mut().zip(data) {
            *slot = *byte;
        }
        self.pending = Some(kept);
        if self.parameters.is_synchronous() {
            Received::Kept
        } else {
            Received::Due
        }
    }

    /// Tells whether data waits.
    pub const fn is_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// Forgets data that waits.
    pub fn forget(&mut self) {
        self.pending = None;
    }

    /// Writes the data that waits, if any, and tells whether the application took it all.
    pub fn apply(&mut self, number: u8, app: &mut impl Application) -> Option<bool> {
        let data = self.pending.take()?;
        let mapping = self.parameters.mapping();
        if !app.take_rpdo(mapping, &data) {
            let mut rest: &[u8] = &data;
            for mapped in mapping {
                let (value, others) = rest.split_at_checked(mapped.bytes())?;
                rest = others;
                if !mapped.is_dummy() && app.write(mapped.index, mapped.subindex, value).is_err() {
                    return Some(false);
                }
            }
        }
        app.rpdo_applied(number, self.parameters.cob_id());
        Some(true)
    }
}
