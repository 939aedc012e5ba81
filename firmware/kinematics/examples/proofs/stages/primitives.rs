//! Sine, cosine, arctangent, quotient and root, as eel-units computes them.

use eel_units::{ROOT_SLOPE_Q16, ROOT_START_Q15};

use crate::coefficients::COEFFICIENTS;
use crate::minimax;
use crate::script::{Range, Script};
use crate::trace::{Trace, Value};

/// The largest error of the sine of `sin_cos_near`.
pub const SINE: f64 = 1.77e-9;
/// The largest error of the cosine of `sin_cos_near`.
pub const COSINE: f64 = 2.81e-9;
/// The largest error of `arctangents`.
pub const ARCTANGENT: f64 = 1.8e-9;
/// The largest error of `root_near`.
pub const ROOT: f64 = 2.91e-9;
/// The largest error of `root_near` from ⅛ on.
pub const ROOT_FROM_EIGHTH: f64 = 1.8e-9;
/// The least number that `root_near` takes.
pub const LEAST_SQUARE: f64 = 1.0 / 32.0;
/// The largest number that `root_near` takes.
pub const MOST_SQUARE: f64 = 0.55;
/// The largest tangent that `arctangents` takes.
pub const TANGENT: f64 = 17.0 / 32.0;

/// One step of Q30.
const STEP: f64 = 1.0 / 1_073_741_824.0;

/// A least divisor of `ratio_q30` in Q30, and the largest error from there on.
pub const RATIOS: [(f64, f64); 2] = [(0.23, 20.2 * STEP), (0.5, 4.2501 * STEP)];

/// The largest error of `ratio_q30` for a quotient up to ⅔ and a divisor from 0.37 in Q30 on.
pub const RATIO_INVERSE: f64 = 5.2 * STEP;

/// Horner's rule with a multiplication and an addition a step.
fn horner<const N: usize>(
    trace: &mut Trace,
    name: &str,
    coefficients: [(i32, i32); N],
    square: Value,
) -> Value {
    let mut sum = None;
    for (index, (integer, bits)) in coefficients.into_iter().enumerate().rev() {
        let constant = trace.constant(&format!("{name}_{index}"), integer.into(), bits);
        sum = Some(match sum {
            None => constant,
            Some(sum) => trace.high_add(&format!("{name}_from{index}"), constant, sum, square),
        });
    }
    sum.expect("a coefficient")
}

/// Gives each coefficient its format: two bits more for each step of Horner's rule.
fn formats<const N: usize>(integers: [i32; N], first: i32) -> [(i32, i32); N] {
    core::array::from_fn(|k| (integers[k], first + 2 * k as i32))
}

/// The sine and the cosine of an angle in Q31.
pub fn sine_cosine(trace: &mut Trace, angle: Value) -> [Value; 2] {
    let square = trace.high("square", angle, angle);
    let sum = horner(trace, "s", formats(COEFFICIENTS.sine, 31), square);
    let sine = trace.high("sine", angle, sum);
    let sum = horner(trace, "c", formats(COEFFICIENTS.cosine, 32), square);
    let one = trace.constant("below_one", (1 << 30) - 1, 30);
    let cosine = trace.high_add("cosine", one, sum, square);
    [sine, cosine]
}

/// The arctangent of a tangent in Q31.
pub fn arctangent(trace: &mut Trace, tangent: Value) -> Value {
    let product = trace.high("product", tangent, tangent);
    let shifted = trace.left("shifted", product, 2);
    let square = trace.read_as("square", shifted, 30);
    let sum = horner(trace, "p", formats(COEFFICIENTS.arctangent, 31), square);
    trace.high("arctangent", tangent, sum)
}

/// `ratio_q30`, for numbers that are not negative.
pub fn ratio(trace: &mut Trace, number: Value, divisor: Value) -> Value {
    let leading = trace.right("leading", divisor, 15);
    let first = trace.divide("first", number, leading);
    let whole = trace.left("whole", number, 15);
    let whole = trace.long(whole);
    let taken = trace.products("taken", &[(first, divisor)]);
    let rest = trace.subtract("rest", whole, taken);
    let rest = trace.short(rest);
    let second = trace.divide("second", rest, leading);
    let shifted = trace.left("shifted", first, 15);
    trace.add("quotient", shifted, second)
}

/// `root_near`.
pub fn root(trace: &mut Trace, square: Value) -> Value {
    let start = trace.constant("start", ROOT_START_Q15.into(), 15);
    let slope = trace.constant("slope", ROOT_SLOPE_Q16.into(), 16);
    let rough = trace.high_add("rough", start, square, slope);
    let rough_q16 = trace.left("rough_q16", rough, 1);
    let rough_q16 = trace.unsigned(rough_q16);
    let other = trace.divide_unsigned("other", square, rough);
    let twice = trace.add("twice", rough_q16, other);
    let near = trace.half("near", twice, 2);
    let doubled = trace.left("doubled", square, 1);
    let doubled = trace.unsigned(doubled);
    let far = trace.divide_unsigned("far", doubled, twice);
    let fine = trace.add("fine", near, far);
    let product = trace.products("product", &[(fine, fine)]);
    let whole = trace.left("whole", doubled, 0);
    let whole = trace.long(whole);
    let residual = trace.subtract("residual", whole, product);
    let residual = trace.short(residual);
    let shifted = trace.left("residual_shifted", residual, 13);
    let correction = trace.divide("correction", shifted, fine);
    let correction = trace.read_as("half_correction", correction, 30);
    let fine = trace.left("fine_q30", fine, 14);
    trace.add("root", fine, correction)
}

/// Adds the true function's value and what the polynomial misses it by.
fn against_truth(script: &mut Script, value: Value, offset: &str, missing: f64, error: f64) {
    let name = script.name(value);
    script.because(&format!(
        "true_{name}: the polynomial misses the function by {missing:.2e}; bounded against the function's \
         series in minimax.rs."
    ));
    script.suppose(format!("|meant_{name} - true_{name}| <= {missing:e}"));
    script.define_last(format!("meant_{name} = 1 * (exact_{name}{offset});"));
    script.hint(format!(
        "{name} - true_{name} -> ({name} - exact_{name}) + (meant_{name} - true_{name}){};",
        offset.replace('+', "-")
    ));
    script.claim(format!("|{name} - true_{name}| <= {error:e}"));
    script.note(&format!("{name}, error"), error);
}

/// The scripts of the primitives.
pub fn scripts() -> Vec<Script> {
    let mut scripts = vec![sine_script(), arctangent_script()];
    let whole = 17.0 / 16.0;
    let stage = "quotient, divisor from 0.23 · 2³⁰ on";
    scripts.push(ratio_script("ratio-quarter", stage, whole, RATIOS[0]));
    let stage = "quotient, divisor from 2²⁹ on";
    scripts.push(ratio_script("ratio-half", stage, whole, RATIOS[1]));
    let stage = "quotient up to ⅔, divisor from 0.37 · 2³⁰ on";
    scripts.push(ratio_script(
        "ratio-inverse",
        stage,
        0.67,
        (0.37, RATIO_INVERSE),
    ));
    scripts.push(root_script(
        "root-low",
        "root, number in 1/32..⅛",
        Range(LEAST_SQUARE, 0.125),
        ROOT,
    ));
    let high = Range(0.125, MOST_SQUARE);
    scripts.push(root_script(
        "root-high",
        "root, number in ⅛..0.55",
        high,
        ROOT_FROM_EIGHTH,
    ));
    scripts
}

fn sine_script() -> Script {
    let mut script = Script::new("sine", "sine and cosine, angle within ±1 rad", true);
    let angle = script.trace.input("angle", 31);
    script.suppose_exact(angle, Range(-1.0, 1.0));
    let [sine, cosine] = sine_cosine(&mut script.trace, angle);
    against_truth(&mut script, sine, "", minimax::sine(), SINE);
    // The cosine starts one step below one.
    against_truth(&mut script, cosine, " + 1b-30", minimax::cosine(), COSINE);
    script.claim(format!("cosine <= {}b-30", (1 << 30) - 1));
    script.because("true_sine: the sine of at most one radian.");
    script.suppose(format!("|true_sine| <= {:e}", 1.0f64.sin() + 1e-9));
    script.hint("sine -> (sine - true_sine) + true_sine;");
    script.claim("|sine| <= 1073741823b-30");
    script
}

fn arctangent_script() -> Script {
    let mut script = Script::new("arctangent", "arctangent, tangent within ±17/32", true);
    let tangent = script.trace.input("tangent", 31);
    script.suppose_exact(tangent, Range(-TANGENT, TANGENT));
    let value = arctangent(&mut script.trace, tangent);
    against_truth(&mut script, value, "", minimax::arctangent(), ARCTANGENT);
    script
}

/// Divisors from one on; numbers of the other sign mirror everything.
fn ratio_script(
    file: &'static str,
    stage: &'static str,
    most: f64,
    (least, error): (f64, f64),
) -> Script {
    let mut script = Script::new(file, stage, false);
    script
        .because("number >= 0: SDIV rounds towards zero, so a negative number mirrors every step.");
    let number = script.trace.input("number", 0);
    let divisor = script.trace.input("divisor", 0);
    let low = (least / STEP).floor();
    script.suppose_exact(number, Range(0.0, i32::MAX.into()));
    script.suppose_exact(divisor, Range(low, i32::MAX.into()));
    script.suppose_within("number / divisor", Range(0.0, most));
    ratio(&mut script.trace, number, divisor);
    let (l, n, d) = ("leading", "number", "divisor");
    let nonzero = format!("{{ {l} <> 0, {d} <> 0 }}");
    for rule in [
        format!("rest -> -({n} / {l}) * ({d} - {l}) - (first - {n} / {l}) * {d} {nonzero};"),
        format!("{n} / {l} -> ({n} / {d}) * ({d} / {l}) {nonzero};"),
        format!("{d} / {l} -> 1 + ({d} - {l}) / {l} {nonzero};"),
        format!(
            "rest / {d} -> -({n} / {d}) * (({d} - {l}) / {l}) - (first - {n} / {l}) {nonzero};"
        ),
        format!(
            "quotient - {n} / {d} -> (rest / {d}) * (({d} - {l}) / {l}) + (second - rest / {l}) {nonzero};"
        ),
        "$ rest in (0);".to_owned(),
    ] {
        script.hint(rule);
    }
    // Away from zero: sharing relies on it.
    let away = (1.0 / least + 0.01) * STEP;
    script.claim(format!("quotient - {n} / {d} <= {away:e}"));
    script.note("away from zero", away);
    script.claim(format!("|quotient - {n} / {d}| <= {error:e}"));
    script.note("error", error);
    script
}

fn root_script(file: &'static str, stage: &'static str, range: Range, error: f64) -> Script {
    let mut script = Script::new(file, stage, false);
    script.because("true_root: the number is its square, whichever it is.");
    let square = script.trace.input("square", 31);
    script.define("square = true_root * true_root;");
    script.suppose("@FIX(square,-31)");
    let sides = Range(range.0.sqrt(), range.1.sqrt()).widened(1e-9);
    script.suppose_within("true_root", sides);
    root(&mut script.trace, square);
    for rule in ROOT_RULES {
        script.hint(rule);
    }
    let parts = if range.0 < 0.1 { 4 } else { 8 };
    script.hint(format!("$ true_root in {parts};"));
    script.claim(format!("|root - true_root| <= {error:e}"));
    script.note("error", error);
    script
}

/// Heron's steps: (a + s/a)/2 − √s = (a − √s)²/2a, and the same of the residual.
const ROOT_RULES: [&str; 10] = [
    "rough - true_root -> (rough_part - square * slope) + slope * (true_root - 0.5 / slope) * (true_root - 0.5 / slope) + (start - 0.25 / slope);",
    "rough + square / rough - 2 * true_root -> (rough - true_root) * (rough - true_root) / rough { rough <> 0 };",
    "twice - 2 * true_root -> (rough + square / rough - 2 * true_root) + (other - square / rough) { rough <> 0 };",
    "twice / 4 + square / twice - true_root -> (twice - 2 * true_root) * (twice - 2 * true_root) / (4 * twice) { twice <> 0 };",
    "fine - true_root -> (twice / 4 + square / twice - true_root) + (near_shifted - twice) / 4 + (far - square / twice) { twice <> 0 };",
    "residual -> (true_root - fine) * (true_root + fine);",
    "fine + residual / fine / 2 - true_root -> (fine - true_root) * (fine - true_root) / (2 * fine) { fine <> 0 };",
    "root - true_root -> (fine + residual / fine / 2 - true_root) + (correction - residual / fine) / 2 { fine <> 0 };",
    "twice -> (twice - 2 * true_root) + 2 * true_root;",
    "fine -> (fine - true_root) + true_root;",
];
