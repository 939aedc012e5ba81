//! The abort codes of SDO in words (CiA 301, 7.2.4.3.17), with what to do about each.

/// An abort code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AbortCode {
    /// The number on the wire.
    pub code: u32,
    /// What it means, in a few words.
    pub meaning: &'static str,
    /// What to do about it.
    pub cure: &'static str,
}

const fn code(code: u32, meaning: &'static str, cure: &'static str) -> AbortCode {
    AbortCode {
        code,
        meaning,
        cure,
    }
}

/// The cure where two clients spoke at once or frames got lost.
const AGAIN: &str = "frames got lost or another client speaks to the same node: try again, and see \
                     `eel stats` for losses";
/// The cure where the access is not made for the object.
const SEE_ACCESS: &str = "`eel export md` lists who may do what with each object";
/// The cure where a mapping is refused.
const SEE_MAPPING: &str = "a mapping is written while its PDO is disabled and its count is 0; what \
                           may be mapped is in `eel export md`, column PDO";
/// The cure where a length is wrong.
const SEE_TYPE: &str = "the object has another type: `eel export md` lists types and lengths";
/// The cure where the device's own trouble is the reason.
const SEE_ERRORS: &str = "`eel nodes` shows the node's errors";

/// Every code, by rising number.
pub const ABORTS: &[AbortCode] = &[
    code(0x0503_0000, "toggle bit not alternated", AGAIN),
    code(0x0504_0000, "timed out", AGAIN),
    code(
        0x0504_0001,
        "unknown command",
        "the node does not know this kind of transfer (block transfers are optional)",
    ),
    code(0x0504_0002, "invalid block size", AGAIN),
    code(0x0504_0003, "invalid sequence number", AGAIN),
    code(0x0504_0004, "CRC error", AGAIN),
    code(
        0x0504_0005,
        "out of memory",
        "the value is longer than the node can take: write a shorter one",
    ),
    code(0x0601_0000, "unsupported access", SEE_ACCESS),
    code(
        0x0601_0001,
        "write only",
        "the object can't be read, only written",
    ),
    code(
        0x0601_0002,
        "read only",
        "the object can't be written, only read",
    ),
    code(
        0x0602_0000,
        "no such object",
        "this node has no such object: its software may be older or it is another device; `eel nodes` \
         shows what it is",
    ),
    code(0x0604_0041, "can't be mapped", SEE_MAPPING),
    code(
        0x0604_0042,
        "PDO too long",
        "the mapped objects are longer than 8 bytes together: map fewer",
    ),
    code(
        0x0604_0043,
        "parameter incompatible",
        "the value contradicts another one: set that one first",
    ),
    code(
        0x0604_0047,
        "internally incompatible",
        "the node's own settings contradict each other: `eel store NODE restore`, then reset it",
    ),
    code(0x0606_0000, "hardware failed", SEE_ERRORS),
    code(0x0607_0010, "wrong length", SEE_TYPE),
    code(0x0607_0012, "too long", SEE_TYPE),
    code(0x0607_0013, "too short", SEE_TYPE),
    code(
        0x0609_0011,
        "no such subindex",
        "the object has fewer entries: read entry 0 for the highest",
    ),
    code(
        0x0609_0030,
        "value not allowed",
        "`eel export md` lists what may be written",
    ),
    code(
        0x0609_0031,
        "value too high",
        "write a lower one: `eel export md` lists the ranges",
    ),
    code(
        0x0609_0032,
        "value too low",
        "write a higher one: `eel export md` lists the ranges",
    ),
    code(
        0x0609_0036,
        "maximum below minimum",
        "write a maximum that is not below the minimum",
    ),
    code(
        0x060A_0023,
        "resource not available",
        "the node is busy or has no room: try again later",
    ),
    code(0x0800_0000, "general error", SEE_ERRORS),
    code(
        0x0800_0020,
        "can't transfer or store",
        "the signature (\"save\", \"load\") is missing, or the node's memory refuses: use `eel store`",
    ),
    code(
        0x0800_0021,
        "under local control",
        "somebody operates the device itself: end that first",
    ),
    code(
        0x0800_0022,
        "the node's state forbids it",
        "stop it first: `eel nmt NODE pre-operational`, or switch the wrist off",
    ),
    code(
        0x0800_0023,
        "no dictionary",
        "the node could not build its dictionary: restore and reset it",
    ),
    code(
        0x0800_0024,
        "no data",
        "there is nothing to read yet: nothing was recorded or reported",
    ),
];

/// Returns what an abort code means; a general entry for a number of another maker's.
#[must_use]
pub fn abort(number: u32) -> AbortCode {
    let unknown = code(number, "unknown reason", "the node's manual may know it");
    ABORTS
        .iter()
        .find(|known| known.code == number)
        .copied()
        .unwrap_or(unknown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_of_the_standard_has_words_and_a_cure() {
        assert!(ABORTS.is_sorted_by(|a, b| a.code < b.code));
        // CiA 301, table 22.
        assert_eq!(ABORTS.len(), 31);
        for known in ABORTS {
            assert!(!known.meaning.is_empty() && known.cure.len() > 20);
            assert_eq!(abort(known.code), *known);
        }
        assert_eq!(abort(0xDEAD_BEEF).meaning, "unknown reason");
    }
}
