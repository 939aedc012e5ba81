//! From the motors' angles to the platform, with its Jacobian.
//!
//! Leg 1 fixes φ and leg 2 then ψ, each by an equation K cos α + M sin α = N whose root nearest to
//! zero is tan(α/2) = (M ∓ W)/(N + K), with W = √(K² + M² − N²): the home assembly mode by construction.

use eel_units::{Angle, multiply_high, multiply_high_add, ratio_q30, root_near, sin_cos_near};

use crate::jacobian::{Basis, First, Jacobian, Second};
use crate::pose::{Joints, PoseError};
use crate::rotation::Rotation;
use crate::vector::{Vector, dot, high, times_root_two, wide};
use crate::wrist::{Push, Wrist};

/// The least assembly margin of a leg, W = ¾ where home has √2: its square in Q26.
pub(crate) const LEAST_ASSEMBLY_SQUARE: i32 = 9 << 22;
/// The least serial margin: ⅛ in Q30.
pub(crate) const LEAST_SERIAL: i32 = 1 << 27;

/// What the direct kinematics gives for three motor angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Direct {
    /// The platform's orientation, in the home assembly mode.
    pub rotation: Rotation,
    /// Rates and torques there, and the parallel margin det A.
    pub jacobian: Jacobian,
    serial: i32,
}

impl Direct {
    /// Returns the serial margin in Q30: the lesser (l×r)·i / ρ of the two legs, as the inverse gives it.
    ///
    /// The parallel margin is [`Jacobian::det_a`].
    #[inline]
    pub const fn margin(&self) -> i32 {
        self.serial
    }
}

/// One leg with its crank turned: what the platform has to meet.
struct Crank {
    sine: i32,
    cosine: i32,
    /// −B / ρ, the crank's end, Q29.
    back: Vector,
    /// (1 + B·B − s²) / 2ρ, which C · B / ρ must equal; Q29.
    offset: i32,
}

/// The root of K cos α + M sin α = N.
struct Root {
    sine: i32,
    cosine: i32,
    /// W, Q29.
    margin: i32,
}

impl Wrist {
    /// Returns the platform for the motors' angles, in the home assembly mode.
    ///
    /// The orientation is wrong by at most 0.03 µrad in the paper's workspace.
    ///
    /// # Errors
    /// [`PoseError::OutOfReach`] where the parts can't be joined at these angles, or they lie beyond
    /// the range of the kernel; [`PoseError::Singular`] where an assembly margin has shrunk to about
    /// half of home's or a serial margin to ⅛.
    #[inline(always)]
    pub fn direct(&self, joints: &Joints) -> Result<Direct, PoseError> {
        let [leg1, leg2] = &self.legs;
        let angles = [
            joints.0[0].to_q29().wrapping_add(leg1.zero.to_q29()),
            joints.0[1].to_q29().wrapping_add(leg2.zero.to_q29()),
            joints.0[2].to_q29().wrapping_sub(Angle::FRAC_PI_4.to_q29()),
        ];
        if !are_near(&angles) {
            return Err(PoseError::OutOfReach);
        }
        let [turn1, turn2, (sine, cosine)] = sin_cos_near(angles.map(Angle::from_q29));
        // Cosine and sine of θ3, below 0.96 each.
        let c3 = times_root_two(cosine - sine); // Q31
        let s3 = times_root_two(cosine + sine);
        let minus_s3 = -s3;

        // Leg 1 fixes φ, where C1 = x'' = (C3 cos φ, S3 cos φ, −sin φ).
        let crank = leg1.push.turned(turn1);
        let [bx, by, bz] = crank.back;
        let behind = (wide(c3, bx) + wide(s3, by)) >> 31;
        let phi = Root::find::<1>(behind as i32, bz, crank.offset)?;
        let (cosine, sine) = (phi.cosine << 1, phi.sine << 1); // Q31
        let x = [
            multiply_high(c3, cosine),
            multiply_high(s3, cosine),
            -phi.sine,
        ];
        let serial1 = leg1.push.serial(&crank, &x);
        let across = (wide(c3, by) + wide(minus_s3, bx)) >> 30; // −P, Q30
        let first = First::new(phi.margin, serial1, across as i32);
        let z = [
            multiply_high(c3, sine) << 1,
            multiply_high(s3, sine) << 1,
            cosine,
        ]; // Q31

        // Leg 2 fixes ψ, where C2 = y' cos ψ + z'' sin ψ.
        let crank = leg2.push.turned(turn2);
        let [bx, by, _] = crank.back;
        let behind = (wide(c3, by) + wide(minus_s3, bx)) >> 31;
        let across = dot(&crank.back, &z) >> 31;
        let along = dot(&crank.back, &x) >> 29; // Q30
        let psi = Root::find::<-1>(behind as i32, across as i32, crank.offset)?;
        let (cosine, sine) = (psi.cosine << 1, psi.sine << 1); // Q31
        let minus_c3 = -c3;
        let point = [
            high(wide(z[0], sine) + wide(minus_s3, cosine)),
            high(wide(z[1], sine) + wide(c3, cosine)),
            multiply_high(z[2], sine),
        ];
        let serial2 = leg2.push.serial(&crank, &point);
        let margin = serial1.min(serial2);
        if margin < LEAST_SERIAL {
            return Err(PoseError::Singular);
        }
        let along = along as i32;
        let along = [multiply_high(along, sine), multiply_high(along, cosine)];
        let second = Second::new(psi.margin, serial2, along);
        let axis = [
            high(wide(z[0], cosine) + wide(s3, sine)),
            high(wide(z[1], cosine) + wide(minus_c3, sine)),
            multiply_high(z[2], cosine),
        ];
        let both = multiply_high(phi.margin, psi.margin) << 3; // Q29
        Ok(Direct {
            rotation: Rotation::from_columns([x, point, axis]),
            jacobian: Jacobian::new(
                &Basis {
                    x,
                    y: [minus_s3, c3],
                    minus_y: [s3, minus_c3],
                    z,
                },
                &first,
                &second,
                multiply_high(both, self.cranks) << 2,
            ),
            serial: margin,
        })
    }
}

/// Tells whether the cranks are within −1..1 rad and the third motor within −½..½ rad of home.
#[inline(always)]
const fn are_near(angles: &[i32; 3]) -> bool {
    let first = angles[0].wrapping_add(1 << 29) as u32;
    let second = angles[1].wrapping_add(1 << 29) as u32;
    let third = angles[2].wrapping_add(1 << 28) as u32;
    ((first | second) >> 1 | third) < 1 << 29
}

impl Push {
    /// Turns the crank, given the sine and cosine of its angle.
    #[inline(always)]
    fn turned(&self, (sine, cosine): (i32, i32)) -> Crank {
        let [x, y, z] = self.back;
        let [right, up] = self.shift;
        let offset = self.offset - (sine >> 1);
        Crank {
            sine,
            cosine,
            back: [x, y - (cosine >> 1), z - (sine >> 1)],
            offset: multiply_high_add(multiply_high_add(offset, cosine, right), sine, up),
        }
    }

    /// Returns (l×r)·i / ρ in Q30: F cos θ − E sin θ, with E and F of the inverse.
    #[inline(always)]
    fn serial(&self, crank: &Crank, point: &Vector) -> i32 {
        let minus_e = self.center[0] - (point[1] >> 1);
        let f = (point[2] >> 1) - self.center[1];
        ((wide(f, crank.cosine) + wide(minus_e, crank.sine)) >> 29) as i32
    }
}

impl Root {
    /// Finds the root nearest to zero for −K, SIDE · M, N in Q29, |α| below 53°.
    #[inline(always)]
    fn find<const SIDE: i32>(k: i32, m: i32, n: i32) -> Result<Self, PoseError> {
        // W² in Q58; |K|, |M|, |N| are below 2.7.
        let square = wide(k, k) + wide(m, m) + wide(n, -n);
        let top = high(square);
        if top < LEAST_ASSEMBLY_SQUARE {
            return Err(if top < 0 {
                PoseError::OutOfReach
            } else {
                PoseError::Singular
            });
        }
        // W²/4 in Q31, W/2 in Q30: W in Q29.
        let margin = root_near((square >> 29) as i32);
        // N + K is below 3.95; where it is not positive one of the tests holds.
        let below = n - k;
        let above = if SIDE < 0 { margin - m } else { m - margin };
        let half = below >> 1;
        if above >= half || above <= -half {
            return Err(PoseError::OutOfReach);
        }
        let tangent = ratio_q30(above << 1, below); // Q31, of half the angle
        let square = multiply_high(tangent, tangent) >> 1; // Q29
        // cos α = (1 − t²)/(1 + t²), one step short of 1; sin α = 2t − 2t (1 − cos α)/2.
        let cosine = ratio_q30((1 << 29) - 1 - square, (1 << 29) + square);
        let fall = (cosine - (1 << 30)) << 1;
        Ok(Self {
            sine: multiply_high_add(tangent, tangent, fall),
            cosine,
            margin,
        })
    }
}
