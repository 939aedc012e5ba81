//! The painter's order: what is farther from the eye is drawn first.
//!
//! Two shapes are compared where they overlap on the drawing, not by their middles, so that a long bar
//! is right at both of its crossings.

use super::super::svg::Point;
use super::scene::Flat;

/// Points of a line that are compared with an area.
const SAMPLES: u32 = 48;
/// Distances that differ by less are equal.
const EQUAL: f64 = 1e-3;

/// Returns the order in which shapes are drawn, as indices.
pub fn painted(shapes: &[Flat]) -> Vec<usize> {
    let count = shapes.len();
    // What must be drawn before each shape, as far as it isn't yet.
    let mut before = vec![Vec::new(); count];
    for a in 0..count {
        for b in a + 1..count {
            match behind(&shapes[a], &shapes[b]) {
                Some(difference) if difference > EQUAL => before[b].push(a),
                Some(difference) if difference < -EQUAL => before[a].push(b),
                _ => {}
            }
        }
    }
    let mut left: Vec<usize> = (0..count).collect();
    left.sort_by(|a, b| middle(&shapes[*b]).total_cmp(&middle(&shapes[*a])));
    let mut order = Vec::with_capacity(count);
    while !left.is_empty() {
        let is_free = |shape: &usize| before[*shape].iter().all(|other| order.contains(other));
        // Shapes that hide each other in a ring have no order; the farthest goes first.
        let next = left.iter().position(is_free).unwrap_or(0);
        order.push(left.remove(next));
    }
    order
}

/// Returns how much farther the first is where both are seen; nothing where they do not overlap.
fn behind(a: &Flat, b: &Flat) -> Option<f64> {
    match (a, b) {
        (Flat::Line(p, dp), Flat::Line(q, dq)) => {
            let (s, t) = crossing(*p, *q)?;
            Some(dp[0] + (dp[1] - dp[0]) * s - dq[0] - (dq[1] - dq[0]) * t)
        }
        // What is joined goes into the joint.
        (Flat::Line(ends, _), Flat::Area(corners, ..)) if is_joined(ends, corners) => Some(1.0),
        (Flat::Line(ends, depths), area) => {
            let samples = (0..=SAMPLES).map(|k| f64::from(k) / f64::from(SAMPLES));
            let differences: Vec<f64> = samples
                .filter_map(|share| {
                    let at = [0, 1].map(|k| ends[0][k] + (ends[1][k] - ends[0][k]) * share);
                    let depth = depths[0] + (depths[1] - depths[0]) * share;
                    Some(depth - depth_at(area, at)?)
                })
                .collect();
            let difference = largest(differences.iter().copied())?;
            // A bar in the plane of a face is drawn on it; one that only touches it has no order.
            if difference.abs() > EQUAL {
                Some(difference)
            } else {
                (differences.len() > 2).then_some(-1.0)
            }
        }
        (area, Flat::Line(..)) => behind(b, area).map(|difference| -difference),
        (Flat::Area(first, ..), Flat::Area(second, ..)) if is_joined(first, second) => Some(1.0),
        (Flat::Area(first, ..), Flat::Area(second, ..)) if is_joined(second, first) => Some(-1.0),
        (Flat::Area(first, ..), Flat::Area(second, ..)) => {
            let corners = first.iter().chain(second).copied();
            let middles = [center(first), center(second)];
            largest(
                corners
                    .chain(middles)
                    .filter_map(|at| Some(depth_at(a, at)? - depth_at(b, at)?)),
            )
        }
    }
}

/// Returns whether a shape ends in the middle of an area, as a bar or a plate does in its joint.
fn is_joined(ends: &[Point], corners: &[Point]) -> bool {
    let [x, y] = center(corners);
    ends.iter().any(|end| (end[0] - x).hypot(end[1] - y) < 1e-6)
}

/// Returns the number that is largest regardless of sign.
fn largest(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    numbers.max_by(|a, b| a.abs().total_cmp(&b.abs()))
}

/// Returns how far an area is at a point of the drawing; nothing beside it.
fn depth_at(shape: &Flat, at: Point) -> Option<f64> {
    let Flat::Area(corners, depth, slope) = shape else {
        return None;
    };
    let [x, y] = *corners.first()?;
    contains(corners, at).then_some(depth + slope[0] * (at[0] - x) + slope[1] * (at[1] - y))
}

/// Returns whether a point is in a convex polygon or on its edge.
fn contains(corners: &[Point], at: Point) -> bool {
    let (mut left, mut right) = (false, false);
    for k in 0..corners.len() {
        let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
        let side = (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0]);
        left |= side > 1e-9;
        right |= side < -1e-9;
    }
    !(left && right)
}

/// Returns where two lines cross, as shares of both; nothing where they do not or only touch.
fn crossing(p: [Point; 2], q: [Point; 2]) -> Option<(f64, f64)> {
    let (a, b) = (
        [p[1][0] - p[0][0], p[1][1] - p[0][1]],
        [q[1][0] - q[0][0], q[1][1] - q[0][1]],
    );
    let across = a[0] * b[1] - a[1] * b[0];
    if across.abs() < 1e-9 {
        return None;
    }
    let way = [q[0][0] - p[0][0], q[0][1] - p[0][1]];
    let s = (way[0] * b[1] - way[1] * b[0]) / across;
    let t = (way[0] * a[1] - way[1] * a[0]) / across;
    let inside = |share: f64| (1e-6..=1.0 - 1e-6).contains(&share);
    (inside(s) && inside(t)).then_some((s, t))
}

fn center(corners: &[Point]) -> Point {
    let count = corners.len().max(1) as f64;
    [0, 1].map(|k| corners.iter().map(|at| at[k]).sum::<f64>() / count)
}

fn middle(shape: &Flat) -> f64 {
    match shape {
        Flat::Line(_, depths) => (depths[0] + depths[1]) / 2.0,
        Flat::Area(corners, depth, slope) => {
            let [x, y] = center(corners);
            let first = corners.first().copied().unwrap_or([x, y]);
            depth + slope[0] * (x - first[0]) + slope[1] * (y - first[1])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(depth: f64) -> Flat {
        let corners = vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
        Flat::Area(corners, depth, [0.0; 2])
    }

    #[test]
    fn a_crossing_decides_and_not_the_middles() {
        // The long line is farther in the middle, but nearer where it crosses the short one.
        let long = Flat::Line([[0.0, 0.0], [100.0, 0.0]], [0.0, 10.0]);
        let short = Flat::Line([[10.0, -5.0], [10.0, 5.0]], [3.0, 3.0]);
        assert_eq!(painted(&[long, short]), [1, 0]);
    }

    #[test]
    fn areas_and_lines_are_drawn_from_far_to_near() {
        let line = |depth: f64| Flat::Line([[-5.0, 5.0], [15.0, 5.0]], [depth, depth]);
        assert_eq!(painted(&[line(1.0), square(2.0), line(3.0)]), [2, 1, 0]);
        assert_eq!(painted(&[square(1.0), square(2.0)]), [1, 0]);
    }

    #[test]
    fn a_bar_in_the_plane_of_a_face_is_drawn_on_it() {
        let bar = Flat::Line([[0.0, 0.0], [10.0, 0.0]], [2.0, 2.0]);
        assert_eq!(painted(&[bar, square(2.0)]), [1, 0]);
    }

    #[test]
    fn a_bar_that_points_at_the_eye_is_still_behind_its_joint() {
        let bar = Flat::Line([[5.0, 5.0], [6.0, 5.0]], [2.0, -50.0]);
        assert_eq!(painted(&[square(2.0), bar]), [1, 0]);
    }

    #[test]
    fn shapes_in_a_ring_are_all_drawn() {
        let line = |from: Point, to: Point, a: f64, b: f64| Flat::Line([from, to], [a, b]);
        let ring = [
            line([0.0, 0.0], [10.0, 10.0], 0.0, 9.0),
            line([10.0, 0.0], [0.0, 10.0], 9.0, 0.0),
            line([0.0, 3.0], [10.0, 3.0], 9.0, 0.0),
        ];
        let mut order = painted(&ring);
        order.sort_unstable();
        assert_eq!(order, [0, 1, 2]);
    }
}
