//! Three-vectors, 3×3 matrices and unit quaternions in f64.
//!
//! Only additions, multiplications, divisions and square roots, in a fixed order: the same bits on
//! every machine and at every optimisation level. Deliberately absent: general sizes, and any
//! product that picks another instruction at run time.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// A vector of three components.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vec3(pub [f64; 3]);

/// A 3×3 matrix, kept by rows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mat3(pub [[f64; 3]; 3]);

/// A unit quaternion: scalar first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quat(pub [f64; 4]);

impl Vec3 {
    /// No length.
    pub const ZERO: Self = Self([0.0; 3]);

    /// Makes a vector from its components.
    #[inline(always)]
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self([x, y, z])
    }

    /// Returns the scalar product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> f64 {
        self.0[0] * other.0[0] + self.0[1] * other.0[1] + self.0[2] * other.0[2]
    }

    /// Returns the vector product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// Returns the length.
    #[inline(always)]
    pub fn norm(self) -> f64 {
        libm::sqrt(self.dot(self))
    }
}

impl Add for Vec3 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([a + x, b + y, c + z])
    }
}

impl Sub for Vec3 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([a - x, b - y, c - z])
    }
}

impl Neg for Vec3 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self([-self.0[0], -self.0[1], -self.0[2]])
    }
}

impl AddAssign for Vec3 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Vec3 {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Mul<f64> for Vec3 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: f64) -> Self {
        Self([self.0[0] * k, self.0[1] * k, self.0[2] * k])
    }
}

impl Mat3 {
    /// Zero everywhere.
    pub const ZERO: Self = Self([[0.0; 3]; 3]);
    /// One on the diagonal.
    pub const IDENTITY: Self = Self::diagonal(1.0, 1.0, 1.0);

    /// Makes a diagonal matrix.
    #[inline(always)]
    pub const fn diagonal(x: f64, y: f64, z: f64) -> Self {
        Self([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]])
    }

    /// Returns the matrix of the vector product with `v` from the left.
    #[inline(always)]
    pub const fn cross(v: Vec3) -> Self {
        let [x, y, z] = v.0;
        Self([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    }

    /// Returns the transpose.
    #[inline(always)]
    pub const fn transpose(self) -> Self {
        let [[a, b, c], [d, e, f], [g, h, i]] = self.0;
        Self([[a, d, g], [b, e, h], [c, f, i]])
    }

    /// Returns the product of the transpose with a vector.
    #[inline(always)]
    pub fn transpose_mul(self, v: Vec3) -> Vec3 {
        let ([[a, b, c], [d, e, f], [g, h, i]], [x, y, z]) = (self.0, v.0);
        Vec3([
            a * x + d * y + g * z,
            b * x + e * y + h * z,
            c * x + f * y + i * z,
        ])
    }

    /// Returns the inverse of a symmetric matrix, itself symmetric.
    #[inline(always)]
    pub fn inverse_symmetric(self) -> Self {
        let [[a, b, c], [_, d, e], [_, _, f]] = self.0;
        let (p, q, r) = (d * f - e * e, c * e - b * f, b * e - c * d);
        let scale = 1.0 / (a * p + b * q + c * r);
        let (p, q, r) = (p * scale, q * scale, r * scale);
        let s = (a * f - c * c) * scale;
        let t = (b * c - a * e) * scale;
        let u = (a * d - b * b) * scale;
        Self([[p, q, r], [q, s, t], [r, t, u]])
    }

    /// Returns `selfᵀ · diag(d) · self`, symmetric to the last bit.
    #[inline(always)]
    pub fn gram(self, d: Vec3) -> Self {
        let ([x, y, z], [p, q, r]) = (self.0, d.0);
        let entry = |i: usize, j: usize| p * x[i] * x[j] + q * y[i] * y[j] + r * z[i] * z[j];
        let (a, b, c) = (entry(0, 0), entry(0, 1), entry(0, 2));
        let (e, f, i) = (entry(1, 1), entry(1, 2), entry(2, 2));
        Self([[a, b, c], [b, e, f], [c, f, i]])
    }
}

impl Add for Mat3 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([
            row_sum(a[0], b[0]),
            row_sum(a[1], b[1]),
            row_sum(a[2], b[2]),
        ])
    }
}

impl Sub for Mat3 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl AddAssign for Mat3 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Mul<f64> for Mat3 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: f64) -> Self {
        let row = |r: [f64; 3]| [r[0] * k, r[1] * k, r[2] * k];
        Self([row(self.0[0]), row(self.0[1]), row(self.0[2])])
    }
}

impl Mul<Vec3> for Mat3 {
    type Output = Vec3;
    #[inline(always)]
    fn mul(self, v: Vec3) -> Vec3 {
        let [a, b, c] = self.0;
        Vec3([Vec3(a).dot(v), Vec3(b).dot(v), Vec3(c).dot(v)])
    }
}

impl Mul for Mat3 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let row = |r: [f64; 3]| other.transpose_mul(Vec3(r)).0;
        Self([row(self.0[0]), row(self.0[1]), row(self.0[2])])
    }
}

impl Quat {
    /// No rotation.
    pub const IDENTITY: Self = Self([1.0, 0.0, 0.0, 0.0]);

    /// Returns the Hamilton product.
    #[inline(always)]
    pub fn product(self, other: Self) -> Self {
        let ([a, b, c, d], [w, x, y, z]) = (self.0, other.0);
        Self([
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ])
    }

    /// Returns the rate of change under an angular velocity given in the turned frame, rad/s.
    #[inline(always)]
    pub fn rate(self, velocity: Vec3) -> Self {
        let [x, y, z] = (velocity * 0.5).0;
        self.product(Self([0.0, x, y, z]))
    }

    /// Returns the sum with `k` times another; no longer of unit length.
    #[inline(always)]
    pub fn plus_scaled(self, other: Self, k: f64) -> Self {
        let ([a, b, c, d], [w, x, y, z]) = (self.0, other.0);
        Self([a + w * k, b + x * k, c + y * k, d + z * k])
    }

    /// Returns the quaternion at unit length.
    #[inline(always)]
    pub fn normalised(self) -> Self {
        let [a, b, c, d] = self.0;
        let k = 1.0 / libm::sqrt(a * a + b * b + c * c + d * d);
        Self([a * k, b * k, c * k, d * k])
    }

    /// Returns the rotation matrix, from the turned frame to the fixed one.
    #[inline(always)]
    pub fn matrix(self) -> Mat3 {
        let [w, x, y, z] = self.0;
        let (xx, yy, zz) = (2.0 * x * x, 2.0 * y * y, 2.0 * z * z);
        let (xy, xz, yz) = (2.0 * x * y, 2.0 * x * z, 2.0 * y * z);
        let (wx, wy, wz) = (2.0 * w * x, 2.0 * w * y, 2.0 * w * z);
        Mat3([
            [1.0 - yy - zz, xy - wz, xz + wy],
            [xy + wz, 1.0 - xx - zz, yz - wx],
            [xz - wy, yz + wx, 1.0 - xx - yy],
        ])
    }

    /// Makes the rotation Rx(yaw) Ry(pitch) Rz(roll), angles in radians.
    pub fn from_pose(pose: [f64; 3]) -> Self {
        let half = |angle: f64| (libm::cos(angle * 0.5), libm::sin(angle * 0.5));
        let ((cy, sy), (cp, sp), (cr, sr)) = (half(pose[0]), half(pose[1]), half(pose[2]));
        Self([cy, sy, 0.0, 0.0])
            .product(Self([cp, 0.0, sp, 0.0]))
            .product(Self([cr, 0.0, 0.0, sr]))
    }
}

/// Returns the yaw, pitch and roll, in radians, of a rotation Rx(yaw) Ry(pitch) Rz(roll).
pub fn pose_of(rotation: &Mat3) -> [f64; 3] {
    let [[r00, r01, r02], [_, _, r12], [_, _, r22]] = rotation.0;
    [
        libm::atan2(-r12, r22),
        libm::asin(r02.clamp(-1.0, 1.0)),
        libm::atan2(-r01, r00),
    ]
}

/// Returns the matrix that turns an angular velocity of the tail-side body relative to the
/// head-side one, in the tail-side frame, into the rates of yaw, pitch and roll.
///
/// Singular at a pitch of ±90°, far outside a joint's stops.
pub fn pose_rate_matrix(rotation: &Mat3) -> Mat3 {
    let [[r00, r01, sin_pitch], ..] = rotation.0;
    // r00 = cos pitch · cos roll and r01 = −cos pitch · sin roll.
    let cos_squared = r00 * r00 + r01 * r01;
    let cos_pitch = libm::sqrt(cos_squared);
    let (x, y) = (r00 / cos_squared, r01 / cos_squared);
    Mat3([
        [x, y, 0.0],
        [-r01 / cos_pitch, r00 / cos_pitch, 0.0],
        [-sin_pitch * x, -sin_pitch * y, 1.0],
    ])
}

/// Adds two rows.
#[inline(always)]
fn row_sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSE: [f64; 3] = [0.4, -0.2, 0.06];

    #[test]
    fn a_pose_survives_the_way_there_and_back() {
        let found = pose_of(&Quat::from_pose(POSE).matrix());
        for (found, expected) in found.iter().zip(POSE) {
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
    }

    #[test]
    fn rates_of_the_pose_agree_with_finite_differences() {
        let velocity = Vec3::new(0.7, -1.3, 2.1);
        let turned = |h: f64| {
            let q = Quat::from_pose(POSE);
            pose_of(&q.plus_scaled(q.rate(velocity), h).normalised().matrix())
        };
        let rates = pose_rate_matrix(&Quat::from_pose(POSE).matrix()) * velocity;
        let (after, before) = (turned(1e-5), turned(-1e-5));
        for i in 0..3 {
            let slope = (after[i] - before[i]) / 2e-5;
            assert!((rates.0[i] - slope).abs() < 1e-9, "{i}: {slope}");
        }
    }

    #[test]
    fn a_symmetric_matrix_times_its_inverse_is_one() {
        let m = Mat3([[4.0, 1.0, -0.5], [1.0, 3.0, 0.2], [-0.5, 0.2, 2.0]]);
        let product = m * m.inverse_symmetric();
        for (i, row) in product.0.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                assert!((value - f64::from(u8::from(i == j))).abs() < 1e-15);
            }
        }
    }
}
