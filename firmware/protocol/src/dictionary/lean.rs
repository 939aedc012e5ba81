//! The table without its words, for a vertebra's flash: names, units and sentences are for host tools.

use eel_canopen::{Abort, Access, Entry};

use super::table::{OBJECTS, position};
use super::{DataType, Field, Pdo, Sub};

/// What serving an entry takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lean {
    /// What serves it.
    pub field: Field,
    /// Its type on the wire.
    pub data_type: DataType,
    /// Who may do what with it.
    pub access: Access,
    /// Which PDO may carry it.
    pub pdo: Pdo,
    /// The least raw number.
    pub min: i64,
    /// The greatest raw number.
    pub max: i64,
}

/// How many entries there are.
const COUNT: usize = {
    let mut count = 0;
    let mut object = 0;
    while object < OBJECTS.len() {
        count += OBJECTS[object].subs.len();
        object += 1;
    }
    count
};

/// Every entry, in the order of the table.
static ENTRIES: [Lean; COUNT] = {
    let mut entries = [OBJECTS[0].subs[0].lean(); COUNT];
    let mut place = 0;
    let mut object = 0;
    while object < OBJECTS.len() {
        let mut sub = 0;
        while sub < OBJECTS[object].subs.len() {
            entries[place] = OBJECTS[object].subs[sub].lean();
            place += 1;
            sub += 1;
        }
        object += 1;
    }
    entries
};

/// Where the entries of each record begin, and how many there are.
static RECORDS: [(u8, u8); OBJECTS.len()] = {
    assert!(COUNT <= u8::MAX as usize);
    let mut records = [(0, 0); OBJECTS.len()];
    let (mut first, mut object) = (0, 0);
    while object < OBJECTS.len() {
        let count = OBJECTS[object].highest();
        records[object] = (first, count);
        first += count;
        object += 1;
    }
    records
};

impl Sub {
    /// Returns the entry without its words.
    pub const fn lean(&self) -> Lean {
        Lean {
            field: self.field,
            data_type: self.data_type,
            access: self.access,
            pdo: self.pdo,
            min: self.min,
            max: self.max,
        }
    }
}

impl Lean {
    /// Returns what a CANopen node must know of the entry.
    pub const fn entry(&self) -> Entry {
        Entry {
            length: self.data_type.length(),
            domain: self.data_type.is_domain(),
            access: self.access,
            tpdo: matches!(self.pdo, Pdo::Transmit),
            rpdo: matches!(self.pdo, Pdo::Receive),
        }
    }

    /// Reads a number that was written to the entry and holds it against the entry's bounds.
    ///
    /// # Errors
    /// [`Abort::ReadOnly`]; [`Abort::TooShort`] or [`Abort::TooLong`] for a wrong length;
    /// [`Abort::ValueTooLow`] or [`Abort::ValueTooHigh`] outside the bounds.
    pub fn accept(&self, bytes: &[u8]) -> Result<i64, Abort> {
        if matches!(self.access, Access::Constant | Access::ReadOnly) {
            return Err(Abort::ReadOnly);
        }
        match self.data_type.decode(bytes)? {
            value if value < self.min => Err(Abort::ValueTooLow),
            value if value > self.max => Err(Abort::ValueTooHigh),
            value => Ok(value),
        }
    }
}

/// Returns where a record's entries begin, and how many there are.
fn record(index: u16) -> Result<(u8, u8), Abort> {
    let record = position(index).and_then(|place| RECORDS.get(place));
    record.copied().ok_or(Abort::NoObject)
}

/// Returns the highest subindex of a record.
///
/// # Errors
/// [`Abort::NoObject`].
pub fn highest(index: u16) -> Result<u8, Abort> {
    record(index).map(|(_, count)| count)
}

/// Returns an entry from subindex 1 on, without its words.
///
/// # Errors
/// [`Abort::NoObject`] or [`Abort::NoSubindex`].
#[inline(never)] // One copy in flash.
pub fn lean(index: u16, subindex: u8) -> Result<&'static Lean, Abort> {
    let (first, count) = record(index)?;
    let place = subindex
        .checked_sub(1)
        .filter(|place| *place < count)
        .ok_or(Abort::NoSubindex)?;
    let place = usize::from(first) + usize::from(place);
    ENTRIES.get(place).ok_or(Abort::NoSubindex)
}

/// Describes an entry to a CANopen node; subindex 0 is a constant byte.
///
/// # Errors
/// [`Abort::NoObject`] or [`Abort::NoSubindex`].
pub fn entry(index: u16, subindex: u8) -> Result<Entry, Abort> {
    if subindex == 0 {
        return highest(index).map(|_| Entry {
            length: 1,
            domain: false,
            access: Access::Constant,
            tpdo: false,
            rpdo: false,
        });
    }
    lean(index, subindex).map(Lean::entry)
}
