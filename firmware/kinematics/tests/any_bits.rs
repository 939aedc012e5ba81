//! Whatever bits arrive: no panic, and an answer is either right or an error.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use common::{Q29, Random, angle_between, exact_joints, exact_rotation, matrix, radians};
use eel_kinematics::design::Geometry;
use eel_kinematics::{Bounds, Joints, Policy, Pose, PoseError, Rotation, Wrist};
use eel_units::{Angle, AngularVelocity, Torque};

/// Bits of every magnitude: full range, the kernel's range, corners.
fn bits(random: &mut Random) -> i32 {
    const CORNERS: [i32; 9] = [
        i32::MIN,
        i32::MIN + 1,
        -1,
        0,
        1,
        421_657_428,
        603_979_776,
        603_979_777,
        i32::MAX,
    ];
    match random.next() % 8 {
        0 => CORNERS[(random.next() % 9) as usize],
        1 => random.bits(),
        2 => random.bits() >> (random.next() % 31),
        _ => random.bits() >> 2,
    }
}

fn three(random: &mut Random) -> [i32; 3] {
    [bits(random), bits(random), bits(random)]
}

#[test]
fn the_inverse_answers_rightly_or_not_at_all() {
    let geometry = Geometry::PARALLEL_ACTUATORS;
    let mut random = Random::new(0xA11B_1750_0000_0001);
    let (mut answers, mut refusals, mut worst) = (0, 0, 0.0f64);
    for _ in 0..500_000 {
        let [yaw, pitch, roll] = three(&mut random).map(Angle::from_q29);
        let pose = Pose { yaw, pitch, roll };
        let Ok(found) = Wrist::PAPER.inverse(&pose) else {
            refusals += 1;
            continue;
        };
        answers += 1;
        let exact = geometry
            .inverse(&exact_rotation(&pose))
            .expect("reached in fixed point only");
        for (a, b) in exact_joints(&found.joints).into_iter().zip(exact) {
            worst = worst.max((a - b).abs());
        }
    }
    println!(
        "{answers} answers, {refusals} refusals, worst error {:.4} µrad",
        worst * 1e6
    );
    assert!(answers > 10_000 && refusals > 10_000);
    assert!(worst <= 0.05e-6, "{worst:e}");
}

#[test]
fn no_pose_with_an_answer_lies_beyond_a_singularity() {
    let mut random = Random::new(0xA11B_1750_0000_0005);
    let (mut answers, mut led_back, mut least, mut worst) = (0, 0, 2.0f64, 0.0f64);
    for round in 0..400 {
        let geometry = match round {
            0 => Geometry::PARALLEL_ACTUATORS,
            _ => common::within_tolerance(&mut random),
        };
        let wrist = geometry.kernel().expect("within tolerance");
        for _ in 0..2_000 {
            // The whole range of the kernel, and its ends.
            let ends = [1 << 29, 1 << 28, 1 << 28];
            let [yaw, pitch, roll] = ends.map(|end: i32| match random.next() % 4 {
                0 => Angle::from_q29(if random.next().is_multiple_of(2) {
                    end - 1
                } else {
                    -end
                }),
                _ => Angle::from_q29((f64::from(end) * random.sign()) as i32),
            });
            let pose = Pose { yaw, pitch, roll };
            let Ok(found) = wrist.inverse(&pose) else {
                continue;
            };
            answers += 1;
            let rotation = exact_rotation(&pose);
            let theta = geometry
                .inverse(&rotation)
                .expect("reached in fixed point only");
            least = least.min(geometry.jacobians(&rotation, &theta).det_a());
            if let Ok(direct) = wrist.direct(&found.joints) {
                led_back += 1;
                worst = worst.max(angle_between(&matrix(&direct.rotation), &rotation));
            }
        }
    }
    println!(
        "{answers} answers, least det A {least:.3}, {led_back} led back to {:.4} µrad",
        worst * 1e6
    );
    assert!(answers > 100_000 && led_back * 100 > answers * 99);
    assert!(least > 0.2 && worst <= 0.1e-6, "{least} {worst:e}");
}

#[test]
fn the_direct_kinematics_answers_rightly_or_not_at_all() {
    let mut geometry = Geometry::PARALLEL_ACTUATORS;
    let mut wrist = Wrist::PAPER;
    let mut random = Random::new(0xA11B_1750_0000_0002);
    let (mut answers, mut refusals, mut worst) = (0, 0, 0.0f64);
    for round in 0..500_000 {
        if round % 2_000 == 1_999 {
            geometry = common::within_tolerance(&mut random);
            wrist = geometry.kernel().expect("within tolerance");
        }
        let mut raw = three(&mut random);
        if random.next().is_multiple_of(2) {
            raw[2] = (raw[2] >> 1).saturating_add(421_657_428);
        }
        let joints = Joints(raw.map(Angle::from_q29));
        let Ok(found) = wrist.direct(&joints) else {
            refusals += 1;
            continue;
        };
        answers += 1;
        let exact = geometry
            .direct(&exact_joints(&joints))
            .expect("joined in fixed point only");
        worst = worst.max(angle_between(&matrix(&found.rotation), &exact));
        assert!(found.jacobian.det_a() > 0 && found.margin() > 0);
        // The working mode is home's too: the inverse leads back.
        if let Ok(back) = wrist.inverse(&found.rotation.to_pose()) {
            for (a, b) in back.joints.0.into_iter().zip(joints.0) {
                assert!(
                    (radians(a) - radians(b)).abs() < 1e-6,
                    "{joints:?} {back:?}"
                );
            }
        }
    }
    println!(
        "{answers} answers, {refusals} refusals, worst error {:.4} µrad",
        worst * 1e6
    );
    assert!(answers > 10_000 && refusals > 10_000);
    assert!(worst <= 0.1e-6, "{worst:e}");
}

#[test]
fn maps_and_sharing_survive_every_input() {
    let mut random = Random::new(0xA11B_1750_0000_0003);
    let mut jacobians = 0;
    while jacobians < 20_000 {
        let raw = three(&mut random).map(|raw| raw >> (random.next() % 3));
        let joints =
            Joints([raw[0], raw[1], raw[2].saturating_add(421_657_428)].map(Angle::from_q29));
        let Ok(direct) = Wrist::PAPER.direct(&joints) else {
            continue;
        };
        jacobians += 1;
        let jacobian = direct.jacobian;
        let given = three(&mut random);
        let rates = given.map(AngularVelocity::from_q24);
        let moment = given.map(Torque::from_q24);
        let _ = jacobian.motor_rates(rates);
        let _ = jacobian.angular_velocity(rates);
        let _ = jacobian.torques(moment);
        let _ = jacobian.moment(moment);
        let bounds = [(); 3].map(|()| Bounds {
            low: Torque::from_q24(bits(&mut random)),
            high: Torque::from_q24(bits(&mut random)),
        });
        for policy in [Policy::YawFirst, Policy::KeepDirection] {
            let shared = jacobian.share(&moment, &bounds, policy);
            for (torque, bound) in shared.torque.iter().zip(&bounds) {
                assert!(
                    *torque >= bound.low.min(Torque::ZERO)
                        && *torque <= bound.high.max(Torque::ZERO),
                    "{shared:?} {bounds:?}"
                );
            }
            for (achieved, asked) in shared.achieved.iter().zip(&moment) {
                let (achieved, asked) = (i64::from(achieved.to_q24()), i64::from(asked.to_q24()));
                assert!(achieved * asked.signum() >= 0 && achieved.abs() <= asked.abs());
            }
        }
    }
}

#[test]
fn poses_and_orientations_survive_every_input() {
    let mut random = Random::new(0xA11B_1750_0000_0004);
    let mut previous = Rotation::default();
    for _ in 0..100_000 {
        let [yaw, pitch, roll] = three(&mut random).map(Angle::from_q29);
        let pose = Pose { yaw, pitch, roll };
        let rotation = Rotation::from_pose(&pose);
        let exact = exact_rotation(&pose);
        assert!((matrix(&rotation) - exact).amax() <= 8e-9);
        let _ = pose.angular_velocity(three(&mut random).map(AngularVelocity::from_q24));
        let back = rotation.to_pose();
        if back.pitch.abs() < Angle::from_milliradians(1_000) {
            let turned = matrix(&Rotation::from_pose(&back));
            assert!((turned - exact).amax() <= 24e-9, "{pose:?} {back:?}");
        }
        let error = previous.error_to(&rotation);
        assert!(
            error
                .iter()
                .all(|angle| f64::from(angle.to_q29()).abs() / Q29 <= 1.571)
        );
        previous = rotation;
    }
}

#[test]
fn a_unit_at_its_tolerances_refuses_a_pose_whose_limit_passes_the_format() {
    // Found by the ranges of the proofs: G − E plus 17/32 of F + √D is above 2 here, more than Q30 holds.
    let mut geometry = Geometry::PARALLEL_ACTUATORS;
    let leg = &mut geometry.legs[0];
    leg.center = [0.713_063_264_7, 0.018_077_002_9, -1.019_9].into();
    leg.crank = 0.715_216_816_4;
    leg.rod = 1.012_446_680_7;
    let wrist = geometry.kernel().expect("within the tolerance");
    let [yaw, pitch, roll] = [535_258_380, -268_435_455, -149_052_183].map(Angle::from_q29);
    let answer = wrist.inverse(&Pose { yaw, pitch, roll });
    assert_eq!(answer, Err(PoseError::OutOfReach));
}
