//! Emergencies (CiA 301, 7.2.7, objects 0x1001, 0x1003, 0x1014 and 0x1015).
//!
//! The application raises and clears what is its own; the node raises the errors of its own
//! communication, each once until it is gone.

use heapless::Deque;

use crate::cob_id::{self, FRAME_BIT, INVALID_BIT};
use crate::deadline::after;
use crate::{Abort, NmtCommand};

/// The most messages that wait for the inhibit time, or for the node to leave Stopped.
const WAITING: usize = 8;
/// Errors that object 0x1003 remembers.
pub(crate) const HISTORY: u8 = 8;

/// Error register (0x1001): an error of any kind.
pub const REGISTER_GENERIC: u8 = 1;
/// Error register (0x1001): an error of communication.
pub const REGISTER_COMMUNICATION: u8 = 1 << 4;

/// An error that the node itself finds, as a bit of [`Emergency::faults`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// The watched node fell silent.
    Heartbeat,
    /// SYNC has the wrong length.
    SyncLength,
    /// RPDO 1–4 is too short.
    RpdoLength(u8),
}

impl Fault {
    const fn bit(self) -> u8 {
        match self {
            Self::Heartbeat => 1,
            Self::SyncLength => 2,
            Self::RpdoLength(number) => 4 << (number.wrapping_sub(1) & 3),
        }
    }

    const fn code(self) -> u16 {
        match self {
            Self::Heartbeat => 0x8130,
            Self::SyncLength => 0x8240,
            Self::RpdoLength(_) => 0x8210,
        }
    }
}

/// The last errors, the newest first.
#[derive(Clone, Copy, Debug)]
struct History {
    errors: [u32; HISTORY as usize],
    length: u8,
}

impl History {
    const EMPTY: Self = Self {
        errors: [0; HISTORY as usize],
        length: 0,
    };

    /// Records an error; the oldest is forgotten when there is no room.
    fn record(&mut self, error: u32) {
        let mut moved = error;
        for slot in &mut self.errors {
            core::mem::swap(slot, &mut moved);
        }
        self.length = (self.length + 1).min(HISTORY);
    }
}

/// What is wrong, what was wrong, and what the bus has not been told yet.
#[derive(Clone, Debug)]
pub(crate) struct Emergency {
    cob_id: u16,
    enabled: bool,
    inhibit_100us: u16,
    quiet_until_us: u64,
    application: u8,
    faults: u8,
    waiting: Deque<[u8; 8], WAITING>,
    history: History,
    dropped: u32,
}

impl Emergency {
    /// Makes one that [`reset`](Self::reset) must follow.
    pub const fn new() -> Self {
        Self {
            cob_id: 0,
            enabled: false,
            inhibit_100us: 0,
            quiet_until_us: 0,
            application: 0,
            faults: 0,
            waiting: Deque::new(),
            history: History::EMPTY,
            dropped: 0,
        }
    }

    /// Starts anew but for the counter and, where only the communication is reset, the
    /// application's errors and the history.
    pub fn reset(&mut self, command: NmtCommand, node_id: u8) {
        self.cob_id = 0x080 + u16::from(node_id);
        self.enabled = true;
        self.inhibit_100us = 0;
        self.quiet_until_us = 0;
        self.faults = 0;
        self.waiting.clear();
        if command == NmtCommand::ResetNode {
            self.application = 0;
            self.clear_history();
        }
    }

    /// Returns object 0x1001.
    pub const fn register(&self) -> u8 {
        let communication = if self.faults != 0 {
            REGISTER_COMMUNICATION
        } else {
            0
        };
        let all = self.application | communication;
        if all != 0 { all | REGISTER_GENERIC } else { 0 }
    }

    pub const fn dropped(&self) -> u32 {
        self.dropped
    }

    pub const fn cob_id(&self) -> u16 {
        self.cob_id
    }

    /// Records an error of the application.
    pub fn raise(&mut self, code: u16, register_bits: u8, detail: [u8; 5]) {
        self.application |= register_bits | REGISTER_GENERIC;
        self.report(code, detail);
    }

    /// Takes back errors of the application; the generic bit goes with the last of them.
    pub fn clear(&mut self, register_bits: u8) {
        self.application &= !register_bits;
        if self.application == REGISTER_GENERIC {
            self.application = 0;
        }
        self.send(0, [0; 5]);
    }

    /// Records an error of the node's communication unless it is there already.
    #[inline(never)] // One copy in flash.
    pub fn raise_fault(&mut self, fault: Fault, detail: u8) {
        if self.faults & fault.bit() == 0 {
            self.faults |= fault.bit();
            self.report(fault.code(), [detail, 0, 0, 0, 0]);
        }
    }

    /// Takes back an error of the node's communication if it is there.
    #[inline]
    pub fn clear_fault(&mut self, fault: Fault) {
        if self.faults != 0 {
            self.end_fault(fault);
        }
    }

    #[inline(never)] // One copy in flash.
    fn end_fault(&mut self, fault: Fault) {
        if self.faults & fault.bit() != 0 {
            self.faults &= !fault.bit();
            self.send(0, [0; 5]);
        }
    }

    #[inline(never)] // One copy in flash.
    fn report(&mut self, code: u16, detail: [u8; 5]) {
        let [first, second, ..] = detail;
        let information = u16::from_le_bytes([first, second]);
        self.history
            .record(u32::from(information) << 16 | u32::from(code));
        self.send(code, detail);
    }

    #[inline(never)] // One copy in flash.
    fn send(&mut self, code: u16, detail: [u8; 5]) {
        let [low, high] = code.to_le_bytes();
        let [a, b, c, d, e] = detail;
        let message = [low, high, self.register(), a, b, c, d, e];
        if self.enabled && self.waiting.push_back(message).is_err() {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    /// Tells whether a message waits.
    #[inline]
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Takes the next message that may be sent now.
    pub fn next(&mut self, now_us: u64) -> Option<[u8; 8]> {
        if now_us < self.quiet_until_us {
            return None;
        }
        let message = self.waiting.pop_front()?;
        self.quiet_until_us = after(now_us, u32::from(self.inhibit_100us) * 100);
        Some(message)
    }

    /// Returns how many errors object 0x1003 holds.
    pub const fn history_length(&self) -> u8 {
        self.history.length
    }

    /// Returns an error of object 0x1003, 1 being the newest.
    ///
    /// # Errors
    /// [`Abort::NoData`] where none has been recorded, [`Abort::NoSubindex`] beyond the last.
    pub fn history(&self, subindex: u8) -> Result<u32, Abort> {
        if subindex == 0 || subindex > HISTORY {
            return Err(Abort::NoSubindex);
        }
        let recorded = self.history.errors.get(..usize::from(self.history.length));
        let newest_first = usize::from(subindex) - 1;
        recorded
            .and_then(|errors| errors.get(newest_first))
            .copied()
            .ok_or(Abort::NoData)
    }

    pub fn clear_history(&mut self) {
        self.history = History::EMPTY;
    }

    /// Returns object 0x1014.
    pub fn raw_cob_id(&self) -> u32 {
        u32::from(self.cob_id) | if self.enabled { 0 } else { INVALID_BIT }
    }

    /// Writes object 0x1014.
    ///
    /// # Errors
    /// [`Abort::Value`] for an identifier that can't be, or another one while emergencies are
    /// enabled.
    pub fn write_cob_id(&mut self, raw: u32) -> Result<(), Abort> {
        let enable = raw & INVALID_BIT == 0;
        if raw & (FRAME_BIT | cob_id::NO_REMOTE_BIT) != 0 {
            return Err(Abort::Value);
        }
        let cob_id = cob_id::parse(raw)?;
        if self.enabled && enable && cob_id != self.cob_id {
            return Err(Abort::Value);
        }
        self.cob_id = cob_id;
        self.enabled = enable;
        if !enable {
            self.waiting.clear();
        }
        Ok(())
    }

    /// Tells whether emergencies are sent.
    pub const fn is_enabled(&self) -> bool {
        self.enabled
    }

    /// Takes a stored identifier over; `None` for one that can't be.
    pub fn restore(&mut self, cob_id: u16, enabled: bool) -> Option<()> {
        self.cob_id = cob_id::parse(u32::from(cob_id)).ok()?;
        self.enabled = enabled;
        Some(())
    }

    /// Returns object 0x1015 in 100 µs.
    pub const fn inhibit_100us(&self) -> u16 {
        self.inhibit_100us
    }

    pub fn set_inhibit(&mut self, inhibit_100us: u16) {
        self.inhibit_100us = inhibit_100us;
    }
}
