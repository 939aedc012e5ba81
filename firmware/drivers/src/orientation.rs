//! Which way a motor and its encoders count, as they are built in.

use eel_units::{Angle, Current};

use crate::Output;

/// Which way something counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mounting {
    /// Up with the crank's positive sense.
    Direct,
    /// Down with it.
    Reversed,
}

/// How one motor and its two encoders are built in.
///
/// Everything with a sign passes through it on its way to the motor or from it, so that the rest of
/// the program knows only the crank's positive sense. A motor whose gear turns the other way has
/// reversed leads and a reversed quadrature encoder; one whose encoder's two lines are exchanged has
/// only the latter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orientation {
    /// The motor's leads: the sense of its voltage and of the current measured in line with it.
    pub leads: Mounting,
    /// The quadrature encoder on the motor.
    pub quadrature: Mounting,
    /// The absolute encoder on the crank.
    pub crank: Mounting,
}

impl Orientation {
    /// Nothing is reversed.
    pub const DIRECT: Self = Self {
        leads: Mounting::Direct,
        quadrature: Mounting::Direct,
        crank: Mounting::Direct,
    };

    /// Returns what the bridge is to do so that the motor does `output`.
    pub fn output(self, output: Output) -> Output {
        match (self.leads, output) {
            (Mounting::Reversed, Output::Duty(duty)) => Output::Duty(-duty),
            (_, output) => output,
        }
    }

    /// Returns the current that is positive with positive torque, of the one measured.
    pub fn current(self, measured: Current) -> Current {
        match self.leads {
            Mounting::Direct => measured,
            Mounting::Reversed => -measured,
        }
    }

    /// Returns the count that is positive with the motor's angle, of the one counted; wraps.
    pub const fn count(self, counted: i32) -> i32 {
        match self.quadrature {
            Mounting::Direct => counted,
            Mounting::Reversed => counted.wrapping_neg(),
        }
    }

    /// Returns the crank's angle, of the one read.
    pub fn angle(self, read: Angle) -> Angle {
        match self.crank {
            Mounting::Direct => read,
            Mounting::Reversed => -read,
        }
    }
}

#[cfg(test)]
mod tests {
    use eel_units::Duty;

    use super::*;

    const OPTIONS: [Mounting; 2] = [Mounting::Direct, Mounting::Reversed];

    /// A motor as a builder may have built it in, by its own physics: what the bridge does makes a
    /// current and motion of the crank, which the sensors see in their own senses.
    struct Built {
        leads: i32,
        quadrature: i32,
        crank: i32,
    }

    impl Built {
        fn new(orientation: Orientation) -> Self {
            let sign = |mounting| if mounting == Mounting::Direct { 1 } else { -1 };
            Self {
                leads: sign(orientation.leads),
                quadrature: sign(orientation.quadrature),
                crank: sign(orientation.crank),
            }
        }

        /// Returns the torque's sign, then what the current sensor and both encoders see.
        fn turn(&self, output: Output) -> (i32, i32, i32, i32) {
            let Output::Duty(duty) = output else {
                return (0, 0, 0, 0);
            };
            let voltage = duty.to_q15().signum();
            let torque = voltage * self.leads;
            (
                torque,
                voltage,
                torque * self.quadrature,
                torque * self.crank,
            )
        }
    }

    #[test]
    fn positive_duty_makes_everything_positive_however_a_motor_is_built_in() {
        for leads in OPTIONS {
            for quadrature in OPTIONS {
                for crank in OPTIONS {
                    let orientation = Orientation {
                        leads,
                        quadrature,
                        crank,
                    };
                    for sign in [1, -1] {
                        let output = Output::Duty(Duty::from_q15(sign * 1_000));
                        let (torque, current, count, angle) =
                            Built::new(orientation).turn(orientation.output(output));
                        assert_eq!(torque, sign, "{orientation:?}");
                        let current = orientation.current(Current::from_microamps(current));
                        assert_eq!(current, Current::from_microamps(sign), "{orientation:?}");
                        assert_eq!(orientation.count(count), sign, "{orientation:?}");
                        let angle = orientation.angle(Angle::from_q29(angle));
                        assert_eq!(angle, Angle::from_q29(sign), "{orientation:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_reversed_motor_brakes_and_rests_like_any_other() {
        let reversed = Orientation {
            leads: Mounting::Reversed,
            ..Orientation::DIRECT
        };
        for output in [Output::Off, Output::Brake] {
            assert_eq!(reversed.output(output), output);
        }
    }

    #[test]
    fn a_reversed_count_goes_on_where_it_wraps() {
        let reversed = Orientation {
            quadrature: Mounting::Reversed,
            ..Orientation::DIRECT
        };
        let step = reversed
            .count(i32::MIN)
            .wrapping_sub(reversed.count(i32::MAX));
        assert_eq!(step, -1);
    }
}
