//! What the bus asks to be stored, on its way to the platform's flash and back.

use eel_canopen::{Abort, STORED_PARAMETERS, StoreRequest};
use eel_protocol::NodeId;
use eel_units::Instant;

use crate::store::{Record, StoreError};
use crate::vertebra::Vertebra;

impl Vertebra {
    /// Makes what is to be stored of what is there at this moment: it may change before the platform is
    /// ready to store it.
    #[inline(never)] // One copy in flash.
    pub(crate) fn prepare_store(&mut self, request: StoreRequest) {
        let mut record = self.storing.stored.clone();
        match request {
            StoreRequest::Save(group) => {
                if group.has_communication() {
                    let mut saved = [0; STORED_PARAMETERS];
                    let length = self.node.save_parameters(&mut saved).unwrap_or_default();
                    record.communication.clear();
                    // A record holds as much as a node saves.
                    let saved = saved.get(..length).unwrap_or_default();
                    let _ = record.communication.extend_from_slice(saved);
                }
                if group.has_application() {
                    record.keep_settings(&self.core.settings);
                }
            }
            StoreRequest::Restore(group) => {
                if group.has_communication() {
                    record.communication.clear();
                }
                if group.has_application() {
                    record.forget_settings();
                }
            }
            StoreRequest::NodeId(id) => record.node = NodeId::new(id),
        }
        // What was lost stays lost until settings are stored or restored.
        let is_mended = match request {
            StoreRequest::Save(group) | StoreRequest::Restore(group) => group.has_application(),
            StoreRequest::NodeId(_) => false,
        };
        record.lost = self.core.settings_lost && !is_mended;
        self.storing.coming = Some(record);
        self.storing.is_taken = false;
    }

    /// Returns what the platform shall store now, once for each request; it then calls
    /// [`finish_store`](Self::finish_store), before or after other turns. The bus waits for a second.
    pub fn poll_store(&mut self) -> Option<Record> {
        if core::mem::replace(&mut self.storing.is_taken, true) {
            return None;
        }
        self.storing.coming.clone()
    }

    /// Hears what became of what [`poll_store`](Self::poll_store) returned, and answers the bus. What is
    /// stored counts from the next reset of the node on.
    pub fn finish_store(&mut self, now: Instant, outcome: Result<(), StoreError>) {
        let coming = self.storing.coming.take();
        if outcome.is_ok()
            && let Some(record) = coming
        {
            self.core.settings_lost = record.lost;
            self.storing.stored = record;
        }
        let outcome = match outcome {
            Ok(()) => Ok(self.storing.stored.communication.as_slice()),
            Err(StoreError::Flash | StoreError::Verify) => Err(Abort::Hardware),
        };
        self.node.finish_store(now.to_micros(), outcome);
    }
}
