//! The vertebra's part of the object dictionary: reading and writing each field.

use eel_canopen::{Abort, Application, Entry};
use eel_protocol::PoseReport;
use eel_protocol::dictionary::{self, Field};
use eel_units::{Angle, AngularVelocity, Duration, Instant, Temperature, Torque};

use crate::core::Core;
use crate::impedance::Impedance;
use crate::io::Sample;

/// Microradians in a radian.
const MICRO: i64 = 1_000_000;
/// The one architecture that the kernel serves: parallel actuators.
const PARALLEL_ACTUATORS: i64 = 3;
/// Length of a rod of the prototype in µm.
const PROTOTYPE_SCALE_UM: i64 = 40_000;

/// The bytes of object 0x2000 as they were written.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ReceivedTarget {
    angles: [i16; 3],
    code: u8,
    crc: u8,
}

/// Counters that the platform or the node keeps, object 0x2030.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counters {
    pub receive_overruns: u32,
    pub transmit_overruns: u32,
}

/// How long a turn takes and how SYNC lies, object 0x2040.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Timing {
    loop_last: Duration,
    loop_max: Duration,
    last_sync: Option<Instant>,
    sync_period_us: i64,
    sync_phase_us: i64,
}

impl ReceivedTarget {
    /// Returns the frame's bytes.
    pub fn to_bytes(self) -> [u8; 8] {
        let [y, p, r] = self.angles.map(i16::to_le_bytes);
        [y[0], y[1], p[0], p[1], r[0], r[1], self.code, self.crc]
    }
}

impl Timing {
    /// Takes the time that a turn took.
    pub fn note_loop(&mut self, duration: Duration) {
        self.loop_last = duration;
        self.loop_max = self.loop_max.max(duration);
    }

    /// Takes the arrival of a SYNC and compares it with where the ones before lead it to be
    /// expected.
    pub fn note_sync(&mut self, now: Instant) {
        if let Some(last) = self.last_sync {
            let period = i64::from(now.since(last).to_micros());
            if self.sync_period_us == 0 || period > 2 * self.sync_period_us {
                self.sync_period_us = period;
            }
            self.sync_phase_us = period - self.sync_period_us;
            self.sync_period_us += self.sync_phase_us / 8;
        }
        self.last_sync = Some(now);
    }
}

impl Core {
    /// Returns the raw number of a field; too large a one is saturated where it is encoded.
    fn value(&self, field: Field) -> i64 {
        let (gains, limits) = (&self.settings.gains, &self.settings.limits);
        match field {
            Field::TargetYaw => i64::from(self.target.angles[0]),
            Field::TargetPitch => i64::from(self.target.angles[1]),
            Field::TargetRoll => i64::from(self.target.angles[2]),
            Field::TargetCode => i64::from(self.target.code),
            Field::TargetCrc => i64::from(self.target.crc),
            Field::MomentX => millis(self.received_feed.moment[0]),
            Field::MomentY => millis(self.received_feed.moment[1]),
            Field::MomentZ => millis(self.received_feed.moment[2]),
            Field::MomentStiffness => i64::from(self.received_feed.stiffness),
            Field::PoseYaw => self.pose_word(0),
            Field::PosePitch => self.pose_word(2),
            Field::PoseRoll => self.pose_word(4),
            Field::PoseCode => i64::from(self.pose_bytes[6]),
            Field::PoseCrc => i64::from(self.pose_bytes[7]),
            Field::PoseStatus => i64::from(self.status.to_bits()),
            Field::EffortMotor1 => millis(self.effort.torque[0]),
            Field::EffortMotor2 => millis(self.effort.torque[1]),
            Field::EffortMotor3 => millis(self.effort.torque[2]),
            Field::EffortLimits => i64::from(self.effort.limits()),
            Field::MotorAngle1 => microradians(self.angles()[0]),
            Field::MotorAngle2 => microradians(self.angles()[1]),
            Field::MotorAngle3 => microradians(self.angles()[2]),
            Field::AchievedX => millis(self.achieved[0]),
            Field::AchievedY => millis(self.achieved[1]),
            Field::AchievedZ => millis(self.achieved[2]),
            Field::UnallocatedX => millis(self.unallocated[0]),
            Field::UnallocatedY => millis(self.unallocated[1]),
            Field::UnallocatedZ => millis(self.unallocated[2]),
            Field::StiffnessX => i64::from(gains.stiffness[0]),
            Field::StiffnessY => i64::from(gains.stiffness[1]),
            Field::StiffnessZ => i64::from(gains.stiffness[2]),
            Field::DampingX => i64::from(gains.damping[0]),
            Field::DampingY => i64::from(gains.damping[1]),
            Field::DampingZ => i64::from(gains.damping[2]),
            Field::PeakTorque => millis(limits.peak_torque),
            Field::RangeYaw => i64::from(limits.workspace.yaw.to_tenth_milliradians()),
            Field::RangePitch => i64::from(limits.workspace.pitch.to_tenth_milliradians()),
            Field::RangeRoll => i64::from(limits.workspace.roll.to_tenth_milliradians()),
            Field::RateLimit => (i64::from(limits.rate.to_q24()) * 1_000 + (1 << 23)) >> 24,
            Field::Architecture => PARALLEL_ACTUATORS,
            Field::GeometryScale => PROTOTYPE_SCALE_UM,
            Field::Supply => self.measured(|sample| sample.supply.to_millivolts()),
            Field::BoardTemperature => self.measured(|sample| tenths(sample.board_temperature)),
            Field::MotorTemperature1 => self.measured(|sample| tenths(sample.motor_temperature[0])),
            Field::MotorTemperature2 => self.measured(|sample| tenths(sample.motor_temperature[1])),
            Field::MotorTemperature3 => self.measured(|sample| tenths(sample.motor_temperature[2])),
            Field::BadTargets => i64::from(self.stream.counters().bad),
            Field::LostTargets => i64::from(self.stream.counters().lost),
            Field::ReceiveOverruns => i64::from(self.counters.receive_overruns),
            Field::TransmitOverruns => i64::from(self.counters.transmit_overruns),
            Field::LoopLast => i64::from(self.timing.loop_last.to_micros()),
            Field::LoopMax => i64::from(self.timing.loop_max.to_micros()),
            Field::SyncPhase => self.timing.sync_phase_us,
        }
    }

    /// Returns a number of the last sample; nothing before the first.
    fn measured(&self, pick: impl Fn(&Sample) -> i32) -> i64 {
        self.sample
            .as_ref()
            .map_or(0, |sample| i64::from(pick(sample)))
    }

    fn pose_word(&self, at: usize) -> i64 {
        let bytes = &self.pose_bytes;
        let byte = |at: usize| bytes.get(at).copied().unwrap_or_default();
        i64::from(i16::from_le_bytes([byte(at), byte(at + 1)]))
    }

    /// Writes a field whose value has been held against its bounds.
    fn set(&mut self, field: Field, value: i64) -> Result<(), Abort> {
        match field {
            Field::TargetYaw => self.target.angles[0] = value as i16,
            Field::TargetPitch => self.target.angles[1] = value as i16,
            Field::TargetRoll => self.target.angles[2] = value as i16,
            Field::TargetCode => self.target.code = value as u8,
            Field::TargetCrc => self.target.crc = value as u8,
            Field::MomentX => self.received_feed.moment[0] = torque(value),
            Field::MomentY => self.received_feed.moment[1] = torque(value),
            Field::MomentZ => self.received_feed.moment[2] = torque(value),
            Field::MomentStiffness => self.received_feed.stiffness = value as u16,
            _ => return self.set_setting(field, value),
        }
        Ok(())
    }

    /// Writes a setting, which is refused while a motor may carry current, and in Operational.
    fn set_setting(&mut self, field: Field, value: i64) -> Result<(), Abort> {
        if self.machine.is_live() || self.operational {
            return Err(Abort::DeviceState);
        }
        let angle = Angle::from_tenth_milliradians(value as i16);
        let (gains, limits) = (&mut self.settings.gains, &mut self.settings.limits);
        match field {
            Field::StiffnessX => gains.stiffness[0] = value as u32,
            Field::StiffnessY => gains.stiffness[1] = value as u32,
            Field::StiffnessZ => gains.stiffness[2] = value as u32,
            Field::DampingX => gains.damping[0] = value as u32,
            Field::DampingY => gains.damping[1] = value as u32,
            Field::DampingZ => gains.damping[2] = value as u32,
            Field::PeakTorque => limits.peak_torque = torque(value),
            Field::RangeYaw => limits.workspace.yaw = angle,
            Field::RangePitch => limits.workspace.pitch = angle,
            Field::RangeRoll => limits.workspace.roll = angle,
            Field::RateLimit => {
                limits.rate = AngularVelocity::from_milliradians_per_second(value as i32);
            }
            _ => return Err(Abort::ReadOnly),
        }
        self.impedance = Impedance::new(&self.settings.gains);
        Ok(())
    }
}

impl Application for Core {
    fn entry(&self, index: u16, subindex: u8) -> Result<Entry, Abort> {
        dictionary::entry(index, subindex)
    }

    fn read(&self, index: u16, subindex: u8, out: &mut [u8]) -> Result<usize, Abort> {
        if subindex == 0 {
            let object = dictionary::object(index).ok_or(Abort::NoObject)?;
            *out.first_mut().ok_or(Abort::OutOfMemory)? = object.highest();
            return Ok(1);
        }
        let (_, sub) = dictionary::find(index, subindex)?;
        sub.data_type.encode(self.value(sub.field), out)
    }

    fn write(&mut self, index: u16, subindex: u8, data: &[u8]) -> Result<(), Abort> {
        let (_, sub) = dictionary::find(index, subindex)?;
        self.set(sub.field, sub.accept(data)?)
    }

    fn rpdo_applied(&mut self, number: u8, cob_id: u16) {
        match number {
            1 => {
                let bytes = self.target.to_bytes();
                self.receive_target(&bytes, cob_id);
            }
            2 => self.receive_feed_forward(),
            _ => {}
        }
    }

    fn tpdo_due(&mut self, number: u8, cob_id: u16) {
        if number == 1 {
            let report = PoseReport {
                yaw: self.pose.yaw,
                pitch: self.pose.pitch,
                roll: self.pose.roll,
                state: self.machine.state(),
                counter: self.pose_counter,
            };
            self.pose_counter = self.pose_counter.next();
            self.pose_bytes = report.to_bytes(cob_id);
        }
    }
}

fn millis(torque: Torque) -> i64 {
    i64::from(torque.to_millinewton_metres())
}

const fn tenths(temperature: Temperature) -> i32 {
    temperature.to_decidegrees()
}

fn torque(value: i64) -> Torque {
    Torque::from_millinewton_metres(value as i32)
}

fn microradians(angle: Angle) -> i64 {
    (i64::from(angle.to_q29()) * MICRO + (1 << 28)) >> 29
}
