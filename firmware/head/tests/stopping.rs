//! The orderly end: fade out, straight, off, out of operation.

mod common;

use common::{Spine, apart, node_id, pose_of};
use eel_head::{Config, Event, Gait, Phase, Plane, Stage};
use eel_kinematics::Pose;
use eel_protocol::{Cob, Mode, State, Target};

/// Stops a spine and returns it with the time of the stop in ms.
fn stopped(mut spine: Spine, millis: u64) -> (Spine, u64) {
    let (at, now) = (spine.now_ms, spine.now());
    spine.head.stop(now);
    spine.run(millis);
    (spine, at)
}

#[test]
fn the_stop_takes_a_cycle_half_a_second_straight_and_50_ms_off() {
    let (spine, start) = stopped(Spine::swimming(), 3_000);
    assert_eq!(
        spine.told(Event::Stopped, 0),
        Some(start + 1_000 + 500 + 50)
    );
    assert_eq!(spine.head.phase(), Phase::Stopped);
    let leave = spine
        .sent_as(Cob::Nmt)
        .into_iter()
        .filter(|(_, data)| data[..] == [128, 0]);
    assert_eq!(leave.map(|(at, _)| at).collect::<Vec<_>>(), [start + 1_550]);
    for id in 1..=10 {
        let targets = spine.targets(id);
        let first_off = targets
            .iter()
            .rev()
            .take_while(|(_, target)| target.mode == Mode::Off);
        let offs: Vec<u64> = first_off.map(|(at, _)| *at).collect();
        assert_eq!(offs.len(), 5, "node {id}");
        assert_eq!(offs.last(), Some(&(start + 1_500)));
        let node = &spine.nodes[usize::from(id) - 1];
        assert_eq!(
            (node.operational, node.state),
            (false, State::Ready),
            "node {id}"
        );
    }
}

#[test]
fn the_gait_fades_without_a_jump_and_ends_straight() {
    for wait in [0, 130, 250, 770] {
        let mut spine = Spine::swimming();
        spine.run(wait);
        let (spine, start) = stopped(spine, 3_000);
        for id in 1..=10 {
            let targets = spine.targets(id);
            let runs: Vec<&(u64, Target)> = targets
                .iter()
                .filter(|(at, target)| *at + 100 >= start && target.mode == Mode::Run)
                .collect();
            for pair in runs.windows(2) {
                let step = apart(pose_of(&pair[0].1), pose_of(&pair[1].1));
                assert!(step <= 400, "node {id}, {} ms: {step}", pair[1].0);
            }
            let straight = runs.iter().filter(|(at, _)| *at >= start + 1_000);
            assert_eq!(
                straight.clone().count(),
                50,
                "node {id} is held straight for 0.5 s"
            );
            for (_, target) in straight {
                assert_eq!(pose_of(target), Pose::default(), "node {id}");
            }
        }
    }
}

#[test]
fn a_slow_gait_fades_out_in_two_seconds() {
    let slow = Gait::new(100, 800, 8_000, Plane::Lateral).unwrap();
    let mut spine = Spine::with(Config::new(slow));
    spine.run(8_000);
    let (spine, start) = stopped(spine, 4_000);
    assert_eq!(spine.told(Event::Stopped, 0), Some(start + 2_000 + 550));
}

#[test]
fn a_stop_before_the_gait_has_begun_ends_the_same_way() {
    let mut spine = Spine::new();
    spine.node(1).on = false;
    spine.run(1_000);
    assert_eq!(spine.head.phase(), Phase::Starting);
    let (spine, _) = stopped(spine, 2_000);
    assert_eq!(spine.head.phase(), Phase::Stopped);
    assert_eq!(spine.told(Event::GaitStarted, 0), None);
    assert!(
        spine
            .nodes
            .iter()
            .all(|node| !node.operational && node.state != State::Run)
    );
}

#[test]
fn a_second_stop_changes_nothing() {
    let (mut spine, start) = stopped(Spine::swimming(), 700);
    let now = spine.now();
    spine.head.stop(now);
    spine.run(2_000);
    assert_eq!(spine.told(Event::Stopped, 0), Some(start + 1_550));
    let now = spine.now();
    spine.head.stop(now);
    spine.run(2_000);
    assert_eq!(
        spine
            .events
            .iter()
            .filter(|(_, event)| *event == Event::Stopped)
            .count(),
        1
    );
}

#[test]
fn nobody_is_started_or_enabled_once_the_stop_has_begun() {
    let mut spine = Spine::swimming();
    spine.node(3).on = false;
    spine.run(600);
    let (mut spine, start) = stopped(spine, 100);
    let now_ms = spine.now_ms;
    spine.node(3).boot(now_ms);
    spine.node(3).operational = true;
    spine.run(3_000);
    assert_ne!(spine.stage(3), Stage::Running);
    let late = spine.targets(3).into_iter().filter(|(at, _)| *at > start);
    assert!(late.into_iter().all(|(_, target)| target.mode == Mode::Off));
    let starts = spine
        .sent_as(Cob::Nmt)
        .into_iter()
        .filter(|(at, data)| *at > start && data[0] == 1);
    assert_eq!(starts.count(), 0);
}

#[test]
fn a_latched_node_stays_latched_through_the_stop() {
    let mut spine = Spine::swimming();
    spine.node(8).state = State::Fault;
    let (spine, start) = stopped(spine, 3_000);
    assert_eq!(spine.told(Event::Stopped, 0), Some(start + 1_550));
    assert_eq!(spine.nodes[7].state, State::Fault);
}

#[test]
fn after_the_stop_the_bus_still_has_its_beat_and_leaving_operation_is_no_news() {
    let (spine, start) = stopped(Spine::swimming(), 5_000);
    let end = start + 1_550;
    let syncs = spine
        .sent_as(Cob::Sync)
        .into_iter()
        .filter(|(at, _)| *at > end)
        .count();
    let beats = spine
        .sent_as(Cob::Heartbeat(127))
        .into_iter()
        .filter(|(at, _)| *at > end)
        .count();
    assert_eq!((syncs, beats), (344, 34));
    assert!((1..=10).all(|id| spine.targets(id).iter().all(|(at, _)| *at <= end)));
    assert!((1..=10).all(|id| spine.told(Event::Booted(node_id(id)), start).is_none()));
    assert!((1..=10).all(|id| spine.stage(id) == Stage::Booted));
}
