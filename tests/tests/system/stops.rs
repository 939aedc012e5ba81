//! A joint that comes to a hard stop long before its target does.

use eel_head::{Config as HeadConfig, Event as HeadEvent, Gait};
use eel_protocol::emergency::Emergency;
use eel_protocol::{NodeId, State};
use eel_units::Instant;
use eel_vertebra::{Drive, Motor, Vertebra};
use hil_sim::bus::Event as BusEvent;
use hil_sim::plant::Plant;
use hil_sim::robot::{Config, Node, Observer, Robot, Turn};

use super::watch::Watch;

/// Where yaw is stopped, rad: every joint but the last swims within it.
const STOP_RAD: f64 = 15.0 * std::f64::consts::PI / 180.0;
/// What a vertebra warns of, rad.
const FAR_RAD: f64 = 0.150;

/// What happens at the last joint, beside everything else.
struct Pressing {
    watch: Watch,
    /// When it was first so far from where it was to be, µs.
    far_since_us: Option<u64>,
    /// The most torque that a motor of it is told, N·m.
    told_nm: f64,
}

impl Observer for Pressing {
    fn bus(&mut self, event: &BusEvent) {
        self.watch.bus(event);
    }

    fn turn(&mut self, id: NodeId, node: &dyn Node, turn: &Turn<'_>, plant: &Plant) {
        self.watch.turn(id, node, turn, plant);
        if id.index() != 9 {
            return;
        }
        if let Some(reference) = node.vertebra().and_then(Vertebra::reference) {
            let yaw = f64::from(reference.yaw.to_q29()) / f64::from(1 << 29);
            if (yaw - plant.joint_pose(9)[0]).abs() > FAR_RAD {
                self.far_since_us.get_or_insert(turn.now.to_micros());
            }
        }
        for drive in turn.drives {
            if let Drive::Current(setpoint) = drive {
                let amps = f64::from(setpoint.current.to_microamps()) / 1e6;
                let constant = f64::from(Motor::PROTOTYPE.torque_constant) / 1e6;
                self.told_nm = self.told_nm.max((amps * constant).abs());
            }
        }
    }

    fn head(&mut self, time: Instant, event: HeadEvent) {
        self.watch.head(time, event);
    }
}

#[test]
fn a_joint_that_beats_against_a_hard_stop_says_so_at_once_and_presses_within_its_limits() {
    let mut config = Config::new(HeadConfig::new(Gait::SWIM), 3);
    config.plant.stops_rad[0] = STOP_RAD;
    let mut robot = Robot::new(&config).expect("a robot");
    let mut pressing = Pressing {
        watch: Watch::new(),
        far_since_us: None,
        told_nm: 0.0,
    };
    robot.run(8_000_000_000, &mut pressing);
    let watch = &pressing.watch;
    let last = NodeId::new(10).expect("a vertebra");

    // The target goes 11 degrees beyond the stop.
    assert!(
        watch.pursued[9][0] > STOP_RAD + FAR_RAD,
        "{:?}",
        watch.pursued
    );
    let far = pressing.far_since_us.expect("the joint is held");
    let told = watch
        .emergencies
        .iter()
        .find(|(_, _, report)| report.code == Emergency::FOLLOWING_ERROR.code);
    let (time, node, _) = told.expect("a warning");
    let passed = time.checked_sub(far);
    println!("warned {passed:?} µs after the deviation");
    assert_eq!(*node, last);
    assert!(
        passed.is_some_and(|passed| passed <= 3_000),
        "{passed:?} µs"
    );

    // A spring of 2000 N·m/rad under three motors of 3 N·m gives way by a few mrad.
    let beyond = watch.truth[9][0] - STOP_RAD;
    println!(
        "{beyond} rad beyond the stop, {} N·m told",
        pressing.told_nm
    );
    assert!(beyond < 0.02, "{beyond} rad");
    assert!(
        (2.9..=3.000_1).contains(&pressing.told_nm),
        "{}",
        pressing.told_nm
    );

    // It is a warning: the eel swims on, and nobody else has anything to say.
    for id in NodeId::all() {
        assert_eq!(robot.node(id).state(), Some(State::Run), "{id:?}");
    }
    let others = watch
        .emergencies
        .iter()
        .filter(|(_, node, _)| *node != last);
    assert_eq!(others.count(), 0, "{:?}", watch.emergencies);
}
