//! Whatever arrives, the node lives: random and mutated frames at random times.

mod common;

use common::{Bench, CONFIG, ID};
use eel_canopen::{Abort, Event, Frame, NmtState, Node, STORED_PARAMETERS};

/// Frames in one run; `CANOPEN_FRAMES` asks for more.
const FRAMES: u32 = 200_000;

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound
    }

    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len() as u64) as usize]
    }
}

/// Sensible frames, from which most of the mutants are made.
const SEEDS: &[(u16, &[u8])] = &[
    (0x000, &[1, 0]),
    (0x000, &[1, ID]),
    (0x000, &[2, ID]),
    (0x000, &[128, ID]),
    (0x000, &[129, ID]),
    (0x000, &[130, ID]),
    (0x080, &[]),
    (0x080, &[7]),
    (0x205, &[1, 0, 2, 0, 3, 0, 4, 5]),
    (0x305, &[1, 0, 2, 0]),
    (0x77F, &[5]),
    (0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]),
    (0x605, &[0x40, 0x08, 0x10, 0, 0, 0, 0, 0]),
    (0x605, &[0x60, 0, 0, 0, 0, 0, 0, 0]),
    (0x605, &[0x70, 0, 0, 0, 0, 0, 0, 0]),
    (0x605, &[0x21, 0x20, 0x20, 0, 20, 0, 0, 0]),
    (0x605, &[0x20, 0x20, 0x20, 0, 0, 0, 0, 0]),
    (0x605, &[0x00, 1, 2, 3, 4, 5, 6, 7]),
    (0x605, &[0x10, 1, 2, 3, 4, 5, 6, 7]),
    (0x605, &[0x13, 1, 2, 3, 4, 5, 6, 7]),
    (0x605, &[0x2F, 0x19, 0x10, 0, 240, 0, 0, 0]),
    (0x605, &[0x2F, 0x19, 0x10, 0, 0, 0, 0, 0]),
    (0x605, &[0x2B, 0x17, 0x10, 0, 1, 0, 0, 0]),
    (0x605, &[0x2B, 0x15, 0x10, 0, 100, 0, 0, 0]),
    (0x605, &[0x23, 0x16, 0x10, 1, 10, 0, 127, 0]),
    (0x605, &[0x23, 0x00, 0x14, 1, 0x05, 0x02, 0, 0x80]),
    (0x605, &[0x23, 0x00, 0x14, 1, 0x05, 0x02, 0, 0]),
    (0x605, &[0x2F, 0x00, 0x14, 2, 255, 0, 0, 0]),
    (0x605, &[0x2F, 0x00, 0x16, 0, 0, 0, 0, 0]),
    (0x605, &[0x2F, 0x00, 0x16, 0, 2, 0, 0, 0]),
    (0x605, &[0x23, 0x00, 0x16, 1, 0x40, 0, 0x22, 0x20]),
    (0x605, &[0x23, 0x00, 0x16, 2, 0x08, 0, 0x05, 0x00]),
    (0x605, &[0x23, 0x02, 0x18, 1, 0x85, 0x03, 0, 0xC0]),
    (0x605, &[0x23, 0x02, 0x18, 1, 0x85, 0x03, 0, 0x40]),
    (0x605, &[0x2B, 0x02, 0x18, 5, 1, 0, 0, 0]),
    (0x605, &[0x2F, 0x02, 0x18, 6, 7, 0, 0, 0]),
    (0x605, &[0x2F, 0x02, 0x1A, 0, 0, 0, 0, 0]),
    (0x605, &[0x23, 0x02, 0x1A, 1, 0x40, 0, 0x22, 0x20]),
    (0x605, &[0x2F, 0x02, 0x1A, 0, 1, 0, 0, 0]),
    (0x605, &[0xA4, 0x08, 0x10, 0, 127, 0, 0, 0]),
    (0x605, &[0xC6, 0x20, 0x20, 0, 9, 0, 0, 0]),
    (0x605, &[0xA3, 0, 0, 0, 0, 0, 0, 0]),
    (0x605, &[0xA2, 3, 127, 0, 0, 0, 0, 0]),
    (0x605, &[0xA1, 0, 0, 0, 0, 0, 0, 0]),
    (0x605, &[0x01, 1, 2, 3, 4, 5, 6, 7]),
    (0x605, &[0x82, 8, 9, 0, 0, 0, 0, 0]),
    (0x605, &[0xD5, 0, 0, 0, 0, 0, 0, 0]),
    (0x605, &[0x80, 0x20, 0x20, 0, 0, 0, 4, 5]),
    (0x605, &[0xC6, 0x23, 0x20, 0, 9, 0, 0, 0]),
    (0x605, &[0xC2, 0x23, 0x20, 0, 0, 4, 0, 0]),
    (0x605, &[0x21, 0x23, 0x20, 0, 14, 0, 0, 0]),
    (0x605, &[0xA4, 0x23, 0x20, 0, 127, 0, 0, 0]),
    (0x605, &[0xA2, 127, 127, 0, 0, 0, 0, 0]),
    (0x605, &[0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e']),
    (0x605, &[0x23, 0x10, 0x10, 2, b's', b'a', b'v', b'e']),
    (0x605, &[0x23, 0x11, 0x10, 1, b'l', b'o', b'a', b'd']),
    (0x605, &[0x23, 0x12, 0x10, 0, 0, 1, 0, 0x80]),
    (0x605, &[0x2F, 0x29, 0x10, 1, 2, 0, 0, 0]),
    (0x100, &[1, 2, 3, 4, 5, 6]),
    (0x7E5, &[0x04, 1, 0, 0, 0, 0, 0, 0]),
    (0x7E5, &[0x04, 0, 0, 0, 0, 0, 0, 0]),
    (0x7E5, &[0x40, 0x78, 0x56, 0x34, 0x12, 0, 0, 0]),
    (0x7E5, &[0x41, 0xE1, 0x0E, 0, 0, 0, 0, 0]),
    (0x7E5, &[0x42, 2, 0, 1, 0, 0, 0, 0]),
    (0x7E5, &[0x43, 0x0D, 0xF0, 0xFE, 0xCA, 0, 0, 0]),
    (0x7E5, &[0x11, 9, 0, 0, 0, 0, 0, 0]),
    (0x7E5, &[0x11, 0xFF, 0, 0, 0, 0, 0, 0]),
    (0x7E5, &[0x13, 0, 0, 0, 0, 0, 0, 0]),
    (0x7E5, &[0x17, 0, 0, 0, 0, 0, 0, 0]),
    (0x7E5, &[0x5D, 0, 0, 0, 0, 0, 0, 0]),
    (0x7E5, &[0x51, 0, 0, 0, 0, 0x80, 0, 0]),
    (0x7E5, &[0x51, 0, 0, 0, 0, 31, 0, 0]),
    (0x7E5, &[0x51, 0x78, 0x56, 0x34, 0x12, 0, 0, 1]),
];

fn random_frame(random: &mut Random) -> Frame {
    let (mut cob_id, seed) = random.pick(SEEDS);
    let mut data = seed.to_vec();
    match random.below(8) {
        0 => cob_id = random.below(0x800) as u16,
        1 => data = (0..random.below(9)).map(|_| random.next() as u8).collect(),
        2..=4 => {
            for _ in 0..=random.below(3) {
                let flipped = 1 << random.below(8);
                if let Some(byte) = data.get_mut(random.below(8) as usize) {
                    *byte = random.pick(&[*byte ^ flipped, 0, 0xFF, 0x7F, 0x10]);
                }
            }
        }
        5 => data.truncate(random.below(9) as usize),
        _ => {}
    }
    match random.below(100) {
        0 => {
            let id = embedded_can::ExtendedId::new(random.next() as u32 & 0x1FFF_FFFF).unwrap();
            Frame::new(id, &data).unwrap()
        }
        1 => Frame::remote(embedded_can::StandardId::new(cob_id).unwrap(), 8).unwrap(),
        _ => Frame::standard(cob_id, &data).unwrap(),
    }
}

/// One step of noise; returns how many frames the node sent.
fn disturb(bench: &mut Bench, random: &mut Random) -> usize {
    let frame = random_frame(random);
    bench
        .node
        .handle_frame(bench.now_us, &frame, &mut bench.app);
    bench.now_us += random.pick(&[0, 0, 1, 100, 999, 10_000, 250_000, 1_000_000]);
    if random.below(2) == 0 {
        bench.node.tick(bench.now_us, &mut bench.app);
    }
    match random.below(50) {
        0 => bench.node.emergency(
            bench.now_us,
            random.next() as u16,
            random.next() as u8,
            [1; 5],
        ),
        1 => bench
            .node
            .emergency_cleared(bench.now_us, random.next() as u8),
        2 => bench.node.request_tpdo(random.next() as u8),
        3 => bench.app.refuse = !bench.app.refuse,
        4..=6 => {
            let outcome = random.pick(&[Ok(()), Ok(()), Err(Abort::Hardware)]);
            finish(bench, outcome);
        }
        _ => {}
    }
    bench.app.calls.clear();
    if random.below(4) == 0 {
        bench.sent().len()
    } else {
        0
    }
}

/// Ends what the node asked to be stored.
fn finish(bench: &mut Bench, outcome: Result<(), Abort>) {
    let mut bytes = [0; STORED_PARAMETERS];
    let length = bench.node.save_parameters(&mut bytes).unwrap();
    let outcome = outcome.map(|()| &bytes[..length]);
    bench.node.finish_store(bench.now_us, outcome);
}

/// Gives the node its id and its defaults back, whatever LSS and SDO have made of them.
fn restore(bench: &mut Bench) {
    let lss = |bench: &mut Bench, command: u8, value: u8| {
        bench.hear(0x7E5, &[command, value, 0, 0, 0, 0, 0, 0]);
        finish(bench, Ok(()));
    };
    finish(bench, Ok(()));
    for (command, value) in [(0x04, 1), (0x11, ID), (0x17, 0), (0x04, 0)] {
        lss(bench, command, value);
    }
    bench.hear(0, &[130, 0]);
    assert_eq!(bench.node.node_id(), ID);
    bench.sent();
    let load = [0x23, 0x11, 0x10, 1, b'l', b'o', b'a', b'd'];
    bench.hear(0x605, &load);
    finish(bench, Ok(()));
    assert_eq!(
        bench.sent(),
        [(0x585, vec![0x60, 0x11, 0x10, 1, 0, 0, 0, 0])]
    );
}

/// The node does what it should after a reset.
fn prove_alive(bench: &mut Bench) {
    bench.app.refuse = false;
    restore(bench);
    bench.hear(0, &[129, ID]);
    assert_eq!(bench.sent(), [(0x705, vec![0])]);
    assert_eq!(bench.app.coming, None, "a reset ends a transfer");
    bench.events();
    assert_eq!(
        bench.sdo([0x40, 0x18, 0x10, 4, 0, 0, 0, 0]),
        [0x43, 0x18, 0x10, 4, 0x0D, 0xF0, 0xFE, 0xCA]
    );
    bench.hear(0, &[1, ID]);
    assert_eq!(bench.node.nmt_state(), NmtState::Operational);
    bench.hear(0x205, &[1, 0, 2, 0, 3, 0, 4, 5]);
    assert_eq!(bench.ask(0x080, &[]).len(), 1);
    assert_eq!(bench.app.target, [1, 2, 3]);
    assert_eq!(bench.events().last(), Some(&Event::Sync { counter: None }));
}

#[test]
fn lives_through_any_frames_and_works_afterwards() {
    let asked = std::env::var("CANOPEN_FRAMES")
        .ok()
        .and_then(|text| text.parse().ok());
    let frames: u32 = asked.unwrap_or(FRAMES);
    let seed = std::env::var("CANOPEN_SEED")
        .ok()
        .and_then(|text| text.parse().ok());
    let seed: u64 = seed.unwrap_or(0xEE1);
    println!("seed {seed}, {frames} frames");
    let mut random = Random(seed);
    let mut bench = Bench::with(CONFIG);
    let mut sent = 0;
    for _ in 0..frames / 1_000 {
        for _ in 0..1_000 {
            sent += disturb(&mut bench, &mut random);
        }
        prove_alive(&mut bench);
    }
    let counters = bench.node.counters();
    println!("{sent} frames sent, {counters:?}");
    assert!(
        sent as u32 > frames / 20,
        "the noise did reach the node: {sent}"
    );
    assert!(counters.rpdos_short > 0 && counters.rpdos_refused > 0);
}

#[test]
fn never_answers_a_frame_with_a_storm() {
    let mut random = Random(7);
    let mut bench = Bench::operational();
    for _ in 0..20_000 {
        let frame = random_frame(&mut random);
        bench
            .node
            .handle_frame(bench.now_us, &frame, &mut bench.app);
        // At most four TPDOs, or one answer, and the end of a fault or two.
        let sent = bench.sent();
        assert!(sent.len() <= 7, "{frame:?}: {sent:02X?}");
        bench.now_us += 100;
    }
}

#[test]
fn its_own_frames_come_back_without_an_echo() {
    let mut bench = Bench::operational();
    bench.hear(0x080, &[]);
    bench.node.emergency(bench.now_us, 0x1000, 1, [0; 5]);
    bench.hear(0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
    bench.pass_ms(200);
    for (cob_id, data) in bench.sent() {
        assert_eq!(bench.ask(cob_id, &data), [], "{cob_id:X}");
    }
}

#[test]
fn fits_a_small_memory() {
    let size = size_of::<Node>();
    println!("{size} bytes");
    // Wider pointers and alignment here make it larger than on the target.
    assert!(size <= 3_072, "{size} bytes");
}
