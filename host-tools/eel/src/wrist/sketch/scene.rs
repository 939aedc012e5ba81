//! The parts of the mechanism in a pose, as shapes in space.

use eel_kinematics::design::{Geometry, Leg, Matrix3, Vector3};

use super::super::svg::Point;
use super::view::View;

/// The base plate: height, half lengths along x and y.
const PLATE: [f64; 3] = [-1.72, 1.2, 0.78];
/// A motor's radius and length, and how far its near end is from the crank.
const MOTOR: [f64; 3] = [0.15, 0.32, 0.14];
/// The same where a crank's axis passes through O, for legs 1 and 2: clear of cranks and rods.
const FAR: [f64; 2] = [0.62, 0.22];
/// Height of the lower and upper end of motor 3: below where C1 can be.
const THIRD: [f64; 2] = [-1.55, -1.2];
/// Corners of a circle.
const CORNERS: u32 = 40;

/// A shape and how it is drawn.
pub struct Shape {
    pub outline: Outline,
    /// The class of its strokes and fills.
    pub class: String,
}

/// Where a shape is.
pub enum Outline {
    /// A straight bar.
    Bar([Vector3<f64>; 2]),
    /// A thin line such as an axis; it hides nothing.
    Thread([Vector3<f64>; 2]),
    /// A plane polygon.
    Face(Vec<Vector3<f64>>),
    /// A cylinder between the middles of its ends.
    Cylinder([Vector3<f64>; 2], f64),
    /// A joint.
    Ball(Vector3<f64>),
}

/// A point with a name.
pub struct Named {
    pub at: Vector3<f64>,
    pub name: &'static str,
    pub class: &'static str,
    /// Whether it names a body rather than a point.
    pub is_body: bool,
}

/// All shapes and names of one pose, lengths in arms.
pub struct Scene {
    pub shapes: Vec<Shape>,
    pub names: Vec<Named>,
}

/// The points of the mechanism that have names.
pub struct Points {
    pub a: [Vector3<f64>; 2],
    pub b: [Vector3<f64>; 2],
    pub c: [Vector3<f64>; 2],
}

impl Points {
    /// Returns them in the unit of the geometry.
    pub fn of(geometry: &Geometry, rotation: &Matrix3<f64>, theta: &[f64; 3]) -> Self {
        Self {
            a: [0, 1].map(|leg| geometry.legs[leg].center),
            b: [0, 1].map(|leg| geometry.legs[leg].end(theta[leg])),
            c: [0, 1].map(|leg| geometry.point(rotation, leg)),
        }
    }
}

impl Scene {
    /// Builds the mechanism in a configuration; its arm must be 1.
    pub fn new(geometry: &Geometry, rotation: &Matrix3<f64>, theta: &[f64; 3]) -> Self {
        let mut scene = Self {
            shapes: Vec::new(),
            names: Vec::new(),
        };
        let points = Points::of(geometry, rotation, theta);
        scene.base();
        scene.serial_leg(rotation, theta[2]);
        scene.platform(&points);
        // With orthogonal axes both cranks turn about O.
        let is_apart = points.a.iter().any(|a| a.norm() > 1e-6);
        let name = if is_apart { "O" } else { "O = A₁ = A₂" };
        scene.name(Vector3::zeros(), name, "name");
        for (k, leg) in geometry.legs.iter().enumerate() {
            scene.leg(k, leg, &points);
        }
        scene
    }

    fn add(&mut self, class: impl Into<String>, outline: Outline) {
        self.shapes.push(Shape {
            outline,
            class: class.into(),
        });
    }

    fn name(&mut self, at: Vector3<f64>, name: &'static str, class: &'static str) {
        self.names.push(Named {
            at,
            name,
            class,
            is_body: name.starts_with("motor"),
        });
    }

    /// The plate that carries the motors.
    fn base(&mut self) {
        let [height, x, y] = PLATE;
        let corners = turn().map(|(s, c)| Vector3::new(x * c, y * s, height));
        self.add("plate", Outline::Face(corners.collect()));
    }

    /// Motor 3 on its column, and the axes z, y', x''.
    fn serial_leg(&mut self, rotation: &Matrix3<f64>, theta3: f64) {
        let at = |z: f64| Vector3::new(0.0, 0.0, z);
        let [low, high] = THIRD;
        self.add("post", Outline::Bar([at(PLATE[0]), at(low)]));
        self.add("leg3", Outline::Cylinder([at(low), at(high)], MOTOR[0]));
        self.add("shaft3", Outline::Bar([at(high), at(0.0)]));
        let x = rotation.column(0).into_owned();
        let y = Vector3::new(-theta3.sin(), theta3.cos(), 0.0);
        let axes = [
            (Vector3::z(), -0.3, 0.62, "z"),
            (y, -0.55, 0.55, "y′"),
            (x, -0.4, 1.32, "x″"),
        ];
        for (axis, from, to, name) in axes {
            self.add("axis", Outline::Thread([axis * from, axis * to]));
            self.name(axis * to, name, "name3");
        }
        self.add("joint", Outline::Ball(Vector3::zeros()));
        self.name(at((low + high) / 2.0), "motor 3", "name3");
    }

    /// O, C1, C2 and what joins them.
    fn platform(&mut self, points: &Points) {
        let [first, second] = points.c;
        let corners = vec![Vector3::zeros(), first, second];
        self.add("platform", Outline::Face(corners));
        self.add("arm", Outline::Bar([Vector3::zeros(), first]));
        self.add("arm", Outline::Bar([Vector3::zeros(), second]));
        self.add("rim", Outline::Bar([first, second]));
    }

    /// Motor, crank and rod of leg 1 or 2.
    fn leg(&mut self, k: usize, leg: &Leg, points: &Points) {
        let (a, b, c) = (points.a[k], points.b[k], points.c[k]);
        // To the left, so that no crank is behind its motor; where both axes pass through O, away from
        // the platform.
        let is_apart = a.norm() > 1e-6;
        let (side, gap) = if is_apart {
            (-leg.axis[0].signum(), MOTOR[2])
        } else {
            (-leg.axis[1].signum(), FAR[k])
        };
        let out = leg.axis * side;
        let ends = [a + out * gap, a + out * (gap + MOTOR[1])];
        let middle = (ends[0] + ends[1]) / 2.0;
        let foot = Vector3::new(middle[0], middle[1], PLATE[0]);
        let number = k + 1;
        self.add("post", Outline::Bar([foot, middle]));
        self.add(format!("shaft{number}"), Outline::Bar([a, ends[0]]));
        self.add(format!("leg{number}"), Outline::Cylinder(ends, MOTOR[0]));
        self.add(format!("crank{number}"), Outline::Bar([a, b]));
        self.add(format!("rod{number}"), Outline::Bar([b, c]));
        let [names, class] = match k {
            0 => [["A₁", "B₁", "C₁", "motor 1"], ["name1"; 4]],
            _ => [["A₂", "B₂", "C₂", "motor 2"], ["name2"; 4]],
        };
        // With orthogonal axes both A are O.
        for (at, name) in [(a, names[0]), (b, names[1]), (c, names[2])] {
            if is_apart || name != names[0] {
                self.add("joint", Outline::Ball(at));
                self.name(at, name, class[0]);
            }
        }
        self.name(middle, names[3], class[0]);
    }
}

/// Returns sines and cosines around a circle.
fn turn() -> impl Iterator<Item = (f64, f64)> {
    (0..CORNERS).map(|k| (f64::from(k) / f64::from(CORNERS) * std::f64::consts::TAU).sin_cos())
}

/// A shape on the drawing, with its distance from the eye.
pub enum Flat {
    /// From one end to the other.
    Line([Point; 2], [f64; 2]),
    /// A convex polygon whose distance is a plane's: at the first point, and its slopes in x and y.
    Area(Vec<Point>, f64, [f64; 2]),
}

impl Outline {
    /// Returns the shape as it is seen.
    pub fn flat(&self, view: &View) -> Flat {
        match self {
            Self::Bar(ends) | Self::Thread(ends) => Flat::Line(
                [view.place(&ends[0]), view.place(&ends[1])],
                [view.depth(&ends[0]), view.depth(&ends[1])],
            ),
            Self::Face(corners) => {
                let points: Vec<Point> = corners.iter().map(|at| view.place(at)).collect();
                let depths: Vec<f64> = corners.iter().map(|at| view.depth(at)).collect();
                let slope = slope(&points, &depths);
                let first = depths.first().copied().unwrap_or(0.0);
                Flat::Area(points, first, slope)
            }
            Self::Cylinder(ends, radius) => {
                let [near, far] = ends.map(|end| circle(&end, &(ends[1] - ends[0]), *radius));
                let all = near.iter().chain(&far).map(|at| view.place(at));
                let depth = view.depth(&((ends[0] + ends[1]) / 2.0));
                Flat::Area(hull(all.collect()), depth, [0.0; 2])
            }
            Self::Ball(at) => {
                let [x, y] = view.place(at);
                let radius = view.radius();
                let corners = turn().map(|(s, c)| [x + radius * c, y + radius * s]);
                // In front of a bar whose middle line it is on.
                Flat::Area(corners.collect(), view.depth(at) - 0.02, [0.0; 2])
            }
        }
    }

    /// Returns the end of a cylinder that the eye sees; nothing for other shapes.
    pub fn cap(&self, view: &View) -> Option<Vec<Point>> {
        let Self::Cylinder([from, to], radius) = self else {
            return None;
        };
        let along = to - from;
        let end = if view.is_facing(&along) { to } else { from };
        let points = circle(end, &along, *radius);
        Some(points.iter().map(|at| view.place(at)).collect())
    }
}

/// Returns a circle about a point, square to an axis.
fn circle(center: &Vector3<f64>, axis: &Vector3<f64>, radius: f64) -> Vec<Vector3<f64>> {
    let axis = axis.normalize();
    let other = if axis[2].abs() < 0.9 {
        Vector3::z()
    } else {
        Vector3::x()
    };
    let u = axis.cross(&other).normalize();
    let v = axis.cross(&u);
    turn()
        .map(|(s, c)| center + (u * c + v * s) * radius)
        .collect()
}

/// Returns how the distance changes along x and y of a plane polygon; flat where it is seen edge on.
fn slope(points: &[Point], depths: &[f64]) -> [f64; 2] {
    let third = points.len() / 3;
    let (Some(o), Some(p), Some(q)) = (points.first(), points.get(third), points.get(2 * third))
    else {
        return [0.0; 2];
    };
    let (a, b) = ([p[0] - o[0], p[1] - o[1]], [q[0] - o[0], q[1] - o[1]]);
    let (da, db) = (depths[third] - depths[0], depths[2 * third] - depths[0]);
    let area = a[0] * b[1] - a[1] * b[0];
    if area.abs() < 1e-6 {
        return [0.0; 2];
    }
    [
        (da * b[1] - db * a[1]) / area,
        (db * a[0] - da * b[0]) / area,
    ]
}

/// Returns the convex hull of points (Andrew's monotone chain).
fn hull(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turn = |a: Point, b: Point, c: Point| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let half = |points: &mut dyn Iterator<Item = Point>| {
        let mut chain: Vec<Point> = Vec::new();
        for point in points {
            while chain.len() >= 2
                && turn(chain[chain.len() - 2], chain[chain.len() - 1], point) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut all = half(&mut points.iter().copied());
    all.extend(half(&mut points.iter().rev().copied()));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_square_with_a_point_inside_is_the_square() {
        let square = vec![[0.0, 0.0], [2.0, 0.0], [1.0, 1.0], [2.0, 2.0], [0.0, 2.0]];
        assert_eq!(
            hull(square),
            [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]
        );
    }

    #[test]
    fn a_face_knows_its_distance_everywhere() {
        let view = View::new(100.0, [0.0, 0.0]);
        let corners = [
            Vector3::new(0.0, 0.0, 0.0),
            Vector3::new(1.0, 0.2, 0.0),
            Vector3::new(0.0, 1.0, 0.7),
        ];
        let Flat::Area(points, depth, slope) = Outline::Face(corners.to_vec()).flat(&view) else {
            panic!("a face is an area");
        };
        for (point, corner) in points.iter().zip(&corners) {
            let [dx, dy] = [point[0] - points[0][0], point[1] - points[0][1]];
            let found = depth + slope[0] * dx + slope[1] * dy;
            assert!((found - view.depth(corner)).abs() < 1e-12);
        }
    }

    #[test]
    fn bars_have_the_mechanism_s_lengths() {
        let geometry = Geometry::PARALLEL_ACTUATORS;
        let rotation = eel_kinematics::design::rotation(0.3, -0.1, 0.05);
        let theta = geometry.inverse(&rotation).unwrap();
        let scene = Scene::new(&geometry, &rotation, &theta);
        let length = |class: &str| {
            let shape = scene.shapes.iter().find(|shape| shape.class == class);
            match &shape.unwrap().outline {
                Outline::Bar([from, to]) => (to - from).norm(),
                _ => f64::NAN,
            }
        };
        for leg in 1..=2 {
            assert!((length(&format!("rod{leg}")) - 1.0).abs() < 1e-12);
            assert!((length(&format!("crank{leg}")) - 0.5f64.sqrt()).abs() < 1e-12);
        }
        assert!((length("arm") - 1.0).abs() < 1e-12);
    }
}
