//! Emergencies on their way to the node, and the faults that wait to be taken.

use eel_protocol::emergency::{Emergency, Source};
use heapless::Deque;

/// How many emergencies wait to be sent.
const WAITING: usize = 8;

/// What is to be told, and what has failed since the last fault reset.
#[derive(Clone, Debug, Default)]
pub struct Pending {
    waiting: Deque<(Emergency, Source), WAITING>,
    fault: Option<(Emergency, Source)>,
    failed_encoders: [bool; 3],
    dropped: u32,
}

impl Pending {
    /// Adds an emergency to send; a ninth is dropped and counted.
    pub fn push(&mut self, emergency: Emergency, source: Source) {
        if self.waiting.push_back((emergency, source)).is_err() {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    /// Takes the next emergency to send.
    pub fn pop(&mut self) -> Option<(Emergency, Source)> {
        self.waiting.pop_front()
    }

    /// Notes a fault of motor 0–2 or of the whole wrist; the first one since the last reset counts.
    pub fn fault(&mut self, emergency: Emergency, motor: Option<usize>, detail: u16) {
        let number = motor.map_or(0, |motor| motor as u8 + 1);
        if matches!(
            emergency,
            Emergency::ENCODER_INVALID | Emergency::ENCODER_IMPLAUSIBLE
        ) && let Some(failed) = motor.and_then(|motor| self.failed_encoders.get_mut(motor))
        {
            *failed = true;
        }
        if self.fault.is_none() {
            self.fault = Some((
                emergency,
                Source {
                    motor: number,
                    limit: 0,
                    detail,
                },
            ));
        }
    }

    /// Returns the fault that counts.
    pub const fn first_fault(&self) -> Option<(Emergency, Source)> {
        self.fault
    }

    /// Returns which encoders have failed.
    pub const fn failed_encoders(&self) -> [bool; 3] {
        self.failed_encoders
    }

    /// Forgets the faults after a reset; what is still to be sent stays.
    pub fn clear(&mut self) {
        self.fault = None;
        self.failed_encoders = [false; 3];
    }
}
