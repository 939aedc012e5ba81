//! Contours of a field on a grid: marching squares, chained into lines.

use std::collections::BTreeMap;

use super::super::svg::Point;

/// A line of a contour, and whether it is closed.
pub type Line = (Vec<Point>, bool);

/// Values on a grid: rows along y, each along x.
#[derive(Clone, Debug)]
pub struct Field {
    /// Coordinates of the columns, never falling.
    pub x: Vec<f64>,
    /// Coordinates of the rows, never falling.
    pub y: Vec<f64>,
    /// `values[row][column]`, finite.
    pub values: Vec<Vec<f64>>,
}

/// Below every level; the ring around a field that closes its regions.
const ABYSS: f64 = -1e9;

impl Field {
    /// Returns the lines on which the field has a level; lines end at the grid's border.
    pub fn contour(&self, level: f64) -> Vec<Line> {
        let mut chains = Chains::default();
        for row in 1..self.y.len() {
            for column in 1..self.x.len() {
                self.cell(row - 1, column - 1, level, &mut chains);
            }
        }
        chains.into_lines(|edge| self.crossing(edge, level))
    }

    /// Returns the border of where the field is at least a level; every line is closed.
    ///
    /// A ring of no width and no depth is put around the grid, so that no contour can leave it.
    pub fn region(&self, level: f64) -> Vec<Line> {
        let ring = |axis: &[f64]| {
            let (first, last) = (axis.first().copied(), axis.last().copied());
            let middle = axis.iter().copied();
            first
                .into_iter()
                .chain(middle)
                .chain(last)
                .collect::<Vec<f64>>()
        };
        let empty = vec![ABYSS; self.x.len() + 2];
        let mut values = vec![empty.clone()];
        for row in &self.values {
            let inner = row.iter().copied();
            values.push([ABYSS].into_iter().chain(inner).chain([ABYSS]).collect());
        }
        values.push(empty);
        let ringed = Self {
            x: ring(&self.x),
            y: ring(&self.y),
            values,
        };
        ringed.contour(level)
    }

    /// Adds the pieces of a contour in one cell.
    fn cell(&self, row: usize, column: usize, level: f64, chains: &mut Chains) {
        let is_above = |r: usize, c: usize| self.values[row + r][column + c] >= level;
        let (a, b, c, d) = (
            is_above(0, 0),
            is_above(0, 1),
            is_above(1, 1),
            is_above(1, 0),
        );
        let width = self.x.len();
        let edge = |r: usize, c: usize, is_upright: bool| {
            2 * ((row + r) * width + column + c) + usize::from(is_upright)
        };
        let (low, right, high, left) = (
            edge(0, 0, false),
            edge(0, 1, true),
            edge(1, 0, false),
            edge(0, 0, true),
        );
        let mut crossed = Vec::new();
        for (is_crossed, edge) in [
            (a != b, low),
            (b != c, right),
            (c != d, high),
            (d != a, left),
        ] {
            if is_crossed {
                crossed.push(edge);
            }
        }
        match *crossed {
            [one, other] => chains.join(one, other),
            [..] if crossed.len() == 4 => {
                // A saddle: the middle says which corners hang together.
                let sum: f64 = [(0, 0), (0, 1), (1, 1), (1, 0)]
                    .iter()
                    .map(|(r, c)| self.values[row + r][column + c])
                    .sum();
                if (sum / 4.0 >= level) == a {
                    chains.join(low, right);
                    chains.join(high, left);
                } else {
                    chains.join(low, left);
                    chains.join(high, right);
                }
            }
            _ => {}
        }
    }

    /// Returns where the field has a level on an edge of the grid.
    fn crossing(&self, edge: usize, level: f64) -> Point {
        let (node, is_upright) = (edge / 2, edge % 2 == 1);
        let (row, column) = (node / self.x.len(), node % self.x.len());
        let (end_row, end_column) = if is_upright {
            (row + 1, column)
        } else {
            (row, column + 1)
        };
        let (from, to) = (self.values[row][column], self.values[end_row][end_column]);
        let share = ((level - from) / (to - from)).clamp(0.0, 1.0);
        let between = |axis: &[f64], a: usize, b: usize| axis[a] + (axis[b] - axis[a]) * share;
        [
            between(&self.x, column, end_column),
            between(&self.y, row, end_row),
        ]
    }
}

/// Which edges follow each other on a contour; at most two neighbours each.
#[derive(Default)]
struct Chains {
    neighbours: BTreeMap<usize, Vec<usize>>,
}

impl Chains {
    fn join(&mut self, one: usize, other: usize) {
        self.neighbours.entry(one).or_default().push(other);
        self.neighbours.entry(other).or_default().push(one);
    }

    /// Follows every chain: first those with ends, then the closed ones.
    fn into_lines(mut self, place: impl Fn(usize) -> Point) -> Vec<Line> {
        let ends: Vec<usize> = self
            .neighbours
            .iter()
            .filter(|(_, next)| next.len() == 1)
            .map(|(edge, _)| *edge)
            .collect();
        let mut lines = Vec::new();
        for edge in ends {
            if self.neighbours.contains_key(&edge) {
                let chain = self.follow(edge);
                lines.push((chain.into_iter().map(&place).collect(), false));
            }
        }
        while let Some((edge, _)) = self.neighbours.first_key_value() {
            let chain = self.follow(*edge);
            lines.push((chain.into_iter().map(&place).collect(), true));
        }
        lines
    }

    /// Takes a chain out, from an edge on.
    fn follow(&mut self, start: usize) -> Vec<usize> {
        let mut chain = Vec::new();
        let mut next = Some(start);
        while let Some(edge) = next {
            chain.push(edge);
            let neighbours = self.neighbours.remove(&edge).unwrap_or_default();
            let is_left = |one: &usize| self.neighbours.contains_key(one);
            next = neighbours.into_iter().find(is_left);
        }
        chain
    }
}

/// Returns the line with fewer points, none farther than a tolerance from where it was
/// (Douglas and Peucker).
pub fn simplified(points: &[Point], tolerance: f64) -> Vec<Point> {
    let mut kept = vec![false; points.len()];
    let mut open = vec![(0, points.len().saturating_sub(1))];
    for end in [0, points.len().saturating_sub(1)] {
        if let Some(flag) = kept.get_mut(end) {
            *flag = true;
        }
    }
    while let Some((from, to)) = open.pop() {
        let far = (from + 1..to)
            .map(|k| (k, distance(points[k], points[from], points[to])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((k, off)) = far
            && off > tolerance
        {
            kept[k] = true;
            open.extend([(from, k), (k, to)]);
        }
    }
    let pairs = points.iter().zip(kept);
    pairs
        .filter(|(_, kept)| *kept)
        .map(|(point, _)| *point)
        .collect()
}

/// Returns how far a point is from the segment between two others.
fn distance(point: Point, from: Point, to: Point) -> f64 {
    let along = [to[0] - from[0], to[1] - from[1]];
    let way = [point[0] - from[0], point[1] - from[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let share = if square > 0.0 {
        ((way[0] * along[0] + way[1] * along[1]) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (way[0] - share * along[0]).hypot(way[1] - share * along[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hill of height 1 whose contours are circles about the origin.
    fn hill() -> Field {
        let axis: Vec<f64> = (-20..=20).map(|k| f64::from(k) / 10.0).collect();
        let values = axis
            .iter()
            .map(|y| axis.iter().map(|x| 1.0 - x.hypot(*y)).collect())
            .collect();
        Field {
            x: axis.clone(),
            y: axis,
            values,
        }
    }

    #[test]
    fn the_contours_of_a_cone_are_circles() {
        let lines = hill().contour(0.25);
        let [(points, true)] = &lines[..] else {
            panic!("{} lines", lines.len());
        };
        for point in points {
            assert!((point[0].hypot(point[1]) - 0.75).abs() < 0.01, "{point:?}");
        }
        // Its length by Crofton or by hand: 2π·0.75.
        let length: f64 = (0..points.len())
            .map(|k| {
                let (a, b) = (points[k], points[(k + 1) % points.len()]);
                (a[0] - b[0]).hypot(a[1] - b[1])
            })
            .sum();
        assert!((length - 4.712).abs() < 0.02, "{length}");
    }

    #[test]
    fn a_contour_that_leaves_the_grid_is_open_and_its_region_is_closed() {
        // Radius 2.5 cuts the four corners of the square.
        let lines = hill().contour(-1.5);
        assert_eq!(lines.len(), 4);
        assert!(lines.iter().all(|(_, is_closed)| !is_closed));
        let region = hill().region(-1.5);
        assert_eq!(region.len(), 1);
        assert!(region[0].1);
        // The whole square, where the level is below everything.
        let whole = hill().region(-9.0);
        let shoelace: f64 = {
            let points = &whole[0].0;
            let pairs = (0..points.len()).map(|k| (points[k], points[(k + 1) % points.len()]));
            pairs.map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum()
        };
        assert!((shoelace.abs() / 2.0 - 16.0).abs() < 1e-9, "{shoelace}");
    }

    #[test]
    fn a_saddle_is_parted_by_its_middle() {
        let field = |a: f64, b: f64| Field {
            x: vec![0.0, 1.0],
            y: vec![0.0, 1.0],
            values: vec![vec![a, b], vec![b, a]],
        };
        // High corners 3, low 0: the middle 1.5 is above 1, so the low corners are cut off.
        for (line, _) in field(3.0, 0.0).contour(1.0) {
            let low = [[1.0, 0.0], [0.0, 1.0]];
            let near = |p: &Point| low.iter().any(|c| (p[0] - c[0]).hypot(p[1] - c[1]) < 0.5);
            assert!(line.iter().all(near), "{line:?}");
        }
        assert_eq!(field(3.0, 0.0).contour(1.0).len(), 2);
        assert_eq!(field(3.0, 0.0).contour(2.0).len(), 2);
    }

    #[test]
    fn a_straight_line_needs_two_points_and_a_bend_one_more() {
        let line: Vec<Point> = (0..50)
            .map(|k| [f64::from(k), 2.0 * f64::from(k)])
            .collect();
        assert_eq!(simplified(&line, 0.01).len(), 2);
        let bent: Vec<Point> = (0..=40)
            .map(|k| [f64::from(k), f64::from((k - 20i32).abs())])
            .collect();
        assert_eq!(simplified(&bent, 0.01).len(), 3);
        assert!(simplified(&[], 0.1).is_empty());
    }
}
