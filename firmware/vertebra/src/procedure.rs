//! The procedures of object 0x2060: calibration step by step, and the self test.
//!
//! They run while the node is not operational and nothing is latched. What a step finds goes into the
//! settings at once, and to flash when the bus asks for it. Two of them put current on single motors, in
//! the state "test": little of it, for a short time, and never by what is to be found out.

use eel_canopen::Abort;
use eel_protocol::procedure::{Check, Progress, Reason, Step};
use eel_protocol::{Condition, State};
use eel_units::{Angle, AngularVelocity, Current, Temperature, Torque, saturate};

use crate::calibration::{Sense, Senses, wrapped};
use crate::core::Core;
use crate::encoder::Encoder;
use crate::io::{Drive, Sample, Setpoint};

/// Ticks over which a reading is averaged.
const AVERAGED: u32 = 256;
/// Most current that a sensor may read without one.
const OFFSET_WINDOW: Current = Current::from_milliamps(160);
/// How far a crank may move that is to be still.
const STILL: Angle = Angle::from_milliradians(5);
/// How far cranks 1 and 2 have to be turned by hand: farther than the stops of pitch let them, so that it
/// can only be yaw.
const TURNED: Angle = Angle::from_milliradians(330);
/// How far crank 3 has to be turned by hand.
const ROLLED: Angle = Angle::from_milliradians(40);
/// How far cranks 1 and 2 may be from home while it is.
const STRAIGHT: Angle = Angle::from_milliradians(100);
/// The bits of the leads.
const LEADS: u16 = 0b111;
/// Most difference of what two cranks, or two encoders of one, have turned.
const ALIKE: Angle = Angle::from_milliradians(150);
const AGREEING: Angle = Angle::from_milliradians(20);
/// Ticks in which that has to happen: 60 s.
const PATIENCE: u32 = 60_000;
/// Ticks of rest before a motor is turned, and in which its torque then grows to the damped torque.
const REST: u32 = 100;
const RAMP: u32 = 500;
/// Motion that shows which way a motor turns its crank.
const SHOWN: Angle = Angle::from_milliradians(10);
/// Motion of the absolute encoder with which the counter must have moved too.
const SEEN: Angle = Angle::from_milliradians(30);
/// Ticks in which the self test looks at the sensors.
const LOOK: u32 = 200;
/// Current with which it tries a bridge, and for how long each way; the second half is averaged.
const TRIED: Current = Current::from_milliamps(200);
const TRIAL: u32 = 40;
/// Current without a bridge that is no longer noise.
const IDLE: Current = Current::from_milliamps(50);
/// Least temperature that a thermistor in order reads.
const COLDEST: Temperature = Temperature::from_decidegrees(-200);
/// The steps of a whole calibration.
const WHOLE: u8 = 0b1111;

/// What hands have to do with the wrist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hands {
    /// Turn it to positive yaw, by 22° or more.
    Yaw,
    /// Turn it to positive roll from straight, by 3° or more.
    Roll,
}

/// What is being done, and what came of it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Procedure {
    step: Option<Step>,
    pub progress: Progress,
    pub reason: Reason,
    /// The motor that something is wrong with, 1–3, or 0.
    pub motor: u8,
    /// The checks of the self test that were made, and those that failed.
    pub checks: u16,
    pub failed: u16,
    /// Steps that were done since power-up, bit 0 the first.
    found: u8,
    /// Ticks since the step, or its present part, began.
    ticks: u32,
    /// Which part that is.
    part: u8,
    start: Option<Readings>,
    /// What has been found of the encoders' senses.
    senses: Senses,
    sums: [i64; 3],
}

/// What the encoders read when a step or a part of it began.
#[derive(Clone, Copy, Debug)]
struct Readings {
    counts: [i32; 3],
    angles: [Angle; 3],
}

/// How a tick of a step ended.
enum Outcome {
    Goes([Drive; 3]),
    Done,
    Failed(Reason, Option<usize>),
}

const OFF: Outcome = Outcome::Goes([Drive::Off; 3]);

impl Procedure {
    /// Tells whether a step goes on.
    #[inline]
    pub const fn is_running(&self) -> bool {
        self.step.is_some()
    }

    /// Returns what hands have to do before it can go on.
    pub fn waits_for(&self) -> Option<Hands> {
        match (self.step, self.part) {
            (Some(Step::Senses), 0) => Some(Hands::Yaw),
            (Some(Step::Senses), _) => Some(Hands::Roll),
            _ => None,
        }
    }

    /// Begins the next part of a step.
    fn next_part(&mut self) {
        self.part += 1;
        self.ticks = 0;
        self.start = None;
        self.sums = [0; 3];
    }

    /// Adds to a motor's sum, Q29 rad or µA.
    fn add(&mut self, values: [i32; 3]) {
        for (sum, value) in self.sums.iter_mut().zip(values) {
            *sum += i64::from(value);
        }
    }

    fn mean(&self, over: u32) -> [i32; 3] {
        self.sums.map(|sum| saturate(sum / i64::from(over.max(1))))
    }

    /// Notes the outcome of a check.
    fn check(&mut self, check: Check, passed: bool) {
        self.checks |= check.mask();
        if !passed {
            self.failed |= check.mask();
        }
    }
}

impl Core {
    /// Tells whether the encoders' zeros and senses are not known, or about to be found.
    pub fn is_being_calibrated(&self) -> bool {
        !self.is_calibrated
            || matches!(
                self.procedure.step,
                Some(Step::Home | Step::Senses | Step::Leads)
            )
    }

    /// Takes what is written to 0x2060:1: the number of a step, or 0 to end one.
    pub fn order_procedure(&mut self, code: u8) -> Result<(), Abort> {
        let Some(step) = Step::from_code(code) else {
            if self.procedure.step.is_some() {
                self.end_procedure(Progress::Failed, Reason::Ended, None);
            }
            return Ok(());
        };
        let is_busy = self.procedure.step.is_some() || self.operational;
        if is_busy || self.machine.state().is_latched() {
            return Err(Abort::DeviceState);
        }
        let is_powered = matches!(step, Step::Leads | Step::Test);
        if self.machine.may_carry_current(self.now)
            || (is_powered && !self.machine.begin_test(self.now))
        {
            return Err(Abort::DeviceState);
        }
        self.procedure = Procedure {
            step: Some(step),
            progress: Progress::Running,
            found: self.procedure.found,
            ..Procedure::default()
        };
        Ok(())
    }

    /// Goes on with the step that was ordered, and says what the bridges do where that is the step's to
    /// say, in the senses of the bridges themselves.
    #[cold]
    #[inline(never)]
    pub fn proceed(&mut self, raw: &Sample, drives: &mut [Drive; 3]) {
        let Some(step) = self.procedure.step else {
            return;
        };
        let is_testing = self.machine.state() == State::Test;
        let is_powered = matches!(step, Step::Leads | Step::Test);
        let is_disturbed = self.operational || self.machine.state().is_latched();
        if is_disturbed || is_powered != is_testing {
            self.end_procedure(Progress::Failed, Reason::Stopped, None);
            return;
        }
        self.procedure.ticks += 1;
        let outcome = match step {
            Step::Offsets => self.find_offsets(raw),
            Step::Home => self.find_home(raw),
            Step::Senses => self.find_senses(raw),
            Step::Leads => self.find_leads(raw),
            Step::Test => self.test_itself(raw),
        };
        match outcome {
            Outcome::Goes(wanted) if is_testing => *drives = wanted,
            Outcome::Goes(_) => {}
            Outcome::Done => self.finish(step),
            Outcome::Failed(reason, motor) => {
                self.end_procedure(Progress::Failed, reason, motor);
            }
        }
    }

    /// Ends a step that came to its end: what it found holds from now on.
    fn finish(&mut self, step: Step) {
        self.end_procedure(Progress::Done, Reason::None, None);
        if step == Step::Test {
            return;
        }
        self.procedure.found |= 1 << (step as u8 - 1);
        if self.procedure.found == WHOLE {
            self.settings.calibration.serial = self.settings.serial;
        }
        self.prepare();
        // The angles that were known are those of another calibration.
        self.encoders = [Encoder::new(&self.settings.motor); 3];
    }

    fn end_procedure(&mut self, progress: Progress, reason: Reason, motor: Option<usize>) {
        self.procedure.step = None;
        self.procedure.progress = progress;
        self.procedure.reason = reason;
        self.procedure.motor = motor.map_or(0, |motor| motor as u8 + 1);
        self.machine.end_test(self.now);
    }

    fn find_offsets(&mut self, raw: &Sample) -> Outcome {
        self.procedure.add(raw.current.map(Current::to_microamps));
        if self.procedure.ticks < AVERAGED {
            return OFF;
        }
        let mean = self.procedure.mean(AVERAGED).map(Current::from_microamps);
        if let Some(motor) = mean.iter().position(|mean| mean.abs() > OFFSET_WINDOW) {
            return Outcome::Failed(Reason::Offset, Some(motor));
        }
        self.settings.calibration.offset = mean;
        Outcome::Done
    }

    fn find_home(&mut self, raw: &Sample) -> Outcome {
        let (start, turned, _) = match self.turned(raw) {
            Ok(found) => found,
            Err(motor) => return Outcome::Failed(Reason::Encoder, Some(motor)),
        };
        if let Some(motor) = turned.iter().position(|turned| turned.abs() > STILL) {
            return Outcome::Failed(Reason::Moved, Some(motor));
        }
        self.procedure.add(turned.map(Angle::to_q29));
        if self.procedure.ticks < AVERAGED {
            return OFF;
        }
        let mean = self.procedure.mean(AVERAGED).map(Angle::from_q29);
        let zeros = self.settings.calibration.zero.iter_mut();
        for ((zero, start), mean) in zeros.zip(start.angles).zip(mean) {
            *zero = wrapped(start + mean, Angle::ZERO);
        }
        Outcome::Done
    }

    /// Watches yaw first, which turns cranks 1 and 2, then roll with the wrist straight, which turns crank
    /// 3: farther from home, yaw would turn that as well.
    fn find_senses(&mut self, raw: &Sample) -> Outcome {
        let (start, turned, counted) = match self.turned(raw) {
            Ok(found) => found,
            Err(motor) => return Outcome::Failed(Reason::Encoder, Some(motor)),
        };
        let mut homes = start.angles.into_iter().zip(self.settings.calibration.zero);
        if let Some(motor) = homes.position(|(angle, zero)| wrapped(angle, zero).abs() > STRAIGHT) {
            return Outcome::Failed(Reason::Moved, Some(motor));
        }
        let [one, two, three] = turned.map(Angle::abs);
        let is_yawed = one >= TURNED && two >= TURNED;
        let is_rolled = one <= STRAIGHT && two <= STRAIGHT && three >= ROLLED;
        let found = match self.procedure.part {
            0 if is_yawed => 0..2,
            1 if is_rolled => 2..3,
            part if self.procedure.ticks >= PATIENCE => {
                let lacking = if part == 1 {
                    2
                } else {
                    usize::from(one >= TURNED)
                };
                return Outcome::Failed(Reason::Timeout, Some(lacking));
            }
            _ => return OFF,
        };
        if is_yawed && (one - two).abs() > ALIKE {
            return Outcome::Failed(Reason::Motion, None);
        }
        let all = turned.into_iter().zip(counted).enumerate();
        for (motor, (turned, counted)) in all.filter(|(motor, _)| found.contains(motor)) {
            if (turned.abs() - counted.abs()).abs() > AGREEING {
                return Outcome::Failed(Reason::Disagree, Some(motor));
            }
            let senses = &mut self.procedure.senses;
            *senses = senses.with(Sense::Crank, motor, turned < Angle::ZERO).with(
                Sense::Counter,
                motor,
                counted < Angle::ZERO,
            );
        }
        if self.procedure.part == 0 {
            // What was at home stays the reference.
            self.procedure.part = 1;
            return OFF;
        }
        let senses = &mut self.settings.calibration.senses;
        let leads = Senses::from_bits(senses.to_bits() & LEADS);
        *senses = Senses::from_bits(self.procedure.senses.to_bits() | leads.to_bits());
        Outcome::Done
    }

    fn find_leads(&mut self, raw: &Sample) -> Outcome {
        let motor = usize::from(self.procedure.part);
        let Some(grown) = self.procedure.ticks.checked_sub(REST) else {
            return OFF;
        };
        let (_, turned, counted) = match self.turned(raw) {
            Ok(found) => found,
            Err(motor) => return Outcome::Failed(Reason::Encoder, Some(motor)),
        };
        let read = |all: [Angle; 3]| all.get(motor).copied().unwrap_or_default();
        let (turned, counted) = (read(turned), read(counted));
        if counted.abs() >= SHOWN {
            let senses = &mut self.settings.calibration.senses;
            let is_up = (counted > Angle::ZERO) != senses.is_reversed(Sense::Counter, motor);
            *senses = senses.with(Sense::Leads, motor, !is_up);
            self.procedure.next_part();
            return if motor == 2 { Outcome::Done } else { OFF };
        }
        if turned.abs() >= SEEN {
            return Outcome::Failed(Reason::Disagree, Some(motor));
        }
        if grown > RAMP {
            return Outcome::Failed(Reason::Still, Some(motor));
        }
        let peak = i64::from(self.settings.limits.damped_torque.to_q24());
        let torque = saturate(peak * i64::from(grown) / i64::from(RAMP));
        let torque = Torque::from_q24(torque);
        let current = self
            .electrical
            .setpoint(torque, AngularVelocity::ZERO)
            .current;
        Outcome::Goes(self.single(motor, current))
    }

    /// Returns drives that put a current on one motor, without feed-forward of its speed.
    fn single(&self, motor: usize, current: Current) -> [Drive; 3] {
        let mut drives = [Drive::Off; 3];
        let offset = self.settings.calibration.offset.get(motor).copied();
        if let Some(drive) = drives.get_mut(motor) {
            *drive = Drive::Current(Setpoint {
                current: current + offset.unwrap_or_default(),
                ..Setpoint::default()
            });
        }
        drives
    }

    fn test_itself(&mut self, raw: &Sample) -> Outcome {
        if self.procedure.part == 0 {
            return self.test_sensors(raw);
        }
        // Parts 1 to 6: each motor, forward and backward.
        let part = usize::from(self.procedure.part - 1);
        let (motor, is_forward) = (part / 2, part.is_multiple_of(2));
        let wanted = if is_forward { TRIED } else { -TRIED };
        let offset = self.settings.calibration.offset;
        let read = |values: [Current; 3]| values.get(motor).copied().unwrap_or_default();
        if self.procedure.ticks > TRIAL / 2 {
            let current = read(raw.current) - read(offset);
            self.procedure.add([current.to_microamps(), 0, 0]);
        }
        if self.procedure.ticks < TRIAL {
            return Outcome::Goes(self.single(motor, wanted));
        }
        let [mean, ..] = self.procedure.mean(TRIAL / 2).map(Current::from_microamps);
        let window = Current::from_microamps(TRIED.to_microamps() / 5);
        let passed = (mean - wanted).abs() <= window;
        self.procedure.check(Check::Bridges, passed);
        if part < 5 && passed {
            self.procedure.next_part();
            return OFF;
        }
        if self.procedure.failed == 0 {
            return Outcome::Done;
        }
        Outcome::Failed(Reason::Checks, (!passed).then_some(motor))
    }

    /// Looks at the sensors for a while, the bridges off, then at everything else.
    fn test_sensors(&mut self, raw: &Sample) -> Outcome {
        let mut seen = *raw;
        self.correction.apply(&mut seen);
        let is_valid = raw.absolute.iter().all(Option::is_some);
        self.procedure.check(Check::Absolute, is_valid);
        let mut both = seen.absolute.into_iter().zip(self.encoders.each_ref());
        let agrees = both.all(|(absolute, encoder)| {
            let apart = absolute.map(|angle| (angle - encoder.angle()).abs());
            apart.is_some_and(|apart| apart <= STILL)
        });
        self.procedure.check(Check::Noise, agrees);
        self.procedure.add(seen.current.map(Current::to_microamps));
        if self.procedure.ticks < LOOK {
            return OFF;
        }
        let mean = self.procedure.mean(LOOK).map(Current::from_microamps);
        let holds = |condition| self.status.contains(condition);
        let limits = &self.settings.limits;
        let is_warm = |value: Temperature, end: Temperature| value > COLDEST && value < end;
        let outcomes = [
            (Check::Settings, !holds(Condition::Settings)),
            (Check::Calibration, !holds(Condition::Calibration)),
            (
                Check::Residual,
                self.has_pose && !holds(Condition::Residual),
            ),
            (Check::Offsets, mean.iter().all(|mean| mean.abs() <= IDLE)),
            (Check::Supply, !holds(Condition::Voltage)),
            (
                Check::Temperatures,
                is_warm(raw.board_temperature, limits.board_hot.start)
                    && raw
                        .motor_temperature
                        .iter()
                        .all(|value| is_warm(*value, limits.motor_hot.start)),
            ),
            (
                Check::Lines,
                !holds(Condition::Bridge) && !holds(Condition::EmergencyStop),
            ),
        ];
        for (check, passed) in outcomes {
            self.procedure.check(check, passed);
        }
        // No current on motors that something else is wrong with.
        if self.procedure.failed != 0 {
            return Outcome::Failed(Reason::Checks, None);
        }
        self.procedure.next_part();
        OFF
    }

    /// Returns what the encoders read when this began, and how far crank encoders and counters have
    /// turned since, each in its own sense; a motor whose absolute encoder gives nothing is the error.
    fn turned(&mut self, raw: &Sample) -> Result<(Readings, [Angle; 3], [Angle; 3]), usize> {
        let mut angles = [Angle::ZERO; 3];
        for (motor, (to, absolute)) in angles.iter_mut().zip(raw.absolute).enumerate() {
            *to = absolute.ok_or(motor)?;
        }
        let now = Readings {
            counts: raw.encoder_counts,
            angles,
        };
        let start = *self.procedure.start.get_or_insert(now);
        let (mut turned, mut counted) = ([Angle::ZERO; 3], [Angle::ZERO; 3]);
        let pairs = now.angles.into_iter().zip(start.angles);
        for (to, (now, start)) in turned.iter_mut().zip(pairs) {
            *to = wrapped(now, start);
        }
        let pairs = now.counts.into_iter().zip(start.counts);
        for (to, (now, start)) in counted.iter_mut().zip(pairs) {
            *to = Encoder::angle_of(&self.settings.motor, now.wrapping_sub(start));
        }
        Ok((start, turned, counted))
    }
}
