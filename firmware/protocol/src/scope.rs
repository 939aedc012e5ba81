//! What the scope captured: the bytes of object 0x2100:2, and the codes of 0x2050.

use eel_canopen::Mapped;

use crate::dictionary::{self, Served};

/// The layout of a capture; another one has another number.
pub const SCOPE_VERSION: u8 = 1;
/// Channels of the scope.
pub const SCOPE_CHANNELS: usize = 4;
/// Bytes before the samples of a capture.
pub const SCOPE_HEADER: usize = 36;
/// Stands in the place of a fault's sample where there was none.
const NO_FAULT: u16 = u16::MAX;

/// What writing 0x2050:6 begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Trigger {
    /// Nothing; what runs ends.
    #[default]
    Stop = 0,
    /// A capture until memory is full.
    Once = 1,
    /// A capture that goes on until a fault or stop, and for half the memory after it.
    Fault = 2,
}

/// What the scope does, 0x2050:7.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum ScopeState {
    /// Nothing; it may hold samples.
    #[default]
    Stopped = 0,
    /// It captures until memory is full.
    Filling = 1,
    /// It captures over what is old until a fault comes.
    Waiting = 2,
    /// It captures what follows a fault.
    Ending = 3,
    /// It has captured all it was told to.
    Full = 4,
}

/// The head of a capture. On the wire, little-endian: version u8, state u8, trigger u8, channels in use
/// u8, divider u16, samples u16, time of the first sample u64, sample of the fault u16 (65 535: none),
/// 0 u16, the four channels u32. Then sample after sample, oldest first, an i32 of each channel in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScopeHeader {
    /// What the scope was doing when it was read.
    pub state: ScopeState,
    /// How the capture was begun.
    pub trigger: Trigger,
    /// Control ticks of 1 ms from one sample to the next.
    pub divider: u16,
    /// How many samples follow.
    pub samples: u16,
    /// Time of the first sample in µs since power-up.
    pub first_us: u64,
    /// Which sample, from 0, was the first after the fault.
    pub fault: Option<u16>,
    /// The entries that were captured, as a PDO maps them; 0 is none.
    pub channels: [u32; SCOPE_CHANNELS],
}

/// Why bytes are no capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScopeError {
    /// They are of another version.
    Version,
    /// They are more or fewer than the header says.
    Length,
    /// A code means nothing.
    Value,
}

impl Trigger {
    /// Returns the trigger of a code.
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Stop),
            1 => Some(Self::Once),
            2 => Some(Self::Fault),
            _ => None,
        }
    }
}

impl ScopeState {
    /// Returns the state of a code.
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Stopped),
            1 => Some(Self::Filling),
            2 => Some(Self::Waiting),
            3 => Some(Self::Ending),
            4 => Some(Self::Full),
            _ => None,
        }
    }

    /// Tells whether samples are being taken.
    pub const fn is_running(self) -> bool {
        matches!(self, Self::Filling | Self::Waiting | Self::Ending)
    }
}

impl ScopeHeader {
    /// Returns how many channels are in use.
    pub fn width(&self) -> usize {
        self.channels
            .iter()
            .filter(|channel| **channel != 0)
            .count()
    }

    /// Packs the header.
    pub fn to_bytes(&self) -> [u8; SCOPE_HEADER] {
        let [d0, d1] = self.divider.to_le_bytes();
        let [s0, s1] = self.samples.to_le_bytes();
        let [f0, f1] = self.fault.unwrap_or(NO_FAULT).to_le_bytes();
        let [a, b, c, d, e, f, g, h] = self.first_us.to_le_bytes();
        let (state, trigger, width) = (self.state as u8, self.trigger as u8, self.width() as u8);
        let mut bytes = [0; SCOPE_HEADER];
        let head = [
            SCOPE_VERSION,
            state,
            trigger,
            width,
            d0,
            d1,
            s0,
            s1,
            a,
            b,
            c,
            d,
            e,
            f,
            g,
            h,
            f0,
            f1,
            0,
            0,
        ];
        let channels = self.channels.into_iter().flat_map(u32::to_le_bytes);
        for (to, from) in bytes.iter_mut().zip(head.into_iter().chain(channels)) {
            *to = from;
        }
        bytes
    }

    /// Takes a capture apart: its header, and the bytes of its samples.
    ///
    /// # Errors
    /// Where the bytes are of another version or length, or hold a code that means nothing.
    pub fn from_bytes(bytes: &[u8]) -> Result<(Self, &[u8]), ScopeError> {
        if bytes.first() != Some(&SCOPE_VERSION) {
            return Err(ScopeError::Version);
        }
        let (head, samples) = bytes
            .split_first_chunk::<SCOPE_HEADER>()
            .ok_or(ScopeError::Length)?;
        let &[
            _,
            state,
            trigger,
            width,
            d0,
            d1,
            s0,
            s1,
            a,
            b,
            c,
            d,
            e,
            f,
            g,
            h,
            f0,
            f1,
            _,
            _,
            ref rest @ ..,
        ] = head;
        let mut channels = [0; SCOPE_CHANNELS];
        let (words, _) = rest.as_chunks();
        for (channel, word) in channels.iter_mut().zip(words) {
            *channel = u32::from_le_bytes(*word);
        }
        let fault = u16::from_le_bytes([f0, f1]);
        let header = Self {
            state: ScopeState::from_code(state).ok_or(ScopeError::Value)?,
            trigger: Trigger::from_code(trigger).ok_or(ScopeError::Value)?,
            divider: u16::from_le_bytes([d0, d1]),
            samples: u16::from_le_bytes([s0, s1]),
            first_us: u64::from_le_bytes([a, b, c, d, e, f, g, h]),
            fault: (fault != NO_FAULT).then_some(fault),
            channels,
        };
        if usize::from(width) != header.width() {
            return Err(ScopeError::Value);
        }
        if samples.len() != 4 * header.width() * usize::from(header.samples) {
            return Err(ScopeError::Length);
        }
        Ok((header, samples))
    }
}

/// Returns the entry that a channel captures: a number that may be read, in its whole length; `None`
/// for any other.
pub fn captured(channel: u32) -> Option<&'static Served> {
    let Mapped {
        index,
        subindex,
        bits,
    } = Mapped::from_raw(channel);
    let entry = dictionary::served(index, subindex).ok()?;
    (!entry.data_type.is_domain() && entry.data_type.bits() == bits).then_some(entry)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    const HEADER: ScopeHeader = ScopeHeader {
        state: ScopeState::Full,
        trigger: Trigger::Fault,
        divider: 5,
        samples: 2,
        first_us: 0x0807_0605_0403_0201,
        fault: Some(1),
        channels: [0x2010_0110, 0, 0x2030_0110, 0],
    };

    #[test]
    fn a_header_is_these_bytes() {
        let pinned = [
            1, 4, 2, 2, 5, 0, 2, 0, 1, 2, 3, 4, 5, 6, 7, 8, 1, 0, 0, 0, 0x10, 0x01, 0x10, 0x20, 0,
            0, 0, 0, 0x10, 0x01, 0x30, 0x20, 0, 0, 0, 0,
        ];
        assert_eq!(HEADER.to_bytes(), pinned);
        let capture: Vec<u8> = pinned.into_iter().chain(0..16).collect();
        let (header, samples) = ScopeHeader::from_bytes(&capture).unwrap();
        assert_eq!(header, HEADER);
        assert!(samples.iter().copied().eq(0..16));
        for (wrong, error) in [
            (&capture[..51], ScopeError::Length),
            (&capture[..20], ScopeError::Length),
            (&[], ScopeError::Version),
        ] {
            assert_eq!(ScopeHeader::from_bytes(wrong), Err(error));
        }
    }

    #[test]
    fn a_channel_captures_numbers_in_their_length_only() {
        let field = captured(0x2010_0110).map(|entry| entry.field);
        assert_eq!(field, Some(dictionary::Field::PoseYaw));
        for wrong in [0, 0x2010_0120, 0x2010_0010, 0x2101_0100, 0x1001_0008, 7] {
            assert_eq!(captured(wrong), None, "{wrong:X}");
        }
    }
}
