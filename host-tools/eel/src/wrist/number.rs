//! Numbers for people: units, columns, no negative zeros.

use anyhow::Result;

use super::args::Subject;
use super::refused;

/// The unit of angles at the command line.
#[derive(Clone, Copy, Debug)]
pub struct Unit {
    /// Its name.
    pub name: &'static str,
    per_radian: f64,
    places: usize,
}

impl Unit {
    /// Returns the unit that is asked for.
    pub fn of(subject: &Subject) -> Self {
        if subject.degrees {
            Self {
                name: "deg",
                per_radian: 1f64.to_degrees(),
                places: 7,
            }
        } else {
            Self {
                name: "rad",
                per_radian: 1.0,
                places: 9,
            }
        }
    }

    /// Returns radians for a number in this unit; refuses more than a turn, which mostly is degrees
    /// taken for radians.
    pub fn read(self, number: f64) -> Result<f64> {
        let radians = number / self.per_radian;
        if radians.abs() > std::f64::consts::TAU {
            return Err(refused(format!(
                "{number} {} is more than a turn; angles are in radians, with --degrees in degrees",
                self.name
            )));
        }
        Ok(radians)
    }

    /// Returns numbers in this unit for radians.
    pub fn show<const N: usize>(self, radians: [f64; N]) -> [f64; N] {
        radians.map(|angle| angle * self.per_radian)
    }

    /// Returns columns for angles in radians.
    pub fn columns(self, radians: &[f64]) -> String {
        let in_unit: Vec<f64> = radians.iter().map(|r| r * self.per_radian).collect();
        columns(&in_unit, self.places)
    }
}

/// Returns numbers as right-aligned columns.
pub fn columns(numbers: &[f64], places: usize) -> String {
    let cells = numbers
        .iter()
        .map(|number| format!("{:>14}", plain(*number, places)));
    cells.collect()
}

/// Returns a number with so many decimal places, without a negative zero.
pub fn plain(number: f64, places: usize) -> String {
    let text = format!("{number:.places$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        _ => text,
    }
}

/// Returns a number as drawings have it: with a true minus sign.
pub fn signed(number: f64, places: usize) -> String {
    plain(number, places).replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_rounds_to_zero_has_no_sign() {
        assert_eq!(plain(-1e-12, 3), "0.000");
        assert_eq!(plain(-0.0015, 3), "-0.002");
        assert_eq!(signed(-0.0015, 3), "−0.002");
    }
}
