//! Settings, communication and node id over a loss of power.

use eel_canopen::{Frame, NmtCommand};
use eel_protocol::emergency::Emergency;
use eel_protocol::{Condition, Mode, NodeId, State, identity};
use eel_vertebra::store::{RAM_PAGE, Record, StoreError, Stored};
use eel_vertebra::{Drive, Event, Settings};

use support::{Bench, NODE, faulty, node};

mod support;

const HARDWARE: u32 = 0x0606_0000;
const DEVICE_STATE: u32 = 0x0800_0022;
const STIFFNESS: (u16, u8) = (0x2020, 1);

fn prototype() -> Settings {
    Settings::prototype(node(), 77)
}

fn save(bench: &mut Bench, group: u8) -> Result<(), u32> {
    bench.download(0x1010, group, b"save")
}

fn restore(bench: &mut Bench, group: u8) -> Result<(), u32> {
    bench.download(0x1011, group, b"load")
}

/// Writes a setting and a communication parameter.
fn change(bench: &mut Bench, stiffness: u32, heartbeat: u16) {
    let (index, subindex) = STIFFNESS;
    bench
        .download(index, subindex, &stiffness.to_le_bytes())
        .unwrap();
    bench.download(0x1017, 0, &heartbeat.to_le_bytes()).unwrap();
}

/// Reads both back.
fn held(bench: &mut Bench) -> (u32, u16) {
    let (index, subindex) = STIFFNESS;
    let stiffness = bench.upload(index, subindex).unwrap();
    let heartbeat = bench.upload(0x1017, 0).unwrap();
    (
        u32::from_le_bytes(stiffness.try_into().unwrap()),
        u16::from_le_bytes(heartbeat.try_into().unwrap()),
    )
}

const FACTORY: (u32, u16) = (400_000, 200);

#[test]
fn what_is_stored_outlives_power_and_reset_and_what_is_not_does_not() {
    for (group, after) in [
        (1, (123_456, 500)),
        (2, (400_000, 500)),
        (3, (123_456, 200)),
    ] {
        let mut bench = Bench::ready();
        bench.maintain();
        change(&mut bench, 123_456, 500);
        save(&mut bench, group).unwrap();
        change(&mut bench, 99, 999);
        bench.power_cycle(prototype());
        assert_eq!(held(&mut bench), after, "group {group}");
        change(&mut bench, 99, 999);
        bench.nmt(NmtCommand::ResetNode);
        bench.run(2);
        assert_eq!(held(&mut bench), after, "group {group}");
    }
}

#[test]
fn one_group_is_stored_and_restored_without_the_other() {
    let mut bench = Bench::ready();
    bench.maintain();
    change(&mut bench, 111_111, 111);
    save(&mut bench, 3).unwrap();
    save(&mut bench, 2).unwrap();
    bench.power_cycle(prototype());
    assert_eq!(held(&mut bench), (111_111, 111));
    restore(&mut bench, 2).unwrap();
    assert_eq!(held(&mut bench), (111_111, 111), "until the next reset");
    bench.nmt(NmtCommand::ResetNode);
    bench.run(2);
    assert_eq!(held(&mut bench), (111_111, 200));
    restore(&mut bench, 1).unwrap();
    bench.power_cycle(prototype());
    assert_eq!(held(&mut bench), FACTORY);
}

#[test]
fn nothing_is_stored_while_motors_are_live() {
    let mut bench = Bench::running();
    assert_eq!(save(&mut bench, 1), Err(DEVICE_STATE));
    assert_eq!(restore(&mut bench, 3), Err(DEVICE_STATE));
    bench.stream = false;
    bench.until(State::StopBrake, 1_000);
    assert_eq!(save(&mut bench, 1), Err(DEVICE_STATE));
    bench.until(State::StopOff, 3_000);
    assert_eq!(save(&mut bench, 1), Ok(()));
    assert_eq!(bench.state(), State::StopOff);
}

/// The motors that are not at fault brake for two seconds.
#[test]
fn nothing_is_stored_or_set_while_a_fault_still_brakes() {
    let mut bench = faulty();
    bench.nmt(NmtCommand::EnterPreOperational);
    bench.run(2);
    let (index, subindex) = STIFFNESS;
    while bench.drives.contains(&Drive::Brake) {
        assert_eq!(bench.state(), State::Fault);
        assert_eq!(save(&mut bench, 1), Err(DEVICE_STATE));
        assert_eq!(bench.download(0x1016, 1, &[0; 4]), Err(DEVICE_STATE));
        let refused = bench.download(index, subindex, &5_000u32.to_le_bytes());
        assert_eq!(refused, Err(DEVICE_STATE));
        bench.run(100);
    }
    assert_eq!(bench.state(), State::Fault);
    change(&mut bench, 5_000, 300);
    assert_eq!(save(&mut bench, 1), Ok(()));
}

/// A head that saves and resets in one breath, and a flash that takes its time.
#[test]
fn what_was_asked_for_is_stored_even_if_a_reset_follows_at_once() {
    for command in [NmtCommand::ResetNode, NmtCommand::ResetCommunication] {
        for ticks in [0, 30] {
            let mut bench = Bench::ready();
            bench.maintain();
            change(&mut bench, 123_456, 500);
            let request = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
            let save = Frame::standard(0x600 + u16::from(NODE), &request).unwrap();
            let reset = Frame::standard(0, &[command as u8, 0]).unwrap();
            let now = bench.now();
            bench.vertebra.handle_frame(now, &save);
            let early = (ticks > 0).then(|| asked(&mut bench));
            bench.vertebra.handle_frame(now, &reset);
            for _ in 0..ticks {
                bench.tick();
            }
            let record = early.unwrap_or_else(|| asked(&mut bench));
            bench.store.save(&record).unwrap();
            let now = bench.now();
            bench.vertebra.finish_store(now, Ok(()));
            bench.nmt(NmtCommand::ResetNode);
            bench.run(2);
            assert_eq!(
                held(&mut bench),
                (123_456, 500),
                "{command:?}, {ticks} ticks"
            );
            bench.power_cycle(prototype());
            assert_eq!(
                held(&mut bench),
                (123_456, 500),
                "{command:?}, {ticks} ticks"
            );
        }
    }
}

#[test]
fn a_flash_that_fails_is_told_and_the_old_settings_stay() {
    let mut bench = Bench::ready();
    bench.maintain();
    change(&mut bench, 5_000, 300);
    let request = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
    let frame = Frame::standard(0x600 + u16::from(NODE), &request).unwrap();
    let now = bench.now();
    bench.vertebra.handle_frame(now, &frame);
    let asked = asked(&mut bench);
    assert!(!asked.is_empty());
    assert_eq!(bench.vertebra.poll_store(), None, "once");
    bench.vertebra.finish_store(now, Err(StoreError::Verify));
    let answer = std::iter::from_fn(|| bench.vertebra.poll_transmit())
        .find(|frame| frame.cob_id() == Some(0x580 + u16::from(NODE)))
        .unwrap();
    let [a, b, c, d] = HARDWARE.to_le_bytes();
    assert_eq!(answer.data(), [0x80, 0x10, 0x10, 1, a, b, c, d]);
    bench.nmt(NmtCommand::ResetNode);
    bench.run(2);
    assert_eq!(held(&mut bench), FACTORY);
}

#[test]
fn settings_that_are_lost_keep_the_wrist_off_until_others_are_stored() {
    for mend in [save, restore] {
        let mut bench = Bench::ready();
        bench.maintain();
        change(&mut bench, 123_456, 500);
        save(&mut bench, 1).unwrap();
        bench.store.flash_mut().bytes_mut()[40] ^= 4;
        assert_eq!(bench.store.load(), Stored::Damaged);
        let from = bench.millis;
        bench.power_cycle(prototype());
        bench.operate();
        bench.run(400);
        assert_eq!(bench.state(), State::Fault);
        assert!(bench.holds(Condition::Settings));
        assert_eq!(
            bench.emergencies(from),
            [Emergency::SETTINGS_INVALID.code],
            "told once"
        );
        bench.maintain();
        assert_eq!(held(&mut bench), FACTORY);
        // The communication alone does not mend it, now or after the next loss of power.
        save(&mut bench, 2).unwrap();
        bench.run(2);
        assert!(bench.holds(Condition::Settings));
        bench.power_cycle(prototype());
        bench.run(2);
        assert!(bench.holds(Condition::Settings));
        mend(&mut bench, 1).unwrap();
        bench.run(2);
        assert!(!bench.holds(Condition::Settings));
        bench.operate();
        bench.recover();
        bench.mode = Mode::Off;
        bench.run(20);
        bench.power_cycle(prototype());
        bench.run(2);
        assert!(!bench.holds(Condition::Settings));
    }
}

#[test]
fn a_torn_page_beside_a_good_one_is_nothing_to_worry_about() {
    let mut bench = Bench::ready();
    bench.maintain();
    change(&mut bench, 123_456, 500);
    save(&mut bench, 1).unwrap();
    bench.store.flash_mut().bytes_mut()[RAM_PAGE + 8..][..400].fill(0x5A);
    bench.power_cycle(prototype());
    bench.run(2);
    assert_eq!(held(&mut bench), (123_456, 500));
    assert!(!bench.holds(Condition::Settings));
}

/// Polls for what is to be stored until it is made.
fn asked(bench: &mut Bench) -> Record {
    let found = (0..8).find_map(|_| bench.vertebra.poll_store().cloned());
    found.expect("a record in a few calls")
}

fn lss(bench: &mut Bench, request: [u8; 8]) -> Vec<[u8; 8]> {
    let from = bench.sent.len();
    bench.extra.push(Frame::standard(0x7E5, &request).unwrap());
    // What is stored is made in four ticks.
    bench.run(6);
    let sent = bench.sent[from..].iter();
    sent.filter(|sent| sent.frame.cob_id() == Some(0x7E4))
        .map(|sent| sent.frame.data().try_into().unwrap())
        .collect()
}

/// Gives the bench's vertebra a node id and stores it.
fn give_id(bench: &mut Bench, id: u8) {
    lss(bench, [0x04, 1, 0, 0, 0, 0, 0, 0]);
    assert_eq!(
        lss(bench, [0x11, id, 0, 0, 0, 0, 0, 0]),
        [[0x11, 0, 0, 0, 0, 0, 0, 0]]
    );
    assert_eq!(
        lss(bench, [0x17, 0, 0, 0, 0, 0, 0, 0]),
        [[0x17, 0, 0, 0, 0, 0, 0, 0]]
    );
    lss(bench, [0x04, 0, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn an_unconfigured_vertebra_says_nothing_and_does_nothing_until_lss_gives_it_an_id() {
    let mut bench = Bench::with(Settings::unconfigured(77));
    bench.nmt(NmtCommand::Start);
    bench.mode = Mode::Run;
    bench.run(1_000);
    assert!(bench.sent.is_empty() && bench.is_off());
    assert_eq!(bench.vertebra.node_id(), None);
    let [a, b, c, d] = identity::PRODUCT.to_le_bytes();
    lss(&mut bench, [0x04, 1, 0, 0, 0, 0, 0, 0]);
    assert_eq!(
        lss(&mut bench, [0x5B, 0, 0, 0, 0, 0, 0, 0]),
        [[0x5B, a, b, c, d, 0, 0, 0]]
    );
    assert_eq!(
        lss(&mut bench, [0x11, 11, 0, 0, 0, 0, 0, 0]),
        [[0x11, 1, 0, 0, 0, 0, 0, 0]],
        "ten vertebrae are enough"
    );
    while bench.vertebra.poll_event().is_some() {}
    give_id(&mut bench, NODE);
    let event = std::iter::from_fn(|| bench.vertebra.poll_event());
    assert!(
        event
            .into_iter()
            .any(|event| event == Event::NodeId(NodeId::new(NODE)))
    );
    assert_eq!(bench.vertebra.node_id(), Some(node()));
    let boot_up = Frame::standard(0x700 + u16::from(NODE), &[0]).unwrap();
    assert_eq!(
        bench
            .sent
            .iter()
            .filter(|sent| sent.frame == boot_up)
            .count(),
        1
    );
    bench.mode = Mode::Off;
    bench.operate();
    bench.run(400);
    bench.mode = Mode::Run;
    bench.run(50);
    assert_eq!(bench.state(), State::Run);
}

#[test]
fn a_stored_id_outranks_the_switches_and_keeps_what_else_is_stored() {
    let mut bench = Bench::ready();
    bench.maintain();
    change(&mut bench, 123_456, 500);
    save(&mut bench, 1).unwrap();
    give_id(&mut bench, 9);
    assert_eq!(bench.vertebra.node_id(), Some(node()), "until a reset");
    bench.power_cycle(prototype());
    assert_eq!(bench.vertebra.node_id(), NodeId::new(9));
    bench.nmt(NmtCommand::Start);
    bench.run(600);
    let id = |base: u16| Some(base + 9);
    let sent = |cob_id| bench.sent.iter().any(|sent| sent.frame.cob_id() == cob_id);
    assert!(sent(id(0x180)) && sent(id(0x700)), "its PDOs follow the id");
    // Back to the switches: LSS stores that there is none.
    give_id(&mut bench, 0xFF);
    bench.power_cycle(prototype());
    assert_eq!(bench.vertebra.node_id(), Some(node()));
    assert_eq!(held(&mut bench), (123_456, 500));
}
