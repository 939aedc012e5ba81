//! How the motors and encoders of one vertebra are built in: senses, zeros, offsets.
//!
//! Everything with a sign passes through here on its way from the sensors and to the bridges, so that the
//! rest of the crate knows only the crank's positive sense. A motor whose gear turns the other way has
//! reversed leads and a reversed counter; one whose encoder's two lines are exchanged has only the latter.

use eel_kinematics::Joints;
use eel_units::{Angle, Current, Voltage};

use crate::io::{Drive, Sample, Setpoint};

/// A turn in Q29 rad.
const TURN: i64 = 3_373_259_426;
/// Angles of the cranks at home.
pub(crate) const HOME: [Angle; 3] = Joints::HOME.0;

/// What counts down where the crank turns up; bit 0 is motor 1's leads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Senses(u16);

/// What may be reversed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sense {
    /// The motor's leads: the sense of its voltage, and of the current measured in line with it.
    Leads = 0,
    /// The counter on the motor.
    Counter = 3,
    /// The absolute encoder on the crank.
    Crank = 6,
}

impl Senses {
    /// The bits that mean something.
    const ALL: u16 = 0x1FF;

    /// Reads the bits; those without a meaning are dropped.
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits & Self::ALL)
    }

    /// Returns the bits.
    pub const fn to_bits(self) -> u16 {
        self.0
    }

    /// Tells whether something of motor 0–2 is reversed.
    pub const fn is_reversed(self, sense: Sense, motor: usize) -> bool {
        self.0 & Self::mask(sense, motor) != 0
    }

    /// Returns the senses with something reversed, or not.
    #[must_use]
    pub const fn with(self, sense: Sense, motor: usize, reversed: bool) -> Self {
        let mask = Self::mask(sense, motor);
        if reversed {
            Self(self.0 | mask)
        } else {
            Self(self.0 & !mask)
        }
    }

    /// Returns −1 where something is reversed, else 1.
    const fn sign(self, sense: Sense, motor: usize) -> i32 {
        if self.is_reversed(sense, motor) {
            -1
        } else {
            1
        }
    }

    const fn mask(sense: Sense, motor: usize) -> u16 {
        // A fourth motor has no bit.
        (1_u16 << (sense as u16)).wrapping_shl(motor as u32) & Self::ALL
    }
}

/// What was found out about one vertebra.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Calibration {
    /// The serial number of the vertebra that it was made for; 0 for none.
    pub serial: u32,
    /// What each crank's encoder reads while the wrist is at home.
    pub zero: [Angle; 3],
    /// What each current sensor reads without a current.
    pub offset: [Current; 3],
    /// What is reversed.
    pub senses: Senses,
}

impl Calibration {
    /// Made for none: nothing is reversed, nothing is off, and the encoders read the cranks' angles.
    pub const NONE: Self = Self::ideal(0);

    /// Returns what a vertebra has that was built and set up perfectly.
    pub const fn ideal(serial: u32) -> Self {
        Self {
            serial,
            zero: HOME,
            offset: [Current::ZERO; 3],
            senses: Senses(0),
        }
    }
}

/// A calibration made ready for the control tick: signs of ±1 instead of bits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Correction {
    motors: [Signs; 3],
}

/// What of one motor is reversed and off.
#[derive(Clone, Copy, Debug)]
struct Signs {
    counter: i32,
    crank: i32,
    leads: i32,
    zero: Angle,
    /// What is beyond these has turned on past half a turn from zero.
    low: Angle,
    high: Angle,
    home: Angle,
    offset: Current,
}

impl Correction {
    /// Makes it ready.
    pub const fn new(calibration: &Calibration) -> Self {
        let senses = calibration.senses;
        let [one, two, three] = calibration.zero;
        let [a, b, c] = calibration.offset;
        let [x, y, z] = HOME;
        Self {
            motors: [
                Signs::new(senses, 0, (one, x, a)),
                Signs::new(senses, 1, (two, y, b)),
                Signs::new(senses, 2, (three, z, c)),
            ],
        }
    }

    /// Makes what is measured what it is in the senses of the cranks.
    #[inline]
    pub fn apply(&self, sample: &mut Sample) {
        let counts = sample.encoder_counts.iter_mut();
        let measured = counts.zip(&mut sample.absolute).zip(&mut sample.current);
        for (((count, absolute), current), signs) in measured.zip(&self.motors) {
            *count = count.wrapping_mul(signs.counter);
            if let Some(angle) = absolute {
                // As wrapped() does, in 32 bits, where the sum may leave them and come back.
                let turn = if *angle > signs.high {
                    -TURN
                } else if *angle < signs.low {
                    TURN
                } else {
                    0
                };
                let turned = angle
                    .to_q29()
                    .wrapping_sub(signs.zero.to_q29())
                    .wrapping_add(turn as i32);
                *angle = signs.home + Angle::from_q29(turned.wrapping_mul(signs.crank));
            }
            let through = (*current - signs.offset).to_microamps();
            *current = Current::from_microamps(through.wrapping_mul(signs.leads));
        }
    }

    /// Makes what the motors are to do what the bridges are told.
    #[inline]
    pub fn turn(&self, drives: &mut [Drive; 3]) {
        for (drive, signs) in drives.iter_mut().zip(&self.motors) {
            if let Drive::Current(Setpoint { current, emf }) = drive {
                let wanted = current.to_microamps().wrapping_mul(signs.leads);
                *current = Current::from_microamps(wanted) + signs.offset;
                *emf = Voltage::from_millivolts(emf.to_millivolts().wrapping_mul(signs.leads));
            }
        }
    }
}

impl Signs {
    const fn new(senses: Senses, motor: usize, known: (Angle, Angle, Current)) -> Self {
        let (zero, home, offset) = known;
        Self {
            counter: senses.sign(Sense::Counter, motor),
            crank: senses.sign(Sense::Crank, motor),
            leads: senses.sign(Sense::Leads, motor),
            zero,
            low: Angle::from_q29(eel_units::saturate(zero.to_q29() as i64 - TURN / 2)),
            high: Angle::from_q29(eel_units::saturate(zero.to_q29() as i64 + TURN / 2)),
            home,
            offset,
        }
    }
}

/// Returns how far an encoder has turned from a reading, within half a turn.
#[inline]
pub(crate) fn wrapped(angle: Angle, from: Angle) -> Angle {
    let turned = i64::from(angle.to_q29()) - i64::from(from.to_q29());
    let half = TURN / 2;
    let turned = if turned > half {
        turned - TURN
    } else if turned < -half {
        turned + TURN
    } else {
        turned
    };
    // Readings are within a turn, or nonsense that saturates.
    Angle::from_q29(eel_units::saturate(turned))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSES: [Sense; 3] = [Sense::Leads, Sense::Counter, Sense::Crank];

    /// A motor as a builder may have built it in, by its own physics: what the bridge does makes a
    /// current and a motion of the crank, which the sensors see in their own senses.
    struct Built {
        senses: Senses,
        zero: Angle,
        offset: Current,
    }

    impl Built {
        fn sign(&self, sense: Sense) -> i32 {
            if self.senses.is_reversed(sense, 1) {
                -1
            } else {
                1
            }
        }

        /// Returns what its sensors read after the crank has turned from home under a current.
        fn read(&self, turned: Angle, counts: i32, current: Current) -> (i32, Angle, Current) {
            let crank = if self.sign(Sense::Crank) < 0 {
                -turned
            } else {
                turned
            };
            let read = i64::from(self.zero.to_q29()) + i64::from(crank.to_q29());
            let read = (read + TURN / 2).rem_euclid(TURN) - TURN / 2;
            let read = Angle::from_q29(read as i32);
            let current = if self.sign(Sense::Leads) < 0 {
                -current
            } else {
                current
            };
            (
                counts * self.sign(Sense::Counter),
                read,
                current + self.offset,
            )
        }
    }

    fn sample(count: i32, absolute: Angle, current: Current) -> Sample {
        Sample {
            encoder_counts: [0, count, 0],
            absolute: [None, Some(absolute), None],
            current: [Current::ZERO, current, Current::ZERO],
            supply: Voltage::from_millivolts(24_000),
            board_temperature: Default::default(),
            motor_temperature: Default::default(),
            bridge_fault: [false; 3],
            over_current: [false; 3],
            sync_age: None,
            chain_in: true,
            emergency_stop: false,
        }
    }

    #[test]
    fn however_a_motor_is_built_in_its_crank_turns_and_reads_in_the_positive_sense() {
        for bits in 0..8_u16 {
            for zero in [-3_100, -1_500, 0, 785, 3_120] {
                let mut senses = Senses::default();
                for (bit, sense) in SENSES.into_iter().enumerate() {
                    senses = senses.with(sense, 1, bits & (1 << bit) != 0);
                }
                let (zero, offset) = (Angle::from_milliradians(zero), Current::from_milliamps(-37));
                let built = Built {
                    senses,
                    zero,
                    offset,
                };
                let calibration = Calibration {
                    serial: 1,
                    zero: [Angle::ZERO, zero, Angle::ZERO],
                    offset: [Current::ZERO, offset, Current::ZERO],
                    senses,
                };
                let (turned, current) =
                    (Angle::from_milliradians(400), Current::from_milliamps(900));
                let (count, absolute, measured) = built.read(turned, 5_600, current);
                let correction = Correction::new(&calibration);
                let mut seen = sample(count, absolute, measured);
                correction.apply(&mut seen);
                assert_eq!(seen.encoder_counts, [0, 5_600, 0]);
                assert_eq!(seen.current[1], current);
                let error = seen.absolute[1].unwrap() - (HOME[1] + turned);
                assert!(
                    error.abs() <= Angle::from_q29(4),
                    "{bits:03b} {zero:?}: {error:?}"
                );
                // What the bridge holds at the sensor is the current that was meant.
                let emf = Voltage::from_millivolts(700);
                let mut drives = [Drive::Current(Setpoint { current, emf }); 3];
                correction.turn(&mut drives);
                let [_, told, _] = drives;
                let Drive::Current(told) = told else {
                    panic!("{told:?}");
                };
                assert_eq!(told.current, measured);
                assert_eq!(
                    told.emf.to_millivolts() < 0,
                    senses.is_reversed(Sense::Leads, 1)
                );
            }
        }
    }

    #[test]
    fn an_ideal_vertebra_is_left_as_it_is() {
        let seen = sample(
            -7,
            Angle::from_milliradians(-900),
            Current::from_milliamps(3),
        );
        let ideal = Correction::new(&Calibration::ideal(9));
        let mut corrected = seen;
        ideal.apply(&mut corrected);
        assert_eq!(corrected, seen);
        let drives = [
            Drive::Off,
            Drive::Brake,
            Drive::Current(Setpoint::default()),
        ];
        let mut turned = drives;
        ideal.turn(&mut turned);
        assert_eq!(turned, drives);
    }

    #[test]
    fn a_reversed_count_goes_on_where_it_wraps() {
        let mut calibration = Calibration::NONE;
        calibration.senses = calibration.senses.with(Sense::Counter, 1, true);
        let count = |raw| {
            let mut seen = sample(raw, Angle::ZERO, Current::ZERO);
            Correction::new(&calibration).apply(&mut seen);
            seen.encoder_counts[1]
        };
        assert_eq!(count(i32::MIN).wrapping_sub(count(i32::MAX)), -1);
    }
}
