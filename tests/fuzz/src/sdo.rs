//! SDO transfers of every kind on a line that loses, repeats, delays and bends frames: what ends well has
//! delivered exactly the bytes, and what does not leaves a server that serves.

use crate::application::{TEXT, WRITABLE_DOMAIN};
use crate::bench::{Bench, ID};
use crate::client::{Client, Failed, Fate, Way};
use crate::input::Input;

/// The most transfers of one run.
const TRANSFERS: usize = 4;
/// So many lost segments a block transfer mends, whichever they are. With more the server can't always tell
/// a client that lost the end of a block and then the beginning of the next from one that is only slow, and
/// ends the transfer rather than take the wrong bytes.
const LOST: usize = 1;
/// The most frames of a transfer that something happens to.
const FATES: usize = 48;

const TEXT_OBJECT: (u16, u8) = (0x2020, 0);
const EIGHT: (u16, u8) = (0x2040, 0);
const WORD: (u16, u8) = (0x2000, 1);
const READABLE: (u16, u8) = (0x2100, 1);
const WRITABLE: (u16, u8) = (0x2100, 2);

/// Does the transfers that the bytes say, and checks what came of each.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let mut bench = Bench::new(ID, &[]);
    bench.watches = false;
    bench.sent();
    for _ in 0..TRANSFERS {
        if input.is_empty() {
            break;
        }
        transfer(&mut bench, &mut input);
    }
    // Whatever happened, a good line brings every object.
    bench.tick(2_000_000);
    bench.sent();
    for object in [TEXT_OBJECT, WRITABLE, READABLE] {
        for way in [
            Way::Segmented { sized: true },
            Way::Block {
                size: 127,
                crc: true,
            },
        ] {
            let read = Client::new(&mut bench, &[]).upload(object, way);
            assert_eq!(read.as_deref(), Ok(value(&bench, object)), "{object:04X?}");
        }
    }
    bench.check_alive();
}

fn transfer(bench: &mut Bench, input: &mut Input<'_>) {
    let object = input.pick(&[TEXT_OBJECT, WRITABLE, READABLE, EIGHT, WORD]);
    let way = match input.below(4) {
        0 => Way::Expedited,
        1 => Way::Segmented {
            sized: input.byte() & 1 != 0,
        },
        kind => Way::Block {
            size: (input.byte() & 0x7F).max(1),
            crc: kind == 2,
        },
    };
    let writes = object != READABLE && input.byte() & 1 != 0;
    let length = usize::from(input.word() & 0x0FFF);
    let seed = input.byte();
    let fates = fates(input, way);
    if writes {
        let longest = match object {
            TEXT_OBJECT => TEXT,
            WRITABLE => WRITABLE_DOMAIN,
            EIGHT => 8,
            _ => 2,
        };
        let length = match object {
            EIGHT | WORD => longest,
            _ => length.min(longest),
        };
        let data = pattern(seed, length);
        let before = value(bench, object).to_vec();
        let mut client = Client::new(bench, &fates);
        let done = client.download(object, &data, way);
        let must = must_succeed(&fates, way, client.has_lost_for_good());
        check_written(bench, object, &before, &data, done);
        if must && (way != Way::Expedited || matches!(data.len(), 1..=4)) {
            assert_eq!(done, Ok(()), "{object:04X?} by {way:?}: {fates:?}");
        }
    } else {
        if object == READABLE {
            bench.app.readable = pattern(seed, length);
        }
        let mut client = Client::new(bench, &fates);
        let done = client.upload(object, way);
        let must = must_succeed(&fates, way, client.has_lost_for_good());
        if let Ok(read) = done {
            assert_eq!(read, value(bench, object), "{object:04X?} by {way:?}");
        } else {
            assert!(!must, "{object:04X?} by {way:?}: {fates:?}");
        }
    }
    assert!(!bench.app.is_writing(), "the transfer has ended");
}

/// Checks an object after it was written, or not.
fn check_written(
    bench: &Bench,
    object: (u16, u8),
    before: &[u8],
    data: &[u8],
    done: Result<(), Failed>,
) {
    let after = value(bench, object);
    if done.is_ok() {
        assert_eq!(after, data, "{object:04X?} is what was written");
    } else {
        // The answer to a transfer that did end well may be what was lost.
        assert!(after == before || after == data, "{object:04X?} is torn");
    }
}

/// Draws what happens to the first frames of a transfer.
fn fates(input: &mut Input<'_>, way: Way) -> Vec<Fate> {
    let count = input.below(FATES);
    let has_crc = matches!(way, Way::Block { crc: true, .. });
    let draw = |input: &mut Input<'_>| match input.byte() {
        0xE0..=0xE7 => Fate::Lost,
        0xE8..=0xEB => Fate::Twice,
        // Without a CRC a client can't tell a late answer from a timely one of another block.
        0xEC..=0xEF if has_crc || !matches!(way, Way::Block { .. }) => {
            Fate::Late(u32::from(input.byte()) * 8_000)
        }
        0xF0..=0xFF => Fate::Bent(input.byte()),
        _ => Fate::Arrives,
    };
    (0..count).map(|_| draw(input)).collect()
}

/// Tells whether a transfer can't fail: on a good line, and where a few segments of blocks get lost.
fn must_succeed(fates: &[Fate], way: Way, lost_for_good: bool) -> bool {
    let lost = fates.iter().filter(|fate| **fate == Fate::Lost).count();
    let others = fates
        .iter()
        .any(|fate| !matches!(fate, Fate::Arrives | Fate::Lost));
    let mends = matches!(way, Way::Block { .. }) && lost <= LOST && !lost_for_good;
    !others && (lost == 0 || mends)
}

/// Returns what an object holds.
fn value(bench: &Bench, object: (u16, u8)) -> &[u8] {
    match object {
        TEXT_OBJECT => &bench.app.text,
        WRITABLE => &bench.app.writable,
        READABLE => &bench.app.readable,
        EIGHT => &bench.app.eight,
        _ => &bench.app.target[0],
    }
}

/// Makes bytes of which no two neighbours are alike.
fn pattern(seed: u8, length: usize) -> Vec<u8> {
    (0..length)
        .map(|at| seed.wrapping_add((at * 7 + at / 256) as u8))
        .collect()
}
