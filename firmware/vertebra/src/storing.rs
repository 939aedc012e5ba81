//! What the bus asks to be stored, on its way to the platform's flash and back.

use eel_canopen::{Abort, STORED_PARAMETERS, StoreRequest};
use eel_protocol::NodeId;
use eel_units::Instant;

use crate::store::{Record, StoreError};
use crate::vertebra::Vertebra;

/// How far the making of a record is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Stage {
    /// None is being made, or the platform has it.
    #[default]
    Idle,
    /// It is to be begun with what is stored.
    Begin(StoreRequest),
    /// The communication parameters come next.
    Communication(StoreRequest),
    /// The settings come next.
    Settings(StoreRequest),
    /// It is whole.
    Whole,
}

impl Vertebra {
    /// Takes what the bus asks for; it waits for the outcome, and changes nothing meanwhile.
    pub(crate) fn prepare_store(&mut self, request: StoreRequest) {
        self.storing.coming = None;
        self.storing.stage = Stage::Begin(request);
    }

    /// Returns what the platform shall store now, once for each request; it then calls
    /// [`finish_store`](Self::finish_store), before or after other turns. The bus waits for a second.
    /// Call it once after each turn: what is asked for is made in four of these calls, so that none takes
    /// long.
    pub fn poll_store(&mut self) -> Option<&Record> {
        if self.storing.stage == Stage::Idle {
            return None;
        }
        self.go_on_storing()
    }

    /// Makes what is asked for at once, before a command of NMT changes what it is made of.
    #[inline]
    pub(crate) fn hasten_store(&mut self) {
        while !matches!(self.storing.stage, Stage::Idle | Stage::Whole) {
            let _ = self.go_on_storing();
        }
    }

    #[cold]
    #[inline(never)]
    fn go_on_storing(&mut self) -> Option<&Record> {
        let stage = self.storing.stage;
        let Some(record) = &mut self.storing.coming else {
            if let Stage::Begin(request) = stage {
                self.storing.coming = Some(self.storing.stored.clone());
                self.storing.stage = Stage::Communication(request);
            }
            return None;
        };
        self.storing.stage = match stage {
            Stage::Idle | Stage::Begin(_) => Stage::Idle,
            Stage::Communication(request) => {
                match request {
                    StoreRequest::Save(group) if group.has_communication() => {
                        // A record holds as much as a node saves.
                        let all = &mut record.communication;
                        let _ = all.resize_default(STORED_PARAMETERS);
                        let length = self.node.save_parameters(all).unwrap_or_default();
                        all.truncate(length);
                    }
                    StoreRequest::Restore(group) if group.has_communication() => {
                        record.communication.clear();
                    }
                    StoreRequest::NodeId(id) => record.node = NodeId::new(id),
                    StoreRequest::Save(_) | StoreRequest::Restore(_) => {}
                }
                Stage::Settings(request)
            }
            Stage::Settings(request) => {
                let mut is_mended = true;
                match request {
                    StoreRequest::Save(group) if group.has_application() => {
                        record.keep_settings(&self.core.settings);
                    }
                    StoreRequest::Restore(group) if group.has_application() => {
                        record.forget_settings();
                    }
                    // What was lost stays lost until settings are stored or restored.
                    _ => is_mended = false,
                }
                record.lost = self.core.settings_lost && !is_mended;
                Stage::Whole
            }
            Stage::Whole => {
                self.storing.stage = Stage::Idle;
                return self.storing.coming.as_ref();
            }
        };
        None
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
