//! The reference gait in f64, for runs of the plant alone.
//!
//! The robot's own gait is the head's, in fixed point; this one is what figures of the plant are
//! compared by: y = A e^{2.2 (s/L − 1)} sin 2π (s/λ − f t), turned into joint angles.

use std::f64::consts::TAU;

use super::body::{BODIES, JOINTS};
use super::config::Shape;
use super::joint::Target;

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
