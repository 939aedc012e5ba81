//! What may be wrong with a vertebra's hardware: sensors, bridges, mechanics.
//!
//! A defect stays from the moment in which it comes. Motors are 0–2 here, as everywhere in the program.

use eel_units::{Angle, Current, Temperature};
use eel_vertebra::{Drive, Sample};

/// Damping of a jammed crank, N·m·s/rad: under all that a motor can give it creeps by 4 µrad/s.
const JAM: f64 = 1e6;

/// One thing that is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// A crank's absolute encoder gives no valid angle.
    CrankSilent(usize),
    /// A crank's absolute encoder reads the same angle for ever.
    CrankFrozen(usize),
    /// A crank's absolute encoder has slipped on its shaft by so many mrad.
    CrankSlipped(usize, i32),
    /// A motor's counter no longer counts.
    CounterFrozen(usize),
    /// A motor's counter has jumped by so many counts.
    CounterJumped(usize, i32),
    /// A motor's current reads too much by so many mA, for the current loop and the vertebra alike.
    CurrentOffset(usize, i32),
    /// A bridge has switched itself off and says so.
    BridgeFault(usize),
    /// A bridge no longer switches anything and says nothing.
    BridgeDead(usize),
    /// A crank is blocked.
    Jammed(usize),
    /// The board is so hot, in °C.
    BoardHot(i32),
    /// A motor's housing is so hot, in °C.
    MotorHot(usize, i32),
    /// The emergency stop line is open.
    EmergencyStop,
}

impl Defect {
    /// Returns the motor that it is of; `None` where it is of the whole vertebra.
    pub const fn motor(self) -> Option<usize> {
        match self {
            Self::CrankSilent(motor)
            | Self::CrankFrozen(motor)
            | Self::CrankSlipped(motor, _)
            | Self::CounterFrozen(motor)
            | Self::CounterJumped(motor, _)
            | Self::CurrentOffset(motor, _)
            | Self::BridgeFault(motor)
            | Self::BridgeDead(motor)
            | Self::Jammed(motor)
            | Self::MotorHot(motor, _) => Some(motor),
            Self::BoardHot(_) | Self::EmergencyStop => None,
        }
    }
}

/// Everything that is wrong with one vertebra.
#[derive(Clone, Debug, Default)]
pub struct Defects {
    present: Vec<Defect>,
    /// What was measured when the first one came.
    before: Option<Sample>,
    last: Option<Sample>,
}

impl Defects {
    /// Adds one.
    pub fn add(&mut self, defect: Defect) {
        self.before = self.before.or(self.last);
        self.present.push(defect);
    }

    /// Returns what bridges do that are told `drives`.
    pub fn driven(&self, mut drives: [Drive; 3]) -> [Drive; 3] {
        for defect in &self.present {
            if let Defect::BridgeFault(motor) | Defect::BridgeDead(motor) = *defect {
                drives[motor] = Drive::Off;
            }
        }
        drives
    }

    /// Returns what each motor's crank is held back by, N·m·s/rad.
    pub fn damping(&self) -> [f64; 3] {
        std::array::from_fn(|motor| {
            let is_jammed = self.present.contains(&Defect::Jammed(motor));
            if is_jammed { JAM } else { 0.0 }
        })
    }

    /// Returns what each current reads too much, A.
    pub fn current_error_a(&self) -> [f64; 3] {
        let mut errors = [0.0; 3];
        for defect in &self.present {
            if let Defect::CurrentOffset(motor, milliamps) = *defect {
                errors[motor] += f64::from(milliamps) / 1e3;
            }
        }
        errors
    }

    /// Makes of what is there what is measured.
    pub fn spoil(&mut self, mut sample: Sample) -> Sample {
        self.last = Some(sample);
        let before = self.before.unwrap_or(sample);
        for defect in &self.present {
            match *defect {
                Defect::CrankSilent(motor) => sample.absolute[motor] = None,
                Defect::CrankFrozen(motor) => sample.absolute[motor] = before.absolute[motor],
                Defect::CrankSlipped(motor, by) => {
                    let slip = Angle::from_milliradians(by);
                    sample.absolute[motor] = sample.absolute[motor].map(|angle| angle + slip);
                }
                Defect::CounterFrozen(motor) => {
                    sample.encoder_counts[motor] = before.encoder_counts[motor];
                }
                Defect::CounterJumped(motor, by) => {
                    sample.encoder_counts[motor] = sample.encoder_counts[motor].wrapping_add(by);
                }
                Defect::CurrentOffset(motor, by) => {
                    sample.current[motor] += Current::from_milliamps(by);
                }
                Defect::BridgeFault(motor) => sample.bridge_fault[motor] = true,
                Defect::BridgeDead(_) | Defect::Jammed(_) => {}
                Defect::BoardHot(celsius) => sample.board_temperature = degrees(celsius),
                Defect::MotorHot(motor, celsius) => {
                    sample.motor_temperature[motor] = degrees(celsius);
                }
                Defect::EmergencyStop => sample.emergency_stop = true,
            }
        }
        sample
    }
}

const fn degrees(celsius: i32) -> Temperature {
    Temperature::from_decidegrees(celsius * 10)
}
