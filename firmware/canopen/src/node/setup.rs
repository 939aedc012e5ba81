//! What outlives a reset: node id, stored parameters, and who asks for them to be stored.

use super::{Node, Waiting};
use crate::deadline::after;
use crate::lss::{self, Outcome};
use crate::stored;
use crate::{Abort, Application, Event, NmtCommand, NmtState, StoreRequest};

/// How long a client waits for something to be stored.
const STORE_TIMEOUT_US: u32 = 1_000_000;

impl Node {
    /// Writes the parameters of the communication area to the start of `out` and returns how many
    /// bytes they take, at most [`STORED_PARAMETERS`](crate::STORED_PARAMETERS); `None` when `out` is too short.
    #[inline(never)] // One copy in flash, and a small one.
    pub fn save_parameters(&self, out: &mut [u8]) -> Option<usize> {
        stored::save(&self.communication, &self.config, out)
    }

    /// Returns the parameters that the next reset takes over; empty for the defaults.
    pub fn stored_parameters(&self) -> &[u8] {
        &self.stored
    }

    /// Tells whether the parameters that the node was made with were none that it can have.
    pub const fn has_refused_stored(&self) -> bool {
        self.stored_refused
    }

    /// Answers whoever asked for an [`Event::Store`]: it is done, or why it is not. What is done comes with
    /// the parameters of the communication area as they were [saved](Self::save_parameters), which may have
    /// changed since; where none were to be saved they are not looked at.
    #[inline(never)] // One copy in flash, and a small one.
    pub fn finish_store(&mut self, now_us: u64, outcome: Result<&[u8], Abort>) {
        self.expire_store(now_us);
        let request = self.storing.take();
        if let Ok(saved) = outcome {
            match request {
                Some(StoreRequest::Save(group)) if group.has_communication() => {
                    self.stored.clear();
                    if self.stored.extend_from_slice(saved).is_err() {
                        self.stored.clear();
                    }
                }
                Some(StoreRequest::Restore(group)) if group.has_communication() => {
                    self.stored.clear();
                }
                Some(StoreRequest::NodeId(node_id)) => self.stored_id = node_id,
                _ => {}
            }
        }
        match self.waiting.take() {
            Some(Waiting::Sdo(answer)) => {
                let answer = outcome.map_or_else(|abort| refusal(request, abort), |_| answer);
                self.answer(answer);
            }
            Some(Waiting::Lss) => self.answer_lss(lss::stored(outcome.is_ok())),
            None => {}
        }
    }

    /// Has an SDO client wait for what it asked to be stored.
    pub(super) fn wait_for_store(&mut self, now_us: u64, answer: [u8; 8]) {
        self.waiting = Some(Waiting::Sdo(answer));
        self.waiting_until_us = after(now_us, STORE_TIMEOUT_US);
        if let Some(request) = self.storing {
            self.events.push(Event::Store(request));
        }
    }

    /// Has no SDO client wait any more for something to be stored.
    pub(super) fn leave_unanswered(&mut self) {
        if let Some(Waiting::Sdo(_)) = self.waiting {
            self.waiting = None;
        }
    }

    /// Tells an SDO client that storing takes too long.
    pub(super) fn expire_store(&mut self, now_us: u64) {
        if matches!(self.waiting, Some(Waiting::Sdo(_))) && now_us >= self.waiting_until_us {
            self.waiting = None;
            self.answer(refusal(self.storing, Abort::Hardware));
        }
    }

    /// Starts the node anew.
    pub(super) fn reset(&mut self, command: NmtCommand, now_us: u64) {
        self.transmit.clear();
        self.sdo.reset();
        self.waiting = None;
        if command == NmtCommand::ResetNode {
            self.lss = lss::Lss::new(self.stored_id);
        }
        let node_id = self.lss.pending();
        if node_id != self.config.node_id {
            self.config.node_id = node_id;
            self.events.push(Event::NodeId(node_id));
        }
        self.communication.reset(command, &self.config, now_us);
        self.load(now_us);
        self.state = NmtState::Initialising;
        self.boot();
    }

    /// Takes the stored parameters over into fresh ones; those that are wrong are forgotten.
    pub(super) fn load(&mut self, now_us: u64) {
        if self.stored.is_empty() {
            return;
        }
        let Self {
            config,
            communication,
            stored,
            ..
        } = self;
        if stored::load(communication, config, stored, now_us).is_none() {
            stored.clear();
            communication.reset(NmtCommand::ResetCommunication, config, now_us);
        }
    }

    /// Serves the layer setting services.
    #[inline(never)] // One copy in flash.
    pub(super) fn set_layer(&mut self, now_us: u64, data: &[u8], app: &dyn Application) {
        let Ok(request) = data.try_into() else { return };
        let config = &self.config;
        let outcome = self
            .lss
            .request(request, &config.identity, config.node_id, config.node_ids);
        match outcome {
            Outcome::Silence | Outcome::Answer(..) => self.answer_lss(outcome),
            Outcome::Store if self.storing.is_some() || app.may_configure().is_err() => {
                self.answer_lss(lss::stored(false));
            }
            Outcome::Store => {
                let request = StoreRequest::NodeId(self.lss.pending());
                self.storing = Some(request);
                self.waiting = Some(Waiting::Lss);
                self.events.push(Event::Store(request));
            }
            Outcome::Left => {
                if self.state == NmtState::Initialising && matches!(self.lss.pending(), 1..=127) {
                    self.reset(NmtCommand::ResetCommunication, now_us);
                }
            }
        }
    }

    /// Does what object 0x1029 says about an error of the communication.
    pub(super) fn behave_after_error(&mut self, now_us: u64) {
        let command = match self.communication.error_behaviour {
            _ if self.state != NmtState::Operational => return,
            0 => NmtCommand::EnterPreOperational,
            2 => NmtCommand::Stop,
            _ => return,
        };
        self.enter(command.target(), now_us);
        let state = self.state;
        self.events.push(Event::Nmt { command, state });
    }

    fn answer_lss(&mut self, outcome: Outcome) {
        if let Outcome::Answer(command, data) = outcome {
            let [a, b, c, d] = data.to_le_bytes();
            let answer = [command, a, b, c, d, 0, 0, 0];
            self.transmit.push(lss::ANSWER, answer, 8);
        }
    }
}

/// Returns the SDO message that refuses what was asked for.
#[inline(never)] // One copy in flash.
fn refusal(request: Option<StoreRequest>, abort: Abort) -> [u8; 8] {
    let (low, group) = match request {
        Some(StoreRequest::Save(group)) => (0x10, group as u8),
        Some(StoreRequest::Restore(group)) => (0x11, group as u8),
        Some(StoreRequest::NodeId(_)) | None => (0, 0),
    };
    let high = if low == 0 { 0 } else { 0x10 };
    let [a, b, c, d] = abort.code().to_le_bytes();
    [0x80, low, high, group, a, b, c, d]
}
