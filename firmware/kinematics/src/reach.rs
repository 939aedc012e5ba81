//! The reachable pose nearest to one that is not.
//!
//! What the wrist can reach is where all of a handful of smooth functions, the rooms, are positive: the
//! caller's box, the margins of the legs, the ranges of the cranks and of the third motor, the
//! assembly margin. Each step makes these functions planes at the present pose (differences of the
//! functions themselves), and takes the point of all the planes' positive sides that is nearest to the
//! target (Hildreth's iteration, the box included); where that is not allowed, the place on its way
//! home where it becomes so. The nearest of all steps counts. A control tick has
//! time for a piece of it: see [`Search`].

use eel_units::{Angle, quotient_q30, saturate};

use crate::inverse::Inverse;
use crate::pose::{Pose, PoseError};
use crate::vector::{Vector, dot, wide};
use crate::wrist::Wrist;

/// How many rooms there are besides the box: see [`Wrist::rooms`].
pub(crate) const ROOMS: usize = 6;
/// How often the planes are made anew.
const STEPS: usize = 4;
/// How often the planes are gone through each time.
const SWEEPS: usize = 12;
/// How often the way home is halved: while the planes are made, and at last.
const COARSE: u32 = 10;
const FINE: u32 = 14;
/// What a difference is taken over: 2⁻⁹ rad in Q29.
const DIFFERENCE: i32 = 1 << 20;
/// By how much a room has to be positive, in Q28: 4e-6.
const ROOM: i64 = 1 << 10;
/// The steepest slope that counts, Q14: slopes are 0.3 to 4 where rooms end.
const STEEPEST: i32 = 16 << 14;
/// The least square of a slope that makes a plane, Q24.
const LEAST_NORM: i32 = 1 << 16;
/// The most that a plane pushes at once, Q20, and the farthest that a point goes, Q24: no sum of any
/// planes leaves 32 bits.
const MOST_PUSH: i32 = 1 << 26;
const FARTHEST: i32 = 1 << 30;
/// The kernel's own range in Q29, both ways: 1 rad of yaw, ½ rad of pitch and roll.
const RANGE: Vector = [(1 << 29) - 1, (1 << 28) - 1, (1 << 28) - 1];
/// The kernel's own least margin, Q30: ¼.
pub(crate) const LEAST_MARGIN: i32 = 1 << 28;

/// Where the wrist may go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reach {
    /// The largest magnitude of each angle.
    pub range: Pose,
    /// The least serial margin, Q30; below the kernel's own ¼ that counts.
    pub margin: i32,
}

impl Reach {
    /// Returns everything that the kernel reaches.
    pub const fn kernel() -> Self {
        let [yaw, pitch, roll] = RANGE;
        Self {
            range: Pose::from_angles([
                Angle::from_q29(yaw),
                Angle::from_q29(pitch),
                Angle::from_q29(roll),
            ]),
            margin: LEAST_MARGIN,
        }
    }
}

/// Why a target is not reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// An angle is beyond the range that is allowed.
    Range,
    /// No configuration of the home branch reaches it, or a motor would turn too far.
    OutOfReach,
    /// A margin would be too small.
    Singular,
}

/// The pose that comes nearest to a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nearest {
    /// The pose; the target itself where nothing is in the way.
    pub pose: Pose,
    /// Its motors' angles and margin.
    pub inverse: Inverse,
    /// What is in the way of the target.
    pub obstacle: Option<Obstacle>,
}

/// A plane n·x ≥ c, x in Q24 radians, with what it pushes so far.
#[derive(Clone, Copy, Debug, Default)]
struct Plane {
    /// Q14, within ±16.
    normal: Vector,
    /// Q38.
    least: i64,
    /// One over n·n, Q20; zero where the room hardly changes.
    inverse: i32,
    /// Q20.
    push: i32,
}

impl Wrist {
    /// Returns the reachable pose nearest to a target, as the sum of the squares of yaw, pitch and
    /// roll measures it.
    ///
    /// Its distance from the target is within 1 % and 1 mrad of the least in a box about the paper's, 10 % in
    /// all of the kernel's range, 20 % for targets far beyond it. An allowed target comes back unchanged.
    ///
    /// # Errors
    /// Those of [`Wrist::inverse`] where not even home is allowed: a margin close to 1, or a unit out
    /// of tolerance.
    pub fn nearest(&self, target: &Pose, reach: &Reach) -> Result<Nearest, PoseError> {
        let obstacle = match self.allowed(target, reach) {
            Ok(inverse) => {
                return Ok(Nearest {
                    pose: *target,
                    inverse,
                    obstacle: None,
                });
            }
            Err(obstacle) => obstacle,
        };
        let mut search = Search::new(target, reach);
        while search.advance(self) {}
        let pose = search.best().unwrap_or_default();
        let inverse = self.inverse(&pose)?;
        if inverse.margin() < reach.margin {
            return Err(PoseError::Singular);
        }
        Ok(Nearest {
            pose,
            inverse,
            obstacle: Some(obstacle),
        })
    }

    /// Returns the answer for a pose that is allowed, or what is in its way.
    fn allowed(&self, pose: &Pose, reach: &Reach) -> Result<Inverse, Obstacle> {
        let inside = to_q29(pose)
            .into_iter()
            .zip(reach.box_q29())
            .all(|(angle, range)| angle >= -range && angle <= range);
        if !inside {
            return Err(Obstacle::Range);
        }
        match self.inverse(pose) {
            Ok(inverse) if inverse.margin() >= reach.margin => Ok(inverse),
            Ok(_) | Err(PoseError::Singular) => Err(Obstacle::Singular),
            Err(PoseError::OutOfReach) => Err(Obstacle::OutOfReach),
        }
    }

    /// Returns the planes that the rooms are at `pose`.
    fn planes(&self, pose: &[i32; 3], margin: i32) -> [Plane; ROOMS] {
        let here = self.rooms(&from_q29(*pose), margin);
        let mut planes = [Plane::default(); ROOMS];
        for axis in 0..3 {
            // Inwards, so that the kernel's range is never left.
            let aside = if pose[axis] > 0 {
                -DIFFERENCE
            } else {
                DIFFERENCE
            };
            let mut moved = *pose;
            moved[axis] += aside;
            let there = self.rooms(&from_q29(moved), margin);
            for (plane, (there, here)) in planes.iter_mut().zip(there.into_iter().zip(here)) {
                // Q28 over 2⁻⁹ is Q28 << 9: Q14 is that >> 14.
                let slope = saturate((i64::from(there) - i64::from(here)) >> 5);
                let slope = slope.clamp(-STEEPEST, STEEPEST);
                plane.normal[axis] = if aside > 0 { slope } else { -slope };
            }
        }
        let at = pose.map(|angle| angle >> 5); // Q24
        for (plane, room) in planes.iter_mut().zip(here) {
            plane.least = dot(&plane.normal, &at) - ((i64::from(room) - ROOM) << 10);
            let norm = saturate(dot(&plane.normal, &plane.normal) >> 4); // Q24
            if norm >= LEAST_NORM {
                plane.inverse = quotient_q30(1 << 14, norm);
            }
        }
        planes
    }
}

/// The way home from a pose, halved until the place is known where it becomes allowed.
#[derive(Clone, Copy, Debug)]
struct Homing {
    from: Vector,
    halvings: u32,
    left: u32,
    /// Parts of the way in 2⁻ʰ: `good` is allowed.
    good: i32,
    bad: i32,
    has_begun: bool,
}

impl Homing {
    const fn new(from: Vector, halvings: u32) -> Self {
        Self {
            from,
            halvings,
            left: halvings,
            good: 0,
            bad: 1 << (halvings & 31),
            has_begun: false,
        }
    }

    fn part(&self, share: i32) -> Vector {
        self.from
            .map(|angle| (wide(angle, share) >> (self.halvings & 31)) as i32)
    }

    /// Looks at some places; returns the pose itself or where it becomes allowed, when it is done.
    fn advance(&mut self, wrist: &Wrist, reach: &Reach, places: u32) -> Option<Vector> {
        for _ in 0..places {
            if !self.has_begun {
                self.has_begun = true;
                if wrist.allowed(&from_q29(self.from), reach).is_ok() {
                    return Some(self.from);
                }
            } else if self.left > 0 {
                self.left -= 1;
                let middle = (self.good + self.bad) >> 1;
                let is_good = wrist.allowed(&from_q29(self.part(middle)), reach).is_ok();
                let end = if is_good {
                    &mut self.good
                } else {
                    &mut self.bad
                };
                *end = middle;
            }
            if self.left == 0 {
                return Some(self.part(self.good));
            }
        }
        None
    }
}

/// What a search does next.
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap to put the planes on"
)]
#[derive(Clone, Copy, Debug)]
enum Stage {
    /// From the target, or a point of the planes, towards home.
    Homing(Homing),
    /// Makes planes at the pose.
    Planes,
    /// Finds the point of the planes.
    Projecting(Projection),
    /// Finds exactly where the best way home becomes allowed.
    Ending(Homing),
    Ended,
}

/// The search for the reachable pose that is nearest to a target, piece by piece: each
/// [`Search::advance`] takes at most as long as five inverse kinematics.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    reach: Reach,
    wanted: Vector,
    pose: Vector,
    /// The nearest place so far with its distance, and what it is on the way home from.
    best: Option<(i64, Vector)>,
    source: Vector,
    stage: Stage,
    steps: usize,
}

impl Search {
    /// Places that a piece looks at, and sweeps that it does.
    const PLACES: u32 = 4;
    const SWEEPS: usize = 6;

    /// Starts for a target that is not allowed.
    pub fn new(target: &Pose, reach: &Reach) -> Self {
        let wanted = to_q29(target);
        let range = reach.box_q29();
        let boxed = [0, 1, 2].map(|axis| wanted[axis].max(-range[axis]).min(range[axis]));
        Self {
            reach: *reach,
            wanted,
            pose: boxed,
            best: None,
            source: boxed,
            stage: Stage::Homing(Homing::new(boxed, COARSE)),
            steps: 0,
        }
    }

    /// Starts for another target where the search for the one before has come.
    pub fn retarget(&mut self, target: &Pose) {
        let Some((_, pose)) = self.best else {
            *self = Self::new(target, &self.reach);
            return;
        };
        let wanted = to_q29(target);
        *self = Self {
            wanted,
            pose,
            best: Some((distance(&pose, &wanted), pose)),
            source: pose,
            stage: Stage::Planes,
            steps: 0,
            ..*self
        };
    }

    /// Returns the target.
    pub fn target(&self) -> Pose {
        from_q29(self.wanted)
    }

    /// Returns the nearest allowed pose so far; home where only that is.
    pub fn best(&self) -> Option<Pose> {
        self.best.map(|(_, pose)| from_q29(pose))
    }

    /// Does a piece of the search. Tells whether there is more to do.
    pub fn advance(&mut self, wrist: &Wrist) -> bool {
        match &mut self.stage {
            Stage::Homing(homing) => {
                let source = homing.from;
                if let Some(pose) = homing.advance(wrist, &self.reach, Self::PLACES) {
                    self.arrive(pose, source);
                }
            }
            Stage::Planes => {
                let margin = self.reach.margin.max(LEAST_MARGIN);
                let planes = wrist.planes(&self.pose, margin);
                let range = self.reach.box_q29();
                self.stage = Stage::Projecting(Projection::new(planes, &self.wanted, &range));
            }
            Stage::Projecting(projection) => {
                if let Some(next) = projection.advance(Self::SWEEPS) {
                    self.stage = Stage::Homing(Homing::new(next, COARSE));
                }
            }
            Stage::Ending(homing) => {
                if let Some(pose) = homing.advance(wrist, &self.reach, Self::PLACES) {
                    self.best = Some((distance(&pose, &self.wanted), pose));
                    self.stage = Stage::Ended;
                }
            }
            Stage::Ended => {}
        }
        !matches!(self.stage, Stage::Ended)
    }

    /// Takes an allowed pose and goes on from there, or ends.
    fn arrive(&mut self, pose: Vector, source: Vector) {
        let is_first = self.best.is_none();
        let length = distance(&pose, &self.wanted);
        if self.best.is_none_or(|(least, _)| length < least) {
            self.best = Some((length, pose));
            self.source = source;
        }
        self.pose = pose;
        self.steps += usize::from(!is_first);
        // A box that is allowed itself has no nearer place.
        let is_box = is_first && pose == source;
        self.stage = if is_box || self.steps == STEPS {
            Stage::Ending(Homing::new(self.source, FINE))
        } else {
            Stage::Planes
        };
    }
}

impl Reach {
    /// Returns the box within the kernel's own, Q29.
    fn box_q29(&self) -> [i32; 3] {
        let asked = to_q29(&self.range);
        [0, 1, 2].map(|axis| asked[axis].clamp(0, RANGE[axis]))
    }
}

/// Returns yaw, pitch and roll in Q29.
fn to_q29(pose: &Pose) -> Vector {
    pose.angles().map(Angle::to_q29)
}

/// Makes a pose of yaw, pitch and roll in Q29.
fn from_q29(angles: Vector) -> Pose {
    Pose::from_angles(angles.map(Angle::from_q29))
}

/// Returns the square of the distance between two points of Q29, Q48.
fn distance(one: &Vector, other: &Vector) -> i64 {
    let apart = [0, 1, 2].map(|axis| (one[axis] >> 5) - (other[axis] >> 5));
    dot(&apart, &apart)
}

/// Hildreth's iteration: the point nearest to `wanted` on the positive side of every plane and in the
/// box.
#[derive(Clone, Copy, Debug)]
struct Projection {
    planes: [Plane; ROOMS],
    /// Q24, as all of these.
    point: Vector,
    held: Vector,
    range: Vector,
    sweeps: usize,
}

impl Projection {
    /// Starts at `wanted`; angles in Q29.
    fn new(planes: [Plane; ROOMS], wanted: &Vector, range: &Vector) -> Self {
        Self {
            planes,
            point: wanted.map(|angle| angle >> 5),
            held: [0; 3],
            range: range.map(|angle| angle >> 5),
            sweeps: SWEEPS,
        }
    }

    /// Goes through all planes some times; returns the point, Q29, when it is done.
    fn advance(&mut self, sweeps: usize) -> Option<Vector> {
        for _ in 0..sweeps.min(self.sweeps) {
            self.sweep();
        }
        self.sweeps = self.sweeps.saturating_sub(sweeps);
        let (point, range) = (&self.point, &self.range);
        (self.sweeps == 0)
            .then(|| [0, 1, 2].map(|axis| point[axis].max(-range[axis]).min(range[axis]) << 5))
    }

    fn sweep(&mut self) {
        let (point, held, range) = (&mut self.point, &mut self.held, &self.range);
        for axis in 0..3 {
            let free = point[axis] - held[axis];
            point[axis] = free.max(-range[axis]).min(range[axis]);
            held[axis] = point[axis] - free;
        }
        for plane in &mut self.planes {
            // What is missing, Q38 to Q24.
            let missing = saturate((plane.least - dot(&plane.normal, point)) >> 14);
            if missing < 0 && plane.push == 0 {
                continue;
            }
            let change = saturate(wide(missing, plane.inverse) >> 24);
            // What it pushes stays positive; every point within ±64 rad.
            let change = change.clamp(-MOST_PUSH, MOST_PUSH).max(-plane.push);
            plane.push += change;
            for (component, normal) in point.iter_mut().zip(plane.normal) {
                let moved = i64::from(*component) + (wide(change, normal) >> 10);
                *component = saturate(moved).clamp(-FARTHEST, FARTHEST);
            }
        }
    }
}
