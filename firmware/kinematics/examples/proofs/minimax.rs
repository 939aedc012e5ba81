//! How far the polynomials of the firmware are from the functions: bounded, not sampled.
//!
//! A polynomial less a function's series is a polynomial of small coefficients, but for the rest of the
//! series, which alternates and falls, so that it is below its first term left out. Between the points of
//! a grid a function is within h²/8 times its second derivative of the chord.

use crate::coefficients::COEFFICIENTS;

/// Terms of a series.
const TERMS: usize = 28;
/// Points of the grid.
const POINTS: usize = 50_000;
/// For the roundings of `f64` here: sums of numbers below 4 whose errors stay below 1e-14.
const ROUNDING: f64 = 1e-14;

/// Bounds |sin a − a P(a²)| for |a| ≤ 1.
pub fn sine() -> f64 {
    let series = |k: usize| sign(k) / factorial(2 * k + 1);
    bound(&values(COEFFICIENTS.sine, 31, 1.0), series, 1, 1.0)
}

/// Bounds |cos a − 1 − a² C(a²)| for |a| ≤ 1.
pub fn cosine() -> f64 {
    let series = |k: usize| -sign(k) / factorial(2 * k + 2);
    bound(&values(COEFFICIENTS.cosine, 32, 1.0), series, 2, 1.0)
}

/// Bounds |atan t − t P((2t)²)| for |t| ≤ 17/32.
pub fn arctangent() -> f64 {
    let series = |k: usize| sign(k) / (2 * k + 1) as f64;
    let side = crate::stages::primitives::TANGENT;
    bound(&values(COEFFICIENTS.arctangent, 31, 4.0), series, 1, side)
}

fn sign(k: usize) -> f64 {
    if k.is_multiple_of(2) { 1.0 } else { -1.0 }
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|k| k as f64).product()
}

/// Returns the coefficients of powers of a², when the table's are of powers of `scale` a².
fn values<const N: usize>(integers: [i32; N], first: i32, scale: f64) -> Vec<f64> {
    let value = |(k, &integer): (usize, &i32)| {
        f64::from(integer) * 0.5f64.powi(first + 2 * k as i32) * scale.powi(k as i32)
    };
    integers.iter().enumerate().map(value).collect()
}

/// Bounds |Σ (cₖ − sₖ) xᵖ⁺²ᵏ| on 0..side.
fn bound(coefficients: &[f64], series: impl Fn(usize) -> f64, power: usize, side: f64) -> f64 {
    let differences: Vec<f64> = (0..TERMS)
        .map(|k| coefficients.get(k).copied().unwrap_or(0.0) - series(k))
        .collect();
    let terms = || differences.iter().enumerate();
    let evaluate = |x: f64| {
        let sum = differences.iter().rev().fold(0.0, |sum, c| sum * x * x + c);
        sum * x.powi(power as i32)
    };
    let step = side / POINTS as f64;
    let largest = (0..=POINTS)
        .map(|k| evaluate(k as f64 * step).abs())
        .fold(0.0, f64::max);
    // The second derivative's terms are largest at the end.
    let curvature: f64 = terms()
        .map(|(k, c)| {
            let n = power + 2 * k;
            (n * (n - 1)) as f64 * c.abs() * side.powi(n as i32 - 2)
        })
        .sum();
    let rest = series(TERMS).abs() * side.powi((power + 2 * TERMS) as i32);
    largest + curvature * step * step / 8.0 + rest + ROUNDING
}
