//! Targets as they are allowed: inside the workspace, no faster than the rate limit.

use eel_kinematics::{Pose, Wrist};
use eel_units::{Angle, AngularVelocity, Duration};

use crate::settings::Limits;

/// Bits of the axes that a target was limited in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limited(u8);

impl Limited {
    /// Yaw was limited.
    pub const YAW: u8 = 1;
    /// Pitch was limited.
    pub const PITCH: u8 = 2;
    /// Roll was limited.
    pub const ROLL: u8 = 4;
    /// The pose has no solution that is far enough from a singularity; the one before it stands.
    pub const KINEMATICS: u8 = 8;

    /// Returns the bits, which are the detail of the emergency `target-limited`.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Tells whether anything was limited.
    pub const fn any(self) -> bool {
        self.0 != 0
    }
}

/// Returns the pose to follow instead of `wanted`, `period` after `previous`, and which bounds of
/// the workspace it met. Following the rate limit is no violation and is not reported.
pub fn admit(
    wanted: Pose,
    previous: Pose,
    period: Duration,
    limits: &Limits,
    wrist: &Wrist,
) -> (Pose, Limited) {
    let range = &limits.workspace;
    let mut limited = 0;
    let mut axis = |value: Angle, range: Angle, bit: u8| {
        let bounded = value.bounded(-range, range);
        if bounded != value {
            limited |= bit;
        }
        bounded
    };
    let boxed = Pose {
        yaw: axis(wanted.yaw, range.yaw, Limited::YAW),
        pitch: axis(wanted.pitch, range.pitch, Limited::PITCH),
        roll: axis(wanted.roll, range.roll, Limited::ROLL),
    };
    let step = largest_step(limits.rate, period);
    let near = |value: Angle, previous: Angle| value.bounded(previous - step, previous + step);
    let pose = Pose {
        yaw: near(boxed.yaw, previous.yaw),
        pitch: near(boxed.pitch, previous.pitch),
        roll: near(boxed.roll, previous.roll),
    };
    if wrist.inverse(&pose).is_err() {
        return (previous, Limited(limited | Limited::KINEMATICS));
    }
    (pose, Limited(limited))
}

/// Tells whether a pose is inside the workspace widened by a quarter, where the hard stops are.
pub fn is_believable(pose: &Pose, limits: &Limits) -> bool {
    let range = &limits.workspace;
    let inside = |value: Angle, range: Angle| {
        i64::from(value.to_q29()).abs() * 4 <= i64::from(range.to_q29()) * 5
    };
    inside(pose.yaw, range.yaw) && inside(pose.pitch, range.pitch) && inside(pose.roll, range.roll)
}

/// Returns the farthest that an axis may move in `period`.
fn largest_step(rate: AngularVelocity, period: Duration) -> Angle {
    // Q24 rad/s × µs; Q29 and seconds: × 2⁵ / 10⁶, as 35 184 372 / 2⁴⁰.
    let product = i64::from(rate.abs().to_q24()) * i64::from(period.to_micros().min(100_000));
    let step = ((product >> 12) * 35_184_372) >> 28;
    Angle::from_q29(step.min(i64::from(i32::MAX)) as i32)
}
