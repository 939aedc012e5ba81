//! A small writer of SVG: shapes with classes, text, one style sheet, a white ground.
//!
//! Coordinates are in px with one decimal. The ground is white and every colour is given, so that a
//! drawing looks the same on a dark page.

use std::fmt::Write as _;

/// A point of the drawing in px, y downwards.
pub type Point = [f64; 2];

/// A drawing in the making.
pub struct Svg {
    text: String,
}

/// Where a text hangs on its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

impl Svg {
    /// Begins a drawing of a size in px, with its name, what it shows, and its style sheet.
    pub fn new([width, height]: Point, name: &str, description: &str, style: &str) -> Self {
        let (w, h) = (number(width), number(height));
        let (name, description) = (escaped(name), escaped(description));
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" \
             height=\"{h}\" role=\"img\">\n<title>{name}</title>\n<desc>{description}</desc>\n\
             <style>\n{style}</style>\n<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n"
        );
        Self { text }
    }

    /// Adds what other elements refer to, such as patterns.
    pub fn definitions(&mut self, text: &str) {
        let _ = writeln!(self.text, "<defs>{text}</defs>");
    }

    /// Adds a rectangle by its corner and size.
    pub fn rectangle(&mut self, [x, y]: Point, [width, height]: Point, class: &str, fill: &str) {
        let [x, y, w, h] = [x, y, width, height].map(number);
        let fill = attribute("fill", fill);
        let class = attribute("class", class);
        let _ = writeln!(
            self.text,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"{class}{fill}/>"
        );
    }

    /// Adds a straight line.
    pub fn line(&mut self, from: Point, to: Point, class: &str) {
        self.path(&[(vec![from, to], false)], class, "");
    }

    /// Adds a straight line of a width in px.
    pub fn wide_line(&mut self, from: Point, to: Point, class: &str, width: f64) {
        let (class, width) = (attribute("class", class), number(width));
        let data = path_data(&[(vec![from, to], false)]);
        let _ = writeln!(
            self.text,
            "<path{class} stroke-width=\"{width}\" d=\"{data}\"/>"
        );
    }

    /// Begins a group that is seen through a clip path only.
    pub fn clipped(&mut self, id: &str) {
        let _ = writeln!(self.text, "<g clip-path=\"url(#{})\">", escaped(id));
    }

    /// Ends the group that was begun last.
    pub fn end(&mut self) {
        self.text.push_str("</g>\n");
    }

    /// Adds a path of lines, each open or closed; nothing where there is none.
    pub fn path(&mut self, lines: &[(Vec<Point>, bool)], class: &str, fill: &str) {
        let text = path_data(lines);
        if text.is_empty() {
            return;
        }
        let (class, fill) = (attribute("class", class), attribute("fill", fill));
        let _ = writeln!(self.text, "<path{class}{fill} d=\"{text}\"/>");
    }

    /// Adds a circle.
    pub fn circle(&mut self, [x, y]: Point, radius: f64, class: &str) {
        let [x, y, r] = [x, y, radius].map(number);
        let class = attribute("class", class);
        let _ = writeln!(
            self.text,
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"{class}/>"
        );
    }

    /// Adds a text by the left end, middle or right end of its base line.
    pub fn text(&mut self, at: Point, anchor: Anchor, class: &str, text: &str) {
        self.turned_text(at, 0.0, anchor, class, text);
    }

    /// Adds a text turned clockwise by so many degrees.
    pub fn turned_text(
        &mut self,
        [x, y]: Point,
        degrees: f64,
        anchor: Anchor,
        class: &str,
        text: &str,
    ) {
        let [x, y, turn] = [x, y, degrees].map(number);
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let turn = match turn.as_str() {
            "0" => String::new(),
            turn => format!(" transform=\"rotate({turn} {x} {y})\""),
        };
        let (class, text) = (attribute("class", class), escaped(text));
        let _ = writeln!(
            self.text,
            "<text x=\"{x}\" y=\"{y}\"{anchor}{class}{turn}>{text}</text>"
        );
    }

    /// Ends the drawing and returns its text.
    pub fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

/// Writes lines as the data of a path.
pub fn path_data(lines: &[(Vec<Point>, bool)]) -> String {
    let mut text = String::new();
    for (points, is_closed) in lines {
        let mut rest = points.iter();
        let Some(first) = rest.next() else {
            continue;
        };
        let _ = write!(text, "M{}", pair(*first));
        for point in rest {
            let _ = write!(text, "L{}", pair(*point));
        }
        text.push_str(if *is_closed { "Z" } else { "" });
    }
    text
}

/// Writes a number with at most one decimal, without a negative zero.
fn number(value: f64) -> String {
    let tenths = (value * 10.0).round() / 10.0;
    // Adding zero takes the sign from a negative zero.
    format!("{}", tenths + 0.0)
}

/// Writes a point as a path does.
fn pair([x, y]: Point) -> String {
    format!("{} {}", number(x), number(y))
}

/// Writes an attribute, nothing for an empty one.
fn attribute(name: &str, value: &str) -> String {
    if value.is_empty() {
        String::new()
    } else {
        format!(" {name}=\"{}\"", escaped(value))
    }
}

/// Returns text that XML takes between tags and in quotes.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_have_no_negative_zero() {
        let texts = [12.0, 0.04, -0.04, -3.26, 1e3].map(number);
        assert_eq!(texts, ["12", "0", "0", "-3.3", "1000"]);
    }

    #[test]
    fn text_is_escaped_wherever_it_stands() {
        let mut svg = Svg::new([10.0, 5.0], "a < b", "c & d", "");
        svg.text([1.0, 2.0], Anchor::Middle, "x\"y", "‖l‖ > 1");
        let text = svg.finish();
        assert!(text.contains("<title>a &lt; b</title>\n<desc>c &amp; d</desc>"));
        assert!(text.contains(
            "<text x=\"1\" y=\"2\" text-anchor=\"middle\" class=\"x&quot;y\">‖l‖ &gt; 1</text>"
        ));
    }

    #[test]
    fn paths_are_closed_where_they_should_be_and_absent_where_empty() {
        let mut svg = Svg::new([1.0, 1.0], "", "", "");
        svg.path(&[(Vec::new(), true)], "none", "");
        let line = vec![[0.0, 0.0], [1.0, 0.5]];
        svg.path(&[(line.clone(), true), (line, false)], "", "#fff");
        let text = svg.finish();
        assert!(!text.contains("none"));
        assert!(text.contains("<path fill=\"#fff\" d=\"M0 0L1 0.5ZM0 0L1 0.5\"/>"));
    }
}
