//! Rates, torques and margins of a configuration.

use nalgebra::{Matrix3, Vector3};

/// A and the diagonal of B at one configuration: A ω = B θ̇, rows (p×r)ᵀ, (p×r)ᵀ, z''ᵀ.
///
/// Rows 1 and 2 of A and of B are products of two lengths, row 3 is a number. Here lengths are in
/// units of the platform's arm, so that nothing depends on the scale; [`Jacobians::scaled`] gives the
/// paper's rows. The maps B⁻¹A, A⁻¹B and B A⁻ᵀ are the same for both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jacobians {
    /// A, lengths in arms.
    pub a: Matrix3<f64>,
    /// The diagonal of B: (l×r)·i of both legs with lengths in arms, and cos φ.
    pub b: Vector3<f64>,
}

impl Jacobians {
    /// Returns B A⁻ᵀ, which makes motor torques of a moment; nothing where A is singular.
    pub fn torque_map(&self) -> Option<Matrix3<f64>> {
        let inverse = self.a.try_inverse()?;
        Some(Matrix3::from_diagonal(&self.b) * inverse.transpose())
    }

    /// Returns the motors' torques for a moment: τ = B A⁻ᵀ M.
    pub fn torques(&self, moment: &Vector3<f64>) -> Option<Vector3<f64>> {
        Some(self.torque_map()? * moment)
    }

    /// Returns the moment for the motors' torques: M = Aᵀ B⁻¹ τ; infinite at a serial singularity.
    pub fn moment(&self, torques: &Vector3<f64>) -> Vector3<f64> {
        self.a.transpose() * torques.component_div(&self.b)
    }

    /// Returns the motors' rates for an angular velocity: θ̇ = B⁻¹ A ω; infinite at a serial
    /// singularity.
    pub fn motor_rates(&self, omega: &Vector3<f64>) -> Vector3<f64> {
        (self.a * omega).component_div(&self.b)
    }

    /// Returns the angular velocity for the motors' rates: ω = A⁻¹ B θ̇.
    pub fn angular_velocity(&self, rates: &Vector3<f64>) -> Option<Vector3<f64>> {
        Some(self.a.try_inverse()? * self.b.component_mul(rates))
    }

    /// Returns det A: 1 at home, 0 at an assembly singularity.
    pub fn det_a(&self) -> f64 {
        self.a.determinant()
    }

    /// Returns A⁻¹ B, which makes an angular velocity of the motors' rates; nothing where A is
    /// singular. It is the transpose of the torque map.
    pub fn velocity_map(&self) -> Option<Matrix3<f64>> {
        Some(self.torque_map()?.transpose())
    }

    /// Returns Aᵀ B⁻¹, which makes a moment of the motors' torques: the inverse of the torque map;
    /// nothing at a serial singularity. It is the transpose of [`Jacobians::rate_map`].
    pub fn moment_map(&self) -> Option<Matrix3<f64>> {
        let map = self.rate_map().transpose();
        if map.iter().all(|entry| entry.is_finite()) {
            Some(map)
        } else {
            None
        }
    }

    /// Returns A and B with lengths in the unit of an arm: rows 1 and 2 in length².
    pub fn scaled(&self, arm: f64) -> Self {
        let square = Vector3::new(arm * arm, arm * arm, 1.0);
        Self {
            a: Matrix3::from_diagonal(&square) * self.a,
            b: self.b.component_mul(&square),
        }
    }
}
