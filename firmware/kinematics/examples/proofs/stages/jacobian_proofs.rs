//! The scripts of the map of torques and of sharing.

use super::columns_proofs::{ALONG_ERROR, SERIAL, given_axes, given_turn};
use super::direct::{along_parts, determinant, first, rows, second};
use super::direct_proofs::{BEHIND, EQUATIONS, LEAN, LEAST_W_SQUARE, given_third, most_square};
use super::primitives::RATIO_INVERSE;
use crate::geometry::limits;
use crate::script::{Range, Script};
use crate::trace::Value;

/// The largest errors of the rows of B A⁻ᵀ.
const ROWS: [f64; 3] = [6.8e-6, 5.5e-6, 1.15e-5];
/// The largest numbers of a row: about x, y and z.
const ENTRIES: [f64; 3] = [5.4, 5.4, 4.0];
/// The largest error of det A.
const DETERMINANT: f64 = 1.35e-6;
/// What a moment's component stays below for all of it to be shared at once, in N·m.
const MOMENT: f64 = crate::share::MOMENT_LIMIT as f64 / 16_777_216.0;

/// The scripts.
pub fn scripts() -> Vec<Script> {
    vec![map_script(), share_script()]
}

/// Takes W and (l×r)·i / ρ of a leg from outside.
fn given_margins(script: &mut Script, leg: usize) -> [Value; 2] {
    let names = [["margin1", "serial1"], ["margin2", "serial2"]][leg];
    let margin = script.trace.input(names[0], 29);
    let least = (LEAST_W_SQUARE - 1e-6).sqrt();
    let range = Range(least, most_square(leg).sqrt());
    script.suppose_near(margin, range, EQUATIONS[leg].margin);
    let serial = script.trace.input(names[1], 30);
    let least = f64::from(crate::direct::LEAST_SERIAL) / 1_073_741_824.0 - 1e-5;
    script.suppose_near(serial, Range(least, limits(leg).rod.1), SERIAL[leg]);
    [margin, serial]
}

fn map_script() -> Script {
    let mut script = Script::new("jacobian", "Jacobian, rows of the map of torques", true);
    let axes = given_axes(&mut script);
    let third = given_third(&mut script);
    script.because(
        "serial: at least LEAST_SERIAL, at most s. margin: from LEAST_ASSEMBLY_SQUARE to s/ρ.",
    );
    let [margin1, serial1] = given_margins(&mut script, 0);
    let [margin2, serial2] = given_margins(&mut script, 1);
    let across = script.trace.input("across", 30);
    script.suppose_near(across, Range(-1.99, 1.99), BEHIND);
    let turn = given_turn(&mut script, &EQUATIONS[1]);
    script.because("along: Q = B·x″ with Q² + W² = |C×B|²/ρ² at most (s/ρ)².");
    let along = script.trace.input("along", 30);
    let most = (most_square(1) - LEAST_W_SQUARE + 1e-6).sqrt();
    script.suppose_near(along, Range(-most, most), ALONG_ERROR);
    let trace = &mut script.trace;
    let parts = along_parts(trace, along, turn);
    let one = first(trace, margin1, serial1, across);
    let two = second(trace, margin2, serial2, parts);
    let cranks = trace.input("cranks", 31);
    let determinant = determinant(trace, margin1, margin2, cranks);
    let rows = rows(trace, axes, third, one, two);
    for name in ["inverse1", "inverse2"] {
        let value = script.trace.find(name);
        script.suppose_primitive(value, RATIO_INVERSE);
        script.hint(format!("{name} -> exact_{name} + ({name} - exact_{name});"));
    }
    script.because("cranks: ρ1 ρ2, of a unit within design's tolerance.");
    let product = limits(0).crank.times(limits(1).crank);
    script.suppose_near(cranks, product, 0.25 / 1_073_741_824.0);
    script.claim_near(determinant, DETERMINANT, "det A, error");
    script.because(
        "exact_lean1: its proof. Q / W: as along, so that its parts with ψ are below that.",
    );
    script.suppose_within("exact_lean1", LEAN);
    let most = (most_square(1) / (LEAST_W_SQUARE - 1e-6) - 1.0).sqrt();
    script.suppose(format!("|exact_lean2| <= {most:e}"));
    script.suppose(format!("|exact_skew| <= {:e}", most * 0.8001));
    for name in ["lean1", "lean2", "skew"] {
        script.hint(format!("{name} -> exact_{name} + ({name} - exact_{name});"));
    }
    for ((row, error), name) in rows.into_iter().zip(ROWS).zip(["1", "2", "3"]) {
        for (value, most) in row.into_iter().zip(ENTRIES) {
            script.claim_near(value, error, "");
            let name = script.name(value);
            script.claim_within(&name, Range(-most, most));
        }
        script.note(&format!("row {name}, error"), error);
    }
    script
}

fn share_script() -> Script {
    let mut script = Script::new("share", "sharing, all of a moment below 8 N·m", false);
    script.because(
        "The rows: their proof. Moments: share_whole and share_part keep them below 8 N·m.",
    );
    let row = script.trace.inputs(["row_x", "row_y", "row_z"], 26);
    let moment = script
        .trace
        .inputs(["moment_x", "moment_y", "moment_z"], 24);
    for (value, most) in row.into_iter().zip(ENTRIES) {
        script.suppose_exact(value, Range(-most, most));
    }
    for value in moment {
        script.suppose_exact(value, Range(-MOMENT, MOMENT));
    }
    let pairs: Vec<_> = row.into_iter().zip(moment).collect();
    script.trace.dot("torque", &pairs, 26);
    let bound = ENTRIES.iter().sum::<f64>() * MOMENT + 1e-6;
    script.claim(format!("|torque| <= {bound:e}"));
    script.note("torque, largest, N·m", bound);
    script
}
