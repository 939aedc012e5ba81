//! Names of the entries of the communication area (0x1000–0x1FFF), such as `heartbeat.producer`,
//! beside those that an EDS must print.
//!
//! Types and access come from the table behind the EDS; here are the names by which people ask
//! tools for an entry, and the worth of a step.

use core::fmt;

use crate::dictionary::Scale;
use crate::export::{AREA, Item, MAPPED, PARAMETERS};
use crate::pdo::{RPDOS, TPDOS};

/// An entry of the communication area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its index.
    pub index: u16,
    /// Its subindex.
    pub subindex: u8,
    /// The name that the EDS prints, such as `Producer heartbeat time`.
    pub title: &'static str,
    /// The index of its type in the dictionary (CiA 301, 7.4.7): 5, 6, 7 unsigned of 1, 2, 4 bytes,
    /// 9 a text, 15 a domain.
    pub type_code: u16,
    /// Whether it can be written.
    pub is_writable: bool,
    /// The unit of the scaled number; empty for a count, a code or a text.
    pub unit: &'static str,
    /// The worth of one raw step in that unit.
    pub scale: Scale,
}

impl Entry {
    /// Returns the short name of its type that tables print.
    pub const fn type_name(&self) -> &'static str {
        match self.type_code {
            5 => "u8",
            6 => "u16",
            7 => "u32",
            9 => "text",
            15 => "domain",
            _ => "",
        }
    }
}

/// A name, its entry, and the unit of the entry.
struct Row(u16, u8, &'static str, Unit);

#[derive(Clone, Copy, PartialEq, Eq)]
enum Unit {
    None,
    Milliseconds,
    /// 100 µs.
    TenthMilliseconds,
}

use Unit::{Milliseconds, None as Plain, TenthMilliseconds};

/// The names of everything but PDOs.
const NAMES: &[Row] = &[
    Row(0x1000, 0, "device.type", Plain),
    Row(0x1001, 0, "error.register", Plain),
    Row(0x1003, 0, "error.count", Plain),
    Row(0x1003, 1, "error.newest", Plain),
    Row(0x1003, 2, "error.2", Plain),
    Row(0x1003, 3, "error.3", Plain),
    Row(0x1003, 4, "error.4", Plain),
    Row(0x1003, 5, "error.5", Plain),
    Row(0x1003, 6, "error.6", Plain),
    Row(0x1003, 7, "error.7", Plain),
    Row(0x1003, 8, "error.8", Plain),
    Row(0x1005, 0, "sync.cob_id", Plain),
    Row(0x1008, 0, "device.name", Plain),
    Row(0x1009, 0, "device.hardware", Plain),
    Row(0x100A, 0, "device.software", Plain),
    Row(0x1010, 1, "store.all", Plain),
    Row(0x1010, 2, "store.communication", Plain),
    Row(0x1010, 3, "store.application", Plain),
    Row(0x1011, 1, "restore.all", Plain),
    Row(0x1011, 2, "restore.communication", Plain),
    Row(0x1011, 3, "restore.application", Plain),
    Row(0x1012, 0, "time.cob_id", Plain),
    Row(0x1014, 0, "emergency.cob_id", Plain),
    Row(0x1015, 0, "emergency.inhibit", TenthMilliseconds),
    Row(0x1016, 1, "heartbeat.consumer", Plain),
    Row(0x1017, 0, "heartbeat.producer", Milliseconds),
    Row(0x1018, 1, "identity.vendor", Plain),
    Row(0x1018, 2, "identity.product", Plain),
    Row(0x1018, 3, "identity.revision", Plain),
    Row(0x1018, 4, "identity.serial", Plain),
    Row(0x1019, 0, "sync.overflow", Plain),
    Row(0x1021, 0, "eds.data", Plain),
    Row(0x1022, 0, "eds.format", Plain),
    Row(0x1029, 1, "error.behaviour", Plain),
    Row(0x1200, 1, "sdo.request", Plain),
    Row(0x1200, 2, "sdo.response", Plain),
];

/// The names of a PDO's parameters, by subindex; those of an RPDO end with the second.
const PDO_NAMES: &[(u8, &str, Unit)] = &[
    (1, "cob_id", Plain),
    (2, "transmission", Plain),
    (3, "inhibit", TenthMilliseconds),
    (5, "event", Milliseconds),
    (6, "sync_start", Plain),
];
/// Highest subindex of an RPDO's parameters.
const RPDO_PARAMETERS: u8 = 2;
/// Entries of a mapping.
const MAPPINGS: u8 = 8;

/// The groups of PDO records: index of the first, what its names begin and go on with.
const GROUPS: [(u16, &str, bool); 4] = [
    (0x1400, "rpdo", false),
    (0x1600, "rpdo", true),
    (0x1800, "tpdo", false),
    (0x1A00, "tpdo", true),
];

/// A name such as `heartbeat.producer` or `tpdo1.mapping.3`, to be printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    stem: &'static str,
    /// Number of the PDO; 0 for what is none.
    number: u16,
    rest: Rest,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rest {
    /// The stem says all.
    Nothing,
    /// A parameter.
    Parameter(&'static str),
    /// An entry of the mapping; 0 is their count.
    Mapping(u8),
}

impl fmt::Display for Name {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { stem, number, rest } = self;
        match rest {
            Rest::Nothing => out.write_str(stem),
            Rest::Parameter(name) => write!(out, "{stem}{number}.{name}"),
            Rest::Mapping(0) => write!(out, "{stem}{number}.mapping.count"),
            Rest::Mapping(entry) => write!(out, "{stem}{number}.mapping.{entry}"),
        }
    }
}

const fn scaled(unit: Unit) -> (&'static str, Scale) {
    let (name, denominator) = match unit {
        Unit::None => ("", 1),
        Unit::Milliseconds => ("s", 1_000),
        Unit::TenthMilliseconds => ("s", 10_000),
    };
    let scale = Scale {
        numerator: 1,
        denominator,
    };
    (name, scale)
}

fn entry(index: u16, item: &Item, unit: Unit) -> Entry {
    let (unit, scale) = scaled(unit);
    Entry {
        index,
        subindex: item.subindex,
        title: item.name,
        type_code: item.data_type as u16,
        is_writable: matches!(item.access, "rw" | "wo"),
        unit,
        scale,
    }
}

/// Returns every named entry with its name, by rising index but PDOs last.
pub fn entries() -> impl Iterator<Item = (Name, Entry)> {
    let plain = AREA.iter().flat_map(|area| {
        area.items.iter().filter_map(|item| {
            let row = NAMES
                .iter()
                .find(|row| (row.0, row.1) == (area.index, item.subindex))?;
            let name = Name {
                stem: row.2,
                number: 0,
                rest: Rest::Nothing,
            };
            Some((name, entry(area.index, item, row.3)))
        })
    });
    plain.chain(GROUPS.into_iter().flat_map(|(first, stem, maps)| {
        let count = if stem == "rpdo" {
            RPDOS.len()
        } else {
            TPDOS.len()
        } as u16;
        (0..count).flat_map(move |place| records(first + place, stem, place + 1, maps))
    }))
}

/// Returns the entries of one PDO record.
fn records(
    index: u16,
    stem: &'static str,
    number: u16,
    maps: bool,
) -> impl Iterator<Item = (Name, Entry)> {
    let mapping = (0..=MAPPINGS).filter(move |_| maps).map(move |subindex| {
        let [count, mapped] = &MAPPED;
        let item = Item {
            subindex,
            ..*if subindex == 0 { count } else { mapped }
        };
        (Rest::Mapping(subindex), entry(index, &item, Plain))
    });
    let last = if stem == "rpdo" {
        RPDO_PARAMETERS
    } else {
        u8::MAX
    };
    let parameters = PARAMETERS
        .iter()
        .filter(move |item| !maps && item.subindex <= last)
        .filter_map(move |item| {
            let (_, name, unit) = PDO_NAMES.iter().find(|row| row.0 == item.subindex)?;
            Some((Rest::Parameter(name), entry(index, item, *unit)))
        });
    mapping
        .chain(parameters)
        .map(move |(rest, entry)| (Name { stem, number, rest }, entry))
}

/// Returns the entry with this index and subindex; `None` where it has no name.
pub fn find(index: u16, subindex: u8) -> Option<(Name, Entry)> {
    entries().find(|(_, entry)| (entry.index, entry.subindex) == (index, subindex))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::string::{String, ToString};

    use super::*;
    use crate::dictionary;
    use crate::export::Shape;

    #[test]
    fn every_entry_but_the_highest_subindices_has_a_name_of_its_own() {
        for area in AREA {
            for item in area.items {
                let is_highest = item.subindex == 0
                    && matches!(area.shape, Shape::Array | Shape::Record)
                    && area.index != 0x1003;
                let found = find(area.index, item.subindex);
                assert_eq!(
                    found.is_none(),
                    is_highest,
                    "{:04X}:{} {}",
                    area.index,
                    item.subindex,
                    item.name
                );
            }
        }
        for Row(index, subindex, name, _) in NAMES {
            assert!(find(*index, *subindex).is_some(), "nobody has {name}");
        }
        let names: BTreeSet<String> = entries().map(|(name, _)| name.to_string()).collect();
        assert_eq!(names.len(), entries().count());
        for (object, sub) in dictionary::entries() {
            assert!(!names.contains(&object.dotted(sub).to_string()));
        }
    }

    #[test]
    fn names_say_what_people_look_for() {
        let all = [
            (0x1017, 0, "heartbeat.producer", 6, "s"),
            (0x1018, 4, "identity.serial", 7, ""),
            (0x1008, 0, "device.name", 9, ""),
            (0x1401, 1, "rpdo2.cob_id", 7, ""),
            (0x1600, 0, "rpdo1.mapping.count", 5, ""),
            (0x1800, 5, "tpdo1.event", 6, "s"),
            (0x1A01, 8, "tpdo2.mapping.8", 7, ""),
        ];
        for (index, subindex, name, type_code, unit) in all {
            let (found, entry) = find(index, subindex).unwrap();
            assert_eq!(found.to_string(), name);
            assert_eq!((entry.type_code, entry.unit), (type_code, unit), "{name}");
        }
        assert!(find(0x1400, 3).is_none() && find(0x1402, 1).is_none());
        assert!(find(0x1017, 0).unwrap().1.is_writable);
        assert!(!find(0x1018, 4).unwrap().1.is_writable);
    }
}
