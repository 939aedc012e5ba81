//! A drawing of one stride, made by the program: the eel from above at several moments, each a row
//! lower, all over the same stretch of water.

use std::fmt::Write as _;

use crate::plant::config::Shape;

/// Pixels a metre.
const SCALE: f64 = 300.0;
/// Space left of the tail for the labels, and right of the nose, px.
const MARGIN: f64 = 110.0;
/// Space above the first row, px.
const HEAD: f64 = 96.0;
/// Space below the last row, px.
const FOOT: f64 = 74.0;
/// Points drawn on each piece of the spine.
const POINTS: usize = 12;

/// The eel at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// Time since the start, s.
    pub time_s: f64,
    /// Nose, joints and trailing edge in the world frame (x up, the eel swims towards −z), m.
    pub spine: Vec<[f64; 3]>,
}

/// What is written into the drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Caption {
    /// First line.
    pub title: String,
    /// Second line.
    pub subtitle: String,
}

/// The drawing's plane: along the path to the right, to the left of the eel upwards.
struct Plane {
    forward: [f64; 3],
    left: [f64; 3],
    /// Water coordinates at the drawing's left edge and path line, m.
    origin: [f64; 3],
}

/// Draws the moments of one stride as an SVG, the first at the top.
///
/// The way between the first and the last moment is dimensioned. Returns an empty drawing for
/// fewer than two moments or spines of fewer than two points.
pub fn stride_svg(snapshots: &[Snapshot], shape: &Shape, caption: &Caption) -> String {
    let drawable = snapshots.len() >= 2 && snapshots.iter().all(|s| s.spine.len() >= 2);
    if !drawable {
        return String::from("<svg xmlns=\"http://www.w3.org/2000/svg\"/>\n");
    }
    let (first, last) = (&snapshots[0], &snapshots[snapshots.len() - 1]);
    let plane = Plane::of(first, last);
    let rows: Vec<Vec<(f64, f64)>> = snapshots
        .iter()
        .map(|snapshot| {
            snapshot
                .spine
                .iter()
                .map(|point| plane.place(*point))
                .collect()
        })
        .collect();
    let (left, right) = extent(&rows, |point| point.0);
    let (low, high) = extent(&rows, |point| point.1);
    let pitch = 0.8 * (high - low + 2.0 * shape.lateral_m) * SCALE + 8.0;
    let size = (
        (right - left) * SCALE + 2.0 * MARGIN,
        HEAD + FOOT + pitch * rows.len() as f64,
    );
    let x_of = |x: f64| MARGIN + (x - left) * SCALE;
    let mut svg = opening(size, caption);
    let bottom = size.1 - FOOT + 6.0;
    let noses = (rows[0][0].0, rows[rows.len() - 1][0].0);
    grid(&mut svg, left, right, &x_of, bottom);
    for (index, (row, snapshot)) in rows.iter().zip(snapshots).enumerate() {
        let middle = HEAD + pitch * (index as f64 + 0.5) + 0.5 * (high + low) * SCALE;
        let place = |point: (f64, f64)| (x_of(point.0), middle - point.1 * SCALE);
        let time = snapshot.time_s - first.time_s;
        let _ = writeln!(
            svg,
            "<text x=\"14\" y=\"{:.1}\" class=\"time\">{time:.3} s</text>",
            middle + 5.0
        );
        eel(&mut svg, row, shape, &place);
    }
    dimension(
        &mut svg,
        x_of(noses.0),
        x_of(noses.1),
        HEAD - 14.0,
        bottom,
        &way(noses, shape),
    );
    foot(&mut svg, x_of(right), bottom);
    svg.push_str("</svg>\n");
    svg
}

impl Plane {
    /// Lays the plane along the way of the eel's middle; along −z when it stays.
    fn of(first: &Snapshot, last: &Snapshot) -> Self {
        let (start, end) = (middle(&first.spine), middle(&last.spine));
        let way = [0.0, end[1] - start[1], end[2] - start[2]];
        let length = libm::sqrt(dot(way, way));
        let forward = if length > 1e-3 {
            way.map(|part| part / length)
        } else {
            [0.0, 0.0, -1.0]
        };
        Self {
            forward,
            // Up × forward, with up along x.
            left: [0.0, -forward[2], forward[1]],
            origin: start,
        }
    }

    /// Returns a point's place along the path and to its left, m.
    fn place(&self, point: [f64; 3]) -> (f64, f64) {
        let from: [f64; 3] = std::array::from_fn(|i| point[i] - self.origin[i]);
        (dot(from, self.forward), dot(from, self.left))
    }
}

/// Writes the drawing's opening: size, styles and the two lines of text.
fn opening(size: (f64, f64), caption: &Caption) -> String {
    let (width, height) = size;
    let (title, subtitle) = (escaped(&caption.title), escaped(&caption.subtitle));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" \
         width=\"{width:.0}\" height=\"{height:.0}\" role=\"img\">\n\
         <title>{title}</title>\n<style>\n\
         text {{ font-family: 'DejaVu Sans', Verdana, sans-serif; fill: #24313d; font-size: 13px; }}\n\
         .title {{ font-size: 17px; font-weight: bold; }}\n\
         .time {{ font-size: 14px; }}\n\
         .body {{ fill: #7fb2c9; stroke: #2b5d78; stroke-width: 1.2; stroke-linejoin: round; }}\n\
         .spine {{ fill: none; stroke: #173a4d; stroke-width: 1.2; }}\n\
         .joint {{ fill: #ffffff; stroke: #173a4d; stroke-width: 1.2; }}\n\
         .grid {{ stroke: #dde5ea; stroke-width: 1; }}\n\
         .mark {{ stroke: #b4552d; stroke-width: 1.2; stroke-dasharray: 5 4; }}\n\
         .measure {{ stroke: #b4552d; stroke-width: 1.4; fill: none; }}\n\
         .ink {{ stroke: #24313d; stroke-width: 1.6; fill: none; }}\n\
         </style>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
         <text x=\"14\" y=\"26\" class=\"title\">{title}</text>\n\
         <text x=\"14\" y=\"47\">{subtitle}</text>\n"
    )
}

/// Draws a line every half metre of water.
fn grid(svg: &mut String, left: f64, right: f64, x_of: &impl Fn(f64) -> f64, bottom: f64) {
    let start = libm::ceil(left * 2.0) as i32;
    let end = libm::floor(right * 2.0) as i32;
    for half in start..=end {
        let x = x_of(f64::from(half) * 0.5);
        let _ = writeln!(
            svg,
            "<line x1=\"{x:.1}\" y1=\"{HEAD:.1}\" x2=\"{x:.1}\" y2=\"{bottom:.1}\" class=\"grid\"/>"
        );
    }
}

/// Draws the eel at one moment: outline, spine, joints.
fn eel(
    svg: &mut String,
    spine: &[(f64, f64)],
    shape: &Shape,
    place: &impl Fn((f64, f64)) -> (f64, f64),
) {
    let outline: Vec<String> = outline(spine, shape)
        .into_iter()
        .map(|p| pair(place(p)))
        .collect();
    let line: Vec<String> = spine.iter().map(|point| pair(place(*point))).collect();
    let _ = writeln!(
        svg,
        "<polygon points=\"{}\" class=\"body\"/>",
        outline.join(" ")
    );
    let _ = writeln!(
        svg,
        "<polyline points=\"{}\" class=\"spine\"/>",
        line.join(" ")
    );
    for point in &spine[1..spine.len() - 1] {
        let (x, y) = place(*point);
        let _ = writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.6\" class=\"joint\"/>"
        );
    }
}

/// Returns the outline of the body around a spine, m: one side to the tail, the other back.
fn outline(spine: &[(f64, f64)], shape: &Shape) -> Vec<(f64, f64)> {
    let (mut port, mut starboard) = (Vec::new(), Vec::new());
    let mut s = 0.0;
    for (index, pair) in spine.windows(2).enumerate() {
        let (from, to) = (pair[0], pair[1]);
        let length = distance(from, to);
        let here = normal(from, to);
        let before = index
            .checked_sub(1)
            .map_or(here, |i| normal(spine[i], spine[i + 1]));
        let after = spine.get(index + 2).map_or(here, |next| normal(to, *next));
        for step in 0..=POINTS {
            let even = step as f64 / POINTS as f64;
            // The nose is round: closer points where it begins.
            let share = if index == 0 { even * even } else { even };
            // Towards the joints the skin turns into the neighbour's direction.
            let (other, weight) = if share < 0.5 {
                (before, 0.5 - share)
            } else {
                (after, share - 0.5)
            };
            let half = shape.half_span(s + length * share);
            let nx = here.0 + (other.0 - here.0) * weight;
            let ny = here.1 + (other.1 - here.1) * weight;
            let x = from.0 + (to.0 - from.0) * share;
            let y = from.1 + (to.1 - from.1) * share;
            port.push((x + nx * half, y + ny * half));
            starboard.push((x - nx * half, y - ny * half));
        }
        s += length;
    }
    starboard.reverse();
    port.extend(starboard);
    port
}

/// Draws the way of the nose between the first and the last moment.
fn dimension(svg: &mut String, from: f64, to: f64, y: f64, bottom: f64, label: &str) {
    let top = y - 8.0;
    for x in [from, to] {
        let _ = writeln!(
            svg,
            "<line x1=\"{x:.1}\" y1=\"{top:.1}\" x2=\"{x:.1}\" y2=\"{bottom:.1}\" class=\"mark\"/>"
        );
    }
    let (a, b) = (from + 8.0, to - 8.0);
    let _ = writeln!(
        svg,
        "<path d=\"M{from:.1} {y:.1} H{to:.1} M{a:.1} {:.1} L{from:.1} {y:.1} L{a:.1} {:.1} \
         M{b:.1} {:.1} L{to:.1} {y:.1} L{b:.1} {:.1}\" class=\"measure\"/>\n\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
        y - 4.0,
        y + 4.0,
        y - 4.0,
        y + 4.0,
        0.5 * (from + to),
        y - 8.0
    );
}

/// Draws the scale bar and the direction of swimming below the rows.
fn foot(svg: &mut String, right: f64, bottom: f64) {
    let (y, end) = (bottom + 28.0, MARGIN + 0.5 * SCALE);
    let (tip, back) = (right, right - 60.0);
    let _ = writeln!(
        svg,
        "<path d=\"M{MARGIN:.1} {:.1} V{:.1} M{MARGIN:.1} {y:.1} H{end:.1} M{end:.1} {:.1} V{:.1}\" \
         class=\"ink\"/>\n\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">0.5 m</text>\n\
         <path d=\"M{back:.1} {y:.1} H{tip:.1} M{:.1} {:.1} L{tip:.1} {y:.1} L{:.1} {:.1}\" \
         class=\"ink\"/>\n\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">swims to the right; seen from above</text>",
        y - 5.0,
        y + 5.0,
        y - 5.0,
        y + 5.0,
        0.5 * (MARGIN + end),
        y + 20.0,
        tip - 8.0,
        y - 5.0,
        tip - 8.0,
        y + 5.0,
        tip,
        y + 20.0
    );
}

/// Returns the label of the way that the nose made.
fn way(noses: (f64, f64), shape: &Shape) -> String {
    let metres = noses.1 - noses.0;
    format!(
        "{metres:.2} m = {:.2} body lengths",
        metres / shape.length_m
    )
}

/// Returns the least and the greatest of a coordinate.
fn extent(rows: &[Vec<(f64, f64)>], of: impl Fn(&(f64, f64)) -> f64) -> (f64, f64) {
    let values = rows.iter().flatten().map(of);
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    })
}

/// Returns the mean of the points.
fn middle(points: &[[f64; 3]]) -> [f64; 3] {
    let count = points.len() as f64;
    std::array::from_fn(|i| points.iter().map(|point| point[i]).sum::<f64>() / count)
}

/// Returns the scalar product.
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the distance of two points.
fn distance(a: (f64, f64), b: (f64, f64)) -> f64 {
    libm::sqrt((b.0 - a.0) * (b.0 - a.0) + (b.1 - a.1) * (b.1 - a.1))
}

/// Returns the unit normal of a line, to its right when it runs to the tail.
fn normal(from: (f64, f64), to: (f64, f64)) -> (f64, f64) {
    let length = distance(from, to).max(1e-12);
    ((from.1 - to.1) / length, (to.0 - from.0) / length)
}

/// Writes a point as SVG does.
fn pair(point: (f64, f64)) -> String {
    format!("{:.1},{:.1}", point.0, point.1)
}

/// Returns text that XML takes.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight eel that swims 0.3 m to the world's −z in one second.
    fn stride() -> [Snapshot; 2] {
        let at = |time_s: f64| Snapshot {
            time_s,
            spine: (0..12)
                .map(|i| [0.0, 0.0, f64::from(i) * 1.5 / 11.0 - 0.3 * time_s])
                .collect(),
        };
        [at(0.0), at(1.0)]
    }

    /// Draws a stride with a caption that needs escaping.
    fn draw(snapshots: &[Snapshot]) -> String {
        let caption = Caption {
            title: String::from("One stride & more"),
            subtitle: String::from("f < 2 Hz"),
        };
        stride_svg(snapshots, &Shape::default(), &caption)
    }

    #[test]
    fn says_how_far_the_eel_came() {
        let svg = draw(&stride());
        assert!(svg.contains("0.30 m = 0.20 body lengths"), "{svg}");
        assert!(svg.contains("1.000 s") && svg.contains("0.5 m"));
        assert!(svg.contains("One stride &amp; more") && svg.contains("f &lt; 2 Hz"));
    }

    #[test]
    fn draws_every_moment_with_its_ten_joints() {
        let svg = draw(&stride());
        assert_eq!(svg.matches("class=\"body\"").count(), 2);
        assert_eq!(svg.matches("class=\"joint\"").count(), 20);
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn what_lies_to_the_eels_left_is_drawn_above() {
        let mut stride = stride();
        for snapshot in &mut stride {
            snapshot.spine[11][1] = 0.1;
        }
        let plane = Plane::of(&stride[0], &stride[1]);
        let (along, left) = plane.place(stride[0].spine[11]);
        assert!(along < 0.0 && left > 0.05, "{along} {left}");
    }

    #[test]
    fn nothing_to_draw_gives_an_empty_drawing() {
        assert!(draw(&stride()[..1]).contains("<svg"));
    }
}
