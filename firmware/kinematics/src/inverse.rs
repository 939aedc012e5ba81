//! From a pose to the motors' angles.
//!
//! Everything is over √2, which no angle notices: the sum and the difference of roll's sine and
//! cosine then are those of roll + π/4 without a multiplication, and C/√2, E, F, G all fit Q30.

use eel_units::{
    Angle, arctangents_of, multiply_high, multiply_high_add, quadruple_square, ratio_q30,
    root_near, sin_cos_near,
};

use crate::direct::LEAST_ASSEMBLY_SQUARE;
use crate::pose::{Joints, Pose, PoseError};
use crate::reach::{LEAST_MARGIN, ROOMS};
use crate::vector::{Vector, dot, high, times_root_two, wide};
use crate::wrist::{Pull, Wrist};

/// The least D/2 of a leg in Q28, the high half of its Q60: a margin of ¼.
pub(crate) const LEAST_SQUARE: i32 = 1 << 23;

/// The least assembly margin W2 in Q28: ¾, where home has √2. The direct kinematics has the same.
pub(crate) const LEAST_ASSEMBLY: i32 = 3 << 26;

// One limit, in the formats of both directions; and one margin, with half of its square.
const _: () = assert!(wide(LEAST_ASSEMBLY, LEAST_ASSEMBLY) >> 30 == LEAST_ASSEMBLY_SQUARE as i64);
const _: () = assert!(half_square(LEAST_MARGIN) == LEAST_SQUARE);

/// Returns half of a margin's square in Q28, of a margin in Q30.
const fn half_square(margin: i32) -> i32 {
    high(wide(margin, margin)) >> 1
}

/// What the inverse kinematics gives for a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inverse {
    /// The motors' angles, in the home working mode.
    pub joints: Joints,
    /// The lesser √D of the two legs over √2, Q30.
    root: i32,
}

impl Inverse {
    /// Returns the serial margin in Q30: the lesser √D = (l×r)·i / ρ of the two legs.
    ///
    /// 1 at home, at least 0.57 in the paper's workspace, 0 where a crank and its rod line up.
    #[inline]
    pub fn margin(&self) -> i32 {
        times_root_two(self.root)
    }
}

/// The platform of a pose.
pub(crate) struct Platform {
    /// C1 and C2 over √2 in Q30, each coordinate wrong by at most 9 parts in 10⁹.
    pub points: [Vector; 2],
    /// Its z axis, C1 × C2, in Q30.
    pub normal: Vector,
}

/// E, F, G of a leg in Q30, and D/2 = E² + F² − G² in Q60.
struct Terms {
    e: i32,
    f: i32,
    g: i32,
    square: i64,
}

/// What one leg gives: tan(θ/2) in Q31, and √D over √2 in Q30.
struct Solved {
    half_tangent: i32,
    /// (2 tan(θ/2))² in Q30.
    square: i32,
    margin: i32,
}

impl Wrist {
    /// Returns the motors' angles for a pose, wrong by at most 0.03 µrad in the paper's workspace.
    ///
    /// # Errors
    /// [`PoseError::OutOfReach`] where no configuration of the home working mode reaches the pose,
    /// or it lies beyond the range of the kernel; [`PoseError::Singular`] where the serial
    /// margin is below ¼ or the assembly margin of leg 2 has shrunk to about half of home's.
    #[inline]
    pub fn inverse(&self, pose: &Pose) -> Result<Inverse, PoseError> {
        if !pose.is_near() {
            return Err(PoseError::OutOfReach);
        }
        let Platform {
            points: [first, second],
            normal,
        } = pose.platform();
        // θ3 = π/4 + atan((y − x)/(y + x)) of C1. Within the kernel's range y + x is positive.
        let [x, y, _] = first;
        let third = small_ratio(y - x, y + x).ok_or(PoseError::OutOfReach)?;
        let solved1 = self.legs[0].pull.solve(&first)?;
        let solved2 = self.legs[1].pull.solve(&second)?;
        if self.legs[1].pull.assembly_room(&normal, &solved2) < 0 {
            return Err(PoseError::Singular);
        }
        let [turn1, turn2, turn3] = arctangents_of(
            [solved1.half_tangent, solved2.half_tangent, third],
            [solved1.square, solved2.square, quadruple_square(third)],
        );
        // An arctangent in Q30, read in Q29, is twice itself: 2 atan(tan(θ/2)).
        let theta1 = turn1 - self.legs[0].zero.to_q29();
        let theta2 = turn2 - self.legs[1].zero.to_q29();
        let theta3 = Angle::FRAC_PI_4.to_q29() + (turn3 >> 1);
        Ok(Inverse {
            joints: Joints([theta1, theta2, theta3].map(Angle::from_q29)),
            root: solved1.margin.min(solved2.margin),
        })
    }

    /// Returns how far a pose of the kernel's range is from what the inverse refuses, in Q28: each
    /// leg's D/2 above that of `margin`, each crank's and the third motor's way to its end, the
    /// assembly room. Continuous; all positive where the inverse answers with that margin.
    pub(crate) fn rooms(&self, pose: &Pose, margin: i32) -> [i32; ROOMS] {
        let Platform {
            points: [first, second],
            normal,
        } = pose.platform();
        let least = half_square(margin);
        let [one, other] = [
            self.legs[0].pull.room(&first, least),
            self.legs[1].pull.room(&second, least),
        ];
        let [x, y, _] = first;
        let third = end(y + x) - (y - x).abs();
        [
            one.square,
            other.square,
            one.turn,
            other.turn,
            third >> 2,
            self.legs[1].pull.assembly_room(&normal, &other.solved),
        ]
    }
}

/// How far a leg is from its limits.
struct Room {
    /// D/2 less the least, Q28.
    square: i32,
    /// 17/32 (F + √D) − |G − E|, Q28.
    turn: i32,
    /// The leg as if it were within them: tan(θ/2) held within ±17/32, √D at the kernel's least.
    solved: Solved,
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

    /// Returns the platform of a pose that is near.
    #[inline(always)]
    pub(crate) fn platform(&self) -> Platform {
        let [(sy, cy), (sp, cp), (sr, cr)] = sin_cos_near([self.yaw, self.pitch, self.roll]);
        // Sine and cosine of roll + π/4, each over √2, in Q31; the others in Q31 too.
        let (sq, cq) = (cr + sr, cr - sr);
        let zx = sp;
        let (sy, cy, sp, cp) = (sy << 1, cy << 1, sp << 1, cp << 1);
        // Their opposites to one step of 2⁻³¹, which one instruction makes.
        let (minus_sy, minus_cy, minus_cp) = (!sy, !cy, !cp);
        let spsq = multiply_high(sp, sq) << 1;
        let spcq = multiply_high(sp, cq) << 1;
        Platform {
            points: [
                [
                    multiply_high(cp, cq),
                    high(wide(cy, sq) + wide(sy, spcq)),
                    high(wide(sy, sq) + wide(minus_cy, spcq)),
                ],
                [
                    multiply_high(minus_cp, sq),
                    high(wide(cy, cq) + wide(minus_sy, spsq)),
                    high(wide(sy, cq) + wide(cy, spsq)),
                ],
            ],
            normal: [zx, multiply_high(minus_sy, cp), multiply_high(cy, cp)],
        }
    }
}

impl Pull {
    /// Solves E cos θ + F sin θ = G for the platform's point C over √2 (Q30).
    #[inline(always)]
    fn solve(&self, point: &Vector) -> Result<Solved, PoseError> {
        let Terms { e, f, g, square } = self.terms(point);
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
            square: quadruple_square(half_tangent),
            margin,
        })
    }

    /// Returns the terms of E cos θ + F sin θ = G, all over 2ρ and √2.
    #[inline(always)]
    fn terms(&self, point: &Vector) -> Terms {
        // |E| ≤ 0.74, |F| ≤ 1.44, −0.9 ≤ G ≤ 2: within Q30.
        let e = point[1] - self.center[0];
        let f = point[2] - self.center[1];
        let g = self.offset - (dot(point, &self.slope) >> 30) as i32;
        let square = wide(e, e) + wide(f, f) + wide(g, -g);
        Terms { e, f, g, square }
    }

    /// Returns how far the leg is from its limits, for any point of the kernel's range.
    fn room(&self, point: &Vector, least: i32) -> Room {
        let Terms { e, f, g, square } = self.terms(point);
        // Below the kernel's own margin as if it were that: continuous, and F + √D stays positive.
        let top = high(square);
        let margin = if top < LEAST_SQUARE {
            root_near(LEAST_SQUARE << 3)
        } else {
            root_near((square >> 29) as i32)
        };
        let below = f + margin;
        let end = end(below);
        let above = g.saturating_sub(e);
        let half_tangent = ratio_q30(above.max(-end).min(end) << 1, below);
        Room {
            square: top - least,
            turn: (end >> 2) - (above.saturating_abs() >> 2),
            solved: Solved {
                half_tangent,
                square: quadruple_square(half_tangent),
                margin,
            },
        }
    }

    /// Returns (W − ¾)(1 + tan²(θ/2)) of leg 2 in Q28: below zero where the assembly margin W is too small.
    ///
    /// det A is ρ1 ρ2 W1 W2, and W2 = −(B/ρ)·(C1 × C2) with the crank's end B: a linear function of
    /// the crank's sine and cosine, so that no division is needed. W1 is 0.7 and more wherever the
    /// other limits hold: a pose beyond the parallel singularity has no answer.
    #[inline(always)]
    fn assembly_room(&self, normal: &Vector, solved: &Solved) -> i32 {
        let center = -high(dot(&self.slope, normal)) - LEAST_ASSEMBLY;
        let along = normal[1] >> 2;
        multiply_high_add(center - along, center + along, solved.square)
            - multiply_high(solved.half_tangent, normal[2])
    }
}

/// Returns 17/32 of a divisor: where the arctangent's range ends.
#[inline(always)]
const fn end(divisor: i32) -> i32 {
    (divisor >> 1) + (divisor >> 5)
}

/// Returns `number / divisor` in Q31 where it is within the arctangent's ±17/32.
#[inline(always)]
fn small_ratio(number: i32, divisor: i32) -> Option<i32> {
    let reach = end(divisor);
    // The sum can pass 2³¹ (a unit at its tolerances, far out): as u32 it still is the sum.
    if number.wrapping_add(reach) as u32 >= (reach << 1) as u32 {
        return None;
    }
    Some(ratio_q30(number << 1, divisor))
}
