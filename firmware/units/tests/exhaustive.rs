//! Every single input of every primitive of one number, against double precision.
//!
//! `cargo xtask exhaustive` runs it, on all processors and in release; `cargo test` leaves it out but for
//! the check of its oracle. The quotient has two numbers, 2⁶⁰ pairs: here every divisor of the range
//! meets four numbers, `primitives.rs` draws both.

#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

use std::ops::{Range, RangeInclusive};
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Instant;

use eel_units::{
    Angle, angle_over_sine, arctangents, ratio_q30, root_near, root_q30, sin_cos_near,
};

const Q29: f64 = (1u64 << 29) as f64;
const Q30: f64 = (1u64 << 30) as f64;
const Q31: f64 = (1u64 << 31) as f64;

/// How many neighbouring inputs share one call of a function of `libm`.
const BLOCK: usize = 64;
/// How many inputs a thread takes at a time: a multiple of the block.
const PORTION: i64 = 1 << 20;

/// Sines and cosines of neighbouring angles by the addition theorem, wrong by some parts in 10¹⁶.
struct Turns([(f64, f64); BLOCK]);

impl Turns {
    /// For angles that are steps of Q29.
    fn new() -> Self {
        Self(std::array::from_fn(|k| {
            let angle = k as f64 / Q29;
            (libm::sin(angle), libm::cos(angle))
        }))
    }

    /// Returns sines and cosines from the angle `first` on.
    fn from(&self, first: i64) -> [(f64, f64); BLOCK] {
        let angle = first as f64 / Q29;
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        self.0
            .map(|(s, c)| (sine * c + cosine * s, cosine * c - sine * s))
    }
}

/// Returns the arctangents of neighbouring tangents in Q31, from `first` on.
///
/// atan(t + d) = atan t + atan(d / (1 + t (t + d))), where the last one is so small that it is its own
/// tangent.
fn arctangents_from(first: i64) -> [f64; BLOCK] {
    let start = first as f64 / Q31;
    let angle = libm::atan(start);
    std::array::from_fn(|k| {
        let more = k as f64 / Q31;
        angle + more / (1.0 + start * (start + more))
    })
}

/// Returns the largest errors over a range of inputs, which all processors share; prints its name, how
/// many inputs it has and what it took.
fn worst<const N: usize>(
    name: &str,
    inputs: RangeInclusive<i64>,
    errors: impl Fn(Range<i64>) -> [f64; N] + Sync,
) -> [f64; N] {
    let begun = Instant::now();
    let (first, end) = (*inputs.start(), *inputs.end() + 1);
    let next = AtomicI64::new(first);
    let take = || {
        let mut worst = [0.0; N];
        loop {
            let start = next.fetch_add(PORTION, Ordering::Relaxed);
            if start >= end {
                return worst;
            }
            merge(&mut worst, errors(start..end.min(start + PORTION)));
        }
    };
    let mut all = [0.0; N];
    std::thread::scope(|scope| {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(take)).collect();
        for thread in threads {
            merge(&mut all, thread.join().expect("a thread"));
        }
    });
    let found: Vec<_> = all.iter().map(|error| format!("{error:.3e}")).collect();
    println!(
        "{name}: {} inputs, worst {}, {:.1} s",
        end - first,
        found.join(" and "),
        begun.elapsed().as_secs_f64()
    );
    all
}

fn merge<const N: usize>(worst: &mut [f64; N], errors: [f64; N]) {
    for (worst, error) in worst.iter_mut().zip(errors) {
        *worst = worst.max(error);
    }
}

/// Returns the blocks of a range: the first input and how many there are.
fn blocks(inputs: Range<i64>) -> impl Iterator<Item = (i64, usize)> {
    let end = inputs.end;
    inputs
        .step_by(BLOCK)
        .map(move |first| (first, BLOCK.min((end - first) as usize)))
}

/// The largest errors of a function that makes sine and cosine.
fn sine_cosine(turns: &Turns, inputs: Range<i64>, made: impl Fn(Angle) -> (i32, i32)) -> [f64; 2] {
    let mut worst = [0.0f64; 2];
    for (first, count) in blocks(inputs) {
        for (raw, exact) in (first..).zip(turns.from(first)).take(count) {
            let (sine, cosine) = made(Angle::from_q29(raw as i32));
            merge(
                &mut worst,
                [
                    (f64::from(sine) / Q30 - exact.0).abs(),
                    (f64::from(cosine) / Q30 - exact.1).abs(),
                ],
            );
        }
    }
    worst
}

#[test]
fn the_oracle_of_neighbours_is_exact() {
    let turns = Turns::new();
    for first in (-(1i64 << 31)..(1 << 31) - 64).step_by(99_999_989) {
        for (raw, (sine, cosine)) in (first..).zip(turns.from(first)) {
            let angle = raw as f64 / Q29;
            assert!((sine - libm::sin(angle)).abs() < 5e-16, "{raw}");
            assert!((cosine - libm::cos(angle)).abs() < 5e-16, "{raw}");
        }
        for (raw, angle) in (first..).zip(arctangents_from(first)) {
            assert!(
                (angle - libm::atan(raw as f64 / Q31)).abs() < 5e-16,
                "{raw}"
            );
        }
    }
}

#[test]
#[ignore = "every input: cargo xtask exhaustive"]
fn near_sine_and_cosine() {
    let turns = Turns::new();
    let limit = 1i64 << 29;
    let errors = worst(
        "sine, cosine, −1 ≤ a < 1 rad",
        -limit..=limit - 1,
        |inputs| {
            sine_cosine(&turns, inputs, |angle| {
                let [pair] = sin_cos_near([angle]);
                assert!(pair.1 < 1 << 30, "{angle:?}");
                pair
            })
        },
    );
    assert!(errors.iter().all(|error| *error <= 2.8e-9), "{errors:?}");
}

#[test]
#[ignore = "every input: cargo xtask exhaustive"]
fn sine_and_cosine_of_every_angle() {
    let turns = Turns::new();
    let all = i64::from(i32::MIN)..=i64::from(i32::MAX);
    let errors = worst("sine, cosine, every angle", all, |inputs| {
        sine_cosine(&turns, inputs, Angle::sin_cos)
    });
    assert!(errors.iter().all(|error| *error <= 3e-9), "{errors:?}");
}

#[test]
#[ignore = "every input: cargo xtask exhaustive"]
fn arctangent() {
    let limit = 17i64 << 26;
    let [error] = worst("arctangent, |t| ≤ 17/32", -limit..=limit, |inputs| {
        let mut worst = 0.0f64;
        for (first, count) in blocks(inputs) {
            for (raw, exact) in (first..).zip(arctangents_from(first)).take(count) {
                let [found] = arctangents([raw as i32]);
                worst = worst.max((f64::from(found) / Q30 - exact).abs());
            }
        }
        [worst]
    });
    assert!(error <= 1.4e-9, "{error:e}");
}

#[test]
#[ignore = "every input: cargo xtask exhaustive"]
fn near_root() {
    let error = |raw: i64| {
        let found = f64::from(root_near(raw as i32)) / Q30;
        (found - (raw as f64 / Q31).sqrt()).abs()
    };
    let largest = |inputs: Range<i64>| [inputs.map(error).fold(0.0, f64::max)];
    let [small] = worst("near root, 1/32 to 1/8", 1 << 26..=(1 << 28) - 1, largest);
    let [large] = worst("near root, 1/8 to 0.55", 1 << 28..=1_181_116_006, largest);
    assert!(small <= 2e-9 && large <= 1.2e-9, "{small:e} {large:e}");
}

#[test]
#[ignore = "every input: cargo xtask exhaustive"]
fn root() {
    let all = 1..=i64::from(u32::MAX);
    let [error] = worst("root, beyond one step, of itself", all, |inputs| {
        let error = |raw: i64| {
            let exact = (raw as f64 * Q30).sqrt();
            ((f64::from(root_q30(raw as u32)) - exact).abs() - 1.0) / exact
        };
        [inputs.map(error).fold(0.0, f64::max)]
    });
    assert!(error <= 4e-9, "{error:e}");
}

/// The largest error of ratios by one divisor.
fn ratio_error(divisor: i64) -> f64 {
    let divisor = divisor as i32;
    // As odd a number as the divisor, and different for each.
    let odd = ((i64::from(divisor) * 0x5DEE_CE66) & 0x7FFF_FFFF) as i32 % divisor;
    let numbers = [divisor, odd, -odd, (odd >> 7) - divisor];
    let exact = 1.0 / f64::from(divisor);
    let errors = numbers.map(|number| {
        (f64::from(ratio_q30(number, divisor)) / Q30 - f64::from(number) * exact).abs()
    });
    errors.into_iter().fold(0.0, f64::max)
}

#[test]
#[ignore = "every divisor: cargo xtask exhaustive"]
fn ratio_by_every_divisor() {
    let largest = |inputs: Range<i64>| [inputs.map(ratio_error).fold(0.0, f64::max)];
    let [small] = worst("ratio, divisor below 2²⁹", 1 << 28..=(1 << 29) - 1, largest);
    let all = 1 << 29..=i64::from(i32::MAX);
    let [large] = worst("ratio, divisor from 2²⁹ on", all, largest);
    assert!(small <= 15e-9 && large <= 3.8e-9, "{small:e} {large:e}");
}

#[test]
#[ignore = "every input: cargo xtask exhaustive"]
fn the_angle_over_its_sine() {
    let [error] = worst("angle over sine, relative", 0..=(1 << 30) - 1, |inputs| {
        let error = |raw: i64| {
            let cosine = raw as f64 / Q30;
            // The sine without cancellation.
            let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
            let exact = libm::acos(cosine) / sine;
            (f64::from(angle_over_sine(raw as i32)) / Q29 / exact - 1.0).abs()
        };
        [inputs.map(error).fold(0.0, f64::max)]
    });
    assert!(error <= 4e-6, "{error:e}");
}
