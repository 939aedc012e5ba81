//! Claims that do not hold: what the paper prints, and the computation that shows the error.

use eel_kinematics::design::{self, Geometry, Jacobians, Matrix3, Vector3};

use super::super::args::Architecture;
use super::super::place::at_home;
use super::claims::{ARCHITECTURES, grid};
use super::{Claim, Verdict};

const PROTOTYPE: Geometry = Geometry::PARALLEL_ACTUATORS;
/// Step of central differences, in rad.
const STEP: f64 = 1e-5;

/// Returns every erratum with what shows it.
pub fn all() -> Vec<Claim> {
    let mut claims = third_row();
    claims.extend(separation());
    claims.extend(signs());
    claims.push(crank());
    claims.push(plane());
    claims
}

/// Makes a claim of the paper that errs where `is_shown`.
fn erratum(
    number: u8,
    source: &'static str,
    claim: &str,
    printed: &str,
    computed: String,
    is_shown: bool,
) -> Claim {
    Claim {
        source,
        claim: claim.to_owned(),
        printed: printed.to_owned(),
        computed,
        verdict: if is_shown {
            Verdict::Erratum
        } else {
            Verdict::Fails
        },
        erratum: Some(number),
    }
}

/// A and B as Eq. (8) prints them.
fn printed(exact: &Jacobians) -> Jacobians {
    let mut printed = *exact;
    printed.a.set_row(2, &Vector3::z().transpose());
    printed.b[2] = 1.0;
    printed
}

/// The orientation turned about an axis of the base by a small angle.
fn turned(rotation: &Matrix3<f64>, axis: usize, angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut turn = Matrix3::identity();
    (turn[(j, j)], turn[(k, k)], turn[(k, j)], turn[(j, k)]) = (c, c, s, -s);
    turn * rotation
}

/// The motors' rates for a unit angular velocity about an axis, by central differences.
fn rates(rotation: &Matrix3<f64>, axis: usize) -> Option<Vector3<f64>> {
    let at = |angle: f64| {
        PROTOTYPE
            .inverse(&turned(rotation, axis, angle))
            .map(Vector3::from)
    };
    Some((at(STEP)? - at(-STEP)?) / (2.0 * STEP))
}

/// Erratum 1: row 3 of A and B₃₃.
fn third_row() -> Vec<Claim> {
    let (mut as_printed, mut exact_row, mut moment) = (0.0f64, 0.0f64, 0.0f64);
    for rotation in grid() {
        let Some(theta) = PROTOTYPE.inverse(&rotation) else {
            continue;
        };
        let exact = PROTOTYPE.jacobians(&rotation, &theta);
        let paper = printed(&exact);
        for axis in 0..3 {
            let omega = Vector3::ith(axis, 1.0);
            let (Some(wanted), Some(torques)) = (rates(&rotation, axis), paper.torques(&omega))
            else {
                continue;
            };
            as_printed = as_printed.max((paper.motor_rates(&omega)[2] - wanted[2]).abs());
            exact_row = exact_row.max((exact.motor_rates(&omega)[2] - wanted[2]).abs());
            moment = moment.max((exact.moment(&torques) - omega).norm());
        }
    }
    vec![
        erratum(
            1,
            "Eq. (8)",
            "row 3 of A is [0 0 1] and B33 = 1: error of motor 3's rate",
            "0",
            format!("up to {as_printed:.3}; with z'' and cos phi {exact_row:.0e}"),
            as_printed > 0.4 && exact_row < 1e-6,
        ),
        erratum(
            1,
            "Eq. (8)",
            "the same: error of a moment made with it",
            "0",
            format!("up to {:.0} %", moment * 100.0),
            moment > 0.5,
        ),
    ]
}

/// Erratum 2: the dot products that should tell the solutions apart.
fn separation() -> Vec<Claim> {
    let (mut legs, mut legs_apart) = (0.0f64, true);
    let (mut platforms, mut platforms_apart) = (0.0f64, true);
    for architecture in ARCHITECTURES {
        let geometry = architecture.geometry();
        for rotation in grid().step_by(7) {
            let Some([home, .., far]) = geometry.inverse_all(&rotation) else {
                continue;
            };
            for (k, leg) in geometry.legs.iter().enumerate() {
                let parts = |theta: f64| {
                    let l = leg.end(theta) - leg.center;
                    let r = rotation.column(k) - leg.end(theta);
                    (l.dot(&r), l.cross(&r).dot(&leg.axis))
                };
                let (one, other) = (parts(home[k]), parts(far[k]));
                legs = legs.max((one.0 - other.0).abs());
                legs_apart &= one.1 > 0.0 && other.1 < 0.0;
            }
            let product = |platform: &Matrix3<f64>| {
                let p = platform.column(1).into_owned();
                (p - geometry.legs[1].end(home[1])).dot(&p)
            };
            let [first, second, ..] = geometry.direct_all(&home);
            let (Some(first), Some(second)) = (first, second) else {
                platforms_apart = false;
                continue;
            };
            platforms = platforms.max((product(&first) - product(&second)).abs());
            platforms_apart &= geometry.jacobians(&first, &home).det_a() > 0.0
                && geometry.jacobians(&second, &home).det_a() < 0.0;
        }
    }
    vec![
        erratum(
            2,
            "inverse",
            "l·r tells the two solutions of a leg apart",
            "different",
            format!("differ by {legs:.0e}; the sign of (l×r)·i tells"),
            legs < 1e-12 && legs_apart,
        ),
        erratum(
            2,
            "direct",
            "r2·p2 tells the direct solutions apart",
            "different",
            format!("differ by {platforms:.0e}; the sign of det A tells"),
            platforms < 1e-12 && platforms_apart,
        ),
    ]
}

/// Erratum 3: two signs of the derivation.
fn signs() -> Vec<Claim> {
    let leg = &PROTOTYPE.legs[0];
    let theta = 0.3;
    let slope = (leg.end(theta + STEP) - leg.end(theta - STEP)) / (2.0 * STEP);
    let arm = leg.end(theta) - leg.center;
    let (off, right) = (
        (arm.cross(&leg.axis) - slope).norm(),
        (leg.axis.cross(&arm) - slope).norm(),
    );
    let rotation = design::rotation(0.2, 0.1, 0.05);
    let (mut sum, mut difference) = (0.0f64, 0.0f64);
    let exact = PROTOTYPE
        .inverse(&rotation)
        .map(|theta| PROTOTYPE.jacobians(&rotation, &theta));
    for axis in 0..3 {
        let (Some(exact), Some(rates)) = (&exact, rates(&rotation, axis)) else {
            continue;
        };
        let (a, b) = (
            exact.a * Vector3::ith(axis, 1.0),
            exact.b.component_mul(&rates),
        );
        sum = sum.max((a + b).norm());
        difference = difference.max((a - b).norm());
    }
    vec![
        erratum(
            3,
            "derivation",
            "the rate of l is l × i: error",
            "0",
            format!("{off:.3}; with i × l {right:.0e}"),
            off > 1.0 && right < 1e-9,
        ),
        erratum(
            3,
            "derivation",
            "A omega + B rates = 0: largest sum",
            "0",
            format!("{sum:.3}; A omega - B rates {difference:.0e}"),
            sum > 1.0 && difference < 1e-8,
        ),
    ]
}

/// Erratum 4: the crank of the architecture with orthogonal axes.
fn crank() -> Claim {
    let geometry = Architecture::OrthogonalAxes.geometry();
    let rotation = design::rotation(0.0, 0.0, 0.0);
    let leg = &geometry.legs[0];
    let length = (leg.end(0.0) - leg.center).norm();
    let rod = rotation.column(0) - leg.end(0.0);
    let b = at_home(&geometry).b;
    let is_shown = (rod.norm() - 1.0).abs() < 1e-12
        && rod.dot(&rotation.column(0)).abs() < 1e-12
        && (length - 2f64.sqrt()).abs() < 1e-12
        && (b - Vector3::new(1.0, 1.0, 1.0)).amax() < 1e-12;
    erratum(
        4,
        "orthogonal axes",
        "‖l‖ = 1 with A at O and r ⟂ p",
        "1",
        format!("{length:.6}; B is the identity all the same"),
        is_shown,
    )
}

/// Erratum 5: the plane of C1, C2 and O.
fn plane() -> Claim {
    let rotation = design::rotation(0.0, 0.0, 0.0);
    let (first, second) = (rotation.column(0), rotation.column(1));
    let beside = first[1].abs().max(second[1].abs());
    let above = first[2].abs().max(second[2].abs());
    erratum(
        5,
        "frames",
        "C1, C2 and O lie in the plane Oxz: largest distance at home",
        "0",
        format!("{beside:.6}; from O x_m y_m {above:.0e}"),
        beside > 0.5 && above < 1e-12,
    )
}
