//! Where names stand: near their points, on clear ground, apart from each other.

use super::super::svg::Point;

/// px of a letter, and of a line above and below its middle.
const LETTER: f64 = 8.8;
const SMALL: f64 = 6.0;
const HALF: f64 = 9.0;
/// Directions and distances that are tried.
const DIRECTIONS: u32 = 24;
const DISTANCES: [f64; 6] = [13.0, 18.0, 24.0, 32.0, 42.0, 54.0];
/// What a point of the drawing under a name costs, in px of distance.
const COST: f64 = 12.0;

/// A name that looks for its place.
pub struct Wanted<'a> {
    pub at: Point,
    pub name: &'a str,
}

/// A rectangle by its low and its high corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle(pub Point, pub Point);

impl Rectangle {
    /// Returns the rectangle that a name takes around its middle.
    pub fn of(name: &str, [x, y]: Point) -> Self {
        let is_small = |c: char| ('₀'..='₉').contains(&c) || c == '′' || c == '″';
        let width: f64 = name
            .chars()
            .map(|c| if is_small(c) { SMALL } else { LETTER })
            .sum();
        let half = width / 2.0 + 2.5;
        Self([x - half, y - HALF], [x + half, y + HALF])
    }

    fn holds(&self, [x, y]: Point) -> bool {
        x >= self.0[0] && x <= self.1[0] && y >= self.0[1] && y <= self.1[1]
    }

    /// Returns whether two rectangles have a common point.
    pub fn touches(&self, other: &Self) -> bool {
        (0..2).all(|k| self.0[k] <= other.1[k] && other.0[k] <= self.1[k])
    }

    fn is_within(&self, frame: &Self) -> bool {
        (0..2).all(|k| self.0[k] >= frame.0[k] && self.1[k] <= frame.1[k])
    }
}

/// Returns the middle of each name, in a frame, off the points of what is drawn.
///
/// Names are placed one after the other at the cheapest of 24 directions and 6 distances; one that
/// finds no place off the others stands on its point.
pub fn placed(wanted: &[Wanted], drawn: &[Point], frame: Rectangle) -> Vec<Point> {
    let mut taken: Vec<Rectangle> = Vec::new();
    let mut places = Vec::new();
    for one in wanted {
        let mut best: Option<(f64, Point)> = None;
        for distance in DISTANCES {
            for k in 0..DIRECTIONS {
                let angle = f64::from(k) / f64::from(DIRECTIONS) * std::f64::consts::TAU;
                let (s, c) = angle.sin_cos();
                // A wide name goes farther to the sides.
                let width = Rectangle::of(one.name, [0.0; 2]).1[0];
                let at = [
                    one.at[0] + (distance + width - HALF) * c,
                    one.at[1] + distance * s,
                ];
                let rectangle = Rectangle::of(one.name, at);
                if !rectangle.is_within(&frame) || taken.iter().any(|t| t.touches(&rectangle)) {
                    continue;
                }
                let hidden = drawn
                    .iter()
                    .filter(|point| rectangle.holds(**point))
                    .count();
                let cost = distance + COST * hidden as f64;
                if best.is_none_or(|(least, _)| cost < least - 1e-9) {
                    best = Some((cost, at));
                }
            }
        }
        let at = best.map_or(one.at, |(_, at)| at);
        taken.push(Rectangle::of(one.name, at));
        places.push(at);
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_one_point_stand_apart_and_off_what_is_drawn() {
        let wanted: Vec<Wanted> = ["A₁", "motor 1", "B₁", "C₁", "x″"]
            .iter()
            .map(|name| Wanted {
                at: [100.0, 100.0],
                name,
            })
            .collect();
        // A line to the right.
        let drawn: Vec<Point> = (0..100).map(|k| [100.0 + f64::from(k), 100.0]).collect();
        let frame = Rectangle([0.0, 0.0], [200.0, 200.0]);
        let places = placed(&wanted, &drawn, frame);
        let all: Vec<Rectangle> = wanted
            .iter()
            .zip(&places)
            .map(|(one, at)| Rectangle::of(one.name, *at))
            .collect();
        for (k, one) in all.iter().enumerate() {
            assert!(one.is_within(&frame));
            assert!(!drawn.iter().any(|point| one.holds(*point)), "{k}");
            assert!(!all[k + 1..].iter().any(|other| other.touches(one)), "{k}");
        }
    }

    #[test]
    fn a_name_without_any_room_is_still_there() {
        let wanted = [Wanted {
            at: [5.0, 5.0],
            name: "O",
        }];
        let frame = Rectangle([0.0, 0.0], [6.0, 6.0]);
        assert_eq!(placed(&wanted, &[], frame), [[5.0, 5.0]]);
    }
}
