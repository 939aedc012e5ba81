//! Condition numbers of the general model.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use common::Random;
use eel_kinematics::design::{self, Geometry, Jacobians, Matrix3, Vector3};

fn random_matrix(random: &mut Random) -> Matrix3<f64> {
    Matrix3::from_fn(|_, _| random.sign())
}

#[test]
fn singular_values_agree_with_nalgebra() {
    let mut random = Random::new(0xC0D1_7100_0000_0001);
    for _ in 0..5_000 {
        let matrix = random_matrix(&mut random);
        let found = design::singular_values(&matrix);
        let wanted = matrix.singular_values();
        for (found, wanted) in found.iter().zip(wanted.iter()) {
            assert!((found - wanted).abs() < 1e-13, "{matrix}");
        }
    }
}

#[test]
fn small_singular_values_are_not_lost() {
    let mut random = Random::new(0xC0D1_7100_0000_0002);
    for _ in 0..200 {
        let [yaw, pitch, roll] = random.vector(3.0);
        let turn = design::rotation(yaw, pitch, roll);
        let other = design::rotation(roll, yaw, pitch);
        let matrix = turn * Matrix3::from_diagonal(&Vector3::new(2.0, 1.0, 1e-6)) * other;
        let condition = design::condition(&matrix);
        assert!((condition / 2e6 - 1.0).abs() < 1e-9, "{condition}");
    }
}

#[test]
fn a_singular_matrix_is_conditioned_worse_than_any_wrist() {
    let flat = Matrix3::new(1.0, 2.0, 3.0, 2.0, 4.0, 6.0, 0.0, 1.0, 5.0);
    assert!(design::condition(&flat) > 1e14);
    assert_eq!(design::condition(&Matrix3::zeros()), f64::INFINITY);
    let lined_up = Jacobians {
        a: Matrix3::identity(),
        b: Vector3::new(0.0, 1.0, 1.0),
    };
    assert_eq!(lined_up.condition_of_rates(), f64::INFINITY);
}

#[test]
fn home_is_isotropic_and_the_prototype_gears_yaw_and_pitch_by_root_two() {
    let rotation = design::rotation(0.0, 0.0, 0.0);
    for (geometry, rates) in [
        (Geometry::PARALLEL_AXES, 1.0),
        (Geometry::ORTHOGONAL_AXES, 1.0),
        (Geometry::PARALLEL_ACTUATORS, 2f64.sqrt()),
    ] {
        let theta = geometry.inverse(&rotation).unwrap();
        let jacobians = geometry.jacobians(&rotation, &theta);
        assert!((jacobians.condition() - 1.0).abs() < 1e-12);
        assert!((jacobians.condition_of_rates() - rates).abs() < 1e-12);
    }
}
