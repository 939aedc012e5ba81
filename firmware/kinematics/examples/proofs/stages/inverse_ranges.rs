//! The scripts of where exact numbers of the inverse can be: points, G − E, F + √D.

use core::f64::consts::FRAC_1_SQRT_2;

use super::inverse_proofs::{DIVISOR, LEAST_THIRD, LEAST_X, LEAST_Z, NUMBER, Region, regions};
use super::primitives::TANGENT;
use crate::geometry::limits;
use crate::script::{Range, Script};

/// A script on exact numbers, G written out: of a leg with D/2 from `least_square` on.
fn range_script(file: &'static str, stage: &'static str, least_square: f64) -> Script {
    let mut script = Script::new(file, stage, false);
    script
        .because("x, y, z: C over √2, a unit vector; leg 2 mirrors x. All numbers are exact here.");
    script
        .because("center: A over √2. G is (u² + E² + F² + (ρ² − s²)/2) / √2 ρ with u = x − A's x.");
    for line in [
        "rest = 0.5 - x * x - z * z;",
        "y = side * sqrt(rest);",
        "e = y - center_y;",
        "f = z - center_z;",
        "u = x - center_x;",
        "both = rest - 2 * y * center_y + center_y * center_y + f * f;",
        "g = (u * u + both + lengths) / crank;",
        "square = both - g * g;",
        "number = g - e;",
        "divisor = f + sqrt(square);",
    ] {
        script.define(line);
    }
    let limits = limits(0);
    let half = Range(FRAC_1_SQRT_2, FRAC_1_SQRT_2);
    let unit = FRAC_1_SQRT_2 + 1e-9;
    script.suppose_within("x", Range(LEAST_X, unit));
    script.suppose_within("z", Range(LEAST_Z, unit));
    script.suppose("|side| <= 1");
    script.suppose("rest >= 0");
    for (name, range) in ["center_x", "center_y", "center_z"]
        .iter()
        .zip(limits.center)
    {
        script.suppose_within(name, range.times(half));
    }
    let minus = Range(-1.0, -1.0);
    let lengths = limits.crank.square().plus(limits.rod.square().times(minus));
    script.suppose_within("lengths", lengths.times(Range(0.5, 0.5)));
    script.suppose_within("crank", limits.crank.over(half));
    script.because("square: D/2 from what the code checks, less its error, to s²/2.");
    script.suppose(format!("square >= {:e}", least_square - 1e-6));
    let rod = limits.rod.1;
    script.suppose(format!("square <= {:e}", rod * rod / 2.0));
    script
}

/// Numerator and denominator of tan(θ/2) where D suffices.
pub fn reach_script() -> Script {
    let least = regions()[0].least_square;
    let mut script = range_script(
        "inverse-range",
        "inverse, ranges of G − E and F + √D",
        least,
    );
    script.claim_within("number", NUMBER);
    script.claim_within("divisor", DIVISOR);
    script.note("G − E, largest", NUMBER.1);
    script.note("F + √D, largest", DIVISOR.1);
    script.hint("$ z in 48, x in 12;");
    script
}

/// The least denominator where the tangent is one that the code accepts.
pub fn divisor_script(region: &Region) -> Script {
    let (file, stage) = (region.divisor_file, region.divisor_stage);
    let mut script = range_script(file, stage, region.least_square);
    script.because("number / divisor: the code's limit, and a little for its errors.");
    let limit = TANGENT + 1e-5;
    script.suppose_within("number / divisor", Range(-limit, limit));
    // A little more, for the errors of the computed one.
    script.claim(format!("divisor >= {:e}", region.least_divisor + 1e-5));
    script.note("F + √D, least", region.least_divisor);
    script.hint("$ z in 64, x in 12;");
    script
}

/// Where the platform's points can be for the angles that the kernel takes.
pub fn place_script() -> Script {
    let mut script = Script::new(
        "inverse-places",
        "inverse, where C1 and C2 are, over √2",
        false,
    );
    script.because(
        "Yaw is within 1 rad, pitch and roll within half a radian. All numbers are exact here.",
    );
    for line in [
        "cy = sqrt(1 - sy * sy);",
        "cp = sqrt(1 - sp * sp);",
        "cr = sqrt(1 - sr * sr);",
        "sq = (cr + sr) / 2;",
        "cq = (cr - sr) / 2;",
        "x1 = cp * cq;",
        "x2 = -cp * sq;",
        "z1 = sy * sq - cy * sp * cq;",
        "z2 = sy * cq + cy * sp * sq;",
        "sum = cp * cq + cy * sq + sy * sp * cq;",
    ] {
        script.define(line);
    }
    for (name, angle) in [("sy", 1.0f64), ("sp", 0.5), ("sr", 0.5)] {
        let sine = angle.sin() + 1e-9;
        script.suppose_within(name, Range(-sine, sine));
    }
    script.claim_within("x1", Range(LEAST_X, 0.75));
    script.claim_within("x2", Range(-0.75, -LEAST_X));
    script.claim_within("z1", Range(LEAST_Z, 0.75));
    script.claim_within("z2", Range(LEAST_Z, 0.75));
    script.claim(format!("sum >= {LEAST_THIRD:e}"));
    script.note("|x|, least", LEAST_X);
    script.note("z, least", LEAST_Z);
    script.note("x + y of C1, least", LEAST_THIRD);
    script.hint("$ sr in 24, sy in 16;");
    script
}
