//! Identifiers as objects of the dictionary hold them (CiA 301, 7.3.5).

use crate::Abort;

/// The bits of an identifier.
pub(crate) const MASK: u16 = 0x7FF;
/// Bit 31: the communication object does not exist.
pub(crate) const INVALID_BIT: u32 = 1 << 31;
/// Bit 30 of a TPDO: remote frames are not answered.
pub(crate) const NO_REMOTE_BIT: u32 = 1 << 30;
/// Bit 29: the identifier has 29 bits.
pub(crate) const FRAME_BIT: u32 = 1 << 29;

/// Returns the identifier in `raw`, whose bits 30 and 31 are not looked at.
///
/// # Errors
/// [`Abort::Value`] for an extended identifier and for one that CiA 301 keeps for NMT, SDO,
/// heartbeats and LSS (table 41).
#[inline(never)] // One copy in flash.
pub(crate) const fn parse(raw: u32) -> Result<u16, Abort> {
    let id = raw & !(INVALID_BIT | NO_REMOTE_BIT);
    match id {
        0x000..=0x07F
        | 0x101..=0x180
        | 0x581..=0x5FF
        | 0x601..=0x67F
        | 0x6E0..=0x6FF
        | 0x701..=0x7FF
        | 0x800.. => Err(Abort::Value),
        _ => Ok(id as u16),
    }
}
