//! The map as a drawing: panels with axes, bands of colour, contours, the paper's box, a legend.

use eel_kinematics::design::{Range, Travel};

use super::super::args::Measure;
use super::super::number::signed;
use super::super::svg::{Anchor, Point, Svg, path_data};
use super::colour::viridis;
use super::contour::{Line, simplified};
use super::field::Map;
use super::scale::{Scale, ticks};

/// The largest plot, px.
const MOST: Point = [560.0, 380.0];
/// Space left, above, right and below of a plot, px.
const LEFT: f64 = 66.0;
const ABOVE: f64 = 38.0;
const RIGHT: f64 = 96.0;
const BELOW: f64 = 54.0;
/// Space for the title above the first panel and for the keys below the last, px.
const HEAD: f64 = 62.0;
const FOOT: f64 = 58.0;
/// How far a drawn line may be from the computed one, px.
const TOLERANCE: f64 = 0.12;
/// The least length of a contour that gets a label, and what a label needs around it, px.
const LABELLED: f64 = 70.0;
const ROOM: f64 = 30.0;

const STYLE: &str = "\
text { font-family: 'DejaVu Sans', Verdana, sans-serif; font-size: 13px; fill: #24313d; }
.title { font-size: 17px; font-weight: bold; }
.panel { font-size: 14px; font-weight: bold; }
.label { font-size: 11.5px; paint-order: stroke; stroke: #ffffff; stroke-width: 3.2px; stroke-linejoin: round; }
.band { stroke: none; fill-rule: evenodd; }
.beyond { fill: #dfe3e6; stroke: none; fill-rule: evenodd; }
.dark { fill: none; stroke: #101820; stroke-opacity: 0.75; stroke-width: 1; }
.light { fill: none; stroke: #ffffff; stroke-opacity: 0.85; stroke-width: 1; }
.edge { fill: none; stroke: #101820; stroke-width: 1.6; stroke-linejoin: round; }
.paper { fill: none; stroke: #ffffff; stroke-width: 4; stroke-opacity: 0.9; }
.box { fill: none; stroke: #c0341d; stroke-width: 2; stroke-dasharray: 7 4; }
.frame { fill: none; stroke: #24313d; stroke-width: 1.2; }
.key { stroke: #24313d; stroke-width: 1.2; }
.least { fill: #ffffff; stroke: #c0341d; stroke-width: 2; }
";

/// What is written over a map.
pub struct Heading {
    /// The first line.
    pub title: String,
    /// The second line.
    pub subtitle: String,
    /// Yaw and pitch in rad where the margin in the box is least.
    pub least: [f64; 2],
}

/// From rad to px in one panel.
struct Plot {
    corner: Point,
    size: Point,
    yaw: Range,
    pitch: Range,
}

/// Draws a map, one panel below the other.
pub fn draw(map: &Map, heading: &Heading) -> String {
    let ends = |axis: &[f64]| Range {
        low: axis.first().copied().unwrap_or(0.0),
        high: axis.last().copied().unwrap_or(0.0),
    };
    let (yaw, pitch) = (ends(&map.yaw), ends(&map.pitch));
    let (wide, high) = (yaw.high - yaw.low, pitch.high - pitch.low);
    // The same scale both ways, unless the ranges are too unlike.
    let scale = (MOST[0] / wide).min(MOST[1] / high);
    let size = [(wide * scale).max(180.0), (high * scale).max(140.0)];
    let width = (LEFT + size[0] + RIGHT).max(690.0);
    let each = ABOVE + size[1] + BELOW;
    let height = HEAD + each * map.values.len() as f64 + FOOT;
    let mut svg = Svg::new([width, height], &heading.title, &heading.subtitle, STYLE);
    svg.definitions(
        "<pattern id=\"hatch\" width=\"7\" height=\"7\" patternUnits=\"userSpaceOnUse\" \
         patternTransform=\"rotate(45)\"><rect width=\"7\" height=\"7\" fill=\"#f4f6f7\"/>\
         <rect width=\"1.4\" height=\"7\" fill=\"#aab4bc\"/></pattern>",
    );
    svg.text([LEFT - 46.0, 28.0], Anchor::Start, "title", &heading.title);
    svg.text([LEFT - 46.0, 50.0], Anchor::Start, "", &heading.subtitle);
    for (index, (measure, _)) in map.values.iter().enumerate() {
        let plot = Plot {
            corner: [LEFT, HEAD + ABOVE + each * index as f64],
            size,
            yaw,
            pitch,
        };
        panel(&mut svg, map, index, *measure, &plot, heading);
    }
    keys(&mut svg, height - FOOT + 22.0);
    svg.finish()
}

/// Draws one measure.
fn panel(svg: &mut Svg, map: &Map, index: usize, measure: Measure, plot: &Plot, heading: &Heading) {
    let Some((_, field)) = map.values.get(index) else {
        return;
    };
    let [x, y] = plot.corner;
    svg.text([x, y - 12.0], Anchor::Start, "panel", measure.title());
    svg.rectangle(plot.corner, plot.size, "", "url(#hatch)");
    svg.path(&plot.lines(&map.reach.region(0.0)), "beyond", "");
    let clear = plot.lines(&map.clear.region(0.0));
    let id = format!("clear{index}");
    svg.definitions(&format!(
        "<clipPath id=\"{id}\"><path clip-rule=\"evenodd\" d=\"{}\"/></clipPath>",
        path_data(&clear)
    ));
    let scale = Scale::of(measure, field, &map.clear);
    svg.clipped(&id);
    for (level, share) in scale.bands() {
        svg.path(&plot.lines(&field.region(level)), "band", &viridis(share));
    }
    let mut labels = Labels::new(plot);
    for (level, name) in scale.contours() {
        let lines = plot.lines(&field.contour(level));
        let class = if scale.share(level) < 0.5 {
            "light"
        } else {
            "dark"
        };
        svg.path(&lines, class, "");
        // The letters need clear ground on both sides of the line.
        let is_clear = |at: Point| {
            let around = [[12.0, 0.0], [-12.0, 0.0], [0.0, 12.0], [0.0, -12.0]];
            let mut all = around.iter().map(|by| [at[0] + by[0], at[1] + by[1]]);
            all.all(|at| map.is_clear(plot.unplaced(at)))
        };
        for (line, _) in &lines {
            labels.place(line, &name, &is_clear);
        }
    }
    svg.end();
    svg.path(&plot.lines(&map.clear.contour(0.0)), "edge", "");
    svg.path(&plot.lines(&map.reach.contour(0.0)), "edge", "");
    let corners = plot.paper();
    if !corners.is_empty() {
        for class in ["paper", "box"] {
            svg.path(&[(corners.clone(), true)], class, "");
        }
    }
    if plot.shows(heading.least) {
        svg.circle(plot.place(heading.least), 4.5, "least");
    }
    labels.write(svg);
    axes(svg, plot);
    legend(svg, plot, &scale, measure);
}

impl Map {
    /// Returns whether a pose in rad has margin, by the nearest point of the grid.
    fn is_clear(&self, [yaw, pitch]: Point) -> bool {
        let nearest = |axis: &[f64], angle: f64| {
            let off = |k: &usize| (axis[*k] - angle).abs();
            (0..axis.len())
                .min_by(|a, b| off(a).total_cmp(&off(b)))
                .unwrap_or(0)
        };
        self.clear.values[nearest(&self.pitch, pitch)][nearest(&self.yaw, yaw)] > 0.0
    }
}

impl Plot {
    /// Returns where a pair of yaw and pitch in rad is drawn.
    fn place(&self, [yaw, pitch]: Point) -> Point {
        let share = |angle: f64, range: &Range| (angle - range.low) / (range.high - range.low);
        [
            self.corner[0] + self.size[0] * share(yaw, &self.yaw),
            self.corner[1] + self.size[1] * (1.0 - share(pitch, &self.pitch)),
        ]
    }

    /// Returns the yaw and pitch in rad that are drawn at a point.
    fn unplaced(&self, [x, y]: Point) -> Point {
        [
            self.yaw.at((x - self.corner[0]) / self.size[0]),
            self.pitch.at(1.0 - (y - self.corner[1]) / self.size[1]),
        ]
    }

    /// Returns lines in px, without points that are not seen.
    fn lines(&self, lines: &[Line]) -> Vec<Line> {
        let simple = lines.iter().map(|(points, is_closed)| {
            let placed: Vec<Point> = points.iter().map(|point| self.place(*point)).collect();
            (simplified(&placed, TOLERANCE), *is_closed)
        });
        simple.filter(|(points, _)| points.len() > 1).collect()
    }

    /// Returns whether a pair of yaw and pitch in rad is on the map.
    fn shows(&self, [yaw, pitch]: Point) -> bool {
        self.yaw.contains(yaw) && self.pitch.contains(pitch)
    }

    /// Returns the corners of the paper's box, as far as it is on the map; none where it is beside it.
    fn paper(&self) -> Vec<Point> {
        let [yaw, pitch, _] = Travel::PAPER;
        let is_beside = |one: &Range, other: &Range| one.low >= other.high || one.high <= other.low;
        if is_beside(&yaw, &self.yaw) || is_beside(&pitch, &self.pitch) {
            return Vec::new();
        }
        let corners = [
            [yaw.low, pitch.low],
            [yaw.high, pitch.low],
            [yaw.high, pitch.high],
            [yaw.low, pitch.high],
        ];
        let inside = |[yaw, pitch]: Point| {
            [
                yaw.clamp(self.yaw.low, self.yaw.high),
                pitch.clamp(self.pitch.low, self.pitch.high),
            ]
        };
        corners.map(|corner| self.place(inside(corner))).to_vec()
    }
}

/// Labels of contours: one a line, where there is most room.
struct Labels<'a> {
    plot: &'a Plot,
    placed: Vec<(Point, f64, String)>,
}

impl<'a> Labels<'a> {
    fn new(plot: &'a Plot) -> Self {
        Self {
            plot,
            placed: Vec::new(),
        }
    }

    /// Finds the place on a line that is farthest from other labels, the frame and the box.
    fn place(&mut self, line: &[Point], name: &str, is_clear: &dyn Fn(Point) -> bool) {
        let length: f64 = line.windows(2).map(|ends| distance(ends[0], ends[1])).sum();
        if length < LABELLED {
            return;
        }
        let mut best: Option<(f64, Point, f64)> = None;
        for ends in line.windows(2) {
            let [from, to] = [ends[0], ends[1]];
            let steps = (distance(from, to) / 4.0).ceil().max(1.0) as u32;
            for step in 0..steps {
                let share = (f64::from(step) + 0.5) / f64::from(steps);
                let at = [0, 1].map(|k| from[k] + (to[k] - from[k]) * share);
                let room = self.room(at).min(60.0);
                if is_clear(at) && best.is_none_or(|(most, ..)| room > most) {
                    let turn = (to[1] - from[1]).atan2(to[0] - from[0]).to_degrees();
                    best = Some((room, at, upright(turn)));
                }
            }
        }
        if let Some((room, at, turn)) = best
            && room >= ROOM
        {
            self.placed.push((at, turn, name.to_owned()));
        }
    }

    /// Returns how far a point is from what a label must not touch.
    fn room(&self, at: Point) -> f64 {
        let [x, y] = at;
        let ([left, top], [wide, high]) = (self.plot.corner, self.plot.size);
        let frame = [x - left, left + wide - x, y - top, top + high - y];
        let mut room = frame.into_iter().fold(f64::INFINITY, f64::min) + ROOM - 18.0;
        for (other, ..) in &self.placed {
            room = room.min(distance(at, *other));
        }
        let corners = self.plot.paper();
        for k in 0..corners.len() {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            let inside = [0, 1].map(|k| at[k].clamp(a[k].min(b[k]), a[k].max(b[k])));
            room = room.min(distance(at, inside) + ROOM - 18.0);
        }
        room
    }

    fn write(&self, svg: &mut Svg) {
        for (at, turn, name) in &self.placed {
            // The base line a little below the middle of the letters, across the line.
            let (s, c) = turn.to_radians().sin_cos();
            let base = [at[0] - 4.0 * s, at[1] + 4.0 * c];
            svg.turned_text(base, *turn, Anchor::Middle, "label", name);
        }
    }
}

/// Returns a direction in degrees turned so that text along it is not upside down.
fn upright(degrees: f64) -> f64 {
    // A little beyond upright still reads upwards, so that no 6 stands on its head.
    if degrees > 70.0 {
        degrees - 180.0
    } else if degrees < -110.0 {
        degrees + 180.0
    } else {
        degrees
    }
}

fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Draws the frame with its ticks in degrees.
fn axes(svg: &mut Svg, plot: &Plot) {
    let ([x, y], [wide, high]) = (plot.corner, plot.size);
    svg.rectangle(plot.corner, plot.size, "frame", "");
    for angle in ticks(&plot.yaw, wide / 55.0) {
        let [at, _] = plot.place([angle.to_radians(), 0.0]);
        svg.line([at, y + high], [at, y + high + 5.0], "frame");
        let name = format!("{}°", signed(angle, 0));
        svg.text([at, y + high + 20.0], Anchor::Middle, "", &name);
    }
    for angle in ticks(&plot.pitch, high / 36.0) {
        let [_, at] = plot.place([0.0, angle.to_radians()]);
        svg.line([x - 5.0, at], [x, at], "frame");
        let name = format!("{}°", signed(angle, 0));
        svg.text([x - 9.0, at + 4.5], Anchor::End, "", &name);
    }
    let middle = [x + wide / 2.0, y + high / 2.0];
    svg.text([middle[0], y + high + 39.0], Anchor::Middle, "", "yaw");
    svg.turned_text([x - 50.0, middle[1]], -90.0, Anchor::Middle, "", "pitch");
}

/// Draws the bar that says which colour is which number.
fn legend(svg: &mut Svg, plot: &Plot, scale: &Scale, measure: Measure) {
    let ([x, y], [wide, high]) = (plot.corner, plot.size);
    let left = x + wide + 18.0;
    let at = |share: f64| y + high * (1.0 - share);
    let bands = scale.bands();
    let step = high / bands.len() as f64;
    for (index, (_, share)) in bands.iter().enumerate() {
        let top = y + high - step * (index as f64 + 1.0);
        // A little higher than it is, so that no seam shows.
        svg.rectangle([left, top], [16.0, step + 0.4], "", &viridis(*share));
    }
    svg.rectangle([left, y], [16.0, high], "frame", "");
    for (share, name) in scale.marks() {
        svg.line([left + 16.0, at(share)], [left + 21.0, at(share)], "frame");
        svg.text([left + 25.0, at(share) + 4.5], Anchor::Start, "", &name);
    }
    svg.text([left, y - 12.0], Anchor::Start, "", measure.sign());
}

/// Draws what the other signs mean.
fn keys(svg: &mut Svg, y: f64) {
    let mut key = |x: f64, fill: &str, text: &str| {
        svg.rectangle([x, y - 11.0], [22.0, 13.0], "key", fill);
        svg.text([x + 30.0, y], Anchor::Start, "", text);
    };
    key(LEFT, "url(#hatch)", "out of reach");
    key(LEFT + 160.0, "#dfe3e6", "beyond a parallel singularity");
    let left = LEFT + 408.0;
    svg.line([left, y - 5.0], [left + 24.0, y - 5.0], "edge");
    svg.text([left + 32.0, y], Anchor::Start, "", "singularity");
    let y = y + 22.0;
    svg.line([LEFT, y - 5.0], [LEFT + 22.0, y - 5.0], "box");
    let text = "the paper's box, yaw ±30°, pitch ±15°";
    svg.text([LEFT + 30.0, y], Anchor::Start, "", text);
    svg.circle([left + 12.0, y - 5.0], 4.5, "least");
    svg.text([left + 32.0, y], Anchor::Start, "", "least margin in it");
}
