//! How vertebrae come from power-up to following the gait.

mod common;

use common::{Spine, apart, node_id, pose_of};
use eel_head::{Config, Event, Gait, Phase, Stage};
use eel_protocol::{Cob, Mode, State};

#[test]
fn each_node_is_booted_started_told_off_three_times_and_only_then_told_to_run() {
    let mut spine = Spine::new();
    spine.run(500);
    for id in 1..=10 {
        let booted = spine
            .told(Event::Booted(node_id(id)), 0)
            .expect("it booted");
        let started: Vec<u64> = spine
            .sent_as(Cob::Nmt)
            .into_iter()
            .filter(|(_, data)| *data == [1, id])
            .map(|(at, _)| at)
            .collect();
        assert_eq!(
            started,
            [booted],
            "node {id} follows the first NMT start, sent at once"
        );
        let heard = &spine.nodes[usize::from(id) - 1].targets;
        let offs = heard
            .iter()
            .take_while(|(_, target)| target.mode == Mode::Off)
            .count();
        assert!(offs >= 3, "node {id}: {offs} offs");
        assert!(
            heard[offs..]
                .iter()
                .all(|(_, target)| target.mode == Mode::Run),
            "node {id}"
        );
        assert_eq!(spine.stage(id), Stage::Running);
        assert!(spine.told(Event::Running(node_id(id)), booted).is_some());
    }
    assert_eq!(spine.head.phase(), Phase::Swimming);
    assert_eq!(
        spine
            .events
            .iter()
            .filter(|(_, event)| *event == Event::GaitStarted)
            .count(),
        1
    );
}

#[test]
fn run_is_sent_only_after_ready_was_reported() {
    let mut spine = Spine::new();
    spine.node(4).willing = false;
    spine.run(1_000);
    assert!(
        spine
            .targets(4)
            .iter()
            .all(|(_, target)| target.mode == Mode::Off)
    );
    assert_eq!(spine.stage(4), Stage::Started);
    spine.node(4).willing = true;
    spine.run(60);
    assert_eq!(spine.stage(4), Stage::Running);
}

#[test]
fn a_ready_from_before_a_reboot_does_not_count() {
    let mut spine = Spine::new();
    spine.node(6).willing = false;
    spine.run(300);
    spine.node(6).willing = true;
    spine.run(12); // It has reported "ready" by now, or will with the next SYNC.
    let now_ms = spine.now_ms;
    spine.node(6).boot(now_ms);
    spine.node(6).willing = false;
    spine.run(1);
    assert_eq!(spine.head.node(node_id(6)).unwrap().state, State::NotReady);
    spine.run(500);
    let later: Vec<_> = spine
        .targets(6)
        .into_iter()
        .filter(|(at, _)| *at > now_ms)
        .collect();
    assert!(
        later.iter().all(|(_, target)| target.mode == Mode::Off),
        "{later:?}"
    );
}

#[test]
fn the_first_targets_are_where_the_vertebra_is_and_then_nothing_jumps() {
    let mut spine = Spine::new();
    let poses: Vec<_> = spine.nodes.iter().map(|node| node.pose).collect();
    spine.run(6_000);
    for (index, pose) in poses.into_iter().enumerate() {
        let targets = spine.targets(index as u8 + 1);
        let mut runs = targets
            .iter()
            .filter(|(_, target)| target.mode == Mode::Run);
        let (_, first) = runs.next().expect("it is told to run");
        assert!(
            apart(pose_of(first), pose) <= 1,
            "{first:?} against {pose:?}"
        );
        let mut last = pose_of(first);
        for (at, target) in runs {
            // The default gait turns joint 10 by 0.47 rad · 2π · 10 ms = 0.03 rad a beat.
            let step = apart(pose_of(target), last);
            assert!(step <= 310, "node {}, {at} ms: {step}", index + 1);
            last = pose_of(target);
        }
    }
}

#[test]
fn a_vertebra_that_enables_late_is_not_pulled_to_where_the_gait_has_got_meanwhile() {
    let mut spine = Spine::new();
    spine.node(10).obeys = false;
    spine.run(5_000);
    assert_eq!(spine.head.running(), 9);
    assert_eq!(spine.head.phase(), Phase::Swimming, "the other nine swim");
    let pose = spine.node(10).pose;
    let late = spine.now_ms;
    spine.node(10).obeys = true;
    spine.run(2_000);
    assert_eq!(spine.stage(10), Stage::Running);
    let mut last = pose;
    for (at, target) in spine.targets(10).iter().filter(|(at, _)| *at + 50 >= late) {
        let step = apart(pose_of(target), last);
        assert!(step <= 350, "{at} ms: {step}");
        last = pose_of(target);
    }
}

#[test]
fn a_vertebra_that_refuses_to_run_is_told_off_again_before_the_next_run() {
    let mut spine = Spine::new();
    spine.node(7).obeys = false;
    spine.run(2_000);
    let modes: Vec<Mode> = spine
        .targets(7)
        .iter()
        .map(|(_, target)| target.mode)
        .collect();
    let rows: Vec<(Mode, usize)> = modes
        .chunk_by(|one, other| one == other)
        .map(|row| (row[0], row.len()))
        .collect();
    assert_eq!(
        rows[1..5],
        [
            (Mode::Run, 20),
            (Mode::Off, 3),
            (Mode::Run, 20),
            (Mode::Off, 3)
        ]
    );
    spine.node(7).obeys = true;
    spine.run(400);
    assert_eq!(spine.stage(7), Stage::Running);
}

#[test]
fn a_vertebra_whose_enabling_is_refused_meanwhile_starts_with_off_again() {
    let mut spine = Spine::new();
    spine.node(2).obeys = false;
    while spine.stage(2) != Stage::Enabling {
        spine.run(1);
    }
    spine.run(15);
    spine.node(2).willing = false;
    spine.run(30);
    assert_eq!(spine.stage(2), Stage::Started);
    assert_eq!(spine.targets(2).last().expect("a target").1.mode, Mode::Off);
}

#[test]
fn the_gait_waits_three_seconds_for_the_missing_and_then_starts_without_them() {
    let mut spine = Spine::new();
    spine.node(3).on = false;
    spine.node(8).on = false;
    spine.run(2_999);
    assert_eq!(spine.head.phase(), Phase::Starting);
    let home = spine.targets(9).last().expect("a target").1;
    assert!(
        apart(pose_of(&home), eel_kinematics::Pose::default()) <= 1,
        "it waits straight"
    );
    spine.run(10);
    assert_eq!(spine.told(Event::GaitStarted, 0), Some(3_000));
    assert_eq!(spine.head.running(), 8);
    assert!(spine.targets(3).is_empty() && spine.targets(8).is_empty());
}

#[test]
fn the_gait_waits_only_for_vertebrae_that_are_expected() {
    let mut spine = Spine::with(Config {
        expected: 0b1,
        ..Config::new(Gait::SWIM)
    });
    for id in 2..=10 {
        spine.node(id).on = false;
    }
    spine.run(200);
    assert_eq!(spine.head.phase(), Phase::Swimming);
}

#[test]
fn the_gait_never_starts_without_any_vertebra() {
    for expected in [0, 0b11_1111_1111] {
        let mut spine = Spine::with(Config {
            expected,
            ..Config::new(Gait::SWIM)
        });
        for id in 1..=10 {
            spine.node(id).on = false;
        }
        spine.run(10_000);
        assert_eq!(spine.head.phase(), Phase::Starting);
        assert!(spine.events.is_empty());
    }
}

#[test]
fn nodes_that_were_up_before_the_head_are_found() {
    let mut spine = Spine::new();
    spine.connected = false;
    for id in 1..=10 {
        // Their boot-up message was before the head's time.
        spine.node(id).on = false;
    }
    spine.run(50);
    spine.connected = true;
    for id in 1..=10 {
        spine.node(id).on = true;
        spine.node(id).operational = id % 2 == 0;
    }
    spine.run(500);
    assert_eq!(spine.head.running(), 10);
    assert_eq!(spine.head.node(node_id(5)).unwrap().boots, 0);
}

#[test]
fn a_node_that_does_not_follow_is_told_again_every_50_ms() {
    let mut spine = Spine::new();
    spine.connected = false;
    spine.run(300);
    let starts: Vec<u64> = spine
        .sent_as(Cob::Nmt)
        .into_iter()
        .filter(|(_, data)| *data == [1, 7])
        .map(|(at, _)| at)
        .collect();
    assert_eq!(starts, [7, 57, 107, 157, 207, 257]);
}
