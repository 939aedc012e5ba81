//! The travelling wave of the body as joint angles.
//!
//! The midline follows y(s, t) = A e^{2.2 (s/L − 1)} sin 2π(s/λ − f t) (anguilliform swimming,
//! Carling et al. 1998; the envelope after Kern & Koumoutsakos 2006). A body between two joints
//! points along the chord of that curve; a vertebra turns by the difference of its neighbours.

use eel_kinematics::Pose;
use eel_protocol::VERTEBRAE;
use eel_units::{Angle, root_q30, saturate};

/// Joints of the eel.
const JOINTS: usize = VERTEBRAE as usize;
/// Nose, joints, tail edge.
const STATIONS: usize = JOINTS + 2;
/// Place of each station along the body in Q30 body lengths: nose, 0.30 m … 1.20 m of 1.5 m, tail.
const PLACES: [i64; STATIONS] = places();
/// e^{2.2 (s/L − 1)} at each station in Q30.
const ENVELOPE: [i64; STATIONS] = [
    118_973_985,
    184_731_766,
    213_913_457,
    247_704_918,
    286_834_346,
    332_144_968,
    384_613_215,
    445_369_760,
    515_723_890,
    597_191_715,
    691_528_841,
    1_073_741_824,
];
/// One over the length of each body in body lengths: 0.2, nine times 1/15, 0.2.
const PER_LENGTH: [i64; JOINTS + 1] = [5, 15, 15, 15, 15, 15, 15, 15, 15, 15, 5];
/// Steepest slope that a body is laid along, in Q30: 72°.
const STEEPEST: i64 = (95 << 30) / 100;
/// Ten-thousandths, the unit of a gait's lengths.
const TEN_THOUSANDTHS: i64 = 10_000;
/// Most amplitude, shortest and longest wave, and fastest wave of a gait.
const MOST_AMPLITUDE: u16 = 2_000;
const WAVELENGTHS: core::ops::RangeInclusive<u16> = 2_000..=30_000;
const FASTEST_MILLIHERTZ: u32 = 3_000;

/// The plane in which the body waves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// Left and right, by yaw.
    Lateral,
    /// Up and down, by pitch.
    Vertical,
}

/// A travelling wave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gait {
    frequency_mhz: u32,
    amplitude: u16,
    wavelength: u16,
    plane: Plane,
}

/// Why a wave is not a gait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GaitError {
    /// The frequency is not within 1–3000 mHz.
    Frequency,
    /// The amplitude is above 0.2 body lengths.
    Amplitude,
    /// The wavelength is not within 0.2–3 body lengths.
    Wavelength,
}

/// Computes the stations while compiling.
const fn places() -> [i64; STATIONS] {
    let mut places = [0; STATIONS];
    let mut joint = 0;
    while joint < JOINTS {
        places[joint + 1] = ((3 + joint as i64) << 30) / 15;
        joint += 1;
    }
    places[STATIONS - 1] = 1 << 30;
    places
}

impl Gait {
    /// The default: 1 Hz, tail amplitude 0.08 body lengths, wavelength 0.8 body lengths, lateral.
    pub const SWIM: Self = Self {
        frequency_mhz: 1_000,
        amplitude: 800,
        wavelength: 8_000,
        plane: Plane::Lateral,
    };

    /// Makes a gait from its frequency in mHz, and from the amplitude of the tail edge and the
    /// length of the wave in 10⁻⁴ body lengths.
    ///
    /// # Errors
    /// The [`GaitError`] that names the number out of range.
    pub fn new(
        frequency_mhz: u32,
        amplitude: u16,
        wavelength: u16,
        plane: Plane,
    ) -> Result<Self, GaitError> {
        if frequency_mhz == 0 || frequency_mhz > FASTEST_MILLIHERTZ {
            Err(GaitError::Frequency)
        } else if amplitude > MOST_AMPLITUDE {
            Err(GaitError::Amplitude)
        } else if !WAVELENGTHS.contains(&wavelength) {
            Err(GaitError::Wavelength)
        } else {
            Ok(Self {
                frequency_mhz,
                amplitude,
                wavelength,
                plane,
            })
        }
    }

    /// Returns the length of a cycle in µs.
    pub const fn period_us(&self) -> u32 {
        1_000_000_000
            / if self.frequency_mhz == 0 {
                1
            } else {
                self.frequency_mhz
            }
    }

    /// Returns the poses `elapsed_us` after the wave began, its amplitude scaled by `share` in
    /// Q15.
    pub fn poses(&self, elapsed_us: u64, share: i64) -> [Pose; JOINTS] {
        let scale = share.clamp(0, 1 << 15);
        let amplitude = ((i64::from(self.amplitude) << 30) / TEN_THOUSANDTHS * scale) >> 15;
        let mut directions = [Angle::ZERO; JOINTS + 1];
        let mut before = self.offset(0, elapsed_us, amplitude);
        for (body, direction) in directions.iter_mut().enumerate() {
            let after = self.offset(body + 1, elapsed_us, amplitude);
            let per_length = PER_LENGTH.get(body).copied().unwrap_or_default();
            *direction = -arcsine((after - before) * per_length);
            before = after;
        }
        let mut poses = [Pose::default(); JOINTS];
        for (pose, pair) in poses.iter_mut().zip(directions.windows(2)) {
            let &[front, back] = pair else { continue };
            match self.plane {
                Plane::Lateral => pose.yaw = back - front,
                // Pitch turns z towards x, yaw turns it away from y.
                Plane::Vertical => pose.pitch = front - back,
            }
        }
        poses
    }

    /// Returns the midline's offset at a station in Q30 body lengths.
    fn offset(&self, station: usize, elapsed_us: u64, amplitude: i64) -> i64 {
        let place = PLACES.get(station).copied().unwrap_or_default();
        let envelope = ENVELOPE.get(station).copied().unwrap_or_default();
        // Turns in Q32; whole turns fall out at the top.
        let along = (place * TEN_THOUSANDTHS / i64::from(self.wavelength.max(1))) << 2;
        let phase = (along as u64).wrapping_sub(self.cycles(elapsed_us)) as u32;
        // Half turns in Q31 times π in Q29.
        let angle = (i64::from(phase as i32) * i64::from(Angle::PI.to_q29())) >> 31;
        let (sine, _) = Angle::from_q29(saturate(angle)).sin_cos();
        let local = (amplitude * envelope) >> 30;
        (local * i64::from(sine)) >> 30
    }

    /// Returns the cycles since the wave began, in Q32, without the whole ones.
    fn cycles(&self, elapsed_us: u64) -> u64 {
        const MILLI_MICRO: u64 = 1_000_000_000;
        let within = elapsed_us.wrapping_mul(u64::from(self.frequency_mhz)) % MILLI_MICRO;
        (within << 32) / MILLI_MICRO
    }
}

/// Returns the arcsine of a Q30 number, which is held to ±0.95.
fn arcsine(sine: i64) -> Angle {
    let sine = sine.clamp(-STEEPEST, STEEPEST);
    let cosine = root_q30(((1 << 30) - ((sine * sine) >> 30)) as u32);
    Angle::from_sides(saturate(sine), cosine)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_arithmetic, reason = "the oracle is the formula in f64")]

    use super::*;
    use core::f64::consts::TAU;

    /// The module's formula, word by word.
    fn oracle(f: f64, a: f64, wavelength: f64, t: f64) -> [f64; JOINTS] {
        let place = |station: usize| match station {
            0 => 0.0,
            11 => 1.0,
            joint => (0.3 + 0.1 * (joint as f64 - 1.0)) / 1.5,
        };
        let offset = |station: usize| {
            let s = place(station);
            let phase = TAU * (s / wavelength - f * t);
            a * libm::exp(2.2 * (s - 1.0)) * libm::sin(phase)
        };
        let direction = |body: usize| {
            let slope = (offset(body + 1) - offset(body)) / (place(body + 1) - place(body));
            -libm::asin(slope)
        };
        core::array::from_fn(|joint| direction(joint + 1) - direction(joint))
    }

    #[test]
    fn agrees_with_the_formula() {
        let gait = Gait::new(1_250, 700, 9_000, Plane::Lateral).unwrap();
        for step in 0..200_u64 {
            let micros = step * 37_123;
            let poses = gait.poses(micros, 1 << 15);
            let expected = oracle(1.25, 0.07, 0.9, micros as f64 / 1e6);
            for (pose, expected) in poses.iter().zip(expected) {
                let yaw = f64::from(pose.yaw.to_q29()) / f64::from(1 << 29);
                assert!(
                    (yaw - expected).abs() < 2e-7,
                    "{step}: {yaw} against {expected}"
                );
                assert_eq!((pose.pitch, pose.roll), (Angle::ZERO, Angle::ZERO));
            }
        }
    }

    #[test]
    fn goes_on_without_a_seam_for_weeks() {
        let gait = Gait::SWIM;
        let week = 7 * 24 * 3_600 * 1_000_000_u64;
        assert_eq!(
            gait.poses(week + 250_000, 1 << 15),
            gait.poses(250_000, 1 << 15)
        );
    }

    #[test]
    fn the_default_stays_inside_the_workspace() {
        let limit = Angle::from_tenth_milliradians(5_236);
        for micros in (0..1_000_000).step_by(1_000) {
            for pose in Gait::SWIM.poses(micros, 1 << 15) {
                assert!(pose.yaw.abs() < limit, "{micros}: {pose:?}");
            }
        }
    }

    #[test]
    fn refuses_what_is_no_gait() {
        let make = |f, a, w| Gait::new(f, a, w, Plane::Vertical).err();
        assert_eq!(make(0, 800, 8_000), Some(GaitError::Frequency));
        assert_eq!(make(3_001, 800, 8_000), Some(GaitError::Frequency));
        assert_eq!(make(1_000, 2_001, 8_000), Some(GaitError::Amplitude));
        assert_eq!(make(1_000, 800, 1_999), Some(GaitError::Wavelength));
        assert_eq!(make(3_000, 2_000, 30_000), None);
    }
}
