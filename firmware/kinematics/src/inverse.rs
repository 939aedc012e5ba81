//! From a pose to the motors' angles.
//!
//! Everything is over √2, which no angle notices: the sum and the difference of roll's sine and
//! cosine then are those of roll + π/4 without a multiplication, and C/√2, E, F, G all fit Q30.

use eel_units::{Angle, arctangents, multiply_high, ratio_q30, root_near, sin_cos_near};

use crate::pose::{Joints, Pose, PoseError};
use crate::vector::{Vector, dot, high, times_root_two, wide};
use crate::wrist::{Pull, Wrist};

/// The least D/2 of a leg in Q28, the high half of its Q60: a margin of ¼.
pub(crate) const LEAST_SQUARE: i32 = 1 << 23;

/// What the inverse kinematics gives for a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inverse {
    /// The motors' angles, in the home working mode.
    pub joints: Joints,
    /// The serial margin, Q30: the lesser √D = (l×r)·i / ρ of the two legs.
    ///
    /// 1 at home, at least 0.57 in the paper's workspace, 0 where a crank and its rod line up.
    pub margin: i32,
}

/// What one leg gives: tan(θ/2) in Q31, and √D over √2 in Q30.
struct Solved {
    half_tangent: i32,
    margin: i32,
}

impl Wrist {
    /// Returns the motors' angles for a pose, wrong by at most 0.03 µrad in the paper's workspace.
    ///
    /// # Errors
    /// [`PoseError::OutOfReach`] where no configuration of the home working mode reaches the pose,
    /// or it lies beyond the range of the kernel; [`PoseError::Singular`] where the margin is below ¼.
    #[inline]
    pub fn inverse(&self, pose: &Pose) -> Result<Inverse, PoseError> {
        if !pose.is_near() {
            return Err(PoseError::OutOfReach);
        }
        let [first, second] = pose.points();
        let solved1 = self.legs[0].pull.solve(&first)?;
        let solved2 = self.legs[1].pull.solve(&second)?;
        // θ3 = π/4 + atan((y − x)/(y + x)) of C1. Within the kernel's range y + x is positive.
        let [x, y, _] = first;
        let third = small_ratio(y - x, y + x).ok_or(PoseError::OutOfReach)?;
        let [turn1, turn2, turn3] =
            arctangents([solved1.half_tangent, solved2.half_tangent, third]);
        // An arctangent in Q30, read in Q29, is twice itself: 2 atan(tan(θ/2)).
        let theta1 = turn1 - self.legs[0].zero.to_q29();
        let theta2 = turn2 - self.legs[1].zero.to_q29();
        let theta3 = Angle::FRAC_PI_4.to_q29() + (turn3 >> 1);
        Ok(Inverse {
            joints: Joints([theta1, theta2, theta3].map(Angle::from_q29)),
            margin: times_root_two(solved1.margin.min(solved2.margin)),
        })
    }
}

impl Pose {
    /// Tells whether yaw is within −1..1 rad, and pitch and roll within −½..½ rad.
    #[inline(always)]
    const fn is_near(&self) -> bool {
        let yaw = self.yaw.to_q29().wrapping_add(1 << 29) as u32;
        let pitch = self.pitch.to_q29().wrapping_add(1 << 28) as u32;
        let roll = self.roll.to_q29().wrapping_add(1 << 28) as u32;
        (yaw >> 1 | pitch | roll) < 1 << 29
    }

    /// Returns C1 and C2 over √2 in Q30, each wrong by at most 3 parts in 10⁹.
    #[inline(always)]
    fn points(&self) -> [Vector; 2] {
        let [(sy, cy), (sp, cp), (sr, cr)] = sin_cos_near([self.yaw, self.pitch, self.roll]);
        // Sine and cosine of roll + π/4, each over √2, in Q31; the others in Q31 too.
        let (sq, cq) = (cr + sr, cr - sr);
        let (sy, cy, sp, cp) = (sy << 1, cy << 1, sp << 1, cp << 1);
        // Their opposites to one step of 2⁻³¹, which one instruction makes.
        let (minus_sy, minus_cy) = (!sy, !cy);
        let spsq = multiply_high(sp, sq) << 1;
        let spcq = multiply_high(sp, cq) << 1;
        [
            [
                multiply_high(cp, cq),
                high(wide(cy, sq) + wide(sy, spcq)),
                high(wide(sy, sq) + wide(minus_cy, spcq)),
            ],
            [
                multiply_high(-cp, sq),
                high(wide(cy, cq) + wide(minus_sy, spsq)),
                high(wide(sy, cq) + wide(cy, spsq)),
            ],
        ]
    }
}

impl Pull {
    /// Solves E cos θ + F sin θ = G for the platform's point C over √2 (Q30).
    #[inline(always)]
    fn solve(&self, point: &Vector) -> Result<Solved, PoseError> {
        // All over 2ρ and √2. |E| ≤ 0.74, |F| ≤ 1.44, −0.9 ≤ G ≤ 2: within Q30.
        let e = point[1] - self.center[0];
        let f = point[2] - self.center[1];
        let g = self.offset - (dot(point, &self.slope) >> 30) as i32;
        // D/2 = E² + F² − G² in Q60.
        let square = wide(e, e) + wide(f, f) + wide(g, -g);
        let top = high(square);
        if top < LEAST_SQUARE {
            return Err(if top < 0 {
                PoseError::OutOfReach
            } else {
                PoseError::Singular
            });
        }
        let margin = root_near((square >> 29) as i32);
        // tan(θ/2) = (G − E)/(F + √D): the home working mode by construction. F + √D is positive.
        let half_tangent = small_ratio(g - e, f + margin).ok_or(PoseError::OutOfReach)?;
        Ok(Solved {
            half_tangent,
            margin,
        })
    }
}

/// Returns `number / divisor` in Q31 where it is within the arctangent's ±17/32.
#[inline(always)]
fn small_ratio(number: i32, divisor: i32) -> Option<i32> {
    let reach = (divisor >> 1) + (divisor >> 5);
    // The sum can pass 2³¹ (a unit at its tolerances, far out): as u32 it still is the sum.
    if number.wrapping_add(reach) as u32 >= (reach << 1) as u32 {
        return None;
    }
    Some(ratio_q30(number << 1, divisor))
}
