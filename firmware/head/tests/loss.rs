//! Vertebrae that fall silent, come back, stop by themselves or send what can't be trusted.

mod common;

use common::{Spine, frame, node_id};
use eel_head::{Event, Stage};
use eel_protocol::emergency::EmergencyReport;
use eel_protocol::{Cob, Counter, Frame, Mode, PoseReport, State};
use eel_units::Angle;

#[test]
fn a_node_silent_for_500_ms_is_lost_and_gets_no_targets() {
    let mut spine = Spine::swimming();
    let silent_from = spine.now_ms;
    spine.node(4).on = false;
    spine.run(1_000);
    let lost = spine
        .told(Event::Lost(node_id(4)), 0)
        .expect("its loss is told");
    // Its last frame came at most a SYNC period before.
    assert!(
        (490..=502).contains(&(lost - silent_from)),
        "after {} ms",
        lost - silent_from
    );
    assert_eq!(spine.stage(4), Stage::Missing);
    assert!(spine.targets(4).iter().all(|(at, _)| *at <= lost));
    assert_eq!(spine.head.running(), 9, "the others swim on");
    let losses = spine
        .events
        .iter()
        .filter(|(_, event)| matches!(event, Event::Lost(_)));
    assert_eq!(losses.count(), 1);
}

#[test]
fn a_lost_node_that_boots_is_brought_back() {
    let mut spine = Spine::swimming();
    spine.node(4).on = false;
    spine.run(1_000);
    let back = spine.now_ms;
    spine.node(4).boot(back);
    spine.run(300);
    assert_eq!(spine.stage(4), Stage::Running);
    assert!(spine.told(Event::Booted(node_id(4)), back).is_some());
    assert!(spine.told(Event::Running(node_id(4)), back).is_some());
    assert_eq!(spine.head.node(node_id(4)).unwrap().boots, 2);
}

#[test]
fn a_node_that_resets_unnoticed_by_time_is_brought_back_too() {
    let mut spine = Spine::swimming();
    let reset = spine.now_ms;
    spine.node(9).boot(reset);
    spine.run(300);
    assert_eq!(spine.told(Event::Booted(node_id(9)), reset), Some(reset));
    assert_eq!(spine.stage(9), Stage::Running);
    assert_eq!(spine.told(Event::Lost(node_id(9)), 0), None);
    let reports = spine.head.node(node_id(9)).unwrap().lost_reports;
    assert_eq!(reports, 0, "a counter that starts anew is no loss");
}

#[test]
fn a_node_that_boots_over_and_over_is_told_of_every_time() {
    let mut spine = Spine::swimming();
    for _ in 0..5 {
        let now_ms = spine.now_ms;
        spine.node(1).boot(now_ms);
        spine.run(3);
    }
    assert_eq!(spine.head.node(node_id(1)).unwrap().boots, 6);
    let told = spine
        .events
        .iter()
        .filter(|(_, event)| *event == Event::Booted(node_id(1)));
    assert_eq!(told.count(), 6);
}

#[test]
fn a_node_that_was_only_cut_off_is_found_latched_and_stays_so() {
    let mut spine = Spine::swimming();
    spine.node(10).on = false;
    spine.run(1_000);
    spine.node(10).on = true;
    spine.node(10).state = State::StopOff;
    let back = spine.now_ms;
    spine.run(5_000);
    assert_eq!(spine.stage(10), Stage::Latched);
    assert!(
        spine
            .told(Event::Latched(node_id(10), State::StopOff), back)
            .is_some()
    );
    let after = spine.targets(10).into_iter().filter(|(at, _)| *at > back);
    assert!(after.clone().count() > 400);
    assert!(
        after
            .into_iter()
            .all(|(_, target)| target.mode == Mode::Off)
    );
}

#[test]
fn every_latched_state_waits_for_a_reset_and_then_runs_again() {
    for state in [
        State::StopDamped,
        State::StopBrake,
        State::StopOff,
        State::Fault,
    ] {
        let mut spine = Spine::swimming();
        spine.node(2).state = state;
        spine.run(10_000);
        assert_eq!(spine.stage(2), Stage::Latched, "{state:?}");
        let modes = |spine: &Spine| -> Vec<Mode> {
            spine
                .targets(2)
                .into_iter()
                .map(|(_, target)| target.mode)
                .collect()
        };
        assert!(
            !modes(&spine).contains(&Mode::FaultReset),
            "{state:?} was reset unasked"
        );
        assert_eq!(
            spine
                .events
                .iter()
                .filter(|(_, e)| matches!(e, Event::Latched(..)))
                .count(),
            1
        );
        spine.head.reset();
        spine.run(200);
        assert_eq!(spine.stage(2), Stage::Running, "{state:?}");
        let resets = modes(&spine)
            .iter()
            .filter(|mode| **mode == Mode::FaultReset)
            .count();
        assert_eq!(resets, 1);
    }
}

#[test]
fn a_reset_does_not_acknowledge_a_stop_that_comes_after_it() {
    let mut spine = Spine::swimming();
    spine.head.reset();
    spine.run(1_000);
    spine.node(6).state = State::Fault;
    spine.run(1_000);
    assert_eq!(spine.stage(6), Stage::Latched);
    for id in 1..=10 {
        let reset = spine
            .targets(id)
            .iter()
            .any(|(_, target)| target.mode == Mode::FaultReset);
        assert!(!reset, "node {id}");
    }
}

#[test]
fn a_reset_that_could_not_be_sent_is_forgotten_with_the_node() {
    let mut spine = Spine::swimming();
    spine.node(6).state = State::Fault;
    spine.run(25);
    assert_eq!(spine.stage(6), Stage::Latched);
    spine.head.reset();
    let now_ms = spine.now_ms;
    spine.node(6).boot(now_ms);
    let now = spine.now();
    spine
        .head
        .handle_frame(now, &frame(Cob::Heartbeat(6), &[0]));
    spine.run(300);
    assert_eq!(spine.stage(6), Stage::Running);
    spine.node(6).state = State::Fault;
    spine.run(300);
    let resets = spine
        .targets(6)
        .into_iter()
        .filter(|(_, t)| t.mode == Mode::FaultReset);
    assert_eq!(resets.count(), 0);
}

/// Returns a report of node 3 as a frame.
fn report(counter: u8) -> Frame {
    let id = Cob::Pose(3).id();
    let angle = Angle::from_tenth_milliradians(100);
    let counter = Counter::new(counter).expect("0 to 14");
    let report = PoseReport {
        yaw: angle,
        pitch: angle,
        roll: angle,
        state: State::Run,
        counter,
    };
    Frame::standard(id, &report.to_bytes(id)).expect("eight bytes")
}

#[test]
fn reports_that_never_came_are_counted_across_the_wrap() {
    let mut spine = Spine::new();
    let now = spine.now();
    for counter in [0, 1, 4, 4, 14, 2] {
        spine.head.handle_frame(now, &report(counter));
    }
    // 2 and 3; 5 to 13; 0 and 1. A repeated one is not lost.
    assert_eq!(spine.head.node(node_id(3)).unwrap().lost_reports, 2 + 9 + 2);
}

#[test]
fn reports_with_a_wrong_bit_length_or_code_are_counted_and_believed_in_nothing() {
    let mut spine = Spine::new();
    let now = spine.now();
    let good = report(5);
    let cob = Cob::Pose(3);
    for bit in 0..64 {
        let mut data: [u8; 8] = good.data().try_into().unwrap();
        data[bit / 8] ^= 1 << (bit % 8);
        spine.head.handle_frame(now, &frame(cob, &data));
    }
    for length in 0..8 {
        spine
            .head
            .handle_frame(now, &frame(cob, &good.data()[..length]));
    }
    // Right for node 3, sent as node 4.
    spine
        .head
        .handle_frame(now, &frame(Cob::Pose(4), good.data()));
    let status = spine.head.node(node_id(3)).unwrap();
    assert_eq!((status.bad_reports, status.lost_reports), (64 + 8, 0));
    assert_eq!(
        (status.stage, status.state),
        (Stage::Missing, State::NotReady)
    );
    assert_eq!(spine.head.node(node_id(4)).unwrap().bad_reports, 1);
}

#[test]
fn an_emergency_is_told_as_it_came() {
    let mut spine = Spine::new();
    let now = spine.now();
    let data = [0x10, 0x23, 0x81, 2, 1, 0, 0x34, 0x12];
    spine
        .head
        .handle_frame(now, &frame(Cob::Emergency(7), &data));
    spine
        .head
        .handle_frame(now, &frame(Cob::Emergency(7), &data[..7]));
    spine.run(1);
    let told: Vec<Event> = spine.events.iter().map(|(_, event)| *event).collect();
    let report = EmergencyReport::from_bytes(data);
    assert_eq!(report.code, 0x2310);
    assert!(told.contains(&Event::Emergency(node_id(7), report)));
    assert_eq!(
        told.iter()
            .filter(|event| matches!(event, Event::Emergency(..)))
            .count(),
        1
    );
}
