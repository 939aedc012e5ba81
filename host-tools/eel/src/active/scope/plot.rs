//! A capture on a terminal: a panel of braille dots for each signal, and one axis of time.

use super::capture::{Capture, Signal};

/// Lines of a panel.
const ROWS: usize = 6;
/// Dots of a character from left to right, and from top to bottom.
const DOTS: [usize; 2] = [2, 4];
/// The bits of a braille character, by column and row of its dots.
const BITS: [[u8; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];
/// The braille character without a dot.
const BLANK: u32 = 0x2800;

/// Dots in characters.
struct Canvas {
    columns: usize,
    rows: usize,
    cells: Vec<u8>,
}

/// Draws a capture, so many characters wide beside its labels.
pub fn text(capture: &Capture, columns: usize) -> String {
    let labels = capture.signals.iter().flat_map(|signal| {
        let (low, high) = signal.extent();
        [signal.number(low).len(), signal.number(high).len()]
    });
    let margin = labels.max().unwrap_or_default();
    let mut text = capture.title();
    text.push('\n');
    let fault = capture.fault.map(usize::from);
    let last = capture.length().saturating_sub(1);
    for signal in &capture.signals {
        panel(&mut text, signal, fault, margin, columns);
    }
    let mut axis: Vec<_> = "─".repeat(columns).chars().collect();
    let mark = fault.map(|sample| place(sample, last, DOTS[0] * columns - 1) / DOTS[0]);
    if let Some(slot) = mark.and_then(|mark| axis.get_mut(mark)) {
        *slot = '┴';
    }
    let axis: String = axis.into_iter().collect();
    text.push_str(&format!("{:margin$} └{axis}\n", ""));
    let first = format!("{:.3} s", capture.time_s(0));
    let end = format!("{:.3} s", capture.time_s(last));
    let between = columns.saturating_sub(first.len() + end.len());
    let mut middle = " ".repeat(between);
    // Where the fault is named only if there is room.
    let name = "fault";
    let start = mark.map(|mark| mark.saturating_sub(first.len() + name.len() / 2));
    if let Some(start) = start.filter(|start| *start > 0 && start + name.len() < between) {
        middle.replace_range(start..start + name.len(), name);
    }
    text.push_str(&format!("{:margin$}  {first}{middle}{end}\n", ""));
    text
}

/// Returns where a number from 0 to `last` lies on a scale from 0 to `end`.
fn place(number: usize, last: usize, end: usize) -> usize {
    (2 * number * end + last) / (2 * last.max(1))
}

/// Draws one signal.
fn panel(text: &mut String, signal: &Signal, fault: Option<usize>, margin: usize, columns: usize) {
    let (low, high) = signal.extent();
    let (least, most) = (signal.number(low), signal.number(high));
    let unit = match signal.unit() {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    // What never changes needs one line.
    let is_flat = low >= high;
    let range = if is_flat {
        format!("always {least}")
    } else {
        format!("{least} to {most}")
    };
    text.push_str(&format!("\n{}: {range}{unit}\n", signal.name()));
    let mut canvas = Canvas::new(columns, if is_flat { 1 } else { ROWS });
    let [wide, tall] = canvas.dots();
    let last = signal.values.len().saturating_sub(1);
    let height = |value: f64| match is_flat {
        true => tall / 2,
        false => ((high - value) / (high - low) * (tall - 1) as f64).round() as usize,
    };
    let points = signal.values.iter().enumerate();
    let points: Vec<_> = points
        .map(|(sample, value)| [place(sample, last, wide - 1), height(*value)])
        .collect();
    if let [only] = points[..] {
        canvas.line(only, only);
    }
    for pair in points.windows(2) {
        if let [from, to] = *pair {
            canvas.line(from, to);
        }
    }
    if let Some(fault) = fault {
        let x = place(fault, last, wide - 1);
        (0..tall).step_by(2).for_each(|y| canvas.set([x, y]));
    }
    for (row, line) in canvas.lines().enumerate() {
        let label = match row {
            0 => &most,
            _ if row + 1 == canvas.rows => &least,
            _ => "",
        };
        let edge = if label.is_empty() { '│' } else { '┤' };
        text.push_str(format!("{label:>margin$} {edge}{line}").trim_end());
        text.push('\n');
    }
}

impl Canvas {
    fn new(columns: usize, rows: usize) -> Self {
        Self {
            columns,
            rows,
            cells: vec![0; columns * rows],
        }
    }

    fn dots(&self) -> [usize; 2] {
        [DOTS[0] * self.columns, DOTS[1] * self.rows]
    }

    fn set(&mut self, [x, y]: [usize; 2]) {
        let cell = y / DOTS[1] * self.columns + x / DOTS[0];
        if let Some(cell) = self.cells.get_mut(cell) {
            *cell |= BITS[x % DOTS[0]][y % DOTS[1]];
        }
    }

    fn line(&mut self, from: [usize; 2], to: [usize; 2]) {
        let steps = from[0].abs_diff(to[0]).max(from[1].abs_diff(to[1]));
        let on_way = |a: usize, b: usize, step: usize| match a <= b {
            true => a + place(step, steps, b - a),
            false => a - place(step, steps, a - b),
        };
        for step in 0..=steps {
            let [x, y] = [0, 1].map(|axis| on_way(from[axis], to[axis], step));
            self.set([x, y]);
        }
    }

    fn lines(&self) -> impl Iterator<Item = String> {
        self.cells.chunks(self.columns).map(|row| {
            let characters = row.iter().map(|bits| match bits {
                0 => ' ',
                bits => char::from_u32(BLANK + u32::from(*bits)).unwrap_or(' '),
            });
            characters.collect()
        })
    }
}
