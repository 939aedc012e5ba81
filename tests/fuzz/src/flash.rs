//! A flash whose power goes at a word of choice.

use eel_vertebra::store::RamFlash;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

/// A flash that does so many things to its cells and then none.
pub struct Failing {
    flash: RamFlash,
    left: u8,
}

impl Failing {
    pub const fn new(flash: RamFlash) -> Self {
        Self {
            flash,
            left: u8::MAX,
        }
    }

    /// Lets it erase and write so many times; 255 is for ever.
    pub const fn fail_after(&mut self, times: u8) {
        self.left = times;
    }

    fn spend(&mut self) -> Result<(), NorFlashErrorKind> {
        if self.left == 0 {
            return Err(NorFlashErrorKind::Other);
        }
        if self.left < u8::MAX {
            self.left -= 1;
        }
        Ok(())
    }
}

impl ErrorType for Failing {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Failing {
    const READ_SIZE: usize = RamFlash::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.flash
            .read(offset, bytes)
            .map_err(|_| NorFlashErrorKind::OutOfBounds)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for Failing {
    const WRITE_SIZE: usize = RamFlash::WRITE_SIZE;
    const ERASE_SIZE: usize = RamFlash::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.spend()?;
        self.flash
            .erase(from, to)
            .map_err(|_| NorFlashErrorKind::Other)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.spend()?;
        self.flash
            .write(offset, bytes)
            .map_err(|_| NorFlashErrorKind::Other)
    }
}
