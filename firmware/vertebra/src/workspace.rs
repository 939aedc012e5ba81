//! Targets as they are allowed: inside the workspace, no faster than the rate limit.

use eel_kinematics::{Pose, Reach, Search, Wrist};
use eel_units::{Angle, AngularVelocity, Duration, quotient_q30, root_q30, saturate};

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
    /// The pose, or the way to it, has no solution that is far enough from a singularity: the vertebra
    /// goes as near as its legs reach, along their edge where it has to.
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

/// Leads targets that the legs don't reach to the nearest place that they do. The search for it goes on
/// between the targets, a piece in each tick, so that no tick takes long.
#[derive(Clone, Copy, Debug, Default)]
pub struct Guide {
    /// The nearest place to the target.
    goal: Option<Search>,
    /// The nearest place to a step that leads out of reach on the way there.
    detour: Option<Search>,
}

impl Guide {
    /// Returns the pose to follow instead of `wanted`, `period` after `previous`, and which bounds of
    /// the workspace it met. Following the rate limit is no violation and is not reported.
    pub fn admit(
        &mut self,
        wanted: Pose,
        previous: Pose,
        period: Duration,
        limits: &Limits,
        wrist: &Wrist,
    ) -> (Pose, Limited) {
        let range = &limits.workspace;
        let (boxed, mut limited) = boxed(&wanted, range);
        let reach = Reach {
            range: *range,
            ..Reach::kernel()
        };
        let rooms = Rooms::new(&previous, range, largest_step(limits.rate, period), period);
        let goal = self.goal(&boxed, wrist);
        let step = rooms.bounded(&goal);
        let is_reached = wrist.inverse(&step).is_ok();
        if is_reached && step == boxed {
            *self = Self::default();
            return (step, Limited(limited));
        }
        // Whether the target itself is in reach, and what is nearest to it, is found out on the way.
        aim(&mut self.goal, &boxed, &reach);
        if goal != boxed {
            limited |= Limited::KINEMATICS;
        }
        if is_reached {
            self.detour = None;
            return (step, Limited(limited));
        }
        // Each axis by itself leads out of what the legs reach: straight, then along the edge, then less.
        limited |= Limited::KINEMATICS;
        let is_way = |pose: &Pose| *pose != previous && wrist.inverse(pose).is_ok();
        let straight = rooms.scaled(&goal, 0);
        if is_way(&straight) {
            self.detour = None;
            return (straight, Limited(limited));
        }
        aim(&mut self.detour, &step, &reach);
        let best = self.detour.as_ref().and_then(Search::best);
        let along = best.unwrap_or(previous);
        let shorter = [0, 1, 3].map(|halvings| rooms.scaled(&along, halvings));
        let allowed = shorter.into_iter().find(is_way);
        (allowed.unwrap_or(previous), Limited(limited))
    }

    /// Returns the nearest place to a target as far as it is known; the target itself where nothing is.
    fn goal(&mut self, target: &Pose, wrist: &Wrist) -> Pose {
        let Some(search) = &self.goal else {
            return *target;
        };
        // Another target may be in reach again.
        if search.target() != *target && wrist.inverse(target).is_ok() {
            self.goal = None;
            return *target;
        }
        search.best().unwrap_or(*target)
    }

    /// Searches on: a tick's piece.
    pub fn advance(&mut self, wrist: &Wrist) {
        let searches = [&mut self.goal, &mut self.detour];
        // The second only where the first has nothing to do.
        searches
            .into_iter()
            .flatten()
            .any(|search| search.advance(wrist));
    }
}

/// Lets a search look for a target.
fn aim(search: &mut Option<Search>, target: &Pose, reach: &Reach) {
    match search {
        Some(search) if search.target() == *target => {}
        Some(search) => search.retarget(target),
        None => *search = Some(Search::new(target, reach)),
    }
}

/// Returns a pose within the workspace, and the bits of the axes that were outside.
fn boxed(wanted: &Pose, range: &Pose) -> (Pose, u8) {
    let mut limited = 0;
    let mut axis = |value: Angle, range: Angle, bit: u8| {
        let bounded = value.bounded(-range, range);
        if bounded != value {
            limited |= bit;
        }
        bounded
    };
    let pose = Pose {
        yaw: axis(wanted.yaw, range.yaw, Limited::YAW),
        pitch: axis(wanted.pitch, range.pitch, Limited::PITCH),
        roll: axis(wanted.roll, range.roll, Limited::ROLL),
    };
    (pose, limited)
}

/// How far each axis may go in a period, down and up, from where it is.
struct Rooms {
    from: [Angle; 3],
    down: [Angle; 3],
    up: [Angle; 3],
}

impl Rooms {
    /// Takes the rate and the way that braking at the end of the range takes.
    fn new(previous: &Pose, range: &Pose, step: Angle, period: Duration) -> Self {
        let (from, range) = (previous.angles(), range.angles());
        let room = |distance: Angle| step.min(braking_step(distance, period));
        Self {
            from,
            down: each(from, range, |from, range| room(from + range)),
            up: each(from, range, |from, range| room(range - from)),
        }
    }

    /// Returns the pose nearest to `to`, each axis by itself.
    fn bounded(&self, to: &Pose) -> Pose {
        let lowest = each(self.from, self.down, |from, down| from - down);
        let highest = each(self.from, self.up, |from, up| from + up);
        let raised = each(to.angles(), lowest, Angle::max);
        Pose::from_angles(each(raised, highest, Angle::min))
    }

    /// Returns as much of the straight way to `to` as all axes can go, halved so many times.
    fn scaled(&self, to: &Pose, halvings: u32) -> Pose {
        let way = each(to.angles(), self.from, |to, from| to - from);
        let rooms = self.down.into_iter().zip(self.up);
        // The least of room / way, Q30.
        let mut share = 1i64 << 30;
        for (way, (down, up)) in way.into_iter().zip(rooms) {
            let room = if way < Angle::ZERO { down } else { up };
            let (room, way) = (room.to_q29(), way.abs().to_q29());
            if way > room {
                share = share.min(i64::from(quotient_q30(room, way)) - 2);
            }
        }
        let share = share.max(0) >> (halvings & 31);
        Pose::from_angles(each(self.from, way, |from, way| {
            let part = (i64::from(way.to_q29()) * share) >> 30;
            from + Angle::from_q29(part as i32)
        }))
    }
}

/// Returns what becomes of two angles of each axis.
fn each(
    [a, b, c]: [Angle; 3],
    [d, e, f]: [Angle; 3],
    make: impl Fn(Angle, Angle) -> Angle,
) -> [Angle; 3] {
    [make(a, d), make(b, e), make(c, f)]
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
    #![expect(clippy::float_arithmetic, reason = "tests only")]

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
        Guide::default().admit(wanted, previous, PERIOD, &limits, &wrist)
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

    /// A box of which the legs do not reach the corners.
    fn wide_settings(scale: f64) -> Settings {
        let mut settings = settings();
        let range = settings.limits.workspace.angles();
        let wider = range.map(|end| Angle::from_q29((f64::from(end.to_q29()) * scale) as i32));
        settings.limits.workspace = Pose::from_angles(wider);
        settings
    }

    fn distance(one: &Pose, other: &Pose) -> f64 {
        let apart = [0, 1, 2].map(|k| {
            let difference = one.angles()[k] - other.angles()[k];
            f64::from(difference.to_q29()) / f64::from(1 << 29)
        });
        apart.iter().map(|part| part * part).sum::<f64>().sqrt()
    }

    #[test]
    fn a_target_is_approached_as_far_as_the_legs_reach() {
        let mut state = 0x0EE1_7A26_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1 << 30) - 1.0
        };
        let (mut ways, mut stuck, mut far) = (0, 0, 0.0f64);
        for round in 0..600 {
            let Settings { limits, wrist, .. } = wide_settings(1.26);
            let reach = Reach {
                range: limits.workspace,
                ..Reach::kernel()
            };
            let corner = limits.workspace.angles();
            let mut somewhere = || {
                Pose::from_angles(
                    corner.map(|end| Angle::from_q29((f64::from(end.to_q29()) * random()) as i32)),
                )
            };
            let start = wrist
                .nearest(&somewhere(), &reach)
                .expect("home is allowed")
                .pose;
            let target = if round % 2 == 0 {
                Pose::from_angles([0, 1, 2].map(|k| {
                    if round >> (k + 1) & 1 == 0 {
                        corner[k]
                    } else {
                        -corner[k]
                    }
                }))
            } else {
                somewhere()
            };
            let end = wrist
                .nearest(&target, &reach)
                .expect("home is allowed")
                .pose;
            let mut at = start;
            let mut guide = Guide::default();
            for _ in 0..200 {
                let (next, _) = guide.admit(target, at, PERIOD, &limits, &wrist);
                // The other nine ticks of a period.
                for _ in 0..9 {
                    guide.advance(&wrist);
                }
                assert!(wrist.inverse(&next).is_ok());
                let step = largest_step(limits.rate, PERIOD);
                for (one, other) in next.angles().into_iter().zip(at.angles()) {
                    assert!((one - other).abs() <= step);
                }
                at = next;
            }
            ways += 1;
            let missed = distance(&at, &end);
            far = far.max(missed);
            stuck += usize::from(missed > 0.01);
        }
        assert!(
            stuck == 0,
            "{stuck} of {ways} ways end more than 10 mrad short, the worst {far:.3} rad"
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
