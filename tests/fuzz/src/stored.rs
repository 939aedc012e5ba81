//! Stored parameters, right, bent or anything: a node takes them over whole or not at all, and a vertebra
//! starts with whatever its flash holds.

use eel_canopen::{Frame, NmtState, STORED_PARAMETERS};
use eel_protocol::{NodeId, dictionary};
use eel_units::Instant;
use eel_vertebra::store::{RAM_PAGE, RamFlash, Store, Stored, serve};
use eel_vertebra::{Settings, Vertebra};

use crate::bench::{Bench, ID, config};
use crate::input::Input;

/// The layout of stored parameters: the bytes before the PDOs, of an RPDO, and of a TPDO.
const HEAD: usize = 21;
const RPDO: usize = 36;
const TPDO: usize = 41;
/// Entries of mappings, right and wrong.
const MAPPED: [u32; 14] = [
    0,
    0x2000_0110,
    0x2000_0408,
    0x2002_0108,
    0x2010_0110,
    0x2010_0220,
    0x2010_0340,
    0x2040_0040,
    0x1001_0008,
    0x0005_0008,
    0x0007_0020,
    0x2010_0108,
    0x2020_0008,
    0x2100_0108,
];
/// The most bytes that are bent.
const BENT: usize = 64;

/// Starts a node or a vertebra with what the bytes say.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    match input.below(3) {
        0 => node(input.take(STORED_PARAMETERS + 8)),
        1 => node(&bent_parameters(&mut input)),
        _ => vertebra(&mut input),
    }
}

/// Starts a node with stored parameters, and has it store and load them again.
fn node(stored: &[u8]) {
    let mut bench = Bench::new(ID, stored);
    let is_refused = bench.node.has_refused_stored();
    let saved = save(&bench);
    if is_refused || stored.is_empty() {
        assert_eq!(saved, save(&Bench::new(ID, &[])), "whole or not at all");
    } else {
        assert_eq!(saved, stored, "what was taken over is what was stored");
    }
    let again = Bench::new(ID, &saved);
    assert!(!again.node.has_refused_stored(), "it takes what it saved");
    assert_eq!(save(&again), saved);
    check_mappings(&mut bench);
    bench.check_alive();
    assert_eq!(save(&bench), saved, "a reset brings them back");
}

fn save(bench: &Bench) -> Vec<u8> {
    let mut bytes = [0; STORED_PARAMETERS];
    let length = bench.node.save_parameters(&mut bytes).expect("room");
    bytes[..length].to_vec()
}

/// Checks by SDO that every PDO is one that SDO could have made.
fn check_mappings(bench: &mut Bench) {
    bench.sent();
    let receive = (0..config(ID).rpdos.len()).map(|number| (0x1400 + number as u16, false));
    let transmit = (0..config(ID).tpdos.len()).map(|number| (0x1800 + number as u16, true));
    for (parameters, is_transmit) in receive.chain(transmit) {
        let mapping = parameters + 0x200;
        let count = bench.read(mapping, 0).expect("a count");
        assert!(count <= 8, "{count} objects");
        let mut bits = 0;
        for subindex in 1..=count as u8 {
            let mapped = bench.read(mapping, subindex).expect("an entry");
            bits += mapped & 0xFF;
            let is_dummy = matches!(mapped >> 16, 1..=7);
            assert!(!(is_transmit && is_dummy), "{mapped:08X}");
            if !is_dummy {
                // Mapped as long as it is, and to be read.
                let [length, sub, low, high] = mapped.to_le_bytes();
                let answer = bench.sdo([0x40, low, high, sub, 0, 0, 0, 0]);
                let answer = answer.expect("an answer");
                let read = match answer[0] {
                    0x41 => u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]),
                    command => 4 - u32::from(command >> 2 & 3),
                };
                assert_eq!(read * 8, u32::from(length), "{mapped:08X}");
            }
        }
        assert!(bits <= 64, "{bits} bits");
        let cob_id = bench.read(parameters, 1).expect("an identifier");
        assert!(cob_id >> 31 == 1 || bits > 0, "enabled and empty");
        let transmission = bench.read(parameters, 2).expect("a type");
        assert!(!matches!(transmission, 241..=253), "{transmission}");
    }
}

/// Bends parameters that are right: any byte, or a PDO's count and objects.
fn bent_parameters(input: &mut Input<'_>) -> Vec<u8> {
    let mut stored = save(&Bench::new(ID, &[]));
    let receive = config(ID).rpdos.len();
    let transmit = config(ID).tpdos.len();
    for _ in 0..input.below(BENT) {
        if input.byte() & 1 == 0 {
            let at = usize::from(input.word()) % stored.len();
            stored[at] = input.byte();
            continue;
        }
        // Behind the head: identifier, type, count, entries; a TPDO has five bytes more.
        let pdo = input.below(receive + transmit);
        let at = HEAD + pdo * RPDO + pdo.saturating_sub(receive) * (TPDO - RPDO);
        let entry = input.below(8);
        stored[at + 3] = input.byte() % 10;
        let mapped: u32 = input.pick(&MAPPED);
        stored[at + 4 + 4 * entry..][..4].copy_from_slice(&mapped.to_le_bytes());
    }
    stored
}

/// Starts a vertebra with a flash in which bytes were bent, and has it store again.
fn vertebra(input: &mut Input<'_>) {
    let mut store = Store::new(RamFlash::new());
    let node = NodeId::new(3).expect("a place");
    let settings = Settings::prototype(node, 1);
    let mut writer = Vertebra::new(settings, Instant::ZERO);
    for _ in 0..input.below(3) {
        change_and_save(&mut writer, &mut store, input);
    }
    let bytes = store.flash_mut().bytes_mut();
    for _ in 0..input.below(BENT) {
        let at = usize::from(input.word() & 0x3FF);
        let page = if input.byte() & 1 == 0 { 0 } else { RAM_PAGE };
        bytes[page + at] = input.byte();
    }
    if input.byte() & 1 == 1 {
        bytes
            .as_chunks_mut::<RAM_PAGE>()
            .0
            .iter_mut()
            .for_each(repair);
    }
    let stored = store.load();
    let mut vertebra = Vertebra::with_stored(settings, &stored, Instant::ZERO);
    check_vertebra(&mut vertebra);
    // Whatever it held, a flash that works takes the next record.
    if change_and_save(&mut vertebra, &mut store, input) {
        assert!(matches!(store.load(), Stored::Record(_)), "it is stored");
    }
    check_vertebra(&mut Vertebra::with_stored(
        settings,
        &store.load(),
        Instant::ZERO,
    ));
}

/// Makes a page's check right again, so that what lies behind it is looked at.
fn repair(page: &mut [u8; RAM_PAGE]) {
    let (first, record) = page.split_at_mut(8);
    first.copy_from_slice(b"eelstore");
    let word = |at: usize| usize::from(u16::from_le_bytes([record[at], record[at + 1]]));
    let length = 16 + word(8) + word(10);
    let Some(rest) = record.get(16..length) else {
        return;
    };
    let mut crc = eel_protocol::Crc32::default();
    crc.update(&record[..12]);
    crc.update(rest);
    let crc = crc.value().to_le_bytes();
    record[12..16].copy_from_slice(&crc);
}

/// Writes a setting and has all stored; tells whether the vertebra asked for it.
fn change_and_save(
    vertebra: &mut Vertebra,
    store: &mut Store<RamFlash>,
    input: &mut Input<'_>,
) -> bool {
    let Some(id) = vertebra.node_id() else {
        return false;
    };
    let subindex = input.byte() % 12;
    let [a, b, c, d] = u32::from(input.word()).to_le_bytes();
    let requests = [
        [0x23, 0x20, 0x20, subindex, a, b, c, d],
        [0x2B, 0x20, 0x20, subindex, a, b, 0, 0],
        [0x2B, 0x17, 0x10, 0, a, b, 0, 0],
        [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'],
    ];
    let cob_id = 0x600 + u16::from(id.get());
    let mut is_stored = false;
    for request in requests {
        let frame = Frame::standard(cob_id, &request).expect("eight bytes");
        vertebra.handle_frame(Instant::ZERO, &frame);
        while vertebra.poll_transmit().is_some() {}
        let before = store.flash_mut().clone();
        serve(vertebra, store, Instant::ZERO);
        is_stored |= *store.flash_mut() != before;
        while vertebra.poll_transmit().is_some() {}
    }
    is_stored
}

/// Checks that a vertebra that was just started lives and keeps its own limits.
fn check_vertebra(vertebra: &mut Vertebra) {
    let Some(id) = vertebra.node_id() else {
        assert_eq!(vertebra.nmt_state(), NmtState::Initialising);
        return;
    };
    let boot_up = Frame::standard(0x700 + u16::from(id.get()), &[0]);
    assert_eq!(vertebra.poll_transmit(), boot_up);
    while vertebra.poll_transmit().is_some() {}
    for (index, subindex) in dictionary::settings() {
        let (object, sub) = dictionary::find(index, subindex).expect("an entry");
        let [low, high] = object.index.to_le_bytes();
        let request = [0x40, low, high, sub.subindex, 0, 0, 0, 0];
        let frame = Frame::standard(0x600 + u16::from(id.get()), &request);
        vertebra.handle_frame(Instant::ZERO, &frame.expect("eight bytes"));
        let answer = vertebra.poll_transmit().expect("an answer");
        let length = usize::from(sub.data_type.length());
        let value = sub.data_type.decode(&answer.data()[4..4 + length]);
        let value = value.expect("a number");
        assert!(
            (sub.min..=sub.max).contains(&value),
            "{} is {value}",
            object.dotted(sub)
        );
    }
}
