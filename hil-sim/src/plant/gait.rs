//! The reference gait in f64, for runs of the plant alone.
//!
//! The robot's own gait is the head's, in fixed point; this one is what figures of the plant are
//! compared by: y = A e^{2.2 (s/L − 1)} sin 2π (s/λ − f t), turned into joint angles.

use std::f64::consts::TAU;

use super::Plant;
use super::algebra::Vec3;
use super::body::{BODIES, JOINTS};
use super::config::{Config, Shape};
use super::joint::{Target, Tracking};
use super::measures::{Figures, Moment, Recording, Stroke, swim_figures};

/// How fast the amplitude grows from head to tail: e^{2.2} = 9 times.
const GROWTH: f64 = 2.2;
/// Cycles over which the gait starts.
const START_CYCLES: f64 = 2.0;

/// A travelling wave of lateral bending.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Cycles a second, Hz.
    pub frequency_hz: f64,
    /// Amplitude at the tail, in body lengths; negative for the mirrored wave.
    pub amplitude_lengths: f64,
    /// Wavelength, in body lengths.
    pub wavelength_lengths: f64,
}

impl Default for Wave {
    fn default() -> Self {
        Self {
            frequency_hz: 1.0,
            amplitude_lengths: 0.08,
            wavelength_lengths: 0.8,
        }
    }
}

impl Wave {
    /// Returns the joints' targets at a time, with a smooth start over two cycles.
    pub fn targets(&self, shape: &Shape, time_s: f64) -> [Target; JOINTS] {
        const H: f64 = 1e-5;
        let (now, before, after) = (
            self.yaws(shape, time_s),
            self.yaws(shape, time_s - H),
            self.yaws(shape, time_s + H),
        );
        std::array::from_fn(|joint| Target {
            pose: [now[joint], 0.0, 0.0],
            rates: [(after[joint] - before[joint]) / (2.0 * H), 0.0, 0.0],
        })
    }

    /// Returns the yaw of every joint at a time, rad.
    fn yaws(&self, shape: &Shape, time_s: f64) -> [f64; JOINTS] {
        let directions: [f64; BODIES] = std::array::from_fn(|body| {
            let (start, end) = (shape.body_start(body), shape.body_start(body + 1));
            let across = self.across(shape, end, time_s) - self.across(shape, start, time_s);
            -libm::asin(across / (end - start))
        });
        std::array::from_fn(|joint| directions[joint + 1] - directions[joint])
    }

    /// Returns the lateral excursion at a distance from the nose, m.
    fn across(&self, shape: &Shape, s: f64, time_s: f64) -> f64 {
        let along = s / shape.length_m;
        let cycles = self.frequency_hz * time_s;
        let amplitude = self.amplitude_lengths * shape.length_m * libm::exp(GROWTH * (along - 1.0));
        let phase = TAU * (along / self.wavelength_lengths - cycles);
        smooth(cycles / START_CYCLES) * amplitude * libm::sin(phase)
    }
}

/// Rises from 0 to 1 with smooth first and second derivatives.
fn smooth(share: f64) -> f64 {
    let x = share.clamp(0.0, 1.0);
    x * x * x * (10.0 + x * (6.0 * x - 15.0))
}

/// What a swim with ideal drives came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swim {
    /// Its figures.
    pub figures: Figures,
    /// Largest yaw of a joint, rad.
    pub peak_yaw_rad: f64,
    /// Largest moment of a joint over the last six cycles, N·m.
    pub peak_moment_nm: f64,
    /// Largest difference between a joint's yaw and its target, rad.
    pub tracking_error_rad: f64,
}

/// Swims the reference gait with ideal drives for a number of cycles; `None` when that is too
/// short for figures.
pub fn reference_swim(config: &Config, wave: &Wave, cycles: f64) -> Option<Swim> {
    let mut plant = Plant::new(config, 1);
    let steps = (cycles / (wave.frequency_hz * config.step_s)) as usize;
    // Two hundred moments a cycle.
    let every = (0.005 / (wave.frequency_hz * config.step_s)) as usize;
    let (mut peak_yaw, mut peak_moment, mut error): (f64, f64, f64) = (0.0, 0.0, 0.0);
    let mut recording = Recording {
        interval_s: every as f64 * config.step_s,
        moments: Vec::new(),
    };
    for step in 0..=steps {
        if step % every == 0 {
            recording.moments.push(Moment {
                centre: plant.centre_of_mass(),
                tail: plant.tail_edge(),
                energy_j: plant.joint_energy_j(),
            });
        }
        let targets = wave.targets(&config.shape, plant.time_s() + config.step_s);
        plant.step_tracking(&targets, &Tracking::default());
        let settled = plant.time_s() * wave.frequency_hz > cycles - 6.0;
        for (joint, target) in targets.iter().enumerate() {
            let yaw = plant.joint_pose(joint)[0];
            peak_yaw = peak_yaw.max(yaw.abs());
            error = error.max((yaw - target.pose[0]).abs());
            if settled {
                peak_moment = peak_moment.max(Vec3(plant.joint_moment(joint)).norm());
            }
        }
    }
    let stroke = Stroke {
        frequency_hz: wave.frequency_hz,
        wavelength_m: wave.wavelength_lengths * config.shape.length_m,
        length_m: config.shape.length_m,
    };
    let figures = swim_figures(&recording, &stroke)?;
    Some(Swim {
        figures,
        peak_yaw_rad: peak_yaw,
        peak_moment_nm: peak_moment,
        tracking_error_rad: error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_swim_is_an_eels() {
        let swim = reference_swim(&Config::default(), &Wave::default(), 20.0).unwrap();
        println!("{swim:#?}");
        let figures = &swim.figures;
        // Kern & Koumoutsakos; Borazjani & Sotiropoulos; Carling et al.
        assert!((0.26..=0.55).contains(&figures.stride_body_lengths));
        assert!((0.30..=0.50).contains(&figures.strouhal));
        assert!((0.45..=0.77).contains(&figures.slip));
        assert!(figures.unsteadiness < 0.02);
        assert!(swim.tracking_error_rad < 0.005);
    }

    #[test]
    fn the_bare_eel_swims_as_the_prototype_did() {
        let swim = reference_swim(&Config::bare(), &Wave::default(), 20.0).unwrap();
        let near = |found: f64, expected: f64, half_digit: f64| {
            assert!((found - expected).abs() <= half_digit, "{found} {expected}");
        };
        near(swim.figures.speed_m_s, 0.66, 0.005);
        near(swim.figures.stride_body_lengths, 0.44, 0.005);
        near(swim.figures.slip, 0.55, 0.005);
        near(swim.figures.strouhal, 0.40, 0.005);
        near(swim.figures.mean_power_w, 2.0, 0.05);
        near(swim.peak_moment_nm, 2.1, 0.05);
        near(swim.peak_yaw_rad.to_degrees(), 26.6, 0.05);
    }
}
