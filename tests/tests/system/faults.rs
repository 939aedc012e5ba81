//! What happens when something fails: the reactions that the safe-state policy promises.

use eel_head::{Config as HeadConfig, Event as HeadEvent, Gait, Plane, Stage};
use eel_protocol::emergency::Emergency;
use eel_protocol::{NodeId, State};
use hil_sim::robot::{Config, Fault, FaultKind, Robot};

use super::watch::{Kind, Watch};

const SECOND_NS: u64 = 1_000_000_000;

/// Runs the default gait with faults for some seconds.
fn run(faults: Vec<Fault>, seconds: u64) -> (Robot, Watch) {
    run_gait(Gait::SWIM, faults, seconds)
}

fn run_gait(gait: Gait, faults: Vec<Fault>, seconds: u64) -> (Robot, Watch) {
    let config = Config {
        faults,
        ..Config::new(HeadConfig::new(gait), 7)
    };
    let mut robot = Robot::new(&config).expect("the usual bit rate");
    let mut watch = Watch::new();
    robot.run(seconds * SECOND_NS, &mut watch);
    (robot, watch)
}

#[test]
fn all_ten_let_go_when_the_head_goes_quiet() {
    const LOST_US: u64 = 4_000_000;
    let fault = Fault {
        at_ns: LOST_US * 1_000,
        kind: FaultKind::HeadSilent,
    };
    let (robot, watch) = run(vec![fault], 9);
    for id in NodeId::all() {
        let after = |state| {
            let entered = watch.entered(id, state, LOST_US);
            entered.unwrap_or_else(|| panic!("{id:?} never entered {state:?}")) - LOST_US
        };
        let (damped, brake, off) = (
            after(State::StopDamped),
            after(State::StopBrake),
            after(State::StopOff),
        );
        println!("{id:?}: damped {damped} µs, braked {brake} µs, off {off} µs after the last word");
        assert!(
            damped <= 100_000,
            "{id:?} was damped only after {damped} µs"
        );
        assert!(off <= 2_500_000, "{id:?} was off only after {off} µs");
        let (since, drives) = watch.drives[id.index()];
        assert_eq!(drives, [Kind::Off; 3], "{id:?}");
        assert!(since - LOST_US <= 2_500_000);
        assert_eq!(robot.node(id).state(), Some(State::StopOff), "latched");
    }
}

#[test]
fn a_vertebra_that_resets_is_brought_back() {
    let fourth = NodeId::new(4).expect("a vertebra");
    let fault = Fault {
        at_ns: 4 * SECOND_NS,
        kind: FaultKind::NodeReset(fourth),
    };
    let (robot, watch) = run(vec![fault], 8);
    let booted = watch
        .head
        .iter()
        .filter(|(_, event)| *event == HeadEvent::Booted(fourth));
    assert_eq!(booted.count(), 2, "once at the start, once after the reset");
    let back = watch
        .entered(fourth, State::Run, 4_000_000)
        .expect("it runs again");
    println!("back after {} ms", (back - 4_000_000) / 1_000);
    assert!(back < 5_000_000);
    for id in NodeId::all() {
        assert_eq!(robot.node(id).state(), Some(State::Run), "{id:?}");
        assert_eq!(
            robot.head().node(id).map(|node| node.stage),
            Some(Stage::Running)
        );
        if id != fourth {
            let runs = watch
                .states
                .iter()
                .filter(|(_, node, state)| *node == id && *state == State::Run);
            assert_eq!(runs.count(), 1, "{id:?} went on all the time");
        }
    }
    // Its way back into the wave is a blend, not a jump.
    assert!(
        !watch
            .emergencies
            .iter()
            .any(|(_, _, report)| { report.code == Emergency::FOLLOWING_ERROR.code })
    );
}

#[test]
fn targets_outside_the_workspace_are_limited_with_a_reason_and_never_executed() {
    // At 0.14 body lengths the last vertebra would have to turn by far more than 30°.
    let gait = Gait::new(1_000, 1_400, 8_000, Plane::Lateral).expect("a gait");
    let wanted = (0..1_000_000)
        .step_by(10_000)
        .map(|micros| {
            gait.poses(micros, 1 << 15)[9]
                .yaw
                .abs()
                .to_tenth_milliradians()
        })
        .max();
    assert!(
        wanted > Some(7_000),
        "the test's own gait is tame: {wanted:?}"
    );
    let (_, watch) = run_gait(gait, Vec::new(), 8);
    let last = NodeId::new(10).expect("a vertebra");
    let limited = watch
        .emergencies
        .iter()
        .find(|(_, node, report)| *node == last && report.code == Emergency::TARGET_LIMITED.code);
    let (_, _, report) = limited.expect("the reason is told");
    assert_eq!(report.source.detail, 1, "yaw is the axis");
    for id in NodeId::all() {
        let [yaw, pitch, roll] = watch.pursued[id.index()];
        assert!(
            yaw <= 0.5237 && pitch <= 0.2619 && roll <= 0.0699,
            "{id:?} pursued more"
        );
        let [yaw, ..] = watch.truth[id.index()];
        assert!(
            yaw < std::f64::consts::FRAC_PI_6 * 1.15,
            "{id:?} came to {yaw} rad"
        );
    }
}
