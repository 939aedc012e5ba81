//! What the kernel takes on the host, beside the model in double precision: `cargo bench -p eel-kinematics`.
//!
//! Each figure is for one call on a random pose of the paper's workspace, the answer stored. Nothing is
//! asserted about time: on the target instructions are counted (`cargo xtask cycles`).

#![expect(clippy::float_arithmetic, reason = "poses are drawn as floats")]

use std::hint::black_box;

use divan::Bencher;
use eel_kinematics::design::{self, Geometry, Matrix3};
use eel_kinematics::{Bounds, Direct, Inverse, Jacobian, Joints, Policy, Pose, Shared, Wrist};
use eel_units::{Angle, Torque};

/// The paper's workspace: yaw ±30°, pitch ±15°, roll ±4°, in radians.
const WORKSPACE: [f64; 3] = [
    std::f64::consts::PI / 6.0,
    std::f64::consts::PI / 12.0,
    std::f64::consts::PI / 45.0,
];
/// How many poses there are; each is used in turn, so that branches can't be learned.
const POSES: usize = 4_096;
/// The seed of the poses.
const SEED: u64 = 0x0EE1_0000_0007;
const MODEL: Geometry = Geometry::PARALLEL_ACTUATORS;

fn main() {
    println!("seed {SEED:#x}, {POSES} poses");
    divan::main();
}

/// A pose with what the calls take.
struct Case {
    pose: Pose,
    joints: Joints,
    jacobian: Jacobian,
    rotation: Matrix3<f64>,
    theta: [f64; 3],
}

/// Draws poses of the workspace.
fn cases() -> Vec<Case> {
    let mut state = SEED;
    let mut part = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state as i64 as f64 / (1u64 << 63) as f64
    };
    let draw = |_| {
        let angles = WORKSPACE.map(|limit| Angle::from_q29((limit * part() * Q29) as i32));
        let [yaw, pitch, roll] = angles;
        let pose = Pose { yaw, pitch, roll };
        let Inverse { joints, .. } = Wrist::PAPER.inverse(&pose).expect("in the workspace");
        let Direct { jacobian, .. } = Wrist::PAPER.direct(&joints).expect("in the workspace");
        let [yaw, pitch, roll] = angles.map(radians);
        Case {
            pose,
            joints,
            jacobian,
            rotation: design::rotation(yaw, pitch, roll),
            theta: joints.0.map(radians),
        }
    };
    (0..POSES).map(draw).collect()
}

const Q29: f64 = (1u64 << 29) as f64;

fn radians(angle: Angle) -> f64 {
    f64::from(angle.to_q29()) / Q29
}

/// Measures a call on one pose after another.
fn each<Answer>(bencher: Bencher, call: impl Fn(&Case) -> Answer + Sync) {
    let cases = cases();
    let mut turn = cases.iter().cycle();
    bencher
        .with_inputs(move || turn.next().expect("a cycle has no end"))
        .bench_local_values(|case| call(black_box(case)));
}

/// Shares one moment after another at bounds of 3 N·m.
fn share(jacobian: &Jacobian, yaw_newton_metres: i32, policy: Policy) -> Shared {
    let bounds = [Bounds {
        low: Torque::from_millinewton_metres(-3_000),
        high: Torque::from_millinewton_metres(3_000),
    }; 3];
    let moment = [
        Torque::from_millinewton_metres(1_000 * yaw_newton_metres),
        Torque::from_millinewton_metres(200),
        Torque::from_millinewton_metres(-100),
    ];
    jacobian.share(black_box(&moment), black_box(&bounds), policy)
}

#[divan::bench]
fn inverse(bencher: Bencher) {
    each(bencher, |case| black_box(&Wrist::PAPER).inverse(&case.pose));
}

/// The platform and its margin alone, as the model's `design_direct` gives it: nobody asks for the Jacobian.
#[divan::bench]
fn direct_platform(bencher: Bencher) {
    each(bencher, |case| {
        let direct = black_box(&Wrist::PAPER).direct(&case.joints);
        direct.map(|direct| (direct.rotation, direct.margin()))
    });
}

#[divan::bench]
fn direct(bencher: Bencher) {
    each(bencher, |case| {
        black_box(&Wrist::PAPER).direct(&case.joints)
    });
}

#[divan::bench]
fn share_free(bencher: Bencher) {
    each(bencher, |case| share(&case.jacobian, 1, Policy::YawFirst));
}

#[divan::bench]
fn share_saturated(bencher: Bencher) {
    each(bencher, |case| share(&case.jacobian, 10, Policy::YawFirst));
}

#[divan::bench]
fn share_keeping_direction(bencher: Bencher) {
    each(bencher, |case| {
        share(&case.jacobian, 10, Policy::KeepDirection)
    });
}

#[divan::bench]
fn step(bencher: Bencher) {
    each(bencher, |case| {
        let wrist = black_box(&Wrist::PAPER);
        let inverse = wrist.inverse(&case.pose).ok()?;
        let direct = wrist.direct(&inverse.joints).ok()?;
        let shared = share(&direct.jacobian, 1, Policy::YawFirst);
        Some((inverse, direct, shared))
    });
}

#[divan::bench]
fn design_inverse(bencher: Bencher) {
    each(bencher, |case| black_box(&MODEL).inverse(&case.rotation));
}

#[divan::bench]
fn design_direct(bencher: Bencher) {
    each(bencher, |case| black_box(&MODEL).direct(&case.theta));
}

#[divan::bench]
fn design_jacobian(bencher: Bencher) {
    each(bencher, |case| {
        black_box(&MODEL)
            .jacobians(&case.rotation, &case.theta)
            .torque_map()
    });
}
