//! A transmit PDO: when it is due.

use super::{Direction, Parameters};
use crate::deadline::{after, micros};
use crate::{Abort, PdoDefault};

/// A transmit PDO.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tpdo {
    pub parameters: Parameters,
    inhibit_100us: u16,
    event_ms: u16,
    sync_start: u8,
    /// SYNCs until the next transmission.
    countdown: u8,
    /// Waits for the SYNC whose counter is `sync_start`.
    awaits_start: bool,
    requested: bool,
    inhibited_until_us: u64,
    event_due_us: u64,
}

impl Tpdo {
    pub const fn absent() -> Self {
        Self {
            parameters: Parameters::absent(),
            inhibit_100us: 0,
            event_ms: 0,
            sync_start: 0,
            countdown: 0,
            awaits_start: false,
            requested: false,
            inhibited_until_us: 0,
            event_due_us: 0,
        }
    }

    /// Returns to the default for node `node_id`, if the node has the PDO.
    pub fn reset(&mut self, default: Option<&PdoDefault>, node_id: u8) {
        if let Some(default) = default {
            self.parameters.reset(Direction::Transmit, default, node_id);
        }
        self.inhibit_100us = 0;
        self.event_ms = 0;
        self.sync_start = 0;
        self.restart(0);
    }

    /// Begins to count SYNCs and time: the node entered Operational, or the PDO was changed.
    #[inline(never)] // One copy in flash.
    pub fn restart(&mut self, now_us: u64) {
        self.countdown = self.parameters.transmission();
        self.awaits_start = self.sync_start != 0;
        self.requested = false;
        self.inhibited_until_us = now_us;
        self.event_due_us = after(now_us, micros(self.event_ms));
    }

    /// Asks for one transmission.
    pub fn request(&mut self) {
        self.requested = self.parameters.is_enabled();
    }

    /// Counts a SYNC and tells whether the PDO is due with it.
    #[inline]
    pub fn is_due_at_sync(&mut self, counter: Option<u8>) -> bool {
        self.parameters.is_enabled() && self.count_sync(counter)
    }

    #[inline(never)] // One copy in flash.
    fn count_sync(&mut self, counter: Option<u8>) -> bool {
        match self.parameters.transmission() {
            0 => core::mem::take(&mut self.requested),
            period @ 1..=240 => {
                if self.awaits_start && counter.is_some_and(|counter| counter != self.sync_start) {
                    return false;
                }
                let starts = core::mem::take(&mut self.awaits_start) && counter.is_some();
                self.countdown = self.countdown.saturating_sub(1);
                let due = starts || self.countdown == 0;
                if due {
                    self.countdown = period;
                }
                due
            }
            _ => false,
        }
    }

    /// Tells whether an event-driven PDO is due, and counts it as sent.
    #[inline(never)] // One copy in flash.
    pub fn is_due_at(&mut self, now_us: u64) -> bool {
        if !self.parameters.is_enabled() || self.parameters.is_synchronous() {
            return false;
        }
        let is_wanted = self.requested || self.event_ms > 0 && now_us >= self.event_due_us;
        if !is_wanted || now_us < self.inhibited_until_us {
            return false;
        }
        self.requested = false;
        self.inhibited_until_us = after(now_us, u32::from(self.inhibit_100us) * 100);
        self.event_due_us = after(now_us, micros(self.event_ms));
        true
    }

    /// Returns object 0x1800, subindex 3, in 100 µs.
    pub const fn inhibit_100us(&self) -> u16 {
        self.inhibit_100us
    }

    /// Writes object 0x1800, subindex 3.
    ///
    /// # Errors
    /// [`Abort::Value`] while the PDO is enabled.
    pub fn write_inhibit(&mut self, inhibit_100us: u16) -> Result<(), Abort> {
        if self.parameters.is_enabled() {
            return Err(Abort::Value);
        }
        self.inhibit_100us = inhibit_100us;
        Ok(())
    }

    /// Returns object 0x1800, subindex 5, in milliseconds.
    pub const fn event_ms(&self) -> u16 {
        self.event_ms
    }

    pub fn set_event(&mut self, event_ms: u16) {
        self.event_ms = event_ms;
    }

    /// Returns object 0x1800, subindex 6.
    pub const fn sync_start(&self) -> u8 {
        self.sync_start
    }

    /// Writes object 0x1800, subindex 6.
    ///
    /// # Errors
    /// [`Abort::Value`] while the PDO is enabled, and above 240.
    pub fn write_sync_start(&mut self, sync_start: u8) -> Result<(), Abort> {
        if self.parameters.is_enabled() || sync_start > 240 {
            return Err(Abort::Value);
        }
        self.sync_start = sync_start;
        Ok(())
    }

    /// Takes stored parameters over; `None` for those that can't be written either.
    pub fn restore(&mut self, inhibit_100us: u16, event_ms: u16, sync_start: u8) -> Option<()> {
        self.inhibit_100us = inhibit_100us;
        self.event_ms = event_ms;
        self.sync_start = sync_start;
        (sync_start <= 240).then_some(())
    }
}
