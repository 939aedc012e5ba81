//! The reachable pose nearest to one that is not.
//!
//! What the wrist can reach is where all of a handful of smooth functions, the rooms, are positive: the
//! caller's box, the margins of the legs, the ranges of the cranks and of the third motor, the
//! assembly margin. Each step makes these functions planes at the present pose (differences of the
//! functions themselves), and takes the point of all the planes' positive sides that is nearest to the
//! target (Hildreth's iteration, the box included); where that is not allowed, the place on its way
//! home where it becomes so. The nearest of all steps counts. Bounded work: for targets, once a SYNC, not for the control tick.

use eel_units::{Angle, saturate};

use crate::inverse::Inverse;
use crate::pose::{Pose, PoseError};
use crate::wrist::Wrist;

/// How many rooms there are besides the box: see [`Wrist::rooms`].
pub(crate) const ROOMS: usize = 6;
/// How often the planes are made anew.
const STEPS: usize = 6;
/// How often the planes are gone through each time.
const SWEEPS: usize = 16;
/// How often the way home is halved.
const HALVINGS: usize = 14;
/// What a difference is taken over: 2⁻⁹ rad in Q29.
const DIFFERENCE: i32 = 1 << 20;
/// By how much a room has to be positive, in Q28: 4e-6.
const ROOM: i64 = 1 << 10;
/// The least square of a slope that makes a plane, Q28: slopes are 0.3 to 4 where rooms end.
const LEAST_NORM: i64 = 1 << 20;
/// The most that a plane pushes at once, Q20: it keeps sums of any planes within 64 bits.
const MOST_PUSH: i64 = 1 << 27;
/// The kernel's own range in Q29, a little less: 0.96 rad of yaw, 0.49 rad of pitch and roll.
const RANGE: [i32; 3] = [515_396_075, 263_066_746, 263_066_746];

/// Where the wrist may go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reach {
    /// The largest magnitude of each angle.
    pub range: Pose,
    /// The least serial margin, Q30; ¼ is the kernel's own.
    pub margin: i32,
}

impl Reach {
    /// Returns everything that the kernel reaches.
    pub const fn kernel() -> Self {
        let [yaw, pitch, roll] = RANGE;
        Self {
            range: Pose {
                yaw: Angle::from_q29(yaw),
                pitch: Angle::from_q29(pitch),
                roll: Angle::from_q29(roll),
            },
            margin: 1 << 28,
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

/// A plane n·x ≥ c, x in Q24 radians, n in Q14, with what it pushes so far.
#[derive(Clone, Copy, Default)]
struct Plane {
    normal: [i64; 3],
    /// Q38.
    least: i64,
    /// One over n·n, Q20.
    inverse: i64,
    /// Q20.
    push: i64,
}

impl Wrist {
    /// Returns the reachable pose nearest to a target, as the sum of the squares of yaw, pitch and
    /// roll measures it.
    ///
    /// Its distance from the target is within 2 % and 1 mrad of the least. A target that is allowed
    /// comes back unchanged. Some 150 answers' worth of work where it is not.
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
        let wanted = target.to_array();
        let boxed = [0, 1, 2].map(|axis| wanted[axis].max(-range[axis]).min(range[axis]));
        let mut pose = self.towards_home(boxed, reach);
        let mut best = pose;
        if pose != boxed {
            for _ in 0..STEPS {
                let next = self.step(&pose, &wanted, &range, reach.margin);
                pose = self.towards_home(next, reach);
                if distance(&pose, &wanted) < distance(&best, &wanted) {
                    best = pose;
                }
            }
        }
        let found = Pose::from_array(best);
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
        let inside = pose
            .to_array()
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
        let here = self.rooms(&Pose::from_array(*pose), margin);
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
            let there = self.rooms(&Pose::from_array(moved), margin);
            for (plane, (there, here)) in planes.iter_mut().zip(there.into_iter().zip(here)) {
                // Q28 over 2⁻⁹ is Q28 << 9: Q14 is that >> 14.
                let slope = (i64::from(there) - i64::from(here)) >> 5;
                plane.normal[axis] = if aside > 0 { slope } else { -slope };
            }
        }
        let at = pose.map(|angle| i64::from(angle >> 5)); // Q24
        for (plane, room) in planes.iter_mut().zip(here) {
            plane.least = product(&plane.normal, &at) - ((i64::from(room) - ROOM) << 10);
            let norm = product(&plane.normal, &plane.normal); // Q28
            // A room that hardly changes makes no plane.
            plane.inverse = if norm < LEAST_NORM {
                0
            } else {
                (1i64 << 48).checked_div(norm).unwrap_or_default()
            };
        }
        project(&mut planes, wanted, range)
    }

    /// Returns the pose, or where on the way home it becomes an allowed one.
    fn towards_home(&self, pose: [i32; 3], reach: &Reach) -> [i32; 3] {
        if self.allowed(&Pose::from_array(pose), reach).is_ok() {
            return pose;
        }
        // Parts of the way in 2⁻¹⁴: `good` is allowed.
        let (mut good, mut bad) = (0, 1 << HALVINGS);
        let part = |share: i64| pose.map(|angle| ((i64::from(angle) * share) >> HALVINGS) as i32);
        for _ in 0..HALVINGS {
            let middle = (good + bad) >> 1;
            if self.allowed(&Pose::from_array(part(middle)), reach).is_ok() {
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
        let asked = self.range.to_array();
        [0, 1, 2].map(|axis| asked[axis].clamp(0, RANGE[axis]))
    }
}

impl Pose {
    /// Returns yaw, pitch and roll in Q29.
    pub(crate) const fn to_array(self) -> [i32; 3] {
        [self.yaw.to_q29(), self.pitch.to_q29(), self.roll.to_q29()]
    }

    /// Makes a pose of yaw, pitch and roll in Q29.
    pub(crate) const fn from_array([yaw, pitch, roll]: [i32; 3]) -> Self {
        Self {
            yaw: Angle::from_q29(yaw),
            pitch: Angle::from_q29(pitch),
            roll: Angle::from_q29(roll),
        }
    }
}

/// Returns the square of the distance between two points of Q29, Q48.
fn distance(one: &[i32; 3], other: &[i32; 3]) -> i64 {
    let apart = [0, 1, 2].map(|axis| (i64::from(one[axis]) - i64::from(other[axis])) >> 5);
    product(&apart, &apart)
}

/// Returns a · b, the sum of the formats.
fn product(a: &[i64; 3], b: &[i64; 3]) -> i64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Hildreth's iteration: the point nearest to `wanted` on the positive side of every plane and in the
/// box; angles in Q29.
fn project(planes: &mut [Plane; ROOMS], wanted: &[i32; 3], range: &[i32; 3]) -> [i32; 3] {
    let range = range.map(|angle| i64::from(angle >> 5));
    // Not so far that the sums overflow.
    let mut point = wanted.map(|angle| i64::from(angle >> 5).clamp(-(2 << 24), 2 << 24));
    let mut held = [0i64; 3];
    for _ in 0..SWEEPS {
        for axis in 0..3 {
            let free = point[axis] - held[axis];
            point[axis] = free.max(-range[axis]).min(range[axis]);
            held[axis] = point[axis] - free;
        }
        for plane in planes.iter_mut() {
            // What is missing, Q38 to Q24, over n·n.
            let missing = (plane.least - product(&plane.normal, &point)) >> 14;
            let change = ((missing * plane.inverse) >> 24).clamp(-MOST_PUSH, MOST_PUSH);
            let change = change.max(-plane.push);
            plane.push += change;
            for (component, normal) in point.iter_mut().zip(plane.normal) {
                *component += (change * normal) >> 10;
            }
        }
    }
    [0, 1, 2].map(|axis| {
        let bounded = point[axis].max(-range[axis]).min(range[axis]);
        saturate(bounded << 5)
    })
}
