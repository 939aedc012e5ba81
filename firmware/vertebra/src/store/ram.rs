//! A flash in RAM, for QEMU and the simulator: it behaves like the STM32G4's and forgets with the process.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};

/// Length of a page in bytes, as on the STM32G4 with two banks.
pub const RAM_PAGE: usize = 2_048;
const BYTES: usize = 2 * RAM_PAGE;

/// Two pages that are written in words of eight bytes, each once after an erase.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RamFlash {
    bytes: [u8; BYTES],
}

/// The one way in which it refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RamFlashError(NorFlashErrorKind);

impl Default for RamFlash {
    fn default() -> Self {
        Self::new()
    }
}

impl RamFlash {
    /// Makes an erased flash.
    pub const fn new() -> Self {
        Self {
            bytes: [0xFF; BYTES],
        }
    }

    /// Returns what it holds, to be damaged in tests.
    pub const fn bytes_mut(&mut self) -> &mut [u8; BYTES] {
        &mut self.bytes
    }

    fn range(&mut self, offset: u32, length: usize) -> Result<&mut [u8], RamFlashError> {
        let start = offset as usize;
        self.bytes
            .get_mut(start..start.saturating_add(length))
            .ok_or(RamFlashError(NorFlashErrorKind::OutOfBounds))
    }
}

impl NorFlashError for RamFlashError {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl ErrorType for RamFlash {
    type Error = RamFlashError;
}

impl ReadNorFlash for RamFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), RamFlashError> {
        check_read(self, offset, bytes.len()).map_err(RamFlashError)?;
        let range = self.range(offset, bytes.len())?;
        for (to, from) in bytes.iter_mut().zip(range) {
            *to = *from;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        BYTES
    }
}

impl NorFlash for RamFlash {
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = RAM_PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), RamFlashError> {
        check_erase(self, from, to).map_err(RamFlashError)?;
        self.range(from, to.saturating_sub(from) as usize)?
            .fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), RamFlashError> {
        check_write(self, offset, bytes.len()).map_err(RamFlashError)?;
        let range = self.range(offset, bytes.len())?;
        if range.iter().any(|byte| *byte != 0xFF) {
            return Err(RamFlashError(NorFlashErrorKind::Other));
        }
        for (to, from) in range.iter_mut().zip(bytes) {
            *to = *from;
        }
        Ok(())
    }
}
