//! The scope, object 0x2050: up to four entries, tick by tick, in a ring of 4 KB.

use eel_canopen::Abort;
use eel_protocol::dictionary::Field;
use eel_protocol::scope::{
    SCOPE_CHANNELS, SCOPE_HEADER, ScopeHeader, ScopeState, Trigger, captured,
};
use eel_units::Instant;

/// Numbers that are kept.
const WORDS: usize = 1_024;
/// Control tick in µs.
const TICK_US: u64 = 1_000;

/// What is captured, and what has been.
#[derive(Clone, Debug)]
pub(crate) struct Scope {
    channels: [u32; SCOPE_CHANNELS],
    divider: u16,
    trigger: Trigger,
    state: ScopeState,
    memory: [i32; WORDS],
    /// Where the next sample goes, counted in samples.
    next: u16,
    /// How many samples are kept.
    samples: u16,
    /// How many of them came since the fault.
    since_fault: Option<u16>,
    /// Ticks until the next sample.
    pause: u16,
    newest: Instant,
    /// The head of the capture that is being read.
    header: [u8; SCOPE_HEADER],
}

impl Default for Scope {
    fn default() -> Self {
        Self {
            channels: [0; SCOPE_CHANNELS],
            divider: 1,
            trigger: Trigger::Stop,
            state: ScopeState::Stopped,
            memory: [0; WORDS],
            next: 0,
            samples: 0,
            since_fault: None,
            pause: 0,
            newest: Instant::ZERO,
            header: [0; SCOPE_HEADER],
        }
    }
}

impl Scope {
    /// Returns the number of one of its fields; 0 of any other.
    pub fn value(&self, field: Field) -> i64 {
        let [one, two, three, four] = self.channels.map(i64::from);
        match field {
            Field::ScopeChannel1 => one,
            Field::ScopeChannel2 => two,
            Field::ScopeChannel3 => three,
            Field::ScopeChannel4 => four,
            Field::ScopeDivider => i64::from(self.divider),
            Field::ScopeTrigger => self.trigger as i64,
            Field::ScopeState => self.state as i64,
            Field::ScopeSamples => i64::from(self.samples),
            _ => 0,
        }
    }

    /// Writes one of its fields, which has been held against its bounds.
    ///
    /// # Errors
    /// [`Abort::DeviceState`] while it captures, or without a channel to capture;
    /// [`Abort::NotMappable`] for a channel that is no number of the dictionary.
    pub fn set(&mut self, field: Field, value: i64) -> Result<(), Abort> {
        let channel = match field {
            Field::ScopeTrigger => return self.begin(value as u8),
            Field::ScopeChannel1 => Some(0),
            Field::ScopeChannel2 => Some(1),
            Field::ScopeChannel3 => Some(2),
            Field::ScopeChannel4 => Some(3),
            Field::ScopeDivider => None,
            _ => return Err(Abort::ReadOnly),
        };
        if self.state.is_running() {
            return Err(Abort::DeviceState);
        }
        let raw = value as u32;
        if channel.is_some() && raw != 0 && captured(raw).is_none() {
            return Err(Abort::NotMappable);
        }
        match channel.and_then(|channel: usize| self.channels.get_mut(channel)) {
            Some(kept) => *kept = raw,
            None => self.divider = value as u16,
        }
        // What was captured is not what is set now.
        self.forget();
        Ok(())
    }

    /// Begins a capture, or ends it.
    fn begin(&mut self, code: u8) -> Result<(), Abort> {
        let trigger = Trigger::from_code(code).ok_or(Abort::Value)?;
        let state = match trigger {
            Trigger::Stop => {
                self.end();
                return Ok(());
            }
            Trigger::Once => ScopeState::Filling,
            Trigger::Fault => ScopeState::Waiting,
        };
        if self.width() == 0 {
            return Err(Abort::DeviceState);
        }
        self.forget();
        self.trigger = trigger;
        self.state = state;
        Ok(())
    }

    /// Ends a capture that runs, and keeps it.
    fn end(&mut self) {
        if self.state.is_running() {
            self.state = ScopeState::Stopped;
        }
    }

    fn forget(&mut self) {
        self.state = ScopeState::Stopped;
        self.next = 0;
        self.samples = 0;
        self.since_fault = None;
        self.pause = 0;
    }

    /// Returns how many channels are in use.
    fn width(&self) -> u16 {
        self.channels.iter().map(|raw| u16::from(*raw != 0)).sum()
    }

    /// Returns how many samples find room.
    const fn room(width: u16) -> u16 {
        match width {
            0 => 0,
            1 => WORDS as u16,
            2 => WORDS as u16 / 2,
            3 => WORDS as u16 / 3,
            _ => WORDS as u16 / 4,
        }
    }

    /// Returns the channels if a sample is due in this tick. `is_fault`: a fault or stop was raised since
    /// the last tick.
    pub fn due(&mut self, is_fault: bool) -> Option<[u32; SCOPE_CHANNELS]> {
        if !self.state.is_running() {
            return None;
        }
        if is_fault && self.state == ScopeState::Waiting {
            self.state = ScopeState::Ending;
            self.since_fault = Some(0);
        }
        if let Some(left) = self.pause.checked_sub(1) {
            self.pause = left;
            return None;
        }
        self.pause = self.divider.saturating_sub(1);
        Some(self.channels)
    }

    /// Takes a sample: a number for each channel, of which those in use are kept.
    pub fn take(&mut self, now: Instant, values: [i32; SCOPE_CHANNELS]) {
        let width = self.width();
        let room = Self::room(width);
        let start = usize::from(self.next) * usize::from(width);
        let used = values
            .into_iter()
            .zip(self.channels)
            .filter(|(_, channel)| *channel != 0);
        for (slot, (value, _)) in self.memory.iter_mut().skip(start).zip(used) {
            *slot = value;
        }
        self.newest = now;
        self.next += 1;
        if self.next >= room {
            self.next = 0;
        }
        self.samples = room.min(self.samples + 1);
        let since = self.since_fault.as_mut();
        let after = since.map_or(0, |since| {
            *since += 1;
            *since
        });
        let is_full = match self.state {
            ScopeState::Filling => self.samples == room,
            ScopeState::Ending => after >= room / 2,
            _ => false,
        };
        if is_full {
            self.state = ScopeState::Full;
        }
    }

    /// Ends the capture, opens it and returns its length.
    pub fn open(&mut self) -> u32 {
        let header = self.describe();
        self.end();
        self.header = header.to_bytes();
        SCOPE_HEADER as u32 + 4 * u32::from(self.width()) * u32::from(self.samples)
    }

    fn describe(&self) -> ScopeHeader {
        let before = u64::from(self.samples.saturating_sub(1)) * u64::from(self.divider) * TICK_US;
        ScopeHeader {
            state: self.state,
            trigger: self.trigger,
            divider: self.divider,
            samples: self.samples,
            first_us: self.newest.to_micros().saturating_sub(before),
            fault: self
                .since_fault
                .filter(|since| *since > 0)
                .map(|since| self.samples.saturating_sub(since)),
            channels: self.channels,
        }
    }

    /// Copies the opened capture from `offset` on.
    pub fn read(&self, offset: u32, out: &mut [u8]) -> usize {
        let mut count = 0;
        for (to, place) in out.iter_mut().zip(offset as usize..) {
            let Some(byte) = self.byte(place) else { break };
            *to = byte;
            count += 1;
        }
        count
    }

    /// Returns a byte of the capture.
    fn byte(&self, place: usize) -> Option<u8> {
        let Some(place) = place.checked_sub(SCOPE_HEADER) else {
            return self.header.get(place).copied();
        };
        let width = usize::from(self.width());
        let (room, samples) = (
            usize::from(Self::room(self.width())),
            usize::from(self.samples),
        );
        let word = place / 4;
        if word >= width * samples {
            return None;
        }
        // The oldest sample stands where the next one goes, once memory is full.
        let first = if samples == room {
            usize::from(self.next)
        } else {
            0
        };
        let mut at = first * width + word;
        if at >= room * width {
            at -= room * width;
        }
        let [a, b, c, d] = self.memory.get(at)?.to_le_bytes();
        Some(match place % 4 {
            0 => a,
            1 => b,
            2 => c,
            _ => d,
        })
    }
}

#[cfg(test)]
mod tests;
