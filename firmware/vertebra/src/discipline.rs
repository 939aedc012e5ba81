//! The phase-locked loop that keeps the control tick at a fixed time after SYNC.
//!
//! The platform says how old the newest SYNC was when the tick began, and makes each tick by so much
//! longer or shorter as [`Discipline::trim_ns`] says. Two clocks of 50 ppm part by 100 µs a second; held
//! together, a SYNC never comes on the edge between two ticks, so that no target waits for a tick more than
//! another, and all vertebrae act within microseconds of each other.
//!
//! A loop of second order: of an error e at each of the SYNCs, e/8 is worked off until the next one, and the
//! frequency learns e/256 of it per SYNC (damping about 1, 80 ms at 100 Hz). Without SYNC the frequency that
//! was learnt stays.

use eel_units::Duration;

/// How old SYNC is to be when a tick begins: old enough for its jitter, young enough for the target.
pub const SYNC_AGE: Duration = Duration::from_micros(300);
/// Length of a tick, µs.
const TICK_US: i64 = 1_000;
/// Errors are worked off in so many SYNCs.
const WORKED_OFF: i64 = 8;
/// SYNCs over which the frequency learns an error.
const LEARNT: i64 = 256;
/// Ticks between two SYNCs that are believed: 200 Hz to 50 Hz, with one to spare.
const PERIODS: (u16, u16) = (4, 21);
/// Most that the frequency is learnt to be off: 300 ppm, ns per tick in 1/1024.
const MOST_LEARNT: i64 = 300 << 10;
/// Most by which a tick is trimmed: 0.5 %, ns.
const MOST_TRIM: i64 = 5_000;
/// Error below which the loop is locked, less than a frame holds SYNC up, and SYNCs for which it must be.
const LOCKED: i64 = 100;
const LOCKED_SYNCS: u8 = 20;
/// Ticks without SYNC after which it no longer is.
const LOST: u16 = 200;

/// The loop.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Discipline {
    /// By how much SYNC was too old at the last tick with one, µs.
    pub error_us: i16,
    /// Trim that stays, ns per tick in 1/1024.
    learnt: i64,
    /// Trim until the next SYNC, ns per tick in 1/1024.
    working: i64,
    /// Ticks since the last SYNC.
    silence: u16,
    /// SYNCs in a row with a small error.
    near: u8,
}

impl Discipline {
    /// Takes a tick, and the age of a SYNC that came since the tick before.
    pub fn tick(&mut self, age: Option<Duration>) {
        self.silence = self.silence.saturating_add(1);
        let Some(age) = age else {
            if self.silence > PERIODS.1 {
                self.working = 0;
            }
            if self.silence > LOST {
                self.near = 0;
            }
            return;
        };
        let ticks = self.silence;
        self.silence = 0;
        let late = i64::from(age.to_micros().min(TICK_US as u32)) - i64::from(SYNC_AGE.to_micros());
        // A tick earlier or later is nearer than more than half a tick.
        let late = if late > TICK_US / 2 {
            late - TICK_US
        } else {
            late
        };
        self.error_us = late as i16;
        self.near = if late.abs() <= LOCKED {
            self.near.saturating_add(1)
        } else {
            0
        };
        let (least, most) = PERIODS;
        if !(least..=most).contains(&ticks) {
            self.working = 0;
            return;
        }
        // A tick that is late has to come sooner: ns per tick in 1/1024.
        let share = -((late * 1_000) << 10) / i64::from(ticks);
        self.working = share / WORKED_OFF;
        self.learnt = (self.learnt + share / LEARNT).clamp(-MOST_LEARNT, MOST_LEARNT);
    }

    /// Returns by how much the next tick is to be longer, ns.
    pub fn trim_ns(&self) -> i32 {
        let trim = (self.learnt + self.working) >> 10;
        trim.clamp(-MOST_TRIM, MOST_TRIM) as i32
    }

    /// Tells whether ticks keep their time after SYNC.
    pub const fn is_locked(&self) -> bool {
        self.near >= LOCKED_SYNCS
    }
}

#[cfg(test)]
#[expect(clippy::float_arithmetic, reason = "tests only")]
mod tests {
    use super::*;

    /// Lets the loop run for so many ms on a clock that is off by so many ppm, with SYNCs of a period in
    /// ms that come up to `jitter` µs late; returns the errors in µs at every SYNC.
    fn run(
        discipline: &mut Discipline,
        ppm: f64,
        start_us: f64,
        period: u64,
        jitter: f64,
        ms: u64,
    ) -> Vec<f64> {
        let (mut tick_us, mut sync, mut seed) = (start_us, 0_u64, 1_u64);
        let mut errors = Vec::new();
        let mut next_us = 0.0;
        while tick_us < ms as f64 * 1e3 {
            let mut age = None;
            while next_us <= tick_us {
                age = Some(tick_us - next_us);
                errors.push(tick_us - next_us);
                sync += period;
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                next_us = sync as f64 * 1e3 + jitter * (seed >> 40) as f64 / f64::from(1 << 24);
            }
            discipline.tick(age.map(|age| Duration::from_micros(age as u32)));
            tick_us += (1e3 + f64::from(discipline.trim_ns()) / 1e3) * (1.0 + ppm * 1e-6);
        }
        errors
    }

    use std::vec::Vec;

    #[test]
    fn any_clock_and_any_phase_come_to_their_time_after_sync_and_stay() {
        for ppm in [-150.0, -50.0, 0.0, 50.0, 150.0] {
            for start in [0.0, 130.0, 450.0, 799.0, 801.0, 990.0] {
                for period in [5, 10, 20] {
                    let mut discipline = Discipline::default();
                    let errors = run(&mut discipline, ppm, start, period, 0.0, 6_000);
                    let settled = &errors[errors.len() * 3 / 4..];
                    let worst = settled
                        .iter()
                        .map(|age| (age - 300.0).abs())
                        .fold(0.0, f64::max);
                    assert!(
                        worst < 6.0,
                        "{ppm} ppm from {start} µs at {period} ms: {worst} µs"
                    );
                    assert!(discipline.is_locked());
                }
            }
        }
    }

    #[test]
    fn jitter_of_the_bus_is_averaged() {
        let mut discipline = Discipline::default();
        // A frame of another node holds SYNC up by as much as 130 µs.
        let errors = run(&mut discipline, 40.0, 0.0, 10, 130.0, 10_000);
        let settled = &errors[errors.len() / 2..];
        // The ages scatter as the jitter does, and little more.
        let (least, most) = settled
            .iter()
            .fold((f64::MAX, 0.0_f64), |(least, most), age| {
                (least.min(*age), most.max(*age))
            });
        assert!(most - least < 130.0 + 50.0, "{least} to {most} µs");
        assert!(least > 200.0 && most < 400.0, "{least} to {most} µs");
    }

    #[test]
    fn without_sync_the_frequency_that_was_learnt_stays() {
        let mut discipline = Discipline::default();
        run(&mut discipline, 100.0, 500.0, 10, 0.0, 8_000);
        let mut trims = 0.0;
        for _ in 0..1_000 {
            discipline.tick(None);
            trims += f64::from(discipline.trim_ns());
        }
        // 1 s of 1 000 ticks at 100 ppm too slow: −100 µs.
        assert!((trims / 1e3 + 100.0).abs() < 6.0, "{trims} ns");
        assert!(!discipline.is_locked());
    }

    #[test]
    fn nonsense_bends_no_tick_by_more_than_half_a_percent() {
        let mut discipline = Discipline::default();
        for ticks in 0..20_000_u32 {
            let age = ticks.wrapping_mul(2_654_435_761);
            let age = ticks.is_multiple_of(3).then(|| Duration::from_micros(age));
            discipline.tick(age);
            assert!(discipline.trim_ns().abs() <= 5_000);
        }
    }
}
