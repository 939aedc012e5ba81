//! The scripts of what φ and ψ give: the platform's columns and the serial margins.

use super::direct::{Crank, first_axes, second_axes, second_equation, serial, sine_cosine};
use super::direct_proofs::{
    ACROSS2, BEHIND, CONSTANT, EQUATIONS, Equation, TANGENT, given_back, given_third, suppose_push,
};
use super::inverse_proofs::suppose_sines;
use super::primitives::RATIOS;
use crate::geometry::limits;
use crate::script::{Range, Script};
use crate::trace::Value;

/// The largest errors of sine and cosine of φ and of ψ.
const TURN: [[f64; 2]; 2] = [[8.6e-8, 7e-8], [6.5e-7, 4.8e-7]];
/// The largest errors of x'', of z'', of C2 and of the axis.
pub const X: f64 = 8.9e-8;
pub const Z: f64 = 8.9e-8;
const POINT: f64 = 1.06e-6;
const AXIS: f64 = 1.11e-6;
/// The largest error of B·x'' on leg 2.
pub const ALONG_ERROR: f64 = 4.05e-7;
/// The largest errors of the serial margins.
pub const SERIAL: [f64; 2] = [1.8e-7, 2.05e-6];

/// The scripts.
pub fn scripts() -> Vec<Script> {
    let mut scripts = vec![first_axes_script(), second_script(), second_axes_script()];
    for equation in &EQUATIONS {
        scripts.push(turn_script(equation));
        scripts.push(serial_script(equation.leg));
    }
    scripts
}

/// φ and ψ from their tangents.
fn turn_script(equation: &Equation) -> Script {
    let (file, stage) = [
        ("direct-phi-sine", "direct, sine and cosine of φ"),
        ("direct-psi-sine", "direct, sine and cosine of ψ"),
    ][equation.leg];
    let mut script = Script::new(file, stage, true);
    let tangent = script.trace.input("tangent", 31);
    let most = TANGENT + 1e-6;
    script.suppose_near(tangent, Range(-most, most), equation.tangent);
    script.suppose(format!("|tangent| <= {TANGENT:e}"));
    let [sine, cosine] = sine_cosine(&mut script.trace, tangent);
    script.because(
        "cosine: the quotient's proof. Its divisor is at least 1, its number less than that.",
    );
    script.suppose_primitive(cosine, RATIOS[1].1);
    script.because("of_tangent: the exact functions of the computed tangent; twice is 2 − 2⁻²⁹.");
    script.define("twice = 2 - 1b-29;");
    for line in [
        "cosine_of_tangent = twice / (1 + tangent * tangent) - 1;",
        "sine_of_tangent = tangent * twice / (1 + tangent * tangent);",
    ] {
        script.define_last(line);
    }
    let (t, exact) = ("tangent", "exact_tangent");
    let both = format!("((1 + {t} * {t}) * (1 + {exact} * {exact}))");
    for rule in [
        format!("{exact} -> {t} - ({t} - {exact});"),
        "sine - exact_sine -> (sine - sine_of_tangent) + (sine_of_tangent - exact_sine);".to_owned(),
        "cosine - exact_cosine -> (cosine - cosine_of_tangent) + (cosine_of_tangent - exact_cosine);".to_owned(),
        format!("sine_of_tangent - exact_sine -> twice * ({t} - {exact}) * (1 - {t} * {exact}) / {both};"),
        format!("cosine_of_tangent - exact_cosine -> -twice * ({t} - {exact}) * ({t} + {exact}) / {both};"),
        "sine - sine_of_tangent -> (sine_part - tangent * fall) + tangent * (cosine - cosine_of_tangent);".to_owned(),
        "cosine - cosine_of_tangent -> (cosine - cosine_number / cosine_divisor) + (cosine_number / cosine_divisor - cosine_of_tangent) { cosine_divisor <> 0 };".to_owned(),
        "cosine_number / cosine_divisor - cosine_of_tangent -> -twice * (tangent_square_q29 - tangent * tangent) / (cosine_divisor * (1 + tangent * tangent)) { cosine_divisor <> 0 };".to_owned(),
        "cosine -> (cosine - cosine_of_tangent) + cosine_of_tangent;".to_owned(),
        "exact_cosine -> twice / (1 + exact_tangent * exact_tangent) - 1;".to_owned(),
        "$ tangent in 16;".to_owned(),
    ] {
        script.hint(rule);
    }
    let errors = TURN[equation.leg];
    script.claim_near(sine, errors[0], "sine, error");
    script.claim_near(cosine, errors[1], "cosine, error");
    script.claim_within("exact_cosine", Range(0.599, 1.0));
    script
}

/// Takes sine and cosine of φ or ψ from outside.
pub fn given_turn(script: &mut Script, equation: &Equation) -> [Value; 2] {
    let values = script.trace.inputs(["turn_sine", "turn_cosine"], 30);
    script.because(
        "turn_sine, turn_cosine: within 53.2°, and below one by the code's 1 − 2⁻²⁹ − t².",
    );
    for ((value, range), error) in values
        .into_iter()
        .zip([Range(-0.8001, 0.8001), Range(0.599, 1.0)])
        .zip(TURN[equation.leg])
    {
        script.suppose_near(value, range, error);
    }
    script.suppose(format!("turn_cosine <= {}b-30", (1 << 30) - 1));
    values
}

fn first_axes_script() -> Script {
    let mut script = Script::new("direct-first-axes", "direct, x″ and z″", true);
    script.sharp = true;
    let [c3, s3] = given_third(&mut script);
    let turn = given_turn(&mut script, &EQUATIONS[0]);
    let [x, z] = first_axes(&mut script.trace, c3, s3, turn);
    for (value, range) in x.into_iter().zip(X_RANGE) {
        script.claim_within(&script.exact(value), range);
        script.claim_near(value, X, "");
    }
    for (value, range) in z.into_iter().zip(Z_RANGE) {
        script.claim_within(&script.exact(value), range);
        script.claim_near(value, Z, "");
    }
    script.note("each coordinate, error", X.max(Z));
    script
}

/// The range of x'' and z''.
pub const X_RANGE: [Range; 3] = [Range(0.16, 0.96), Range(0.16, 0.96), Range(-0.8002, 0.8002)];
pub const Z_RANGE: [Range; 3] = [
    Range(-0.769, 0.769),
    Range(-0.769, 0.769),
    Range(0.5989, 1.0001),
];

/// Takes x'' and z'' from outside.
pub fn given_axes(script: &mut Script) -> [[Value; 3]; 2] {
    let x = script.trace.inputs(["x_x", "x_y", "x_z"], 30);
    for (value, range) in x.into_iter().zip(X_RANGE) {
        script.suppose_near(value, range, X);
    }
    let z = script.trace.inputs(["z_x", "z_y", "z_z"], 31);
    for (value, range) in z.into_iter().zip(Z_RANGE) {
        script.suppose_near(value, range, Z);
    }
    [x, z]
}

fn second_script() -> Script {
    let mut script = Script::new("direct-psi-terms", "direct, terms of ψ's equation", true);
    let third = given_third(&mut script);
    let back = given_back(&mut script, 1);
    let axes = given_axes(&mut script);
    let crank = Crank {
        sine: third[0],
        cosine: third[0],
        back,
        offset: third[0],
    };
    let [behind, across, along] = second_equation(&mut script.trace, third, &crank, axes);
    // B·x'' stays in 64 bits until ψ is found.
    script.trace.long(along);
    script.claim_near(behind, BEHIND, "K, error");
    script.claim_near(across, ACROSS2, "M, error");
    script.claim_near(along, ALONG_ERROR, "B·x″, error");
    script
}

fn second_axes_script() -> Script {
    let mut script = Script::new("direct-second-axes", "direct, C2 and the axis", true);
    script.sharp = true;
    let third = given_third(&mut script);
    let [_, z] = given_axes(&mut script);
    let turn = given_turn(&mut script, &EQUATIONS[1]);
    let [point, axis] = second_axes(&mut script.trace, third, z, turn);
    for value in point {
        script.claim_near(value, POINT, "");
    }
    for value in axis {
        script.claim_near(value, AXIS, "");
    }
    script.note("C2, each coordinate, error", POINT);
    script.note("axis, each coordinate, error", AXIS);
    script
}

fn serial_script(leg: usize) -> Script {
    let (file, stage) = [
        ("direct-serial1", "direct, serial margin of leg 1"),
        ("direct-serial2", "direct, serial margin of leg 2"),
    ][leg];
    let mut script = Script::new(file, stage, true);
    let [sine, cosine] = script.trace.inputs(["sine", "cosine"], 30);
    suppose_sines(&mut script, [sine, cosine], 1.0, CONSTANT);
    let push = super::direct::push(&mut script.trace);
    suppose_push(&mut script, &push, leg);
    script.because("C is a unit vector.");
    let point = script.trace.inputs(["x", "y", "z"], 30);
    for value in point {
        script.suppose_near(value, Range(-1.0, 1.0), [X, POINT][leg]);
    }
    let back = push.back;
    let crank = Crank {
        sine,
        cosine,
        back,
        offset: push.offset,
    };
    let value = serial(&mut script.trace, &push, &crank, point);
    script.because("exact serial: (l×r)·i / ρ, at most s.");
    let (name, exact) = (script.name(value), script.exact(value));
    script.suppose(format!("|{exact}| <= {:e}", limits(leg).rod.1));
    script.hint(format!("{name} -> {exact} + ({name} - {exact});"));
    script.claim_near(value, SERIAL[leg], "error");
    script
}
