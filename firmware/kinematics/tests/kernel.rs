//! The fixed-point kernel against the model in double precision.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use common::{
    Q29, Q30, Random, angle_between, exact_joints, exact_rotation, matrix, newton_metres, pose_of,
    radians, rate, rate_of, torque,
};
use eel_kinematics::design::{Geometry, Vector3};
use eel_kinematics::{Joints, Pose, PoseError, Wrist};
use eel_units::Angle;

#[test]
fn the_papers_kernel_is_what_design_makes_of_its_geometry() {
    assert_eq!(Geometry::PARALLEL_ACTUATORS.kernel(), Some(Wrist::PAPER));
}

#[test]
fn home_is_home() {
    let inverse = Wrist::PAPER.inverse(&Pose::HOME).unwrap();
    for (found, wanted) in inverse.joints.0.into_iter().zip(Joints::HOME.0) {
        assert!((radians(found) - radians(wanted)).abs() <= 3e-9);
    }
    assert!((f64::from(inverse.margin()) / Q30 - 1.0).abs() < 1e-8);
    let direct = Wrist::PAPER.direct(&Joints::HOME).unwrap();
    assert!((f64::from(direct.jacobian.det_a()) / Q30 - 1.0).abs() < 4e-8);
    let moment = [torque(1.0), torque(0.0), torque(0.0)];
    let found = direct.jacobian.torques(moment).map(newton_metres);
    assert!(
        (found[0] - 0.5).abs() + (found[1] - 0.5).abs() + found[2].abs() < 3e-7,
        "{found:?}"
    );
}

#[test]
fn the_inverse_is_wrong_by_at_most_a_fiftieth_of_a_microradian() {
    let geometry = Geometry::PARALLEL_ACTUATORS;
    let mut random = Random::new(0x1D5E_ED00_0000_0001);
    let (mut worst, mut worst_beyond, mut least) = (0.0f64, 0.0f64, 2.0f64);
    for round in 0..300_000 {
        let beyond = round % 4 == 3;
        let pose = pose_of(random.pose(if beyond { 1.08 } else { 1.0 }));
        let exact = geometry.inverse(&exact_rotation(&pose)).unwrap();
        let found = Wrist::PAPER.inverse(&pose).unwrap();
        let error = exact_joints(&found.joints)
            .into_iter()
            .zip(exact)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        if beyond {
            worst_beyond = worst_beyond.max(error);
        } else {
            worst = worst.max(error);
            least = least.min(f64::from(found.margin()) / Q30);
        }
    }
    println!(
        "inverse: {:.4} µrad, {:.4} at 1.08 of the box, margin {least:.3}",
        worst * 1e6,
        worst_beyond * 1e6
    );
    assert!(worst <= 0.02e-6, "{worst:e}");
    assert!(worst_beyond <= 0.03e-6, "{worst_beyond:e}");
    assert!(least > 0.57);
}

#[test]
fn the_direct_kinematics_undoes_the_inverse_to_a_fiftieth_of_a_microradian() {
    let geometry = Geometry::PARALLEL_ACTUATORS;
    let mut random = Random::new(0x1D5E_ED00_0000_0002);
    let (mut round_trip, mut alone, mut torques) = (0.0f64, 0.0f64, 0.0f64);
    for _ in 0..200_000 {
        let pose = pose_of(random.pose(1.0));
        let inverse = Wrist::PAPER.inverse(&pose).unwrap();
        let direct = Wrist::PAPER.direct(&inverse.joints).unwrap();
        let found = matrix(&direct.rotation);
        round_trip = round_trip.max(angle_between(&found, &exact_rotation(&pose)));
        let theta = exact_joints(&inverse.joints);
        let exact = geometry.direct(&theta).unwrap();
        alone = alone.max(angle_between(&found, &exact));
        let back = direct.rotation.to_pose();
        for (a, b) in [
            (back.yaw, pose.yaw),
            (back.pitch, pose.pitch),
            (back.roll, pose.roll),
        ] {
            assert!((radians(a) - radians(b)).abs() <= 0.05e-6);
        }
        assert!(
            (direct.margin() - inverse.margin()).abs() < 40,
            "{direct:?} {inverse:?}"
        );

        let jacobians = geometry.jacobians(&exact, &theta);
        let det = f64::from(direct.jacobian.det_a()) / Q30;
        assert!((det - jacobians.det_a()).abs() < 4e-8 && det > 0.67);
        let map = jacobians.torque_map().unwrap();
        for (i, row) in direct.jacobian.torque_rows().iter().enumerate() {
            for (j, &entry) in row.iter().enumerate() {
                torques = torques.max((f64::from(entry) / 67_108_864.0 - map[(i, j)]).abs());
            }
        }
    }
    println!(
        "direct after inverse {:.4} µrad, direct {:.4} µrad, torque {:.4} µN·m per N·m",
        round_trip * 1e6,
        alone * 1e6,
        torques * 1e6
    );
    assert!(
        round_trip <= 0.02e-6 && alone <= 0.02e-6,
        "{round_trip:e} {alone:e}"
    );
    assert!(torques <= 0.1e-6, "{torques:e}");
}

#[test]
fn pure_yaw_turns_both_cranks_by_the_yaw_angle() {
    let mut worst = 0;
    for raw in (-520_000_000..=520_000_000).step_by(10_007) {
        let yaw = Angle::from_q29(raw);
        let joints = Wrist::PAPER
            .inverse(&Pose { yaw, ..Pose::HOME })
            .unwrap()
            .joints;
        for theta in &joints.0[..2] {
            worst = worst.max((theta.to_q29() - raw).abs());
        }
    }
    println!(
        "pure yaw to ±0.968 rad: {:.4} µrad",
        f64::from(worst) / Q29 * 1e6
    );
    assert!(f64::from(worst) / Q29 <= 0.02e-6);
}

#[test]
fn rates_and_torques_are_the_models() {
    let geometry = Geometry::PARALLEL_ACTUATORS;
    let mut random = Random::new(0x1D5E_ED00_0000_0003);
    let mut worst = [0.0f64; 4];
    for _ in 0..50_000 {
        let pose = pose_of(random.pose(1.0));
        let joints = Wrist::PAPER.inverse(&pose).unwrap().joints;
        let theta = exact_joints(&joints);
        let exact = geometry.direct(&theta).unwrap();
        let jacobians = geometry.jacobians(&exact, &theta);
        let jacobian = Wrist::PAPER.direct(&joints).unwrap().jacobian;
        let given = Vector3::from(random.vector(1.0));
        let fixed_rates = [given[0], given[1], given[2]].map(rate);
        let fixed_torques = [given[0], given[1], given[2]].map(torque);
        let maps = [
            (
                jacobian.motor_rates(fixed_rates).map(rate_of),
                jacobians.motor_rates(&given),
            ),
            (
                jacobian.angular_velocity(fixed_rates).map(rate_of),
                jacobians.angular_velocity(&given).unwrap(),
            ),
            (
                jacobian.torques(fixed_torques).map(newton_metres),
                jacobians.torques(&given).unwrap(),
            ),
            (
                jacobian.moment(fixed_torques).map(newton_metres),
                jacobians.moment(&given),
            ),
        ];
        for (worst, (found, wanted)) in worst.iter_mut().zip(maps) {
            *worst = worst.max((Vector3::from(found) - wanted).amax());
        }
    }
    println!("θ̇ of ω, ω of θ̇, τ of M, M of τ: {worst:?}");
    assert!(
        worst
            .iter()
            .zip([8e-7, 1.5e-7, 1.5e-7, 8e-7])
            .all(|(&error, bound)| error <= bound),
        "{worst:?}"
    );
}

#[test]
fn a_pose_beyond_the_mechanism_is_refused_with_the_reason() {
    let refuse = |angles| Wrist::PAPER.inverse(&pose_of(angles)).unwrap_err();
    assert_eq!(refuse([1.2, 0.0, 0.0]), PoseError::OutOfReach);
    assert_eq!(refuse([0.0, 0.0, 3.9]), PoseError::OutOfReach);
    // Along the corner of the workspace the margin goes through ¼ to zero.
    let mut seen = Vec::new();
    for step in 0..80 {
        let scale = 1.0 + f64::from(step) * 0.005;
        let corner = common::WORKSPACE.map(|limit| limit * scale);
        let answer = Wrist::PAPER.inverse(&pose_of([corner[0], -corner[1], corner[2]]));
        let other = Wrist::PAPER.inverse(&pose_of([corner[0], corner[1], corner[2]]));
        for answer in [answer.err(), other.err()] {
            if seen.last() != Some(&answer) && step > 0 {
                seen.push(answer);
            }
        }
    }
    assert!(seen.contains(&Some(PoseError::Singular)), "{seen:?}");
    assert!(seen.contains(&Some(PoseError::OutOfReach)), "{seen:?}");
}

#[test]
fn joints_that_do_not_fit_together_are_refused() {
    let refuse = |angles: [f64; 3]| Wrist::PAPER.direct(&Joints(angles.map(common::angle)));
    assert_eq!(refuse([1.2, 0.0, 0.785]), Err(PoseError::OutOfReach));
    assert_eq!(refuse([0.0, 0.0, 2.5]), Err(PoseError::OutOfReach));
    assert!(refuse([1.0, -1.0, 0.785]).is_err());
}

#[test]
fn every_geometry_within_tolerance_keeps_the_error_bounds() {
    let mut random = Random::new(0x1D5E_ED00_0000_0004);
    let (mut worst, mut round_trip) = (0.0f64, 0.0f64);
    let mut refused = 0;
    for _ in 0..1_000 {
        let geometry = common::within_tolerance(&mut random);
        let kernel = geometry.kernel().unwrap();
        for _ in 0..50 {
            let pose = pose_of(random.pose(1.0));
            let exact = exact_rotation(&pose);
            let Some(wanted) = geometry.inverse(&exact) else {
                refused += 1;
                continue;
            };
            let Ok(found) = kernel.inverse(&pose) else {
                refused += 1;
                continue;
            };
            for (a, b) in exact_joints(&found.joints).into_iter().zip(wanted) {
                worst = worst.max((a - b).abs());
            }
            let direct = kernel.direct(&found.joints).unwrap();
            round_trip = round_trip.max(angle_between(&matrix(&direct.rotation), &exact));
            let theta = exact_joints(&found.joints);
            let jacobians = geometry.jacobians(&geometry.direct(&theta).unwrap(), &theta);
            let det = f64::from(direct.jacobian.det_a()) / Q30;
            assert!((det - jacobians.det_a()).abs() < 4e-8);
        }
    }
    println!(
        "1000 geometries: inverse {:.4} µrad, direct after inverse {:.4} µrad, refused {refused}",
        worst * 1e6,
        round_trip * 1e6
    );
    assert!(
        // A unit at the end of the tolerance may lack a corner of the workspace.
        worst <= 0.03e-6 && round_trip <= 0.05e-6 && refused <= 100,
        "{worst:e} {round_trip:e}"
    );
}

#[test]
fn a_unit_out_of_tolerance_gets_no_kernel() {
    let mut geometry = Geometry::PARALLEL_ACTUATORS;
    geometry.legs[1].rod = 1.021;
    assert_eq!(geometry.kernel(), None);
    geometry.legs[1].rod = f64::NAN;
    assert_eq!(geometry.kernel(), None);
    assert_eq!(Geometry::ORTHOGONAL_AXES.kernel(), None);
}
