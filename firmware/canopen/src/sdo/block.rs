//! The segments of a block download: which is the next, and what is acknowledged when.

use super::crc::Crc;
use super::{BLOCK, SEGMENT};
use crate::Abort;
use crate::deadline::{NEVER_US, after};

/// Silence in the middle of a block after which the server acknowledges what it has, because the
/// last segment seems lost.
const QUIET_US: u32 = 200_000;
/// How many blocks in a row may bring nothing.
const IDLE_BLOCKS: u8 = 4;

/// A block that is being received.
///
/// The last good segment is held back: only what comes next says how many of its bytes count.
#[derive(Clone, Debug)]
pub(super) struct Block {
    crc: Option<Crc>,
    held: Option<[u8; SEGMENT]>,
    /// The last segment of the object has come.
    at_end: bool,
    /// The last good segment of this block.
    good: u8,
    /// The highest that was heard in this block.
    heard: u8,
    /// How many blocks in a row have brought nothing.
    idle: u8,
    /// This block was acknowledged early, and the client may not know yet.
    early: bool,
    failure: Option<Abort>,
    /// The client may be out of step: nothing is said before it falls silent.
    out_of_step: bool,
    /// When silence in the middle of the block has lasted too long.
    quiet_us: u64,
}

impl Block {
    /// Makes the first block, with a CRC if the client computes one.
    pub fn new(with_crc: bool) -> Self {
        Self {
            crc: with_crc.then(Crc::default),
            held: None,
            at_end: false,
            good: 0,
            heard: 0,
            idle: 0,
            early: false,
            failure: None,
            out_of_step: false,
            quiet_us: NEVER_US,
        }
    }

    /// Tells whether segments are awaited.
    pub const fn is_running(&self) -> bool {
        !self.at_end
    }

    /// Returns the CRC of what was [`check`](Self::check)ed, if the client wants one.
    pub fn crc(&self) -> Option<u16> {
        self.crc.map(Crc::value)
    }

    /// Counts bytes to the CRC.
    pub fn check(&mut self, bytes: &[u8]) {
        if let Some(crc) = &mut self.crc {
            crc.update(bytes);
        }
    }

    /// Remembers what ends the transfer when the block does.
    pub fn fail(&mut self, abort: Abort) {
        self.failure = Some(abort);
    }

    /// Looks at a segment: when it is the next one it is held back, and the one before, if there is
    /// one, is returned: all of its bytes count.
    pub fn accept(&mut self, first: u8, data: [u8; SEGMENT]) -> Option<[u8; SEGMENT]> {
        let sequence = first & 0x7F;
        if self.failure.is_some() {
            return None;
        }
        if sequence == 0 {
            self.failure = Some(Abort::SequenceNumber);
            return None;
        }
        if core::mem::take(&mut self.early) && sequence != 1 {
            // The client was only slow, and goes on with the old block. It will take the early
            // acknowledgement for one of a later block: without a CRC nobody would notice.
            self.failure = Some(Abort::SequenceNumber);
            self.out_of_step = true;
            return None;
        }
        if sequence != self.good.saturating_add(1) {
            return None;
        }
        self.good = sequence;
        self.at_end = first & 0x80 != 0;
        self.held.replace(data)
    }

    /// Counts a segment as heard, and ends the block where that was the last.
    ///
    /// # Errors
    /// The abort code that ends the transfer.
    pub fn hear(&mut self, first: u8, now_us: u64) -> Result<Heard, Abort> {
        let sequence = first & 0x7F;
        let forward = sequence > self.heard;
        self.heard = self.heard.max(sequence);
        self.quiet_us = after(now_us, QUIET_US);
        let ends = first & 0x80 != 0 || sequence >= BLOCK;
        if ends && !self.out_of_step {
            return self.acknowledge().map(Heard::Acknowledge);
        }
        Ok(if forward {
            Heard::Forward
        } else {
            Heard::Again
        })
    }

    /// Ends the block when the client has fallen silent in the middle of it, and returns how many
    /// segments have come.
    ///
    /// # Errors
    /// The abort code that ends the transfer.
    pub fn expire(&mut self, now_us: u64) -> Result<Option<u8>, Abort> {
        if now_us < self.quiet_us {
            return Ok(None);
        }
        let good = self.acknowledge()?;
        self.early = true;
        Ok(Some(good))
    }

    /// Returns the last segment of the object.
    pub fn take_last(&mut self) -> Option<[u8; SEGMENT]> {
        self.held.take_if(|_| self.at_end)
    }

    #[inline(never)] // One copy in flash.
    fn acknowledge(&mut self) -> Result<u8, Abort> {
        if let Some(abort) = self.failure {
            return Err(abort);
        }
        self.idle = if self.good == 0 {
            self.idle.saturating_add(1)
        } else {
            0
        };
        if self.idle > IDLE_BLOCKS {
            return Err(Abort::Timeout);
        }
        let good = core::mem::take(&mut self.good);
        self.heard = 0;
        self.quiet_us = NEVER_US;
        Ok(good)
    }
}

/// What a segment means for the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Heard {
    /// It is farther than any before.
    Forward,
    /// It is not.
    Again,
    /// It ends the block, of which so many segments have come.
    Acknowledge(u8),
}
