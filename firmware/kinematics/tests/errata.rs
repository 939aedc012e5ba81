//! Errata of the paper, each shown by what the printed formula gets wrong.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use common::{Random, pose_of, rate, rate_of};
use eel_kinematics::Wrist;
use eel_kinematics::design::{self, Geometry, Jacobians, Matrix3, Vector3};

/// A and B as Eq. (8) prints them: third row [0 0 1], B₃₃ = 1.
fn printed(exact: &Jacobians) -> Jacobians {
    let mut printed = *exact;
    printed
        .a
        .set_row(2, &Vector3::new(0.0, 0.0, 1.0).transpose());
    printed.b[2] = 1.0;
    printed
}

/// θ3' by central differences of the inverse, for ω about one axis of the base.
fn third_rate(geometry: &Geometry, rotation: &Matrix3<f64>, axis: usize) -> f64 {
    let step = 1e-5;
    let at = |angle: f64| {
        let (s, c) = (angle.sin(), angle.cos());
        let mut turn = Matrix3::identity();
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        turn[(j, j)] = c;
        turn[(k, k)] = c;
        turn[(k, j)] = s;
        turn[(j, k)] = -s;
        geometry.inverse(&(turn * rotation)).unwrap()[2]
    };
    (at(step) - at(-step)) / (2.0 * step)
}

#[test]
fn erratum_1_the_printed_third_row_is_wrong_away_from_home() {
    let geometry = Geometry::PARALLEL_ACTUATORS;
    let mut random = Random::new(0xE44A_7A00_0000_0001);
    let (mut printed_off, mut exact_off, mut kernel_off, mut moment_off) =
        (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    for _ in 0..20_000 {
        let pose = pose_of(random.pose(1.0));
        let rotation = common::exact_rotation(&pose);
        let theta = geometry.inverse(&rotation).unwrap();
        let exact = geometry.jacobians(&rotation, &theta);
        let joints = Wrist::PAPER.inverse(&pose).unwrap().joints;
        let kernel = Wrist::PAPER.direct(&joints).unwrap().jacobian;
        for axis in 0..3 {
            let mut omega = Vector3::zeros();
            omega[axis] = 1.0;
            let wanted = third_rate(&geometry, &rotation, axis);
            let of = |jacobians: &Jacobians| jacobians.motor_rates(&omega)[2];
            printed_off = printed_off.max((of(&printed(&exact)) - wanted).abs());
            exact_off = exact_off.max((of(&exact) - wanted).abs());
            let fixed = kernel.motor_rates([omega[0], omega[1], omega[2]].map(rate));
            kernel_off = kernel_off.max((rate_of(fixed[2]) - wanted).abs());
            // A commanded unit moment, made by the printed torque map on the true mechanism.
            let made = exact.moment(&printed(&exact).torques(&omega).unwrap());
            moment_off = moment_off.max((made - omega).norm());
        }
    }
    println!(
        "row 3 against finite differences: printed {printed_off:.3}, exact {exact_off:.1e}, \
         kernel {kernel_off:.1e}; a moment by the printed map is wrong by up to {:.0} %",
        moment_off * 100.0
    );
    assert!((0.45..=0.50).contains(&printed_off), "{printed_off}");
    assert!(
        exact_off <= 1e-9 && kernel_off <= 1e-6,
        "{exact_off:e} {kernel_off:e}"
    );
    assert!((0.5..=0.7).contains(&moment_off), "{moment_off}");
}

#[test]
fn erratum_1_is_not_seen_at_home() {
    let geometry = Geometry::PARALLEL_ACTUATORS;
    let rotation = design::rotation(0.0, 0.0, 0.0);
    let exact = geometry.jacobians(&rotation, &geometry.inverse(&rotation).unwrap());
    assert!((printed(&exact).a - exact.a).amax() < 1e-12);
}

#[test]
fn erratum_2_the_printed_criteria_separate_no_solutions() {
    let mut random = Random::new(0xE44A_7A00_0000_0002);
    for geometry in [
        Geometry::PARALLEL_AXES,
        Geometry::ORTHOGONAL_AXES,
        Geometry::PARALLEL_ACTUATORS,
    ] {
        for _ in 0..2_000 {
            let [yaw, pitch, roll] = random.pose(1.0);
            let rotation = design::rotation(yaw, pitch, roll);
            let solutions = geometry.inverse_all(&rotation).unwrap();
            let leg = &geometry.legs[0];
            let parts = |theta: f64| {
                let l = leg.end(theta) - leg.center;
                let r = rotation.column(0) - leg.end(theta);
                (l.dot(&r), l.cross(&r).dot(&leg.axis))
            };
            let (dot, side) = parts(solutions[0][0]);
            let (other_dot, other_side) = parts(solutions[2][0]);
            // l·r is the same for both solutions; the sign of (l×r)·i is not.
            assert!((dot - other_dot).abs() < 1e-12);
            assert!(side > 0.0 && other_side < 0.0, "{side} {other_side}");

            let theta = geometry.inverse(&rotation).unwrap();
            let second = &geometry.legs[1];
            let mut signs = Vec::new();
            for other in geometry.direct_all(&theta).into_iter().flatten() {
                let p = other.column(1).into_owned();
                let r = p - second.end(theta[1]);
                // r·p = (1 + s² − |B|²)/2 follows from the three fixed lengths.
                let home = rotation
                    .column(1)
                    .dot(&(rotation.column(1) - second.end(theta[1])));
                assert!((r.dot(&p) - home).abs() < 1e-12);
                signs.push(geometry.jacobians(&other, &theta).det_a());
            }
            assert!(signs[0] > 0.0 && signs[1] < 0.0, "{signs:?}");
        }
    }
}

#[test]
fn erratum_4_orthogonal_axes_need_a_crank_of_root_two() {
    let geometry = Geometry::ORTHOGONAL_AXES;
    let rotation = design::rotation(0.0, 0.0, 0.0);
    let theta = geometry.inverse(&rotation).unwrap();
    for (k, leg) in geometry.legs.iter().enumerate() {
        let rod = rotation.column(k) - leg.end(theta[k]);
        assert!((rod.norm() - 1.0).abs() < 1e-12 && rod.dot(&rotation.column(k)).abs() < 1e-12);
        assert!((leg.crank - 2f64.sqrt()).abs() < 1e-12);
    }
    let b = geometry.jacobians(&rotation, &theta).b;
    assert!((b - Vector3::new(1.0, 1.0, 1.0)).amax() < 1e-12);
}
