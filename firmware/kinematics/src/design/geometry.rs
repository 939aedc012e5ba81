//! The parts of a wrist: lengths, axes, scale and limits of travel.

use core::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2, TAU};

use libm::{atan2, cos, sin, sqrt};
use nalgebra::Vector3;

use super::Travel;

/// One leg: a crank about a fixed axis and a rod to the platform.
///
/// The crank's end is B = A + ρ(cos θ u + sin θ (i × u)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// A, the crank's centre.
    pub center: Vector3<f64>,
    /// i, the unit vector of the crank's axis.
    pub axis: Vector3<f64>,
    /// u, the unit vector of the crank where the motor reads zero; perpendicular to the axis.
    pub zero: Vector3<f64>,
    /// ρ, the crank's length.
    pub crank: f64,
    /// The rod's length.
    pub rod: f64,
}

/// A wrist: two legs; the third is the serial chain z, y', x''.
///
/// All lengths are in one unit, whichever it is. Angles, margins and condition numbers depend on
/// ratios of lengths only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// |OC|, the platform's arm: positive; 1 in the paper's mechanisms.
    pub arm: f64,
    /// Leg 1, to C1 = arm · R eₓ, and leg 2, to C2 = arm · R e_y.
    pub legs: [Leg; 2],
    /// How far the motors and the platform may turn.
    pub travel: Travel,
}

impl Leg {
    /// Returns the crank's end B for a crank angle in radians.
    pub fn end(&self, theta: f64) -> Vector3<f64> {
        self.center + self.crank_vector(theta)
    }

    /// Returns the crank's vector l = B − A for a crank angle in radians.
    pub fn crank_vector(&self, theta: f64) -> Vector3<f64> {
        (self.zero * cos(theta) + self.axis.cross(&self.zero) * sin(theta)) * self.crank
    }

    /// Returns both crank angles for the platform's point C, within ±π: home's working mode,
    /// (l×r)·i > 0, first.
    pub fn inverse(&self, point: &Vector3<f64>) -> Option<[f64; 2]> {
        let (e, f, g) = self.terms(point);
        let square = e * e + f * f - g * g;
        if square < 0.0 {
            return None;
        }
        let root = sqrt(square);
        // tan(θ/2) = (G − E)/(F + √D) and (F + √D)/(G + E): neither cancels near home.
        Some([
            wrapped(2.0 * atan2(g - e, f + root)),
            wrapped(2.0 * atan2(f + root, g + e)),
        ])
    }

    /// Returns D = (E² + F² − G²)/4, which is ((l×r)·i)² where the rod reaches C and negative where
    /// it does not; in length⁴.
    pub fn discriminant(&self, point: &Vector3<f64>) -> f64 {
        let (e, f, g) = self.terms(point);
        (e * e + f * f - g * g) / 4.0
    }

    /// Returns the crank angle at which the rod's end comes nearest to C or, within the rod, is
    /// farthest from it: both solutions where they meet.
    pub(super) fn nearest(&self, point: &Vector3<f64>) -> f64 {
        let (e, f, g) = self.terms(point);
        if g < 0.0 { atan2(-f, -e) } else { atan2(f, e) }
    }

    /// Returns E, F, G of E cos θ + F sin θ = G.
    fn terms(&self, point: &Vector3<f64>) -> (f64, f64, f64) {
        let d = point - self.center;
        let e = 2.0 * self.crank * d.dot(&self.zero);
        let f = 2.0 * self.crank * d.dot(&self.axis.cross(&self.zero));
        let g = d.dot(&d) + self.crank * self.crank - self.rod * self.rod;
        (e, f, g)
    }

    /// Returns the sines and cosines of K cos α + M sin α = N for a point at `arm` from O that turns
    /// in the plane of two unit vectors; the one with −K sin α + M cos α ≥ 0 first.
    pub(super) fn meeting(
        &self,
        arm: f64,
        theta: f64,
        ahead: &Vector3<f64>,
        across: &Vector3<f64>,
    ) -> Option<[(f64, f64); 2]> {
        let end = self.end(theta);
        let (k, m) = (end.dot(ahead), end.dot(across));
        let n = (arm * arm + end.dot(&end) - self.rod * self.rod) / (2.0 * arm);
        let whole = k * k + m * m;
        let square = whole - n * n;
        if square < 0.0 || whole == 0.0 {
            return None;
        }
        let w = sqrt(square);
        let root = |w: f64| ((m * n - k * w) / whole, (k * n + m * w) / whole);
        Some([root(w), root(-w)])
    }
}

impl Geometry {
    /// Both crank axes along x, crank 1.
    pub const PARALLEL_AXES: Self = Self {
        arm: 1.0,
        travel: Travel::PARALLEL_AXES,
        legs: [
            Leg {
                center: Vector3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2 - 1.0, -1.0),
                axis: Vector3::new(1.0, 0.0, 0.0),
                zero: Vector3::new(0.0, 1.0, 0.0),
                crank: 1.0,
                rod: 1.0,
            },
            Leg {
                center: Vector3::new(-FRAC_1_SQRT_2, FRAC_1_SQRT_2 - 1.0, -1.0),
                axis: Vector3::new(1.0, 0.0, 0.0),
                zero: Vector3::new(0.0, 1.0, 0.0),
                crank: 1.0,
                rod: 1.0,
            },
        ],
    };

    /// Crank axes at right angles through the centre, crank √2.
    pub const ORTHOGONAL_AXES: Self = Self {
        arm: 1.0,
        travel: Travel::ORTHOGONAL_AXES,
        legs: [
            Leg {
                center: Vector3::new(0.0, 0.0, 0.0),
                axis: Vector3::new(FRAC_1_SQRT_2, -FRAC_1_SQRT_2, 0.0),
                zero: Vector3::new(0.5, 0.5, -FRAC_1_SQRT_2),
                crank: SQRT_2,
                rod: 1.0,
            },
            Leg {
                center: Vector3::new(0.0, 0.0, 0.0),
                axis: Vector3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0),
                zero: Vector3::new(-0.5, 0.5, -FRAC_1_SQRT_2),
                crank: SQRT_2,
                rod: 1.0,
            },
        ],
    };

    /// The prototype's: parallel actuators, crank √½.
    pub const PARALLEL_ACTUATORS: Self = Self {
        arm: 1.0,
        travel: Travel::PARALLEL_ACTUATORS,
        legs: [
            Leg {
                center: Vector3::new(FRAC_1_SQRT_2, 0.0, -1.0),
                axis: Vector3::new(1.0, 0.0, 0.0),
                zero: Vector3::new(0.0, 1.0, 0.0),
                crank: FRAC_1_SQRT_2,
                rod: 1.0,
            },
            Leg {
                center: Vector3::new(-FRAC_1_SQRT_2, 0.0, -1.0),
                axis: Vector3::new(1.0, 0.0, 0.0),
                zero: Vector3::new(0.0, 1.0, 0.0),
                crank: FRAC_1_SQRT_2,
                rod: 1.0,
            },
        ],
    };

    /// Returns the same mechanism with an arm of another length; nothing unless the length is
    /// positive and finite.
    ///
    /// `Geometry::PARALLEL_ACTUATORS.scaled(0.03)` is the prototype with an arm of 30 mm, in metres.
    pub fn scaled(&self, arm: f64) -> Option<Self> {
        if !(arm > 0.0 && arm.is_finite()) {
            return None;
        }
        let mut scaled = *self;
        let factor = arm / self.arm;
        for leg in &mut scaled.legs {
            leg.center *= factor;
            leg.crank *= factor;
            leg.rod *= factor;
        }
        scaled.arm = arm;
        Some(scaled)
    }
}

/// Returns an angle of at most two turns within ±π.
fn wrapped(angle: f64) -> f64 {
    if angle > PI {
        angle - TAU
    } else if angle < -PI {
        angle + TAU
    } else {
        angle
    }
}
