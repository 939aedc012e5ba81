//! The bridges of a joint: the current loop of the board on windings with inductance.
//!
//! The plant's step is ten periods of the loop. Within it the speed is that of its beginning; what a
//! period's conversion decides acts in the next period, as on the board.

use eel_units::{Current, Voltage};
use eel_vertebra::{CURRENT_LOOP_HZ, CurrentLoop, Drive, Switching};

use super::config::Motor;
use super::motor::{Bridge, MotorState, Winding};

/// A step of the board's current converter, µA: 3.3 V / 4096 over 5 mΩ · 50.
const CONVERTER_STEP_UA: f64 = 3_222.656;

/// What the bridges have, and how wrong they measure.
#[derive(Clone, Copy, Debug)]
pub struct Supply {
    /// Voltage at the bridges.
    pub volts: f64,
    /// How each current is measured.
    pub sensors: [Sensor; 3],
}

/// A current sensor in line with a motor's leads.
#[derive(Clone, Copy, Debug)]
pub struct Sensor {
    /// −1 where the leads are exchanged, for the bridge's voltage as well.
    pub sign: f64,
    /// What it reads without a current, A.
    pub offset_a: f64,
}

/// The bridges of three motors.
#[derive(Clone, Debug)]
pub struct Power {
    current_loop: CurrentLoop,
    winding: Winding,
    /// What acts until the next conversion.
    acting: [Switching; 3],
    drawn_a: [f64; 3],
}

impl Power {
    /// Makes bridges that are off.
    pub fn new(motor: &Motor) -> Self {
        Self {
            current_loop: CurrentLoop::new(&eel_vertebra::Motor::PROTOTYPE),
            winding: Winding::new(motor, 1.0 / f64::from(CURRENT_LOOP_HZ)),
            acting: [Switching::Off; 3],
            drawn_a: [0.0; 3],
        }
    }

    /// Lets the loop act for a step and returns what each bridge did.
    pub fn act(
        &mut self,
        motor: &Motor,
        drives: &[Drive; 3],
        supply: &Supply,
        speeds: &[f64; 3],
        motors: &mut [MotorState; 3],
        step: f64,
    ) -> [Bridge; 3] {
        let is_driven = drives.map(|drive| matches!(drive, Drive::Current(_)));
        self.drawn_a = [0.0; 3];
        let (supply_v, sensors) = (supply.volts, supply.sensors);
        let supply = Voltage::from_millivolts(libm::round(supply_v * 1e3) as i32);
        self.current_loop.set(drives, supply);
        let periods = libm::round(step * f64::from(CURRENT_LOOP_HZ)).max(1.0);
        let mut sums = [0.0; 3];
        if is_driven.contains(&true) {
            for _ in 0..periods as usize {
                let measured = std::array::from_fn(|i| {
                    converted(sensors[i].sign * motors[i].current_a + sensors[i].offset_a)
                });
                let decided = self.current_loop.update(measured);
                for i in (0..3).filter(|i| is_driven[*i]) {
                    let volts = sensors[i].sign * voltage(self.acting[i], supply_v);
                    let before = motors[i].current_a;
                    let after = if self.current_loop.tripped()[i] {
                        0.0
                    } else {
                        self.winding.advance(motor, before, volts, speeds[i])
                    };
                    let mean = 0.5 * (before + after);
                    motors[i].current_a = after;
                    sums[i] += mean;
                    self.drawn_a[i] += volts * mean / (supply_v.max(1.0) * periods);
                }
                self.acting = decided;
            }
        }
        std::array::from_fn(|i| match drives[i] {
            Drive::Off => Bridge::Open,
            Drive::Brake => Bridge::Voltage(0.0),
            Drive::Current(_) => Bridge::Current(sums[i] / periods),
        })
    }

    /// Tells which bridges the loop has switched off.
    pub fn tripped(&self) -> [bool; 3] {
        self.current_loop.tripped()
    }

    /// Returns the mean current drawn from the battery in the last step, A.
    pub fn drawn_a(&self) -> f64 {
        self.drawn_a.iter().sum()
    }
}

/// Returns the current as the board converts it.
fn converted(current_a: f64) -> Current {
    let steps = libm::round(current_a * 1e6 / CONVERTER_STEP_UA);
    Current::from_microamps((steps * CONVERTER_STEP_UA) as i32)
}

/// Returns the voltage of a driven bridge; one that was off or braked before begins with none.
fn voltage(acting: Switching, supply_v: f64) -> f64 {
    match acting {
        Switching::Off | Switching::Brake => 0.0,
        Switching::Duty(duty) => f64::from(duty.to_q15()) / 32_767.0 * supply_v,
    }
}

#[cfg(test)]
mod tests {
    use eel_vertebra::Setpoint;

    use super::*;

    const FULL: Supply = Supply {
        volts: 24.0,
        sensors: [Sensor {
            sign: 1.0,
            offset_a: 0.0,
        }; 3],
    };

    /// Spins a lone motor with a load by the loop for a second, in steps; returns its speed at the end.
    fn spin(step: f64, amps: f64) -> (f64, MotorState) {
        let motor = Motor::default();
        let mut motors = std::array::from_fn(|_| MotorState::new(&motor));
        let mut power = Power::new(&motor);
        let mut speed: f64 = 0.0;
        let steps_per_tick = libm::round(1e-3 / step) as usize;
        for _ in 0..1_000 {
            // The control tick.
            let setpoint = Setpoint {
                current: Current::from_microamps((amps * 1e6) as i32),
                emf: Voltage::from_millivolts((motor.constant * speed * 1e3) as i32),
            };
            let drives = [Drive::Current(setpoint), Drive::Off, Drive::Brake];
            for _ in 0..steps_per_tick {
                let speeds = [speed, 0.0, 0.0];
                let [bridge, ..] = power.act(&motor, &drives, &FULL, &speeds, &mut motors, step);
                let line = super::super::motor::line(&motor, bridge, speed);
                let push = line.torque - line.slope * speed;
                speed += step * push / (0.05 + step * line.slope);
                motors[0].advance(&motor, bridge, speed, step);
            }
        }
        (speed, motors[0].clone())
    }

    #[test]
    fn half_a_millisecond_is_as_good_as_a_period() {
        for amps in [0.1, 0.5, -0.3] {
            let ((coarse, _), (fine, state)) = (spin(0.5e-3, amps), spin(50e-6, amps));
            assert!(
                (coarse - fine).abs() < 5e-3 * fine.abs(),
                "{coarse} {fine} rad/s"
            );
            assert!(
                (state.current_a - amps).abs() < 5e-3,
                "{} A",
                state.current_a
            );
        }
    }

    #[test]
    fn the_battery_gives_what_motor_and_winding_take() {
        let motor = Motor::default();
        let mut motors = std::array::from_fn(|_| MotorState::new(&motor));
        let mut power = Power::new(&motor);
        let speed = 4.0;
        let setpoint = Setpoint {
            current: Current::from_milliamps(800),
            emf: Voltage::from_millivolts((motor.constant * speed * 1e3) as i32),
        };
        let drives = [Drive::Current(setpoint), Drive::Off, Drive::Brake];
        for _ in 0..20 {
            power.act(
                &motor,
                &drives,
                &FULL,
                &[speed, 0.0, 0.0],
                &mut motors,
                0.5e-3,
            );
        }
        // V i = R i² + k ω i.
        let taken = 5.8 * 0.64 + 1.488 * speed * 0.8;
        let given = 24.0 * power.drawn_a();
        assert!(
            (given - taken).abs() < 0.02 * taken,
            "{given} W of {taken} W"
        );
    }
}
