//! Which number has which colour, which contours are drawn, and what they are called.

use clap::ValueEnum;
use eel_kinematics::design::Range;

use super::super::args::Measure;
use super::super::number::plain;
use super::contour::Field;

/// Bands of colour.
const BANDS: u32 = 20;

/// A scale from 0 to `top`.
pub struct Scale {
    top: f64,
    is_condition: bool,
}

impl Scale {
    /// Returns the scale of a measure: to 1 for what is 1 at best, else to what the map shows where it
    /// is clear of singularities.
    pub fn of(measure: Measure, field: &Field, clear: &Field) -> Self {
        let shown = field.values.iter().flatten();
        let mut shown: Vec<f64> = shown
            .zip(clear.values.iter().flatten())
            .filter(|(_, clear)| **clear > 0.0)
            .map(|(value, _)| *value)
            .collect();
        shown.sort_by(f64::total_cmp);
        // What grows without bound near a singularity must not flatten the rest.
        let most = shown.get(shown.len() * 9 / 10).copied().unwrap_or(0.0);
        let top = match measure {
            Measure::Serial | Measure::Parallel | Measure::Manipulability => {
                let tops = [1.0, 1.5, 2.0, 3.0, 4.0, 5.0];
                // A hair above a round number is that number.
                let enough = |top: &&f64| **top * 1.02 >= most;
                tops.iter().find(enough).copied().unwrap_or(10.0)
            }
            _ => 1.0,
        };
        Self {
            top,
            is_condition: matches!(measure, Measure::Condition | Measure::ConditionOfA),
        }
    }

    /// Returns where a number is on the scale, 0 to 1.
    pub fn share(&self, value: f64) -> f64 {
        value / self.top
    }

    /// Returns the lower end of each band of colour, and the share whose colour it has.
    pub fn bands(&self) -> Vec<(f64, f64)> {
        let share = |k: u32| f64::from(k) / f64::from(BANDS);
        let middle = 0.5 / f64::from(BANDS);
        (0..BANDS)
            .map(|k| {
                // The lowest holds everything that the map's clear part can have.
                let low = if k == 0 { -1e6 } else { share(k) * self.top };
                (low, share(k) + middle)
            })
            .collect()
    }

    /// Returns the levels at which contours are drawn, with their names.
    pub fn contours(&self) -> Vec<(f64, String)> {
        if self.is_condition {
            let levels = [1.1, 1.25, 1.5, 2.0, 3.0, 5.0, 10.0];
            return levels.map(|level| (1.0 / level, short(level))).to_vec();
        }
        (1..10)
            .map(|k| f64::from(k) / 10.0 * self.top)
            .map(|level| (level, short(level)))
            .collect()
    }

    /// Returns the shares that are marked on the legend, with their names.
    pub fn marks(&self) -> Vec<(f64, String)> {
        if self.is_condition {
            let levels = [1.0, 1.25, 1.5, 2.0, 3.0, 5.0, 10.0];
            let mut marks = levels.map(|level| (1.0 / level, short(level))).to_vec();
            marks.push((0.0, "∞".to_owned()));
            return marks;
        }
        (0..=5)
            .map(|k| f64::from(k) / 5.0)
            .map(|share| (share, short(share * self.top)))
            .collect()
    }
}

/// Returns a number with two decimals at most.
fn short(value: f64) -> String {
    let text = plain(value, 2);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Returns round angles in degrees over a range in rad, about `wanted` of them.
pub fn ticks(range: &Range, wanted: f64) -> Vec<f64> {
    let (low, high) = (range.low.to_degrees(), range.high.to_degrees());
    let steps = [1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 90.0];
    let fits = |step: &&f64| (high - low) / **step <= wanted;
    let step = steps.iter().find(fits).copied().unwrap_or(90.0);
    let first = (low / step - 1e-9).ceil() as i32;
    let last = (high / step + 1e-9).floor() as i32;
    (first..=last).map(|k| f64::from(k) * step).collect()
}

impl Measure {
    /// Returns its name on the command line.
    pub fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Returns the number itself for what is coloured; nothing where it is infinite.
    pub fn number(self, coloured: f64) -> Option<f64> {
        let number = match self {
            Self::Condition | Self::ConditionOfA => 1.0 / coloured,
            _ => coloured,
        };
        Some(number).filter(|number| number.is_finite())
    }

    /// Returns what stands over its panel.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Margin => "Least margin (1 at home, 0 at a singularity)",
            Self::Serial => "Least serial margin (1 at home, 0 where a leg lines up)",
            Self::Parallel => "Parallel margin (1 at home, 0 where det A = 0)",
            Self::Isotropy => "Conditioning of the motors' rates, 1/κ(B⁻¹A)",
            Self::IsotropyOfA => "Conditioning of A, 1/κ(A)",
            Self::Condition => "Condition number of the motors' rates, κ(B⁻¹A)",
            Self::ConditionOfA => "Condition number of A, κ(A)",
            Self::Manipulability => "Manipulability of A⁻¹B, √det(J Jᵀ)",
        }
    }

    /// Returns what stands over its legend.
    pub const fn sign(self) -> &'static str {
        match self {
            Self::Margin | Self::Serial | Self::Parallel => "margin",
            Self::Isotropy | Self::IsotropyOfA => "1/κ",
            Self::Condition | Self::ConditionOfA => "κ",
            Self::Manipulability => "√det(J Jᵀ)",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_not_too_many() {
        let all = ticks(&Range::from_degrees(-75.0, 75.0), 10.0);
        assert_eq!(all.first(), Some(&-75.0));
        assert_eq!(all.len(), 11);
        assert_eq!(ticks(&Range::from_degrees(3.0, 8.9), 3.0), [4.0, 6.0, 8.0]);
    }

    #[test]
    fn a_condition_number_is_named_itself_and_placed_by_its_inverse() {
        let field = Field {
            x: vec![0.0],
            y: vec![0.0],
            values: vec![vec![0.5]],
        };
        let scale = Scale::of(Measure::Condition, &field, &field);
        assert!(scale.contours().contains(&(0.5, "2".to_owned())));
        let plain = Scale::of(Measure::Isotropy, &field, &field);
        assert!(plain.marks().contains(&(0.2, "0.2".to_owned())));
        let mut tall = field.clone();
        tall.values[0][0] = 1.7;
        assert_eq!(
            Scale::of(Measure::Manipulability, &tall, &field).share(2.0),
            1.0
        );
        assert_eq!(Scale::of(Measure::Margin, &tall, &field).share(1.0), 1.0);
    }
}
