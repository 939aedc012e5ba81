//! One or more poses as a drawing: panels side by side, each with its caption.

use eel_kinematics::design::Vector3;

use super::super::svg::{Anchor, Point, Svg};
use super::labels::{self, Rectangle, Wanted};
use super::order;
use super::scene::{Flat, Named, Outline, Scene, Shape};
use super::view::View;

/// px of an arm where there is one panel, and where there are more.
const LARGE: f64 = 165.0;
const SMALL: f64 = 108.0;
/// Space around the mechanism for names, px.
const EDGE: f64 = 40.0;
/// The base frame in the corner: px of an axis, and where its origin is.
const TRIAD: f64 = 34.0;
const CORNER: Point = [34.0, -22.0];
/// px of the head and of a caption's line.
const HEAD: f64 = 58.0;
const LINE: f64 = 19.0;
/// px between points of what is drawn that names avoid.
const STEP: f64 = 5.0;

const STYLE: &str = "\
text { font-family: 'DejaVu Sans', Verdana, sans-serif; font-size: 13px; fill: #24313d; }
.title { font-size: 17px; font-weight: bold; }
.mode { font-size: 14px; font-weight: bold; }
.name, .name1, .name2, .name3 { font-size: 14px; paint-order: stroke; stroke: #ffffff; stroke-width: 3px; stroke-linejoin: round; }
.name { font-weight: bold; }
.name1 { fill: #00598c; }
.name2 { fill: #a84300; }
.name3 { fill: #00694d; }
.small { font-size: 12px; fill: #5b6873; }
.halo { stroke: #ffffff; fill: none; }
.crank1, .crank2, .rod1, .rod2, .arm, .rim, .post, .shaft1, .shaft2, .shaft3 { fill: none; }
.crank1, .rod1, .shaft1 { stroke: #0072b2; }
.crank2, .rod2, .shaft2 { stroke: #d55e00; }
.shaft3 { stroke: #009e73; }
.crank1, .crank2 { stroke-width: 8; stroke-linecap: round; }
.rod1, .rod2 { stroke-width: 4; stroke-linecap: round; }
.shaft1, .shaft2, .shaft3 { stroke-width: 4; }
.arm { stroke: #3d4b57; stroke-width: 5; stroke-linecap: round; }
.rim { stroke: #3d4b57; stroke-width: 1.5; }
.post { stroke: #b4bec6; stroke-width: 6; }
.plate { fill: #eef1f3; stroke: #b4bec6; stroke-width: 1.2; }
.platform { fill: #aebfcd; fill-opacity: 0.55; stroke: none; }
.axis { fill: none; stroke: #00694d; stroke-width: 1.1; stroke-dasharray: 9 3 2 3; }
.joint { fill: #ffffff; stroke: #24313d; stroke-width: 1.6; }
.leg1 { fill: #8cc0e0; stroke: #00598c; stroke-width: 1.2; stroke-linejoin: round; }
.leg2 { fill: #f3bb8f; stroke: #a84300; stroke-width: 1.2; stroke-linejoin: round; }
.leg3 { fill: #90d3bd; stroke: #00694d; stroke-width: 1.2; stroke-linejoin: round; }
.frame { fill: none; stroke: #5b6873; stroke-width: 1.3; }
.leader { fill: none; stroke: #8a96a0; stroke-width: 0.8; }
";

/// A mechanism and what is written under it.
pub struct Panel {
    pub scene: Scene,
    /// The first line of the caption.
    pub mode: String,
    /// The lines below.
    pub lines: Vec<String>,
}

/// Draws panels in rows of at most two.
pub fn draw(title: &str, subtitle: &str, panels: &[Panel]) -> String {
    let scale = if panels.len() == 1 { LARGE } else { SMALL };
    let extent = extent(panels, scale);
    let size = [
        extent.1[0] - extent.0[0] + 2.0 * EDGE,
        extent.1[1] - extent.0[1] + 2.0 * EDGE,
    ];
    let lines = panels.iter().map(|panel| panel.lines.len()).max();
    let caption = LINE * (lines.unwrap_or(0) as f64 + 1.0) + 14.0;
    let columns = panels.len().min(2);
    let rows = panels.len().div_ceil(2);
    let width = (size[0] * columns as f64).max(620.0);
    let height = HEAD + (size[1] + caption) * rows as f64;
    let mut svg = Svg::new([width, height], title, subtitle, STYLE);
    svg.text([20.0, 28.0], Anchor::Start, "title", title);
    svg.text([20.0, 50.0], Anchor::Start, "", subtitle);
    let left = (width - size[0] * columns as f64) / 2.0;
    for (index, panel) in panels.iter().enumerate() {
        let corner = [
            left + size[0] * (index % 2) as f64,
            HEAD + (size[1] + caption) * (index / 2) as f64,
        ];
        let origin = [
            corner[0] + EDGE - extent.0[0],
            corner[1] + EDGE - extent.0[1],
        ];
        let frame = Rectangle(corner, [corner[0] + size[0], corner[1] + size[1]]);
        mechanism(&mut svg, &panel.scene, &View::new(scale, origin), frame);
        let middle = corner[0] + size[0] / 2.0;
        let mut base = corner[1] + size[1] + 8.0;
        svg.text([middle, base], Anchor::Middle, "mode", &panel.mode);
        for line in &panel.lines {
            base += LINE;
            svg.text([middle, base], Anchor::Middle, "", line);
        }
    }
    svg.finish()
}

/// Returns how far all panels reach from O, px.
fn extent(panels: &[Panel], scale: f64) -> Rectangle {
    let view = View::new(scale, [0.0; 2]);
    let mut extent = Rectangle([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let shapes = panels.iter().flat_map(|panel| &panel.scene.shapes);
    for flat in shapes.map(|shape| shape.outline.flat(&view)) {
        let points = match &flat {
            Flat::Line(ends, _) => &ends[..],
            Flat::Area(corners, ..) => corners,
        };
        for point in points {
            let [x, y] = *point;
            extent.0 = [extent.0[0].min(x), extent.0[1].min(y)];
            extent.1 = [extent.1[0].max(x), extent.1[1].max(y)];
        }
    }
    extent
}

/// Draws one mechanism, far parts first, and its names.
fn mechanism(svg: &mut Svg, scene: &Scene, view: &View, frame: Rectangle) {
    let flats: Vec<Flat> = scene
        .shapes
        .iter()
        .map(|shape| shape.outline.flat(view))
        .collect();
    for index in order::painted(&flats) {
        shape(svg, &scene.shapes[index], &flats[index], view);
    }
    let mut drawn: Vec<Point> = flats
        .iter()
        .zip(&scene.shapes)
        .filter(|(_, shape)| !["plate", "platform"].contains(&shape.class.as_str()))
        .flat_map(|(flat, shape)| match shape.outline {
            // Nor what is inside a motor.
            Outline::Cylinder(..) => filled(flat),
            _ => points(flat),
        })
        .collect();
    drawn.extend(triad(svg, view, frame));
    // The widest first, while there is room.
    let (bodies, points): (Vec<&Named>, Vec<&Named>) =
        scene.names.iter().partition(|named| named.is_body);
    let names = [bodies, points].concat();
    let wanted: Vec<Wanted> = names
        .iter()
        .map(|named| Wanted {
            at: view.place(&named.at),
            name: named.name,
        })
        .collect();
    let places = labels::placed(&wanted, &drawn, frame);
    for ((named, one), at) in names.iter().zip(&wanted).zip(places) {
        let rectangle = Rectangle::of(one.name, at);
        let near = [0, 1].map(|k| one.at[k].clamp(rectangle.0[k], rectangle.1[k]));
        let far = (near[0] - one.at[0]).hypot(near[1] - one.at[1]);
        if far > 24.0 && !named.is_body {
            svg.line(one.at, near, "leader");
        }
        let base = [at[0], at[1] + 5.0];
        svg.text(base, Anchor::Middle, named.class, named.name);
    }
}

/// Draws one shape with white around its bars, so that crossings read.
fn shape(svg: &mut Svg, shape: &Shape, flat: &Flat, view: &View) {
    match flat {
        Flat::Line([from, to], _) => {
            if matches!(shape.outline, Outline::Bar(_)) {
                let halo = match shape.class.as_str() {
                    "crank1" | "crank2" => 13.0,
                    "rim" => 5.0,
                    _ => 9.0,
                };
                let length = (to[0] - from[0]).hypot(to[1] - from[1]);
                // Not over what the ends are joined to.
                let short = (10.0 / length.max(1.0)).min(0.5);
                let inner = |a: &Point, b: &Point| [0, 1].map(|k| a[k] + (b[k] - a[k]) * short);
                svg.wide_line(inner(from, to), inner(to, from), "halo", halo);
            }
            svg.line(*from, *to, &shape.class);
        }
        Flat::Area(corners, ..) => {
            if let Outline::Ball(at) = &shape.outline {
                svg.circle(view.place(at), view.radius(), &shape.class);
                return;
            }
            svg.path(&[(corners.clone(), true)], &shape.class, "");
            if let Some(cap) = shape.outline.cap(view) {
                svg.path(&[(cap, true)], &shape.class, "");
            }
        }
    }
}

/// Returns points along a shape that names must not cover.
fn points(flat: &Flat) -> Vec<Point> {
    let along = |from: Point, to: Point| {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let steps = (length / STEP).ceil().max(1.0) as u32;
        (0..=steps).map(move |k| {
            let share = f64::from(k) / f64::from(steps);
            [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * share)
        })
    };
    match flat {
        Flat::Line([from, to], _) => along(*from, *to).collect(),
        Flat::Area(corners, ..) => {
            let pairs = (0..corners.len()).map(|k| (corners[k], corners[(k + 1) % corners.len()]));
            pairs.flat_map(|(from, to)| along(from, to)).collect()
        }
    }
}

/// Returns points all over an area.
fn filled(flat: &Flat) -> Vec<Point> {
    let border = points(flat);
    let count = border.len().max(1) as f64;
    let middle = [0, 1].map(|k| border.iter().map(|at| at[k]).sum::<f64>() / count);
    let shares = [0.25, 0.5, 0.75, 1.0];
    let inward = border
        .iter()
        .flat_map(|at| shares.map(|share| [0, 1].map(|k| middle[k] + (at[k] - middle[k]) * share)));
    inward.collect()
}

/// Draws the base frame in the lower left corner; returns points that names must not cover.
fn triad(svg: &mut Svg, view: &View, frame: Rectangle) -> Vec<Point> {
    let origin = [frame.0[0] + CORNER[0], frame.1[1] + CORNER[1]];
    let zero = view.place(&Vector3::zeros());
    let unit = view.length();
    let mut taken = Vec::new();
    for (axis, name) in [
        (Vector3::x(), "x"),
        (Vector3::y(), "y"),
        (Vector3::z(), "z"),
    ] {
        let end = view.place(&axis);
        let way = [0, 1].map(|k| (end[k] - zero[k]) / unit);
        let at = |length: f64| [0, 1].map(|k| origin[k] + way[k] * length);
        let tip = at(TRIAD);
        let size = way[0].hypot(way[1]);
        let along = way.map(|part| part / size);
        let barb = |side: f64| {
            [
                tip[0] - 6.0 * along[0] + side * 3.0 * along[1],
                tip[1] - 6.0 * along[1] - side * 3.0 * along[0],
            ]
        };
        let head = vec![barb(1.0), tip, barb(-1.0)];
        svg.path(&[(vec![origin, tip], false), (head, false)], "frame", "");
        let letter = [0, 1].map(|k| tip[k] + along[k] * 10.0);
        svg.text([letter[0], letter[1] + 4.0], Anchor::Middle, "small", name);
        taken.extend([origin, at(TRIAD / 2.0), tip, letter]);
    }
    taken
}
