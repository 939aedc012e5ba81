//! The eel cut into eleven bodies: inertia, added mass, buoyancy and strips of each.
//!
//! Body frames: z along the body from head to tail, x vertical, y lateral; the origin of the head
//! at the nose, that of every other body at the joint on its head side.

use std::f64::consts::PI;

use super::algebra::{Mat3, Vec3};
use super::config::{Ballast, Config, Shape, Water};

/// How many bodies the chain has.
pub const BODIES: usize = 11;
/// How many joints the chain has.
pub const JOINTS: usize = 10;

/// A symmetric 6×6 inertia: momentum = [[angular, coupling], [couplingᵀ, linear]] · velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inertia {
    /// Angular momentum for angular velocity, kg·m².
    pub angular: Mat3,
    /// Angular momentum for linear velocity, kg·m.
    pub coupling: Mat3,
    /// Linear momentum for linear velocity, kg.
    pub linear: Mat3,
}

/// Coefficients of the drag on one strip; force = −coefficient · speed · speed component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strip {
    /// Distance of its middle from the body's origin, m.
    pub z: f64,
    /// Drag of vertical flow, kg/m.
    pub vertical: f64,
    /// Drag of lateral flow, kg/m.
    pub lateral: f64,
    /// Friction along the skin, kg/m.
    pub skin: f64,
    /// Resistance to rolling, N·m·s².
    pub roll: f64,
}

/// One rigid piece of the eel.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Length along z, m.
    pub length_m: f64,
    /// Mass without the water's, kg.
    pub mass_kg: f64,
    /// Centre of mass in the body's frame, m.
    pub centre_of_mass: Vec3,
    /// Inertia of body and water together.
    pub inertia: Inertia,
    /// Buoyancy less weight, N; acts upwards at the origin together with `righting`.
    pub lift_n: f64,
    /// Moment of buoyancy and weight about the origin is this × up, N·m.
    pub righting: Vec3,
    /// Strips for the drag.
    pub strips: Vec<Strip>,
}

/// Added masses at the trailing edge, kg/m, where the tail sheds the momentum of the water.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Edge {
    /// For vertical motion.
    pub vertical: f64,
    /// For lateral motion.
    pub lateral: f64,
    /// Distance of the edge from the origin of the last body, m.
    pub z: f64,
}

impl Inertia {
    /// Returns the angular and the linear momentum at a velocity.
    #[inline(always)]
    pub fn momentum(&self, spin: Vec3, velocity: Vec3) -> (Vec3, Vec3) {
        (
            self.angular * spin + self.coupling * velocity,
            self.coupling.transpose_mul(spin) + self.linear * velocity,
        )
    }

    /// Adds masses, one for each direction, concentrated at a point.
    fn add_point(&mut self, point: Vec3, masses: Mat3) {
        let lever = Mat3::cross(point);
        self.linear += masses;
        self.coupling += lever * masses;
        self.angular += lever * masses * lever * -1.0;
    }
}

/// Cuts the eel into its bodies.
pub fn cut(config: &Config) -> [Body; BODIES] {
    std::array::from_fn(|index| {
        let shape = &config.shape;
        let (start, end) = (shape.body_start(index), shape.body_start(index + 1));
        let mut body = solid(config, start, end);
        if let Some(water) = &config.water {
            body.strips = strips(shape, water, start, end, config.strips_per_body);
        }
        if let Some(ballast) = config.ballast.filter(|ballast| ballast.body == index) {
            load(&mut body, &ballast, config.gravity_m_s2);
        }
        body
    })
}

/// Returns the added masses at the trailing edge; none in the dry.
pub fn trailing_edge(config: &Config) -> Edge {
    let shape = &config.shape;
    let z = shape.length_m - shape.body_start(BODIES - 1);
    let density = config.water.map_or(0.0, |water| water.density_kg_m3);
    let span = shape.half_span(shape.length_m);
    Edge {
        vertical: density * PI * span * span,
        lateral: density * PI * shape.edge_vertical_m * shape.edge_vertical_m,
        z,
    }
}

/// Integrates the sections between two distances from the nose.
fn solid(config: &Config, start: f64, end: f64) -> Body {
    let shape = &config.shape;
    let (water_density, stream) = config.water.map_or((0.0, 0.0), |water| {
        (water.density_kg_m3, water.density_kg_m3)
    });
    let mut inertia = Inertia::default();
    let (mut mass, mut moment, mut displaced, mut displaced_moment) = (0.0, 0.0, 0.0, 0.0);
    for (s, h) in slices(shape, start, end) {
        let ((a, b), z) = (shape.half_axes(s), s - start);
        let area_h = PI * a * b * h;
        let slice = config.density_kg_m3 * area_h;
        mass += slice;
        moment += slice * z;
        displaced += water_density * area_h;
        displaced_moment += water_density * area_h * z;
        inertia.add_point(
            Vec3::new(-config.centre_of_mass_drop_m, 0.0, z),
            Mat3::diagonal(slice, slice, slice),
        );
        // Second moments of the ellipse: ¼ of the mass times the squared half axis.
        let (about_x, about_y) = (0.25 * slice * a * a, 0.25 * slice * b * b);
        inertia.angular += Mat3::diagonal(about_x, about_y, about_x + about_y);
        let (water, span) = (stream * PI * h, shape.half_span(s));
        inertia.add_point(
            Vec3::new(0.0, 0.0, z),
            Mat3::diagonal(water * span * span, water * b * b, 0.0),
        );
        let flat = a * a - b * b;
        inertia.angular += Mat3::diagonal(0.0, 0.0, water * flat * flat / 8.0);
    }
    let g = config.gravity_m_s2;
    Body {
        length_m: end - start,
        mass_kg: mass,
        centre_of_mass: Vec3::new(-config.centre_of_mass_drop_m, 0.0, moment / mass),
        inertia,
        lift_n: (displaced - mass) * g,
        righting: Vec3::new(
            mass * config.centre_of_mass_drop_m,
            0.0,
            displaced_moment - moment,
        ) * g,
        strips: Vec::new(),
    }
}

/// Fixes a ballast to a body.
fn load(body: &mut Body, ballast: &Ballast, gravity: f64) {
    let (m, at) = (ballast.mass_kg, Vec3(ballast.position_m));
    body.inertia.add_point(at, Mat3::diagonal(m, m, m));
    let total = body.mass_kg + m;
    body.centre_of_mass = (body.centre_of_mass * body.mass_kg + at * m) * (1.0 / total);
    body.mass_kg = total;
    body.lift_n -= m * gravity;
    body.righting -= at * (m * gravity);
}

/// Returns Gauss–Legendre points (distance from the nose, weight): three on each piece of the
/// outline, which integrates all sections of this shape exactly.
fn slices(shape: &Shape, start: f64, end: f64) -> Vec<(f64, f64)> {
    let (tail, fins) = (
        shape.length_m - shape.tail_m,
        shape.length_m - shape.fin_length_m,
    );
    let cuts = [start, shape.nose_m, tail, fins.max(tail), end];
    let mut points = Vec::new();
    for pair in cuts.windows(2) {
        let (low, high) = (pair[0].clamp(start, end), pair[1].clamp(start, end));
        let half = 0.5 * (high - low);
        if half <= 0.0 {
            continue;
        }
        let reach = libm::sqrt(0.6);
        for (offset, weight) in [(-reach, 5.0 / 9.0), (0.0, 8.0 / 9.0), (reach, 5.0 / 9.0)] {
            points.push((low + half * (1.0 + offset), half * weight));
        }
    }
    points
}

/// Cuts a body into strips of equal length.
fn strips(shape: &Shape, water: &Water, start: f64, end: f64, count: usize) -> Vec<Strip> {
    let h = (end - start) / count as f64;
    let half_density = 0.5 * water.density_kg_m3;
    let strip = |index: usize| {
        let z = (index as f64 + 0.5) * h;
        let (a, b) = shape.half_axes(start + z);
        let cross = half_density * water.cross_drag * h;
        Strip {
            z,
            vertical: cross * 2.0 * shape.half_span(start + z),
            lateral: cross * 2.0 * b,
            skin: half_density * water.skin_friction * perimeter(a, b) * h,
            roll: half_density * 0.5 * (b * b - a * a).abs() * b * b * h,
        }
    };
    (0..count).map(strip).collect()
}

/// Returns the perimeter of an ellipse by Ramanujan's second formula, right to 1e-4 here.
pub fn perimeter(a: f64, b: f64) -> f64 {
    let sum = a + b;
    if sum <= 0.0 {
        return 0.0;
    }
    let h = (a - b) * (a - b) / (sum * sum);
    PI * sum * (1.0 + 3.0 * h / (10.0 + libm::sqrt(4.0 - 3.0 * h)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_eel_weighs_what_its_water_weighs() {
        let bodies = cut(&Config::bare());
        let mass: f64 = bodies.iter().map(|body| body.mass_kg).sum();
        assert!((mass - 15.107).abs() < 0.001, "{mass} kg");
        for body in &bodies {
            assert_eq!(body.lift_n, 0.0);
            assert_eq!(body.righting, Vec3::ZERO);
        }
    }

    #[test]
    fn added_mass_of_the_trunk_is_that_of_an_elliptic_cylinder() {
        let body = &cut(&Config::default())[4];
        let added = body.inertia.linear.0[1][1] - body.mass_kg;
        let expected = 1000.0 * PI * 0.075 * 0.075 * 0.1;
        assert!((added - expected).abs() < 1e-12, "{added} kg");
        assert!((body.inertia.linear.0[2][2] - body.mass_kg).abs() < 1e-12);
    }

    #[test]
    fn a_cylinder_has_the_inertia_of_the_textbook() {
        let config = Config {
            water: None,
            ..Config::default()
        };
        let body = &cut(&config)[3];
        let about_end = body.mass_kg * (0.05 * 0.05 / 4.0 + 0.1 * 0.1 / 3.0);
        assert!((body.inertia.angular.0[0][0] - about_end).abs() < 1e-15);
    }

    #[test]
    fn the_perimeter_of_a_circle_is_exact() {
        assert!((perimeter(0.05, 0.05) - PI * 0.1).abs() < 1e-16);
    }
}
