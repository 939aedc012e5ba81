//! The last two pages of bank 2, which keep settings and node id.
//!
//! The program runs from bank 1, so that an erase (22 ms) or a write of bank 2 stalls nothing but
//! whoever reads bank 2. It is done by the main thread, below every interrupt: turns, frames and the
//! watchdog go on meanwhile, without the flash's data cache, which the chip demands to be off. `memory.x`
//! leaves the pages out of the program's flash.
//!
//! A word that was torn by a loss of power may read as an error of two bits, which raises an NMI. While
//! these pages are read that is noted and the read fails; [`eel_vertebra::store`] then takes the word for
//! what it is. At any other time the NMI is a failure of the program's flash or of the crystal.

use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::asm;
use cortex_m_rt::exception;
use eel_vertebra::store::{Record, Store, StoreError, Stored};
use embassy_stm32::flash::{Blocking, FLASH_SIZE, Flash, WRITE_SIZE};
use embassy_stm32::pac;
use embassy_stm32::{Peri, peripherals::FLASH};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

use crate::failure;

/// Length of a page while the flash has two banks.
const PAGE: usize = 2_048;
/// The pages.
const BYTES: usize = 2 * PAGE;
/// Where they begin, counted from the start of the flash.
const START: u32 = (FLASH_SIZE - BYTES) as u32;

/// What the control tick wants to be stored.
static WANTED: Channel<CriticalSectionRawMutex, Record, 1> = Channel::new();
/// What became of it.
static OUTCOME: Channel<CriticalSectionRawMutex, Result<(), StoreError>, 1> = Channel::new();

/// Whether these pages are being read.
static READING: AtomicBool = AtomicBool::new(false);
/// Whether a word of them could not be read.
static TORN: AtomicBool = AtomicBool::new(false);

/// The pages and what is done with them.
pub struct Storage {
    /// Absent where the option bytes ask for one bank: then the pages would be others.
    store: Option<Store<Pages>>,
}

/// Gives a record to the main thread to store; tells whether it was free to.
pub fn ask(record: Record) -> bool {
    WANTED.try_send(record).is_ok()
}

/// Returns what became of the record that was given last, once.
pub fn outcome() -> Option<Result<(), StoreError>> {
    OUTCOME.try_receive().ok()
}

impl Storage {
    /// Takes the flash.
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        let has_two_banks = pac::FLASH.optr().read().dbank();
        if !has_two_banks {
            defmt::error!("option bit DBANK is 0: nothing can be stored");
        }
        Self {
            store: has_two_banks.then(|| Store::new(Pages(Flash::new_blocking(flash)))),
        }
    }

    /// Returns what is stored.
    pub fn load(&mut self) -> Stored {
        let stored = self.store.as_mut().map(Store::load).unwrap_or_default();
        match &stored {
            Stored::Nothing => defmt::info!("nothing is stored"),
            Stored::Record(_) => defmt::info!("settings are stored"),
            Stored::Damaged => defmt::error!("the stored settings are damaged"),
        }
        stored
    }

    /// Stores what the control tick wants to be stored, for up to 60 ms.
    pub fn serve(&mut self) {
        let Ok(record) = WANTED.try_receive() else {
            return;
        };
        let outcome = match &mut self.store {
            Some(store) => store.save(&record),
            None => Err(StoreError::Flash),
        };
        if outcome.is_err() {
            defmt::error!("the settings could not be stored");
        }
        // The one before has been taken: the control tick asks for one at a time.
        let _ = OUTCOME.try_send(outcome);
    }
}

/// The two pages as a flash of their own.
struct Pages(Flash<'static, Blocking>);

/// Why the pages refuse.
#[derive(Debug)]
struct Refused(NorFlashErrorKind);

impl NorFlashError for Refused {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl Refused {
    fn from_hal(error: embassy_stm32::flash::Error) -> Self {
        Self(error.kind())
    }
}

impl ErrorType for Pages {
    type Error = Refused;
}

impl ReadNorFlash for Pages {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refused> {
        TORN.store(false, Ordering::SeqCst);
        READING.store(true, Ordering::SeqCst);
        asm::dsb();
        let outcome = self.0.blocking_read(START.saturating_add(offset), bytes);
        // The NMI of the last read has been taken when these are through.
        asm::dsb();
        asm::isb();
        READING.store(false, Ordering::SeqCst);
        outcome.map_err(Refused::from_hal)?;
        if TORN.load(Ordering::SeqCst) {
            return Err(Refused(NorFlashErrorKind::Other));
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        BYTES
    }
}

impl NorFlash for Pages {
    const WRITE_SIZE: usize = WRITE_SIZE;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Refused> {
        self.0
            .blocking_erase(START.saturating_add(from), START.saturating_add(to))
            .map_err(Refused::from_hal)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        self.0
            .blocking_write(START.saturating_add(offset), bytes)
            .map_err(Refused::from_hal)
    }
}

// SAFETY: touches a register and two flags, or never returns.
#[exception]
unsafe fn NonMaskableInt() {
    let errors = pac::FLASH.eccr().read();
    let is_torn = errors.eccd() || errors.eccd2();
    if !is_torn || !READING.load(Ordering::SeqCst) {
        failure::stop_for_interrupt(failure::NMI);
    }
    TORN.store(true, Ordering::SeqCst);
    // Cleared by writing 1; the rest of the register is as it was.
    pac::FLASH.eccr().write_value(errors);
}
