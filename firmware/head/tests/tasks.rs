//! Tasks other than a gait, for some of the vertebrae.

mod common;

use common::{Spine, node_id};
use eel_head::{Config, Event, Phase, Stage, Task};
use eel_kinematics::Pose;
use eel_protocol::{Cob, Mode, Moment, State};
use eel_units::{Angle, Torque};

/// Vertebrae 3 and 7.
const LED: u16 = 0b100_0100;

#[test]
fn only_those_that_are_led_are_started_and_told_anything() {
    let mut spine = Spine::with(Config::only(LED, Task::Mode(Mode::Hold)));
    spine.run(1_000);
    for id in 1..=10 {
        let is_led = LED & (1 << (id - 1)) != 0;
        let started = spine
            .sent_as(Cob::Nmt)
            .iter()
            .any(|(_, data)| data[1] == id);
        assert_eq!(started, is_led, "node {id}");
        assert_eq!(
            !spine.sent_as(Cob::Target(id)).is_empty(),
            is_led,
            "node {id}"
        );
        let expected = if is_led { State::Hold } else { State::Ready };
        assert_eq!(spine.node(id).state, expected, "node {id}");
    }
    assert!(spine.told(Event::Running(node_id(3)), 0).is_some());
    assert_eq!(spine.told(Event::GaitStarted, 0), None);
    assert_eq!(spine.head.running(), 2);
    let now = spine.now();
    spine.head.stop(now);
    spine.run(1_500);
    assert_eq!(spine.head.phase(), Phase::Stopped);
    assert!(spine.told(Event::Stopped, 1_000).is_some());
    assert_eq!(spine.node(3).state, State::Ready);
    // Nobody else is taken out of operation.
    let ended: Vec<u8> = spine
        .sent_as(Cob::Nmt)
        .iter()
        .filter(|(_, data)| data[0] == 128)
        .map(|(_, data)| data[1])
        .collect();
    assert_eq!(ended, [3, 7]);
}

#[test]
fn a_pose_is_reached_in_a_second_and_kept() {
    let pose = Pose {
        yaw: Angle::from_milliradians(200),
        pitch: Angle::from_milliradians(-50),
        roll: Angle::ZERO,
    };
    let mut spine = Spine::with(Config::only(LED, Task::Pose(pose)));
    spine.run(500);
    let half = spine.node(3).pose.yaw;
    assert!(half > Angle::ZERO && half < pose.yaw, "{half:?}");
    spine.run(1_500);
    let targets = &spine.node(3).targets;
    let (_, last) = targets[targets.len() - 1];
    let wire = |angles: [Angle; 3]| angles.map(Angle::to_tenth_milliradians);
    assert_eq!(wire([last.yaw, last.pitch, last.roll]), wire(pose.angles()));
    // No step is larger than a smooth second allows: 1.5 times the mean rate.
    for pair in targets
        .windows(2)
        .filter(|pair| pair[1].1.mode == Mode::Run)
    {
        let step = (pair[1].1.yaw - pair[0].1.yaw).abs();
        assert!(step <= Angle::from_milliradians(4), "{step:?}");
    }
}

#[test]
fn moments_go_to_those_that_are_in_the_mode_and_to_no_other() {
    let mut spine = Spine::with(Config::only(LED, Task::Mode(Mode::Moment)));
    let moment = Moment {
        moment: [
            Torque::from_millinewton_metres(500),
            Torque::ZERO,
            Torque::ZERO,
        ],
        stiffness: 1 << 15,
    };
    spine.head.set_moment(node_id(3), Some(moment));
    spine.run(1_000);
    assert_eq!(spine.stage(3), Stage::Running);
    let running = spine.told(Event::Running(node_id(3)), 0).unwrap();
    let sent = spine.sent_as(Cob::Moment(3));
    // One for each target since, at 100 Hz.
    assert!(
        sent.len() as u64 >= (1_000 - running) / 10 - 2,
        "{}",
        sent.len()
    );
    assert!(
        sent.iter()
            .all(|(at, data)| *at >= running && *data == moment.to_bytes())
    );
    assert!(spine.sent_as(Cob::Moment(7)).is_empty());
    spine.head.set_moment(node_id(3), None);
    let count = spine.sent_as(Cob::Moment(3)).len();
    spine.run(200);
    assert_eq!(spine.sent_as(Cob::Moment(3)).len(), count);
}
