//! How evenly a configuration turns rates into rates: condition numbers, conditioning indices and
//! manipulability, from singular values.
//!
//! Lengths are in arms, so that none depends on the scale.

use libm::{fabs, sqrt};
use nalgebra::{Matrix3, Vector3};

use super::{Geometry, Jacobians, Range, rotation};

/// Sweeps of the rotations; they converge quadratically, a 3×3 matrix within six.
const SWEEPS: usize = 16;

/// Returns the singular values of a matrix, largest first; each to a few parts in 10¹⁵ of itself
/// unless the matrix is singular.
///
/// One-sided Jacobi rotations (Hestenes): columns are turned in pairs until all are perpendicular;
/// their lengths are the singular values. Small ones are not lost as they are in AᵀA.
pub fn singular_values(matrix: &Matrix3<f64>) -> [f64; 3] {
    let mut columns = [0, 1, 2].map(|k| matrix.column(k).into_owned());
    for _ in 0..SWEEPS {
        let mut is_done = true;
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            is_done &= !turn(&mut columns, i, j);
        }
        if is_done {
            break;
        }
    }
    let mut lengths = columns.map(|column| column.norm());
    lengths.sort_unstable_by(|a, b| b.total_cmp(a));
    lengths
}

/// Makes two columns perpendicular by a rotation; tells whether they were not.
fn turn(columns: &mut [Vector3<f64>; 3], i: usize, j: usize) -> bool {
    let (a, b) = (columns[i], columns[j]);
    let (long, short, across) = (a.dot(&a), b.dot(&b), a.dot(&b));
    if fabs(across) <= 1e-16 * sqrt(long * short) {
        return false;
    }
    let ratio = (short - long) / (2.0 * across);
    let sign = if ratio < 0.0 { -1.0 } else { 1.0 };
    let tangent = sign / (fabs(ratio) + sqrt(1.0 + ratio * ratio));
    let cosine = 1.0 / sqrt(1.0 + tangent * tangent);
    let sine = cosine * tangent;
    columns[i] = a * cosine - b * sine;
    columns[j] = a * sine + b * cosine;
    true
}

/// Returns the largest singular value over the least: 1 where isotropic, infinite where singular.
pub fn condition(matrix: &Matrix3<f64>) -> f64 {
    let [largest, _, least] = singular_values(matrix);
    if least == 0.0 {
        f64::INFINITY
    } else {
        largest / least
    }
}

impl Jacobians {
    /// Returns the condition number of A: 1 at home of all three architectures, infinite at an
    /// assembly singularity.
    pub fn condition(&self) -> f64 {
        condition(&self.a)
    }

    /// Returns B⁻¹ A, which makes motor rates of an angular velocity; not finite at a serial
    /// singularity.
    pub fn rate_map(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&self.b.map(|entry| 1.0 / entry)) * self.a
    }

    /// Returns the condition number of B⁻¹ A: √2 at home of the prototype, infinite at a serial or
    /// an assembly singularity.
    pub fn condition_of_rates(&self) -> f64 {
        let map = self.rate_map();
        if map.iter().all(|entry| entry.is_finite()) {
            condition(&map)
        } else {
            f64::INFINITY
        }
    }

    /// Returns the inverse condition number of A, the local conditioning index: 1 where isotropic,
    /// 0 at an assembly singularity.
    pub fn isotropy(&self) -> f64 {
        1.0 / self.condition()
    }

    /// Returns the inverse condition number of B⁻¹ A: 1 where isotropic, 0 at a serial or an
    /// assembly singularity. The velocity map A⁻¹ B has the same.
    pub fn isotropy_of_rates(&self) -> f64 {
        1.0 / self.condition_of_rates()
    }

    /// Returns Yoshikawa's manipulability √det(A Aᵀ) of A, which is |det A|.
    pub fn manipulability(&self) -> f64 {
        fabs(self.det_a())
    }

    /// Returns Yoshikawa's manipulability √det(J Jᵀ) of the velocity map J = A⁻¹ B: 0 at a serial
    /// singularity, infinite at an assembly singularity, not a number where both meet.
    pub fn manipulability_of_rates(&self) -> f64 {
        fabs(self.b[0] * self.b[1] * self.b[2]) / self.manipulability()
    }
}

/// Conditioning over a box of poses, as means over a grid; what is out of reach counts as 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlobalIsotropy {
    /// The global conditioning index of A: the mean of 1/κ(A).
    pub of_a: f64,
    /// The global conditioning index of the motors' rates: the mean of 1/κ(B⁻¹ A).
    pub of_rates: f64,
    /// The share of the box that is in reach.
    pub in_reach: f64,
}

impl Geometry {
    /// Returns the global conditioning indices over yaw, pitch and roll, in home's working mode, by
    /// the midpoints of `cells`³ cells; at least one.
    pub fn global_isotropy(&self, over: &[Range; 3], cells: u32) -> GlobalIsotropy {
        let cells = cells.max(1);
        let share = |k: u32| (f64::from(k) + 0.5) / f64::from(cells);
        let (mut of_a, mut of_rates, mut reached) = (0.0, 0.0, 0.0);
        for i in 0..cells {
            for (j, k) in (0..cells).flat_map(|j| (0..cells).map(move |k| (j, k))) {
                let [yaw, pitch, roll] = over;
                let at = rotation(yaw.at(share(i)), pitch.at(share(j)), roll.at(share(k)));
                if let Some(theta) = self.inverse(&at) {
                    let jacobians = self.jacobians(&at, &theta);
                    of_a += jacobians.isotropy();
                    of_rates += jacobians.isotropy_of_rates();
                    reached += 1.0;
                }
            }
        }
        let edge = f64::from(cells);
        let count = edge * edge * edge;
        GlobalIsotropy {
            of_a: of_a / count,
            of_rates: of_rates / count,
            in_reach: reached / count,
        }
    }
}
