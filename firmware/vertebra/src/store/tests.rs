//! A flash that loses power at any word, cleanly or in the middle of it.

use std::boxed::Box;
use std::println;
use std::vec::Vec;

use eel_protocol::{NodeId, dictionary};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

use super::*;
use crate::settings::Settings;

const WORDS: usize = 2 * RAM_PAGE / WORD;

/// A word of the flash.
#[derive(Clone, Copy)]
struct Cell {
    value: u64,
    /// Whether it may be written: it has been erased, whole, and not been written since.
    is_erased: bool,
    /// Whether its error-correcting code can't be right, so that reading it fails.
    is_unreadable: bool,
}

const ERASED: Cell = Cell {
    value: u64::MAX,
    is_erased: true,
    is_unreadable: false,
};

/// What becomes of the word or the page that is being changed when power fails.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cut {
    /// Nothing has been changed yet.
    Clean,
    /// It is changed in part, and reads as something.
    Torn,
    /// It is changed in part, and what is torn can't be read.
    Unreadable,
}

/// The STM32G4's flash: words of eight bytes, each written once after an erase of its page of 2 KB.
struct Model {
    cells: Box<[Cell; WORDS]>,
    /// Changes until power fails, and how.
    left: Option<(usize, Cut)>,
    is_off: bool,
    changes: usize,
    random: u64,
}

#[derive(Debug)]
struct Failure;

impl NorFlashError for Failure {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Model {
    type Error = Failure;
}

impl Model {
    fn new(seed: u64) -> Self {
        Self {
            cells: Box::new([ERASED; WORDS]),
            left: None,
            is_off: false,
            changes: 0,
            random: seed | 1,
        }
    }

    fn next(&mut self) -> u64 {
        self.random ^= self.random >> 12;
        self.random ^= self.random << 25;
        self.random ^= self.random >> 27;
        self.random.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// Returns how the change that is about to be made goes wrong, if it does.
    fn change(&mut self) -> Result<Option<Cut>, Failure> {
        if self.is_off {
            return Err(Failure);
        }
        self.changes += 1;
        match &mut self.left {
            Some((0, cut)) => {
                self.is_off = true;
                Ok(Some(*cut))
            }
            Some((left, _)) => {
                *left -= 1;
                Ok(None)
            }
            None => Ok(None),
        }
    }

    /// Turns a bit of the record in a page.
    fn damage(&mut self, page: usize) {
        self.cells[page * RAM_PAGE / WORD + 2].value ^= 1 << 20;
    }

    fn power_up(&mut self) {
        self.is_off = false;
        self.left = None;
    }
}

impl ReadNorFlash for Model {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        if self.is_off {
            return Err(Failure);
        }
        for (to, at) in bytes.iter_mut().zip(offset as usize..) {
            let cell = self.cells[at / WORD];
            if cell.is_unreadable {
                return Err(Failure);
            }
            *to = cell.value.to_le_bytes()[at % WORD];
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * RAM_PAGE
    }
}

impl NorFlash for Model {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = RAM_PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        assert_eq!(to - from, RAM_PAGE as u32, "a page at a time");
        let cut = self.change()?;
        for at in from as usize / WORD..to as usize / WORD {
            let before = self.cells[at];
            self.cells[at] = match cut {
                None => ERASED,
                Some(Cut::Clean) => before,
                Some(cut) => match self.next() >> 62 {
                    0 => before,
                    // It reads as erased, and is not: nothing may be written to it.
                    1 => Cell {
                        is_erased: false,
                        ..ERASED
                    },
                    _ => Cell {
                        value: before.value | self.next(),
                        is_erased: false,
                        is_unreadable: cut == Cut::Unreadable && self.next() >> 63 == 0,
                    },
                },
            };
        }
        cut.map_or(Ok(()), |_| Err(Failure))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        let at = offset as usize / WORD;
        let value = u64::from_le_bytes(bytes.try_into().expect("one word"));
        assert!(
            self.is_off || self.cells[at].is_erased,
            "word {at} is written twice"
        );
        let cut = self.change()?;
        self.cells[at] = match cut {
            Some(Cut::Clean) => self.cells[at],
            // The last moment: all of it is written, and nobody was told.
            Some(Cut::Torn) if self.next() >> 62 == 0 => Cell {
                value,
                is_erased: false,
                is_unreadable: false,
            },
            Some(cut) => Cell {
                // Some of the bits that become 0 have done so.
                value: value | self.next(),
                is_erased: false,
                is_unreadable: cut == Cut::Unreadable,
            },
            None => Cell {
                value,
                is_erased: false,
                is_unreadable: false,
            },
        };
        cut.map_or(Ok(()), |_| Err(Failure))
    }
}

/// Returns a record that no other number gives.
fn record(number: usize) -> Record {
    let mut record = Record::default();
    record.node = NodeId::new((number % 11) as u8);
    let length = 40 + number * 37 % 290;
    for at in 0..length {
        record.communication.push((number ^ at) as u8).unwrap();
    }
    record
}

/// Makes a store that has held `count` records, the last of them `count`.
fn used(count: usize, seed: u64) -> Store<Model> {
    let mut store = Store::new(Model::new(seed));
    for number in 1..=count {
        store.save(&record(number)).unwrap();
    }
    store
}

#[test]
fn the_newest_record_is_found_however_often_one_is_stored() {
    let mut store = used(0, 1);
    assert_eq!(store.load(), Stored::Nothing);
    for number in 1..20 {
        store.save(&record(number)).unwrap();
        assert_eq!(store.load(), Stored::Record(record(number)));
    }
    let changes = store.flash_mut().changes;
    store.save(&record(19)).unwrap();
    assert_eq!(store.flash_mut().changes, changes, "nothing new");
}

#[test]
fn sequence_numbers_wrap() {
    assert!(is_newer(0, u32::MAX) && is_newer(5, u32::MAX - 5) && is_newer(2, 1));
    assert!(!is_newer(u32::MAX, 0) && !is_newer(1, 2) && !is_newer(7, 7));
}

/// Every word of every kind of save, cut in every way: the old record or the new one is left, and the
/// next save goes through.
#[test]
fn a_loss_of_power_at_any_word_leaves_the_old_record_or_the_new_one() {
    let mut cases = 0;
    let mut outcomes = [0; 2];
    for before in 0..5 {
        let mut whole = used(before, 1);
        let start = whole.flash_mut().changes;
        let new = record(100 + before);
        whole.save(&new).unwrap();
        let changes = whole.flash_mut().changes - start;
        assert!(changes >= 10, "{changes}");
        let old = match before {
            0 => Stored::Nothing,
            number => Stored::Record(record(number)),
        };
        for at in 0..changes {
            for (cut, seeds) in [(Cut::Clean, 1), (Cut::Torn, 12), (Cut::Unreadable, 12)] {
                for seed in 0..seeds {
                    let mut store = used(before, 0x5EED + seed * 977 + at as u64);
                    store.flash_mut().left = Some((at, cut));
                    assert_eq!(store.save(&new), Err(StoreError::Flash));
                    store.flash_mut().power_up();
                    let left = store.load();
                    let is_new = left == Stored::Record(new.clone());
                    assert!(
                        is_new || left == old,
                        "{before} before, change {at} of {changes}, {cut:?}, seed {seed}: {left:?}"
                    );
                    outcomes[usize::from(is_new)] += 1;
                    store.save(&new).unwrap();
                    assert_eq!(store.load(), Stored::Record(new.clone()));
                    cases += 1;
                }
            }
        }
    }
    println!("{cases} cuts: {} old, {} new", outcomes[0], outcomes[1]);
    assert!(cases > 2_000 && outcomes[1] > 0);
}

/// Long lives with a loss of power at any moment, again and again.
#[test]
fn many_losses_of_power_in_a_row_never_mix_records() {
    let histories = std::env::var("STORE_HISTORIES")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(300);
    let mut cuts = 0;
    for seed in 0..histories {
        let mut store = Store::new(Model::new(seed * 0x9E37_79B9 + 1));
        let mut held = Stored::Nothing;
        for number in 1..40 {
            let random = store.flash_mut().next();
            let cut = [Cut::Clean, Cut::Torn, Cut::Unreadable][(random >> 40) as usize % 3];
            if random >> 62 != 0 {
                store.flash_mut().left = Some(((random >> 32) as usize % 50, cut));
            }
            let outcome = store.save(&record(number));
            let was_cut = store.flash_mut().is_off;
            store.flash_mut().power_up();
            assert!(outcome.is_ok() || was_cut, "seed {seed}, record {number}");
            let left = store.load();
            let new = Stored::Record(record(number));
            assert!(
                left == new || (was_cut && left == held),
                "seed {seed}, record {number}"
            );
            held = left;
            cuts += u32::from(was_cut);
        }
    }
    println!("{histories} histories, {cuts} losses of power");
    assert!(cuts > 1_000);
}

/// Time is not kind either: bits of what was finished turn.
#[test]
fn a_record_that_was_damaged_is_not_believed_and_not_taken_for_none() {
    let lengths: Vec<usize> = (0..3)
        .map(|number| record(number).to_bytes(1).len())
        .collect();
    let flip = |store: &mut Store<RamFlash>, at: usize| store.flash_mut().bytes_mut()[at] ^= 0x10;
    for at in WORD..WORD + lengths[1] {
        let mut store = Store::new(RamFlash::new());
        store.save(&record(1)).unwrap();
        flip(&mut store, at);
        assert_eq!(store.load(), Stored::Damaged, "byte {at}");
        store.save(&record(2)).unwrap();
        assert_eq!(store.load(), Stored::Record(record(2)));
    }
    // With another record beside it that one counts.
    for at in 0..WORD + lengths[2] {
        let mut store = Store::new(RamFlash::new());
        store.save(&record(1)).unwrap();
        store.save(&record(2)).unwrap();
        flip(&mut store, RAM_PAGE + at);
        assert_eq!(store.load(), Stored::Record(record(1)), "byte {at}");
    }
}

/// Until another record is whole, the damage is not forgotten: a loss of power meanwhile must not have the
/// vertebra swim with the settings of the factory.
#[test]
fn a_loss_of_power_while_a_damaged_record_is_replaced_does_not_hide_it() {
    for pages in 1..=2 {
        let damaged = |left| {
            let mut store = used(pages, 7);
            for page in 0..pages {
                store.flash_mut().damage(page);
            }
            store.flash_mut().left = left;
            store
        };
        assert_eq!(damaged(None).load(), Stored::Damaged);
        for cut in [Cut::Clean, Cut::Torn, Cut::Unreadable] {
            for at in 0.. {
                let mut store = damaged(Some((at, cut)));
                let is_whole = store.save(&record(9)).is_ok();
                store.flash_mut().power_up();
                let left = store.load();
                let is_new = left == Stored::Record(record(9));
                assert!(
                    is_new || !is_whole && left == Stored::Damaged,
                    "{at} {cut:?} {left:?}"
                );
                if is_whole {
                    break;
                }
            }
        }
    }
}

/// What is loaded may have been written by anything: a check that holds proves no sense.
#[test]
fn no_record_whatever_it_holds_makes_a_vertebra_with_settings_out_of_bounds() {
    let mut random = Model::new(0xACE);
    let (mut taken, mut refused) = (0, 0);
    for _ in 0..3_000 {
        let mut settings = Settings::unconfigured(1);
        let mut expected = Vec::new();
        for (index, subindex) in dictionary::settings() {
            let entry = dictionary::served(index, subindex).unwrap();
            // Mostly within the bounds, of which few are that wide.
            let (least, most) = entry.bounds();
            let span = (most - least + 1) as u64;
            let inside = least + (random.next() % span) as i64;
            let value = match random.next() % 40 {
                0 => i64::from(random.next() as i32),
                _ => inside,
            };
            assert!(settings.set(entry.field, value));
            expected.push(settings.value(entry.field));
        }
        let mut record = Record::default();
        record.keep_settings(&settings);
        for _ in 0..random.next() % 400 {
            let _ = record.communication.push(random.next() as u8);
        }
        let mut store = Store::new(RamFlash::new());
        store.save(&record).unwrap();
        let now = Instant::ZERO;
        let vertebra = Vertebra::with_stored(Settings::unconfigured(1), &store.load(), now);
        let found: Vec<_> = dictionary::settings()
            .map(|(index, subindex)| {
                let entry = dictionary::served(index, subindex).unwrap();
                let value = vertebra.core.settings.value(entry.field).unwrap();
                assert!(
                    (entry.bounds().0..=entry.bounds().1).contains(&value),
                    "{entry:?}: {value}"
                );
                Some(value)
            })
            .collect();
        assert!(vertebra.core.settings.are_sound());
        if found == expected {
            taken += 1;
        } else {
            assert!(vertebra.core.settings_lost, "{expected:?} became {found:?}");
            refused += 1;
        }
    }
    println!("{taken} records taken, {refused} refused");
    assert!(taken > 500 && refused > 500);
}
