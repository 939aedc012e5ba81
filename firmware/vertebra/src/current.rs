//! From torque to the share of the supply voltage that drives it.
//!
//! The winding settles within a tick, so the voltage that a current needs is known: R i + k ω. A
//! slow integral takes up what resistance and supply really are. The 20 kHz loop of the board will
//! take this place.

use eel_kinematics::Bounds;
use eel_units::{AngularVelocity, Current, Duty, Torque, Voltage, saturate};

use crate::io::Drive;
use crate::settings::Motor;

/// Share of the current error that enters the integral each tick, as a shift.
const INTEGRAL_SHIFT: u32 = 4;
/// Most voltage that the integral may add.
const INTEGRAL_LIMIT_MV: i64 = 3_000;
/// Least supply that a duty is computed for.
const SUPPLY_FLOOR_MV: i64 = 1_000;

/// Torque constants in µN·m/A that the products below have room for: 1 mN·m/A to 100 N·m/A.
pub const TORQUE_CONSTANTS: (u32, u32) = (1_000, 100_000_000);
/// Resistances in mΩ that they have room for: 1 mΩ to 1 kΩ.
pub const RESISTANCES: (u32, u32) = (1, 1_000_000);

/// A motor's constants, prepared for the tick.
#[derive(Clone, Copy, Debug)]
pub struct Electrical {
    /// Current per torque: µA per N·m.
    microamps_per_newton_metre: i64,
    /// Torque per current: Q24 N·m per µA, in Q20.
    torque_per_microamp: i64,
    /// Voltage per current: mV per µA, in Q30.
    millivolts_per_microamp: i64,
    /// Voltage per speed: mV per Q24 rad/s, in Q34.
    millivolts_per_speed: i64,
    /// Torque per voltage: Q24 N·m per mV.
    torque_per_millivolt: i64,
    current_limit: Current,
}

/// What the current controller of one motor remembers.
#[derive(Clone, Copy, Debug, Default)]
pub struct CurrentState {
    wanted: Current,
    integral_mv: i64,
    saturated: bool,
    /// The voltage of the last tick; none where the bridge was open.
    applied_mv: Option<i64>,
    emf_mv: i64,
}

/// What one motor's current depends on, as measured for this tick.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    /// Speed of the motor.
    pub speed: AngularVelocity,
    /// Mean current of the tick that ends.
    pub current: Current,
    /// Supply of the bridge.
    pub supply: Voltage,
}

impl CurrentState {
    /// Forgets what was learned, but not what the bridge does.
    pub fn restart(&mut self) {
        *self = Self {
            applied_mv: self.applied_mv,
            emf_mv: self.emf_mv,
            ..Self::default()
        };
    }

    /// Notes what the bridge does until the next tick, where that is no duty.
    pub fn note_drive(&mut self, drive: &Drive) {
        match drive {
            Drive::Off => self.applied_mv = None,
            Drive::Brake => self.applied_mv = Some(0),
            Drive::Duty(_) => {}
        }
    }
}

impl Electrical {
    /// Prepares the constants; what is out of range is moved to its end.
    pub const fn new(motor: &Motor) -> Self {
        let constant = within(motor.torque_constant, TORQUE_CONSTANTS);
        let resistance = within(motor.resistance, RESISTANCES);
        Self {
            microamps_per_newton_metre: 1_000_000_000_000 / constant,
            // 2⁴⁴ / 10¹² = 17.592186.
            torque_per_microamp: constant * 17_592_186 / 1_000_000,
            millivolts_per_microamp: (resistance << 30) / 1_000_000,
            millivolts_per_speed: (constant << 10) / 1_000,
            // k/R: µN·m/A over mΩ is 10⁻⁶ N·m per mV, times 2²⁴.
            torque_per_millivolt: (constant << 24) / resistance / 1_000_000,
            current_limit: motor.current_limit,
        }
    }

    /// Returns the torque of a current.
    pub fn torque(&self, current: Current) -> Torque {
        let current = i64::from(current.to_microamps());
        Torque::from_q24(saturate((current * self.torque_per_microamp) >> 20))
    }

    /// Returns the most torque forward and backward that `supply` drives at `speed`, and that the
    /// bridge's current limit allows.
    pub fn reach(&self, supply: Voltage, speed: AngularVelocity) -> (Torque, Torque) {
        let emf = self.back_emf(speed);
        let supply = i64::from(supply.to_millivolts()).max(0);
        let limit = self.torque(self.current_limit);
        let low = Torque::from_q24(saturate((-supply - emf) * self.torque_per_millivolt));
        let high = Torque::from_q24(saturate((supply - emf) * self.torque_per_millivolt));
        (low.bounded(-limit, limit), high.bounded(-limit, limit))
    }

    /// Returns the duty that lets the motor produce `torque`, from what was measured in the tick
    /// before. The current that was measured holds the next one within `bounds`, whatever the
    /// speed was taken for.
    pub fn duty(
        &self,
        state: &mut CurrentState,
        torque: Torque,
        bounds: &Bounds,
        reading: &Reading,
    ) -> Duty {
        let error = self.voltage(state.wanted) - self.voltage(reading.current);
        if !state.saturated {
            let integral = state.integral_mv + (error >> INTEGRAL_SHIFT);
            state.integral_mv = integral.clamp(-INTEGRAL_LIMIT_MV, INTEGRAL_LIMIT_MV);
        }
        state.wanted = self.current(torque);
        let emf = self.back_emf(reading.speed);
        let voltage = self.voltage(state.wanted) + emf + state.integral_mv;
        // The voltage that drove the measured current, moved by the change of the back-EMF.
        let before = match state.applied_mv {
            Some(applied) => applied + (emf - state.emf_mv),
            None => emf,
        };
        let to_current = |bound: Torque| {
            before + self.voltage(self.current(bound)) - self.voltage(reading.current)
        };
        let (low, high) = (to_current(bounds.low), to_current(bounds.high));
        let held = voltage.max(low).min(high.max(low));
        let supply = i64::from(reading.supply.to_millivolts()).max(SUPPLY_FLOOR_MV);
        let applied = held.clamp(-supply, supply);
        state.saturated = applied != voltage;
        state.applied_mv = Some(applied);
        state.emf_mv = emf;
        // The machine divides 32 bits itself, and no supply has more millivolts than 16.
        Duty::from_q15(match u16::try_from(supply) {
            Ok(supply) => applied as i32 * 32_767 / i32::from(supply).max(1),
            Err(_) => (applied * 32_767 / supply) as i32,
        })
    }

    /// Returns the current of a torque, within the bridge's limit.
    fn current(&self, torque: Torque) -> Current {
        let current = (i64::from(torque.to_q24()) * self.microamps_per_newton_metre) >> 24;
        Current::from_microamps(saturate(current)).bounded(-self.current_limit, self.current_limit)
    }

    fn voltage(&self, current: Current) -> i64 {
        (i64::from(current.to_microamps()) * self.millivolts_per_microamp) >> 30
    }

    fn back_emf(&self, speed: AngularVelocity) -> i64 {
        (i64::from(speed.to_q24()) * self.millivolts_per_speed) >> 34
    }
}

const fn within(value: u32, (least, most): (u32, u32)) -> i64 {
    if value < least {
        least as i64
    } else if value > most {
        most as i64
    } else {
        value as i64
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_arithmetic, reason = "the oracle is a winding in f64")]

    use super::*;

    const SUPPLY: Voltage = Voltage::from_millivolts(24_000);
    const WIDE: Bounds = Bounds {
        low: Torque::from_millinewton_metres(-3_000),
        high: Torque::from_millinewton_metres(3_000),
    };

    fn motor() -> Electrical {
        Electrical::new(&Motor::PROTOTYPE)
    }

    fn reading(speed: f64, current: f64) -> Reading {
        Reading {
            speed: AngularVelocity::from_milliradians_per_second((speed * 1e3) as i32),
            current: Current::from_microamps((current * 1e6) as i32),
            supply: SUPPLY,
        }
    }

    /// The winding: the current that a duty drives at a speed, with another resistance than set.
    fn winding(duty: Duty, speed: f64, resistance: f64) -> f64 {
        let voltage = 24.0 * f64::from(duty.to_q15()) / 32_767.0;
        (voltage - 1.488 * speed) / resistance
    }

    #[test]
    fn drives_the_current_that_the_torque_needs() {
        let mut state = CurrentState::default();
        let torque = Torque::from_millinewton_metres(1_488);
        let duty = motor().duty(&mut state, torque, &WIDE, &reading(3.0, 0.0));
        assert!((winding(duty, 3.0, 5.8) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn learns_a_resistance_that_differs_from_the_settings() {
        let mut state = CurrentState::default();
        let torque = Torque::from_millinewton_metres(744);
        let mut current = 0.0;
        for _ in 0..200 {
            let duty = motor().duty(&mut state, torque, &WIDE, &reading(0.0, current));
            current = winding(duty, 0.0, 7.0);
        }
        assert!((current - 0.5).abs() < 5e-3, "{current}");
    }

    #[test]
    fn a_speed_that_is_taken_wrong_does_not_break_the_bound() {
        // The crank slows down by 60 rad/s² and the observer lags by 2 rad/s.
        let mut state = CurrentState::default();
        let peak = 3.0 / 1.488;
        let mut current = 0.0;
        let mut speed = 6.0;
        for tick in 0..100 {
            let duty = motor().duty(&mut state, WIDE.high, &WIDE, &reading(speed + 2.0, current));
            speed -= 0.06;
            current = winding(duty, speed, 5.8);
            if tick > 0 {
                assert!(current < peak * 1.02, "{current} A in tick {tick}");
            }
        }
        assert!(current > peak * 0.98, "{current} A at the end");
    }

    #[test]
    fn reaches_less_torque_the_faster_it_turns() {
        let speed = AngularVelocity::from_milliradians_per_second(15_000);
        let (low, high) = motor().reach(SUPPLY, speed);
        let expected = 1.488 * (24.0 - 1.488 * 15.0) / 5.8;
        assert!((f64::from(high.to_millinewton_metres()) / 1e3 - expected).abs() < 2e-3);
        assert_eq!(low, -motor().torque(Motor::PROTOTYPE.current_limit));
    }

    #[test]
    fn any_measurement_leaves_the_duty_in_range() {
        let mut state = CurrentState::default();
        for raw in [i32::MIN, -1, 0, 1, i32::MAX] {
            for supply in [i32::MIN, 0, 24_000, i32::MAX] {
                let bound = Torque::from_q24(raw);
                let reading = Reading {
                    speed: AngularVelocity::from_q24(raw),
                    current: Current::from_microamps(raw),
                    supply: Voltage::from_millivolts(supply),
                };
                let bounds = Bounds {
                    low: bound,
                    high: -bound,
                };
                let duty = motor().duty(&mut state, bound, &bounds, &reading);
                assert!(duty.abs() <= Duty::FULL);
            }
        }
    }
}
