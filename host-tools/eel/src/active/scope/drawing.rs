//! A capture as an SVG: a panel for each signal, one below the other, over the same time.

use super::capture::{Capture, Signal};
use crate::wrist::svg::{Anchor, Point, Svg};

/// Size of a panel in px.
const PANEL: Point = [640.0, 150.0];
/// Space left of the panels, for the numbers, and right of them.
const LEFT: f64 = 92.0;
const RIGHT: f64 = 28.0;
/// Space above the first panel, from one panel to the next, and below the last.
const HEAD: f64 = 100.0;
const GAP: f64 = 30.0;
const FOOT: f64 = 52.0;
/// Space from one line of the legend to the next.
const LEGEND: f64 = 18.0;
/// Letters of a name that find room four times in a line.
const SHORT: usize = 18;
/// Ticks of an axis, about.
const TICKS: [f64; 2] = [8.0, 5.0];

const STYLE: &str = "\
text { font-family: 'DejaVu Sans', Verdana, sans-serif; font-size: 13px; fill: #24313d; }
.title { font-size: 17px; font-weight: bold; }
.number { font-size: 12px; }
.frame { fill: none; stroke: #24313d; stroke-width: 1.2; }
.grid { fill: none; stroke: #dfe3e6; stroke-width: 1; }
.fault { fill: none; stroke: #c0341d; stroke-width: 1.6; stroke-dasharray: 7 4; }
.trace1, .trace2, .trace3, .trace4 { fill: none; stroke-width: 1.8; stroke-linejoin: round; }
.trace1 { stroke: #0072b2; }
.trace2 { stroke: #d55e00; }
.trace3 { stroke: #009e73; }
.trace4 { stroke: #8a4f7d; }
";

/// An axis: from the least to the greatest number, over so many px.
struct Axis {
    low: f64,
    high: f64,
    length: f64,
}

/// Draws a capture.
pub fn svg(capture: &Capture) -> String {
    let count = capture.signals.len() as f64;
    let width = LEFT + PANEL[0] + RIGHT;
    let names: Vec<_> = capture.signals.iter().map(Signal::name).collect();
    let is_short = names.iter().all(|name| name.len() <= SHORT);
    let in_line = if is_short { 4 } else { 2 };
    let lines = names.len().div_ceil(in_line);
    let head = HEAD + LEGEND * lines.saturating_sub(1) as f64;
    let height = head + count * PANEL[1] + (count - 1.0) * GAP + FOOT;
    let mut svg = Svg::new([width, height], &names.join(", "), &capture.title(), STYLE);
    let title = format!("Scope of {}", capture.node);
    svg.text([16.0, 28.0], Anchor::Start, "title", &title);
    svg.text([16.0, 50.0], Anchor::Start, "", &capture.title());
    legend(&mut svg, &names, in_line);
    let last = capture.length().saturating_sub(1);
    let time = Axis::new(capture.time_s(0), capture.time_s(last), PANEL[0]);
    for (index, signal) in capture.signals.iter().enumerate() {
        let top = head + index as f64 * (PANEL[1] + GAP);
        panel(&mut svg, capture, signal, index, &time, top);
    }
    let bottom = height - FOOT;
    for (value, text) in time.ticks(TICKS[0]) {
        let x = LEFT + time.place(value);
        svg.text([x, bottom + 18.0], Anchor::Middle, "number", &text);
    }
    let name = match capture.fault {
        Some(_) => "time since the fault, s",
        None => "time, s",
    };
    let middle = LEFT + PANEL[0] / 2.0;
    svg.text([middle, bottom + 40.0], Anchor::Middle, "", name);
    svg.finish()
}

/// Draws which line is which signal.
fn legend(svg: &mut Svg, names: &[&str], in_line: usize) {
    let each = (PANEL[0] + RIGHT) / in_line as f64;
    for (index, name) in names.iter().enumerate() {
        let x = LEFT + each * (index % in_line) as f64;
        let y = 74.0 + LEGEND * (index / in_line) as f64;
        let class = format!("trace{}", index + 1);
        svg.line([x, y - 4.0], [x + 20.0, y - 4.0], &class);
        svg.text([x + 26.0, y], Anchor::Start, "number", name);
    }
}

/// Draws one signal.
fn panel(svg: &mut Svg, capture: &Capture, signal: &Signal, index: usize, time: &Axis, top: f64) {
    let (low, high) = signal.extent();
    // A little room above and below; what never changes lies in the middle.
    let room = if high > low {
        0.06 * (high - low)
    } else {
        low.abs().max(1.0) * 0.1
    };
    let axis = Axis::new(low - room, high + room, PANEL[1]);
    let bottom = top + PANEL[1];
    for (value, text) in axis.ticks(TICKS[1]) {
        let y = bottom - axis.place(value);
        svg.line([LEFT, y], [LEFT + PANEL[0], y], "grid");
        svg.text([LEFT - 8.0, y + 4.0], Anchor::End, "number", &text);
    }
    for (value, _) in time.ticks(TICKS[0]) {
        let x = LEFT + time.place(value);
        svg.line([x, top], [x, bottom], "grid");
    }
    let points = signal.values.iter().enumerate().map(|(sample, value)| {
        let x = LEFT + time.place(capture.time_s(sample));
        [x, bottom - axis.place(*value)]
    });
    let class = format!("trace{}", index + 1);
    svg.path(&[(points.collect(), false)], &class, "");
    if capture.fault.is_some() {
        let x = LEFT + time.place(0.0);
        svg.line([x, top], [x, bottom], "fault");
        if index == 0 {
            svg.text([x, top - 4.0], Anchor::Middle, "number", "fault");
        }
    }
    svg.rectangle([LEFT, top], PANEL, "frame", "");
    // A long name stands in the legend only.
    let name = signal.name();
    let label = match signal.unit() {
        unit if name.len() > SHORT => unit.to_owned(),
        "" => name.to_owned(),
        unit => format!("{name}, {unit}"),
    };
    let at = [20.0, top + PANEL[1] / 2.0];
    svg.turned_text(at, -90.0, Anchor::Middle, "number", &label);
}

impl Axis {
    fn new(low: f64, high: f64, length: f64) -> Self {
        // One sample has no duration.
        let high = if high > low { high } else { low + 1.0 };
        Self { low, high, length }
    }

    /// Returns how far from its begin a number lies, px.
    fn place(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low) * self.length
    }

    /// Returns round numbers on the axis, about `count`, and how they are written.
    fn ticks(&self, count: f64) -> Vec<(f64, String)> {
        let rough = (self.high - self.low) / count;
        let decade = 10_f64.powf(rough.log10().floor());
        let factors = [1.0, 2.0, 5.0];
        let step = factors.map(|factor| factor * decade);
        let step = step.into_iter().find(|step| *step >= rough);
        let step = step.unwrap_or(10.0 * decade);
        let digits = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
        let (first, last) = ((self.low / step).ceil(), (self.high / step).floor());
        // At most as many as were asked for, and their neighbours.
        let steps = (last - first).clamp(0.0, 2.0 * count) as u32;
        (0..=steps)
            .map(|tick| {
                // Adding zero takes the sign from a negative zero.
                let value = (first + f64::from(tick)) * step + 0.0;
                (value, format!("{value:.digits$}"))
            })
            .collect()
    }
}
