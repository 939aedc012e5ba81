//! What a node is made of: its identity, its defaults and its PDOs.

use crate::pdo::MAPPED_OBJECTS;

/// The most RPDOs, and the most TPDOs, that a node has.
pub const PDOS: usize = 4;

/// Object 0x1018: who made the device, and which one it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// The vendor's number, given by CiA.
    pub vendor: u32,
    /// The vendor's number for the product.
    pub product: u32,
    /// Major revision in the upper, minor in the lower 16 bits.
    pub revision: u32,
    /// The number of this one device.
    pub serial: u32,
}

/// Everything that a node starts with, and returns to when its communication is reset.
#[derive(Clone, Copy, Debug)]
pub struct Config {
    /// The node id, 1–127. With any other the node is unconfigured: it only listens to LSS.
    pub node_id: u8,
    /// The lowest and the highest node id that LSS may give.
    pub node_ids: (u8, u8),
    /// Object 0x1018.
    pub identity: Identity,
    /// Object 0x1000.
    pub device_type: u32,
    /// Object 0x1008.
    pub device_name: &'static str,
    /// Object 0x1009.
    pub hardware_version: &'static str,
    /// Object 0x100A.
    pub software_version: &'static str,
    /// Object 0x1017: the time between two heartbeats in milliseconds; 0 sends none.
    pub heartbeat_ms: u16,
    /// Object 0x1016: the node whose heartbeat is watched, and after how many milliseconds of
    /// silence it counts as lost.
    pub consumer: Option<(u8, u16)>,
    /// Object 0x1005: the identifier of SYNC, 0x080 by the predefined connection set.
    pub sync_cob_id: u16,
    /// Object 0x1019: the highest SYNC counter, 2–240; 0 when SYNC carries no counter.
    pub sync_counter_overflow: u8,
    /// Object 0x1012: the identifier of TIME, 0x100 by the predefined connection set.
    pub time_cob_id: u16,
    /// Object 0x1029, subindex 1: what the node does in Operational when its communication fails:
    /// 0 enters Pre-operational, 1 stays, 2 enters Stopped.
    pub error_behaviour: u8,
    /// Objects 0x1400 and 0x1600 onwards; what comes after the fourth is ignored.
    pub rpdos: &'static [PdoDefault],
    /// Objects 0x1800 and 0x1A00 onwards; what comes after the fourth is ignored.
    pub tpdos: &'static [PdoDefault],
}

/// How a PDO is configured before anybody writes its objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PdoDefault {
    /// The identifier without the node id, which is added to it.
    pub cob_id_base: u16,
    /// The transmission type: 0–240 with SYNC, 254 or 255 by event.
    pub transmission: u8,
    /// Whether the PDO exists from the start.
    pub enabled: bool,
    /// The objects it carries, first to last.
    pub mapping: &'static [Mapped],
}

impl PdoDefault {
    /// Tells whether a node can use it: at most eight objects of whole bytes, together 1–8 bytes,
    /// and a transmission type that exists. A node keeps an invalid one disabled and empty.
    pub const fn is_valid(&self) -> bool {
        if self.mapping.len() > MAPPED_OBJECTS || matches!(self.transmission, 241..=253) {
            return false;
        }
        let mut rest = self.mapping;
        let mut bits = 0;
        while let [first, others @ ..] = rest {
            if first.bits == 0 || !first.bits.is_multiple_of(8) {
                return false;
            }
            bits += first.bits as u32;
            rest = others;
        }
        bits <= 64 && (bits > 0 || !self.enabled)
    }
}

/// An object in a PDO.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mapped {
    /// The object's index; 1–7 are the dummies, bytes of an RPDO that are skipped.
    pub index: u16,
    /// The object's subindex.
    pub subindex: u8,
    /// Its length in bits, a multiple of 8.
    pub bits: u8,
}

impl Mapped {
    /// Names an object and its length in bits.
    pub const fn new(index: u16, subindex: u8, bits: u8) -> Self {
        Self {
            index,
            subindex,
            bits,
        }
    }

    /// Returns the value of a mapping entry (0x1600, 0x1A00).
    pub const fn to_raw(self) -> u32 {
        (self.index as u32) << 16 | (self.subindex as u32) << 8 | self.bits as u32
    }

    /// Reads the value of a mapping entry (0x1600, 0x1A00).
    pub const fn from_raw(raw: u32) -> Self {
        Self::new((raw >> 16) as u16, (raw >> 8) as u8, raw as u8)
    }

    pub(crate) const fn bytes(self) -> usize {
        (self.bits / 8) as usize
    }

    pub(crate) const fn is_dummy(self) -> bool {
        matches!(self.index, 1..=7)
    }
}
