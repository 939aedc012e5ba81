//! The modes that produce what they are told instead of following a pose: a moment of the wrist, or
//! the torque of single motors.
//!
//! Neither leads out of the workspace, or faster than the rate limit: outside, the spring of the
//! controller pulls back, and above the limit its damper brakes. Inside both act not at all.

use eel_kinematics::{Bounds, Policy, Pose, Side};
use eel_units::{AngularVelocity, Torque};

use crate::core::Core;
use crate::impedance::{FeedForward, Motion};
use crate::io::Drive;

/// Speed of a crank above which a commissioned motor is braked: 1 rad/s.
const CRANK_SPEED: AngularVelocity = AngularVelocity::from_milliradians_per_second(1_000);

impl Core {
    /// Returns the moment that the head asks for, and what keeps the wrist inside its limits.
    pub fn push(&self, motion: &Motion) -> [Torque; 3] {
        let [a, b, c] = self.feed_forward.moment;
        match self.guard(motion) {
            None => [a, b, c],
            Some([x, y, z]) => [a + x, b + y, c + z],
        }
    }

    /// Lets each motor produce the torque that it is told, within its bounds.
    pub fn drive_motors(&mut self, motion: &Motion, cap: Option<Torque>) -> [Drive; 3] {
        let bounds = self.bounds(cap);
        let limits = bounds.each_ref().map(|motor| motor.torque);
        let mut torques = self.motor_torque;
        for (torque, speed) in torques.iter_mut().zip(self.speeds()) {
            let excess = speed - speed.bounded(-CRANK_SPEED, CRANK_SPEED);
            // 1 N·m·s/rad: both are Q24.
            *torque -= Torque::from_q24(excess.to_q24());
        }
        if let Some(back) = self.guard(motion) {
            let shared = motion
                .direct
                .jacobian
                .share(&back, &limits, Policy::YawFirst);
            for (torque, back) in torques.iter_mut().zip(shared.torque) {
                *torque += back;
            }
        }
        let mut sides = [None; 3];
        let motors = torques.iter_mut().zip(&limits).zip(&mut sides);
        for ((torque, bounds), side) in motors {
            *side = side_of(*torque, bounds);
            *torque = torque.bounded(bounds.low, bounds.high);
        }
        self.apply(&bounds, &torques, &sides)
    }

    /// Returns the moment that leads back into the workspace and below the rate limit; `None` inside.
    fn guard(&self, motion: &Motion) -> Option<[Torque; 3]> {
        let limits = &self.settings.limits;
        let Pose { yaw, pitch, roll } = limits.workspace;
        let inside = Pose {
            yaw: self.pose.yaw.bounded(-yaw, yaw),
            pitch: self.pose.pitch.bounded(-pitch, pitch),
            roll: self.pose.roll.bounded(-roll, roll),
        };
        let slow = motion
            .omega
            .map(|axis| axis.bounded(-limits.rate, limits.rate));
        if inside == self.pose && slow == motion.omega {
            return None;
        }
        let neutral = FeedForward::NEUTRAL;
        Some(self.impedance.moment(motion, &inside, slow, &neutral).0)
    }
}

/// Returns the bound that a torque is beyond.
fn side_of(torque: Torque, bounds: &Bounds) -> Option<Side> {
    if torque > bounds.high {
        Some(Side::High)
    } else if torque < bounds.low {
        Some(Side::Low)
    } else {
        None
    }
}
