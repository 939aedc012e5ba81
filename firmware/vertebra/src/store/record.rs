//! What is kept over a loss of power, as bytes.

use eel_canopen::STORED_PARAMETERS;
use eel_protocol::dictionary;
use eel_protocol::{Crc32, NodeId};
use heapless::Vec;

use crate::settings::Settings;

/// The layout; another one has another number.
const LAYOUT: u8 = 1;
/// Length of what stands before the parameters: sequence u32, layout u8, node id u8, flags u8, 0 u8,
/// lengths of the parameters and of the settings u16 each, CRC-32 u32 over all the rest.
const HEAD: usize = 16;
/// Set where settings had been stored and are lost.
const LOST: u8 = 1;
/// Length of a setting: index u16, subindex u8, number 32 bits.
const SETTING: usize = 7;
/// The most settings that a record holds.
const SETTINGS: usize = 40;
/// Stands for no node id.
const UNCONFIGURED: u8 = 0xFF;

/// The most bytes that a record takes.
pub(crate) const RECORD_BYTES: usize = HEAD + STORED_PARAMETERS + SETTING * SETTINGS;

/// What a vertebra keeps over a loss of power: its place, its communication parameters, its settings.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Record {
    /// The place in the chain that LSS has stored.
    pub(crate) node: Option<NodeId>,
    /// What [`eel_canopen::Node::save_parameters`] wrote; empty for the defaults.
    pub(crate) communication: Vec<u8, STORED_PARAMETERS>,
    /// The settings, as [`Record::keep_settings`] wrote them; empty for the defaults.
    settings: Vec<u8, { SETTING * SETTINGS }>,
    /// Whether settings had been stored before and are lost.
    pub(crate) lost: bool,
}

impl Record {
    /// Tells whether it holds nothing that a new vertebra does not have.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Keeps the settings as they are.
    #[inline(never)] // One copy in flash.
    pub(crate) fn keep_settings(&mut self, settings: &Settings) {
        self.settings.clear();
        for (index, subindex) in dictionary::settings() {
            let field = dictionary::served(index, subindex).map(|entry| entry.field);
            let Some(value) = field.ok().and_then(|field| settings.value(field)) else {
                continue;
            };
            let [low, high] = index.to_le_bytes();
            let [a, b, c, d] = (value as u32).to_le_bytes();
            // There is room: a test holds that the dictionary has fewer settings.
            let entry = [low, high, subindex, a, b, c, d];
            let _ = self.settings.extend_from_slice(&entry);
        }
    }

    /// Forgets the settings; the defaults hold.
    pub(crate) fn forget_settings(&mut self) {
        self.settings.clear();
    }

    /// Puts the kept settings in the place of those of `settings`. A setting that this firmware does not
    /// have is left out. Tells whether all others are within their bounds; if not, `settings` is as before.
    #[inline(never)] // One copy in flash.
    pub(crate) fn apply_settings(&self, settings: &mut Settings) -> bool {
        let mut changed = *settings;
        let (entries, rest) = self.settings.as_chunks();
        for entry in entries {
            let &[low, high, subindex, number @ ..]: &[u8; SETTING] = entry;
            let index = u16::from_le_bytes([low, high]);
            let is_known = dictionary::settings().any(|place| place == (index, subindex));
            let Some(known) = dictionary::served(index, subindex)
                .ok()
                .filter(|_| is_known)
            else {
                continue;
            };
            let raw = u32::from_le_bytes(number);
            let value = if known.data_type.is_signed() {
                i64::from(raw as i32)
            } else {
                i64::from(raw)
            };
            let (least, most) = known.bounds();
            if value < least || value > most || !changed.set(known.field, value) {
                return false;
            }
        }
        if !rest.is_empty() || !changed.are_sound() {
            return false;
        }
        *settings = changed;
        true
    }

    /// Packs the record.
    pub(crate) fn to_bytes(&self, sequence: u32) -> Vec<u8, RECORD_BYTES> {
        let mut head = [0; HEAD];
        let node = self.node.map_or(UNCONFIGURED, NodeId::get);
        let flags = if self.lost { LOST } else { 0 };
        let lengths = [self.communication.len(), self.settings.len()];
        let fields = sequence
            .to_le_bytes()
            .into_iter()
            .chain([LAYOUT, node, flags, 0])
            .chain(
                lengths
                    .into_iter()
                    .flat_map(|length| (length as u16).to_le_bytes()),
            );
        for (to, from) in head.iter_mut().zip(fields) {
            *to = from;
        }
        let crc = check(&head, &[&self.communication, &self.settings]);
        for (to, from) in head.iter_mut().skip(HEAD - 4).zip(crc.to_le_bytes()) {
            *to = from;
        }
        let mut bytes = Vec::new();
        for part in [&head[..], &self.communication, &self.settings] {
            // There is room: it is the sum of the parts' own.
            let _ = bytes.extend_from_slice(part);
        }
        bytes
    }

    /// Unpacks a record and its sequence number; what follows it is ignored. `None` where the bytes are
    /// none, of another layout, or damaged.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Option<(u32, Self)> {
        let (head, rest) = bytes.split_first_chunk::<HEAD>()?;
        let &[
            a,
            b,
            c,
            d,
            layout,
            node,
            flags,
            zero,
            p0,
            p1,
            s0,
            s1,
            crc @ ..,
        ] = head;
        let (communication, rest) = rest.split_at_checked(length(p0, p1))?;
        let settings = rest.get(..length(s0, s1))?;
        let expected = check(head, &[communication, settings]);
        if layout != LAYOUT || zero != 0 || flags > LOST || u32::from_le_bytes(crc) != expected {
            return None;
        }
        let record = Self {
            node: NodeId::new(node),
            communication: Vec::from_slice(communication).ok()?,
            settings: Vec::from_slice(settings).ok()?,
            lost: flags == LOST,
        };
        Some((u32::from_le_bytes([a, b, c, d]), record))
    }
}

fn length(low: u8, high: u8) -> usize {
    usize::from(u16::from_le_bytes([low, high]))
}

/// Returns the check over a head without its own place, and over the parts.
fn check(head: &[u8; HEAD], parts: &[&[u8]; 2]) -> u32 {
    let mut crc = Crc32::default();
    let [checked @ .., _, _, _, _] = head;
    crc.update(checked);
    for part in parts {
        crc.update(part);
    }
    crc.value()
}

#[cfg(test)]
mod tests {
    use std::vec::Vec as List;

    use super::*;
    use eel_protocol::dictionary::Field;

    fn prototype() -> Settings {
        Settings::prototype(NodeId::FIRST, 1)
    }

    fn record() -> Record {
        let mut record = Record {
            node: NodeId::new(7),
            communication: Vec::from_slice(&[1, 2, 3, 4, 5]).unwrap(),
            ..Record::default()
        };
        let mut settings = prototype();
        assert!(settings.set(Field::StiffnessY, 123_456));
        assert!(settings.set(Field::RangeRoll, 500));
        record.keep_settings(&settings);
        record
    }

    #[test]
    fn a_record_survives_the_way_to_bytes_and_back() {
        let lost = Record {
            lost: true,
            ..Record::default()
        };
        for record in [record(), Record::default(), lost] {
            let mut bytes: List<u8> = record.to_bytes(0xFFFF_FFFE).to_vec();
            bytes.extend([0xFF; 5]);
            assert_eq!(Record::from_bytes(&bytes), Some((0xFFFF_FFFE, record)));
        }
    }

    #[test]
    fn every_bit_is_protected() {
        let bytes = record().to_bytes(3);
        for at in 0..8 * bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at / 8] ^= 1 << (at % 8);
            assert_eq!(Record::from_bytes(&damaged), None, "bit {at}");
        }
        for length in 0..bytes.len() {
            assert_eq!(Record::from_bytes(&bytes[..length]), None);
        }
    }

    #[test]
    fn settings_come_back_and_there_is_room_for_all() {
        let mut settings = prototype();
        assert!(record().apply_settings(&mut settings));
        assert_eq!(settings.value(Field::StiffnessY), Some(123_456));
        assert_eq!(settings.value(Field::RangeRoll), Some(500));
        assert_eq!(settings.value(Field::RangeYaw), Some(5_236));
        let count = dictionary::settings().count();
        assert!(count <= SETTINGS);
        assert_eq!(record().settings.len(), SETTING * count);
        for (index, subindex) in dictionary::settings() {
            let (_, sub) = dictionary::find(index, subindex).unwrap();
            let fresh = Settings::prototype(NodeId::FIRST, 0);
            assert_eq!(fresh.value(sub.field), Some(sub.default));
        }
    }

    /// Whoever made the record may have had other bounds, or other settings.
    #[test]
    fn settings_out_of_bounds_are_refused_and_unknown_ones_are_left_out() {
        let entry = |index: u16, subindex: u8, value: u32| {
            let [low, high] = index.to_le_bytes();
            let [a, b, c, d] = value.to_le_bytes();
            [low, high, subindex, a, b, c, d]
        };
        let apply = |entries: &[[u8; SETTING]]| {
            let mut settings = prototype();
            let mut record = Record::default();
            for entry in entries {
                record.settings.extend_from_slice(entry).unwrap();
            }
            let is_good = record.apply_settings(&mut settings);
            (is_good, settings.value(Field::RangeYaw).unwrap())
        };
        let good = entry(0x2020, 8, 1_000);
        assert_eq!(apply(&[good]), (true, 1_000));
        assert_eq!(apply(&[good, entry(0x2020, 8, 5_237)]), (false, 5_236));
        assert_eq!(apply(&[good, entry(0x2020, 9, u32::MAX)]), (false, 5_236));
        assert_eq!(apply(&[good, entry(0x2020, 7, 0)]), (false, 5_236));
        assert_eq!(apply(&[good, entry(0x2020, 99, 0)]), (true, 1_000));
        assert_eq!(apply(&[good, entry(0x2000, 1, 0)]), (true, 1_000));
        let mut torn = record();
        torn.settings.pop();
        assert!(!torn.apply_settings(&mut prototype()));
    }
}
