//! What breaks in a vertebra, and what it makes of it.

use eel_head::{Config as HeadConfig, Gait, Task};
use eel_kinematics::Pose;
use eel_protocol::emergency::Emergency;
use eel_protocol::freeze::FreezeFrame;
use eel_protocol::{NodeId, State};
use eel_units::Angle;
use hil_sim::plant::Defect;
use hil_sim::robot::{Config, FaultKind, Robot};

use super::watch::Watch;

const SECOND_NS: u64 = 1_000_000_000;
/// When something breaks, µs; the gait is whole.
const BROKEN_US: u64 = 4_000_000;

fn fifth() -> NodeId {
    NodeId::new(5).expect("a vertebra")
}

fn last() -> NodeId {
    NodeId::new(10).expect("a vertebra")
}

/// Swims until the gait is whole.
fn swimming() -> (Robot, Watch) {
    let config = Config::new(HeadConfig::new(Gait::SWIM), 7);
    let mut robot = Robot::new(&config).expect("the usual bit rate");
    let mut watch = Watch::new();
    robot.run(BROKEN_US * 1_000, &mut watch);
    (robot, watch)
}

/// Returns how warm the fifth vertebra takes its windings to be, °C.
fn winding_c(robot: &Robot) -> [f64; 3] {
    let vertebra = robot.node(fifth()).vertebra().expect("a native one");
    vertebra
        .winding_temperatures()
        .map(|winding| f64::from(winding.to_decidegrees()) / 10.0)
}

/// Swims, lets something break and swims on for so many seconds.
fn swim(kind: FaultKind, seconds: u64) -> (Robot, Watch) {
    let (mut robot, mut watch) = swimming();
    robot.fail(kind);
    robot.run(BROKEN_US * 1_000 + seconds * SECOND_NS, &mut watch);
    (robot, watch)
}

/// Returns when a vertebra told of an emergency, in µs after something broke.
fn told(watch: &Watch, id: NodeId, emergency: Emergency) -> Option<u64> {
    let mut all = watch.emergencies.iter();
    all.find(|(_, node, report)| *node == id && report.code == emergency.code)
        .map(|(time, ..)| time - BROKEN_US)
}

/// Checks that one vertebra faults within a time for a reason, and no other at all.
fn faults(defect: Defect, emergency: Emergency, within_us: u64) {
    let (robot, watch) = swim(FaultKind::Broken(last(), defect), 2);
    let time = told(&watch, last(), emergency);
    let time = time.unwrap_or_else(|| panic!("{defect:?}: {:?}", watch.emergencies));
    println!("{defect:?}: {} after {time} µs", emergency.name);
    assert!(time <= within_us, "{defect:?}: only after {time} µs");
    for id in NodeId::all() {
        let state = robot.node(id).state();
        let expected = if id == last() {
            State::Fault
        } else {
            State::Run
        };
        assert_eq!(state, Some(expected), "{defect:?}: {id:?}");
    }
}

#[test]
fn sensors_that_stand_still_are_found_within_half_a_stride() {
    for motor in 0..3 {
        // Roll turns the third crank by too little for that.
        if motor < 2 {
            for defect in [Defect::CrankFrozen(motor), Defect::CounterFrozen(motor)] {
                faults(defect, Emergency::ENCODER_IMPLAUSIBLE, 500_000);
            }
        }
        faults(
            Defect::CrankSilent(motor),
            Emergency::ENCODER_INVALID,
            60_000,
        );
    }
}

#[test]
fn a_blocked_crank_is_a_wrist_that_does_not_follow() {
    faults(Defect::Jammed(0), Emergency::NOT_FOLLOWING, 1_500_000);
}

#[test]
fn a_bridge_that_is_dead_without_a_word_shows_as_a_wrist_off_its_path() {
    let (_, watch) = swim(FaultKind::Broken(last(), Defect::BridgeDead(1)), 2);
    let told = told(&watch, last(), Emergency::FOLLOWING_ERROR);
    println!("following-error after {told:?} µs");
    assert!(told.is_some_and(|time| time < 1_000_000), "{told:?}");
}

#[test]
fn a_program_that_hangs_leaves_a_freeze_frame_of_what_it_did_last() {
    let (mut robot, mut watch) = swimming();
    let before = winding_c(&robot);
    robot.fail(FaultKind::NodeHung(fifth()));
    robot.run(robot.now_ns() + SECOND_NS, &mut watch);
    let node = robot.node(fifth());
    assert_eq!(node.state(), Some(State::StopOff), "latched");
    assert!(told(&watch, fifth(), Emergency::RESTARTED).is_some());
    let vertebra = node.vertebra().expect("a native one");
    let frame: FreezeFrame = vertebra.freeze_frame().expect("kept over the reset");
    assert_eq!(frame.code, Emergency::RESTARTED.code);
    assert_eq!(frame.state, State::Run);
    let age = BROKEN_US - frame.at_us;
    assert!(age <= 101_000, "{age} µs old");
    assert!(
        frame.pose[0].abs() > 10_000 && frame.reference.is_some(),
        "{frame:?}"
    );
    // The windings are taken to be as warm as they were, not as a start without memory takes them.
    for (after, before) in winding_c(&robot).into_iter().zip(before) {
        assert!(after < before + 0.5, "{after} °C, {before} °C before");
    }
}

#[test]
fn a_brown_out_ends_the_swim_and_nothing_moves_by_itself_afterwards() {
    let (mut robot, mut watch) = swim(FaultKind::Battery(3_000), 1);
    robot.fail(FaultKind::Battery(24_000));
    robot.run(robot.now_ns() + SECOND_NS / 20, &mut watch);
    for id in NodeId::all() {
        let state = robot.node(id).state();
        assert_eq!(
            state,
            Some(State::NotReady),
            "{id:?}: it has just been powered"
        );
    }
}

#[test]
fn a_stalled_motor_settles_at_its_continuous_current_without_a_fault() {
    const SECONDS: u64 = 900;
    let pose = Pose {
        yaw: Angle::from_milliradians(300),
        ..Pose::default()
    };
    let mut head = HeadConfig::new(Gait::SWIM);
    head.task = Task::Pose(pose);
    let mut robot = Robot::new(&Config::new(head, 3)).expect("the usual bit rate");
    for motor in 0..3 {
        robot.fail(FaultKind::Broken(fifth(), Defect::Jammed(motor)));
    }
    let mut watch = Watch::new();
    let (mut hottest, mut peak) = (0.0_f64, 0.0_f64);
    for second in 0..SECONDS {
        robot.run((second + 1) * SECOND_NS, &mut watch);
        let index = fifth().index();
        let hot = robot.plant().winding_c(index);
        let currents = robot.plant().motor_current_a(index);
        hottest = hot.into_iter().fold(hottest, f64::max);
        peak = currents
            .into_iter()
            .fold(peak, |most, it| most.max(it.abs()));
    }
    assert_eq!(
        robot.node(fifth()).state(),
        Some(State::Run),
        "no fault: {:?}",
        watch.emergencies
    );
    let current = robot.plant().motor_current_a(fifth().index())[0].abs();
    // Winding and housing in series carry what the limit of 105 °C lets flow off; copper at that
    // temperature has 1 + 0.00393 · 80 times its resistance at 25 °C.
    let continuous = (90.0_f64 / (3.1 + 13.0) / (5.8 * (1.0 + 0.003_93 * 80.0))).sqrt();
    println!(
        "peak {peak:.2} A, hottest {hottest:.1} °C, {current:.3} A after {SECONDS} s, continuous {continuous:.3} A"
    );
    assert!(peak > 1.9, "it began at full command: {peak} A");
    assert!(hottest < 105.0, "{hottest} °C");
    assert!(
        current < 0.5 * peak && current > continuous * 0.9,
        "{current} A"
    );
}
