//! How well each vertebra follows: the plant's true pose against the reference that it pursued.

use eel_kinematics::Pose;
use eel_units::Angle;

use super::NodeSummary;
use crate::robot::NODES;

/// The worst of each vertebra so far.
#[derive(Clone, Debug, Default)]
pub struct Tracking {
    error_rad: [Option<f64>; NODES],
    torque_nm: [f64; NODES],
    yaw_rad: [f64; NODES],
}

impl Tracking {
    /// Starts with nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a reference and the true yaw, pitch and roll at the same time, rad.
    pub fn note_pose(&mut self, index: usize, reference: &Pose, truth: [f64; 3]) {
        let wanted = [reference.yaw, reference.pitch, reference.roll].map(radians);
        let error = angle_between(wanted, truth);
        let worst = &mut self.error_rad[index];
        *worst = Some(worst.map_or(error, |before| before.max(error)));
        self.note_yaw(index, truth);
    }

    /// Takes the true yaw, pitch and roll of a vertebra whose reference nobody knows, rad.
    pub fn note_yaw(&mut self, index: usize, truth: [f64; 3]) {
        self.yaw_rad[index] = self.yaw_rad[index].max(truth[0].abs());
    }

    /// Takes the torques of a vertebra's motors, N·m.
    pub fn note_torque(&mut self, index: usize, torques: [f64; 3]) {
        for torque in torques {
            self.torque_nm[index] = self.torque_nm[index].max(torque.abs());
        }
    }

    /// Returns the worst angle between reference and truth of all vertebrae, rad.
    pub fn worst_error(&self) -> f64 {
        self.error_rad.iter().copied().flatten().fold(0.0, f64::max)
    }

    /// Returns the largest torque of any motor, N·m.
    pub fn peak_torque(&self) -> f64 {
        self.torque_nm.iter().copied().fold(0.0, f64::max)
    }

    /// Returns what to report of one vertebra.
    pub fn node(&self, index: usize) -> NodeSummary {
        NodeSummary {
            node: index as u8 + 1,
            peak_torque_nm: self.torque_nm[index],
            max_tracking_error_rad: self.error_rad[index],
            peak_yaw_rad: self.yaw_rad[index],
        }
    }
}

/// Returns an angle in radians.
pub fn radians(angle: Angle) -> f64 {
    f64::from(angle.to_q29()) / f64::from(1 << 29)
}

/// Returns the angle of the rotation between two poses given as yaw, pitch, roll, rad.
fn angle_between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (first, second) = (matrix(a), matrix(b));
    let mut square = 0.0;
    for (x, y) in first.into_iter().zip(second) {
        square += (x - y) * (x - y);
    }
    // ‖R₁ − R₂‖² = 8 sin²(φ/2).
    2.0 * libm::asin(libm::sqrt(square / 8.0).min(1.0))
}

/// Returns Rx(yaw) Ry(pitch) Rz(roll), row by row.
fn matrix([yaw, pitch, roll]: [f64; 3]) -> [f64; 9] {
    let (sx, cx) = libm::sincos(yaw);
    let (sy, cy) = libm::sincos(pitch);
    let (sz, cz) = libm::sincos(roll);
    [
        cy * cz,
        -cy * sz,
        sy,
        cx * sz + sx * sy * cz,
        cx * cz - sx * sy * sz,
        -sx * cy,
        sx * sz - cx * sy * cz,
        sx * cz + cx * sy * sz,
        cx * cy,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_between_poses_is_that_of_their_rotation() {
        assert!((angle_between([0.3, 0.0, 0.0], [0.1, 0.0, 0.0]) - 0.2).abs() < 1e-12);
        // Two small turns about different axes: the angle is √(0.003² + 0.004²) to second order.
        let small = angle_between([0.003, 0.004, 0.0], [0.0; 3]);
        assert!((small - 0.005).abs() < 1e-7);
    }
}
