//! The kernel's work once more in single precision with libm: what the integers are measured against.
//!
//! The same closed forms for the same unit's constants, the same checks and the same answers, written as
//! one would write them for a processor with floats; never on the control path. A quotient that is
//! needed twice is computed once, and an angle that is only needed by its sine and cosine isn't.

use libm::{atanf, cosf, sinf, sqrtf};

const SQRT_2: f32 = core::f32::consts::SQRT_2;
const ROOT_HALF: f32 = core::f32::consts::FRAC_1_SQRT_2;
const QUARTER_TURN_HALF: f32 = core::f32::consts::FRAC_PI_4;
/// The ranges of yaw and the cranks, and of the other angles, as the kernel has them.
const RANGES: [f32; 3] = [1.0, 0.5, 0.5];
const CRANK_RANGES: [f32; 3] = [1.0, 1.0, 0.5];
/// The least margins, as the kernel has them: D, W², and (l×r)·i / ρ.
const LEAST_SQUARE: f32 = 1.0 / 16.0;
const LEAST_ASSEMBLY_SQUARE: f32 = 9.0 / 16.0;
const LEAST_SERIAL: f32 = 0.125;
/// The most that tan(θ/2) may be.
const MOST_TANGENT: f32 = 17.0 / 32.0;

/// A vector of three numbers.
pub type Vector = [f32; 3];

/// One leg's constants, as [`eel_kinematics::Wrist`] has them.
pub struct Leg {
    /// The crank's centre A.
    center: Vector,
    /// A / ρ.
    slope: Vector,
    /// (1 + A·A + ρ² − s²) / 2ρ.
    offset: f32,
    /// The crank.
    crank: f32,
    /// The geometric angle at which the motor reads zero.
    zero: f32,
}

/// What the inverse gives.
pub struct Inverse {
    /// The motors' angles in radians.
    pub joints: Vector,
    /// The lesser √D.
    pub margin: f32,
}

/// What the direct kinematics gives.
pub struct Direct {
    /// The columns of the orientation.
    pub columns: [Vector; 3],
    /// The rows of the map of torques, B A⁻ᵀ.
    pub torque: [Vector; 3],
    /// det A.
    pub determinant: f32,
    /// The lesser (l×r)·i / ρ.
    pub margin: f32,
}

/// The paper's legs.
pub const PAPER: [Leg; 2] = [paper_leg(1.0), paper_leg(-1.0)];

const fn paper_leg(side: f32) -> Leg {
    Leg {
        center: [side * ROOT_HALF, 0.0, -1.0],
        slope: [side, 0.0, -SQRT_2],
        offset: SQRT_2,
        crank: ROOT_HALF,
        zero: 0.0,
    }
}

/// Returns the motors' angles for yaw, pitch and roll, or nothing where the kernel would refuse.
#[inline]
pub fn inverse(legs: &[Leg; 2], pose: &Vector) -> Option<Inverse> {
    if pose
        .iter()
        .zip(RANGES)
        .any(|(angle, range)| angle.abs() > range)
    {
        return None;
    }
    let [(sy, cy), (sp, cp), (sr, cr)] = pose.map(sine_cosine);
    let (cq, sq) = ((cr - sr) * ROOT_HALF, (cr + sr) * ROOT_HALF);
    let (spcq, spsq) = (sp * cq, sp * sq);
    let first = [cp * cq, cy * sq + sy * spcq, sy * sq - cy * spcq];
    let second = [-(cp * sq), cy * cq - sy * spsq, sy * cq + cy * spsq];
    let (theta1, margin1) = legs[0].inverse(&first)?;
    let (theta2, margin2) = legs[1].inverse(&second)?;
    let third = atanf((first[1] - first[0]) / (first[1] + first[0]));
    Some(Inverse {
        joints: [theta1, theta2, QUARTER_TURN_HALF + third],
        margin: margin1.min(margin2),
    })
}

/// Returns the platform for the motors' angles, or nothing where the kernel would refuse.
#[inline]
pub fn direct(legs: &[Leg; 2], joints: &Vector) -> Option<Direct> {
    let angles = [
        joints[0] + legs[0].zero,
        joints[1] + legs[1].zero,
        joints[2],
    ];
    let centered = [angles[0], angles[1], angles[2] - QUARTER_TURN_HALF];
    if centered
        .iter()
        .zip(CRANK_RANGES)
        .any(|(angle, range)| angle.abs() > range)
    {
        return None;
    }
    let [turn1, turn2, (s3, c3)] = angles.map(sine_cosine);

    // Leg 1 fixes φ, where C1 = x'' = (C3 cos φ, S3 cos φ, −sin φ).
    let (end, n) = legs[0].turned(turn1);
    let (sine, cosine, assembly1) = root(c3 * end[0] + s3 * end[1], -end[2], n, -1.0)?;
    let x = [c3 * cosine, s3 * cosine, -sine];
    let z = [c3 * sine, s3 * sine, cosine];
    let serial1 = legs[0].serial(turn1, &x);
    let scale1 = 1.0 / assembly1;
    let (gear1, lean1) = (serial1 * scale1, (c3 * end[1] - s3 * end[0]) * scale1);

    // Leg 2 fixes ψ, where C2 = y' cos ψ + z'' sin ψ.
    let (end, n) = legs[1].turned(turn2);
    let across = c3 * end[1] - s3 * end[0];
    let (sine, cosine, assembly2) = root(across, dot(&end, &z), n, 1.0)?;
    let point = [
        z[0] * sine - s3 * cosine,
        z[1] * sine + c3 * cosine,
        z[2] * sine,
    ];
    let serial2 = legs[1].serial(turn2, &point);
    let margin = serial1.min(serial2);
    if margin < LEAST_SERIAL {
        return None;
    }
    let axis = [
        z[0] * cosine + s3 * sine,
        z[1] * cosine - c3 * sine,
        z[2] * cosine,
    ];
    let scale2 = 1.0 / assembly2;
    let along = dot(&end, &x) * scale2;
    let (gear2, skew, lean2) = (serial2 * scale2, along * sine, along * cosine);

    // τ1 = −b1/W1 (Qs/W2 x'' + y'), τ2 = b2/W2 x'', τ3 = cos φ (z'' − P/W1 y' − (P Qs/W1 + Qc)/W2 x'').
    let pull = -gear1 * skew;
    let twist = -z[2] * (lean1 * skew + lean2);
    let turn = -z[2] * lean1;
    Some(Direct {
        columns: [x, point, axis],
        torque: [
            [
                pull * x[0] + gear1 * s3,
                pull * x[1] - gear1 * c3,
                pull * x[2],
            ],
            x.map(|component| gear2 * component),
            [
                twist * x[0] - turn * s3 + z[2] * z[0],
                twist * x[1] + turn * c3 + z[2] * z[1],
                twist * x[2] + z[2] * z[2],
            ],
        ],
        determinant: legs[0].crank * legs[1].crank * assembly1 * assembly2,
        margin,
    })
}

/// Returns the motors' torques for a moment.
#[inline]
pub fn torques(map: &[Vector; 3], moment: &Vector) -> Vector {
    [
        dot(&map[0], moment),
        dot(&map[1], moment),
        dot(&map[2], moment),
    ]
}

/// Returns the motors' torques for a moment where all are within their bounds: what is shared of a
/// moment that fits.
#[inline]
pub fn share(map: &[Vector; 3], moment: &Vector, bounds: &[[f32; 2]; 3]) -> Option<Vector> {
    let torques = torques(map, moment);
    let fits = torques
        .iter()
        .zip(bounds)
        .all(|(torque, [low, high])| low <= torque && torque <= high);
    fits.then_some(torques)
}

/// Returns sine and cosine.
#[inline]
pub fn sine_cosine(angle: f32) -> (f32, f32) {
    (sinf(angle), cosf(angle))
}

impl Leg {
    #[inline(always)]
    fn inverse(&self, point: &Vector) -> Option<(f32, f32)> {
        let e = point[1] - self.center[1];
        let f = point[2] - self.center[2];
        let g = self.offset - dot(point, &self.slope);
        let square = e * e + f * f - g * g;
        if square < LEAST_SQUARE {
            return None;
        }
        let margin = sqrtf(square);
        let tangent = (g - e) / (f + margin);
        if tangent.abs() > MOST_TANGENT {
            return None;
        }
        Some((2.0 * atanf(tangent) - self.zero, margin))
    }

    /// Returns the crank's end over ρ, and what C times it must be.
    #[inline(always)]
    fn turned(&self, (sine, cosine): (f32, f32)) -> (Vector, f32) {
        let [x, y, z] = self.slope;
        let n = self.offset + self.center[1] * cosine + self.center[2] * sine;
        ([x, y + cosine, z + sine], n)
    }

    /// Returns (l×r)·i / ρ.
    #[inline(always)]
    fn serial(&self, (sine, cosine): (f32, f32), point: &Vector) -> f32 {
        (point[2] - self.center[2]) * cosine - (point[1] - self.center[1]) * sine
    }
}

/// Returns sine, cosine and W of the root nearest to zero of K cos α + M sin α = N.
#[inline(always)]
fn root(k: f32, m: f32, n: f32, side: f32) -> Option<(f32, f32, f32)> {
    let square = k * k + m * m - n * n;
    if square < LEAST_ASSEMBLY_SQUARE {
        return None;
    }
    let margin = sqrtf(square);
    let tangent = (m + side * margin) / (n + k);
    if tangent.abs() > 0.5 {
        return None;
    }
    let square = tangent * tangent;
    let scale = 1.0 / (1.0 + square);
    Some((2.0 * tangent * scale, (1.0 - square) * scale, margin))
}

#[inline(always)]
fn dot(a: &Vector, b: &Vector) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
