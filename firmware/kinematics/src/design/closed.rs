//! The closed forms: motors' angles for an orientation, orientations for the motors' angles, A and B.

use libm::{atan2, cos, sin};
use nalgebra::{Matrix3, Vector3};

use super::{AssemblyMode, Geometry, Jacobians, WorkingMode};

impl Geometry {
    /// Returns the motors' angles for an orientation, in home's working mode.
    pub fn inverse(&self, rotation: &Matrix3<f64>) -> Option<[f64; 3]> {
        self.inverse_in(WorkingMode::HOME, rotation)
    }

    /// Returns the motors' angles for an orientation in a working mode; legs 1 and 2 within ±π.
    ///
    /// Nothing where a leg does not reach. Motor 3 follows from the orientation alone, so that
    /// cos φ ≥ 0 whatever the mode.
    pub fn inverse_in(&self, mode: WorkingMode, rotation: &Matrix3<f64>) -> Option<[f64; 3]> {
        let [first, second] = &self.legs;
        let [one, other] = mode.solutions();
        let theta1 = first.inverse(&self.point(rotation, 0))?[one];
        let theta2 = second.inverse(&self.point(rotation, 1))?[other];
        Some([theta1, theta2, atan2(rotation[(1, 0)], rotation[(0, 0)])])
    }

    /// Returns all four inverse solutions, in the order of [`WorkingMode::ALL`].
    pub fn inverse_all(&self, rotation: &Matrix3<f64>) -> Option<[[f64; 3]; 4]> {
        let [a, b, c, d] = WorkingMode::ALL.map(|mode| self.inverse_in(mode, rotation));
        Some([a?, b?, c?, d?])
    }

    /// Returns the orientation for the motors' angles, in home's assembly mode and with cos φ > 0.
    pub fn direct(&self, theta: &[f64; 3]) -> Option<Matrix3<f64>> {
        let found = self.direct_in(AssemblyMode::HOME, theta)?;
        // cos φ is how far C1 lies along the x axis that motor 3 turned.
        let ahead = found[(0, 0)] * cos(theta[2]) + found[(1, 0)] * sin(theta[2]);
        if ahead > 0.0 { Some(found) } else { None }
    }

    /// Returns the orientation for the motors' angles in an assembly mode, whatever the sign of
    /// cos φ; nothing where the legs do not meet the platform so.
    pub fn direct_in(&self, mode: AssemblyMode, theta: &[f64; 3]) -> Option<Matrix3<f64>> {
        let (s3, c3) = (sin(theta[2]), cos(theta[2]));
        let flat = Vector3::new(c3, s3, 0.0);
        let y = Vector3::new(-s3, c3, 0.0);
        let up = Vector3::new(0.0, 0.0, 1.0);
        let [first, second] = mode.below();
        let pick = |roots: [(f64, f64); 2], is_first: bool| roots[usize::from(!is_first)];
        // The first root on leg 1 has B1·z'' ≤ 0; on leg 2 it has B2·z_m ≥ 0.
        let phis = self.legs[0].meeting(self.arm, theta[0], &flat, &-up)?;
        let (sine, cosine) = pick(phis, first);
        let x = flat * cosine - up * sine;
        let z = flat * sine + up * cosine;
        let psis = self.legs[1].meeting(self.arm, theta[1], &y, &z)?;
        let (sine, cosine) = pick(psis, !second);
        let across = y * cosine + z * sine;
        let ahead = z * cosine - y * sine;
        Some(Matrix3::from_columns(&[x, across, ahead]))
    }

    /// Returns all direct solutions, as far as they exist, in the order of [`AssemblyMode::ALL`].
    pub fn direct_all(&self, theta: &[f64; 3]) -> [Option<Matrix3<f64>>; 4] {
        AssemblyMode::ALL.map(|mode| self.direct_in(mode, theta))
    }

    /// Returns A and B at a configuration: A ω = B θ̇, lengths in arms.
    pub fn jacobians(&self, rotation: &Matrix3<f64>, theta: &[f64; 3]) -> Jacobians {
        let (s3, c3) = (sin(theta[2]), cos(theta[2]));
        let x = rotation.column(0).into_owned();
        let y = Vector3::new(-s3, c3, 0.0);
        let mut a = Matrix3::zeros();
        let mut b = Vector3::new(0.0, 0.0, c3 * x[0] + s3 * x[1]);
        for (i, leg) in self.legs.iter().enumerate() {
            let p = rotation.column(i).into_owned();
            let l = leg.crank_vector(theta[i]) / self.arm;
            let r = p - leg.center / self.arm - l;
            a.set_row(i, &p.cross(&r).transpose());
            b[i] = l.cross(&r).dot(&leg.axis);
        }
        a.set_row(2, &x.cross(&y).transpose());
        Jacobians { a, b }
    }

    /// Returns the platform's point C of a leg, in the unit of the arm.
    pub fn point(&self, rotation: &Matrix3<f64>, leg: usize) -> Vector3<f64> {
        rotation.column(leg) * self.arm
    }
}
