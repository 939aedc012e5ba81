//! The loop against a winding in double precision: R, L, back-EMF, and the delay of a period from the
//! conversion to the voltage.
#![expect(clippy::float_arithmetic, reason = "the oracle is a winding in f64")]

extern crate std;

use std::vec::Vec;

use super::*;
use proptest::prelude::*;

const SUPPLY_V: f64 = 24.0;
const PERIOD_S: f64 = 50e-6;
const SUPPLY: Voltage = Voltage::from_millivolts(24_000);

/// A motor with its bridge: the voltage follows the conversion by one period.
struct Winding {
    resistance: f64,
    inductance: f64,
    emf: f64,
    current: f64,
    voltage: f64,
    supply: f64,
    current_loop: CurrentLoop,
}

impl Winding {
    /// The prototype's, with resistance and inductance wrong by these factors.
    fn new(resistance: f64, inductance: f64) -> Self {
        Self {
            resistance: 5.8 * resistance,
            inductance: 0.55e-3 * inductance,
            emf: 0.0,
            current: 0.0,
            voltage: 0.0,
            supply: SUPPLY_V,
            current_loop: CurrentLoop::new(&Motor::PROTOTYPE),
        }
    }

    /// Sets motor 1's current and back-EMF as the control tick does.
    fn set(&mut self, amps: f64, emf: f64) {
        let setpoint = Setpoint {
            current: Current::from_microamps((amps * 1e6) as i32),
            emf: Voltage::from_millivolts((emf * 1e3) as i32),
        };
        let drives = [Drive::Current(setpoint), Drive::Off, Drive::Brake];
        self.current_loop.set(&drives, SUPPLY);
    }

    /// Lets a period pass in a hundred exact steps of the winding; returns the current at its end.
    fn period(&mut self) -> f64 {
        let measured = Current::from_microamps((self.current * 1e6) as i32);
        let [one, two, three] = self
            .current_loop
            .update([measured, Current::MAX, Current::MIN]);
        assert_eq!((two, three), (Switching::Off, Switching::Brake));
        let Switching::Duty(duty) = one else {
            panic!("motor 1 is driven");
        };
        for _ in 0..100 {
            let step = PERIOD_S / 100.0;
            let push = self.voltage - self.emf - self.resistance * self.current;
            self.current += step * push / self.inductance;
        }
        self.voltage = self.supply * f64::from(duty.to_q15()) / 32_767.0;
        self.current
    }

    fn run(&mut self, seconds: f64) -> Vec<f64> {
        (0..(seconds / PERIOD_S) as usize)
            .map(|_| self.period())
            .collect()
    }
}

#[test]
fn a_step_rises_in_two_periods_of_the_winding_and_does_not_overshoot() {
    for wanted in [0.05, 0.5, 1.5, -2.0] {
        let mut winding = Winding::new(1.0, 1.0);
        winding.set(wanted, 0.0);
        let course: Vec<f64> = winding.run(5e-3).iter().map(|amps| amps / wanted).collect();
        let rise = course.iter().position(|share| *share > 0.9).unwrap() + 1;
        let peak = course.iter().copied().fold(0.0, f64::max);
        // The winding alone needs 2.3 L/R = 218 µs, and the conversion a period more.
        assert!(rise <= 5, "{rise} periods to 90 % of {wanted} A");
        assert!(peak < 1.005, "{peak} of {wanted} A");
        // Of 0.3 mA the integral has less than its last digit.
        let end = course.last().unwrap();
        let off = (end - 1.0).abs() * f64::abs(wanted);
        assert!(
            off < 0.3e-3 + 1e-3 * f64::abs(wanted),
            "{end} of {wanted} A"
        );
    }
}

#[test]
fn a_winding_that_differs_by_a_third_is_brought_to_the_current() {
    for (resistance, inductance) in [(0.7, 0.7), (0.7, 1.3), (1.3, 0.7), (1.3, 1.3)] {
        let mut winding = Winding::new(resistance, inductance);
        winding.set(1.0, 0.0);
        let course = winding.run(10e-3);
        let peak = course.iter().copied().fold(0.0, f64::max);
        // R i* is wrong by 30 % for about a millisecond.
        assert!(peak < 1.0 + 0.3 / 0.7 + 0.1, "{peak} A");
        let end = course.last().unwrap();
        assert!((end - 1.0).abs() < 2e-3, "{end} A");
    }
}

#[test]
fn the_loop_keeps_its_phase_margin_for_every_winding_it_may_meet() {
    // L(jω) = (Kp + Ki/jω) e^(−jω 1.5 Δt) / (jω L + R), with the gains of the prototype.
    let margin = |resistance: f64, inductance: f64| {
        let (kp, ki) = (0.55e-3 * 3_141.6, 3_141.6 * 5.8 / 4.0);
        let mut least = f64::INFINITY;
        for step in 1..200_000 {
            let omega = f64::from(step);
            let gain = (kp * kp + (ki / omega).powi(2)).sqrt()
                / (resistance * resistance + (omega * inductance).powi(2)).sqrt();
            let phase = (-ki / omega).atan2(kp)
                - (omega * inductance).atan2(resistance)
                - omega * 1.5 * PERIOD_S;
            // Distance of L(jω) from −1.
            let (re, im) = (1.0 + gain * phase.cos(), gain * phase.sin());
            least = least.min(re.hypot(im));
        }
        least
    };
    for (resistance, inductance) in [(1.0, 1.0), (0.5, 0.5), (0.5, 2.0), (2.0, 0.5), (2.0, 2.0)] {
        // 1/0.5 is the largest amplification of a disturbance; 0.5 keeps 29 degrees and a factor of two.
        let distance = margin(5.8 * resistance, 0.55e-3 * inductance);
        assert!(
            distance > 0.5,
            "{distance} for {resistance} R, {inductance} L"
        );
    }
}

#[test]
fn a_speed_that_is_taken_wrong_passes_the_bound_for_a_moment_only() {
    // The crank slows down by 60 rad/s²; the observer is 2 rad/s too high, a surprise of 3 V.
    let mut winding = Winding::new(1.0, 1.0);
    let mut speed = 6.0;
    let mut course = Vec::new();
    for _ in 0..100 {
        winding.set(2.0, 1.488 * (speed + 2.0));
        winding.emf = 1.488 * speed;
        course.extend(winding.run(1e-3));
        speed -= 0.06;
    }
    let above = course.iter().filter(|amps| **amps > 2.0 * 1.02).count();
    let peak = course.iter().copied().fold(0.0, f64::max);
    assert!(peak < 2.0 + 3.0 / (5.8 + 1.7) + 0.1, "{peak} A");
    // Five milliseconds, at the beginning.
    assert!(above < 100, "{above} periods above");
    let end = course.last().unwrap();
    assert!((end - 2.0).abs() < 0.02, "{end} A");
}

#[test]
fn nothing_winds_up_while_the_supply_holds_the_voltage() {
    // 2 A at 20 V of back-EMF take 31.6 V of 24: for 50 ms; then the back-EMF falls away.
    let mut winding = Winding::new(1.0, 1.0);
    winding.emf = 20.0;
    winding.set(2.0, 20.0);
    let course = winding.run(50e-3);
    let held = course.last().unwrap();
    assert!((held - 4.0 / 5.8).abs() < 2e-3, "{held} A");
    winding.emf = 2.0;
    winding.set(2.0, 2.0);
    let course = winding.run(5e-3);
    let peak = course.iter().copied().fold(0.0, f64::max);
    assert!(peak < 2.2, "{peak} A");
    // Back within 5 % after a millisecond and a half. An integral that had been added up for 50 ms at
    // 1.3 A would be at the supply's limit, and the current far above.
    let late = &course[30..];
    assert!(late.iter().all(|amps| (amps - 2.0).abs() < 0.1), "{late:?}");
}

#[test]
fn a_sagging_supply_is_made_up_for() {
    let mut winding = Winding::new(1.0, 1.0);
    winding.set(1.0, 3.0);
    winding.emf = 3.0;
    winding.run(5e-3);
    // The tick still believes in 24 V.
    winding.supply = 20.0;
    let course = winding.run(10e-3);
    let end = course.last().unwrap();
    assert!((end - 1.0).abs() < 3e-3, "{end} A");
}

#[test]
fn a_bridge_that_was_off_begins_without_a_memory() {
    let mut winding = Winding::new(1.3, 1.0);
    winding.set(2.0, 0.0);
    winding.run(20e-3);
    let learned = winding.current_loop.channels[0].integral;
    assert!(learned > 1_000, "{learned}");
    for drive in [Drive::Off, Drive::Brake] {
        let mut current_loop = winding.current_loop.clone();
        current_loop.set(&[drive; 3], SUPPLY);
        assert_eq!(current_loop.channels[0].integral, 0);
    }
    // A tick that goes on keeps it.
    winding.set(2.0, 0.0);
    assert_eq!(winding.current_loop.channels[0].integral, learned);
}

#[test]
fn reaches_less_torque_the_faster_it_turns() {
    let motor = Electrical::new(&Motor::PROTOTYPE);
    let speed = AngularVelocity::from_milliradians_per_second(15_000);
    let (low, high) = motor.reach(SUPPLY, speed);
    let expected = 1.488 * (24.0 - 1.488 * 15.0) / 5.8;
    assert!((f64::from(high.to_millinewton_metres()) / 1e3 - expected).abs() < 2e-3);
    assert_eq!(low, -motor.torque(Motor::PROTOTYPE.current_limit));
}

#[test]
fn a_setpoint_is_the_current_of_the_torque_within_the_limit() {
    let motor = Electrical::new(&Motor::PROTOTYPE);
    let speed = AngularVelocity::from_milliradians_per_second(2_000);
    let setpoint = motor.setpoint(Torque::from_millinewton_metres(744), speed);
    assert!(setpoint.current.to_microamps().abs_diff(500_000) <= 2);
    assert!(setpoint.emf.to_millivolts().abs_diff(2_976) <= 1);
    let most = motor.setpoint(Torque::MAX, AngularVelocity::MIN);
    assert_eq!(most.current, Motor::PROTOTYPE.current_limit);
}

#[test]
fn a_bridge_whose_current_is_out_of_hand_stays_off_until_it_is_told_to_be() {
    let mut current_loop = CurrentLoop::new(&Motor::PROTOTYPE);
    let driven = [Drive::Current(Setpoint::default()); 3];
    let at = |amps: i32| [0, amps, 0].map(Current::from_milliamps);
    current_loop.set(&driven, SUPPLY);
    current_loop.update(at(3_750));
    assert_eq!(
        current_loop.tripped(),
        [false; 3],
        "at the limit, not beyond it"
    );
    let [_, switching, _] = current_loop.update(at(-3_751));
    assert_eq!(switching, Switching::Off, "in the same period");
    current_loop.set(&driven, SUPPLY);
    let [other, switching, _] = current_loop.update(at(0));
    assert_eq!(switching, Switching::Off);
    assert!(matches!(other, Switching::Duty(_)), "the others go on");
    assert_eq!(current_loop.tripped(), [false, true, false]);
    current_loop.set(&[Drive::Brake; 3], SUPPLY);
    current_loop.set(&driven, SUPPLY);
    assert_eq!(current_loop.tripped(), [false; 3]);
    let all = current_loop.update(at(0));
    assert!(all.iter().all(|it| matches!(it, Switching::Duty(_))));
}

proptest! {
    #[test]
    fn any_motor_setpoint_current_and_supply_has_a_duty(
        (resistance, inductance) in any::<(u32, u32)>(),
        (wanted, emf, supply) in any::<(i32, i32, i32)>(),
        measured in prop::collection::vec(any::<i32>(), 1..40),
    ) {
        let motor = Motor { resistance, inductance, ..Motor::PROTOTYPE };
        let mut current_loop = CurrentLoop::new(&motor);
        let setpoint = Setpoint {
            current: Current::from_microamps(wanted),
            emf: Voltage::from_millivolts(emf),
        };
        current_loop.set(&[Drive::Current(setpoint); 3], Voltage::from_millivolts(supply));
        let hard = i64::from(Motor::PROTOTYPE.current_limit.to_microamps()) * 3 / 2;
        let mut tripped = false;
        for raw in measured {
            tripped |= i64::from(raw).abs() > hard;
            for switching in current_loop.update([Current::from_microamps(raw); 3]) {
                match switching {
                    Switching::Duty(duty) => prop_assert!(!tripped && duty.abs() <= Duty::FULL),
                    other => prop_assert!(tripped && other == Switching::Off),
                }
            }
            prop_assert_eq!(current_loop.tripped(), [tripped; 3]);
        }
    }
}
