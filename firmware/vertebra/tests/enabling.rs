//! Enabling: refused for each reason, with the reason, and never by a stream that was there before.

use eel_canopen::NmtCommand;
use eel_protocol::emergency::Emergency;
use eel_protocol::{Condition, Mode, NodeId, State};
use eel_units::{Angle, AngularVelocity, Current, Temperature, Torque, Voltage};
use eel_vertebra::{Ramp, Settings};

use support::{Bench, node, pose};

mod support;

/// Starts a vertebra with something wrong, asks it to run, and checks the reason for refusing; then
/// mends it and checks that the old request enables nothing but a new one does.
fn refused(reason: Condition, set: impl Fn(&mut Bench, bool)) {
    let mut bench = Bench::new();
    set(&mut bench, true);
    bench.nmt(NmtCommand::Start);
    bench.run(600);
    for mode in [Mode::Run, Mode::Hold, Mode::Damped, Mode::Brake] {
        bench.mode = Mode::Off;
        bench.run(20);
        bench.mode = mode;
        for _ in 0..30 {
            bench.tick();
            assert!(bench.is_off(), "{reason:?}: {mode:?}");
            let expected = [State::NotReady, State::SwitchedOff];
            assert!(
                expected.contains(&bench.state()),
                "{reason:?}: {:?}",
                bench.state()
            );
            assert!(
                bench.holds(reason),
                "{reason:?}: {:?}",
                bench.vertebra.status()
            );
        }
    }
    set(&mut bench, false);
    bench.run(400);
    assert!(!bench.holds(reason), "{reason:?}");
    assert_eq!(
        bench.state(),
        State::Ready,
        "{reason:?}: a request of before enables nothing"
    );
    bench.mode = Mode::Off;
    bench.run(20);
    bench.mode = Mode::Run;
    bench.run(20);
    assert_eq!(
        bench.state(),
        State::Run,
        "{reason:?}: {:?}",
        bench.vertebra.status()
    );
}

#[test]
fn refused_while_a_crank_has_no_valid_angle() {
    for motor in 0..3 {
        refused(Condition::Encoders, |bench, broken| {
            bench.measures = !broken;
            if broken {
                bench.sample.absolute[motor] = None;
            }
        });
    }
}

#[test]
fn refused_outside_the_workspace_and_its_quarter_more() {
    for wrong in [pose(660, 0, 0), pose(0, -330, 0), pose(0, 0, 90)] {
        let mut bench = Bench::new();
        bench.pose = wrong;
        bench.nmt(NmtCommand::Start);
        bench.run(600);
        bench.mode = Mode::Run;
        bench.run(50);
        assert_eq!(bench.state(), State::SwitchedOff, "{wrong:?}");
        assert!(bench.holds(Condition::Pose));
        // Somebody moves the wrist back by hand.
        for step in (0..=400).rev() {
            let part = |angle: Angle| Angle::from_q29((angle.to_q29() / 400).saturating_mul(step));
            bench.pose.yaw = part(wrong.yaw);
            bench.pose.pitch = part(wrong.pitch);
            bench.pose.roll = part(wrong.roll);
            bench.tick();
        }
        assert!(
            !bench.holds(Condition::Pose),
            "{wrong:?}: {:?}",
            bench.vertebra.pose()
        );
        assert_eq!(bench.state(), State::Ready);
    }
}

#[test]
fn refused_outside_the_supply_window() {
    for millivolts in [0, 16_999, 17_000, 31_000, 60_000] {
        refused(Condition::Voltage, |bench, broken| {
            let supply = if broken { millivolts } else { 24_000 };
            bench.sample.supply = Voltage::from_millivolts(supply);
        });
    }
}

#[test]
fn refused_while_too_hot() {
    refused(Condition::Temperature, |bench, broken| {
        let board = if broken { 900 } else { 300 };
        bench.sample.board_temperature = Temperature::from_decidegrees(board);
    });
    for motor in 0..3 {
        refused(Condition::Temperature, |bench, broken| {
            let housing = if broken { 1_000 } else { 300 };
            bench.sample.motor_temperature[motor] = Temperature::from_decidegrees(housing);
        });
    }
}

#[test]
fn refused_until_the_encoders_were_valid_for_a_quarter_of_a_second() {
    let mut bench = Bench::new();
    bench.nmt(NmtCommand::Start);
    bench.run(249);
    assert_eq!(bench.state(), State::NotReady);
    assert!(bench.holds(Condition::Encoders));
    bench.run(20);
    assert_eq!(bench.state(), State::Ready);
}

#[test]
fn a_crank_that_moves_far_during_alignment_starts_it_again() {
    let mut bench = Bench::new();
    bench.nmt(NmtCommand::Start);
    bench.run(200);
    let joint = bench.sample.absolute[0];
    bench.measures = false;
    bench.sample.absolute[0] = joint.map(|angle| angle + Angle::from_milliradians(50));
    bench.tick();
    bench.measures = true;
    bench.run(200);
    assert_eq!(
        bench.state(),
        State::NotReady,
        "the readings did not agree for long enough"
    );
    bench.run(100);
    assert_eq!(bench.state(), State::Ready);
}

#[test]
fn refused_before_the_node_is_operational() {
    let mut bench = Bench::new();
    bench.mode = Mode::Off;
    bench.run(500);
    bench.mode = Mode::Run;
    bench.run(500);
    assert_eq!(bench.state(), State::SwitchedOff);
    assert!(bench.holds(Condition::NotOperational));
    assert!(bench.is_off());
}

#[test]
fn refused_while_the_head_is_silent() {
    let mut bench = Bench::ready();
    bench.heartbeat = false;
    bench.run(301);
    assert!(bench.holds(Condition::HeadLost));
    assert_eq!(bench.state(), State::SwitchedOff);
    bench.mode = Mode::Run;
    bench.run(100);
    assert!(bench.is_off());
    bench.heartbeat = true;
    bench.run(200);
    assert_eq!(
        bench.state(),
        State::Ready,
        "a request of before enables nothing"
    );
}

#[test]
fn unsound_settings_are_a_fault_that_no_reset_clears() {
    let good = Settings::prototype(node(), 1);
    let mut wrong = [good; 14];
    wrong[0].limits.peak_torque = Torque::ZERO;
    wrong[1].limits.workspace.yaw = Angle::ZERO;
    wrong[2].limits.workspace.roll = Angle::PI;
    wrong[3].limits.travel[2].high = wrong[3].limits.travel[2].low;
    wrong[4].limits.supply_low = Ramp {
        start: Voltage::ZERO,
        end: Voltage::ZERO,
    };
    wrong[5].limits.supply_high.start = Voltage::ZERO;
    wrong[6].limits.board_hot.end = Temperature::ZERO;
    wrong[7].limits.motor_hot.end = Temperature::ZERO;
    wrong[8].limits.rate = AngularVelocity::ZERO;
    wrong[9].motor.torque_constant = u32::MAX;
    wrong[10].motor.resistance = 0;
    wrong[11].motor.counts_per_turn = 0;
    wrong[12].motor.current_limit = Current::ZERO;
    wrong[13].motor.speed_limit = AngularVelocity::MIN;
    assert!(good.are_sound());
    for (case, settings) in wrong.into_iter().enumerate() {
        assert!(!settings.are_sound(), "case {case}");
        let mut bench = Bench::with(settings);
        bench.nmt(NmtCommand::Start);
        for mode in [Mode::Off, Mode::FaultReset, Mode::Off, Mode::Run] {
            bench.mode = mode;
            bench.run(200);
            assert!(bench.is_off(), "case {case}");
            assert_eq!(bench.state(), State::Fault, "case {case}");
            assert!(bench.holds(Condition::Settings), "case {case}");
        }
        assert_eq!(
            bench.emergencies(0),
            [Emergency::SETTINGS_INVALID.code],
            "case {case}"
        );
    }
}

#[test]
fn a_bridge_fault_or_an_emergency_stop_before_enabling_latches() {
    type Set = fn(&mut Bench, bool);
    let causes: [(Condition, Set); 2] = [
        (Condition::Bridge, |bench, on| {
            bench.sample.bridge_fault[1] = on;
        }),
        (Condition::EmergencyStop, |bench, on| {
            bench.sample.emergency_stop = on;
        }),
    ];
    for (condition, set) in causes {
        let mut bench = Bench::ready();
        set(&mut bench, true);
        bench.run(20);
        assert!(bench.holds(condition) && bench.state().is_latched());
        bench.mode = Mode::FaultReset;
        bench.run(20);
        assert!(bench.state().is_latched(), "{condition:?} still holds");
        set(&mut bench, false);
        bench.mode = Mode::Run;
        bench.run(100);
        assert!(bench.is_off() && bench.state().is_latched());
        bench.recover();
    }
}

#[test]
fn a_stream_of_run_at_power_up_never_enables() {
    for mode in [
        Mode::Run,
        Mode::Hold,
        Mode::Damped,
        Mode::Brake,
        Mode::FaultReset,
    ] {
        let mut bench = Bench::new();
        bench.mode = mode;
        bench.nmt(NmtCommand::Start);
        for _ in 0..3_000 {
            bench.tick();
            assert!(bench.is_off(), "{mode:?}");
        }
        assert_eq!(bench.state(), State::Ready);
    }
}

#[test]
fn a_stream_of_run_after_a_reset_of_the_node_never_enables() {
    let mut bench = Bench::running();
    bench.nmt(NmtCommand::ResetNode);
    bench.nmt(NmtCommand::Start);
    for _ in 0..1_000 {
        bench.tick();
        assert!(bench.is_off());
    }
    assert_eq!(bench.state(), State::Ready);
    bench.mode = Mode::Off;
    bench.run(20);
    bench.mode = Mode::Run;
    bench.run(20);
    assert_eq!(bench.state(), State::Run);
}

#[test]
fn a_target_for_another_vertebra_enables_nobody_else() {
    let mut bench = Bench::ready();
    bench.stream = false;
    for _ in 0..20 {
        bench.mode = Mode::Run;
        let own = bench.next_target();
        let other = NodeId::new(4).unwrap();
        let target = eel_protocol::Target::from_frame(&own).unwrap().1;
        bench.extra.push(target.to_frame(other).unwrap());
        bench.run(10);
    }
    assert_eq!(bench.state(), State::Ready);
}
