//! What makes a vertebra let go: limits of what it measures, loss of command, stops and faults.

use eel_kinematics::Joints;
use eel_protocol::Condition;
use eel_protocol::emergency::{Emergency, Source};
use eel_units::{Angle, Current, Temperature, Torque};

use crate::command::TARGET_TIMEOUT;
use crate::core::Core;
use crate::current::hard_limit;
use crate::encoder::Encoder;
use crate::io::{Drive, Sample};
use crate::limits::SINGULARITY;
use crate::machine::STOP_DAMPED;
use crate::thermal::Thermal;
use crate::workspace::is_believable;

/// Largest difference between the measured angles and those of the measured pose: 1 mrad.
const RESIDUAL_LIMIT: Angle = Angle::from_milliradians(1);

/// Current that a sensor may read while its bridge is off: 100 mA.
const IDLE_CURRENT: Current = Current::from_milliamps(100);

/// Deviation from the reference that is worth a warning: 150 mrad.
const FOLLOWING_LIMIT: Angle = Angle::from_milliradians(150);
/// Deviation below which that warning ends: 100 mrad, so that noise doesn't repeat it.
const FOLLOWING_END: Angle = Angle::from_milliradians(100);
/// Deviation from the reference that no wrist has which still follows: 350 mrad.
const LOST_LIMIT: Angle = Angle::from_milliradians(350);
/// det A from which that warning ends, Q30: 0.61.
const SINGULARITY_END: i32 = 654_982_512;
/// Ticks for which the deviation may be that large.
const LOST_TICKS: u8 = 250;

impl Core {
    /// Holds every reading against its limit and decides what may be enabled.
    pub fn watch(&mut self) {
        self.note_refusals();
        self.find_faults();
        self.take_faults();
        if self.sample.emergency_stop {
            self.emergency_stop(Emergency::EMERGENCY_STOP);
        }
        if self.machine.is_enabled() && self.stream.is_lost(self.now) {
            self.lose_command(Emergency::COMMAND_LOST, TARGET_TIMEOUT.to_micros() / 1_000);
        }
        self.status = self
            .status
            .with(Condition::Latched, self.machine.state().is_latched());
    }

    /// Notes what stands against enabling.
    fn note_refusals(&mut self) {
        let reads_idle_current = self.reads_idle_current();
        let sample = &self.sample;
        let limits = &self.settings.limits;
        let aligned = self.encoders.iter().all(Encoder::is_aligned);
        let believable = self.has_pose && is_believable(&self.pose, limits);
        let hot = sample.board_temperature >= limits.board_hot.end
            || sample
                .motor_temperature
                .iter()
                .any(|value| *value >= limits.motor_hot.end);
        let hot = hot || self.hot_winding().is_some();
        let voltage =
            sample.supply <= limits.supply_low.end || sample.supply >= limits.supply_high.end;
        self.status = self
            .status
            .with(Condition::Settings, self.settings_lost || !self.is_sound)
            .with(Condition::Calibration, !self.is_calibrated)
            .with(Condition::CurrentOffset, reads_idle_current)
            .with(Condition::Encoders, !aligned)
            .with(Condition::Pose, aligned && !believable)
            .with(Condition::Voltage, voltage)
            .with(Condition::Temperature, hot)
            .with(Condition::Bridge, sample.bridge_fault.contains(&true))
            .with(Condition::EmergencyStop, sample.emergency_stop)
            .with(Condition::NotOperational, !self.operational);
    }

    /// Tells whether a current sensor reads a current that can't be, the bridges being off.
    fn reads_idle_current(&mut self) -> bool {
        let [one, two, three] = self.is_open;
        if !(one && two && three) {
            self.idle = [0; 3];
            return false;
        }
        let mut is_wrong = false;
        for (idle, current) in self.idle.iter_mut().zip(self.sample.current) {
            // A low pass of 64 ticks.
            *idle += i64::from(current.to_microamps()) - *idle / 64;
            is_wrong |=
                (*idle / 64).unsigned_abs() > u64::from(IDLE_CURRENT.to_microamps().unsigned_abs());
        }
        is_wrong
    }

    /// Finds what is wrong with this vertebra: some of it always, some while its drives are on.
    fn find_faults(&mut self) {
        let sample = &self.sample;
        if self.status.contains(Condition::Settings) {
            self.pending.fault(Emergency::SETTINGS_INVALID, None, 0);
        }
        if let Some(motor) = sample.bridge_fault.iter().position(|fault| *fault) {
            self.pending.fault(Emergency::BRIDGE_FAULT, Some(motor), 0);
        }
        if !self.machine.is_powered() {
            return;
        }
        let limits = &self.settings.limits;
        let centivolts = || (sample.supply.to_millivolts() / 10).clamp(0, 0xFFFF) as u16;
        if sample.supply <= limits.supply_low.end {
            self.pending
                .fault(Emergency::UNDER_VOLTAGE, None, centivolts());
        } else if sample.supply >= limits.supply_high.end {
            self.pending
                .fault(Emergency::OVER_VOLTAGE, None, centivolts());
        }
        let decidegrees = |value: Temperature| value.to_decidegrees() as u16;
        if sample.board_temperature >= limits.board_hot.end {
            let detail = decidegrees(sample.board_temperature);
            self.pending
                .fault(Emergency::BOARD_OVER_TEMPERATURE, None, detail);
        }
        for (motor, value) in sample.motor_temperature.into_iter().enumerate() {
            if value >= limits.motor_hot.end {
                let detail = decidegrees(value);
                self.pending
                    .fault(Emergency::MOTOR_OVER_TEMPERATURE, Some(motor), detail);
            }
        }
        if let Some(motor) = self.hot_winding() {
            let winding = self.thermal.get(motor).map(Thermal::winding);
            let detail = decidegrees(winding.unwrap_or_default());
            let fault = Emergency::WINDING_OVER_TEMPERATURE;
            self.pending.fault(fault, Some(motor), detail);
        }
        self.find_over_current();
    }

    /// Returns the first motor whose winding is hotter than its current should let it become.
    fn hot_winding(&self) -> Option<usize> {
        self.is_too_hot.iter().position(|hot| *hot)
    }

    /// Finds a current that is far above what the bridge is ever told: the loop has seen it, or its mean
    /// is, as that of a braked motor may be.
    fn find_over_current(&mut self) {
        let Sample {
            current,
            over_current,
            ..
        } = self.sample;
        let hard = hard_limit(self.settings.motor.current_limit);
        for (motor, (current, tripped)) in current.into_iter().zip(over_current).enumerate() {
            if tripped || current.abs() > hard {
                let milliamps = current.abs().to_microamps() / 1_000;
                let detail = milliamps.min(0xFFFF) as u16;
                self.pending
                    .fault(Emergency::OVER_CURRENT, Some(motor), detail);
            }
        }
    }

    /// Compares the motors' angles with those that the measured pose should have: outside the
    /// home branch, or with damaged constants, they part.
    pub fn find_residual(&mut self) {
        let residual = match self.settings.wrist.inverse(&self.pose) {
            Ok(inverse) => {
                let Joints(expected) = inverse.joints;
                let parts = expected.into_iter().zip(self.angles());
                parts
                    .map(|(one, other)| (one - other).abs())
                    .max()
                    .unwrap_or_default()
            }
            Err(_) => Angle::MAX,
        };
        let wrong = residual > RESIDUAL_LIMIT;
        self.status = self.status.with(Condition::Residual, wrong);
        if wrong && self.machine.is_live() {
            let detail = residual.to_tenth_milliradians().unsigned_abs();
            self.pending.fault(Emergency::RESIDUAL, None, detail);
        }
    }

    /// Warns near a parallel singularity, where little torque of the motors is left over the moment, and
    /// faults nearer to it.
    #[inline]
    pub fn watch_singularity(&mut self) {
        let was_near = self.status.contains(Condition::NearSingularity);
        if self.det_a >= SINGULARITY_END && !was_near {
            return;
        }
        let is_live = self.machine.is_live();
        let limit = if was_near {
            SINGULARITY_END
        } else {
            SINGULARITY.start
        };
        let is_near = is_live && self.det_a < limit;
        if is_near && !was_near {
            let detail = (i64::from(self.det_a.max(0)) * 1_000) >> 30;
            self.emit(Emergency::NEAR_SINGULARITY, Source::whole(detail as u16));
        }
        self.status = self.status.with(Condition::NearSingularity, is_near);
        if is_live && self.det_a < SINGULARITY.end {
            self.pending.fault(Emergency::SINGULAR, None, 0);
        }
    }

    /// Enters the fault state for the first fault that waits.
    pub fn take_faults(&mut self) {
        let Some((emergency, source)) = self.pending.first_fault() else {
            return;
        };
        let before = self.machine.state();
        let motor = usize::from(source.motor).checked_sub(1);
        if self.machine.fault(self.now, motor) {
            self.freeze(before, emergency, source);
            self.emit(emergency, source);
        }
        self.note_state(before);
    }

    /// Forgets what a fault reset clears; encoders that failed align again.
    pub fn reset_faults(&mut self) {
        for (encoder, failed) in self.encoders.iter_mut().zip(self.pending.failed_encoders()) {
            if failed {
                *encoder = Encoder::new(&self.settings.motor);
            }
        }
        self.pending.clear();
        self.forget_feed_forward();
        self.status = self.status.with(Condition::CommandLost, false);
        self.emit(Emergency::CLEARED, Source::WHOLE);
    }

    /// Stops in order, with the reason, when enabled.
    pub fn stop(&mut self, emergency: Emergency, detail: u32) {
        let before = self.machine.state();
        if self.machine.stop(self.now) {
            let source = Source::whole(detail.min(0xFFFF) as u16);
            self.freeze(before, emergency, source);
            self.emit(emergency, source);
        }
        self.note_state(before);
    }

    /// Lets go because there are no targets to follow; nothing is lost where none was followed.
    pub fn lose_command(&mut self, emergency: Emergency, detail: u32) {
        if self.machine.is_enabled() {
            self.stop(emergency, detail);
            self.status = self.status.with(Condition::CommandLost, true);
        }
    }

    /// Switches off at once, with the reason.
    pub fn emergency_stop(&mut self, emergency: Emergency) {
        let before = self.machine.state();
        if self.machine.emergency_stop(self.now) {
            self.freeze(before, emergency, Source::WHOLE);
            self.emit(emergency, Source::WHOLE);
        }
        self.note_state(before);
    }

    /// Stops by NMT: in order when enabled, and latched in any case. A stop that has begun goes on.
    pub fn latch_stop(&mut self) {
        if self.machine.is_enabled() {
            self.stop(Emergency::STOPPED_BY_NMT, 0);
        } else if !self.machine.state().is_latched() {
            self.emergency_stop(Emergency::STOPPED_BY_NMT);
        }
    }

    /// Lets go because the head's heartbeat is missing; the node sends the emergency itself.
    pub fn lose_head(&mut self, node: u8) {
        let before = self.machine.state();
        self.status = self.status.with(Condition::HeadLost, true);
        if self.machine.stop(self.now) {
            self.freeze(before, Emergency::HEAD_LOST, Source::whole(u16::from(node)));
        }
        self.note_state(before);
    }

    /// Hears the head again, which by itself moves nothing.
    pub fn hear_head(&mut self) {
        self.status = self.status.with(Condition::HeadLost, false);
    }

    /// Warns of a wrist that is far from its reference, and faults one that is farther for too
    /// long: a stuck mechanism, a motor connected the wrong way round, a gait beyond the motors.
    pub fn watch_following(&mut self, worst: Angle) {
        let detail = worst.to_tenth_milliradians().unsigned_abs();
        let was_far = self.status.contains(Condition::FollowingError);
        let limit = if was_far {
            FOLLOWING_END
        } else {
            FOLLOWING_LIMIT
        };
        let far = worst > limit;
        if far && !was_far {
            self.emit(Emergency::FOLLOWING_ERROR, Source::whole(detail));
        }
        self.status = self.status.with(Condition::FollowingError, far);
        self.lost_ticks = if worst > LOST_LIMIT {
            self.lost_ticks.saturating_add(1)
        } else {
            0
        };
        if self.lost_ticks >= LOST_TICKS {
            self.pending.fault(Emergency::NOT_FOLLOWING, None, detail);
        }
    }

    /// Returns the torque that a stop still allows: it falls to nothing with time.
    pub fn stop_cap(&self) -> Torque {
        let elapsed = self.machine.elapsed(self.now).to_micros();
        let left = STOP_DAMPED.to_micros().saturating_sub(elapsed);
        let peak = i64::from(self.settings.limits.peak_torque.to_q24());
        Torque::from_q24((peak * i64::from(left) / i64::from(STOP_DAMPED.to_micros())) as i32)
    }

    /// Returns the drives of a fault: the motor at fault is off, the others brake, then all off.
    /// What was off before the fault stays off.
    pub fn fault_drives(&self) -> [Drive; 3] {
        if !self.machine.brakes_after_fault(self.now) {
            return [Drive::Off; 3];
        }
        let mut drives = [Drive::Brake; 3];
        if let Some(drive) = self
            .machine
            .faulty_motor()
            .and_then(|motor| drives.get_mut(motor))
        {
            *drive = Drive::Off;
        }
        drives
    }
}
