//! An orthographic view: from the base frame to px, z up.

use eel_kinematics::design::Vector3;

use super::super::svg::Point;

/// Where the eye is: turned from −y towards +x by the azimuth, raised by the elevation.
///
/// Chosen so that at home of all three architectures no two parts of the legs lie over each other.
const AZIMUTH: f64 = 11.0;
const ELEVATION: f64 = 17.0;

/// A view of the base frame.
#[derive(Clone, Copy, Debug)]
pub struct View {
    right: Vector3<f64>,
    up: Vector3<f64>,
    away: Vector3<f64>,
    /// px of a unit of length.
    scale: f64,
    /// Where O is drawn.
    origin: Point,
}

impl View {
    /// Returns the view at a scale in px, with O at a point.
    pub fn new(scale: f64, origin: Point) -> Self {
        let (azimuth, elevation) = (AZIMUTH.to_radians(), ELEVATION.to_radians());
        let (sa, ca) = azimuth.sin_cos();
        let (se, ce) = elevation.sin_cos();
        let level = Vector3::new(-sa, ca, 0.0);
        Self {
            right: Vector3::new(ca, sa, 0.0),
            up: level * se + Vector3::z() * ce,
            away: level * ce - Vector3::z() * se,
            scale,
            origin,
        }
    }

    /// Returns where a point is drawn.
    pub fn place(&self, point: &Vector3<f64>) -> Point {
        [
            self.origin[0] + self.scale * point.dot(&self.right),
            self.origin[1] - self.scale * point.dot(&self.up),
        ]
    }

    /// Returns px of a unit of length that is seen square.
    pub fn length(&self) -> f64 {
        self.scale
    }

    /// Returns px of a joint's radius.
    pub fn radius(&self) -> f64 {
        3.0 + 0.016 * self.scale
    }

    /// Returns how far a point is from the eye, from O's distance on.
    pub fn depth(&self, point: &Vector3<f64>) -> f64 {
        point.dot(&self.away)
    }

    /// Returns whether a direction points towards the eye.
    pub fn is_facing(&self, direction: &Vector3<f64>) -> bool {
        direction.dot(&self.away) < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn z_is_up_x_to_the_right_and_y_away() {
        let view = View::new(100.0, [0.0, 0.0]);
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| view.place(&axis));
        assert!(z[0].abs() < 1e-9 && z[1] < -80.0);
        assert!(x[0] > 80.0 && y[0] > 0.0 && y[1] < 0.0);
        assert!(view.depth(&Vector3::y()) > 0.0 && view.is_facing(&-Vector3::y()));
        // Right-handed and of unit length.
        let cross = view.right.cross(&view.up) + view.away;
        assert!(cross.amax() < 1e-12 && (view.up.norm() - 1.0).abs() < 1e-12);
    }
}
