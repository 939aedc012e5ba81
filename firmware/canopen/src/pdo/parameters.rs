//! The parameters and the mapping of a PDO, and the rules for changing them.

use super::MAPPED_OBJECTS;
use crate::cob_id::{self, FRAME_BIT, INVALID_BIT, NO_REMOTE_BIT};
use crate::{Abort, Entry, Mapped, PdoDefault};

/// Which way a PDO goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Receive,
    Transmit,
}

/// What objects 0x1400 and 0x1600 (or 0x1800 and 0x1A00) hold in common.
///
/// `count` is never more than the mapped objects that are there, and `bytes` is their length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parameters {
    direction: Direction,
    enabled: bool,
    cob_id: u16,
    transmission: u8,
    count: u8,
    bytes: u8,
    mapping: [Mapped; MAPPED_OBJECTS],
}

impl Parameters {
    /// Makes a PDO that the node does not have.
    pub const fn absent() -> Self {
        Self {
            direction: Direction::Receive,
            enabled: false,
            cob_id: 0,
            transmission: 0,
            count: 0,
            bytes: 0,
            mapping: [Mapped::new(0, 0, 0); MAPPED_OBJECTS],
        }
    }

    /// Returns to the default for node `node_id`, in place.
    #[inline(never)] // One copy in flash.
    pub fn reset(&mut self, direction: Direction, default: &PdoDefault, node_id: u8) {
        self.direction = direction;
        let is_valid = default.is_valid();
        let valid = if is_valid { default.mapping } else { &[] };
        let mut bits = 0;
        let mut rest = valid.iter();
        for slot in &mut self.mapping {
            *slot = rest.next().copied().unwrap_or_default();
            bits += slot.bits;
        }
        self.enabled = is_valid && default.enabled;
        self.cob_id = default.cob_id_base.wrapping_add(u16::from(node_id)) & cob_id::MASK;
        self.transmission = default.transmission;
        self.count = valid.len() as u8;
        self.bytes = bits / 8;
    }

    pub const fn is_enabled(&self) -> bool {
        self.enabled
    }

    pub const fn cob_id(&self) -> u16 {
        self.cob_id
    }

    pub const fn transmission(&self) -> u8 {
        self.transmission
    }

    /// Tells whether the PDO goes with SYNC.
    pub const fn is_synchronous(&self) -> bool {
        self.transmission <= 240
    }

    /// Returns the length of the mapped objects in bytes, at most 8.
    pub const fn bytes(&self) -> u8 {
        self.bytes
    }

    /// Returns the mapped objects, first to last.
    pub fn mapping(&self) -> &[Mapped] {
        self.mapping.get(..usize::from(self.count)).unwrap_or(&[])
    }

    /// Returns the number of mapped objects.
    pub const fn count(&self) -> u8 {
        self.count
    }

    /// Returns all mapping entries, be they active or not.
    pub const fn entries(&self) -> &[Mapped; MAPPED_OBJECTS] {
        &self.mapping
    }

    /// Returns all mapping entries to be written over; [`restore`](Self::restore) must follow.
    pub const fn entries_mut(&mut self) -> &mut [Mapped; MAPPED_OBJECTS] {
        &mut self.mapping
    }

    /// Returns a mapping entry, 1–8, be it active or not.
    ///
    /// # Errors
    /// [`Abort::NoSubindex`].
    pub fn entry(&self, subindex: u8) -> Result<u32, Abort> {
        let slot = usize::from(subindex)
            .checked_sub(1)
            .and_then(|slot| self.mapping.get(slot));
        slot.map(|mapped| mapped.to_raw()).ok_or(Abort::NoSubindex)
    }

    /// Returns the identifier with its flags.
    pub fn raw_cob_id(&self) -> u32 {
        let invalid = if self.enabled { 0 } else { INVALID_BIT };
        let no_remote = if self.direction == Direction::Transmit {
            NO_REMOTE_BIT
        } else {
            0
        };
        u32::from(self.cob_id) | invalid | no_remote
    }

    /// Writes the identifier, enables or disables the PDO.
    ///
    /// # Errors
    /// [`Abort::Value`]: for an identifier that can't be, for another one while the PDO is
    /// enabled, for enabling an empty PDO, and for a TPDO that would answer remote frames.
    pub fn write_cob_id(&mut self, raw: u32) -> Result<(), Abort> {
        let enable = raw & INVALID_BIT == 0;
        let answers_remote = self.direction == Direction::Transmit && raw & NO_REMOTE_BIT == 0;
        if raw & FRAME_BIT != 0 || answers_remote {
            return Err(Abort::Value);
        }
        // A PDO that is only switched off keeps whatever identifier it had.
        let raw_id = raw & !(INVALID_BIT | NO_REMOTE_BIT);
        let same = raw_id == u32::from(self.cob_id);
        let cob_id = if same && !enable {
            self.cob_id
        } else {
            cob_id::parse(raw)?
        };
        if enable && (self.count == 0 || self.enabled && !same) {
            return Err(Abort::Value);
        }
        self.cob_id = cob_id;
        self.enabled = enable;
        Ok(())
    }

    /// Writes the transmission type.
    ///
    /// # Errors
    /// [`Abort::Value`] for 241–253, which are reserved or ask for remote frames.
    pub fn write_transmission(&mut self, transmission: u8) -> Result<(), Abort> {
        if matches!(transmission, 241..=253) {
            return Err(Abort::Value);
        }
        self.transmission = transmission;
        Ok(())
    }

    /// Writes the number of mapped objects, which makes the mapping active; 0 frees it.
    ///
    /// # Errors
    /// [`Abort::UnsupportedAccess`] while the PDO is enabled, [`Abort::PdoLength`] for more than
    /// eight objects or bytes, [`Abort::Incompatible`] for an entry that is empty.
    pub fn write_count(&mut self, count: u8) -> Result<(), Abort> {
        if self.enabled {
            return Err(Abort::UnsupportedAccess);
        }
        let entries = self
            .mapping
            .get(..usize::from(count))
            .ok_or(Abort::PdoLength)?;
        if entries.iter().any(|mapped| mapped.bits == 0) {
            return Err(Abort::Incompatible);
        }
        let bits: u32 = entries.iter().map(|mapped| u32::from(mapped.bits)).sum();
        if bits > 64 {
            return Err(Abort::PdoLength);
        }
        self.count = count;
        self.bytes = (bits / 8) as u8;
        Ok(())
    }

    /// Writes a mapping entry, 1–8; 0 empties it. `described` is what the dictionary says of the
    /// object, and is not asked for dummies.
    ///
    /// # Errors
    /// [`Abort::UnsupportedAccess`] while the mapping is active, [`Abort::NotMappable`] for an
    /// object that does not go this way or has another length, the error of `described`.
    pub fn write_entry(
        &mut self,
        subindex: u8,
        raw: u32,
        described: Result<Entry, Abort>,
    ) -> Result<(), Abort> {
        let slot = usize::from(subindex).wrapping_sub(1);
        let slot = self.mapping.get_mut(slot).ok_or(Abort::NoSubindex)?;
        if self.enabled || self.count != 0 {
            return Err(Abort::UnsupportedAccess);
        }
        let mapped = Mapped::from_raw(raw);
        check_mapped(self.direction, mapped, described)?;
        *slot = mapped;
        Ok(())
    }

    /// Holds an entry against what the dictionary says of its object, as
    /// [`write_entry`](Self::write_entry) does.
    ///
    /// # Errors
    /// [`Abort::NotMappable`], and the error of `described`.
    pub fn check_entry(
        &self,
        mapped: Mapped,
        described: Result<Entry, Abort>,
    ) -> Result<(), Abort> {
        check_mapped(self.direction, mapped, described)
    }

    /// Takes stored parameters over, behind the mapping's entries; `None` for those that can't be written
    /// either. The objects are not looked at.
    pub fn restore(
        &mut self,
        cob_id: u16,
        enabled: bool,
        transmission: u8,
        count: u8,
    ) -> Option<()> {
        // Disabled, the mapping may be changed and the identifier too.
        self.enabled = false;
        self.write_transmission(transmission).ok()?;
        self.write_count(count).ok()?;
        let is_same = cob_id == self.cob_id;
        let parsed = if is_same && !enabled {
            cob_id
        } else {
            cob_id::parse(u32::from(cob_id)).ok()?
        };
        if enabled && self.count == 0 {
            return None;
        }
        self.cob_id = parsed;
        self.enabled = enabled;
        Some(())
    }
}

/// Holds a mapping entry against what the dictionary says of its object; 0 is an empty entry.
fn check_mapped(
    direction: Direction,
    mapped: Mapped,
    described: Result<Entry, Abort>,
) -> Result<(), Abort> {
    if mapped == Mapped::default() {
        return Ok(());
    }
    if mapped.is_dummy() {
        return check_dummy(direction, mapped);
    }
    let entry = described?;
    let allowed = match direction {
        Direction::Receive => entry.rpdo,
        Direction::Transmit => entry.tpdo,
    };
    let bits = entry.length.checked_mul(8);
    if !allowed || entry.domain || entry.length == 0 || bits != Some(mapped.bits) {
        return Err(Abort::NotMappable);
    }
    Ok(())
}

/// Dummies have the index of their data type and stand for bytes that an RPDO skips.
fn check_dummy(direction: Direction, mapped: Mapped) -> Result<(), Abort> {
    let bits = match mapped.index {
        2 | 5 => 8,
        3 | 6 => 16,
        4 | 7 => 32,
        _ => 0,
    };
    if direction == Direction::Transmit || bits != mapped.bits || bits == 0 {
        return Err(Abort::NotMappable);
    }
    if mapped.subindex != 0 {
        return Err(Abort::NoSubindex);
    }
    Ok(())
}
