//! TIME as a consumer hears it (CiA 301, 7.2.6, object 0x1012).

use crate::Abort;
use crate::cob_id::{self, FRAME_BIT, INVALID_BIT, NO_REMOTE_BIT};

/// Bit 31 of object 0x1012: the node consumes TIME.
const CONSUME_BIT: u32 = INVALID_BIT;
/// Bit 30: the node produces it.
const PRODUCE_BIT: u32 = NO_REMOTE_BIT;
/// Milliseconds have 28 bits.
const MILLISECONDS: u32 = 0x0FFF_FFFF;

/// Which frame TIME is, and whether it is listened to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Time {
    cob_id: u16,
    consumes: bool,
}

impl Time {
    pub fn new(cob_id: u16) -> Self {
        Self {
            cob_id: cob_id & cob_id::MASK,
            consumes: true,
        }
    }

    /// Returns the identifier of the frame to listen to.
    pub fn cob_id(&self) -> Option<u16> {
        self.consumes.then_some(self.cob_id)
    }

    /// Returns object 0x1012.
    pub fn to_raw(self) -> u32 {
        u32::from(self.cob_id) | if self.consumes { CONSUME_BIT } else { 0 }
    }

    /// Writes object 0x1012.
    ///
    /// # Errors
    /// [`Abort::Value`]: the node does not produce TIME, knows no extended identifiers, and keeps off
    /// those that CiA 301 reserves.
    pub fn write(&mut self, raw: u32) -> Result<(), Abort> {
        if raw & (PRODUCE_BIT | FRAME_BIT) != 0 {
            return Err(Abort::Value);
        }
        self.cob_id = cob_id::parse(raw)?;
        self.consumes = raw & CONSUME_BIT != 0;
        Ok(())
    }
}

/// Reads TIME OF DAY: days since 1 January 1984, milliseconds since midnight.
pub(crate) fn of_day(data: &[u8]) -> Option<(u16, u32)> {
    let &[a, b, c, d, low, high] = data else {
        return None;
    };
    let ms = u32::from_le_bytes([a, b, c, d]) & MILLISECONDS;
    Some((u16::from_le_bytes([low, high]), ms))
}
