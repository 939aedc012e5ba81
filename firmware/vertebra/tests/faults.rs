//! Faults of a vertebra's own: found in time, told once, and only a fault reset leads back.

use eel_protocol::emergency::Emergency;
use eel_protocol::{Condition, Mode, State};
use eel_units::{Angle, Current, Temperature, Voltage};
use eel_vertebra::{Drive, Settings};

use support::{Bench, node, stays_off, stopping};

mod support;

/// Breaks a running vertebra, checks the fault's reaction to the end, and mends it.
fn check_fault(
    emergency: Emergency,
    motor: Option<usize>,
    within: u64,
    condition: Option<Condition>,
    set: impl Fn(&mut Bench, bool),
) {
    let name = emergency.name;
    let mut bench = Bench::running();
    let from = bench.millis;
    set(&mut bench, true);
    let passed = bench.until(State::Fault, within);
    assert!(passed <= within, "{name}: {passed} ms");
    let mut expected = [Drive::Brake; 3];
    if let Some(motor) = motor {
        expected[motor] = Drive::Off;
    }
    for _ in 0..1_999 {
        assert_eq!(bench.drives, expected, "{name}");
        bench.tick();
    }
    bench.run(2);
    assert!(bench.is_off(), "{name}");
    assert!(
        condition.is_none_or(|condition| bench.holds(condition)),
        "{name}"
    );
    // What still stands can't be reset, except for an encoder, which starts its alignment anew.
    if condition.is_some() {
        bench.mode = Mode::FaultReset;
        bench.run(50);
        assert_eq!(bench.state(), State::Fault, "{name}");
    }
    set(&mut bench, false);
    stays_off(&mut bench);
    let reports = bench.reports(from);
    assert_eq!(reports.len(), 1, "{name}: {reports:?}");
    assert_eq!(reports[0].code, emergency.code, "{name}");
    assert_eq!(reports[0].register, emergency.register, "{name}");
    assert_eq!(
        usize::from(reports[0].source.motor),
        motor.map_or(0, |motor| motor + 1),
        "{name}"
    );
    bench.recover();
    assert_eq!(bench.emergencies(from), [emergency.code, 0], "{name}");
}

#[test]
fn a_bridge_fault_frees_that_motor_and_brakes_the_others() {
    for motor in 0..3 {
        let condition = Some(Condition::Bridge);
        check_fault(
            Emergency::BRIDGE_FAULT,
            Some(motor),
            1,
            condition,
            |bench, broken| {
                bench.sample.bridge_fault[motor] = broken;
            },
        );
    }
}

#[test]
fn supply_out_of_its_window_is_a_fault_in_one_tick() {
    let faults = [
        (Emergency::UNDER_VOLTAGE, 17_000),
        (Emergency::OVER_VOLTAGE, 31_000),
    ];
    for (emergency, millivolts) in faults {
        check_fault(
            emergency,
            None,
            1,
            Some(Condition::Voltage),
            |bench, broken| {
                bench.sample.supply =
                    Voltage::from_millivolts(if broken { millivolts } else { 24_000 });
            },
        );
    }
}

#[test]
fn heat_is_a_fault_in_one_tick() {
    let condition = Some(Condition::Temperature);
    let celsius = |broken, hot| Temperature::from_decidegrees(if broken { hot } else { 300 });
    check_fault(
        Emergency::BOARD_OVER_TEMPERATURE,
        None,
        1,
        condition,
        |bench, broken| {
            bench.sample.board_temperature = celsius(broken, 900);
        },
    );
    for motor in 0..3 {
        let emergency = Emergency::MOTOR_OVER_TEMPERATURE;
        check_fault(emergency, Some(motor), 1, condition, |bench, broken| {
            bench.sample.motor_temperature[motor] = celsius(broken, 1_000);
        });
    }
}

#[test]
fn a_current_far_above_the_limit_is_a_fault_in_one_tick() {
    for motor in 0..3 {
        check_fault(
            Emergency::OVER_CURRENT,
            Some(motor),
            1,
            None,
            |bench, broken| {
                bench.sample.current[motor] =
                    Current::from_milliamps(if broken { -3_751 } else { 0 });
            },
        );
    }
}

#[test]
fn a_bridge_that_the_current_loop_switched_off_is_a_fault_in_one_tick() {
    for motor in 0..3 {
        let emergency = Emergency::OVER_CURRENT;
        check_fault(emergency, Some(motor), 1, None, |bench, broken| {
            bench.sample.over_current[motor] = broken;
        });
    }
}

#[test]
fn a_silent_absolute_encoder_is_a_fault_in_50_ticks() {
    for motor in 0..3 {
        check_fault(
            Emergency::ENCODER_INVALID,
            Some(motor),
            50,
            None,
            |bench, broken| {
                bench.measures = !broken;
                bench.sample.absolute[motor] = None;
            },
        );
    }
}

#[test]
fn an_absolute_encoder_that_contradicts_the_counter_is_a_fault_in_5_ticks() {
    for motor in 0..3 {
        check_fault(
            Emergency::ENCODER_IMPLAUSIBLE,
            Some(motor),
            5,
            None,
            |bench, broken| {
                bench.measures = !broken;
                let angle = bench.sample.absolute[motor].unwrap();
                bench.sample.absolute[motor] = Some(angle + Angle::from_milliradians(25));
            },
        );
    }
}

#[test]
fn a_counter_that_jumps_is_a_fault_in_5_ticks() {
    for motor in 0..3 {
        check_fault(
            Emergency::ENCODER_IMPLAUSIBLE,
            Some(motor),
            5,
            None,
            |bench, broken| {
                bench.measures = !broken;
                bench.sample.encoder_counts[motor] += 2_000;
            },
        );
    }
}

#[test]
fn what_was_off_before_a_fault_stays_off() {
    for prepare in [Bench::ready, || stopping(State::StopOff)] {
        let mut bench = prepare();
        bench.sample.bridge_fault[0] = true;
        for _ in 0..100 {
            bench.tick();
            assert_eq!(bench.state(), State::Fault);
            assert!(bench.is_off(), "{:?}", bench.drives);
        }
    }
}

#[test]
fn a_fault_during_a_stop_brakes_the_healthy_motors() {
    let mut bench = stopping(State::StopDamped);
    bench.sample.bridge_fault[2] = true;
    bench.tick();
    assert_eq!(bench.drives, [Drive::Brake, Drive::Brake, Drive::Off]);
}

#[test]
fn a_winding_that_gets_too_hot_is_a_fault_until_it_has_cooled() {
    for motor in 0..3 {
        let mut bench = Bench::running();
        let from = bench.millis;
        // Less than the current that is a fault at once.
        bench.sample.current[motor] = Current::from_milliamps(3_600);
        bench.until(State::Fault, 120_000);
        let thermal = Settings::prototype(node(), 0).motor.thermal;
        let limit = thermal.winding_limit.to_decidegrees();
        let [report] = bench.reports(from)[..] else {
            panic!("{:?}", bench.reports(from))
        };
        assert_eq!(report.code, Emergency::WINDING_OVER_TEMPERATURE.code);
        assert_eq!(usize::from(report.source.motor), motor + 1);
        assert!(i32::from(report.source.detail) > limit, "{report:?}");
        assert!(i32::from(report.source.detail) < limit + 300, "{report:?}");

        bench.sample.current[motor] = Current::ZERO;
        bench.mode = Mode::FaultReset;
        // Longer than it brakes.
        bench.run(2_100);
        assert_eq!(bench.state(), State::Fault, "still hot");
        stays_off(&mut bench);
        bench.run(300_000);
        bench.recover();
    }
}
