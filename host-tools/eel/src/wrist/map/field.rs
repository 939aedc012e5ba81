//! The general model over a grid of yaw and pitch.

use eel_kinematics::design::{self, Geometry, GlobalIsotropy, Jacobians, Margins, Range, Travel};

use super::super::args::Measure;
use super::contour::Field;

/// Cells along each axis of the paper's box where it is searched at one roll; its corners are on the
/// grid.
const FINE: u32 = 60;
/// The same where roll is searched too.
const COARSE: u32 = 24;
/// Cells along each axis for the mean conditioning of the box.
const MEAN: u32 = 16;

/// What is mapped: yaw along x, pitch along y, in rad.
pub struct Map {
    /// Yaw of the columns.
    pub yaw: Vec<f64>,
    /// Pitch of the rows.
    pub pitch: Vec<f64>,
    /// How far the legs reach, the lesser; negative out of reach.
    pub reach: Field,
    /// Positive where it is clear of singularities in home's modes: the least of the serial margins and
    /// of the factors of det A, which cross zero more straightly than their product.
    pub clear: Field,
    /// Each measure that is asked for, continued out of reach.
    pub values: Vec<(Measure, Field)>,
}

/// The value of a number, and the pose in rad at which it is.
#[derive(Clone, Copy, Debug)]
pub struct Extreme {
    pub value: f64,
    pub pose: [f64; 3],
}

/// The least margin and the worst condition number of rates over some poses.
pub struct Extremes {
    pub margin: Extreme,
    pub condition: Extreme,
}

/// Returns `cells` + 1 angles over a range, its ends among them.
pub fn axis(range: &Range, cells: u32) -> Vec<f64> {
    let share = |k: u32| f64::from(k) / f64::from(cells);
    (0..=cells).map(|k| range.at(share(k))).collect()
}

/// The model at one orientation.
struct Point {
    reach: f64,
    margin: f64,
    jacobians: Jacobians,
    margins: Margins,
}

impl Point {
    /// Asks the model; nothing where the geometry does not reach home.
    fn at(geometry: &Geometry, pose: [f64; 3]) -> Option<Self> {
        let [yaw, pitch, roll] = pose;
        let rotation = design::rotation(yaw, pitch, roll);
        let theta = geometry.nearest(&rotation);
        let [first, second] = geometry.reach(&rotation);
        Some(Self {
            reach: first.min(second),
            margin: geometry.least_margin(&rotation)?,
            jacobians: geometry.jacobians(&rotation, &theta),
            margins: geometry.margins(&rotation, &theta)?,
        })
    }

    /// Returns what is positive where it is clear of singularities.
    fn clear(&self) -> f64 {
        if self.reach < 0.0 {
            return self.margin;
        }
        let [first, second] = self.margins.depths;
        let serial = self.margins.legs().min(self.margins.serial[2]);
        serial.min(first).min(second)
    }

    /// Returns a measure as it is coloured: condition numbers as their inverses.
    fn value(&self, measure: Measure) -> f64 {
        let value = match measure {
            Measure::Margin => self.margin,
            Measure::Serial => self.margins.legs().min(self.margins.serial[2]),
            Measure::Parallel => self.margins.parallel,
            Measure::Isotropy | Measure::Condition => self.jacobians.isotropy_of_rates(),
            Measure::IsotropyOfA | Measure::ConditionOfA => self.jacobians.isotropy(),
            Measure::Manipulability => self.jacobians.manipulability_of_rates(),
        };
        // Where both kinds of singularity meet there is no manipulability.
        if value.is_finite() { value } else { 0.0 }
    }
}

impl Map {
    /// Computes the measures over a grid at one roll; nothing where the geometry does not reach home.
    pub fn compute(
        geometry: &Geometry,
        [yaw, pitch]: [&Range; 2],
        roll: f64,
        cells: u32,
        measures: &[Measure],
    ) -> Option<Self> {
        let (yaw, pitch) = (axis(yaw, cells), axis(pitch, cells));
        let row = |y: &f64| -> Option<Vec<Point>> {
            let points = yaw.iter().map(|x| Point::at(geometry, [*x, *y, roll]));
            points.collect()
        };
        let rows: Vec<Vec<Point>> = pitch.iter().map(row).collect::<Option<_>>()?;
        let field = |of: &dyn Fn(&Point) -> f64| Field {
            x: yaw.clone(),
            y: pitch.clone(),
            values: rows
                .iter()
                .map(|row| row.iter().map(of).collect())
                .collect(),
        };
        let values = measures
            .iter()
            .map(|measure| (*measure, field(&|point| point.value(*measure))))
            .collect();
        Some(Self {
            reach: field(&|point| point.reach),
            clear: field(&Point::clear),
            values,
            yaw,
            pitch,
        })
    }
}

/// What holds over the paper's box.
pub struct Summary {
    /// The least margin and the worst condition of rates at the map's roll.
    pub at_roll: Extremes,
    /// The same at any roll of the box.
    pub any_roll: Extremes,
    /// By how much the box may grow before it meets a singularity.
    pub largest_box: f64,
    /// Mean conditioning over the box.
    pub isotropy: GlobalIsotropy,
}

impl Summary {
    /// Searches the paper's box; nothing where the geometry does not reach home.
    pub fn of(geometry: &Geometry, roll: f64) -> Option<Self> {
        let [yaw, pitch, rolls] = &Travel::PAPER;
        Some(Self {
            at_roll: Extremes::over(geometry, [yaw, pitch], FINE, &[roll])?,
            any_roll: Extremes::over(geometry, [yaw, pitch], COARSE, &axis(rolls, COARSE))?,
            largest_box: geometry.largest_box(&Travel::PAPER),
            isotropy: geometry.global_isotropy(&Travel::PAPER, MEAN),
        })
    }
}

impl Extremes {
    fn over(
        geometry: &Geometry,
        [yaw, pitch]: [&Range; 2],
        cells: u32,
        rolls: &[f64],
    ) -> Option<Self> {
        let nowhere = |value: f64| Extreme {
            value,
            pose: [0.0; 3],
        };
        let mut found = Self {
            margin: nowhere(f64::INFINITY),
            condition: nowhere(0.0),
        };
        let (yaw, pitch) = (axis(yaw, cells), axis(pitch, cells));
        for x in &yaw {
            for (y, roll) in pitch.iter().flat_map(|y| rolls.iter().map(move |r| (y, r))) {
                let pose = [*x, *y, *roll];
                let point = Point::at(geometry, pose)?;
                let margin = point.margin;
                // Where there is no margin there is no conditioning either.
                let condition = if margin > 0.0 {
                    point.jacobians.condition_of_rates()
                } else {
                    f64::INFINITY
                };
                if margin < found.margin.value {
                    found.margin = Extreme {
                        value: margin,
                        pose,
                    };
                }
                if condition > found.condition.value {
                    found.condition = Extreme {
                        value: condition,
                        pose,
                    };
                }
            }
        }
        Some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_of_the_prototype_has_its_least_margin_in_a_corner() {
        let summary = Summary::of(&Geometry::PARALLEL_ACTUATORS, 0.0).unwrap();
        let margin = summary.any_roll.margin;
        assert!((margin.value - 0.574_757_5).abs() < 1e-6, "{margin:?}");
        for (angle, range) in margin.pose.iter().zip(Travel::PAPER) {
            assert!((angle.abs() - range.high).abs() < 1e-12);
        }
        assert!(summary.at_roll.margin.value > margin.value);
        assert!(summary.any_roll.condition.value >= summary.at_roll.condition.value);
        assert!((summary.largest_box - 1.258).abs() < 1e-3);
    }

    #[test]
    fn measures_are_continuous_across_the_end_of_reach_and_one_at_home() {
        let geometry = Geometry::PARALLEL_ACTUATORS;
        let pitch = Range::from_degrees(-60.0, 60.0);
        let yaw = Range::from_degrees(-10.0, 10.0);
        let all = [Measure::Margin, Measure::Isotropy, Measure::IsotropyOfA];
        let map = Map::compute(&geometry, [&yaw, &pitch], 0.0, 480, &all).unwrap();
        assert_eq!((map.yaw.len(), map.pitch.len()), (481, 481));
        for ((_, field), home) in map.values.iter().zip([1.0, 0.5f64.sqrt(), 1.0]) {
            assert!((field.values[240][240] - home).abs() < 1e-9);
            for row in field.values.windows(2) {
                // A quarter of a degree; at the border of reach a root.
                assert!((row[1][240] - row[0][240]).abs() < 0.2);
            }
        }
        assert!(map.reach.values[0][240] < 0.0 && map.clear.values[0][240] < 0.0);
        assert!(map.clear.values[240][240] > 0.0);
    }
}
