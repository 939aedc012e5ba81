//! Every primitive against `libm` in double precision, over its whole range.
//!
//! `cargo test -p eel-units --release -- --ignored` checks every single input.

#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

use eel_units::{
    Angle, Reciprocal, SIN_COS_NEAR, angle_over_sine, arctangent, divide_q31, invert_normal,
    multiply_high, multiply_high_add, root_q30, shift_left_high, sin_cos_near,
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

fn worst_sin_cos_near(step: usize) -> f64 {
    let limit = SIN_COS_NEAR.to_q29();
    let mut worst = 0.0f64;
    for raw in (-limit..=limit).step_by(step) {
        let angle = f64::from(raw) / Q29;
        let (sine, cosine) = sin_cos_near(Angle::from_q29(raw));
        worst = worst.max((f64::from(sine) / Q30 - libm::sin(angle)).abs());
        worst = worst.max((f64::from(cosine) / Q30 - libm::cos(angle)).abs());
    }
    worst
}

fn worst_arctangent(step: usize) -> f64 {
    let limit = (0.625 * Q31) as i32;
    let mut worst = 0.0f64;
    for raw in (-limit..=limit).step_by(step) {
        let error = f64::from(arctangent(raw)) / Q30 - libm::atan(f64::from(raw) / Q31);
        worst = worst.max(error.abs());
    }
    worst
}

fn worst_root(step: usize) -> f64 {
    let mut worst = 0.0f64;
    for raw in (0..=u32::MAX).step_by(step) {
        let error = f64::from(root_q30(raw)) - libm::sqrt(f64::from(raw) * Q30);
        worst = worst.max(error.abs());
    }
    worst
}

fn worst_reciprocal(step: usize) -> f64 {
    let mut worst = 0.0f64;
    for raw in (1..=i32::MAX).step_by(step) {
        // Half of the divisor: the quotient is ½, in 2³⁰ steps.
        let half = raw / 2;
        let exact = f64::from(half) / f64::from(raw);
        let error = f64::from(divide_q31(half, raw)) / Q31 - exact;
        worst = worst.max(error.abs());
    }
    worst
}

#[test]
fn sine_and_cosine_are_wrong_by_at_most_one_and_a_half_parts_in_a_billion() {
    let worst = worst_sin_cos_near(97);
    println!("sine and cosine, |a| ≤ 1.125 rad: {worst:.2e}");
    assert!(worst <= 1.5e-9, "{worst:e}");
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
    assert!(worst <= 2e-9, "{worst:e}");
}

#[test]
fn the_arctangent_is_wrong_by_at_most_one_and_a_fifth_parts_in_a_billion() {
    let worst = worst_arctangent(97);
    println!("arctangent, |t| ≤ 0.625: {worst:.2e} rad");
    assert!(worst <= 1.2e-9, "{worst:e}");
    for raw in [i32::MIN, i32::MIN + 1, i32::MAX] {
        let error = f64::from(arctangent(raw)) / Q30 - libm::atan(f64::from(raw) / Q31);
        assert!(error.abs() <= 0.1, "{raw}: {error}");
    }
}

#[test]
fn the_root_is_wrong_by_at_most_one_step() {
    let worst = worst_root(211);
    println!("root: {worst:.3} steps of 2⁻³⁰");
    assert!(worst <= 1.0, "{worst}");
    for raw in [0, 1, 2, 3, 4, 1 << 30, u32::MAX - 1, u32::MAX] {
        let error = f64::from(root_q30(raw)) - libm::sqrt(f64::from(raw) * Q30);
        assert!(error.abs() <= 1.0, "{raw}: {error}");
    }
}

#[test]
fn quotients_are_wrong_by_at_most_one_and_a_third_parts_in_a_billion() {
    let seed = 0x9E37_79B9_7F4A_7C15;
    println!("seed {seed:#x}");
    let mut random = Random(seed);
    let mut worst = worst_reciprocal(101);
    for _ in 0..400_000 {
        let divisor = (random.bits() >> (random.next() % 31))
            .saturating_abs()
            .max(2);
        let number = (f64::from(random.bits() % divisor) * 0.99) as i32;
        let error =
            f64::from(divide_q31(number, divisor)) / Q31 - f64::from(number) / f64::from(divisor);
        worst = worst.max(error.abs());
    }
    println!("quotient: {worst:.2e}");
    assert!(worst <= 1.3e-9, "{worst:e}");
}

#[test]
fn quotients_of_every_kind_survive_every_input() {
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
    for round in 0..400_000usize {
        let (number, divisor) = match (corners.get(round / 9), corners.get(round % 9)) {
            (Some(&number), Some(&divisor)) => (number, divisor),
            _ => (
                random.bits() >> (random.next() % 31),
                random.bits() >> (random.next() % 31),
            ),
        };
        let reciprocal = Reciprocal::new(divisor);
        let exact = f64::from(number) / f64::from(divisor.max(1));
        let close = |found: i32, scale: f64, tolerance: f64| {
            let wanted = (exact * scale).clamp(f64::from(i32::MIN), f64::from(i32::MAX));
            (f64::from(found) - wanted).abs() <= tolerance * wanted.abs() + 1.0
        };
        let context = format!("{number} / {divisor}");
        assert!(
            close(reciprocal.times_over_q29(number), Q29, 1.2e-9),
            "{context}"
        );
        let _ = (
            divide_q31(number, divisor),
            invert_normal(number),
            reciprocal.to_q30(),
        );
        if (1 << 29..1 << 31).contains(&i64::from(divisor)) {
            let error = f64::from(reciprocal.to_q30()) / Q30 * f64::from(divisor) / Q30 - 1.0;
            assert!(error.abs() <= 2e-9, "{divisor}: {error:e}");
        }
    }
}

#[test]
fn the_angle_of_a_vector_is_wrong_by_at_most_three_and_a_half_nanoradians() {
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
        assert!(error.abs() <= 3.5e-9, "({x}, {y}): {error:e}");
        worst = worst.max(error.abs());
    }
    println!("angle of a vector: {worst:.2e} rad");
}

#[test]
fn the_multiplies_round_to_nearest() {
    for (a, b, product) in [
        (1 << 16, 1 << 16, 1),
        (1 << 15, 1 << 16, 1),
        ((1 << 15) - 1, 1 << 16, 0),
        (-(1 << 15), 1 << 16, 0),
        (-(1 << 15) - 1, 1 << 16, -1),
        (i32::MIN, i32::MIN, 1 << 30),
        (i32::MIN, i32::MAX, -(1 << 30) + 1),
    ] {
        assert_eq!(multiply_high(a, b), product, "{a} × {b}");
        assert_eq!(multiply_high_add(7, a, b), product + 7, "7 + {a} × {b}");
    }
    assert_eq!(multiply_high_add(i32::MAX, 1 << 16, 1 << 16), i32::MIN);
}

#[test]
#[ignore = "minutes: every input of every primitive"]
fn every_input_of_every_primitive_keeps_its_bound() {
    let (sine, tangent) = (worst_sin_cos_near(1), worst_arctangent(1));
    let (root, quotient) = (worst_root(1), worst_reciprocal(1));
    println!("sine {sine:.3e}, arctangent {tangent:.3e}, root {root:.4}, quotient {quotient:.3e}");
    assert!(sine <= 1.5e-9 && tangent <= 1.2e-9 && root <= 1.0 && quotient <= 1.3e-9);
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
fn the_high_half_of_a_shift_is_the_high_half() {
    for value in [
        0x0123_4567_89AB_CDEFi64,
        -0x0123_4567_89AB_CDEF,
        1 << 31,
        -1,
    ] {
        for shift in 1..=31 {
            assert_eq!(
                shift_left_high(value, shift),
                ((value << shift) >> 32) as i32
            );
        }
    }
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
