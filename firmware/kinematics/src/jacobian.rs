//! Rates and torques at one configuration: A ω = B θ̇ and τ = B A⁻ᵀ M.
//!
//! In the basis (x'', y', z'') of the serial leg's axes the rows of A are (0, −W1, −P), (W2, −Qs,
//! Qc) and (0, 0, 1), the first two over the crank's length: triangular, so that τ takes two
//! divisions, none of them by B, and det A = ρ1 ρ2 W1 W2.

use eel_units::{AngularVelocity, Reciprocal, Torque, round_shift, round_shift_saturating};

use crate::vector::{Vector, dot};

/// A, B and det A at one configuration of the wrist, and the map of torques made from them.
///
/// Row 3 of A is the exact one, z'', with B₃₃ = cos φ; the paper's printed [0 0 1] holds at φ = 0
/// only (`tests/errata.rs`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Jacobian {
    /// The basis x'', y', z'', Q30.
    basis: [Vector; 3],
    /// The assembly margins W1 and W2, Q30.
    margins: [i32; 2],
    /// P, Q29.
    across: i32,
    /// Qs and Qc, Q29.
    along: [i32; 2],
    /// (l×r)·i over ρ for the legs, and cos φ, Q29.
    serial: [i32; 3],
    /// det A, Q30.
    determinant: i32,
    /// The rows of B A⁻ᵀ, Q27, one per motor.
    torque: [Vector; 3],
}

impl Jacobian {
    /// Makes it from its parts; nothing where a torque would exceed eight times the moment.
    #[inline(always)]
    pub(crate) fn new(
        basis: [Vector; 3],
        margins: [i32; 2],
        across: i32,
        along: [i32; 2],
        serial: [i32; 3],
        cranks: i32,
    ) -> Option<Self> {
        let [x, y, z] = &basis;
        // W > ½: one over it is below 2, in Q30.
        let [inverse1, inverse2] =
            margins.map(|margin| i64::from(Reciprocal::new(margin).to_q30()));
        let mut torque = [[0; 3]; 3];
        let mut excess = 0;
        for axis in 0..3 {
            // Aᵀλ = M for a unit moment about this axis of the base.
            let lambda2 = i64::from(round_shift::<30>(i64::from(x[axis]) * inverse2)); // Q30
            // Below 7 in Q28; over W below 14, and cut to 8 with the answer as a whole.
            let sum = (i64::from(y[axis]) << 29) + i64::from(along[0]) * lambda2; // Q59
            let sum = i64::from(round_shift::<31>(sum));
            let lambda1 = -((sum * inverse1 + (1 << 29)) >> 30);
            let sum = (i64::from(z[axis]) << 27) // Q57
                + i64::from(across) * lambda1
                - ((i64::from(along[1]) * lambda2) >> 2);
            let lambda3 = (sum + (1 << 29)) >> 30; // Q27
            // λ1 in Q28 and λ3 in Q27, each below 8.
            excess |= (lambda1.abs() >> 31) | (lambda3.abs() >> 30);
            torque[0][axis] = round_shift::<30>(i64::from(serial[0]) * lambda1);
            torque[1][axis] = round_shift::<32>(i64::from(serial[1]) * lambda2);
            torque[2][axis] = round_shift::<29>(i64::from(serial[2]) * lambda3);
        }
        if excess != 0 {
            return None;
        }
        let both = round_shift::<31>(i64::from(margins[0]) * i64::from(margins[1])); // Q29
        let determinant = round_shift::<29>(i64::from(both) * i64::from(cranks));
        Some(Self {
            basis,
            margins,
            across,
            along,
            serial,
            determinant,
            torque,
        })
    }

    /// Returns det A in Q30: 1 at home, at least 0.674 in the paper's workspace.
    #[inline]
    pub const fn det_a(&self) -> i32 {
        self.determinant
    }

    /// Returns the rows of B A⁻ᵀ in Q27, one per motor: torque for a unit moment about x, y, z.
    ///
    /// Each number is wrong by at most 2 parts in 10⁸ and within ±8.5.
    #[inline]
    pub const fn torque_rows(&self) -> &[[i32; 3]; 3] {
        &self.torque
    }

    /// Returns the motors' rates for an angular velocity of the platform: θ̇ = B⁻¹ A ω.
    ///
    /// A rate beyond ±128 rad/s saturates.
    pub fn motor_rates(&self, omega: [AngularVelocity; 3]) -> [AngularVelocity; 3] {
        let omega = omega.map(AngularVelocity::to_q24);
        let [x, y, z] = self
            .basis
            .map(|axis| i64::from(round_shift_saturating::<30>(dot(&axis, &omega))));
        let [w1, w2] = self.margins.map(i64::from);
        let [sine, cosine] = self.along.map(i64::from);
        // Q53: every factor of Q29 is below 2³⁰·⁶, so that three products fit.
        let first = -((w1 * y) >> 1) - i64::from(self.across) * z;
        let second = ((w2 * x) >> 1) - sine * y + cosine * z;
        let rates = [
            round_shift_saturating::<29>(first),
            round_shift_saturating::<29>(second),
            z as i32,
        ];
        self.over_serial(rates).map(AngularVelocity::from_q24)
    }

    /// Returns the platform's angular velocity for the motors' rates: ω = A⁻¹ B θ̇.
    ///
    /// By virtual work this is the transpose of the torque map. A component beyond ±128 rad/s
    /// saturates.
    pub fn angular_velocity(&self, rates: [AngularVelocity; 3]) -> [AngularVelocity; 3] {
        let rates = rates.map(AngularVelocity::to_q24);
        let [first, second, third] = &self.torque;
        [0, 1, 2].map(|axis| {
            let column = [first[axis], second[axis], third[axis]];
            AngularVelocity::from_q24(round_shift_saturating::<27>(dot(&column, &rates)))
        })
    }

    /// Returns the motors' torques for a moment on the platform: τ = B A⁻ᵀ M, without bounds.
    ///
    /// Wrong by at most 0.25 µN·m per N·m in the paper's workspace; beyond ±128 N·m it saturates.
    pub fn torques(&self, moment: [Torque; 3]) -> [Torque; 3] {
        let moment = moment.map(Torque::to_q24);
        self.torque
            .map(|row| Torque::from_q24(round_shift_saturating::<27>(dot(&row, &moment))))
    }

    /// Returns the moment on the platform for the motors' torques: M = Aᵀ B⁻¹ τ.
    ///
    /// A component beyond ±128 N·m saturates.
    pub fn moment(&self, torques: [Torque; 3]) -> [Torque; 3] {
        let [first, second, third] = self.over_serial(torques.map(Torque::to_q24)).map(i64::from);
        let [w1, w2] = self.margins.map(i64::from);
        let [sine, cosine] = self.along.map(i64::from);
        let parts = [
            round_shift_saturating::<30>(w2 * second),
            round_shift_saturating::<29>(-((w1 * first) >> 1) - sine * second),
            round_shift_saturating::<29>(
                cosine * second - i64::from(self.across) * first + (third << 29),
            ),
        ];
        let [x, y, z] = &self.basis;
        [0, 1, 2].map(|axis| {
            let row = [x[axis], y[axis], z[axis]];
            Torque::from_q24(round_shift_saturating::<30>(dot(&row, &parts)))
        })
    }

    /// Divides by the diagonal of B; each entry is at least ⅛.
    fn over_serial(&self, numbers: Vector) -> Vector {
        let [a, b, c] = self.serial.map(Reciprocal::new);
        [
            a.times_over_q29(numbers[0]),
            b.times_over_q29(numbers[1]),
            c.times_over_q29(numbers[2]),
        ]
    }
}
