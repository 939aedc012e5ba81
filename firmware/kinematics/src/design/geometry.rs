//! The parts of a wrist, and its closed forms.

use core::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use libm::{atan2, cos, sin, sqrt};
use nalgebra::{Matrix3, Vector3};

use super::Jacobians;

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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Leg 1, to C1 = R eₓ, and leg 2, to C2 = R e_y.
    pub legs: [Leg; 2],
}

impl Leg {
    /// Returns the crank's end B for a crank angle in radians.
    pub fn end(&self, theta: f64) -> Vector3<f64> {
        self.center + self.arm(theta)
    }

    /// Returns the crank's vector l = B − A.
    fn arm(&self, theta: f64) -> Vector3<f64> {
        (self.zero * cos(theta) + self.axis.cross(&self.zero) * sin(theta)) * self.crank
    }

    /// Returns both crank angles for the platform's point C: home's working mode, (l×r)·i > 0, first.
    pub fn inverse(&self, point: &Vector3<f64>) -> Option<[f64; 2]> {
        let (e, f, g, root) = self.terms(point)?;
        // tan(θ/2) = (G − E)/(F + √D) and (F + √D)/(G + E): neither cancels near home.
        Some([2.0 * atan2(g - e, f + root), 2.0 * atan2(f + root, g + e)])
    }

    /// Returns E, F, G of E cos θ + F sin θ = G, and √(E² + F² − G²).
    fn terms(&self, point: &Vector3<f64>) -> Option<(f64, f64, f64, f64)> {
        let d = point - self.center;
        let e = 2.0 * self.crank * d.dot(&self.zero);
        let f = 2.0 * self.crank * d.dot(&self.axis.cross(&self.zero));
        let g = d.dot(&d) + self.crank * self.crank - self.rod * self.rod;
        let square = e * e + f * f - g * g;
        if square < 0.0 {
            None
        } else {
            Some((e, f, g, sqrt(square)))
        }
    }

    /// Returns K cos α + M sin α = N for a point that turns in the plane of two unit vectors.
    fn meeting(
        &self,
        theta: f64,
        ahead: &Vector3<f64>,
        across: &Vector3<f64>,
    ) -> Option<[(f64, f64); 2]> {
        let end = self.end(theta);
        let (k, m) = (end.dot(ahead), end.dot(across));
        let n = (1.0 + end.dot(&end) - self.rod * self.rod) / 2.0;
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

    /// Returns the motors' angles for an orientation, in the home working mode.
    pub fn inverse(&self, rotation: &Matrix3<f64>) -> Option<[f64; 3]> {
        let [first, second] = &self.legs;
        let [theta1, _] = first.inverse(&rotation.column(0).into_owned())?;
        let [theta2, _] = second.inverse(&rotation.column(1).into_owned())?;
        Some([theta1, theta2, atan2(rotation[(1, 0)], rotation[(0, 0)])])
    }

    /// Returns all four inverse solutions, home's working mode first.
    pub fn inverse_all(&self, rotation: &Matrix3<f64>) -> Option<[[f64; 3]; 4]> {
        let [first, second] = &self.legs;
        let [a, b] = first.inverse(&rotation.column(0).into_owned())?;
        let [c, d] = second.inverse(&rotation.column(1).into_owned())?;
        let theta3 = atan2(rotation[(1, 0)], rotation[(0, 0)]);
        Some([
            [a, c, theta3],
            [a, d, theta3],
            [b, c, theta3],
            [b, d, theta3],
        ])
    }

    /// Returns the orientation for the motors' angles, in the home assembly mode: det A > 0 and
    /// cos φ > 0.
    pub fn direct(&self, theta: &[f64; 3]) -> Option<Matrix3<f64>> {
        let [found, ..] = self.direct_all(theta);
        let found = found?;
        // cos φ² is what C1 leaves in the plane; its sign is that of C1 along the turned x axis.
        let ahead = found[(0, 0)] * cos(theta[2]) + found[(1, 0)] * sin(theta[2]);
        if ahead > 0.0 { Some(found) } else { None }
    }

    /// Returns all direct solutions, as far as they exist; the home assembly mode first.
    pub fn direct_all(&self, theta: &[f64; 3]) -> [Option<Matrix3<f64>>; 4] {
        let (s3, c3) = (sin(theta[2]), cos(theta[2]));
        let flat = Vector3::new(c3, s3, 0.0);
        let y = Vector3::new(-s3, c3, 0.0);
        let up = Vector3::new(0.0, 0.0, 1.0);
        let mut found = [None; 4];
        let Some(phis) = self.legs[0].meeting(theta[0], &flat, &-up) else {
            return found;
        };
        for (i, (sine, cosine)) in phis.into_iter().enumerate() {
            let x = flat * cosine - up * sine;
            let z = flat * sine + up * cosine;
            let Some([a, b]) = self.legs[1].meeting(theta[1], &y, &z) else {
                continue;
            };
            // det A = −(n1·y')(n2·x''): positive where the two roots have opposite signs.
            let pair = if i == 0 { [b, a] } else { [a, b] };
            for (j, (sine, cosine)) in pair.into_iter().enumerate() {
                let second = y * cosine + z * sine;
                let axis = z * cosine - y * sine;
                // Order: home, its other ψ, then the other φ, the one with det A > 0 first.
                if let Some(entry) = found.get_mut(2 * i + j) {
                    *entry = Some(Matrix3::from_columns(&[x, second, axis]));
                }
            }
        }
        found
    }

    /// Returns A and B at a configuration: A ω = B θ̇.
    pub fn jacobians(&self, rotation: &Matrix3<f64>, theta: &[f64; 3]) -> Jacobians {
        let (s3, c3) = (sin(theta[2]), cos(theta[2]));
        let x = rotation.column(0).into_owned();
        let y = Vector3::new(-s3, c3, 0.0);
        let mut a = Matrix3::zeros();
        let mut b = Vector3::new(0.0, 0.0, c3 * x[0] + s3 * x[1]);
        for (i, leg) in self.legs.iter().enumerate() {
            let p = rotation.column(i).into_owned();
            let arm = leg.arm(theta[i]);
            let r = p - leg.center - arm;
            a.set_row(i, &p.cross(&r).transpose());
            b[i] = arm.cross(&r).dot(&leg.axis);
        }
        a.set_row(2, &x.cross(&y).transpose());
        Jacobians { a, b }
    }
}
