//! Laws that hold whatever the formulas are: finite differences, virtual work, composition.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use common::{
    Random, angle_between, exact_rotation, newton_metres, pose_of, radians, rate, rate_of, torque,
};
use eel_kinematics::design::{self, Geometry, Matrix3, Vector3};
use eel_kinematics::{Rotation, Wrist};

/// The rotation by a vector, in radians.
fn turn(vector: &Vector3<f64>) -> Matrix3<f64> {
    let angle = vector.norm();
    if angle == 0.0 {
        return Matrix3::identity();
    }
    let k = (vector / angle).cross_matrix();
    Matrix3::identity() + k * angle.sin() + k * k * (1.0 - angle.cos())
}

#[test]
fn the_kernels_rates_are_the_finite_differences_of_the_inverse() {
    let geometry = Geometry::PARALLEL_ACTUATORS;
    let mut random = Random::new(0x1A35_0000_0000_0001);
    let (step, mut worst) = (1e-5, 0.0f64);
    for _ in 0..20_000 {
        let pose = pose_of(random.pose(1.0));
        let rotation = exact_rotation(&pose);
        let omega = Vector3::from(random.vector(1.0));
        let ahead = geometry
            .inverse(&(turn(&(omega * step)) * rotation))
            .unwrap();
        let behind = geometry
            .inverse(&(turn(&(omega * -step)) * rotation))
            .unwrap();
        let joints = Wrist::PAPER.inverse(&pose).unwrap().joints;
        let jacobian = Wrist::PAPER.direct(&joints).unwrap().jacobian;
        let found = jacobian
            .motor_rates([omega[0], omega[1], omega[2]].map(rate))
            .map(rate_of);
        for k in 0..3 {
            worst = worst.max((found[k] - (ahead[k] - behind[k]) / (2.0 * step)).abs());
        }
    }
    println!("Jacobian against finite differences: {worst:.1e}");
    assert!(worst <= 1e-6, "{worst:e}");
}

#[test]
fn the_models_rates_are_finite_differences_on_every_architecture() {
    let mut random = Random::new(0x1A35_0000_0000_0002);
    for geometry in [
        Geometry::PARALLEL_AXES,
        Geometry::ORTHOGONAL_AXES,
        Geometry::PARALLEL_ACTUATORS,
    ] {
        let (step, mut worst) = (1e-5, 0.0f64);
        for _ in 0..5_000 {
            let [yaw, pitch, roll] = random.pose(1.0);
            let rotation = design::rotation(yaw, pitch, roll);
            let omega = Vector3::from(random.vector(1.0));
            let theta = geometry.inverse(&rotation).unwrap();
            let ahead = Vector3::from(
                geometry
                    .inverse(&(turn(&(omega * step)) * rotation))
                    .unwrap(),
            );
            let behind = Vector3::from(
                geometry
                    .inverse(&(turn(&(omega * -step)) * rotation))
                    .unwrap(),
            );
            let jacobians = geometry.jacobians(&rotation, &theta);
            let rates = (ahead - behind) / (2.0 * step);
            worst = worst.max((jacobians.motor_rates(&omega) - rates).amax());
            worst = worst.max((jacobians.angular_velocity(&rates).unwrap() - omega).amax());
        }
        println!("model against finite differences: {worst:.1e}");
        assert!(worst <= 1e-8, "{worst:e}");
    }
}

#[test]
fn motors_do_the_work_that_the_platform_receives() {
    let mut random = Random::new(0x1A35_0000_0000_0003);
    let mut worst = 0.0f64;
    for _ in 0..50_000 {
        let pose = pose_of(random.pose(1.0));
        let joints = Wrist::PAPER.inverse(&pose).unwrap().joints;
        let jacobian = Wrist::PAPER.direct(&joints).unwrap().jacobian;
        let moment = random.vector(1.0).map(torque);
        let omega = random.vector(1.0).map(rate);
        let torques = jacobian.torques(moment);
        let rates = jacobian.motor_rates(omega);
        let platform: f64 = (0..3)
            .map(|k| newton_metres(moment[k]) * rate_of(omega[k]))
            .sum();
        let motors: f64 = (0..3)
            .map(|k| newton_metres(torques[k]) * rate_of(rates[k]))
            .sum();
        worst = worst.max((platform - motors).abs());
        let back = jacobian.moment(torques);
        for k in 0..3 {
            worst = worst.max((newton_metres(back[k]) - newton_metres(moment[k])).abs());
        }
    }
    println!("virtual work: {worst:.1e} W per N·m and rad/s");
    assert!(worst <= 1e-6, "{worst:e}");
}

#[test]
fn rates_of_a_pose_turn_the_platform() {
    let mut random = Random::new(0x1A35_0000_0000_0004);
    let (step, mut worst) = (1e-5, 0.0f64);
    for _ in 0..20_000 {
        let pose = pose_of(random.pose(2.0));
        let angles = [pose.yaw, pose.pitch, pose.roll].map(radians);
        let rates = random.vector(1.0);
        let at = |t: f64| {
            let [yaw, pitch, roll] = [0, 1, 2].map(|k| angles[k] + t * rates[k]);
            design::rotation(yaw, pitch, roll)
        };
        let derivative = (at(step) - at(-step)) / (2.0 * step) * at(0.0).transpose();
        let wanted = [derivative[(2, 1)], derivative[(0, 2)], derivative[(1, 0)]];
        let found = pose.angular_velocity(rates.map(rate)).map(rate_of);
        for k in 0..3 {
            worst = worst.max((found[k] - wanted[k]).abs());
        }
    }
    println!("angular velocity of a pose: {worst:.1e} rad/s");
    assert!(worst <= 2e-7, "{worst:e}");
}

#[test]
fn the_error_leads_to_the_target() {
    let mut random = Random::new(0x1A35_0000_0000_0005);
    let mut worst = 0.0f64;
    for _ in 0..50_000 {
        let (from, to) = (pose_of(random.pose(1.3)), pose_of(random.pose(1.3)));
        let error = Rotation::from_pose(&from).error_to(&Rotation::from_pose(&to));
        let vector = Vector3::from(error.map(radians));
        let angle = vector.norm();
        let reached = turn(&vector) * exact_rotation(&from);
        let missed = angle_between(&reached, &exact_rotation(&to));
        assert!(angle < core::f64::consts::FRAC_PI_2);
        assert!(missed <= 4e-6 * angle + 6e-9, "{missed:e} of {angle}");
        worst = worst.max(missed);
    }
    println!("error to the target misses by {worst:.1e} rad at most");
}

#[test]
fn a_longer_way_is_a_larger_error_up_to_a_right_angle() {
    let mut random = Random::new(0x1A35_0000_0000_0006);
    for _ in 0..200 {
        let axis = Vector3::from(random.vector(1.0)).normalize();
        let mut last = -1.0;
        for step in 0..=150 {
            // A way about any axis, through the poses on it.
            let turned = turn(&(axis * (0.01 * f64::from(step)))) * design::rotation(0.0, 0.0, 0.0);
            let target = Rotation::from_pose(&pose_of(design::pose(&turned)));
            let error = Rotation::default().error_to(&target).map(radians);
            let length = Vector3::from(error).norm();
            assert!(length > last, "{length} after {last}");
            last = length;
        }
    }
}

#[test]
fn every_solution_of_the_model_is_one() {
    let mut random = Random::new(0x1A35_0000_0000_0007);
    for geometry in [
        Geometry::PARALLEL_AXES,
        Geometry::ORTHOGONAL_AXES,
        Geometry::PARALLEL_ACTUATORS,
    ] {
        for _ in 0..5_000 {
            let [yaw, pitch, roll] = random.pose(1.0);
            let rotation = design::rotation(yaw, pitch, roll);
            let theta = geometry.inverse(&rotation).unwrap();
            let home = geometry.direct(&theta).unwrap();
            assert!((home - rotation).amax() < 1e-12, "{yaw} {pitch} {roll}");
            for theta in geometry.inverse_all(&rotation).unwrap() {
                for (k, leg) in geometry.legs.iter().enumerate() {
                    let rod = leg.end(theta[k]) - rotation.column(k);
                    assert!((rod.norm() - leg.rod).abs() < 1e-12);
                }
            }
            let mut found = 0;
            for other in geometry.direct_all(&theta).into_iter().flatten() {
                found += 1;
                for (k, leg) in geometry.legs.iter().enumerate() {
                    let rod = leg.end(theta[k]) - other.column(k);
                    assert!((rod.norm() - leg.rod).abs() < 1e-12);
                }
                assert!((other.transpose() * other - Matrix3::identity()).amax() < 1e-12);
            }
            assert!(found >= 2, "home and one more at least");
            assert!(geometry.jacobians(&home, &theta).det_a() > 0.0);
        }
    }
}
