//! The inverse once more in single precision with libm: what the integers are measured against.
//!
//! The same closed forms, the same checks and the same answer; never on the control path.

use libm::{atanf, cosf, sinf, sqrtf};

const SQRT_2: f32 = core::f32::consts::SQRT_2;
const ROOT_HALF: f32 = core::f32::consts::FRAC_1_SQRT_2;
const QUARTER_TURN_HALF: f32 = core::f32::consts::FRAC_PI_4;
/// The range of an angle, and the least margin squared, as the kernel has them.
const RANGE: f32 = 1.125;
const LEAST_SQUARE: f32 = 1.0 / 16.0;

/// One leg's constants: centre's y and z, A/ρ, the offset, the motor's zero.
pub struct Leg {
    center: [f32; 2],
    slope: [f32; 3],
    offset: f32,
    zero: f32,
}

/// What the inverse gives.
pub struct Inverse {
    /// The motors' angles in radians.
    pub joints: [f32; 3],
    /// The lesser √D.
    pub margin: f32,
}

/// The paper's legs.
pub const PAPER: [Leg; 2] = [
    Leg {
        center: [0.0, -1.0],
        slope: [1.0, 0.0, -SQRT_2],
        offset: SQRT_2,
        zero: 0.0,
    },
    Leg {
        center: [0.0, -1.0],
        slope: [-1.0, 0.0, -SQRT_2],
        offset: SQRT_2,
        zero: 0.0,
    },
];

/// Returns the motors' angles for yaw, pitch and roll, or nothing where the kernel would refuse.
#[inline]
pub fn inverse(legs: &[Leg; 2], pose: &[f32; 3]) -> Option<Inverse> {
    if pose.iter().any(|angle| angle.abs() > RANGE) {
        return None;
    }
    let [(sy, cy), (sp, cp), (sr, cr)] = pose.map(|angle| (sinf(angle), cosf(angle)));
    let (cq, sq) = ((cr - sr) * ROOT_HALF, (cr + sr) * ROOT_HALF);
    let (spcq, spsq) = (sp * cq, sp * sq);
    let columns = [
        [cp * cq, cy * sq + sy * spcq, sy * sq - cy * spcq],
        [-(cp * sq), cy * cq - sy * spsq, sy * cq + cy * spsq],
    ];
    let [first, second] = &columns;
    let (theta1, margin1) = legs[0].inverse(first)?;
    let (theta2, margin2) = legs[1].inverse(second)?;
    let third = atanf((first[1] - first[0]) / (first[1] + first[0]));
    Some(Inverse {
        joints: [theta1, theta2, QUARTER_TURN_HALF + third],
        margin: margin1.min(margin2),
    })
}

impl Leg {
    #[inline(always)]
    fn inverse(&self, point: &[f32; 3]) -> Option<(f32, f32)> {
        let e = point[1] - self.center[0];
        let f = point[2] - self.center[1];
        let along = point[0] * self.slope[0] + point[1] * self.slope[1] + point[2] * self.slope[2];
        let g = self.offset - along;
        let square = e * e + f * f - g * g;
        if square < LEAST_SQUARE {
            return None;
        }
        let margin = sqrtf(square);
        Some((2.0 * atanf((g - e) / (f + margin)) - self.zero, margin))
    }
}
