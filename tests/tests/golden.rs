//! Golden vectors of the wrist, made apart from this project: 64 poses per architecture.
//!
//! `golden/wrist-*.csv` are never edited. The model in double precision must give them to 1e-12, the
//! firmware's kernel within its stated errors.

use eel_kinematics::design::{self, Geometry, Vector3};
use eel_kinematics::{Pose, Wrist};
use eel_units::{Angle, Torque};

/// One line of a file.
struct Line {
    pose: [f64; 3],
    theta: [f64; 3],
    phi: f64,
    psi: f64,
    det_a: f64,
    b: [f64; 3],
    /// Motor torques for unit moments about x, y, z: one row per moment.
    torques: [[f64; 3]; 3],
}

fn lines(text: &str) -> Vec<Line> {
    let lines: Vec<Line> = text
        .lines()
        .skip(1)
        .map(|line| {
            let numbers: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            assert_eq!(numbers.len(), 21, "{line}");
            let three = |at: usize| [numbers[at], numbers[at + 1], numbers[at + 2]];
            Line {
                pose: three(0),
                theta: three(3),
                phi: numbers[6],
                psi: numbers[7],
                det_a: numbers[8],
                b: three(9),
                torques: [three(12), three(15), three(18)],
            }
        })
        .collect();
    assert_eq!(lines.len(), 64);
    lines
}

fn close(found: f64, wanted: f64, tolerance: f64) {
    assert!(
        (found - wanted).abs() <= tolerance,
        "{found} instead of {wanted}"
    );
}

fn model_gives(geometry: &Geometry, text: &str) {
    for line in lines(text) {
        let [yaw, pitch, roll] = line.pose;
        let rotation = design::rotation(yaw, pitch, roll);
        let theta = geometry.inverse(&rotation).unwrap();
        let [_, phi, psi] = design::platform(&rotation);
        close(phi, line.phi, 1e-12);
        close(psi, line.psi, 1e-12);
        let jacobians = geometry.jacobians(&rotation, &theta);
        close(jacobians.det_a(), line.det_a, 1e-12);
        for k in 0..3 {
            close(theta[k], line.theta[k], 1e-12);
            close(jacobians.b[k], line.b[k], 1e-12);
            let mut moment = Vector3::zeros();
            moment[k] = 1.0;
            let torques = jacobians.torques(&moment).unwrap();
            for motor in 0..3 {
                close(torques[motor], line.torques[k][motor], 1e-12);
            }
        }
        let back = geometry.direct(&line.theta).unwrap();
        assert!((back - rotation).amax() < 1e-12);
    }
}

#[test]
fn the_model_gives_the_golden_vectors_of_parallel_axes() {
    model_gives(
        &Geometry::PARALLEL_AXES,
        include_str!("../golden/wrist-parallel-axes.csv"),
    );
}

#[test]
fn the_model_gives_the_golden_vectors_of_orthogonal_axes() {
    model_gives(
        &Geometry::ORTHOGONAL_AXES,
        include_str!("../golden/wrist-orthogonal-axes.csv"),
    );
}

#[test]
fn the_model_gives_the_golden_vectors_of_parallel_actuators() {
    model_gives(
        &Geometry::PARALLEL_ACTUATORS,
        include_str!("../golden/wrist-parallel-actuators.csv"),
    );
}

#[test]
fn the_kernel_gives_the_golden_vectors_of_its_architecture() {
    const Q29: f64 = (1u64 << 29) as f64;
    const Q30: f64 = (1u64 << 30) as f64;
    let one = Torque::from_q24(1 << 24);
    let mut worst = [0.0f64; 4];
    for line in lines(include_str!("../golden/wrist-parallel-actuators.csv")) {
        let [yaw, pitch, roll] = line.pose.map(|a| Angle::from_q29((a * Q29).round() as i32));
        let inverse = Wrist::PAPER.inverse(&Pose { yaw, pitch, roll }).unwrap();
        for k in 0..3 {
            let error = f64::from(inverse.joints.0[k].to_q29()) / Q29 - line.theta[k];
            worst[0] = worst[0].max(error.abs());
        }
        let direct = Wrist::PAPER.direct(&inverse.joints).unwrap();
        let back = direct.rotation.to_pose();
        for (found, wanted) in [back.yaw, back.pitch, back.roll].into_iter().zip(line.pose) {
            worst[1] = worst[1].max((f64::from(found.to_q29()) / Q29 - wanted).abs());
        }
        worst[2] = worst[2].max((f64::from(direct.jacobian.det_a()) / Q30 - line.det_a).abs());
        for axis in 0..3 {
            let mut moment = [Torque::ZERO; 3];
            moment[axis] = one;
            let torques = direct.jacobian.torques(moment);
            for (torque, wanted) in torques.iter().zip(line.torques[axis]) {
                let found = f64::from(torque.to_q24()) / f64::from(1 << 24);
                worst[3] = worst[3].max((found - wanted).abs());
            }
        }
    }
    println!(
        "inverse {:.4} µrad, there and back {:.4} µrad, det A {:.1e}, torque {:.3} µN·m",
        worst[0] * 1e6,
        worst[1] * 1e6,
        worst[2],
        worst[3] * 1e6
    );
    // A pose is rounded to 1.9 nrad before it is asked for.
    assert!(worst[0] <= 0.02e-6 && worst[1] <= 0.03e-6, "{worst:?}");
    assert!(worst[2] <= 2e-8 && worst[3] <= 0.1e-6, "{worst:?}");
}
