//! Condition numbers of the general model.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use common::{ARCHITECTURES, Random};
use eel_kinematics::design::{self, Geometry, Jacobians, Matrix3, Range, Travel, Vector3};

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

#[test]
fn isotropy_and_manipulability_agree_with_their_definitions() {
    let mut random = Random::new(0xC0D1_7100_0000_0003);
    for geometry in ARCHITECTURES {
        for _ in 0..2_000 {
            let [yaw, pitch, roll] = random.pose(1.0);
            let rotation = design::rotation(yaw, pitch, roll);
            let theta = geometry.inverse(&rotation).unwrap();
            let jacobians = geometry.jacobians(&rotation, &theta);
            let velocity = jacobians.velocity_map().unwrap();
            let definition = |map: &Matrix3<f64>| (map * map.transpose()).determinant().sqrt();
            let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
            assert!(close(jacobians.manipulability(), definition(&jacobians.a)));
            assert!(close(
                jacobians.manipulability_of_rates(),
                definition(&velocity)
            ));
            assert!(close(jacobians.isotropy() * jacobians.condition(), 1.0));
            // A map and its inverse are as far from isotropic.
            assert!(close(
                jacobians.isotropy_of_rates(),
                1.0 / design::condition(&velocity)
            ));
            assert!(jacobians.isotropy() <= 1.0 && jacobians.isotropy() > 0.1);
        }
    }
    let lined_up = Jacobians {
        a: Matrix3::identity(),
        b: Vector3::new(0.0, 1.0, 1.0),
    };
    assert_eq!(lined_up.isotropy_of_rates(), 0.0);
    assert_eq!(lined_up.manipulability_of_rates(), 0.0);
    assert_eq!(lined_up.moment_map(), None);
}

#[test]
fn global_indices_are_means_over_the_box() {
    for (geometry, of_a, of_rates) in [
        (Geometry::PARALLEL_AXES, 0.807, 0.809),
        (Geometry::ORTHOGONAL_AXES, 0.816, 0.814),
        (Geometry::PARALLEL_ACTUATORS, 0.806, 0.640),
    ] {
        let found = geometry.global_isotropy(&Travel::PAPER, 12);
        assert!((found.of_a - of_a).abs() < 1e-3, "{found:?}");
        assert!((found.of_rates - of_rates).abs() < 1e-3, "{found:?}");
        assert_eq!(found.in_reach, 1.0);
        let finer = geometry.global_isotropy(&Travel::PAPER, 20);
        assert!((finer.of_rates - found.of_rates).abs() < 1e-3);
    }
    let geometry = Geometry::PARALLEL_ACTUATORS;
    let point = [Range::from_degrees(0.0, 0.0); 3];
    let home = geometry.global_isotropy(&point, 0);
    assert!((home.of_a - 1.0).abs() < 1e-12);
    assert!((home.of_rates - core::f64::consts::FRAC_1_SQRT_2).abs() < 1e-12);
    let beyond = [Range::from_degrees(-80.0, 80.0); 3];
    let wide = geometry.global_isotropy(&beyond, 10);
    assert!(wide.in_reach < 0.8 && wide.of_a < wide.in_reach);
}
