//! Forces of the water on one body, beyond the added mass inside its inertia.
//!
//! Lighthill's elongated-body theory in Boyer and Porez's form: the Kirchhoff bias of body and
//! water together, drag by strips, and the momentum that the trailing edge sheds.

use super::algebra::Vec3;
use super::body::{Body, Edge};

/// A moment about the body's origin and a force, in the body's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Moment, N·m.
    pub moment: Vec3,
    /// Force, N.
    pub force: Vec3,
}

/// Returns v ×* (I v): what inertia alone needs to keep body and water on their course.
#[inline(always)]
pub fn bias(body: &Body, spin: Vec3, velocity: Vec3) -> Wrench {
    let (angular, linear) = body.inertia.momentum(spin, velocity);
    Wrench {
        moment: spin.cross(angular) + velocity.cross(linear),
        force: spin.cross(linear),
    }
}

/// Returns the drag of a body that moves through still water.
#[inline(always)]
pub fn drag(body: &Body, spin: Vec3, velocity: Vec3) -> Wrench {
    let ([wx, wy, wz], [vx, vy, vz]) = (spin.0, velocity.0);
    let along = vz * vz.abs();
    let rolling = wz * wz.abs();
    let mut wrench = Wrench::default();
    for strip in &body.strips {
        // Velocity of the axis at the middle of the strip.
        let (x, y) = (vx + wy * strip.z, vy - wx * strip.z);
        let cross_speed = libm::sqrt(x * x + y * y);
        let fx = -strip.vertical * cross_speed * x;
        let fy = -strip.lateral * cross_speed * y;
        wrench.force += Vec3::new(fx, fy, -strip.skin * along);
        wrench.moment += Vec3::new(-strip.z * fy, strip.z * fx, -strip.roll * rolling);
    }
    wrench
}

/// Returns the force of the momentum shed at the trailing edge: F = −u m w n + ½ m w² t, with the
/// edge's forward speed u and cross speed w, while it moves forward; t points to the head.
#[inline(always)]
pub fn shed(edge: &Edge, spin: Vec3, velocity: Vec3) -> Wrench {
    let ([wx, wy, _], [vx, vy, vz]) = (spin.0, velocity.0);
    let forward = -vz;
    if forward <= 0.0 {
        return Wrench::default();
    }
    let (x, y) = (vx + wy * edge.z, vy - wx * edge.z);
    let (fx, fy) = (-forward * edge.vertical * x, -forward * edge.lateral * y);
    let thrust = 0.5 * (edge.vertical * x * x + edge.lateral * y * y);
    Wrench {
        moment: Vec3::new(-edge.z * fy, edge.z * fx, 0.0),
        force: Vec3::new(fx, fy, -thrust),
    }
}

impl Wrench {
    /// Adds another wrench.
    #[inline(always)]
    pub fn add(&mut self, other: Self) {
        self.moment += other.moment;
        self.force += other.force;
    }

    /// Returns its power at a velocity, W.
    #[inline(always)]
    pub fn power(&self, spin: Vec3, velocity: Vec3) -> f64 {
        self.moment.dot(spin) + self.force.dot(velocity)
    }
}
