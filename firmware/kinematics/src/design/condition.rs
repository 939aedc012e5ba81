//! How evenly a configuration turns rates into rates: condition numbers from singular values.

use libm::{fabs, sqrt};
use nalgebra::{Matrix3, Vector3};

use super::Jacobians;

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
}
