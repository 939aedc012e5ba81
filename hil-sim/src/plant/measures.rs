//! The figures of a swim, from a record of the eel's path.
//!
//! Speed is that of the centre of mass over six cycles at the end of the record; the mean path is
//! the straight line of that displacement; slip = U/(λ f); Strouhal = 2 f A/U with A half the
//! peak-to-peak excursion of the tail's edge across the mean path.

/// One moment of a swim.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Centre of mass in the world frame, m.
    pub centre: [f64; 3],
    /// Middle of the trailing edge in the world frame, m.
    pub tail: [f64; 3],
    /// Work of the joints since the start, J.
    pub energy_j: f64,
}

/// A swim, recorded at equal times; at least fifty moments a cycle make the amplitude right to
/// 0.2 %.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Time between moments, s.
    pub interval_s: f64,
    /// The moments, from the start.
    pub moments: Vec<Moment>,
}

/// What the swim was meant to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Cycles a second, Hz.
    pub frequency_hz: f64,
    /// Wavelength of the body wave, m.
    pub wavelength_m: f64,
    /// Length of the eel, m.
    pub length_m: f64,
}

/// The figures of a swim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Speed of the centre of mass, m/s.
    pub speed_m_s: f64,
    /// Way per cycle, body lengths.
    pub stride_body_lengths: f64,
    /// Speed over that of the body wave.
    pub slip: f64,
    /// Strouhal number 2 f A/U.
    pub strouhal: f64,
    /// Half the peak-to-peak excursion of the tail's edge across the mean path, body lengths.
    pub tail_amplitude_body_lengths: f64,
    /// Mean mechanical power of the joints, W.
    pub mean_power_w: f64,
    /// Work of the joints a metre of way, J/m.
    pub work_j_per_m: f64,
    /// How much the speed of the last three cycles differs from that of the three before,
    /// relative to the mean: small when the start has settled.
    pub unsteadiness: f64,
}

/// How many cycles the figures are taken over.
pub const CYCLES: f64 = 6.0;

/// Returns the figures over the last six cycles; `None` when the record is shorter, or when the
/// eel went nowhere.
pub fn swim_figures(recording: &Recording, stroke: &Stroke) -> Option<Figures> {
    let window_s = CYCLES / stroke.frequency_hz;
    let last = recording.moments.len().checked_sub(1)? as f64;
    let first = last - window_s / recording.interval_s;
    if first.is_nan() || first < -1e-9 {
        return None;
    }
    let first = first.max(0.0);
    let (start, middle, end) = (
        recording.at(first)?,
        recording.at(0.5 * (first + last))?,
        recording.at(last)?,
    );
    let way = minus(end.centre, start.centre);
    let distance = length(way);
    if distance < 1e-6 {
        return None;
    }
    let along = way.map(|x| x / distance);
    let speed = distance / window_s;
    let halves = [
        dot(minus(middle.centre, start.centre), along),
        dot(minus(end.centre, middle.centre), along),
    ];
    let amplitude = 0.5 * recording.excursion(first, last, start.centre, along);
    Some(Figures {
        speed_m_s: speed,
        stride_body_lengths: speed / (stroke.frequency_hz * stroke.length_m),
        slip: speed / (stroke.wavelength_m * stroke.frequency_hz),
        strouhal: 2.0 * stroke.frequency_hz * amplitude / speed,
        tail_amplitude_body_lengths: amplitude / stroke.length_m,
        mean_power_w: (end.energy_j - start.energy_j) / window_s,
        work_j_per_m: (end.energy_j - start.energy_j) / distance,
        unsteadiness: (halves[1] - halves[0]).abs() / (0.5 * distance),
    })
}

impl Recording {
    /// Returns the moment at a place between the recorded ones, by linear interpolation.
    fn at(&self, index: f64) -> Option<Moment> {
        let low = libm::floor(index);
        let share = index - low;
        let before = *self.moments.get(low as usize)?;
        let after = *self.moments.get(low as usize + 1).unwrap_or(&before);
        let mix = |a: f64, b: f64| a + (b - a) * share;
        let mix3 = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| mix(a[i], b[i]));
        Some(Moment {
            centre: mix3(before.centre, after.centre),
            tail: mix3(before.tail, after.tail),
            energy_j: mix(before.energy_j, after.energy_j),
        })
    }

    /// Returns the peak-to-peak excursion of the tail's edge across a path, m: the largest over
    /// the cross directions, as the mean of the six cycles' own peak-to-peak values.
    fn excursion(&self, first: f64, last: f64, origin: [f64; 3], along: [f64; 3]) -> f64 {
        let across = self.widest(first, last, origin, along);
        let cycle = (last - first) / CYCLES;
        let mut total = 0.0;
        for index in 0..CYCLES as usize {
            let low = first + cycle * index as f64;
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for moment in self.between(low, low + cycle) {
                let side = dot(minus(moment.tail, origin), across);
                (least, most) = (least.min(side), most.max(side));
            }
            total += (most - least).max(0.0);
        }
        total / CYCLES
    }

    /// Returns the direction across the path in which the tail moves most.
    fn widest(&self, first: f64, last: f64, origin: [f64; 3], along: [f64; 3]) -> [f64; 3] {
        let off = |moment: &Moment| {
            let from = minus(moment.tail, origin);
            let ahead = dot(from, along);
            let side: [f64; 3] = std::array::from_fn(|i| from[i] - ahead * along[i]);
            side
        };
        let inside = self.between(first, last);
        let count = inside.len() as f64;
        let mut mean = [0.0; 3];
        for side in inside.iter().map(off) {
            mean = std::array::from_fn(|i| mean[i] + side[i] / count);
        }
        let mut best = [0.0; 3];
        for side in inside.iter().map(off) {
            let from_mean = minus(side, mean);
            if length(from_mean) > length(best) {
                best = from_mean;
            }
        }
        let reach = length(best);
        if reach > 0.0 {
            best.map(|x| x / reach)
        } else {
            best
        }
    }

    /// Returns the moments from one place to another, ends included.
    fn between(&self, first: f64, last: f64) -> &[Moment] {
        let low = libm::ceil(first - 1e-9).max(0.0) as usize;
        let high = (libm::floor(last + 1e-9) as usize + 1).min(self.moments.len());
        self.moments.get(low..high).unwrap_or(&[])
    }
}

/// Returns a − b.
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// Returns the scalar product.
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the length of a vector.
fn length(a: [f64; 3]) -> f64 {
    libm::sqrt(dot(a, a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const STROKE: Stroke = Stroke {
        frequency_hz: 1.0,
        wavelength_m: 1.2,
        length_m: 1.5,
    };

    /// A swim at 0.6 m/s and 2 W in a direction, its tail at 0.12 m.
    fn swim(direction: [f64; 3], across: [f64; 3], frequency: f64, seconds: f64) -> Recording {
        let interval_s = 0.01;
        let moment = |index: usize| {
            let t = index as f64 * interval_s;
            let sway = 0.01 * (TAU * frequency * t).cos();
            let beat = 0.12 * (TAU * frequency * t + 0.3).sin();
            let place = |side: f64, behind: f64| {
                std::array::from_fn(|i| direction[i] * (0.6 * t - behind) + across[i] * side)
            };
            Moment {
                centre: place(sway, 0.0),
                tail: place(beat, 0.7),
                energy_j: 2.0 * t,
            }
        };
        let count = (seconds / interval_s) as usize + 1;
        Recording {
            interval_s,
            moments: (0..count).map(moment).collect(),
        }
    }

    #[test]
    fn finds_the_figures_that_a_swim_was_made_with() {
        let swim = swim([0.0, 0.6, -0.8], [0.0, 0.8, 0.6], 1.0, 12.0);
        let figures = swim_figures(&swim, &STROKE).unwrap();
        assert!((figures.speed_m_s - 0.6).abs() < 1e-12);
        assert!((figures.stride_body_lengths - 0.4).abs() < 1e-12);
        assert!((figures.slip - 0.5).abs() < 1e-12);
        assert!((figures.tail_amplitude_body_lengths - 0.08).abs() < 0.08 * 1e-3);
        assert!((figures.strouhal - 0.4).abs() < 0.4 * 1e-3);
        assert!((figures.mean_power_w - 2.0).abs() < 1e-9);
        assert!((figures.work_j_per_m - 2.0 / 0.6).abs() < 1e-9);
        assert!(figures.unsteadiness < 1e-9);
    }

    #[test]
    fn a_cycle_need_not_be_a_whole_number_of_moments() {
        let stroke = Stroke {
            frequency_hz: 0.7,
            ..STROKE
        };
        let swim = swim([0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 0.7, 20.0);
        let figures = swim_figures(&swim, &stroke).unwrap();
        assert!((figures.speed_m_s - 0.6).abs() < 1e-5, "{figures:?}");
        assert!((figures.tail_amplitude_body_lengths - 0.08).abs() < 0.08 * 1e-3);
    }

    #[test]
    fn only_the_last_six_cycles_count_and_a_start_shows() {
        let mut record = swim([0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 1.0, 12.0);
        for moment in &mut record.moments[..500] {
            moment.tail[1] = 7.0;
        }
        let figures = swim_figures(&record, &STROKE).unwrap();
        assert!((figures.tail_amplitude_body_lengths - 0.08).abs() < 1e-3);
        for (index, moment) in record.moments.iter_mut().enumerate() {
            moment.centre[2] -= 1e-6 * (index * index) as f64;
        }
        let figures = swim_figures(&record, &STROKE).unwrap();
        assert!(figures.unsteadiness > 0.05, "{figures:?}");
    }

    #[test]
    fn says_nothing_of_a_short_record_or_of_an_eel_at_rest() {
        let short = swim([0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 1.0, 5.9);
        assert_eq!(swim_figures(&short, &STROKE), None);
        let rest = Recording {
            interval_s: 0.01,
            moments: vec![Moment::default(); 1000],
        };
        assert_eq!(swim_figures(&rest, &STROKE), None);
    }
}
