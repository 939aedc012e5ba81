//! The reachable pose nearest to one that is not.
//!
//! What the wrist can reach is where all of a handful of smooth functions, the rooms, are positive: the
//! caller's box, the margins of the legs, the ranges of the cranks and of the third motor, the
//! assembly margin. Each step makes these functions planes at the present pose (differences of the
//! functions themselves), and takes the point of all the planes' positive sides that is nearest to the
//! target (Hildreth's iteration, the box included); where that is not allowed, the place on its way
//! home where it becomes so. The nearest of all steps counts. Bounded work: for targets, once a SYNC, not
//! for the control tick.

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
#[derive(Clone, Copy, Default)]
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
        let range = reach.box_q29();
        let wanted = to_q29(target);
        let boxed = [0, 1, 2].map(|axis| wanted[axis].max(-range[axis]).min(range[axis]));
        let mut pose = self.towards_home(&boxed, reach, COARSE);
        // The nearest place so far, and what it is on the way home from.
        let (mut best, mut source) = (distance(&pose, &wanted), boxed);
        if pose != boxed {
            for _ in 0..STEPS {
                let next = self.step(&pose, &wanted, &range, reach.margin.max(LEAST_MARGIN));
                pose = self.towards_home(&next, reach, COARSE);
                let length = distance(&pose, &wanted);
                if length < best {
                    (best, source) = (length, next);
                }
            }
        }
        let found = from_q29(self.towards_home(&source, reach, FINE));
        let inverse = self.inverse(&found)?;
        if inverse.margin() < reach.margin {
            return Err(PoseError::Singular);
        }
        Ok(Nearest {
            pose: found,
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

    /// Returns the point nearest to `wanted` that all planes at `pose` and the box allow.
    fn step(&self, pose: &[i32; 3], wanted: &[i32; 3], range: &[i32; 3], margin: i32) -> [i32; 3] {
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
        project(&mut planes, wanted, range)
    }

    /// Returns the pose, or where on the way home it becomes an allowed one, to 2⁻ʰ of the way.
    fn towards_home(&self, pose: &[i32; 3], reach: &Reach, halvings: u32) -> [i32; 3] {
        if self.allowed(&from_q29(*pose), reach).is_ok() {
            return *pose;
        }
        // Parts of the way in 2⁻ʰ: `good` is allowed.
        let (mut good, mut bad) = (0, 1 << (halvings & 31));
        let part = |share: i32| pose.map(|angle| (wide(angle, share) >> (halvings & 31)) as i32);
        for _ in 0..halvings {
            let middle = (good + bad) >> 1;
            if self.allowed(&from_q29(part(middle)), reach).is_ok() {
                good = middle;
            } else {
                bad = middle;
            }
        }
        part(good)
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
/// box; angles in Q29.
fn project(planes: &mut [Plane; ROOMS], wanted: &Vector, range: &Vector) -> Vector {
    let range = range.map(|angle| angle >> 5);
    let mut point = wanted.map(|angle| angle >> 5);
    let mut held = [0; 3];
    for _ in 0..SWEEPS {
        for axis in 0..3 {
            let free = point[axis] - held[axis];
            point[axis] = free.max(-range[axis]).min(range[axis]);
            held[axis] = point[axis] - free;
        }
        for plane in planes.iter_mut() {
            // What is missing, Q38 to Q24.
            let missing = saturate((plane.least - dot(&plane.normal, &point)) >> 14);
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
    [0, 1, 2].map(|axis| point[axis].max(-range[axis]).min(range[axis]) << 5)
}
