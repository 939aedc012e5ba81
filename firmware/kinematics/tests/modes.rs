//! Working and assembly modes: each solution has a name, and is found again by it.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use core::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use common::{ARCHITECTURES, Random};
use eel_kinematics::design::{self, AssemblyMode, Geometry, Matrix3, WorkingMode};

#[test]
fn home_is_in_home_s_modes_and_names_are_distinct() {
    let rotation = design::rotation(0.0, 0.0, 0.0);
    for geometry in ARCHITECTURES {
        let theta = geometry.inverse(&rotation).unwrap();
        let (working, assembly) = (
            geometry.working_mode(&rotation, &theta),
            geometry.assembly_mode(&rotation, &theta),
        );
        assert_eq!(working, Some(WorkingMode::HOME));
        assert_eq!(assembly, Some(AssemblyMode::HOME));
        for depth in geometry.depths(&rotation, &theta) {
            assert!((depth - 1.0).abs() < 1e-12);
        }
    }
    assert_eq!(
        WorkingMode::ALL.map(WorkingMode::name),
        ["++", "+-", "-+", "--"]
    );
    assert_eq!(
        AssemblyMode::ALL.map(AssemblyMode::name),
        ["home", "other-psi", "other-phi", "other-both"]
    );
}

#[test]
fn inverse_in_a_mode_then_direct_in_the_configuration_s_mode_is_the_same_orientation() {
    let mut random = Random::new(0x30DE_5000_0000_0001);
    let mut worst = 0.0f64;
    let mut seen = [[0u32; 4]; 4];
    for geometry in ARCHITECTURES.map(|geometry| geometry.scaled(0.037).unwrap()) {
        for _ in 0..3_000 {
            let [yaw, pitch, roll] = random.pose(3.0);
            let rotation = design::rotation(yaw, pitch, roll);
            let Some(solutions) = geometry.inverse_all(&rotation) else {
                continue;
            };
            for (index, mode) in WorkingMode::ALL.into_iter().enumerate() {
                let theta = geometry.inverse_in(mode, &rotation).unwrap();
                assert_eq!(theta, solutions[index]);
                // Near a singularity roundings grow without bound.
                let margins = geometry.margins(&rotation, &theta).unwrap();
                let nearest = margins.depths.map(f64::abs);
                if nearest[0].min(nearest[1]) < 0.01 || margins.legs().abs() < 0.01 {
                    continue;
                }
                assert_eq!(geometry.working_mode(&rotation, &theta), Some(mode));
                let assembly = geometry.assembly_mode(&rotation, &theta).unwrap();
                let back = geometry.direct_in(assembly, &theta).unwrap();
                worst = worst.max((back - rotation).amax());
                let found = AssemblyMode::ALL.iter().position(|one| *one == assembly);
                seen[index][found.unwrap()] += 1;
            }
        }
    }
    println!("worst entry {worst:.1e}, working by assembly modes {seen:?}");
    assert!(worst < 1e-10, "{worst:e}");
    // Every working mode occurs, and every assembly mode.
    assert!(seen.iter().all(|row| row.iter().sum::<u32>() > 1_000));
    assert!((0..4).all(|k| seen.iter().map(|row| row[k]).sum::<u32>() > 10));
}

#[test]
fn direct_solutions_are_in_the_mode_that_they_are_asked_for() {
    let mut random = Random::new(0x30DE_5000_0000_0002);
    let mut counts = [0u32; 4];
    for geometry in ARCHITECTURES.map(|geometry| geometry.scaled(12.5).unwrap()) {
        for _ in 0..3_000 {
            let [a, b, c] = random.vector(1.2);
            let theta = [a, b, FRAC_PI_4 + c];
            let all = geometry.direct_all(&theta);
            for (index, mode) in AssemblyMode::ALL.into_iter().enumerate() {
                let found = geometry.direct_in(mode, &theta);
                assert_eq!(found, all[index]);
                let Some(rotation) = found else {
                    continue;
                };
                let depths = geometry.depths(&rotation, &theta);
                let jacobians = geometry.jacobians(&rotation, &theta);
                assert!((jacobians.det_a() - depths[0] * depths[1]).abs() < 1e-9);
                if depths[0].abs().min(depths[1].abs()) > 1e-6 {
                    assert_eq!(geometry.assembly_mode(&rotation, &theta), Some(mode));
                    counts[index] += 1;
                }
                // It closes both loops and is a rotation with motor 3's y' in its plane.
                for (k, leg) in geometry.legs.iter().enumerate() {
                    let rod = geometry.point(&rotation, k) - leg.end(theta[k]);
                    assert!((rod.norm() / leg.rod - 1.0).abs() < 1e-9);
                }
                assert!((rotation * rotation.transpose() - Matrix3::identity()).amax() < 1e-9);
                let [phi_root, ..] =
                    [rotation[(1, 0)] * theta[2].cos() - rotation[(0, 0)] * theta[2].sin()];
                assert!(phi_root.abs() < 1e-9);
            }
        }
    }
    println!("{counts:?}");
    assert!(counts.iter().all(|count| *count > 1_000), "{counts:?}");
}

#[test]
fn home_s_phi_has_the_greater_cosine_where_b1_is_below_the_base_plane() {
    let mut random = Random::new(0x30DE_5000_0000_0003);
    let mut counts = [0u32; 2];
    for geometry in ARCHITECTURES {
        for _ in 0..4_000 {
            let [a, b, c] = random.vector(1.5);
            let theta = [a, b, FRAC_PI_4 + c];
            let cosine = |rotation: Matrix3<f64>| {
                rotation[(0, 0)] * theta[2].cos() + rotation[(1, 0)] * theta[2].sin()
            };
            let [home, _, other, _] = geometry.direct_all(&theta).map(|one| one.map(cosine));
            let (Some(home), Some(other)) = (home, other) else {
                continue;
            };
            let height = geometry.legs[0].end(theta[0])[2];
            if height.abs() > 1e-3 && (home - other).abs() > 1e-9 {
                assert_eq!(home > other, height < 0.0, "{theta:?}");
                counts[usize::from(height < 0.0)] += 1;
            }
            if geometry == Geometry::PARALLEL_ACTUATORS {
                assert!(height < 0.0 && home.abs().min(other.abs()) < 1e-6);
                assert!(home < 1e-6 || other.abs() < 1e-6);
            }
        }
    }
    println!("B1 above and below the base plane: {counts:?}");
    assert!(counts[0] > 100 && counts[1] > 1_000, "{counts:?}");
}

#[test]
fn on_a_singularity_there_is_no_mode() {
    let geometry = Geometry::PARALLEL_ACTUATORS;
    assert_eq!(WorkingMode::of_signs(0.0, 1.0), None);
    assert_eq!(WorkingMode::of_signs(1.0, f64::NAN), None);
    assert_eq!(
        WorkingMode::of_signs(-1.0, 2.0),
        Some(WorkingMode::MinusPlus)
    );
    // The crank's end in the plane of the platform: B2·z_m = 0 by a platform turned onto it.
    let theta = [0.0, 0.0, FRAC_PI_4];
    let flat = Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0);
    let [_, second] = geometry.depths(&flat, &theta);
    let level = Geometry {
        legs: [
            geometry.legs[0],
            design::Leg {
                center: design::Vector3::new(0.0, 0.0, -1.0),
                ..geometry.legs[1]
            },
        ],
        ..geometry
    };
    assert!(second.abs() > 0.1);
    assert_eq!(level.depths(&flat, &theta)[1], 0.0);
    assert_eq!(level.assembly_mode(&flat, &theta), None);
}

#[test]
fn motors_angles_are_within_half_a_turn() {
    let mut random = Random::new(0x30DE_5000_0000_0004);
    let mut largest = 0.0f64;
    for geometry in ARCHITECTURES {
        for _ in 0..5_000 {
            let [yaw, pitch, roll] = random.vector(3.1);
            let rotation = design::rotation(yaw, pitch, roll);
            for theta in geometry.inverse_all(&rotation).into_iter().flatten() {
                for angle in theta {
                    assert!(angle.abs() <= core::f64::consts::PI);
                    largest = largest.max(angle.abs());
                }
            }
        }
    }
    assert!(largest > FRAC_PI_2, "the wrap was never asked for");
}
