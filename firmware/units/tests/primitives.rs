//! Every primitive against `libm` in double precision, over its whole range.
//!
//! Here every so many inputs; `exhaustive.rs` takes every single one.

#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

use eel_units::{
    Angle, angle_over_sine, arctangents, multiply_high, multiply_high_add, quotient_q30, ratio_q30,
    root_near, root_q30, sin_cos_near,
};

const Q29: f64 = (1u64 << 29) as f64;
const Q30: f64 = (1u64 << 30) as f64;
const Q31: f64 = (1u64 << 31) as f64;

/// A small generator, so that a failing input can be made again from the printed seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    fn bits(&mut self) -> i32 {
        (self.next() >> 32) as i32
    }
}

/// The largest error of sine or cosine, over every `step`th angle within ±1 rad.
fn worst_sin_cos_near(step: usize) -> f64 {
    let limit = (1 << 29) - 1;
    let mut worst = 0.0f64;
    for raw in (-limit - 1..=limit).step_by(step) {
        let angle = f64::from(raw) / Q29;
        let [(sine, cosine)] = sin_cos_near([Angle::from_q29(raw)]);
        worst = worst.max((f64::from(sine) / Q30 - libm::sin(angle)).abs());
        worst = worst.max((f64::from(cosine) / Q30 - libm::cos(angle)).abs());
        assert!(cosine < 1 << 30, "{raw}");
    }
    worst
}

/// The largest error of an arctangent, over every `step`th tangent within ±17/32.
fn worst_arctangent(step: usize) -> f64 {
    let limit = 17 << 26;
    let mut worst = 0.0f64;
    for raw in (-limit..=limit).step_by(step) {
        let [found] = arctangents([raw]);
        let error = f64::from(found) / Q30 - libm::atan(f64::from(raw) / Q31);
        worst = worst.max(error.abs());
    }
    worst
}

/// The largest errors of a near root: from 1/32 to 1/8, and from 1/8 to 0.55.
fn worst_root_near(step: usize) -> [f64; 2] {
    let mut worst = [0.0f64; 2];
    for raw in (1 << 26..=1_181_116_006).step_by(step) {
        let error = f64::from(root_near(raw)) / Q30 - libm::sqrt(f64::from(raw) / Q31);
        let worst = &mut worst[usize::from(raw >= 1 << 28)];
        *worst = worst.max(error.abs());
    }
    worst
}

/// The largest error of a root in parts of itself and, where that is less, in steps.
fn worst_root(step: usize) -> f64 {
    let mut worst = 0.0f64;
    for raw in (1..=u32::MAX).step_by(step) {
        let exact = libm::sqrt(f64::from(raw) * Q30);
        let error = (f64::from(root_q30(raw)) - exact).abs();
        worst = worst.max((error - 1.0).max(0.0) / exact);
    }
    worst
}

/// The largest errors of ratios over every `step`th divisor: below 2²⁹, and from there on.
fn worst_ratio(step: usize) -> [f64; 2] {
    let mut worst = [0.0f64; 2];
    for divisor in (1 << 28..=i32::MAX).step_by(step) {
        // As many numbers as the bits of the divisor spread: its whole, parts of it, odd ones.
        for number in [
            divisor,
            divisor / 2,
            divisor / 3,
            (divisor >> 7).wrapping_mul(37) % divisor,
            // Where the digits err most: what the leading bits divide.
            (divisor >> 15) << 15,
        ] {
            let number = if divisor & 2 == 0 { number } else { -number };
            let error = f64::from(ratio_q30(number, divisor)) / Q30
                - f64::from(number) / f64::from(divisor);
            let worst = &mut worst[usize::from(divisor >= 1 << 29)];
            *worst = worst.max(error.abs());
        }
    }
    worst
}

#[test]
fn sine_and_cosine_are_wrong_by_at_most_three_parts_in_a_billion() {
    let worst = worst_sin_cos_near(97);
    println!("sine and cosine, |a| ≤ 1 rad: {worst:.2e}");
    assert!(worst <= 2.8e-9, "{worst:e}");
}

#[test]
fn sine_and_cosine_take_every_angle() {
    let mut worst = 0.0f64;
    for raw in (i32::MIN..=i32::MAX).step_by(1_009) {
        let angle = f64::from(raw) / Q29;
        let (sine, cosine) = Angle::from_q29(raw).sin_cos();
        worst = worst.max((f64::from(sine) / Q30 - libm::sin(angle)).abs());
        worst = worst.max((f64::from(cosine) / Q30 - libm::cos(angle)).abs());
    }
    println!("sine and cosine, every angle: {worst:.2e}");
    assert!(worst <= 3e-9, "{worst:e}");
}

#[test]
fn the_arctangent_is_wrong_by_at_most_one_and_a_half_parts_in_a_billion() {
    let worst = worst_arctangent(97);
    println!("arctangent, |t| ≤ 17/32: {worst:.2e} rad");
    assert!(worst <= 1.4e-9, "{worst:e}");
    // Beyond the range: no more than a wrong answer.
    let _ = arctangents([i32::MIN, i32::MIN + 1, i32::MAX]);
}

#[test]
fn the_near_root_is_wrong_by_at_most_two_parts_in_a_billion() {
    let [small, large] = worst_root_near(211);
    println!("near root: {small:.2e} below an eighth, {large:.2e} above");
    assert!(small <= 2e-9 && large <= 1.2e-9, "{small:e} {large:e}");
    for raw in [i32::MIN, -1, 0, 1, i32::MAX] {
        let _ = root_near(raw);
    }
}

#[test]
fn the_root_is_wrong_by_at_most_four_parts_in_a_billion_and_a_step() {
    let worst = worst_root(211);
    println!("root: {worst:.2e} of itself and a step");
    assert!(worst <= 4e-9, "{worst:e}");
    for raw in [0, 1, 2, 3, 4, 1 << 30, u32::MAX - 1, u32::MAX] {
        let exact = libm::sqrt(f64::from(raw) * Q30);
        let error = (f64::from(root_q30(raw)) - exact).abs();
        assert!(error <= 1.0 + 4e-9 * exact, "{raw}: {error}");
    }
}

#[test]
fn ratios_are_wrong_by_at_most_four_parts_in_a_billion() {
    let seed = 0x9E37_79B9_7F4A_7C15;
    println!("seed {seed:#x}");
    let mut random = Random(seed);
    let [mut small, mut large] = worst_ratio(1_009);
    for _ in 0..400_000 {
        let divisor = random.bits().saturating_abs().max(1 << 28);
        let number = random.bits() % divisor;
        let error =
            f64::from(ratio_q30(number, divisor)) / Q30 - f64::from(number) / f64::from(divisor);
        let worst = if divisor < 1 << 29 {
            &mut small
        } else {
            &mut large
        };
        *worst = worst.max(error.abs());
    }
    println!("ratio: {small:.2e} below 2²⁹, {large:.2e} above");
    assert!(small <= 15e-9 && large <= 3.8e-9, "{small:e} {large:e}");
}

#[test]
fn a_ratio_reaches_four_steps_of_error_where_the_divisor_s_low_digit_is_full() {
    let (number, divisor) = (1 << 29, (1 << 29) + (1 << 15) - 1);
    let error =
        f64::from(ratio_q30(number, divisor)) / Q30 - f64::from(number) / f64::from(divisor);
    assert!((-3.96e-9..-3.6e-9).contains(&error), "{error:e}");
    let (number, divisor) = (1 << 28, (1 << 28) + (1 << 15) - 1);
    let error =
        f64::from(ratio_q30(number, divisor)) / Q30 - f64::from(number) / f64::from(divisor);
    assert!((-1.59e-8..-1.4e-8).contains(&error), "{error:e}");
}

#[test]
fn quotients_survive_every_input_and_are_right_where_they_should() {
    let seed = 0x5DEE_CE66_D1CE_4E5B;
    println!("seed {seed:#x}");
    let mut random = Random(seed);
    let corners = [
        i32::MIN,
        i32::MIN + 1,
        -1,
        0,
        1,
        2,
        1 << 30,
        i32::MAX - 1,
        i32::MAX,
    ];
    let mut worst = 0.0f64;
    for round in 0..400_000usize {
        let (number, divisor) = match (corners.get(round / 9), corners.get(round % 9)) {
            (Some(&number), Some(&divisor)) => (number, divisor),
            _ => (
                random.bits() >> (random.next() % 31),
                random.bits() >> (random.next() % 31),
            ),
        };
        let found = f64::from(quotient_q30(number, divisor)) / Q30;
        let _ = ratio_q30(number, divisor);
        if divisor > 0 && number.unsigned_abs() <= divisor.unsigned_abs() {
            let error = (found - f64::from(number) / f64::from(divisor)).abs();
            assert!(error <= 3.8e-9, "{number} / {divisor}: {error:e}");
            worst = worst.max(error);
        }
    }
    println!("quotient: {worst:.2e}");
}

#[test]
fn the_angle_of_a_vector_is_wrong_by_at_most_five_nanoradians() {
    let seed = 0xDEAD_BEEF_CAFE_F00D;
    println!("seed {seed:#x}");
    let mut random = Random(seed);
    let corners = [i32::MIN, -1, 0, 1, i32::MAX];
    let mut worst = 0.0f64;
    for round in 0..400_000usize {
        let (y, x) = match (corners.get(round / 5), corners.get(round % 5)) {
            (Some(&y), Some(&x)) => (y, x),
            _ => {
                let shift = random.next() % 31;
                (random.bits() >> shift, random.bits() >> shift)
            }
        };
        let error = f64::from(Angle::from_sides(y, x).to_q29()) / Q29
            - libm::atan2(f64::from(y), f64::from(x));
        assert!(error.abs() <= 5e-9, "({x}, {y}): {error:e}");
        worst = worst.max(error.abs());
    }
    println!("angle of a vector: {worst:.2e} rad");
}

#[test]
fn the_multiplies_round_down() {
    for (a, b, product) in [
        (1 << 16, 1 << 16, 1),
        ((1 << 16) - 1, 1 << 16, 0),
        (-1, 1, -1),
        (-(1 << 16), 1 << 16, -1),
        (-(1 << 16) - 1, 1 << 16, -2),
        (i32::MIN, i32::MIN, 1 << 30),
        (i32::MIN, i32::MAX, -(1 << 30)),
    ] {
        assert_eq!(multiply_high(a, b), product, "{a} × {b}");
        assert_eq!(multiply_high_add(7, a, b), product + 7, "7 + {a} × {b}");
    }
    assert_eq!(multiply_high_add(i32::MAX, 1 << 16, 1 << 16), i32::MIN);
}

#[test]
fn the_angle_over_its_sine_is_wrong_by_at_most_four_parts_in_a_million() {
    let mut worst = 0.0f64;
    for raw in (0..1 << 30).step_by(1_013) {
        let angle = libm::acos(f64::from(raw) / Q30);
        let exact = if angle == 0.0 {
            1.0
        } else {
            angle / libm::sin(angle)
        };
        worst = worst.max((f64::from(angle_over_sine(raw)) / Q29 / exact - 1.0).abs());
    }
    println!("angle over sine: {worst:.1e}");
    assert!(worst <= 4e-6, "{worst:e}");
    for raw in [i32::MIN, -1, 0] {
        assert!(
            (f64::from(angle_over_sine(raw)) / Q29 - core::f64::consts::FRAC_PI_2).abs() < 1e-5
        );
    }
    assert!((f64::from(angle_over_sine(i32::MAX)) / Q29 - 1.0).abs() < 4e-6);
}

#[test]
fn the_coefficients_are_what_their_generator_prints() {
    let folder = env!("CARGO_MANIFEST_DIR");
    let made = std::process::Command::new("python3")
        .arg(format!("{folder}/coefficients.py"))
        .output();
    let Ok(made) = made else {
        assert!(
            std::env::var_os("CI").is_none(),
            "python3 is missing: install it"
        );
        println!("skipped: python3 is missing; install it to make the coefficients again");
        return;
    };
    let kept = std::fs::read_to_string(format!("{folder}/src/coefficients.rs")).unwrap();
    assert_eq!(String::from_utf8(made.stdout).unwrap(), kept);
}
