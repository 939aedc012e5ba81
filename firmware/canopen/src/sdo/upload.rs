//! What the server sends: an object in segments, one by one or in blocks.

use super::crc::Crc;
use super::{BLOCK, Buffer, Message, Multiplexor, SDO_BUFFER, SEGMENT};
use crate::objects::Objects;
use crate::{Abort, Access};

/// An object on its way to the client.
///
/// Byte `n` of the object is at `n` modulo the buffer's length in the buffer, which thus holds a
/// whole block. `base` is a multiple of [`SEGMENT`], and so is `fetched` before the object's end.
#[derive(Clone, Debug)]
pub(super) struct Upload {
    object: Multiplexor,
    domain: bool,
    length: u32,
    /// How many bytes have been in the buffer.
    fetched: u32,
    /// How many bytes the client has for certain: where the segment or the block begins.
    base: u32,
    toggle: bool,
    block: Option<Block>,
}

/// What an upload in blocks must know beside.
#[derive(Clone, Debug)]
struct Block {
    phase: Phase,
    /// How many segments the client wants in this block, 1–127.
    size: u8,
    /// How many segments of this block have been made.
    sequence: u8,
    crc: Option<Crc>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Waits for the client to ask for the first block.
    Ready,
    /// Segments go out, or are out and wait to be acknowledged.
    Running,
    /// The client has it all and has been told so.
    Ending,
}

impl Upload {
    /// Opens an object: a value is read at once.
    ///
    /// # Errors
    /// The abort code to answer with.
    pub fn open(
        object: Multiplexor,
        buffer: &mut Buffer,
        objects: &mut Objects<'_>,
    ) -> Result<Self, Abort> {
        let Multiplexor { index, subindex } = object;
        let entry = objects.describe(index, subindex)?;
        if entry.access == Access::WriteOnly {
            return Err(Abort::WriteOnly);
        }
        let length = if entry.domain {
            objects.app.open_domain(index, subindex)?
        } else {
            objects.read(index, subindex, buffer)? as u32
        };
        Ok(Self {
            object,
            domain: entry.domain,
            length,
            fetched: 0,
            base: 0,
            toggle: false,
            block: None,
        })
    }

    pub const fn length(&self) -> u32 {
        self.length
    }

    /// Returns the first four bytes of an upload without blocks; those behind its end are zeros.
    ///
    /// # Errors
    /// The abort code that ends the transfer.
    pub fn first(
        &mut self,
        buffer: &mut Buffer,
        objects: &mut Objects<'_>,
    ) -> Result<[u8; 4], Abort> {
        let [_, a, b, c, d, ..] = self.segment_at(self.base, buffer, objects)?;
        Ok([a, b, c, d])
    }

    /// Makes the segment that is asked for; the last is marked by its lowest bit.
    ///
    /// # Errors
    /// The abort code that ends the transfer.
    pub fn segment(
        &mut self,
        command: u8,
        buffer: &mut Buffer,
        objects: &mut Objects<'_>,
    ) -> Result<Message, Abort> {
        if self.block.is_some() {
            return Err(Abort::Command);
        }
        if (command & 0x10 != 0) != self.toggle {
            return Err(Abort::ToggleBit);
        }
        let mut segment = self.segment_at(self.base, buffer, objects)?;
        let rest = self.length.saturating_sub(self.base);
        let unused = SEGMENT as u32 - rest.min(SEGMENT as u32);
        let last = rest <= SEGMENT as u32;
        let [flags, ..] = &mut segment;
        *flags = u8::from(self.toggle) << 4 | (unused as u8) << 1 | u8::from(last);
        self.base = self.base.saturating_add(SEGMENT as u32);
        self.toggle = !self.toggle;
        Ok(segment)
    }

    /// Sends in blocks of `size` segments from now on, and computes the CRC if asked to.
    pub fn use_blocks(&mut self, size: u8, with_crc: bool) {
        self.block = Some(Block {
            phase: Phase::Ready,
            size,
            sequence: 0,
            crc: with_crc.then(Crc::default),
        });
    }

    /// Tells whether segments of a block may be on their way.
    pub fn is_streaming(&self) -> bool {
        self.phase() == Some(Phase::Running)
    }

    /// Tells whether a segment can be made now.
    pub fn has_segment(&self) -> bool {
        self.block.as_ref().is_some_and(|block| {
            block.phase == Phase::Running && block.sequence < block.size && !self.is_at_end(block)
        })
    }

    /// Makes the next segment of the block.
    ///
    /// # Errors
    /// The abort code that ends the transfer.
    pub fn next(
        &mut self,
        buffer: &mut Buffer,
        objects: &mut Objects<'_>,
    ) -> Result<Message, Abort> {
        let sequence = self.block.as_ref().map_or(0, |block| block.sequence);
        let at = self.base.saturating_add(bytes_in(sequence));
        let mut segment = self.segment_at(at, buffer, objects)?;
        let last = self.length.saturating_sub(at) <= SEGMENT as u32;
        let sequence = sequence.saturating_add(1);
        if let Some(block) = &mut self.block {
            block.sequence = sequence;
        }
        let [first, ..] = &mut segment;
        *first = u8::from(last) << 7 | sequence;
        Ok(segment)
    }

    /// The client asks for the first block.
    ///
    /// # Errors
    /// [`Abort::Command`] out of turn.
    pub fn start(&mut self) -> Result<(), Abort> {
        match &mut self.block {
            Some(block) if block.phase == Phase::Ready => {
                block.phase = Phase::Running;
                Ok(())
            }
            _ => Err(Abort::Command),
        }
    }

    /// The client has `sequence` segments of the block and wants `size` in the next one. Returns
    /// the message that ends the upload when that was all.
    ///
    /// # Errors
    /// The abort code that ends the transfer.
    pub fn acknowledge(&mut self, sequence: u8, size: u8) -> Result<Option<Message>, Abort> {
        let Some(block) = self.block.as_mut().filter(|b| b.phase == Phase::Running) else {
            return Err(Abort::Command);
        };
        if sequence > block.sequence {
            return Err(Abort::SequenceNumber);
        }
        check_block_size(size)?;
        let base = self.base.saturating_add(bytes_in(sequence));
        if sequence == 0 || base < self.length {
            self.base = base;
            block.sequence = 0;
            block.size = size;
            return Ok(None);
        }
        block.phase = Phase::Ending;
        let unused = match self.length % SEGMENT as u32 {
            0 if self.length > 0 => 0,
            carried => SEGMENT as u8 - carried as u8,
        };
        let [low, high] = block.crc.unwrap_or_default().value().to_le_bytes();
        Ok(Some([0xC1 | unused << 2, low, high, 0, 0, 0, 0, 0]))
    }

    /// The client ends the upload.
    ///
    /// # Errors
    /// [`Abort::Command`] out of turn.
    pub fn end(&self) -> Result<(), Abort> {
        if self.phase() == Some(Phase::Ending) {
            Ok(())
        } else {
            Err(Abort::Command)
        }
    }

    fn phase(&self) -> Option<Phase> {
        self.block.as_ref().map(|block| block.phase)
    }

    /// Tells whether the object's last segment has been made.
    fn is_at_end(&self, block: &Block) -> bool {
        block.sequence > 0 && self.base.saturating_add(bytes_in(block.sequence)) >= self.length
    }

    /// Makes a segment of the bytes from `at` on, which the application is asked for only once. What
    /// says which segment it is comes first, and is left to be set.
    #[inline(never)] // One copy in flash.
    fn segment_at(
        &mut self,
        at: u32,
        buffer: &mut Buffer,
        objects: &mut Objects<'_>,
    ) -> Result<Message, Abort> {
        let carried = self.length.saturating_sub(at).min(SEGMENT as u32) as usize;
        let start = at as usize % SDO_BUFFER;
        let slot = buffer
            .get_mut(start..)
            .and_then(|rest| rest.get_mut(..carried))
            .ok_or(Abort::General)?;
        if at >= self.fetched {
            let Multiplexor { index, subindex } = self.object;
            // A domain that ends before the length it was opened with has broken its word.
            if self.domain
                && carried > 0
                && objects.app.read_domain(index, subindex, at, slot)? != carried
            {
                return Err(Abort::General);
            }
            self.fetched = at.saturating_add(carried as u32);
            if let Some(crc) = self.block.as_mut().and_then(|block| block.crc.as_mut()) {
                crc.update(slot);
            }
        }
        let mut segment = [0; 8];
        for (to, from) in segment.iter_mut().skip(1).zip(slot) {
            *to = *from;
        }
        Ok(segment)
    }
}

/// Checks how many segments a client wants in a block.
///
/// # Errors
/// [`Abort::BlockSize`] outside 1–127.
pub(super) fn check_block_size(size: u8) -> Result<(), Abort> {
    if (1..=BLOCK).contains(&size) {
        Ok(())
    } else {
        Err(Abort::BlockSize)
    }
}

/// Returns how many bytes full segments carry.
fn bytes_in(segments: u8) -> u32 {
    u32::from(segments) * SEGMENT as u32
}
