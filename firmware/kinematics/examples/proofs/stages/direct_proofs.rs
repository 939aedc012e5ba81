//! The scripts of `Wrist::direct`.

use super::direct::{Crank, Push, find, first_equation, third, turned};
use super::inverse_proofs::suppose_sines;
use super::primitives::{MOST_SQUARE, RATIOS, ROOT_FROM_EIGHTH};
use crate::geometry::limits;
use crate::script::{Range, Script};
use crate::trace::Value;

/// The largest error of a constant in Q29, rounded to nearest.
pub const CONSTANT: f64 = 1.0 / 1_073_741_824.0;
/// The largest error of the sine and cosine of θ3.
pub const THIRD: f64 = 5.1e-9;
/// The largest errors of −B / ρ: y and z.
const BACK: [f64; 2] = [5.7e-9, 4.6e-9];
/// The largest error of N.
const OFFSET: f64 = 8e-9;
/// The largest errors of K, in either equation, and of leg 2's M.
pub const BEHIND: f64 = 1.95e-8;
pub const ACROSS2: f64 = 4.05e-7;
/// Returns W² at most, (s/ρ)², on a leg.
pub fn most_square(leg: usize) -> f64 {
    let limits = limits(leg);
    limits.rod.over(limits.crank).1.powi(2)
}

/// W² at least, of what the code checks in Q26.
pub const LEAST_W_SQUARE: f64 = crate::direct::LEAST_ASSEMBLY_SQUARE as f64 / 67_108_864.0;
/// The largest tangent of half a root: 2 above < below.
pub const TANGENT: f64 = 0.5;
/// The range of cos θ3 and sin θ3.
pub const THIRD_RANGE: Range = Range(0.28, 0.9597);

/// One of the two equations.
pub struct Equation {
    pub leg: usize,
    files: [&'static str; 3],
    stages: [&'static str; 3],
    /// M.
    m: Range,
    m_error: f64,
    /// What the computed tangent leaves of the equation.
    left: f64,
    /// The largest error of W.
    pub margin: f64,
    /// The first bound of the tangent's error.
    coarse: f64,
    /// The largest error of the tangent.
    pub tangent: f64,
}

/// The equation of φ on leg 1, and that of ψ on leg 2.
pub const EQUATIONS: [Equation; 2] = [
    Equation {
        leg: 0,
        files: ["direct-phi-range", "direct-phi", "direct-phi-tangent"],
        stages: [
            "direct, ranges of φ's equation",
            "direct, φ's equation",
            "direct, tan(φ/2)",
        ],
        m: Range(0.5, 2.34),
        m_error: BACK[1],
        left: 3e-8,
        margin: 8.8e-8,
        coarse: 1.08e-7,
        tangent: 4.15e-8,
    },
    Equation {
        leg: 1,
        files: ["direct-psi-range", "direct-psi", "direct-psi-tangent"],
        stages: [
            "direct, ranges of ψ's equation",
            "direct, ψ's equation",
            "direct, tan(ψ/2)",
        ],
        m: Range(-2.6, 2.6),
        m_error: ACROSS2,
        left: 3.1e-8,
        margin: 1.5e-6,
        coarse: 1.95e-6,
        tangent: 3.15e-7,
    },
];

/// K (negative), N, the denominator and the numerator of the tangent.
const MINUS_K: Range = Range(-1.6, -0.5);
const N: Range = Range(0.3, 2.45);
const BELOW: Range = Range(1.01, 3.95);
const ABOVE: Range = Range(-1.9, 1.9);
/// P / W on leg 1 where φ is found.
pub const LEAN: Range = Range(-1.25, 1.25);

/// The scripts.
pub fn scripts() -> Vec<Script> {
    let mut scripts = vec![third_script(), crank_script(), first_script()];
    for equation in &EQUATIONS {
        scripts.push(range_script(equation, false));
        scripts.push(find_script(equation));
        scripts.push(tangent_script(equation));
    }
    scripts.push(range_script(&EQUATIONS[0], true));
    scripts
}

fn third_script() -> Script {
    let mut script = Script::new("direct-third", "direct, sine and cosine of θ3", true);
    script.because("The third motor is within half a radian of home: are_near.");
    let values = script.trace.inputs(["sine", "cosine"], 30);
    suppose_sines(&mut script, values, 0.5, CONSTANT);
    let [c3, s3] = third(&mut script.trace, values);
    script.because("exact_cosine: of the same angle as exact_sine.");
    script.define("exact_cosine = sqrt(1 - exact_sine * exact_sine);");
    for name in ["c3", "s3"] {
        script.hint(format!(
            "{name}_q30 -> exact_{name}_q30 + ({name}_q30 - exact_{name}_q30);"
        ));
    }
    script.hint("$ exact_sine in 24;");
    script.claim_within("exact_c3", THIRD_RANGE);
    script.claim_within("exact_s3", THIRD_RANGE);
    script.claim_near(c3, THIRD, "error");
    script.claim_near(s3, THIRD, "");
    script
}

/// Supposes a leg's constants for the direct kinematics.
pub fn suppose_push(script: &mut Script, push: &Push, leg: usize) {
    script.because(
        "The constants are those of a unit within design's tolerance, rounded to nearest.",
    );
    let limits = limits(leg);
    let minus = Range(-1.0, -1.0);
    for (value, range) in push.back.into_iter().zip(limits.slope) {
        script.suppose_near(value, range.times(minus), CONSTANT);
    }
    script.suppose_near(push.offset, limits.offset, CONSTANT);
    let [_, y, z] = limits.center;
    let shifts = [y, z.plus(Range(1.0, 1.0))];
    for (value, range) in push.shift.into_iter().zip(shifts) {
        script.suppose_near(value, range, CONSTANT / 4.0);
    }
    for (value, range) in push.center.into_iter().zip([y, z]) {
        script.suppose_near(value, range, CONSTANT);
    }
}

fn crank_script() -> Script {
    let mut script = Script::new("direct-crank", "direct, a crank's end and N", true);
    script.because("A crank is within one radian: are_near.");
    let values = script.trace.inputs(["sine", "cosine"], 30);
    suppose_sines(&mut script, values, 1.0, CONSTANT);
    let push = super::direct::push(&mut script.trace);
    suppose_push(&mut script, &push, 0);
    let crank = turned(&mut script.trace, &push, values);
    script.claim_near(crank.back[1], BACK[0], "−B / ρ, error");
    script.claim_near(crank.back[2], BACK[1], "");
    script.claim_near(crank.offset, OFFSET, "N, error");
    script
}

/// The range of −B / ρ of a leg.
fn back_range(leg: usize) -> [Range; 3] {
    let minus = Range(-1.0, -1.0);
    let [x, y, z] = limits(leg).slope.map(|range| range.times(minus));
    let (sine, cosine) = 1.0f64.sin_cos();
    [x, y.plus(Range(-1.0, -cosine)), z.plus(Range(-sine, sine))]
}

/// Takes the end of a turned crank from outside.
pub fn given_back(script: &mut Script, leg: usize) -> [Value; 3] {
    script.because("b: −B / ρ of the proof of the cranks.");
    let back = script.trace.inputs(["b_x", "b_y", "b_z"], 29);
    let errors = [CONSTANT, BACK[0], BACK[1]];
    for ((value, range), error) in back.into_iter().zip(back_range(leg)).zip(errors) {
        script.suppose_near(value, range, error);
    }
    back
}

/// Takes cosine and sine of θ3 from outside.
pub fn given_third(script: &mut Script) -> [Value; 2] {
    let values = script.trace.inputs(["c3", "s3"], 31);
    for value in values {
        script.suppose_near(value, THIRD_RANGE, THIRD);
    }
    values
}

fn first_script() -> Script {
    let mut script = Script::new("direct-phi-terms", "direct, terms of φ's equation", true);
    let [c3, s3] = given_third(&mut script);
    let back = given_back(&mut script, 0);
    let crank = Crank {
        sine: c3,
        cosine: c3,
        back,
        offset: c3,
    };
    let [behind, _, across] = first_equation(&mut script.trace, c3, s3, &crank);
    script.claim_near(behind, BEHIND, "K, error");
    script.claim_near(across, BEHIND, "P, error");
    script
}

/// Ranges of exact numbers, of cranks within one radian and θ3 within half a radian of home.
///
/// With `accepted` of where the tangent is one that the code takes.
fn range_script(equation: &Equation, accepted: bool) -> Script {
    let (file, stage) = if accepted {
        ("direct-phi-lean", "direct, range of P / W where φ is found")
    } else {
        (equation.files[0], equation.stages[0])
    };
    let mut script = Script::new(file, stage, false);
    script.because("s, c: of the crank; c3, s3: of θ3; sf, cf: of φ, which is within 53.2°. All is exact here.");
    script.define("c = sqrt(1 - s * s);\ns3 = sqrt(1 - c3 * c3);\nby = ay - c;\nbz = az - s;");
    if equation.leg == 0 {
        script.define("k = c3 * bx + s3 * by;\nm = 1 * bz;");
    } else {
        script.define("cf = sqrt(1 - sf * sf);\nk = c3 * by - s3 * bx;\nside = c3 * bx + s3 * by;");
        script.define("m = sf * side + cf * bz;");
        script.suppose("|sf| <= 0.8001");
    }
    script.define("n = o - s + c * right + s * up;\nsquare = k * k + m * m - n * n;");
    script.define(if equation.leg == 0 {
        "between = m - sqrt(square);"
    } else {
        "between = sqrt(square) - m;"
    });
    script.define("below = n - k;");
    let sine = 1.0f64.sin() + 1e-9;
    script.suppose_within("s", Range(-sine, sine));
    script.suppose_within("c3", THIRD_RANGE);
    let limits = limits(equation.leg);
    let minus = Range(-1.0, -1.0);
    for (name, range) in ["bx", "ay", "az"].iter().zip(limits.slope) {
        script.suppose_within(name, range.times(minus));
    }
    script.suppose_within("o", limits.offset);
    script.suppose_within("right", limits.center[1]);
    script.suppose_within("up", limits.center[2].plus(Range(1.0, 1.0)));
    script.because(
        "square: W² from what the code checks, less its error, to (s/ρ)²: W ρ is |C×B|, at most s.",
    );
    let most = most_square(equation.leg);
    script.suppose_within("square", Range(LEAST_W_SQUARE - 1e-6, most));
    if accepted {
        script.because(
            "between / below: the code's limit of the tangent, and a little for its errors.",
        );
        script.suppose_within("between / below", Range(-0.5001, 0.5001));
        script.define("lean = (c3 * by - s3 * bx) / sqrt(square);");
        script.claim_within("lean", LEAN);
        script.note("largest", LEAN.1);
    } else {
        script.claim_within("k", MINUS_K);
        script.claim_within("m", equation.m);
        script.claim_within("n", N);
        script.claim_within("below", BELOW);
        script.claim_within("between", ABOVE);
        script.note("N + K, largest", BELOW.1);
    }
    script.hint(if equation.leg == 0 {
        "$ s in 24, c3 in 8;"
    } else {
        "$ s in 24, c3 in 8, sf in 8;"
    });
    script
}

/// Takes −K, M, N from outside, as their proofs bound them.
fn given_terms(script: &mut Script, equation: &Equation) -> [Value; 3] {
    let terms = script.trace.inputs(["k", "m", "n"], 29);
    script.suppose_near(terms[0], MINUS_K, BEHIND);
    script.suppose_near(terms[1], equation.m, equation.m_error);
    script.suppose_near(terms[2], N, OFFSET);
    terms
}

fn find_script(equation: &Equation) -> Script {
    let mut script = Script::new(equation.files[1], equation.stages[1], true);
    let terms = given_terms(&mut script, equation);
    let side = if equation.leg == 0 { 1 } else { -1 };
    let root = find(&mut script.trace, side, terms);
    script.because("square: the code answers from LEAST_ASSEMBLY_SQUARE on; at most (s/ρ)².");
    let (name, exact) = (script.name(root.square), script.exact(root.square));
    script.suppose(format!("{name} >= {LEAST_W_SQUARE:e}"));
    let most = most_square(equation.leg);
    script.suppose(format!("{exact} <= {most:e}"));
    script.hint(format!("{name} -> {exact} + ({name} - {exact});"));
    script.hint(format!("{exact} -> {name} - ({name} - {exact});"));
    script.claim_within("root_of", Range(0.125, MOST_SQUARE));
    script.suppose_primitive(root.half_margin, ROOT_FROM_EIGHTH);
    script.because("exact_below, exact_above: the proof of the ranges.");
    script.suppose_within(&script.exact(root.below), BELOW);
    script.suppose_within(&script.exact(root.above), ABOVE);
    script.because("tangent: the code answers while 2 above is between −below and below.");
    script.suppose(format!("|above / below| <= {TANGENT:e}"));
    script.suppose_primitive(root.tangent, RATIOS[1].1);
    script.claim_near(root.margin, equation.margin, "W, error");
    script.claim_near(root.tangent, equation.coarse, "tangent, first bound");
    let sign = if side < 0 { "-" } else { "" };
    script.define_last(format!(
        "u = {sign}tangent * 1;\nr = {sign}(above / below);"
    ));
    script.define_last("left = -k * (1 - u * u) + 2 * m * u - n * (1 + u * u);");
    script.hint(format!(
        "left -> ({name} - margin * margin) / below + (u - r) * (2 * m - below * (u + r)) {{ below <> 0 }};"
    ));
    script.hint(format!(
        "u - r -> {sign}(tangent - above / below) {{ below <> 0 }};"
    ));
    script.hint(format!(
        "{name} - margin * margin -> ({name} - square_q29) + 4 * (root_of - half_margin * half_margin);"
    ));
    script.hint(
        "root_of - half_margin * half_margin -> (sqrt(root_of) - half_margin) * (sqrt(root_of) + half_margin) { root_of >= 0 };",
    );
    script.claim(format!("|left| <= {:e}", equation.left));
    script.note("equation left over", equation.left);
    script
}

/// The tangent's error, from what it leaves of the equation.
fn tangent_script(equation: &Equation) -> Script {
    let mut script = Script::new(equation.files[2], equation.stages[2], false);
    script.because("exact_u: the exact tangent, by which N is given; u the computed one. k is −K.");
    for line in [
        "exact_n = (-exact_k * (1 - exact_u * exact_u) + 2 * exact_m * exact_u) / (1 + exact_u * exact_u);",
        "w = exact_m - (exact_n - exact_k) * exact_u;",
        "left = -k * (1 - u * u) + 2 * m * u - n * (1 + u * u);",
        "exact_left = -exact_k * (1 - u * u) + 2 * exact_m * u - exact_n * (1 + u * u);",
    ] {
        script.define(line);
    }
    script.suppose_within("exact_k", MINUS_K);
    script.suppose_within("exact_m", equation.m);
    script.suppose_within("exact_n", N);
    script.suppose(format!("w >= {:e}", (LEAST_W_SQUARE - 1e-6).sqrt()));
    script.suppose(format!("|k - exact_k| <= {BEHIND:e}"));
    script.suppose(format!("|m - exact_m| <= {:e}", equation.m_error));
    script.suppose(format!("|n - exact_n| <= {OFFSET:e}"));
    script.suppose(format!("|u - exact_u| <= {:e}", equation.coarse));
    script.suppose(format!("|u| <= {TANGENT:e}"));
    script.suppose(format!("|left| <= {:e}", equation.left));
    script.hint("u - exact_u -> exact_left / (2 * w - (exact_n - exact_k) * (u - exact_u)) { 2 * w - (exact_n - exact_k) * (u - exact_u) <> 0 };");
    script.hint("exact_left -> left - (-(k - exact_k) * (1 - u * u) + 2 * (m - exact_m) * u - (n - exact_n) * (1 + u * u));");
    script.hint("$ u in 8;");
    script.claim(format!("|u - exact_u| <= {:e}", equation.tangent));
    script.note("error", equation.tangent);
    script
}
