//! Layer setting services, byte by byte (CiA 305).

mod common;

use common::{Bench, CONFIG, ID, Sent};
use eel_canopen::{Abort, Config, Event, NmtState, StoreRequest};

const REQUEST: u16 = 0x7E5;
const UNCONFIGURED: u8 = 0xFF;
/// The identity of the node under test as LSS speaks of it.
const NUMBERS: [u32; 4] = [0x1234_5678, 0x0000_0EE1, 0x0001_0002, 0xCAFE_F00D];

fn unconfigured() -> Bench {
    let mut bench = Bench::with(Config {
        node_id: UNCONFIGURED,
        node_ids: (1, 10),
        ..CONFIG
    });
    assert_eq!(bench.sent(), []);
    bench
}

/// Sends a command with a number.
fn number(bench: &mut Bench, command: u8, value: u32) -> Vec<Sent> {
    let [a, b, c, d] = value.to_le_bytes();
    bench.ask(REQUEST, &[command, a, b, c, d, 0, 0, 0])
}

/// Sends a command with a byte.
fn byte(bench: &mut Bench, command: u8, value: u8) -> Vec<Sent> {
    bench.ask(REQUEST, &[command, value, 0, 0, 0, 0, 0, 0])
}

fn answer(data: [u8; 8]) -> Vec<Sent> {
    vec![(0x7E4, data.to_vec())]
}

/// Asks a fastscan question and tells whether the node answered.
fn scan(bench: &mut Bench, value: u32, bit: u8, place: u8, next: u8) -> bool {
    let [a, b, c, d] = value.to_le_bytes();
    let sent = bench.ask(REQUEST, &[0x51, a, b, c, d, bit, place, next]);
    assert!(sent.is_empty() || sent == answer([0x4F, 0, 0, 0, 0, 0, 0, 0]));
    !sent.is_empty()
}

/// Finds all four numbers as CiA 305 describes it: bit by bit from the highest.
fn fastscan(bench: &mut Bench) -> Option<[u32; 4]> {
    if !scan(bench, 0, 0x80, 0, 0) {
        return None;
    }
    let mut found = [0; 4];
    for (place, number) in (0..).zip(&mut found) {
        for bit in (0..32).rev() {
            if !scan(bench, *number, bit, place, place) {
                *number |= 1 << bit;
            }
        }
        assert!(scan(bench, *number, 0, place, (place + 1) % 4));
    }
    Some(found)
}

#[test]
fn an_unconfigured_node_is_deaf_to_all_but_lss() {
    let mut bench = unconfigured();
    for (cob_id, data) in [
        (0, vec![1, 0]),
        (0x080, vec![]),
        (0x6FF, vec![0x40, 0, 0x10, 0, 0, 0, 0, 0]),
        (0x77F, vec![5]),
        (0x100, vec![0; 6]),
    ] {
        assert_eq!(bench.ask(cob_id, &data), []);
    }
    bench.pass_ms(1_000);
    assert_eq!(bench.sent(), []);
    assert_eq!(bench.node.nmt_state(), NmtState::Initialising);
    assert_eq!(
        byte(&mut bench, 0x4C, 0),
        answer([0x50, 0, 0, 0, 0, 0, 0, 0])
    );
}

#[test]
fn fastscan_finds_the_identity_and_leaves_the_node_to_be_configured() {
    let mut bench = unconfigured();
    assert_eq!(fastscan(&mut bench), Some(NUMBERS));
    // In configuration it scans no more, and takes an id.
    assert!(!scan(&mut bench, 0, 0x80, 0, 0));
    assert_eq!(
        byte(&mut bench, 0x11, 7),
        answer([0x11, 0, 0, 0, 0, 0, 0, 0])
    );
    assert_eq!(byte(&mut bench, 0x04, 0), [(0x707, vec![0])]);
    assert_eq!(bench.node.node_id(), 7);
    assert_eq!(bench.node.nmt_state(), NmtState::PreOperational);
    assert_eq!(bench.events(), [Event::NodeId(7)]);
    assert_eq!(
        bench.ask(0x607, &[0x40, 0x14, 0x10, 0, 0, 0, 0, 0]),
        [(0x587, vec![0x43, 0x14, 0x10, 0, 0x87, 0, 0, 0])],
        "the predefined identifiers follow the id"
    );
    assert_eq!(fastscan(&mut bench), None, "a configured node hides");
}

#[test]
fn fastscan_asks_the_numbers_in_their_order_only() {
    let mut bench = unconfigured();
    assert!(scan(&mut bench, 0, 0x80, 0, 0));
    assert!(!scan(&mut bench, NUMBERS[1], 0, 1, 2));
    assert!(!scan(&mut bench, NUMBERS[0] ^ 1, 0, 0, 1));
    assert!(scan(&mut bench, NUMBERS[0] ^ 1, 1, 0, 0));
    assert!(!scan(&mut bench, NUMBERS[0], 32, 0, 0));
    assert!(!scan(&mut bench, NUMBERS[0], 0, 0, 4));
}

#[test]
fn a_selective_switch_takes_four_matching_numbers_in_order() {
    let mut bench = Bench::pre_operational();
    for (place, value) in NUMBERS.into_iter().enumerate().take(3) {
        assert_eq!(number(&mut bench, 0x40 + place as u8, value), []);
    }
    assert_eq!(
        number(&mut bench, 0x43, NUMBERS[3]),
        answer([0x44, 0, 0, 0, 0, 0, 0, 0])
    );
    assert_eq!(
        byte(&mut bench, 0x5E, 0),
        answer([0x5E, ID, 0, 0, 0, 0, 0, 0])
    );
    assert_eq!(
        byte(&mut bench, 0x5D, 0),
        answer([0x5D, 0x0D, 0xF0, 0xFE, 0xCA, 0, 0, 0])
    );
    byte(&mut bench, 0x04, 0);

    for wrong in 0..4 {
        for (place, value) in NUMBERS.into_iter().enumerate() {
            let value = value ^ u32::from(place == wrong);
            assert_eq!(number(&mut bench, 0x40 + place as u8, value), []);
        }
        assert_eq!(byte(&mut bench, 0x5E, 0), [], "still waiting");
    }
}

#[test]
fn a_waiting_node_configures_nothing() {
    let mut bench = Bench::pre_operational();
    for command in [0x11, 0x13, 0x15, 0x17, 0x5A, 0x5B, 0x5C, 0x5D, 0x5E] {
        assert_eq!(byte(&mut bench, command, 3), []);
    }
    bench.hear(0, &[130, 0]);
    assert_eq!(bench.node.node_id(), ID);
}

#[test]
fn only_ids_that_the_device_may_have_and_one_bit_rate_are_taken() {
    let mut bench = unconfigured();
    byte(&mut bench, 0x04, 1);
    for id in [0, 11, 127, 128, 254] {
        assert_eq!(
            byte(&mut bench, 0x11, id),
            answer([0x11, 1, 0, 0, 0, 0, 0, 0])
        );
    }
    for id in [1, 10, 255] {
        assert_eq!(
            byte(&mut bench, 0x11, id),
            answer([0x11, 0, 0, 0, 0, 0, 0, 0])
        );
    }
    let timing =
        |bench: &mut Bench, table, index| bench.ask(REQUEST, &[0x13, table, index, 0, 0, 0, 0, 0]);
    assert_eq!(
        timing(&mut bench, 0, 0),
        answer([0x13, 0, 0, 0, 0, 0, 0, 0])
    );
    assert_eq!(
        timing(&mut bench, 0, 2),
        answer([0x13, 1, 0, 0, 0, 0, 0, 0])
    );
    assert_eq!(
        timing(&mut bench, 1, 0),
        answer([0x13, 1, 0, 0, 0, 0, 0, 0])
    );
}

#[test]
fn a_configured_node_takes_its_new_id_at_the_reset_of_communication() {
    let mut bench = Bench::operational();
    byte(&mut bench, 0x04, 1);
    byte(&mut bench, 0x11, 9);
    byte(&mut bench, 0x04, 0);
    assert_eq!(bench.node.node_id(), ID);
    assert_eq!(bench.ask(0, &[130, ID]), [(0x709, vec![0])]);
    assert!(bench.events().contains(&Event::NodeId(9)));
    // What was not stored is gone with the power.
    assert_eq!(bench.ask(0, &[129, 9]), [(0x705, vec![0])]);
}

#[test]
fn the_id_is_stored_by_whoever_has_the_flash_and_then_outlives_a_reset() {
    let mut bench = unconfigured();
    byte(&mut bench, 0x04, 1);
    byte(&mut bench, 0x11, 4);
    assert_eq!(byte(&mut bench, 0x17, 0), [], "nothing is promised yet");
    assert_eq!(bench.events(), [Event::Store(StoreRequest::NodeId(4))]);
    bench.node.finish_store(bench.now_us, Ok(&[]));
    assert_eq!(bench.sent(), answer([0x17, 0, 0, 0, 0, 0, 0, 0]));
    byte(&mut bench, 0x04, 0);
    assert_eq!(bench.ask(0, &[129, 0]), [(0x704, vec![0])]);

    byte(&mut bench, 0x04, 1);
    byte(&mut bench, 0x17, 0);
    bench.node.finish_store(bench.now_us, Err(Abort::Hardware));
    assert_eq!(bench.sent(), answer([0x17, 2, 0, 0, 0, 0, 0, 0]));
    bench.app.refuse_configuration = true;
    assert_eq!(
        byte(&mut bench, 0x17, 0),
        answer([0x17, 2, 0, 0, 0, 0, 0, 0])
    );
}

#[test]
fn a_node_loses_its_id_when_told_so() {
    let mut bench = Bench::pre_operational();
    byte(&mut bench, 0x04, 1);
    byte(&mut bench, 0x11, UNCONFIGURED);
    byte(&mut bench, 0x04, 0);
    assert_eq!(bench.ask(0, &[130, 0]), []);
    assert_eq!(bench.node.nmt_state(), NmtState::Initialising);
    assert_eq!(fastscan(&mut bench), Some(NUMBERS));
}

#[test]
fn identifies_itself_within_ranges_of_revision_and_serial_number() {
    let ask = |bench: &mut Bench, ranges: [u32; 6]| {
        let mut last = Vec::new();
        for (place, value) in ranges.into_iter().enumerate() {
            assert_eq!(last, []);
            last = number(bench, 0x46 + place as u8, value);
        }
        last
    };
    let [vendor, product, revision, serial] = NUMBERS;
    let exact = [vendor, product, revision, revision, serial, serial];
    let mut bench = Bench::pre_operational();
    let yes = answer([0x4F, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(ask(&mut bench, exact), yes);
    assert_eq!(
        ask(&mut bench, [vendor, product, 0, u32::MAX, 0, u32::MAX]),
        yes
    );
    for place in 0..6 {
        let mut wrong = exact;
        wrong[place] = if place % 2 == 0 {
            wrong[place] + 1
        } else {
            wrong[place] - 1
        };
        assert_eq!(ask(&mut bench, wrong), [], "number {place}");
    }
}

#[test]
fn frames_of_another_length_are_none() {
    let mut bench = unconfigured();
    assert_eq!(bench.ask(REQUEST, &[0x4C]), []);
    assert_eq!(bench.ask(REQUEST, &[0x4C, 0, 0, 0, 0, 0, 0]), []);
}
