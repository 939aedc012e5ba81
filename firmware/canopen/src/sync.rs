//! SYNC as a consumer hears it (CiA 301, 7.2.5, objects 0x1005 and 0x1019).

use crate::Abort;
use crate::cob_id::{self, FRAME_BIT};

/// Bit 30 of object 0x1005: the node generates SYNC.
const GENERATE_BIT: u32 = 1 << 30;

/// Which frame SYNC is, and what it carries.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sync {
    cob_id: u16,
    overflow: u8,
}

impl Sync {
    pub fn new(cob_id: u16, overflow: u8) -> Self {
        Self {
            cob_id: cob_id & cob_id::MASK,
            overflow,
        }
    }

    pub const fn cob_id(&self) -> u16 {
        self.cob_id
    }

    pub const fn overflow(&self) -> u8 {
        self.overflow
    }

    /// Returns the counter of a SYNC, or nothing at all when its length is wrong.
    pub fn counter(&self, data: &[u8]) -> Option<Option<u8>> {
        match (self.overflow, data) {
            (0, []) => Some(None),
            (1.., &[counter]) => Some(Some(counter)),
            _ => None,
        }
    }

    /// Writes object 0x1005.
    ///
    /// # Errors
    /// [`Abort::Value`]: the node does not generate SYNC, knows no extended identifiers, and keeps
    /// off those that CiA 301 reserves.
    pub fn write_cob_id(&mut self, raw: u32) -> Result<(), Abort> {
        if raw & (GENERATE_BIT | FRAME_BIT) != 0 {
            return Err(Abort::Value);
        }
        self.cob_id = cob_id::parse(raw)?;
        Ok(())
    }

    /// Writes object 0x1019.
    ///
    /// # Errors
    /// [`Abort::Value`] for 1 and above 240.
    pub fn write_overflow(&mut self, overflow: u8) -> Result<(), Abort> {
        if matches!(overflow, 1 | 241..) {
            return Err(Abort::Value);
        }
        self.overflow = overflow;
        Ok(())
    }
}
