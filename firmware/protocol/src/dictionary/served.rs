//! What a vertebra must know of an entry to serve it, without the words for people: five bytes an
//! entry, made from [`OBJECTS`] by the compiler, so that names and descriptions stay out of the image.

use eel_canopen::{Abort, Access, Entry};

use super::{DataType, Field, OBJECTS, Pdo, Sub};

/// How many entries there are, without those of subindex 0.
pub const ENTRIES: usize = {
    let (mut entries, mut place) = (0, 0);
    while place < OBJECTS.len() {
        entries += OBJECTS[place].subs.len();
        place += 1;
    }
    entries
};

/// One entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Served {
    /// What serves it.
    pub field: Field,
    /// Its type on the wire.
    pub data_type: DataType,
    /// Who may do what with it.
    pub access: Access,
    /// Which PDO may carry it.
    pub pdo: Pdo,
    /// The place of its bounds in [`BOUNDS`].
    bounds: u8,
}

/// The least and the greatest raw number.
type Bounds = (i32, u32);

/// Every pair of bounds once, and how many there are.
const ALL_BOUNDS: ([Bounds; ENTRIES], usize) = {
    let (mut all, mut count) = ([(0, 0); ENTRIES], 0);
    let mut place = 0;
    while place < OBJECTS.len() {
        let mut sub = 0;
        while sub < OBJECTS[place].subs.len() {
            let bounds = bounds(&OBJECTS[place].subs[sub]);
            if position(&all, bounds) >= count {
                all[count] = bounds;
                count += 1;
            }
            sub += 1;
        }
        place += 1;
    }
    (all, count)
};

/// Every pair of bounds: many entries have the same.
static BOUNDS: [Bounds; ALL_BOUNDS.1] = *ALL_BOUNDS.0.first_chunk().unwrap();

/// Returns where bounds are in a list; its length where they aren't.
const fn position(all: &[Bounds; ENTRIES], bounds: Bounds) -> usize {
    let mut place = 0;
    while place < ENTRIES && !(all[place].0 == bounds.0 && all[place].1 == bounds.1) {
        place += 1;
    }
    place
}

/// Returns the bounds of an entry.
const fn bounds(sub: &Sub) -> Bounds {
    assert!(sub.min >= i32::MIN as i64 && sub.min <= i32::MAX as i64);
    assert!(sub.max >= 0 && sub.max <= u32::MAX as i64);
    assert!(sub.data_type.is_signed() || sub.min >= 0);
    (sub.min as i32, sub.max as u32)
}

impl Served {
    const fn new(sub: &Sub) -> Self {
        Self {
            field: sub.field,
            data_type: sub.data_type,
            access: sub.access,
            pdo: sub.pdo,
            bounds: position(&ALL_BOUNDS.0, bounds(sub)) as u8,
        }
    }

    /// Returns the least and the greatest raw number.
    pub fn bounds(&self) -> (i64, i64) {
        let (min, max) = self.least_and_greatest();
        (i64::from(min), i64::from(max))
    }

    #[inline]
    fn least_and_greatest(&self) -> Bounds {
        let bounds = BOUNDS.get(usize::from(self.bounds));
        bounds.copied().unwrap_or_default()
    }

    /// Returns what a CANopen node must know of the entry.
    #[inline]
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
    #[inline]
    pub fn accept(&self, bytes: &[u8]) -> Result<i64, Abort> {
        if matches!(self.access, Access::Constant | Access::ReadOnly) {
            return Err(Abort::ReadOnly);
        }
        // In 32 bits, which is half the instructions.
        let raw = self.data_type.decode(bytes)? as u32;
        let (min, max) = self.least_and_greatest();
        let (low, high, value) = if self.data_type.is_signed() {
            let value = raw.cast_signed();
            let high = value > max.cast_signed();
            (value < min, high, i64::from(value))
        } else {
            (raw < min.cast_unsigned(), raw > max, i64::from(raw))
        };
        if low {
            Err(Abort::ValueTooLow)
        } else if high {
            Err(Abort::ValueTooHigh)
        } else {
            Ok(value)
        }
    }
}

impl DataType {
    /// Writes a number of the type, whose low bytes these are, to the start of `out` and returns the
    /// length.
    ///
    /// # Errors
    /// [`Abort::OutOfMemory`] when `out` is too short, [`Abort::UnsupportedAccess`] for a domain.
    #[inline]
    pub fn put(self, raw: u32, out: &mut [u8]) -> Result<usize, Abort> {
        let bytes = raw.to_le_bytes();
        let [a, b, ..] = bytes;
        // Copies whose length the compiler knows: any other costs more than all the rest.
        let length = usize::from(self.length());
        match length {
            0 => return Err(Abort::UnsupportedAccess),
            1 => *out.first_mut().ok_or(Abort::OutOfMemory)? = a,
            2 => *out.first_chunk_mut().ok_or(Abort::OutOfMemory)? = [a, b],
            _ => *out.first_chunk_mut().ok_or(Abort::OutOfMemory)? = bytes,
        }
        Ok(length)
    }
}

/// Every entry in the order of [`OBJECTS`], which is that of [`Field`].
static SERVED: [Served; ENTRIES] = {
    let mut served = [Served::new(&OBJECTS[0].subs[0]); ENTRIES];
    let (mut entry, mut place) = (0, 0);
    while place < OBJECTS.len() {
        let mut sub = 0;
        while sub < OBJECTS[place].subs.len() {
            served[entry] = Served::new(&OBJECTS[place].subs[sub]);
            entry += 1;
            sub += 1;
        }
        place += 1;
    }
    served
};

/// Of each record by its [`key`], where its entries begin in [`SERVED`] and how many there are; 0 where
/// there is no record.
static RECORDS: [(u8, u8); KEYS] = {
    let mut records = [(0, 0); KEYS];
    let (mut first, mut place) = (0, 0);
    while place < OBJECTS.len() {
        let Some(key) = key(OBJECTS[place].index) else {
            panic!("an index that has no key");
        };
        let count = OBJECTS[place].highest();
        assert!(records[key].1 == 0, "two records have one key");
        records[key] = (first, count);
        first += count;
        place += 1;
    }
    records
};

/// How many keys there are.
const KEYS: usize = match key(OBJECTS[OBJECTS.len() - 1].index) {
    Some(key) => key + 1,
    None => panic!("an index that has no key"),
};

/// Returns a small number for each index that a record may have: 0x2000–0x2003, 0x2010–0x2013, and so on
/// up to 0x21F3.
#[inline]
const fn key(index: u16) -> Option<usize> {
    if index & 0xFE0C == 0x2000 {
        Some((index >> 4 & 0x1F) as usize * 4 + (index & 3) as usize)
    } else {
        None
    }
}

/// Returns an entry; subindex 0 has none.
///
/// # Errors
/// [`Abort::NoObject`] or [`Abort::NoSubindex`].
#[inline]
pub fn served(index: u16, subindex: u8) -> Result<&'static Served, Abort> {
    find(index, subindex).ok_or_else(|| match highest(index) {
        Ok(_) => Abort::NoSubindex,
        Err(abort) => abort,
    })
}

/// Returns the highest subindex of a record.
///
/// # Errors
/// [`Abort::NoObject`].
#[inline(never)] // One copy in flash.
pub fn highest(index: u16) -> Result<u8, Abort> {
    let record = key(index).and_then(|key| RECORDS.get(key));
    match record {
        Some((_, count)) if *count > 0 => Ok(*count),
        _ => Err(Abort::NoObject),
    }
}

#[inline]
fn find(index: u16, subindex: u8) -> Option<&'static Served> {
    let (first, count) = RECORDS.get(key(index)?)?;
    let place = subindex.wrapping_sub(1);
    if place >= *count {
        return None;
    }
    SERVED.get(usize::from(*first) + usize::from(place))
}
