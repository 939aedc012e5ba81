//! Heartbeats, sent and watched (CiA 301, 7.2.8.3.2, objects 0x1016 and 0x1017).

use crate::deadline::{NEVER_US, after, micros};
use crate::{Abort, NmtState};

/// Sends the node's state at a fixed period.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Producer {
    period_ms: u16,
    due_us: u64,
}

impl Producer {
    /// Starts with the boot-up message, which counts as the first heartbeat.
    pub fn new(period_ms: u16, now_us: u64) -> Self {
        let due_us = after(now_us, micros(period_ms));
        Self { period_ms, due_us }
    }

    pub const fn period_ms(&self) -> u16 {
        self.period_ms
    }

    /// Changes the period; the first heartbeat of the new one is due at once.
    pub fn set_period(&mut self, period_ms: u16, now_us: u64) {
        *self = Self {
            period_ms,
            due_us: now_us,
        };
    }

    /// Tells whether a heartbeat is due and counts it as sent. After a gap the missed ones are not
    /// made up for.
    pub fn is_due(&mut self, now_us: u64) -> bool {
        if self.period_ms == 0 || now_us < self.due_us {
            return false;
        }
        let period_us = micros(self.period_ms);
        self.due_us = after(self.due_us, period_us);
        if self.due_us <= now_us {
            self.due_us = after(now_us, period_us);
        }
        true
    }
}

/// What the consumer makes of a heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Heard {
    /// It had been lost before.
    pub back: bool,
    /// The state, where it differs from the last one.
    pub changed: Option<NmtState>,
}

/// Watches one other node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Consumer {
    node: u8,
    timeout_ms: u16,
    /// When silence ends the node's life; never before it was heard.
    deadline_us: u64,
    /// Silent for too long.
    lost: bool,
    last: Option<NmtState>,
}

impl Consumer {
    pub fn new(configured: Option<(u8, u16)>) -> Self {
        let (node, timeout_ms) = configured.unwrap_or((0, 0));
        Self {
            node,
            timeout_ms,
            deadline_us: NEVER_US,
            lost: false,
            last: None,
        }
    }

    /// Returns object 0x1016, subindex 1.
    pub fn to_raw(self) -> u32 {
        u32::from(self.node) << 16 | u32::from(self.timeout_ms)
    }

    /// Makes a consumer from object 0x1016, subindex 1; it waits for the first heartbeat.
    ///
    /// # Errors
    /// [`Abort::Value`] when reserved bits are set.
    pub fn from_raw(raw: u32) -> Result<Self, Abort> {
        match raw.to_be_bytes() {
            [0, node, high, low] => Ok(Self::new(Some((node, u16::from_be_bytes([high, low]))))),
            _ => Err(Abort::Value),
        }
    }

    /// Returns the watched node; `None` when nothing is watched.
    pub fn node(&self) -> Option<u8> {
        (self.timeout_ms > 0 && matches!(self.node, 1..=127)).then_some(self.node)
    }

    pub fn hear(&mut self, byte: u8, now_us: u64) -> Heard {
        let back = core::mem::take(&mut self.lost);
        self.deadline_us = after(now_us, micros(self.timeout_ms));
        let state = NmtState::from_heartbeat(byte);
        let changed = state.filter(|_| state != self.last);
        self.last = state;
        Heard { back, changed }
    }

    /// Returns the watched node when it has just been lost.
    pub fn expire(&mut self, now_us: u64) -> Option<u8> {
        if now_us < self.deadline_us {
            return None;
        }
        self.deadline_us = NEVER_US;
        self.lost = true;
        self.last = None;
        Some(self.node)
    }
}
