//! The paper's numbers, and what holds over its workspace.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use core::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4, PI, SQRT_2};

use common::Random;
use eel_kinematics::design::{self, Geometry, Jacobians, Vector3};

fn at_home(geometry: &Geometry) -> Jacobians {
    let rotation = design::rotation(0.0, 0.0, 0.0);
    geometry.jacobians(&rotation, &geometry.inverse(&rotation).unwrap())
}

fn close(found: &Vector3<f64>, wanted: [f64; 3]) -> bool {
    (found - Vector3::from(wanted)).amax() < 1e-12
}

#[test]
fn a_is_isotropic_at_home_on_every_architecture() {
    for geometry in [
        Geometry::PARALLEL_AXES,
        Geometry::ORTHOGONAL_AXES,
        Geometry::PARALLEL_ACTUATORS,
    ] {
        let a = at_home(&geometry).a;
        assert!((a * a.transpose() - design::Matrix3::identity()).amax() < 1e-12);
        assert!((a.determinant() - 1.0).abs() < 1e-12);
    }
    assert!(close(&at_home(&Geometry::PARALLEL_AXES).b, [1.0; 3]));
    assert!(close(&at_home(&Geometry::ORTHOGONAL_AXES).b, [1.0; 3]));
    assert!(close(
        &at_home(&Geometry::PARALLEL_ACTUATORS).b,
        [FRAC_1_SQRT_2, FRAC_1_SQRT_2, 1.0]
    ));
}

#[test]
fn equal_cranks_give_pure_yaw_at_home() {
    let rates = Vector3::new(1.0, 1.0, 0.0);
    let moment = Vector3::new(1.0, 0.0, 0.0);
    for geometry in [Geometry::PARALLEL_AXES, Geometry::ORTHOGONAL_AXES] {
        let omega = at_home(&geometry).angular_velocity(&rates).unwrap();
        assert!(close(&omega, [SQRT_2, 0.0, 0.0]));
        let torques = at_home(&geometry).torques(&moment).unwrap();
        assert!(close(&torques, [FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0]));
    }
    let prototype = at_home(&Geometry::PARALLEL_ACTUATORS);
    assert!(close(
        &prototype.angular_velocity(&rates).unwrap(),
        [1.0, 0.0, 0.0]
    ));
    assert!(close(&prototype.torques(&moment).unwrap(), [0.5, 0.5, 0.0]));
}

#[test]
fn figure_12_has_its_four_direct_solutions() {
    let theta = [0.1, 0.2, FRAC_PI_4];
    let mut found: Vec<[f64; 2]> = Geometry::PARALLEL_ACTUATORS
        .direct_all(&theta)
        .into_iter()
        .map(|rotation| {
            let r = rotation.unwrap();
            // φ and ψ of R = Rz(θ3) Ry(φ) Rx(ψ) with θ3 known: Ry(φ) Rx(ψ) = Rz(−θ3) R.
            let turned = design::rotation_from_platform(-theta[2], 0.0, 0.0) * r;
            [
                libm::atan2(-turned[(2, 0)], turned[(0, 0)]),
                libm::atan2(-turned[(1, 2)], turned[(1, 1)]),
            ]
        })
        .collect();
    let home = found[0];
    assert!(
        (home[0] + 0.070_649).abs() < 1e-6 && (home[1] - 0.141_301).abs() < 1e-6,
        "{home:?}"
    );
    found.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let wanted = [
        [-0.070_649, -1.567_916],
        [-0.070_649, 0.141_301],
        [FRAC_PI_2, -0.529_444],
        [FRAC_PI_2, 0.509_311],
    ];
    for (found, wanted) in found.iter().zip(wanted) {
        assert!((found[0] - wanted[0]).abs() < 1e-6 && (found[1] - wanted[1]).abs() < 1e-6);
    }
}

#[test]
fn figure_13_has_its_inverse_solutions() {
    let rotation = design::rotation_from_platform(FRAC_PI_4, PI / 12.0, PI / 12.0);
    let [home, .., far] = Geometry::PARALLEL_ACTUATORS.inverse_all(&rotation).unwrap();
    for (found, wanted) in [
        (home[0], -0.373_828),
        (home[1], 0.369_056),
        (far[0], 2.026_265),
        (far[1], 1.714_940),
    ] {
        assert!((found - wanted).abs() < 1e-6, "{found} {wanted}");
    }
}

#[test]
fn home_has_two_solutions_a_leg() {
    let rotation = design::rotation(0.0, 0.0, 0.0);
    for (geometry, other) in [
        (Geometry::PARALLEL_ACTUATORS, 109.471_220_634_490_69),
        (Geometry::PARALLEL_AXES, 90.0),
        (Geometry::ORTHOGONAL_AXES, 90.0),
    ] {
        let [home, .., far] = geometry.inverse_all(&rotation).unwrap();
        for leg in 0..2 {
            assert!(home[leg].abs() < 1e-12);
            assert!(
                (far[leg].to_degrees() - other).abs() < 1e-9,
                "{}",
                far[leg].to_degrees()
            );
        }
    }
}

#[test]
fn the_workspace_holds_no_singularity() {
    let geometry = Geometry::PARALLEL_ACTUATORS;
    let mut random = Random::new(0x9A9E_4000_0000_0001);
    let mut least = [f64::INFINITY; 3];
    for _ in 0..100_000 {
        let [yaw, pitch, roll] = random.pose(1.0);
        let rotation = design::rotation(yaw, pitch, roll);
        let jacobians = geometry.jacobians(&rotation, &geometry.inverse(&rotation).unwrap());
        least[0] = least[0].min(jacobians.det_a());
        least[1] = least[1].min(jacobians.b[0].min(jacobians.b[1]));
        least[2] = least[2].min(jacobians.b[2]);
    }
    println!(
        "least det A {:.3}, bᵢ {:.3}, cos φ {:.3}",
        least[0], least[1], least[2]
    );
    assert!(
        least[0] >= 0.674 && least[1] >= 0.406 && least[2] >= 0.851,
        "{least:?}"
    );
}

#[test]
fn the_platform_s_angles_are_those_that_its_orientation_was_made_of() {
    let mut random = Random::new(0x9A9E_4000_0000_0007);
    for _ in 0..10_000 {
        let angles = [PI, FRAC_PI_2, PI].map(|limit| 0.999 * limit * random.sign());
        let [theta3, phi, psi] = angles;
        let found = design::platform(&design::rotation_from_platform(theta3, phi, psi));
        for (found, wanted) in found.iter().zip(angles) {
            assert!((found - wanted).abs() < 1e-9, "{found} instead of {wanted}");
        }
    }
}
