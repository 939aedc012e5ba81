//! Storing and restoring parameters (CiA 301, 0x1010 and 0x1011), TIME (0x1012) and the behaviour
//! after errors (0x1029).

mod common;

use common::{Bench, CONFIG, MASTER};
use eel_canopen::{
    Abort, Config, Event, Group, NmtCommand, NmtState, STORED_PARAMETERS, StoreRequest,
};

const SAVE: u32 = 0x6576_6173;
const LOAD: u32 = 0x6461_6F6C;

/// Asks for something to be stored and returns the answer after the owner's.
fn store(bench: &mut Bench, index: u16, subindex: u8, outcome: Result<(), Abort>) -> Vec<u8> {
    let [low, high] = index.to_le_bytes();
    let [a, b, c, d] = if index == 0x1010 { SAVE } else { LOAD }.to_le_bytes();
    let asked = bench.ask(0x605, &[0x23, low, high, subindex, a, b, c, d]);
    assert_eq!(asked, [], "nothing is promised yet");
    let saved = parameters(bench);
    let outcome = outcome.map(|()| saved.as_slice());
    bench.node.finish_store(bench.now_us, outcome);
    let mut sent = bench.sent();
    assert_eq!(sent.len(), 1);
    sent.remove(0).1
}

/// Returns the request to save everything.
fn save_all() -> [u8; 8] {
    let [a, b, c, d] = SAVE.to_le_bytes();
    [0x23, 0x10, 0x10, 1, a, b, c, d]
}

/// Tells the node that it is done.
fn finish(bench: &mut Bench) {
    let saved = parameters(bench);
    bench.node.finish_store(bench.now_us, Ok(&saved));
}

fn parameters(bench: &Bench) -> Vec<u8> {
    let mut bytes = [0; STORED_PARAMETERS];
    let length = bench.node.save_parameters(&mut bytes).unwrap();
    bytes[..length].to_vec()
}

/// Changes one parameter of every kind.
fn change(bench: &mut Bench) {
    for (index, subindex, value, length) in CHANGED {
        assert_eq!(
            bench.write(index, subindex, value, length),
            Ok(()),
            "{index:X}:{subindex}"
        );
    }
}

/// Writes in an order that CiA 301 allows; what is read afterwards is the last of each object.
const CHANGED: [(u16, u8, u32, u8); 27] = [
    (0x1005, 0, 0x081, 4),
    (0x1019, 0, 10, 1),
    (0x1012, 0, 0x0000_00FF, 4),
    (0x1014, 0, 0x8000_0085, 4),
    (0x1014, 0, 0x8000_0090, 4),
    (0x1015, 0, 30, 2),
    (0x1016, 1, 0x0011_01F4, 4),
    (0x1017, 0, 333, 2),
    (0x1029, 1, 2, 1),
    (0x1400, 1, 0x8000_0205, 4),
    (0x1400, 2, 255, 1),
    (0x1600, 0, 0, 1),
    (0x1600, 1, 0x2000_0210, 4),
    (0x1600, 2, 0x0005_0008, 4),
    (0x1600, 3, 0x2000_0110, 4),
    (0x1600, 0, 3, 1),
    (0x1400, 1, 0x0000_0222, 4),
    (0x1800, 1, 0xC000_0185, 4),
    (0x1800, 2, 7, 1),
    (0x1800, 3, 100, 2),
    (0x1800, 5, 50, 2),
    (0x1800, 6, 3, 1),
    (0x1A00, 0, 0, 1),
    (0x1A00, 1, 0x2010_0220, 4),
    (0x1A00, 0, 1, 1),
    (0x1800, 1, 0x4000_0185, 4),
    (0x1802, 1, 0xC000_0385, 4),
];

/// Returns what each changed object reads as.
fn readings(bench: &mut Bench) -> Vec<Result<u32, u32>> {
    CHANGED
        .map(|(index, subindex, ..)| bench.read(index, subindex))
        .to_vec()
}

#[test]
fn saved_parameters_outlive_both_resets_and_the_power() {
    let mut bench = Bench::pre_operational();
    let defaults = readings(&mut bench);
    change(&mut bench);
    let changed = readings(&mut bench);
    assert_ne!(defaults, changed);
    assert_eq!(bench.read(0x1010, 0), Ok(3));
    assert_eq!(bench.read(0x1010, 1), Ok(1));
    assert_eq!(
        store(&mut bench, 0x1010, 1, Ok(())),
        [0x60, 0x10, 0x10, 1, 0, 0, 0, 0]
    );
    let event = Event::Store(StoreRequest::Save(Group::All));
    assert!(bench.events().contains(&event));
    for reset in [130, 129] {
        bench.ask(0, &[reset, 0]);
        assert_eq!(readings(&mut bench), changed, "after NMT {reset}");
    }
    let stored = parameters(&bench);
    let mut bench = Bench::stored(CONFIG, &stored);
    bench.sent();
    assert_eq!(readings(&mut bench), changed, "after power-on");
    assert!(!bench.node.has_refused_stored());

    store(&mut bench, 0x1011, 2, Ok(()));
    assert_eq!(readings(&mut bench), changed, "until the next reset");
    bench.ask(0, &[130, 0]);
    assert_eq!(readings(&mut bench), defaults);
    assert_eq!(bench.node.stored_parameters(), []);
}

#[test]
fn what_was_not_saved_is_gone_after_a_reset() {
    let mut bench = Bench::pre_operational();
    let defaults = readings(&mut bench);
    change(&mut bench);
    let failed = store(&mut bench, 0x1010, 1, Err(Abort::Hardware));
    assert_eq!(failed, [0x80, 0x10, 0x10, 1, 0, 0, 0x06, 0x06]);
    store(&mut bench, 0x1010, 3, Ok(()));
    bench.ask(0, &[130, 0]);
    assert_eq!(readings(&mut bench), defaults);
}

#[test]
fn the_predefined_identifiers_follow_a_new_node_id() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.write(0x1400, 1, 0x8000_0205, 4), Ok(()));
    assert_eq!(bench.write(0x1400, 1, 0x0000_0233, 4), Ok(()));
    let stored = parameters(&bench);
    let mut bench = Bench::stored(
        Config {
            node_id: 9,
            ..CONFIG
        },
        &stored,
    );
    bench.sent();
    let mut read = |index: u16, subindex| {
        let [low, high] = index.to_le_bytes();
        let sent = bench.ask(0x609, &[0x40, low, high, subindex, 0, 0, 0, 0]);
        u32::from_le_bytes(sent[0].1[4..].try_into().unwrap())
    };
    assert_eq!(read(0x1014, 0), 0x089);
    assert_eq!(read(0x1800, 1), 0x4000_0189);
    assert_eq!(read(0x1400, 1), 0x233);
}

#[test]
fn stored_bytes_that_this_node_can_not_have_are_refused_as_a_whole() {
    let mut bench = Bench::pre_operational();
    change(&mut bench);
    let stored = parameters(&bench);
    let defaults = readings(&mut Bench::pre_operational());
    let refused = |bytes: &[u8]| {
        let mut bench = Bench::stored(CONFIG, bytes);
        bench.sent();
        bench.node.has_refused_stored() && readings(&mut bench) == defaults
    };
    for length in 1..stored.len() {
        assert!(refused(&stored[..length]), "{length} bytes");
    }
    assert!(refused(&[stored.as_slice(), &[0]].concat()));
    assert!(refused(&[0; 1_000]));
    // The layout's version, SYNC as extended, a reserved transmission type, an object that is not there.
    for (at, byte) in [(0, 2), (2, 0x08), (23, 245), (28, 0x55)] {
        let mut wrong = stored.clone();
        wrong[at] = byte;
        assert!(refused(&wrong), "byte {at}");
    }
}

#[test]
fn nothing_is_stored_without_the_signature_or_against_the_device_s_state() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.write(0x1010, 1, LOAD, 4), Err(0x0800_0020));
    assert_eq!(bench.write(0x1011, 1, SAVE, 4), Err(0x0800_0020));
    assert_eq!(bench.write(0x1010, 4, SAVE, 4), Err(0x0609_0011));
    assert_eq!(bench.write(0x1010, 0, 1, 1), Err(0x0601_0002));
    assert_eq!(bench.write(0x1010, 1, SAVE, 2), Err(0x0607_0013));
    bench.app.refuse_configuration = true;
    assert_eq!(bench.write(0x1010, 1, SAVE, 4), Err(0x0800_0022));
    assert_eq!(bench.events(), []);
}

#[test]
fn the_application_can_keep_the_communication_as_it_is() {
    let mut bench = Bench::operational();
    bench.app.refuse_configuration = true;
    let defaults = readings(&mut bench);
    for (index, subindex, value, length) in CHANGED {
        let refused = Err(0x0800_0022);
        assert_eq!(bench.write(index, subindex, value, length), refused);
    }
    assert_eq!(readings(&mut bench), defaults);
    assert_eq!(bench.write(0x1003, 0, 0, 1), Ok(()));
    assert_eq!(bench.write(0x2000, 1, 5, 2), Ok(()));
}

#[test]
fn one_thing_is_stored_at_a_time_and_not_for_ever() {
    let mut bench = Bench::pre_operational();
    let [a, b, c, d] = SAVE.to_le_bytes();
    let save = [0x23, 0x10, 0x10, 2, a, b, c, d];
    assert_eq!(bench.ask(0x605, &save), []);
    bench.pass_ms(999);
    bench.sent();
    bench.pass_ms(1);
    let timeout = (0x585, vec![0x80, 0x10, 0x10, 2, 0, 0, 0x06, 0x06]);
    assert!(bench.sent().contains(&timeout));
    assert_eq!(bench.write(0x1011, 1, LOAD, 4), Err(0x0800_0022));
    // The flash ends late, without a word, and the next one may come.
    finish(&mut bench);
    assert_eq!(bench.sent(), []);
    assert_eq!(bench.ask(0x605, &save), []);
}

#[test]
fn a_node_that_was_stopped_does_not_answer_when_all_is_stored() {
    for late in [false, true] {
        let mut bench = Bench::pre_operational();
        assert_eq!(bench.ask(0x605, &save_all()), []);
        bench.ask(0, &[2, 0]);
        if late {
            bench.pass_ms(1_500);
        }
        finish(&mut bench);
        let sent = bench.sent();
        assert!(sent.iter().all(|(cob_id, _)| *cob_id == 0x705), "{sent:?}");
        bench.ask(0, &[128, 0]);
        bench.pass_ms(1_500);
        let sent = bench.sent();
        assert!(sent.iter().all(|(cob_id, _)| *cob_id == 0x705), "{sent:?}");
    }
}

#[test]
fn a_client_that_no_longer_waits_is_not_answered() {
    for request in [
        [0x80, 0x10, 0x10, 1, 0, 0, 0x04, 0x05],
        [0x40, 0x17, 0x10, 0, 0, 0, 0, 0],
    ] {
        for late in [false, true] {
            let mut bench = Bench::pre_operational();
            assert_eq!(bench.ask(0x605, &save_all()), []);
            bench.ask(0x605, &request);
            if late {
                bench.pass_ms(1_500);
            }
            finish(&mut bench);
            let sent = bench.sent();
            assert!(sent.iter().all(|(cob_id, _)| *cob_id != 0x585), "{sent:?}");
        }
    }
}

#[test]
fn what_was_asked_for_is_kept_whatever_happens_before_the_flash_is_done() {
    for reset in [None, Some(130), Some(129)] {
        let mut bench = Bench::pre_operational();
        change(&mut bench);
        let changed = readings(&mut bench);
        assert_eq!(bench.ask(0x605, &save_all()), []);
        let saved = parameters(&bench);
        match reset {
            Some(reset) => drop(bench.ask(0, &[reset, 0])),
            None => assert_eq!(bench.write(0x1017, 0, 444, 2), Ok(())),
        }
        bench.node.finish_store(bench.now_us, Ok(&saved));
        bench.ask(0, &[130, 0]);
        assert_eq!(readings(&mut bench), changed, "{reset:?}");
        assert_eq!(bench.node.stored_parameters(), saved);
    }
}

#[test]
fn hears_the_time_of_day() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.read(0x1012, 0), Ok(0x8000_0100));
    bench.events();
    // 28 bits of milliseconds, the four above are reserved.
    bench.hear(0x100, &[0x78, 0x56, 0x34, 0xF2, 0x10, 0x3D]);
    let (days, ms) = (0x3D10, 0x0234_5678);
    assert_eq!(bench.events(), [Event::Time { days, ms }]);
    bench.hear(0x100, &[0; 5]);
    assert_eq!(bench.write(0x1012, 0, 0x4000_0100, 4), Err(0x0609_0030));
    assert_eq!(bench.write(0x1012, 0, 0x0000_0100, 4), Ok(()));
    bench.hear(0x100, &[0; 6]);
    assert_eq!(bench.events(), []);
}

#[test]
fn leaves_operational_after_an_error_as_it_was_told() {
    for (behaviour, state, command) in [
        (
            0,
            NmtState::PreOperational,
            Some(NmtCommand::EnterPreOperational),
        ),
        (1, NmtState::Operational, None),
        (2, NmtState::Stopped, Some(NmtCommand::Stop)),
    ] {
        let mut bench = Bench::operational();
        assert_eq!(bench.write(0x1029, 1, behaviour, 1), Ok(()));
        bench.hear(0x700 + u16::from(MASTER), &[5]);
        bench.events();
        bench.pass_ms(301);
        assert_eq!(bench.node.nmt_state(), state);
        let told = bench.events().into_iter().find_map(|event| match event {
            Event::Nmt { command, .. } => Some(command),
            _ => None,
        });
        assert_eq!(told, command);
    }
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.read(0x1029, 0), Ok(1));
    assert_eq!(bench.write(0x1029, 1, 3, 1), Err(0x0609_0030));
}
