//! The fields of the object dictionary that the core holds: reading and writing each.

use eel_canopen::Abort;
use eel_protocol::State;
use eel_protocol::dictionary::Field;
use eel_units::{Angle, Duration, Temperature, Torque};

use crate::core::Core;
use crate::encoder::Encoder;
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

/// What the daisy line's OUT does, object 0x2070:2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ChainOut {
    /// It is high once the node has an id, so that the next vertebra may get one.
    #[default]
    Auto = 0,
    Low = 1,
    High = 2,
}

/// How long a turn takes, object 0x2040.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Timing {
    loop_last: Duration,
    loop_max: Duration,
    /// Last and longest turn of the current loop, ns.
    pub current_loop_ns: (u32, u32),
}

impl ReceivedTarget {
    /// Takes a frame's bytes.
    pub const fn from_bytes(bytes: [u8; 8]) -> Self {
        let [y0, y1, p0, p1, r0, r1, code, crc] = bytes;
        let [yaw, pitch, roll] = [[y0, y1], [p0, p1], [r0, r1]];
        Self {
            angles: [
                i16::from_le_bytes(yaw),
                i16::from_le_bytes(pitch),
                i16::from_le_bytes(roll),
            ],
            code,
            crc,
        }
    }

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
}

impl Core {
    /// Returns the raw number of a field; too large a one is saturated where it is encoded.
    pub fn value(&self, field: Field) -> i64 {
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
            Field::MotorTorque1 => millis(self.motor_torque[0]),
            Field::MotorTorque2 => millis(self.motor_torque[1]),
            Field::MotorTorque3 => millis(self.motor_torque[2]),
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
            Field::StiffnessX
            | Field::StiffnessY
            | Field::StiffnessZ
            | Field::DampingX
            | Field::DampingY
            | Field::DampingZ
            | Field::PeakTorque
            | Field::RangeYaw
            | Field::RangePitch
            | Field::RangeRoll
            | Field::RateLimit
            | Field::FrictionCoulomb
            | Field::FrictionViscous
            | Field::FrictionSpeed
            | Field::WindingResistance
            | Field::HousingResistance
            | Field::WindingCapacity
            | Field::HousingCapacity
            | Field::WindingLimit
            | Field::Ambient
            | Field::CalibrationSerial
            | Field::Zero1
            | Field::Zero2
            | Field::Zero3
            | Field::Offset1
            | Field::Offset2
            | Field::Offset3
            | Field::Reversed => self.settings.value(field).unwrap_or_default(),
            Field::Architecture => PARALLEL_ACTUATORS,
            Field::GeometryScale => PROTOTYPE_SCALE_UM,
            Field::TorqueConstant => i64::from(self.settings.motor.torque_constant),
            Field::Resistance => i64::from(self.settings.motor.resistance),
            Field::Inductance => i64::from(self.settings.motor.inductance),
            Field::CurrentLimit => {
                i64::from(self.settings.motor.current_limit.to_microamps() / 1_000)
            }
            Field::Supply => self.measured(|sample| sample.supply.to_millivolts()),
            Field::BoardTemperature => self.measured(|sample| tenths(sample.board_temperature)),
            Field::MotorTemperature1 => self.measured(|sample| tenths(sample.motor_temperature[0])),
            Field::MotorTemperature2 => self.measured(|sample| tenths(sample.motor_temperature[1])),
            Field::MotorTemperature3 => self.measured(|sample| tenths(sample.motor_temperature[2])),
            Field::BadTargets => i64::from(self.stream.counters().bad),
            Field::LostTargets => i64::from(self.stream.counters().lost),
            Field::ReceiveOverruns => i64::from(self.counters.receive_overruns),
            Field::TransmitOverruns => i64::from(self.counters.transmit_overruns),
            Field::WindingTemperature1 => i64::from(tenths(self.thermal[0].winding())),
            Field::WindingTemperature2 => i64::from(tenths(self.thermal[1].winding())),
            Field::WindingTemperature3 => i64::from(tenths(self.thermal[2].winding())),
            Field::LoopLast => i64::from(self.timing.loop_last.to_micros()),
            Field::LoopMax => i64::from(self.timing.loop_max.to_micros()),
            Field::SyncPhase => i64::from(self.discipline.error_us),
            Field::TickTrim => i64::from(self.discipline.trim_ns()),
            Field::TickLocked => i64::from(self.discipline.is_locked()),
            Field::CurrentLoopLast => i64::from(self.timing.current_loop_ns.0),
            Field::CurrentLoopMax => i64::from(self.timing.current_loop_ns.1),
            Field::ChainIn => i64::from(self.sample.chain_in),
            Field::ChainOut => self.chain_out as i64,
            Field::ProcedureStep => 0,
            Field::ProcedureProgress => self.procedure.progress as i64,
            Field::ProcedureReason => self.procedure.reason as i64,
            Field::ProcedureMotor => i64::from(self.procedure.motor),
            Field::ProcedureChecks => i64::from(self.procedure.checks),
            Field::ProcedureFailed => i64::from(self.procedure.failed),
            // The rest is served beside the core, or streams.
            Field::ScopeChannel1
            | Field::ScopeChannel2
            | Field::ScopeChannel3
            | Field::ScopeChannel4
            | Field::ScopeDivider
            | Field::ScopeTrigger
            | Field::ScopeState
            | Field::ScopeSamples
            | Field::RecordFreeze
            | Field::RecordScope
            | Field::LinkData
            | Field::LinkLength
            | Field::LinkCrc => 0,
        }
    }

    /// Returns a number of the last sample; 0 before the first.
    fn measured(&self, pick: impl Fn(&Sample) -> i32) -> i64 {
        i64::from(pick(&self.sample))
    }

    fn pose_word(&self, at: usize) -> i64 {
        let bytes = &self.pose_bytes;
        let byte = |at: usize| bytes.get(at).copied().unwrap_or_default();
        i64::from(i16::from_le_bytes([byte(at), byte(at + 1)]))
    }

    /// Writes a field whose value has been held against its bounds.
    pub fn set(&mut self, field: Field, value: i64) -> Result<(), Abort> {
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
            Field::MotorTorque1 => return self.set_motor_torque(0, value),
            Field::MotorTorque2 => return self.set_motor_torque(1, value),
            Field::MotorTorque3 => return self.set_motor_torque(2, value),
            Field::ChainOut => {
                self.chain_out = match value {
                    1 => ChainOut::Low,
                    2 => ChainOut::High,
                    _ => ChainOut::Auto,
                };
            }
            Field::ProcedureStep => return self.order_procedure(value as u8),
            _ => return self.set_setting(field, value),
        }
        Ok(())
    }

    /// Writes the torque of a single motor, which is refused unless the mode for it is on.
    fn set_motor_torque(&mut self, motor: usize, value: i64) -> Result<(), Abort> {
        if self.machine.state() != State::Motor {
            return Err(Abort::DeviceState);
        }
        if let Some(wanted) = self.motor_torque.get_mut(motor) {
            *wanted = torque(value);
        }
        Ok(())
    }

    /// Writes a setting, which is refused while a motor may carry current, and in Operational.
    fn set_setting(&mut self, field: Field, value: i64) -> Result<(), Abort> {
        if self.machine.may_carry_current(self.now) || self.operational {
            return Err(Abort::DeviceState);
        }
        let before = self.settings.calibration;
        if !self.settings.set(field, value) {
            return Err(Abort::ReadOnly);
        }
        if self.settings.calibration != before {
            self.encoders = [Encoder::new(&self.settings.motor); 3];
        }
        self.prepare();
        Ok(())
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

pub(crate) fn microradians(angle: Angle) -> i64 {
    (i64::from(angle.to_q29()) * MICRO + (1 << 28)) >> 29
}
