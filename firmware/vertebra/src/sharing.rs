//! From a moment to what each motor's current loop holds: bounds, sharing, setpoints.

use eel_kinematics::{Policy, Side};
use eel_units::Torque;

use crate::core::Core;
use crate::impedance::Motion;
use crate::io::Drive;
use crate::limits::{MotorBounds, Situation, bounds};

impl Core {
    /// Shares a moment among the motors within what their bounds leave beside the friction.
    pub fn share(
        &mut self,
        motion: &Motion,
        moment: [Torque; 3],
        bounds: &[MotorBounds; 3],
    ) -> [Drive; 3] {
        let mut torques = self.friction_torques;
        let mut limits = bounds.each_ref().map(|motor| motor.torque);
        for (torque, bounds) in torques.iter_mut().zip(&mut limits) {
            *torque = torque.bounded(bounds.low, bounds.high);
            bounds.low -= *torque;
            bounds.high -= *torque;
        }
        let shared = motion
            .direct
            .jacobian
            .share(&moment, &limits, Policy::YawFirst);
        self.achieved = shared.achieved;
        self.unallocated = shared.unallocated;
        for (torque, part) in torques.iter_mut().zip(shared.torque) {
            *torque += part;
        }
        self.apply(bounds, &torques, &shared.bound)
    }

    /// Returns what each motor may produce.
    pub fn bounds(&self, command_cap: Option<Torque>) -> [MotorBounds; 3] {
        let situation = Situation {
            sample: &self.sample,
            standing: &self.standing,
            angles: self.angles(),
            speeds: self.speeds(),
            command_cap,
            det_a: self.det_a,
        };
        bounds(&self.settings.limits, &self.electrical, &situation)
    }

    /// Lets the current loop produce torques that are within their bounds; `sides` tells which bound
    /// holds a motor.
    pub fn apply(
        &mut self,
        bounds: &[MotorBounds; 3],
        torques: &[Torque; 3],
        sides: &[Option<Side>; 3],
    ) -> [Drive; 3] {
        let mut drives = [Drive::Off; 3];
        let motors = drives.iter_mut().zip(&mut self.effort.limit);
        let asked = bounds
            .iter()
            .zip(sides)
            .zip(torques)
            .zip(self.encoders.each_ref());
        for ((drive, limit), (((bounds, side), torque), encoder)) in motors.zip(asked) {
            *limit = bounds.reason(*side);
            *drive = Drive::Current(self.electrical.setpoint(*torque, encoder.speed()));
        }
        drives
    }
}
