//! A sign-magnitude H-bridge: one PWM input, one direction input, one wake input.
//!
//! The truth table is that of TI's DRV8874 in phase/enable mode (SLVSF66A, table 4): asleep, all
//! switches are open; awake, PWM low turns both low sides on, PWM high drives as the direction
//! input says.

use eel_units::Duty;
use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;

/// What a bridge does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// All switches open: the motor is free.
    Off,
    /// Low sides on: the motor is shorted.
    Brake,
    /// This share of the supply voltage, positive with the direction input high.
    Duty(Duty),
}

/// Which of its connections failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BridgeError {
    /// The PWM input.
    Pwm,
    /// The direction input.
    Direction,
    /// The wake input.
    Wake,
}

/// One H-bridge.
#[derive(Debug)]
pub struct Bridge<Pwm, Direction, Wake> {
    pwm: Pwm,
    direction: Direction,
    wake: Wake,
}

impl<Pwm, Direction, Wake> Bridge<Pwm, Direction, Wake>
where
    Pwm: SetDutyCycle,
    Direction: OutputPin,
    Wake: OutputPin,
{
    /// Takes the connections of a bridge and turns it off.
    ///
    /// # Errors
    /// The connection that could not be set.
    pub fn new(pwm: Pwm, direction: Direction, wake: Wake) -> Result<Self, BridgeError> {
        let mut bridge = Self {
            pwm,
            direction,
            wake,
        };
        bridge.apply(Output::Off)?;
        Ok(bridge)
    }

    /// Makes the bridge do this until the next call. Where the sign changes, the PWM follows within
    /// one of its periods; a bridge that slept drives about 1 ms later.
    ///
    /// # Errors
    /// The connection that could not be set; the bridge may then be anything but more awake than
    /// asked for.
    pub fn apply(&mut self, output: Output) -> Result<(), BridgeError> {
        match output {
            Output::Off => {
                self.wake.set_low().map_err(|_| BridgeError::Wake)?;
                self.set_magnitude(0)
            }
            Output::Brake => {
                self.set_magnitude(0)?;
                self.wake.set_high().map_err(|_| BridgeError::Wake)
            }
            Output::Duty(duty) => {
                let is_positive = duty >= Duty::ZERO;
                self.direction
                    .set_state(is_positive.into())
                    .map_err(|_| BridgeError::Direction)?;
                self.set_magnitude(duty.to_q15().unsigned_abs())?;
                self.wake.set_high().map_err(|_| BridgeError::Wake)
            }
        }
    }

    /// Sets the share of the time that the bridge drives, in parts of 32 767; more is full.
    fn set_magnitude(&mut self, magnitude: u32) -> Result<(), BridgeError> {
        const FULL: u32 = Duty::FULL.to_q15().unsigned_abs();
        // At most 65 535 · 32 767, which fits; at most the highest duty after the division.
        let product = u32::from(self.pwm.max_duty_cycle()) * magnitude.min(FULL);
        let duty = u16::try_from(product / FULL).unwrap_or(0);
        self.pwm.set_duty_cycle(duty).map_err(|_| BridgeError::Pwm)
    }
}

#[cfg(test)]
mod tests {
    use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction as Level};
    use embedded_hal_mock::eh1::pwm::{Mock as Pwm, Transaction as Cycle};

    use super::*;

    const MAX: u16 = 4_250;

    /// Applies an output to a bridge that was just made, and checks every write to its inputs.
    fn check(output: Output, cycle: u16, direction: Option<State>, awake: State) {
        let writes = [
            Cycle::max_duty_cycle(MAX),
            Cycle::set_duty_cycle(0),
            Cycle::max_duty_cycle(MAX),
            Cycle::set_duty_cycle(cycle),
        ];
        let mut pwm = Pwm::new(&writes);
        let direction: Option<Level> = direction.map(Level::set);
        let mut direction = Pin::new(direction.iter());
        let mut wake = Pin::new(&[Level::set(State::Low), Level::set(awake)]);
        let mut bridge = Bridge::new(pwm.clone(), direction.clone(), wake.clone()).unwrap();
        bridge.apply(output).unwrap();
        pwm.done();
        direction.done();
        wake.done();
    }

    #[test]
    fn sleeps_when_off() {
        check(Output::Off, 0, None, State::Low);
    }

    #[test]
    fn shorts_the_motor_when_braking() {
        check(Output::Brake, 0, None, State::High);
    }

    #[test]
    fn drives_with_sign_and_magnitude() {
        let half = Duty::from_q15(16_384);
        check(Output::Duty(half), 2_125, Some(State::High), State::High);
        check(Output::Duty(-half), 2_125, Some(State::Low), State::High);
    }

    #[test]
    fn never_asks_for_more_than_full_voltage() {
        check(
            Output::Duty(Duty::FULL),
            MAX,
            Some(State::High),
            State::High,
        );
        check(Output::Duty(Duty::MAX), MAX, Some(State::High), State::High);
        check(
            Output::Duty(Duty::from_q15(i32::MIN)),
            MAX,
            Some(State::Low),
            State::High,
        );
    }
}
