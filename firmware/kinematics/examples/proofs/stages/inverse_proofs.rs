//! The scripts of `Wrist::inverse`.

use core::f64::consts::FRAC_1_SQRT_2;

use super::inverse::{
    Platform, Pull, Solved, angles, assembly_room, platform, pull, small_ratio, solve, terms,
};
use super::inverse_ranges::{divisor_script, place_script, reach_script};
use super::primitives::{
    ARCTANGENT, COSINE, LEAST_SQUARE, MOST_SQUARE, RATIOS, ROOT, SINE, TANGENT,
};
use crate::geometry::limits;
use crate::script::{Range, Script};
use crate::trace::Value;

/// The largest error of x of a platform point over √2.
const POINT_X: f64 = 5.65e-9;
/// The largest error of a platform point's coordinate over √2.
const POINT: f64 = 8.91e-9;
/// The largest error of a coordinate of the platform's z axis.
const NORMAL: f64 = 6.6e-9;
/// The largest error of the assembly room.
const ROOM: f64 = 5.3e-6;
/// The largest error of θ3.
const THIRD: f64 = 7.8e-8;
/// The largest error of E and F.
const SIDE_E: f64 = 9.38e-9;
/// The largest error of G.
const SIDE_G: f64 = 2.18e-8;
/// The largest error of D/2.
const SQUARE: f64 = 1.2e-7;
/// The first, coarse bound of tan(θ/2).
const COARSE: f64 = 9e-7;
/// The largest error of a leg's constant, which is rounded to nearest in Q30.
const CONSTANT: f64 = 0.5 / 1_073_741_824.0;

/// Where a leg's equation is looked at: everywhere, or where the answer's margin is from this on.
pub struct Region {
    files: [&'static str; 2],
    stages: [&'static str; 2],
    /// D/2 at least, in the units of the code.
    pub least_square: f64,
    pub divisor_file: &'static str,
    pub divisor_stage: &'static str,
    /// F + √D at least, over √2, as a proof of ranges shows.
    pub least_divisor: f64,
    /// The largest error of the quotient.
    ratio: f64,
    /// The least number of which the root is taken, and the root's largest error from there on.
    least_root: f64,
    root: f64,
    /// The largest error of √(D/2).
    margin: f64,
    /// The most that a computed tangent leaves of its equation.
    left: f64,
    angle_file: &'static str,
    angle_stage: &'static str,
    /// The largest error of θ.
    angle: f64,
}

/// G − E and F + √D, over √2, wherever the kernel gets to their quotient.
pub const NUMBER: Range = Range(-1.0, 1.85);
pub const DIVISOR: Range = Range(0.2, 1.85);

/// The serial margin √D that the paper's workspace keeps on the ideal geometry.
const WORKSPACE_MARGIN: f64 = 0.57;

pub fn regions() -> [Region; 2] {
    [
        Region {
            files: ["inverse-leg1", "inverse-leg2"],
            stages: [
                "inverse, leg 1, wherever it answers",
                "inverse, leg 2, wherever it answers",
            ],
            divisor_file: "inverse-divisor",
            divisor_stage: "inverse, least divisor, wherever it answers",
            least_square: f64::from(crate::inverse::LEAST_SQUARE) / 268_435_456.0,
            least_divisor: RATIOS[0].0,
            ratio: RATIOS[0].1,
            least_root: LEAST_SQUARE,
            root: ROOT,
            margin: 3.3e-7,
            left: 6.2e-8,
            angle_file: "inverse-angle",
            angle_stage: "inverse, θ1 and θ2, wherever it answers",
            angle: 5.61e-7,
        },
        Region {
            files: ["inverse-leg1-margin", "inverse-leg2-margin"],
            stages: [
                "inverse, leg 1, margin from 0.57 on",
                "inverse, leg 2, margin from 0.57 on",
            ],
            divisor_file: "inverse-divisor-margin",
            divisor_stage: "inverse, least divisor, margin from 0.57 on",
            least_square: WORKSPACE_MARGIN * WORKSPACE_MARGIN / 2.0,
            least_divisor: RATIOS[1].0,
            ratio: RATIOS[1].1,
            least_root: 0.125,
            root: super::primitives::ROOT_FROM_EIGHTH,
            margin: 1.45e-7,
            left: 1.42e-8,
            angle_file: "inverse-angle-margin",
            angle_stage: "inverse, θ1 and θ2, margin from 0.57 on",
            angle: 1.34e-7,
        },
    ]
}

/// The scripts of the inverse.
pub fn scripts() -> Vec<Script> {
    let mut scripts = vec![
        points_script(),
        place_script(),
        third_script(),
        joints_script(),
        terms_script(0),
        terms_script(1),
        reach_script(),
        assembly_script(),
    ];
    for region in regions() {
        scripts.push(divisor_script(&region));
        scripts.push(leg_script(&region, 0));
        scripts.push(leg_script(&region, 1));
        scripts.push(angle_script(&region));
    }
    scripts
}

/// Supposes of sine and cosine what their proof says, for angles within a range that are off by a rounding.
pub fn suppose_sines(script: &mut Script, values: [Value; 2], angle: f64, rounding: f64) {
    let (sine, cosine) = angle.sin_cos();
    script.suppose_near(values[0], Range(-sine, sine).widened(1e-9), SINE + rounding);
    script.suppose_near(
        values[1],
        Range(cosine, 1.0).widened(1e-9),
        COSINE + rounding,
    );
    let name = script.name(values[1]);
    script.suppose(format!("{name} <= {}b-30", (1 << 30) - 1));
}

fn points_script() -> Script {
    let mut script = Script::new("inverse-points", "inverse, points C1 and C2 over √2", true);
    script.sharp = true;
    script.because("Yaw is within 1 rad, pitch and roll within half a radian: Pose::is_near.");
    let names = [
        ["sine_yaw", "cosine_yaw"],
        ["sine_pitch", "cosine_pitch"],
        ["sine_roll", "cosine_roll"],
    ];
    let sines = names.map(|names| script.trace.inputs(names, 30));
    for (values, angle) in sines.into_iter().zip([1.0, 0.5, 0.5]) {
        suppose_sines(&mut script, values, angle, 0.0);
    }
    let Platform { points, normal } = platform(&mut script.trace, sines);
    for value in &normal[1..] {
        script.claim_near(*value, NORMAL, "");
    }
    for [x, y, z] in points {
        script.claim_near(x, POINT_X, "");
        script.claim_near(y, POINT, "");
        script.claim_near(z, POINT, "");
    }
    script.note("each coordinate, error", POINT);
    script
}

/// Supposes what is known of an arctangent of t and of the exact t.
fn suppose_arctangent(script: &mut Script) {
    script.because(
        "atan_t, atan_exact: the arctangents' difference is that of t over 1 + ξ², ξ between them.",
    );
    script.suppose(format!("|turn - atan_t| <= {ARCTANGENT:e}"));
    script.suppose("|turn| <= 0.6");
    script.suppose(format!("|steepness| <= {:e}", 1.0 + 3.0 * COARSE));
}

/// The third motor, from C1 alone.
fn third_script() -> Script {
    let mut script = Script::new("inverse-third", "inverse, θ3", true);
    let [x, y] = script.trace.inputs(["x", "y"], 30);
    let side = FRAC_1_SQRT_2 + 1e-9;
    script.suppose_near(x, Range(LEAST_X, side), POINT_X);
    script.suppose_near(y, Range(-side, side), POINT);
    let number = script.trace.subtract("number", y, x);
    let divisor = script.trace.add("divisor", y, x);
    script.because("exact_divisor: the proof of the places.");
    let exact = script.exact(divisor);
    script.suppose(format!("{exact} >= {LEAST_THIRD:e}"));
    let tangent = small_ratio(&mut script.trace, number, divisor);
    script.because("half_tangent: small_ratio answers within ±17/32 only.");
    script.suppose(format!("|number / divisor| <= {TANGENT:e}"));
    script.suppose_primitive(tangent, RATIOS[0].1);
    script.claim_near(tangent, COARSE, "");
    for line in [
        "slope = steepness / (1 + half_tangent * half_tangent);",
        "atan_exact = atan_t - (half_tangent - exact_half_tangent) * slope;",
        "theta = quarter + fixed<-29,dn>(turn);",
        "exact_theta = exact_quarter + atan_exact;",
    ] {
        script.define_last(line);
    }
    suppose_arctangent(&mut script);
    script.hint("theta - exact_theta -> (quarter - exact_quarter) + (fixed<-29,dn>(turn) - turn) + (turn - atan_t) + (half_tangent - exact_half_tangent) * slope;");
    script.because("quarter: π/4 in Q29.");
    script.suppose(format!("|quarter - exact_quarter| <= {:e}", 2.0 * CONSTANT));
    script.claim(format!("|theta - exact_theta| <= {THIRD:e}"));
    script.note("θ3, error in rad", THIRD);
    script
}

/// How far leg 2's assembly margin is above the least.
fn assembly_script() -> Script {
    let mut script = Script::new("inverse-assembly", "inverse, leg 2, assembly room", true);
    let normal = script
        .trace
        .inputs(["normal_x", "normal_y", "normal_z"], 30);
    let slope = script.trace.inputs(["slope_x", "slope_y", "slope_z"], 30);
    let tangent = script.trace.input("half_tangent", 31);
    script.because("The platform's z axis is a unit vector; pitch is within half a radian.");
    for (value, side) in normal.into_iter().zip([0.48, 0.8415, 1.0]) {
        script.suppose_near(value, Range(-side, side), NORMAL);
    }
    for (value, range) in slope.into_iter().zip(limits(1).slope) {
        script.suppose_near(value, range, CONSTANT);
    }
    script.because(
        "half_tangent: small_ratio answers within ±17/32 only; its error: the proof of the legs.",
    );
    script.suppose_near(tangent, Range(-TANGENT, TANGENT), COARSE);
    let room = assembly_room(&mut script.trace, slope, normal, tangent);
    script.claim_near(room, ROOM, "(W − ¾)(1 + t²), error");
    script
}

/// The joints from their arctangents: no overflow.
fn joints_script() -> Script {
    let mut script = Script::new("inverse-joints", "inverse, the joints' angles fit", false);
    let tangents = script.trace.inputs(["t1", "t2", "t3"], 31);
    let zeros = script.trace.inputs(["zero1", "zero2"], 29);
    let joints = angles(&mut script.trace, tangents, zeros);
    script.because("turn: the arctangent of 17/32 is below 0.49. zero: within design's tolerance.");
    for value in tangents {
        script.suppose_exact(value, Range(-TANGENT, TANGENT));
        let turn = format!("turn_{}", script.name(value));
        script.suppose(format!("|{turn}| <= 0.49"));
        script.suppose(format!("@FIX({turn},-30)"));
    }
    let most = crate::design::kernel::TOLERANCE + 1e-6;
    for value in zeros {
        script.suppose_exact(value, Range(-most, most));
    }
    for value in &joints[..2] {
        script.claim(format!("|{}| <= 1.01", script.name(*value)));
    }
    script.note("θ1 and θ2, largest", 1.01);
    script
}

/// θ, from what its tangent leaves of the equation: far closer than from the tangent's parts.
fn angle_script(region: &Region) -> Script {
    let mut script = Script::new(region.angle_file, region.angle_stage, false);
    script.because(
        "exact_t = tan(θ/2) of the exact E and F, by which G is given; t is the computed one.",
    );
    script.because(
        "w = √(D/2), from what the code checks. Errors and first bound: the proofs of the legs.",
    );
    for line in [
        "exact_g = (exact_e * (1 - exact_t * exact_t) + 2 * exact_f * exact_t) / (1 + exact_t * exact_t);",
        "w = exact_f - (exact_e + exact_g) * exact_t;",
        "left = e * (1 - t * t) + 2 * f * t - g * (1 + t * t);",
        "exact_left = exact_e * (1 - t * t) + 2 * exact_f * t - exact_g * (1 + t * t);",
        "theta = 2 * turn - zero;",
        "slope = steepness / (1 + t * t);",
        "atan_exact = atan_t - (t - exact_t) * slope;",
        "exact_theta = 2 * atan_exact - exact_zero;",
    ] {
        script.define(line);
    }
    script.suppose_within("exact_e", Range(-0.73, 0.73));
    script.suppose_within("exact_f", Range(-0.1, 1.45));
    script.suppose_within("exact_g", Range(-1.5, 2.0));
    script.suppose(format!("w >= {:e}", region.least_square.sqrt() - 1e-6));
    script.suppose(format!("|exact_t| <= {:e}", TANGENT + COARSE));
    script.suppose(format!("|e - exact_e| <= {SIDE_E:e}"));
    script.suppose(format!("|f - exact_f| <= {SIDE_E:e}"));
    script.suppose(format!("|g - exact_g| <= {SIDE_G:e}"));
    script.suppose(format!("|t - exact_t| <= {COARSE:e}"));
    script.suppose(format!("|t| <= {TANGENT:e}"));
    script.suppose(format!("|left| <= {:e}", region.left));
    suppose_arctangent(&mut script);
    script.suppose(format!("|zero - exact_zero| <= {:e}", 2.0 * CONSTANT));
    script.suppose(format!(
        "|zero| <= {:e}",
        crate::design::kernel::TOLERANCE + 1e-6
    ));
    script.hint("t - exact_t -> exact_left / (2 * w - (exact_e + exact_g) * (t - exact_t)) { 2 * w - (exact_e + exact_g) * (t - exact_t) <> 0 };");
    script.hint("exact_left -> left - ((e - exact_e) * (1 - t * t) + 2 * (f - exact_f) * t - (g - exact_g) * (1 + t * t));");
    script.hint("theta - exact_theta -> 2 * ((turn - atan_t) + (t - exact_t) * slope) - (zero - exact_zero);");
    script.hint("$ t in 8;");
    script.claim("theta in [-4,2147483647b-29]");
    script.claim(format!("|theta - exact_theta| <= {:e}", region.angle));
    script.note("θ, error in rad", region.angle);
    script
}

/// The least |x| of a platform point over √2.
pub const LEAST_X: f64 = 0.1745;
/// The least x + y of C1 over √2.
pub const LEAST_THIRD: f64 = 0.35;
/// The least z of a platform point over √2.
pub const LEAST_Z: f64 = -0.63;

/// What is known of a platform point and of the constants.
fn suppose_leg(script: &mut Script, pull: &Pull, point: [Value; 3], leg: usize) {
    script.because(
        "C is a unit vector: no coordinate over √2 passes √½. Its x: the proof of the points.",
    );
    let side = FRAC_1_SQRT_2 + 1e-9;
    let x = if leg == 0 {
        Range(LEAST_X, side)
    } else {
        Range(-side, -LEAST_X)
    };
    script.suppose_near(point[0], x, POINT_X);
    script.suppose_near(point[1], Range(-side, side), POINT);
    script.suppose_near(point[2], Range(LEAST_Z, side), POINT);
    script.because(
        "The constants are those of a unit within design's tolerance, rounded to nearest.",
    );
    let limits = limits(leg);
    let half = Range(FRAC_1_SQRT_2, FRAC_1_SQRT_2);
    for (value, range) in pull.center.into_iter().zip(&limits.center[1..]) {
        script.suppose_near(value, range.times(half), CONSTANT);
    }
    for (value, range) in pull.slope.into_iter().zip(limits.slope) {
        script.suppose_near(value, range, CONSTANT);
    }
    script.suppose_near(pull.offset, limits.offset.times(half), CONSTANT);
}

/// What is computed before anything is known of D.
fn terms_script(leg: usize) -> Script {
    let (file, stage) = [
        (
            "inverse-leg1-terms",
            "inverse, leg 1, E, F, G before any check",
        ),
        (
            "inverse-leg2-terms",
            "inverse, leg 2, E, F, G before any check",
        ),
    ][leg];
    let mut script = Script::new(file, stage, true);
    let point = script.trace.inputs(["x", "y", "z"], 30);
    let pull = pull(&mut script.trace);
    suppose_leg(&mut script, &pull, point, leg);
    let [_, _, g, _] = terms(&mut script.trace, &pull, point);
    script.claim_near(g, SIDE_G, "G, error");
    script
}

fn leg_script(region: &Region, leg: usize) -> Script {
    let mut script = Script::new(region.files[leg], region.stages[leg], true);
    let point = script.trace.inputs(["x", "y", "z"], 30);
    let pull = pull(&mut script.trace);
    suppose_leg(&mut script, &pull, point, leg);
    let solved = solve(&mut script.trace, &pull, point);
    let Solved {
        e,
        f,
        g,
        square,
        root_of,
        margin,
        number,
        divisor,
        half_tangent,
    } = solved;
    script.because("square: the kernel answers from LEAST_SQUARE on.");
    let (name, exact) = (script.name(square), script.exact(square));
    script.suppose(format!("{name} >= {:e}", region.least_square));
    script.because("exact_square: √D is (l×r)·i / ρ, and |l×r| is at most ρ s.");
    let rod = limits(leg).rod.1;
    script.suppose(format!("{exact} <= {:e}", rod * rod / 2.0));
    script.hint(format!("{name} -> {exact} + ({name} - {exact});"));
    script.hint(format!("{exact} -> {name} - ({name} - {exact});"));
    script.claim_within(&script.name(root_of), Range(region.least_root, MOST_SQUARE));
    script.claim(format!(
        "{} >= {:e}",
        script.name(divisor),
        region.least_divisor
    ));
    script.suppose_primitive(margin, region.root);
    script.because("exact_number, exact_divisor: the proof of the ranges.");
    script.suppose_within(&script.exact(number), NUMBER);
    let least = region.least_divisor + 1e-5;
    script.suppose_within(&script.exact(divisor), Range(least, DIVISOR.1));
    script.because("half_tangent: small_ratio answers within ±17/32 only.");
    let quotient = format!("{} / {}", script.name(number), script.name(divisor));
    script.suppose(format!("|{quotient}| <= {TANGENT:e}"));
    script.suppose_primitive(half_tangent, region.ratio);
    script.claim_near(e, SIDE_E, "");
    script.claim_near(f, SIDE_E, "");
    script.claim_near(g, SIDE_G, "G, error");
    script.claim_near(square, SQUARE, "D/2, error");
    script.claim_near(margin, region.margin, "√(D/2), error");
    script.claim_near(half_tangent, COARSE, "tan(θ/2), first bound");
    // What the computed tangent leaves of the equation with the computed E, F, G: h(t).
    let [e, f, g, m] = [e, f, g, margin].map(|value| script.name(value));
    let (n, d, t) = (
        script.name(number),
        script.name(divisor),
        script.name(half_tangent),
    );
    let (square, root_of) = (script.name(square), script.name(root_of));
    script.define_last(format!(
        "left = {e} * (1 - {t} * {t}) + 2 * {f} * {t} - {g} * (1 + {t} * {t});"
    ));
    script.hint(format!(
        "left -> ({n} / {d}) / {d} * ({square} - {m} * {m}) + ({t} - {n} / {d}) * (2 * {f} - ({e} + {g}) * ({t} + {n} / {d})) {{ {d} <> 0 }};"
    ));
    script.hint(format!(
        "{square} - {m} * {m} -> ({square} - {root_of}) + ({root_of} - {m} * {m});"
    ));
    script.hint(format!(
        "{root_of} - {m} * {m} -> (sqrt({root_of}) - {m}) * (sqrt({root_of}) + {m}) {{ {root_of} >= 0 }};"
    ));
    script.claim(format!("|left| <= {:e}", region.left));
    script.note("equation left over", region.left);
    script
}
