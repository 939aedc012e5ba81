//! What the server receives: an object in one message or in segments, one by one or in blocks.

use super::block::Block;
use super::{Buffer, Message, Multiplexor, SDO_BUFFER, SEGMENT};
use crate::objects::Objects;
use crate::{Abort, Access};

/// An object on its way from the client.
#[derive(Clone, Debug)]
pub(super) struct Download {
    object: Multiplexor,
    pub domain: bool,
    /// How long it must be in the end, where the client or the object's type says so.
    expected: Option<u32>,
    received: u32,
    toggle: bool,
    pub block: Option<Block>,
}

impl Download {
    /// Opens an object to be written with `size` bytes; a domain is begun, and must be ended.
    ///
    /// # Errors
    /// The abort code to answer with.
    pub fn open(
        object: Multiplexor,
        size: Option<u32>,
        objects: &mut Objects<'_>,
    ) -> Result<Self, Abort> {
        let Multiplexor { index, subindex } = object;
        let entry = objects.describe(index, subindex)?;
        if matches!(entry.access, Access::Constant | Access::ReadOnly) {
            return Err(Abort::ReadOnly);
        }
        let mut expected = size;
        if entry.domain {
            objects.app.begin_domain(index, subindex, size)?;
        } else {
            if entry.length > 0 {
                let fixed = u32::from(entry.length);
                check_length(size.unwrap_or(fixed), fixed)?;
                expected = Some(fixed);
            }
            if expected.is_some_and(|expected| expected > SDO_BUFFER as u32) {
                return Err(Abort::OutOfMemory);
            }
        }
        Ok(Self {
            object,
            domain: entry.domain,
            expected,
            received: 0,
            toggle: false,
            block: None,
        })
    }

    /// Takes the four bytes of an expedited download, of which `given` count; where the client does
    /// not say so, as many as the object has.
    ///
    /// # Errors
    /// The abort code that ends the transfer.
    pub fn expedited(
        &mut self,
        data: [u8; 4],
        buffer: &mut Buffer,
        objects: &mut Objects<'_>,
    ) -> Result<(), Abort> {
        let length = self.expected.unwrap_or(4);
        let value = data.get(..length as usize).ok_or(Abort::TooShort)?;
        self.take(value, buffer, objects)
    }

    /// Takes a segment and tells whether it was the last.
    ///
    /// # Errors
    /// The abort code that ends the transfer.
    pub fn segment(
        &mut self,
        request: Message,
        buffer: &mut Buffer,
        objects: &mut Objects<'_>,
    ) -> Result<bool, Abort> {
        if self.block.is_some() {
            return Err(Abort::Command);
        }
        let [command, data @ ..] = request;
        if (command & 0x10 != 0) != self.toggle {
            return Err(Abort::ToggleBit);
        }
        self.take(used(&data, command >> 1), buffer, objects)?;
        self.toggle = !self.toggle;
        Ok(command & 1 != 0)
    }

    /// Tells whether what comes next is a segment of a block, whatever it looks like.
    pub fn is_in_block(&self) -> bool {
        self.block.as_ref().is_some_and(Block::is_running)
    }

    /// Takes a segment of a block. What is wrong with it is remembered by the block.
    pub fn block_segment(
        &mut self,
        request: Message,
        buffer: &mut Buffer,
        objects: &mut Objects<'_>,
    ) {
        let [first, data @ ..] = request;
        let before = self.block.as_mut().and_then(|b| b.accept(first, data));
        if let Some(before) = before
            && let Err(abort) = self.take(&before, buffer, objects)
            && let Some(block) = &mut self.block
        {
            block.fail(abort);
        }
    }

    /// Takes the last segment of the last block, and checks the CRC.
    ///
    /// # Errors
    /// The abort code that ends the transfer.
    pub fn end_blocks(
        &mut self,
        request: Message,
        buffer: &mut Buffer,
        objects: &mut Objects<'_>,
    ) -> Result<(), Abort> {
        let [command, low, high, ..] = request;
        let held = self.block.as_mut().and_then(Block::take_last);
        let held = held.ok_or(Abort::Command)?;
        self.take(used(&held, command >> 2), buffer, objects)?;
        let crc = self.block.as_ref().and_then(Block::crc);
        if crc.is_some_and(|crc| crc != u16::from_le_bytes([low, high])) {
            return Err(Abort::Crc);
        }
        Ok(())
    }

    /// Checks that everything has come that was promised.
    ///
    /// # Errors
    /// [`Abort::TooShort`].
    pub fn check_complete(&self) -> Result<(), Abort> {
        check_length(self.received, self.expected.unwrap_or(self.received))
    }

    /// Writes the value, or ends the domain.
    ///
    /// # Errors
    /// The abort code to answer with.
    pub fn finish(&self, buffer: &Buffer, objects: &mut Objects<'_>) -> Result<(), Abort> {
        let Multiplexor { index, subindex } = self.object;
        if self.domain {
            return objects.app.end_domain(index, subindex, Some(self.received));
        }
        let value = buffer.get(..self.received as usize).unwrap_or(&[]);
        objects.write(index, subindex, value)
    }

    /// Takes the next bytes: of a value to the buffer, of a domain to the application.
    #[inline(never)] // One copy in flash.
    fn take(
        &mut self,
        bytes: &[u8],
        buffer: &mut Buffer,
        objects: &mut Objects<'_>,
    ) -> Result<(), Abort> {
        let total = self.received.saturating_add(bytes.len() as u32);
        if self.expected.is_some_and(|expected| total > expected) {
            return Err(Abort::TooLong);
        }
        if self.domain {
            if !bytes.is_empty() {
                let Multiplexor { index, subindex } = self.object;
                objects
                    .app
                    .write_domain(index, subindex, self.received, bytes)?;
            }
        } else {
            let slot = buffer
                .get_mut(self.received as usize..total as usize)
                .ok_or(Abort::OutOfMemory)?;
            for (to, from) in slot.iter_mut().zip(bytes) {
                *to = *from;
            }
        }
        if let Some(block) = &mut self.block {
            block.check(bytes);
        }
        self.received = total;
        Ok(())
    }
}

/// Returns the bytes of a segment that count, where the lowest three bits of `unused` do not.
fn used(data: &[u8; SEGMENT], unused: u8) -> &[u8] {
    let count = SEGMENT.saturating_sub(usize::from(unused & 7));
    data.get(..count).unwrap_or(&[])
}

fn check_length(given: u32, fixed: u32) -> Result<(), Abort> {
    if given > fixed {
        Err(Abort::TooLong)
    } else if given < fixed {
        Err(Abort::TooShort)
    } else {
        Ok(())
    }
}
