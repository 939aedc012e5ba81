//! The object dictionary of a vertebra beyond the communication area: 0x2000–0x2101.
//!
//! Every object is a record whose entries are numbered 1, 2, 3 … without a gap; entry 0 is the
//! highest of these numbers. [`OBJECTS`] is the one place where a name, a type, a unit or a bound
//! is written; EDS, DBC and the tables of the documentation come from it. A vertebra serves the
//! entries by a `match` over [`Field`], so the compiler refuses a table entry that nobody serves.

mod served;
mod shapes;
mod table;

use core::fmt;

use eel_canopen::{Abort, Access, Entry};

pub use served::{ENTRIES, Served, highest, served};
pub use table::{Field, OBJECTS};

/// The records whose entries are settings.
const SETTINGS: [u16; 3] = [0x2020, 0x2022, 0x2023];

/// How an entry lies on the wire; integers are little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataType {
    /// UNSIGNED8.
    U8,
    /// UNSIGNED16.
    U16,
    /// UNSIGNED32.
    U32,
    /// INTEGER16.
    I16,
    /// INTEGER32.
    I32,
    /// DOMAIN: bytes that stream, as many as there are.
    Domain,
}

/// Which kind of PDO may carry an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pdo {
    /// Neither: it is reached by SDO alone.
    No,
    /// An RPDO: from the head to the vertebra.
    Receive,
    /// A TPDO: from the vertebra to the bus.
    Transmit,
}

/// The worth of one step of a raw number in the entry's unit, as a fraction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// Above the line.
    pub numerator: u32,
    /// Below the line; never 0.
    pub denominator: u32,
}

/// One entry of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sub {
    /// What serves it.
    pub field: Field,
    /// Its number within the record, from 1.
    pub subindex: u8,
    /// Its name within the record, such as `yaw`.
    pub name: &'static str,
    /// Its type on the wire.
    pub data_type: DataType,
    /// Who may do what with it.
    pub access: Access,
    /// Which PDO may carry it.
    pub pdo: Pdo,
    /// The unit of the scaled number; empty for a count or a code.
    pub unit: &'static str,
    /// The worth of one raw step in that unit.
    pub scale: Scale,
    /// The raw number at power-up.
    pub default: i64,
    /// The least raw number.
    pub min: i64,
    /// The greatest raw number.
    pub max: i64,
    /// What it is, in one sentence.
    pub description: &'static str,
}

/// One record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Object {
    /// Its index, 0x2000–0x2101.
    pub index: u16,
    /// Its name, such as `pose`.
    pub name: &'static str,
    /// What it is, in one sentence.
    pub description: &'static str,
    /// Its entries from subindex 1, without a gap.
    pub subs: &'static [Sub],
}

impl DataType {
    /// Returns the length of a number in bytes; 0 for a domain.
    pub const fn length(self) -> u8 {
        match self {
            Self::Domain => 0,
            Self::U8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 => 4,
        }
    }

    /// Returns the length in bits, as PDO mappings count.
    pub const fn bits(self) -> u8 {
        self.length() * 8
    }

    /// Tells whether the number may be negative.
    pub const fn is_signed(self) -> bool {
        matches!(self, Self::I16 | Self::I32)
    }

    /// Returns the index of the type in the dictionary (CiA 301, 7.4.7).
    pub const fn code(self) -> u16 {
        match self {
            Self::I16 => 0x0003,
            Self::I32 => 0x0004,
            Self::U8 => 0x0005,
            Self::U16 => 0x0006,
            Self::U32 => 0x0007,
            Self::Domain => 0x000F,
        }
    }

    /// Returns the short name that tables print.
    pub const fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::U16 => "u16",
            Self::U32 => "u32",
            Self::I16 => "i16",
            Self::I32 => "i32",
            Self::Domain => "domain",
        }
    }

    /// Tells whether it is a domain, which holds no number.
    pub const fn is_domain(self) -> bool {
        matches!(self, Self::Domain)
    }

    /// Returns the least and the greatest number of the type; twice 0 for a domain.
    pub const fn range(self) -> (i64, i64) {
        match self {
            Self::Domain => (0, 0),
            Self::U8 => (0, u8::MAX as i64),
            Self::U16 => (0, u16::MAX as i64),
            Self::U32 => (0, u32::MAX as i64),
            Self::I16 => (i16::MIN as i64, i16::MAX as i64),
            Self::I32 => (i32::MIN as i64, i32::MAX as i64),
        }
    }

    /// Reads a number from its bytes.
    ///
    /// # Errors
    /// [`Abort::TooShort`] or [`Abort::TooLong`] for another length;
    /// [`Abort::UnsupportedAccess`] for a domain.
    pub fn decode(self, bytes: &[u8]) -> Result<i64, Abort> {
        match (self, bytes) {
            (Self::Domain, _) => Err(Abort::UnsupportedAccess),
            (Self::U8, &[a]) => Ok(i64::from(a)),
            (Self::U16, &[a, b]) => Ok(i64::from(u16::from_le_bytes([a, b]))),
            (Self::I16, &[a, b]) => Ok(i64::from(i16::from_le_bytes([a, b]))),
            (Self::U32, &[a, b, c, d]) => Ok(i64::from(u32::from_le_bytes([a, b, c, d]))),
            (Self::I32, &[a, b, c, d]) => Ok(i64::from(i32::from_le_bytes([a, b, c, d]))),
            _ if bytes.len() < usize::from(self.length()) => Err(Abort::TooShort),
            _ => Err(Abort::TooLong),
        }
    }

    /// Writes `value`, saturated to the type, to the start of `out` and returns the length.
    ///
    /// # Errors
    /// [`Abort::OutOfMemory`] when `out` is too short; [`Abort::UnsupportedAccess`] for a domain.
    pub fn encode(self, value: i64, out: &mut [u8]) -> Result<usize, Abort> {
        if self.is_domain() {
            return Err(Abort::UnsupportedAccess);
        }
        let (low, high) = self.range();
        self.put(value.clamp(low, high) as u32, out)
    }
}

impl Object {
    /// Returns the highest subindex, which is what entry 0 holds.
    pub const fn highest(&self) -> u8 {
        self.subs.len() as u8
    }

    /// Returns the dotted name of one of its entries, such as `pose.yaw`.
    pub const fn dotted(&self, sub: &Sub) -> Dotted {
        Dotted(self.name, sub.name)
    }
}

/// A dotted name such as `pose.yaw`, to be printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dotted(&'static str, &'static str);

impl fmt::Display for Dotted {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}.{}", self.0, self.1)
    }
}

/// Returns the record with this index.
#[inline]
pub fn object(index: u16) -> Option<&'static Object> {
    OBJECTS.get(table::position(index)?)
}

/// Returns an entry and its record; subindex 0, which has no [`Sub`], is answered by [`entry`]
/// and [`Object::highest`].
///
/// # Errors
/// [`Abort::NoObject`] or [`Abort::NoSubindex`].
#[inline]
pub fn find(index: u16, subindex: u8) -> Result<(&'static Object, &'static Sub), Abort> {
    let object = object(index).ok_or(Abort::NoObject)?;
    let position = usize::from(subindex)
        .checked_sub(1)
        .ok_or(Abort::NoSubindex)?;
    let sub = object.subs.get(position).ok_or(Abort::NoSubindex)?;
    Ok((object, sub))
}

/// Returns an entry while compiling.
pub(crate) const fn lookup(index: u16, subindex: u8) -> Option<&'static Sub> {
    match table::position(index) {
        Some(place) if subindex > 0 && subindex <= OBJECTS[place].highest() => {
            Some(&OBJECTS[place].subs[subindex as usize - 1])
        }
        _ => None,
    }
}

/// Describes an entry to a CANopen node; subindex 0 is a constant byte.
///
/// # Errors
/// [`Abort::NoObject`] or [`Abort::NoSubindex`].
pub fn entry(index: u16, subindex: u8) -> Result<Entry, Abort> {
    if subindex == 0 {
        highest(index)?;
        return Ok(Entry {
            length: 1,
            domain: false,
            access: Access::Constant,
            tpdo: false,
            rpdo: false,
        });
    }
    served(index, subindex).map(Served::entry)
}

/// Returns every entry with its record, in the order of the dictionary.
pub fn entries() -> impl Iterator<Item = (&'static Object, &'static Sub)> + Clone {
    OBJECTS
        .iter()
        .flat_map(|object| object.subs.iter().map(move |sub| (object, sub)))
}

/// Returns index and subindex of the entries that are settings: written while nothing moves, and stored.
pub fn settings() -> impl Iterator<Item = (u16, u8)> + Clone {
    SETTINGS.into_iter().flat_map(|index| {
        let highest = highest(index).unwrap_or_default();
        (1..=highest).map(move |subindex| (index, subindex))
    })
}

#[cfg(test)]
mod tests;
