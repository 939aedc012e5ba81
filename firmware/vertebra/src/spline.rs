//! The path between two SYNCs: a quadratic B-spline through the targets.
//!
//! Position and velocity are continuous, and the curve stays inside the convex hull of its targets,
//! so it never leaves a box that all of them are in. The price is a delay of half a SYNC period
//! more than a straight line would have.

use eel_kinematics::Pose;
use eel_units::{Angle, AngularVelocity, Duration, saturate};

/// Ticks of one second.
const MICROS_PER_SECOND: i64 = 1_000_000;

/// Three targets and the place between them.
#[derive(Clone, Copy, Debug)]
pub struct Spline {
    /// Oldest to newest.
    knots: [Pose; 3],
}

/// Where the path is and how fast it moves: the rates of yaw, pitch and roll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reference {
    /// The pose.
    pub pose: Pose,
    /// Its rate of change.
    pub rates: [AngularVelocity; 3],
}

impl Reference {
    /// Makes a reference that stays at `pose`.
    pub const fn at_rest(pose: Pose) -> Self {
        Self {
            pose,
            rates: [AngularVelocity::ZERO; 3],
        }
    }
}

impl Spline {
    /// Makes a path that rests at `pose`.
    pub const fn at_rest(pose: Pose) -> Self {
        Self { knots: [pose; 3] }
    }

    /// Starts the next segment, which leads towards `target`.
    pub const fn push(&mut self, target: Pose) {
        self.knots = [self.knots[1], self.knots[2], target];
    }

    /// Returns the newest target.
    pub const fn newest(&self) -> Pose {
        self.knots[2]
    }

    /// Returns where the path would lead if it went on as it did from the last target but one.
    pub fn continued(&self) -> Pose {
        let [_, from, to] = self.knots;
        Pose {
            yaw: to.yaw + (to.yaw - from.yaw),
            pitch: to.pitch + (to.pitch - from.pitch),
            roll: to.roll + (to.roll - from.roll),
        }
    }

    /// Returns the path's point `elapsed` µs after its segment of length `period` began. Before and
    /// after the segment the path goes on straight for half a period, which its neighbours hardly
    /// differ from; then it waits.
    pub fn reference(&self, elapsed: i64, period: Duration) -> Reference {
        let period = i64::from(period.to_micros().clamp(1_000, 100_000));
        let elapsed = elapsed.clamp(-period / 2, period * 3 / 2);
        // Place in the segment in Q15, and the number of segments in a second.
        let place = (elapsed << 15) / period;
        let per_second = MICROS_PER_SECOND * 16 / period;
        let [a, b, c] = self.knots;
        let (yaw, yaw_rate) = axis([a.yaw, b.yaw, c.yaw], place, per_second);
        let (pitch, pitch_rate) = axis([a.pitch, b.pitch, c.pitch], place, per_second);
        let (roll, roll_rate) = axis([a.roll, b.roll, c.roll], place, per_second);
        Reference {
            pose: Pose { yaw, pitch, roll },
            rates: [yaw_rate, pitch_rate, roll_rate],
        }
    }
}

/// Evaluates one axis: `place` in Q15 within the segment or up to half of it outside, where the
/// path is straight and still within the hull; `per_second` segments a second in Q4.
fn axis(knots: [Angle; 3], place: i64, per_second: i64) -> (Angle, AngularVelocity) {
    let [a, b, c] = knots.map(|angle| i64::from(angle.to_q29()));
    let (first, second) = (b - a, c - b);
    // ½(a + b) + u (b − a) + ½ u² (c − 2b + a), with u in Q15: the sum is kept doubled.
    let inside = place.clamp(0, 1 << 15);
    let bend = ((second - first) * inside) >> 15;
    let slope = first + bend;
    let outside = (2 * slope * (place - inside)) >> 15;
    let doubled = a + b + (((2 * first + bend) * inside) >> 15) + outside;
    // Q29 rad a segment × Q4 segments a second is Q33 rad/s; the quantity is Q24.
    let rate = (slope * per_second) >> 9;
    (
        Angle::from_q29(saturate(doubled >> 1)),
        AngularVelocity::from_q24(saturate(rate)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(10);

    fn yaw(milliradians: i32) -> Pose {
        Pose {
            yaw: Angle::from_milliradians(milliradians),
            ..Pose::default()
        }
    }

    #[test]
    fn joins_its_segments_in_position_and_velocity() {
        let mut spline = Spline::at_rest(yaw(0));
        let mut last = spline.reference(10_000, PERIOD);
        for target in [30, 55, -20, -20, 400] {
            spline.push(yaw(target));
            let start = spline.reference(0, PERIOD);
            assert!(
                (start.pose.yaw - last.pose.yaw).abs() <= Angle::from_q29(2),
                "{target}"
            );
            let step = (start.rates[0] - last.rates[0]).abs();
            assert!(step <= AngularVelocity::from_q24(16), "{target}: {step:?}");
            last = spline.reference(10_000, PERIOD);
        }
    }

    #[test]
    fn comes_to_rest_at_a_repeated_target() {
        let mut spline = Spline::at_rest(yaw(0));
        for _ in 0..3 {
            spline.push(yaw(100));
        }
        let reference = spline.reference(10_000, PERIOD);
        assert_eq!(reference.pose, yaw(100));
        assert_eq!(reference.rates[0], AngularVelocity::ZERO);
    }

    #[test]
    fn has_the_rate_of_its_own_position() {
        let mut spline = Spline::at_rest(yaw(10));
        spline.push(yaw(40));
        spline.push(yaw(100));
        let [before, after] = [3_000, 5_000].map(|t| spline.reference(t, PERIOD).pose.yaw.to_q29());
        let difference = f64::from(after - before) / f64::from(1 << 29) / 2e-3;
        let rate = spline.reference(4_000, PERIOD).rates[0];
        let rate = f64::from(rate.to_q24()) / f64::from(1 << 24);
        assert!(
            (rate - difference).abs() < 2e-3,
            "{rate} against {difference}"
        );
    }

    #[test]
    fn never_leaves_the_hull_of_its_targets() {
        let mut spline = Spline::at_rest(yaw(500));
        for target in [-500, 500, 500, -500] {
            spline.push(yaw(target));
            for micros in (-9_000..=19_000).step_by(100) {
                let pose = spline.reference(micros, PERIOD).pose;
                assert!(
                    pose.yaw.abs() <= Angle::from_milliradians(500),
                    "{micros}: {pose:?}"
                );
            }
        }
    }
}
