//! Targets as they are allowed: inside the workspace, no faster than the rate limit.

use eel_kinematics::{Pose, Reach, Wrist};
use eel_units::{Angle, AngularVelocity, Duration, root_q30, saturate};

use crate::settings::Limits;

/// √(2 a) in 2²⁰ √(rad)/µs, times 1000, for braking at a = 40 rad/s²: what the motors can do
/// against the water at the tail.
const BRAKING_Q20: i64 = 9_379;

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
    /// The pose has no solution that is far enough from a singularity; the nearest that has one, or
    /// the one before it, stands.
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
    let mut boxed = Pose {
        yaw: axis(wanted.yaw, range.yaw, Limited::YAW),
        pitch: axis(wanted.pitch, range.pitch, Limited::PITCH),
        roll: axis(wanted.roll, range.roll, Limited::ROLL),
    };
    if wrist.inverse(&boxed).is_err() {
        limited |= Limited::KINEMATICS;
        let reach = Reach {
            range: *range,
            ..Reach::kernel()
        };
        // Without an answer the check below keeps the pose before.
        if let Ok(nearest) = wrist.nearest(&boxed, &reach) {
            boxed = nearest.pose;
        }
    }
    let step = largest_step(limits.rate, period);
    let near = |value: Angle, previous: Angle, range: Angle| {
        let up = step.min(braking_step(range - previous, period));
        let down = step.min(braking_step(previous + range, period));
        value.bounded(previous - down, previous + up)
    };
    let pose = Pose {
        yaw: near(boxed.yaw, previous.yaw, range.yaw),
        pitch: near(boxed.pitch, previous.pitch, range.pitch),
        roll: near(boxed.roll, previous.roll, range.roll),
    };
    if wrist.inverse(&pose).is_err() {
        return (previous, Limited(limited | Limited::KINEMATICS));
    }
    (pose, Limited(limited))
}

/// Tells whether a pose is inside the workspace widened by a quarter; the hard stops are inside that.
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

/// Returns the farthest that an axis may move in `period` towards a bound at `distance`, so that
/// it can still come to rest there at 40 rad/s².
fn braking_step(distance: Angle, period: Duration) -> Angle {
    if distance <= Angle::ZERO {
        return Angle::ZERO;
    }
    // √(2 a d) t with the distance in Q30: √(2 a) t is 8.944 t, in Q20 9.379 per µs.
    let root = i64::from(root_q30((distance.to_q29() as u32).saturating_mul(2)));
    let factor = i64::from(period.to_micros().min(100_000)) * BRAKING_Q20 / 1_000;
    Angle::from_q29(saturate((root * factor) >> 21))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;
    use eel_protocol::NodeId;

    const PERIOD: Duration = Duration::from_millis(10);

    fn settings() -> Settings {
        Settings::prototype(NodeId::FIRST, 0)
    }

    fn yaw(milliradians: i32) -> Pose {
        Pose {
            yaw: Angle::from_milliradians(milliradians),
            ..Pose::default()
        }
    }

    fn admitted(wanted: Pose, previous: Pose) -> (Pose, Limited) {
        let Settings { limits, wrist, .. } = settings();
        admit(wanted, previous, PERIOD, &limits, &wrist)
    }

    #[test]
    fn a_reachable_target_passes_unchanged() {
        let wanted = yaw(310);
        assert_eq!(admitted(wanted, yaw(300)), (wanted, Limited::default()));
    }

    #[test]
    fn no_step_is_faster_than_the_rate() {
        let (pose, limited) = admitted(yaw(400), yaw(0));
        let step = f64::from(pose.yaw.to_q29()) / f64::from(1 << 29);
        assert!((step - 0.06).abs() < 1e-6, "{step}");
        assert!(!limited.any(), "the rate is followed, not violated");
    }

    #[test]
    fn comes_to_rest_at_the_bound_no_faster_than_it_can_brake() {
        let mut pose = yaw(0);
        let mut last = 0.0;
        for _ in 0..100 {
            let (next, limited) = admitted(yaw(3_000), pose);
            assert_eq!(limited.bits(), Limited::YAW);
            let speed = f64::from((next.yaw - pose.yaw).to_q29()) / f64::from(1 << 29) / 0.01;
            if last > 0.0 {
                // The last steps are coarse: a step is a hundredth of a second.
                assert!(last - speed < 1.0, "{last} to {speed} rad/s in a step");
            }
            (pose, last) = (next, speed);
        }
        assert_eq!(pose.yaw, settings().limits.workspace.yaw);
    }

    #[test]
    fn a_corner_that_the_legs_do_not_reach_is_approached_as_far_as_they_do() {
        let Settings {
            mut limits, wrist, ..
        } = settings();
        let milliradians = Angle::from_milliradians;
        limits.workspace = Pose {
            yaw: milliradians(700),
            pitch: milliradians(370),
            roll: milliradians(90),
        };
        let corner = limits.workspace;
        assert!(wrist.inverse(&corner).is_err());
        let mut pose = Pose::default();
        for _ in 0..100 {
            let (next, limited) = admit(corner, pose, PERIOD, &limits, &wrist);
            assert_eq!(limited.bits(), Limited::KINEMATICS);
            assert!(wrist.inverse(&next).is_ok());
            pose = next;
        }
        let missing = [
            corner.yaw - pose.yaw,
            corner.pitch - pose.pitch,
            corner.roll - pose.roll,
        ];
        assert!(
            missing.iter().all(|&angle| angle.abs() < milliradians(100)),
            "{pose:?}"
        );
    }

    #[test]
    fn leads_back_from_outside() {
        let (pose, _) = admitted(yaw(0), yaw(560));
        assert!(pose.yaw < Angle::from_milliradians(520), "{pose:?}");
    }

    #[test]
    fn any_pose_is_survived() {
        let extremes = [i32::MIN, -1, 0, 1, i32::MAX].map(Angle::from_q29);
        for yaw in extremes {
            for pitch in extremes {
                let pose = Pose {
                    yaw,
                    pitch,
                    roll: pitch,
                };
                let (admitted, _) = admitted(pose, Pose::default());
                assert!(is_believable(&admitted, &settings().limits));
            }
        }
    }
}
