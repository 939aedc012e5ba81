//! NMT, heartbeat and SYNC, byte by byte (CiA 301, 7.2.5 and 7.2.8).

mod common;

use common::{Bench, CONFIG, Call, ID, MASTER};
use eel_canopen::{Config, Event, Frame, NmtCommand, NmtState};

fn nmt(command: NmtCommand, state: NmtState) -> Event {
    Event::Nmt { command, state }
}

#[test]
fn boots_up_with_a_zero_byte_and_is_pre_operational() {
    let mut bench = Bench::with(CONFIG);
    assert_eq!(bench.sent(), [(0x705, vec![0])]);
    assert_eq!(bench.node.nmt_state(), NmtState::PreOperational);
    assert_eq!(bench.node.node_id(), ID);
}

#[test]
fn follows_every_command_for_itself_or_for_all() {
    for addressee in [0, ID] {
        let mut bench = Bench::pre_operational();
        for (byte, command, state, heartbeat) in [
            (1, NmtCommand::Start, NmtState::Operational, 5),
            (2, NmtCommand::Stop, NmtState::Stopped, 4),
            (
                128,
                NmtCommand::EnterPreOperational,
                NmtState::PreOperational,
                127,
            ),
            (2, NmtCommand::Stop, NmtState::Stopped, 4),
            (1, NmtCommand::Start, NmtState::Operational, 5),
            (
                128,
                NmtCommand::EnterPreOperational,
                NmtState::PreOperational,
                127,
            ),
        ] {
            assert_eq!(bench.ask(0, &[byte, addressee]), []);
            assert_eq!(bench.events(), [nmt(command, state)]);
            assert_eq!(bench.node.nmt_state(), state);
            bench.pass_ms(200);
            assert_eq!(bench.sent(), [(0x705, vec![heartbeat])]);
        }
    }
}

#[test]
fn ignores_commands_that_are_not_for_it_or_not_whole() {
    let mut bench = Bench::pre_operational();
    for data in [&[1, ID + 1][..], &[1], &[], &[1, ID, 0], &[3, ID], &[0, 0]] {
        bench.hear(0, data);
        assert_eq!(
            bench.node.nmt_state(),
            NmtState::PreOperational,
            "{data:02X?}"
        );
    }
    assert_eq!(bench.events(), []);
}

#[test]
fn resets_with_a_new_boot_up_and_default_parameters() {
    for (byte, command) in [
        (129, NmtCommand::ResetNode),
        (130, NmtCommand::ResetCommunication),
    ] {
        let mut bench = Bench::operational();
        assert_eq!(bench.write(0x1017, 0, 50, 2), Ok(()));
        bench.hear(0x080, &[]);
        bench.events();
        // What waited to be sent belongs to the life before.
        assert_eq!(bench.ask(0, &[byte, ID]), [(0x705, vec![0])]);
        assert_eq!(bench.events(), [nmt(command, NmtState::PreOperational)]);
        assert_eq!(bench.read(0x1017, 0), Ok(200));
    }
}

#[test]
fn is_silent_in_stopped_but_for_heartbeats() {
    let mut bench = Bench::operational();
    bench.hear(0, &[2, 0]);
    bench.sent();
    assert_eq!(bench.ask(0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]), []);
    assert_eq!(bench.ask(0x080, &[]), []);
    bench.hear(0x205, &[0; 8]);
    bench.node.emergency(bench.now_us, 0x2310, 2, [0; 5]);
    assert_eq!(bench.sent(), []);
    assert_eq!(bench.calls(), []);
    bench.pass_ms(200);
    assert_eq!(bench.sent(), [(0x705, vec![4])]);
    // The emergency is told as soon as it may be.
    assert_eq!(
        bench.ask(0, &[128, 0]),
        [(0x085, vec![0x10, 0x23, 3, 0, 0, 0, 0, 0])]
    );
}

#[test]
fn an_unconfigured_node_says_nothing_and_hears_nothing() {
    for node_id in [0, 128, 255] {
        let mut bench = Bench::with(Config { node_id, ..CONFIG });
        bench.hear(0, &[1, 0]);
        bench.hear(0, &[130, 0]);
        bench.pass_ms(1_000);
        bench.node.emergency(bench.now_us, 0x1000, 1, [0; 5]);
        assert_eq!(bench.sent(), []);
        assert_eq!(bench.events(), []);
        assert_eq!(bench.node.nmt_state(), NmtState::Initialising);
    }
}

#[test]
fn beats_at_its_period_and_skips_what_it_missed() {
    let mut bench = Bench::pre_operational();
    bench.pass_ms(199);
    assert_eq!(bench.sent(), []);
    bench.pass_ms(1);
    assert_eq!(bench.sent(), [(0x705, vec![127])]);
    bench.now_us = 5_000_000;
    bench.node.tick(bench.now_us, &mut bench.app);
    bench.pass_ms(199);
    assert_eq!(bench.sent(), [(0x705, vec![127])]);
    bench.pass_ms(1);
    assert_eq!(bench.sent(), [(0x705, vec![127])]);
}

#[test]
fn a_new_heartbeat_period_begins_at_once_and_zero_ends_it() {
    let mut bench = Bench::pre_operational();
    bench.pass_ms(10);
    assert_eq!(bench.write(0x1017, 0, 50, 2), Ok(()));
    bench.pass_ms(1);
    assert_eq!(bench.sent(), [(0x705, vec![127])]);
    bench.pass_ms(100);
    // The two wait for a bus: the older one is no news.
    assert_eq!(bench.sent(), [(0x705, vec![127])]);
    assert_eq!(bench.write(0x1017, 0, 0, 2), Ok(()));
    bench.pass_ms(1_000);
    assert_eq!(bench.sent(), []);
}

#[test]
fn watches_the_master_from_its_first_heartbeat_on() {
    let master = 0x700 + u16::from(MASTER);
    let mut bench = Bench::pre_operational();
    bench.pass_ms(1_000);
    assert_eq!(
        bench.events(),
        [],
        "silence before the first heartbeat is no loss"
    );
    bench.sent();
    bench.hear(master, &[5]);
    let operational = Event::RemoteState {
        node: MASTER,
        state: NmtState::Operational,
    };
    assert_eq!(bench.events(), [operational]);
    bench.pass_ms(299);
    bench.hear(master, &[5]);
    bench.pass_ms(299);
    assert_eq!(bench.events(), []);
    bench.sent();
    bench.pass_ms(1);
    assert_eq!(bench.events(), [Event::HeartbeatLost(MASTER)]);
    let lost = (0x085, vec![0x30, 0x81, 0x11, MASTER, 0, 0, 0, 0]);
    assert!(bench.sent().contains(&lost));
    bench.pass_ms(1_000);
    assert_eq!(bench.events(), [], "a loss is told once");
    bench.sent();
    let back = (0x085, vec![0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(bench.ask(master, &[5]), [back]);
    assert_eq!(bench.events(), [Event::HeartbeatBack(MASTER), operational]);
}

#[test]
fn watches_in_stopped_too_and_notices_a_loss_at_the_next_frame() {
    let mut bench = Bench::pre_operational();
    bench.hear(0x77F, &[5]);
    bench.hear(0, &[2, 0]);
    bench.events();
    bench.now_us += 400_000;
    bench.hear(0x77F, &[0]);
    let boot = Event::RemoteState {
        node: MASTER,
        state: NmtState::Initialising,
    };
    let expected = [
        Event::HeartbeatLost(MASTER),
        Event::HeartbeatBack(MASTER),
        boot,
    ];
    assert_eq!(bench.events(), expected);
}

#[test]
fn the_watched_node_can_be_changed_and_left_alone() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.read(0x1016, 1), Ok(0x007F_012C));
    assert_eq!(bench.write(0x1016, 1, 0x0009_0064, 4), Ok(()));
    bench.hear(0x709, &[5]);
    bench.events();
    bench.pass_ms(100);
    assert_eq!(bench.events(), [Event::HeartbeatLost(9)]);
    assert_eq!(bench.write(0x1016, 1, 0, 4), Ok(()));
    assert_eq!(
        bench.read(0x1001, 0),
        Ok(0),
        "what nobody watches is not lost"
    );
    bench.hear(0x77F, &[5]);
    bench.pass_ms(1_000);
    assert_eq!(bench.events(), []);
    assert_eq!(bench.write(0x1016, 1, 0x0100_0000, 4), Err(0x0609_0030));
}

#[test]
fn hears_sync_in_pre_operational_without_pdos() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.ask(0x080, &[]), []);
    assert_eq!(bench.events(), [Event::Sync { counter: None }]);
    assert_eq!(bench.calls(), [Call::Synchronised(None)]);
}

#[test]
fn takes_the_counter_when_sync_has_one_and_minds_the_length() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.write(0x1019, 0, 240, 1), Ok(()));
    bench.hear(0x080, &[17]);
    assert_eq!(bench.events(), [Event::Sync { counter: Some(17) }]);
    let wrong = (0x085, vec![0x40, 0x82, 0x11, 0, 0, 0, 0, 0]);
    assert_eq!(bench.ask(0x080, &[]), [wrong]);
    assert_eq!(bench.ask(0x080, &[]), [], "told once");
    assert_eq!(bench.events(), [Event::SyncLength, Event::SyncLength]);
    assert_eq!(bench.ask(0x080, &[18]), [(0x085, vec![0; 8])]);
    assert_eq!(bench.events(), [Event::Sync { counter: Some(18) }]);
}

#[test]
fn sync_can_have_another_identifier_but_no_impossible_one() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.read(0x1005, 0), Ok(0x80));
    for raw in [0, 0x4000_0080, 0x2000_0080, 0x601, 0x7FF, 0x800] {
        assert_eq!(bench.write(0x1005, 0, raw, 4), Err(0x0609_0030), "{raw:X}");
    }
    assert_eq!(bench.write(0x1005, 0, 0x0F0, 4), Ok(()));
    bench.hear(0x080, &[]);
    bench.hear(0x0F0, &[]);
    assert_eq!(bench.events(), [Event::Sync { counter: None }]);
    for overflow in [1, 241, 255] {
        assert_eq!(bench.write(0x1019, 0, overflow, 1), Err(0x0609_0030));
    }
}

#[test]
fn tells_which_identifiers_it_listens_to() {
    let mut bench = Bench::pre_operational();
    let listens = |bench: &Bench| {
        let mut identifiers = bench.node.identifiers().to_vec();
        identifiers.sort_unstable();
        identifiers
    };
    assert_eq!(
        listens(&bench),
        [0x000, 0x080, 0x100, 0x205, 0x305, 0x605, 0x77F, 0x7E5]
    );
    assert_eq!(bench.write(0x1400, 1, 0x8000_0205, 4), Ok(()));
    assert_eq!(bench.write(0x1400, 1, 0x222, 4), Ok(()));
    assert_eq!(bench.write(0x1401, 1, 0x8000_0305, 4), Ok(()));
    assert_eq!(bench.write(0x1005, 0, 0x081, 4), Ok(()));
    assert_eq!(bench.write(0x1012, 0, 0x100, 4), Ok(()));
    assert_eq!(bench.write(0x1016, 1, 0, 4), Ok(()));
    assert_eq!(listens(&bench), [0x000, 0x081, 0x222, 0x605, 0x7E5]);
    let mute = Bench::with(Config {
        node_id: 0xFF,
        ..CONFIG
    });
    assert_eq!(listens(&mute), [0x7E5]);
}

#[test]
fn ignores_remote_and_extended_frames() {
    let mut bench = Bench::pre_operational();
    let standard = embedded_can::StandardId::new(0x705).unwrap();
    let remote = Frame::remote(standard, 1).unwrap();
    bench.node.handle_frame(0, &remote, &mut bench.app);
    let extended = embedded_can::ExtendedId::new(0).unwrap();
    let command = Frame::new(extended, &[1, 0]).unwrap();
    bench.node.handle_frame(0, &command, &mut bench.app);
    assert_eq!(bench.sent(), []);
    assert_eq!(bench.events(), []);
}

#[test]
fn old_events_give_way_to_new_ones_and_are_counted() {
    let mut bench = Bench::pre_operational();
    for _ in 0..20 {
        bench.hear(0x080, &[]);
    }
    bench.hear(0, &[1, 0]);
    let events = bench.events();
    assert_eq!(events.len(), 16);
    assert_eq!(
        events.last(),
        Some(&nmt(NmtCommand::Start, NmtState::Operational))
    );
    assert_eq!(bench.node.counters().events_dropped, 5);
}
