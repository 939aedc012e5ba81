//! Rates and torques at one configuration: A ω = B θ̇ and τ = B A⁻ᵀ M.
//!
//! In the basis (x'', y', z'') of the serial leg's axes the rows of A are (0, −W1, −P), (W2, −Qs,
//! Qc) and (0, 0, 1), the first two over the crank's length: triangular, so that τ takes two
//! divisions, none of them by B, and det A = ρ1 ρ2 W1 W2.

use eel_units::{
    AngularVelocity, Torque, multiply_high, ratio_q30, round_shift_saturating, saturate,
};

use crate::vector::{Vector, add_cross, dot, high, wide};

/// The Jacobian at one configuration of the wrist: J = A⁻¹ B and its transpose, the map of torques.
///
/// Row 3 of A is the exact one, z'', with B₃₃ = cos φ; the paper's printed [0 0 1] holds at φ = 0
/// only (`tests/errata.rs`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Jacobian {
    /// det A, Q30.
    determinant: i32,
    /// The rows of B A⁻ᵀ = Jᵀ, Q26, one per motor.
    torque: [Vector; 3],
}

/// The axes of the serial leg.
pub(crate) struct Basis {
    /// x'', Q30.
    pub x: Vector,
    /// The first two of y', Q31; the third is zero.
    pub y: [i32; 2],
    /// Its opposite.
    pub minus_y: [i32; 2],
    /// z'', Q31; its third is cos φ = B₃₃.
    pub z: Vector,
}

/// Leg 1's part in the map of torques.
pub(crate) struct First {
    /// b1 / W1, Q28, up to 1.5.
    gear: i32,
    /// −P / W1, Q30, within ±2.
    lean: i32,
}

/// Leg 2's part in the map of torques.
pub(crate) struct Second {
    /// b2 / W2, Q28, up to 1.5.
    gear: i32,
    /// −Qs / W2, Q30, within ±2.
    skew: i32,
    /// −Qc / W2, Q28, within ±2.
    lean: i32,
}

/// Returns 1 / W, at most 4/3, in Q30, for W in Q29 from ¾ to 1.5.
#[inline(always)]
fn invert(margin: i32) -> i32 {
    ratio_q30(1 << 28, margin) << 1
}

impl First {
    /// Makes it from W1 (Q29), (l×r)·i / ρ and −P (Q30).
    #[inline(always)]
    pub fn new(margin: i32, serial: i32, across: i32) -> Self {
        let inverse = invert(margin);
        Self {
            gear: multiply_high(serial, inverse),
            lean: multiply_high(across, inverse) << 2,
        }
    }
}

impl Second {
    /// Makes it from W2 (Q29), (l×r)·i / ρ (Q30), −Qs and −Qc (Q29).
    #[inline(always)]
    pub fn new(margin: i32, serial: i32, along: [i32; 2]) -> Self {
        let inverse = invert(margin);
        let [sine, cosine] = along;
        Self {
            gear: multiply_high(serial, inverse),
            skew: multiply_high(sine, inverse) << 3,
            lean: multiply_high(cosine, inverse) << 1,
        }
    }
}

impl Jacobian {
    /// Makes the map of torques.
    ///
    /// Aᵀλ = M in the basis, then τ = B λ: τ1 = −b1/W1 (Qs/W2 Mx + My), τ2 = b2/W2 Mx,
    /// τ3 = cos φ (Mz − P/W1 My − (P Qs/W1 + Qc)/W2 Mx). Every factor is below 5, in Q28.
    #[inline(always)]
    pub(crate) fn new(basis: &Basis, first: &First, second: &Second, determinant: i32) -> Self {
        let Basis { x, y, minus_y, z } = basis;
        let ex = multiply_high(first.gear, second.skew) << 2;
        let ey = first.gear >> 1; // Q27, for −y in Q31
        let sum = second.lean - multiply_high(first.lean, second.skew);
        let gx = multiply_high(z[2], sum) << 1;
        let gy = multiply_high(z[2], first.lean) >> 2; // Q27
        let gz = z[2] >> 4; // Q27
        Self {
            determinant,
            torque: [
                [
                    high(wide(ex, x[0]) + wide(ey, minus_y[0])),
                    high(wide(ex, x[1]) + wide(ey, minus_y[1])),
                    multiply_high(ex, x[2]),
                ],
                x.map(|component| multiply_high(second.gear, component)),
                [
                    high(wide(gx, x[0]) + wide(gy, y[0]) + wide(gz, z[0])),
                    high(wide(gx, x[1]) + wide(gy, y[1]) + wide(gz, z[1])),
                    high(wide(gx, x[2]) + wide(gz, z[2])),
                ],
            ],
        }
    }

    /// Returns the parallel margin det A in Q30: 1 at home, at least 0.674 in the paper's workspace.
    #[inline]
    pub const fn det_a(&self) -> i32 {
        self.determinant
    }

    /// Returns the rows of B A⁻ᵀ in Q26, one per motor: torque for a unit moment about x, y, z.
    ///
    /// Each number is within ±5.4, and wrong by at most 1 part in 10⁷ in the paper's workspace (measured), 1.2 in
    /// 10⁵ wherever there is an answer (proven).
    #[inline]
    pub const fn torque_rows(&self) -> &[[i32; 3]; 3] {
        &self.torque
    }

    /// Returns the platform's angular velocity for the motors' rates: ω = A⁻¹ B θ̇.
    ///
    /// By virtual work this is the transpose of the torque map. A component beyond ±128 rad/s
    /// saturates.
    pub fn angular_velocity(&self, rates: [AngularVelocity; 3]) -> [AngularVelocity; 3] {
        let rates = rates.map(AngularVelocity::to_q24);
        self.columns().map(|column| {
            AngularVelocity::from_q24(round_shift_saturating::<26>(dot(&column, &rates)))
        })
    }

    /// Returns the motors' rates for an angular velocity of the platform: θ̇ = B⁻¹ A ω.
    ///
    /// Wrong by at most 6 parts in 10⁷ of the largest component in the paper's workspace; a rate beyond
    /// ±128 rad/s saturates.
    pub fn motor_rates(&self, omega: [AngularVelocity; 3]) -> [AngularVelocity; 3] {
        solve(&self.columns(), omega.map(AngularVelocity::to_q24)).map(AngularVelocity::from_q24)
    }

    /// Returns the motors' torques for a moment on the platform: τ = B A⁻ᵀ M, without bounds.
    ///
    /// Wrong by at most 0.25 µN·m per N·m in the paper's workspace; beyond ±128 N·m it saturates.
    pub fn torques(&self, moment: [Torque; 3]) -> [Torque; 3] {
        let moment = moment.map(Torque::to_q24);
        self.torque
            .map(|row| Torque::from_q24(round_shift_saturating::<26>(dot(&row, &moment))))
    }

    /// Returns the moment on the platform for the motors' torques: M = Aᵀ B⁻¹ τ.
    ///
    /// Wrong by at most 6 parts in 10⁷ of the largest torque in the paper's workspace; a component beyond
    /// ±128 N·m saturates.
    pub fn moment(&self, torques: [Torque; 3]) -> [Torque; 3] {
        solve(&self.torque, torques.map(Torque::to_q24)).map(Torque::from_q24)
    }

    /// Returns the columns of the map of torques, which are the rows of J.
    fn columns(&self) -> [Vector; 3] {
        let [a, b, c] = &self.torque;
        [0, 1, 2].map(|axis| [a[axis], b[axis], c[axis]])
    }
}

/// Solves a small system with rows in Q26, each number within ±5, by Cramer's rule; saturates.
///
/// For reports and tests, not for the control tick: it divides 64 bits by 64.
fn solve(rows: &[Vector; 3], right: Vector) -> Vector {
    let [a, b, c] = rows;
    // Q52 to Q24: each number is within ±50.
    let cross = |one: &Vector, other: &Vector| {
        let mut product = [0; 3];
        add_cross(&mut product, one, other);
        product.map(|component| (component + (1 << 27)) >> 28)
    };
    let crosses = [cross(b, c), cross(c, a), cross(a, b)];
    let determinant = a.iter().zip(&crosses[0]).map(|(a, b)| i64::from(*a) * b);
    let determinant = (determinant.sum::<i64>() + (1 << 25)) >> 26; // Q24
    [0, 1, 2].map(|axis| {
        let parts = crosses.iter().zip(right);
        // Q48, within 2⁶³.
        let sum: i64 = parts
            .map(|(cross, right)| cross[axis] * i64::from(right))
            .sum();
        saturate(sum.checked_div(determinant).unwrap_or(i64::MAX))
    })
}
