//! From counts to angle and speed: the zero from the absolute encoder, the motion from the counts.

use eel_units::{Angle, AngularVelocity, saturate};

use crate::settings::Motor;

/// Valid absolute readings averaged before the angle is believed: a quarter of a second.
const ALIGN_SAMPLES: u32 = 256;
/// Largest difference between absolute and counted angle that is still plausible: 20 mrad.
const DISAGREEMENT: i64 = (20 << 29) / 1_000;
/// Absolute angles in a row that part from the counted ones and make a fault; a jump of the count does at once.
const IMPLAUSIBLE_LIMIT: u8 = 5;
/// Invalid absolute readings in a row that make a fault: 50 ms.
const INVALID_LIMIT: u8 = 50;
/// Correction of the speed per tick and position error: ω₀² Δt with ω₀ = 600 rad/s.
const SPEED_GAIN: i64 = 360;
/// Correction of the position per tick: 2 ω₀ Δt in Q16.
const POSITION_GAIN: i64 = 78_643;
/// The largest error that is followed, 512 rad in Q37: the gains have room for it, no crank has.
const FAR: i64 = 1 << 46;
/// One tick in Q24 rad/s → Q29 rad: 2⁵/1000 in Q16.
const TICK: i64 = 2_097;

/// What is wrong with an encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncoderFault {
    /// The absolute encoder gives no valid angle.
    Invalid,
    /// Counts jump, or absolute and counted angle part.
    Implausible,
}

/// One motor's encoder pair.
#[derive(Clone, Copy, Debug)]
pub struct Encoder {
    /// Q29 radians per count in Q16 more.
    scale: i64,
    /// Most counts in one tick.
    step_limit: u32,
    reference_count: i32,
    last_count: i32,
    started: bool,
    align_sum: i64,
    align_count: u32,
    zero: i64,
    /// What the crank's angle was at the last tick.
    angle: Angle,
    implausible: u8,
    invalid: u8,
    observer: Observer,
}

/// A second-order tracking loop that follows the counted angle and knows its speed.
#[derive(Clone, Copy, Debug, Default)]
struct Observer {
    /// Q29 rad with 8 bits more.
    position: i64,
    /// Q24 rad/s.
    speed: i32,
}

impl Encoder {
    /// Makes an encoder that knows nothing yet.
    pub const fn new(motor: &Motor) -> Self {
        let counts = if motor.counts_per_turn == 0 {
            1
        } else {
            motor.counts_per_turn
        } as i64;
        // 2π in Q29 with 16 bits more, shared among the counts of a turn.
        let scale = 221_069_929_750_889 / counts;
        // rad/s × 1 ms in Q29, over the angle of a count, and one count more.
        let tick_angle = (motor.speed_limit.abs().to_q24() as i64 * TICK) >> 16;
        let step = (tick_angle << 16) / if scale > 0 { scale } else { 1 } + 1;
        Self {
            scale,
            step_limit: step as u32,
            reference_count: 0,
            last_count: 0,
            started: false,
            align_sum: 0,
            align_count: 0,
            zero: 0,
            angle: Angle::ZERO,
            implausible: 0,
            invalid: 0,
            observer: Observer {
                position: 0,
                speed: 0,
            },
        }
    }

    /// Returns the angle of so many counts.
    pub const fn angle_of(motor: &Motor, counts: i32) -> Angle {
        let turned = (counts as i64).wrapping_mul(Self::new(motor).scale) >> 16;
        Angle::from_q29(saturate(turned))
    }

    /// Takes the readings of one tick.
    ///
    /// # Errors
    /// [`EncoderFault`] once readings have been bad for too long; the angle then stands for
    /// nothing.
    pub fn update(&mut self, count: i32, absolute: Option<Angle>) -> Result<(), EncoderFault> {
        if !self.started {
            self.started = true;
            self.reference_count = count;
            self.last_count = count;
        }
        let jumped = count.wrapping_sub(self.last_count).unsigned_abs() > self.step_limit;
        self.last_count = count;
        let counted = self.count();
        self.angle = Angle::from_q29(saturate(self.zero + counted));
        if !self.is_aligned() {
            return self.align(counted, absolute, jumped);
        }
        self.observer.follow(self.zero + counted);
        let parted = match absolute {
            Some(angle) => {
                self.invalid = 0;
                let error = i64::from(angle.to_q29()) - (self.zero + counted);
                error.abs() > DISAGREEMENT
            }
            None => {
                self.invalid = self.invalid.saturating_add(1);
                false
            }
        };
        if jumped {
            // The angle is wrong from now on: no reading will mend it.
            self.implausible = IMPLAUSIBLE_LIMIT;
        } else if parted {
            self.implausible = self.implausible.saturating_add(1);
        } else if self.implausible < IMPLAUSIBLE_LIMIT {
            self.implausible = 0;
        }
        self.verdict()
    }

    /// Tells whether the angle is known.
    pub const fn is_aligned(&self) -> bool {
        self.align_count >= ALIGN_SAMPLES
    }

    /// Returns the crank's angle; wrong by a count (71 µrad) and by the absolute encoder's mean
    /// error.
    pub const fn angle(&self) -> Angle {
        self.angle
    }

    /// Returns the crank's speed, low-passed at 600 rad/s.
    pub fn speed(&self) -> AngularVelocity {
        AngularVelocity::from_q24(self.observer.speed)
    }

    /// Averages the absolute angle at no motion; any doubt starts the average again.
    fn align(
        &mut self,
        counted: i64,
        absolute: Option<Angle>,
        jumped: bool,
    ) -> Result<(), EncoderFault> {
        let Some(angle) = absolute else {
            self.restart_alignment();
            self.invalid = self.invalid.saturating_add(1);
            return self.verdict();
        };
        self.invalid = 0;
        let zero = i64::from(angle.to_q29()) - counted;
        let mean = self.align_sum / i64::from(self.align_count.max(1));
        if jumped || (self.align_count > 0 && (zero - mean).abs() > DISAGREEMENT) {
            self.restart_alignment();
        }
        self.align_sum += zero;
        self.align_count += 1;
        if self.is_aligned() {
            self.zero = self.align_sum / i64::from(ALIGN_SAMPLES);
            self.angle = Angle::from_q29(saturate(self.zero + counted));
            self.observer = Observer {
                position: (self.zero + counted) << 8,
                speed: 0,
            };
        }
        Ok(())
    }

    fn restart_alignment(&mut self) {
        self.align_sum = 0;
        self.align_count = 0;
    }

    /// Returns the angle counted since the first reading, Q29.
    fn count(&self) -> i64 {
        let counts = i64::from(self.last_count.wrapping_sub(self.reference_count));
        (counts.wrapping_mul(self.scale)) >> 16
    }

    fn verdict(&self) -> Result<(), EncoderFault> {
        if self.implausible >= IMPLAUSIBLE_LIMIT {
            Err(EncoderFault::Implausible)
        } else if self.invalid >= INVALID_LIMIT {
            Err(EncoderFault::Invalid)
        } else {
            Ok(())
        }
    }
}

impl Observer {
    /// Advances by one tick towards the measured `angle`, Q29.
    fn follow(&mut self, angle: i64) {
        let predicted = self
            .position
            .saturating_add((i64::from(self.speed) * TICK) >> 8);
        let error = (angle << 8).saturating_sub(predicted).clamp(-FAR, FAR);
        self.position = predicted.saturating_add((error * POSITION_GAIN) >> 16);
        // Q37 rad × 1/s is Q37 rad/s; the speed is Q24.
        let change = (error * SPEED_GAIN) >> 13;
        // The change is below 2⁴².
        self.speed = saturate(i64::from(self.speed) + change);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: f64 = core::f64::consts::TAU / 88_064.0;

    /// Feeds an aligned encoder with a crank that stands at 0.3 rad, its counter at 7000.
    fn aligned() -> Encoder {
        let mut encoder = Encoder::new(&Motor::PROTOTYPE);
        for _ in 0..ALIGN_SAMPLES {
            assert!(!encoder.is_aligned());
            encoder
                .update(7_000, Some(Angle::from_milliradians(300)))
                .unwrap();
        }
        assert!(encoder.is_aligned());
        encoder
    }

    #[expect(clippy::float_arithmetic, reason = "tests only")]
    fn radians(angle: Angle) -> f64 {
        f64::from(angle.to_q29()) / f64::from(1 << 29)
    }

    #[test]
    fn takes_its_zero_from_the_absolute_encoder_and_its_motion_from_the_counts() {
        let mut encoder = aligned();
        for step in 1..=100 {
            let angle = 0.3 + f64::from(step * 10) * COUNT;
            let absolute = Angle::from_milliradians((angle * 1e3) as i32);
            encoder.update(7_000 + step * 10, Some(absolute)).unwrap();
            assert!((radians(encoder.angle()) - angle).abs() < 1e-7);
        }
    }

    #[test]
    fn finds_the_speed_of_steady_motion() {
        let mut encoder = aligned();
        let mut fine = 7_000.0_f64;
        for _ in 0..200 {
            fine += 3.0 * 1e-3 / COUNT;
            encoder.update(fine as i32, None).ok();
        }
        let speed = f64::from(encoder.speed().to_q24()) / f64::from(1 << 24);
        assert!((speed - 3.0).abs() < 0.02, "{speed}");
    }

    #[test]
    fn survives_the_wrap_of_the_counter() {
        let mut encoder = Encoder::new(&Motor::PROTOTYPE);
        for _ in 0..ALIGN_SAMPLES {
            encoder.update(i32::MAX - 2, Some(Angle::ZERO)).unwrap();
        }
        encoder.update(i32::MIN + 2, Some(Angle::ZERO)).unwrap();
        assert!((radians(encoder.angle()) - 5.0 * COUNT).abs() < 1e-8);
    }

    #[test]
    fn reports_a_jump_of_the_count_at_once_and_for_good() {
        let mut encoder = aligned();
        let there = Some(Angle::from_milliradians(300));
        for count in [7_600, 7_600, 7_000] {
            let verdict = encoder.update(count, there);
            assert_eq!(verdict, Err(EncoderFault::Implausible), "{count}");
        }
    }

    #[test]
    fn reports_an_absolute_angle_only_when_it_stays_elsewhere() {
        let mut encoder = aligned();
        let there = Some(Angle::from_milliradians(300));
        let elsewhere = Some(Angle::from_milliradians(330));
        for angle in [elsewhere, elsewhere, elsewhere, elsewhere, there] {
            assert_eq!(encoder.update(7_000, angle), Ok(()));
        }
        for _ in 0..4 {
            assert_eq!(encoder.update(7_000, elsewhere), Ok(()));
        }
        let verdict = encoder.update(7_000, elsewhere);
        assert_eq!(verdict, Err(EncoderFault::Implausible));
    }

    #[test]
    fn reports_an_absolute_encoder_that_falls_silent() {
        let mut encoder = aligned();
        let verdicts = (0..50).map(|_| encoder.update(7_000, None));
        assert_eq!(verdicts.last(), Some(Err(EncoderFault::Invalid)));
    }

    #[test]
    fn any_readings_leave_it_standing() {
        let mut encoder = aligned();
        let mut state = 0x9E37_79B9_u64;
        for _ in 0..10_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let count = (state >> 32) as i32;
            encoder
                .update(count, Some(Angle::from_q29(state as i32)))
                .ok();
            let _ = (encoder.angle(), encoder.speed());
        }
    }
}
