//! What a vertebra keeps over a loss of power, in two pages of flash.
//!
//! A record is written to the page that does not hold the newest one: erased, filled word by word, and
//! made valid by a last word. At any moment one of the two pages holds the old record or the new one,
//! whole, so a loss of power at any word leaves the one or the other. Each word is written once after an
//! erase, as flash with an error-correcting code demands. Of two valid records the one with the higher
//! sequence number counts. A record that was finished and no longer holds its check, with no other beside
//! it, is told apart from none at all: [`Stored::Damaged`].

mod ram;
mod record;

use eel_protocol::NodeId;
use eel_units::Instant;
use embedded_storage::nor_flash::NorFlash;

use crate::vertebra::Vertebra;
use record::RECORD_BYTES;

pub use ram::{RAM_PAGE, RamFlash};
pub use record::Record;

/// Length of a word: what is written at once.
const WORD: usize = 8;
/// What the first word of a page holds once the record behind it is whole.
const FINISHED: [u8; WORD] = *b"eelstore";
/// Bytes that are read of a page: its first word and the longest record.
const READ: usize = (WORD + RECORD_BYTES).next_multiple_of(WORD);

/// What a flash held at power-up.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "there is no allocator")]
pub enum Stored {
    /// Nothing: the vertebra is as it left the factory.
    #[default]
    Nothing,
    /// The newest record.
    Record(Record),
    /// There was a record, and it is lost.
    Damaged,
}

/// Why a record is not stored; the one before it still is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError {
    /// The flash refused to read, erase or write.
    Flash,
    /// What was written does not read back.
    Verify,
}

/// Two pages of a flash whose addresses begin at 0.
#[derive(Clone, Debug)]
pub struct Store<F> {
    flash: F,
}

/// What a page holds.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "there is no allocator")]
enum Page {
    /// Nothing that was ever finished.
    Unfinished,
    /// Something that was finished once.
    Damaged,
    /// A record with its sequence number.
    Holds(u32, Record),
}

impl Stored {
    /// Returns the place in the chain that LSS has stored.
    pub const fn node(&self) -> Option<NodeId> {
        match self {
            Self::Record(record) => record.node,
            Self::Nothing | Self::Damaged => None,
        }
    }
}

impl<F: NorFlash> Store<F> {
    /// Takes a flash of at least two pages; more are left alone.
    pub const fn new(flash: F) -> Self {
        const {
            assert!(WORD.is_multiple_of(F::WRITE_SIZE) && WORD.is_multiple_of(F::READ_SIZE));
            assert!(F::ERASE_SIZE >= READ && F::ERASE_SIZE.is_multiple_of(WORD));
        }
        Self { flash }
    }

    /// Returns the newest record.
    pub fn load(&mut self) -> Stored {
        match [self.read(0), self.read(1)] {
            [Page::Holds(one, first), Page::Holds(two, second)] => {
                Stored::Record(if is_newer(two, one) { second } else { first })
            }
            [Page::Holds(_, record), _] | [_, Page::Holds(_, record)] => Stored::Record(record),
            [Page::Damaged, _] | [_, Page::Damaged] => Stored::Damaged,
            [Page::Unfinished, Page::Unfinished] => Stored::Nothing,
        }
    }

    /// Stores a record; one that is the newest already is left as it is.
    ///
    /// # Errors
    /// Where the flash fails; the record before is then still the newest.
    pub fn save(&mut self, record: &Record) -> Result<(), StoreError> {
        let (place, sequence) = match [self.read(0), self.read(1)] {
            [Page::Holds(one, first), Page::Holds(two, second)] => {
                let (newest, page, sequence) = if is_newer(two, one) {
                    (second, 0, two)
                } else {
                    (first, 1, one)
                };
                if newest == *record {
                    return Ok(());
                }
                (page, sequence)
            }
            [Page::Holds(_, newest), _] | [_, Page::Holds(_, newest)] if newest == *record => {
                return Ok(());
            }
            [Page::Holds(sequence, _), _] => (1, sequence),
            [_, Page::Holds(sequence, _)] => (0, sequence),
            // That something is lost is not forgotten before there is something else.
            [Page::Damaged, Page::Unfinished] => (1, 0),
            _ => (0, 0),
        };
        self.write(place, sequence.wrapping_add(1), record)
    }

    /// Returns the flash.
    pub const fn flash_mut(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Reads a page.
    fn read(&mut self, place: u32) -> Page {
        let mut bytes = [0; READ];
        let mut offset = place * F::ERASE_SIZE as u32;
        let (words, _) = bytes.as_chunks_mut::<WORD>();
        let mut is_readable = true;
        for (number, word) in words.iter_mut().enumerate() {
            if self.flash.read(offset, word).is_err() {
                // A word that was torn, perhaps in the moment in which the page would have been finished.
                if number == 0 {
                    return Page::Unfinished;
                }
                is_readable = false;
            }
            offset += WORD as u32;
        }
        let Some(rest) = bytes.strip_prefix(&FINISHED) else {
            return Page::Unfinished;
        };
        match record::Record::from_bytes(rest) {
            Some((sequence, record)) if is_readable => Page::Holds(sequence, record),
            _ => Page::Damaged,
        }
    }

    /// Writes a page and reads it back.
    fn write(&mut self, place: u32, sequence: u32, record: &Record) -> Result<(), StoreError> {
        let size = F::ERASE_SIZE as u32;
        let start = place * size;
        // Even where it reads as erased: an erase that was cut off leaves words that only seem so.
        self.flash
            .erase(start, start + size)
            .map_err(|_| StoreError::Flash)?;
        let bytes = record.to_bytes(sequence);
        let mut offset = start;
        for part in bytes.chunks(WORD) {
            offset += WORD as u32;
            let mut word = [0xFF; WORD];
            for (to, from) in word.iter_mut().zip(part) {
                *to = *from;
            }
            self.write_word(offset, &word)?;
        }
        self.write_word(start, &FINISHED)?;
        match self.read(place) {
            Page::Holds(found, back) if found == sequence && back == *record => Ok(()),
            _ => Err(StoreError::Verify),
        }
    }

    fn write_word(&mut self, offset: u32, word: &[u8; WORD]) -> Result<(), StoreError> {
        self.flash
            .write(offset, word)
            .map_err(|_| StoreError::Flash)
    }
}

/// Tells whether a sequence number is the later one; they wrap.
const fn is_newer(one: u32, other: u32) -> bool {
    (one.wrapping_sub(other) as i32) > 0
}

/// Stores what a vertebra wants to be stored, at once; call it after each turn. For platforms whose flash
/// takes no time.
pub fn serve<F: NorFlash>(vertebra: &mut Vertebra, store: &mut Store<F>, now: Instant) {
    if let Some(record) = vertebra.poll_store() {
        let outcome = store.save(record);
        vertebra.finish_store(now, outcome);
    }
}

#[cfg(test)]
mod tests;
