//! The constants of every unit that `design` admits, as intervals.

use crate::design::Geometry;
use crate::design::kernel::TOLERANCE;
use crate::script::Range;

/// What one leg of any unit may be: lengths over the arm.
pub struct Limits {
    /// A.
    pub center: [Range; 3],
    /// A / ρ.
    pub slope: [Range; 3],
    /// (1 + A·A + ρ² − s²) / 2ρ.
    pub offset: Range,
    /// ρ.
    pub crank: Range,
    /// s.
    pub rod: Range,
}

/// Returns the limits of one leg.
pub fn limits(leg: usize) -> Limits {
    let ideal = &Geometry::PARALLEL_ACTUATORS.legs[leg];
    let about = |value: f64, by: f64| Range(value - by, value + by);
    let center = [0, 1, 2].map(|k| about(ideal.center[k], TOLERANCE));
    let crank = about(ideal.crank, TOLERANCE * ideal.crank);
    let rod = about(ideal.rod, TOLERANCE * ideal.rod);
    let slope = center.map(|range| range.over(crank));
    // (1 + A·A − s²) / 2ρ + ρ / 2.
    let squares = center
        .iter()
        .fold(Range(1.0, 1.0), |sum, a| sum.plus(a.square()));
    let rest = squares.plus(rod.square().times(Range(-1.0, -1.0)));
    let half = Range(0.5, 0.5);
    let offset = rest.over(crank).times(half).plus(crank.times(half));
    Limits {
        center,
        slope,
        offset,
        crank,
        rod,
    }
}

impl Range {
    /// Returns all sums.
    pub fn plus(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1).widened(1e-12)
    }

    /// Returns all products.
    pub fn times(self, other: Self) -> Self {
        let all = [
            self.0 * other.0,
            self.0 * other.1,
            self.1 * other.0,
            self.1 * other.1,
        ];
        let least = all.into_iter().fold(f64::INFINITY, f64::min);
        let most = all.into_iter().fold(f64::NEG_INFINITY, f64::max);
        Self(least, most).widened(1e-12)
    }

    /// Returns all quotients by positive numbers.
    pub fn over(self, positive: Self) -> Self {
        assert!(positive.0 > 0.0);
        self.times(Self(1.0 / positive.1, 1.0 / positive.0))
    }

    /// Returns all squares.
    pub fn square(self) -> Self {
        let (a, b) = (self.0.abs(), self.1.abs());
        let least = if self.0 <= 0.0 && self.1 >= 0.0 {
            0.0
        } else {
            a.min(b)
        };
        Self(least * least, a.max(b) * a.max(b)).widened(1e-12)
    }

    /// Returns it longer at both ends.
    pub fn widened(self, by: f64) -> Self {
        Self(self.0 - by, self.1 + by)
    }
}
