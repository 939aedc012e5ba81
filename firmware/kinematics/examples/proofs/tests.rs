//! What is proven is what runs: every trace gives the kernel's bits, and without rounding the model's numbers.

use eel_units::{Angle, arctangents, ratio_q30, root_near, sin_cos_near};

use crate::design::{self, Geometry};
use crate::pose::{Joints, Pose};
use crate::stages::{direct, inverse, primitives};
use crate::trace::{Trace, Value};
use crate::vector::times_root_two;
use crate::wrist::Wrist;

/// A seeded generator (xorshift64*).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        println!("seed {seed:#x}");
        Self(seed)
    }

    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// An integer from low to high.
    pub fn within(&mut self, low: i64, high: i64) -> i64 {
        low + (self.next() % (high - low + 1) as u64) as i64
    }

    /// A number in −1..1, sometimes at an end.
    pub fn sign(&mut self) -> f64 {
        let number = self.within(-1 << 30, 1 << 30) as f64 / f64::from(1 << 30);
        if self.next().is_multiple_of(6) {
            number.signum()
        } else {
            number
        }
    }

    /// A unit within the tolerance, its zeros too.
    pub fn geometry(&mut self) -> Geometry {
        let mut geometry = Geometry::PARALLEL_ACTUATORS;
        for leg in &mut geometry.legs {
            for k in 0..3 {
                leg.center[k] += 0.0199 * self.sign();
            }
            leg.crank *= 1.0 + 0.0199 * self.sign();
            leg.rod *= 1.0 + 0.0199 * self.sign();
            let (sine, cosine) = (0.0199 * self.sign()).sin_cos();
            leg.zero = design::Vector3::new(0.0, cosine, sine);
        }
        geometry
    }

    /// Joints within the kernel's range.
    pub fn joints(&mut self) -> Joints {
        let mut angle = |most: f64| (self.sign() * most * f64::from(1 << 29)) as i32;
        let quarter = Angle::FRAC_PI_4.to_q29();
        Joints([angle(0.97), angle(0.97), quarter + angle(0.4999)].map(Angle::from_q29))
    }

    /// A pose within the kernel's range, more often near home.
    pub fn pose(&mut self) -> Pose {
        let size = if self.next().is_multiple_of(2) {
            1.0
        } else {
            0.55
        };
        let mut angle = |most: f64| {
            let number = (self.sign() * most * size * f64::from(1 << 29)) as i32;
            Angle::from_q29(number.min((most * f64::from(1 << 29)) as i32 - 1))
        };
        Pose {
            yaw: angle(1.0),
            pitch: angle(0.5),
            roll: angle(0.5),
        }
    }
}

#[test]
fn the_primitives_are_those_of_eel_units() {
    let mut random = Random::new(0x1D5E_ED00_0000_0101);
    let mut trace = Trace::default();
    let angle = trace.input("angle", 31);
    let [sine, cosine] = primitives::sine_cosine(&mut trace, angle);
    let mut other = Trace::default();
    let tangent = other.input("tangent", 31);
    let turn = primitives::arctangent(&mut other, tangent);
    for _ in 0..100_000 {
        let integer = random.within(-1 << 29, (1 << 29) - 1);
        let run = trace.run(&[integer << 2]);
        let [(s, c)] = sin_cos_near([Angle::from_q29(integer as i32)]);
        assert_eq!((run.at(sine), run.at(cosine)), (s.into(), c.into()));
        let integer = random.within(-17 << 26, 17 << 26);
        let [found] = arctangents([integer as i32]);
        assert_eq!(other.run(&[integer]).at(turn), i64::from(found));
    }
}

#[test]
fn quotient_and_root_are_those_of_eel_units() {
    let mut random = Random::new(0x1D5E_ED00_0000_0102);
    let mut trace = Trace::default();
    let (number, divisor) = (trace.input("number", 0), trace.input("divisor", 0));
    let quotient = primitives::ratio(&mut trace, number, divisor);
    let mut other = Trace::default();
    let square = other.input("square", 31);
    let root = primitives::root(&mut other, square);
    for _ in 0..100_000 {
        let d = random.within(247_000_000, i32::MAX.into());
        let n = random.within(0, (d / 16 * 17).min(i32::MAX.into()));
        let found = ratio_q30(n as i32, d as i32);
        assert_eq!(trace.run(&[n, d]).at(quotient), i64::from(found));
        // The proof is for numbers that are not negative: the others mirror it.
        assert_eq!(ratio_q30(-(n as i32), d as i32), -found);
        let s = random.within(1 << 26, 1_181_116_006);
        assert_eq!(other.run(&[s]).at(root), i64::from(root_near(s as i32)));
    }
}

/// The whole inverse, from the pose's angles and the constants to the joints and both margins.
fn whole_inverse() -> (Trace, [Value; 3], [Value; 2], [Value; 3], Value) {
    let mut trace = Trace::default();
    let angles = trace.inputs(["yaw", "pitch", "roll"], 29);
    let pulls = [inverse::pull(&mut trace), inverse::pull(&mut trace)];
    let zeros = trace.inputs(["zero1", "zero2"], 29);
    let sines = angles.map(|angle| trace.sine_cosine("", angle));
    let inverse::Platform {
        points: [first, second],
        normal,
    } = inverse::platform(&mut trace, sines);
    let one = inverse::solve(&mut trace, &pulls[0], first);
    let two = inverse::solve(&mut trace, &pulls[1], second);
    let room = inverse::assembly_room(&mut trace, pulls[1].slope, normal, two.half_tangent);
    let number = trace.subtract("number", first[1], first[0]);
    let divisor = trace.add("divisor", first[1], first[0]);
    let third = inverse::small_ratio(&mut trace, number, divisor);
    let tangents = [one.half_tangent, two.half_tangent, third];
    let joints = inverse::angles(&mut trace, tangents, zeros);
    (trace, joints, [one.margin, two.margin], tangents, room)
}

fn inverse_inputs(wrist: &Wrist, pose: &Pose) -> Vec<i64> {
    let mut inputs: Vec<i64> = [pose.yaw, pose.pitch, pose.roll]
        .map(|angle| angle.to_q29().into())
        .to_vec();
    for leg in &wrist.legs {
        inputs.extend(leg.pull.center.map(i64::from));
        inputs.extend(leg.pull.slope.map(i64::from));
        inputs.push(leg.pull.offset.into());
    }
    inputs.extend(wrist.legs.map(|leg| i64::from(leg.zero.to_q29())));
    inputs
}

#[test]
fn the_inverse_is_the_kernels() {
    let mut random = Random::new(0x1D5E_ED00_0000_0103);
    let (trace, joints, margins, tangents, room) = whole_inverse();
    let mut answers = 0;
    for _ in 0..40_000 {
        let wrist = random.geometry().kernel().expect("within the tolerance");
        let pose = random.pose();
        let Ok(found) = wrist.inverse(&pose) else {
            continue;
        };
        answers += 1;
        let run = trace.run(&inverse_inputs(&wrist, &pose));
        let margin = found.margin();
        let rooms = wrist.rooms(&pose, 0);
        assert_eq!(run.at(room), i64::from(rooms[rooms.len() - 1]));
        assert!(run.at(room) >= 0, "beyond the assembly margin");
        let wanted = found.joints.0.map(|angle| i64::from(angle.to_q29()));
        assert_eq!(joints.map(|joint| run.at(joint)), wanted);
        for tangent in tangents {
            assert!(
                run.at(tangent).abs() <= (17 << 26) + 8,
                "a tangent beyond ±17/32"
            );
        }
        let least = margins.map(|margin| run.at(margin) as i32);
        assert_eq!(times_root_two(least[0].min(least[1])), margin);
    }
    assert!(answers > 20_000, "only {answers} answers");
}

#[test]
fn without_rounding_the_inverse_is_the_models() {
    let mut random = Random::new(0x1D5E_ED00_0000_0104);
    let (trace, joints, ..) = whole_inverse();
    let mut answers = 0;
    for _ in 0..20_000 {
        let geometry = random.geometry();
        let pose = random.pose();
        if geometry
            .kernel()
            .is_none_or(|wrist| wrist.inverse(&pose).is_err())
        {
            continue;
        }
        answers += 1;
        let angles = [pose.yaw, pose.pitch, pose.roll].map(radians);
        let mut inputs = angles.to_vec();
        for leg in &geometry.legs {
            let a = leg.center;
            let offset = 1.0 + a.dot(&a) + leg.crank.powi(2) - leg.rod.powi(2);
            let half = core::f64::consts::FRAC_1_SQRT_2;
            inputs.extend([a[1] * half, a[2] * half]);
            inputs.extend((a / leg.crank).iter());
            inputs.push(offset / (2.0 * leg.crank) * half);
        }
        inputs.extend(geometry.legs.map(|leg| leg.zero[2].atan2(leg.zero[1])));
        let numbers = trace.idealize(&inputs);
        let wanted = geometry
            .inverse(&design::rotation(angles[0], angles[1], angles[2]))
            .expect("reachable");
        for (joint, wanted) in joints.into_iter().zip(wanted) {
            let error = (trace.ideal(&numbers, joint) - wanted).abs();
            assert!(error < 1e-9, "{error:e}");
        }
    }
    assert!(answers > 10_000, "only {answers} answers");
}

#[test]
fn the_kernel_takes_no_angle_beyond_what_is_proven() {
    let mut random = Random::new(0x1D5E_ED00_0000_0107);
    for round in 0..60_000 {
        let wrist = random.geometry().kernel().expect("within the tolerance");
        // Most are near home, where nothing but the limit refuses them.
        let by = random.within(0, 20_000_000) as i32;
        let limits = [1 << 29, 1 << 28, 1 << 28];
        let mut angles = [0, 1, 2].map(|_| random.within(-1 << 26, 1 << 26) as i32);
        let axis = round % 3;
        angles[axis] = if round % 2 == 0 {
            limits[axis] + by
        } else {
            -limits[axis] - 1 - by
        };
        let [yaw, pitch, roll] = angles.map(Angle::from_q29);
        assert!(
            wrist.inverse(&Pose { yaw, pitch, roll }).is_err(),
            "{angles:?}"
        );
        let mut joints = [0, 1, 2].map(|_| random.within(-1 << 26, 1 << 26) as i32);
        let limit = limits[2 * (axis / 2)];
        joints[axis] = if round % 2 == 0 {
            limit + by
        } else {
            -limit - 1 - by
        };
        for (joint, leg) in joints.iter_mut().zip(&wrist.legs) {
            *joint -= leg.zero.to_q29();
        }
        joints[2] += Angle::FRAC_PI_4.to_q29();
        let joints = Joints(joints.map(Angle::from_q29));
        assert!(wrist.direct(&joints).is_err(), "{joints:?}");
    }
}

/// What the direct kinematics answers with, as numbers of a trace.
struct Answer {
    columns: [[Value; 3]; 3],
    rows: [[Value; 3]; 3],
    determinant: Value,
    serial: [Value; 2],
    tangents: [Value; 2],
}

/// The whole direct kinematics, from the joints' angles and the constants.
fn whole_direct() -> (Trace, Answer) {
    let t = &mut Trace::default();
    let joints = t.inputs(["theta1", "theta2", "theta3"], 29);
    let zeros = t.inputs(["zero1", "zero2"], 29);
    let pushes = [direct::push(t), direct::push(t)];
    let cranks = t.input("cranks", 31);
    let quarter = t.constant("quarter", Angle::FRAC_PI_4.to_q29().into(), 29);
    let angles = [
        t.add("", joints[0], zeros[0]),
        t.add("", joints[1], zeros[1]),
        t.subtract("", joints[2], quarter),
    ];
    let [turn1, turn2, turn3] = angles.map(|angle| t.sine_cosine("", angle));
    let [c3, s3] = direct::third(t, turn3);
    let crank1 = direct::turned(t, &pushes[0], turn1);
    let [k, m, across] = direct::first_equation(t, c3, s3, &crank1);
    let phi = direct::find(t, 1, [k, m, crank1.offset]);
    let turn = direct::sine_cosine(t, phi.tangent);
    let [x, z] = direct::first_axes(t, c3, s3, turn);
    let serial1 = direct::serial(t, &pushes[0], &crank1, x);
    let first = direct::first(t, phi.margin, serial1, across);
    let crank2 = direct::turned(t, &pushes[1], turn2);
    let [k, m, along] = direct::second_equation(t, [c3, s3], &crank2, [x, z]);
    let psi = direct::find(t, -1, [k, m, crank2.offset]);
    let turn = direct::sine_cosine(t, psi.tangent);
    let [point, axis] = direct::second_axes(t, [c3, s3], z, turn);
    let serial2 = direct::serial(t, &pushes[1], &crank2, point);
    let parts = direct::along_parts(t, along, turn);
    let second = direct::second(t, psi.margin, serial2, parts);
    let determinant = direct::determinant(t, phi.margin, psi.margin, cranks);
    let answer = Answer {
        columns: [x, point, axis],
        rows: direct::rows(t, [x, z], [c3, s3], first, second),
        determinant,
        serial: [serial1, serial2],
        tangents: [phi.tangent, psi.tangent],
    };
    (t.clone(), answer)
}

#[test]
fn the_direct_kinematics_is_the_kernels() {
    let mut random = Random::new(0x1D5E_ED00_0000_0105);
    let (trace, answer) = whole_direct();
    let mut answers = 0;
    for _ in 0..60_000 {
        let wrist = random.geometry().kernel().expect("within the tolerance");
        let joints = random.joints();
        let Ok(found) = wrist.direct(&joints) else {
            continue;
        };
        answers += 1;
        let mut inputs: Vec<i64> = joints.0.map(|angle| angle.to_q29().into()).to_vec();
        inputs.extend(wrist.legs.map(|leg| i64::from(leg.zero.to_q29())));
        for leg in &wrist.legs {
            inputs.extend(leg.push.back.map(i64::from));
            inputs.push(leg.push.offset.into());
            inputs.extend(leg.push.shift.map(i64::from));
            inputs.extend(leg.push.center.map(i64::from));
        }
        inputs.push(wrist.cranks.into());
        let run = trace.run(&inputs);
        for tangent in answer.tangents {
            assert!(
                run.at(tangent).abs() <= (1 << 30) + 8,
                "a tangent beyond ±½"
            );
        }
        let all = |values: &[[Value; 3]; 3]| values.map(|row| row.map(|at| run.at(at) as i32));
        assert_eq!(&all(&answer.columns), found.rotation.columns());
        assert_eq!(&all(&answer.rows), found.jacobian.torque_rows());
        assert_eq!(run.at(answer.determinant), found.jacobian.det_a().into());
        let least = answer.serial.map(|serial| run.at(serial) as i32);
        assert_eq!(least[0].min(least[1]), found.margin());
    }
    assert!(answers > 15_000, "only {answers} answers");
}

#[test]
fn without_rounding_the_direct_kinematics_is_the_models() {
    let mut random = Random::new(0x1D5E_ED00_0000_0106);
    let (trace, answer) = whole_direct();
    let mut answers = 0;
    for _ in 0..20_000 {
        let geometry = random.geometry();
        let joints = random.joints();
        if geometry
            .kernel()
            .is_none_or(|wrist| wrist.direct(&joints).is_err())
        {
            continue;
        }
        answers += 1;
        let theta = joints.0.map(radians);
        let mut inputs = theta.to_vec();
        inputs.extend(geometry.legs.map(|leg| leg.zero[2].atan2(leg.zero[1])));
        for leg in &geometry.legs {
            let a = leg.center;
            let offset = 1.0 + a.dot(&a) + leg.crank.powi(2) - leg.rod.powi(2);
            inputs.extend((-a / leg.crank).iter());
            inputs.extend([offset / (2.0 * leg.crank), a[1], 1.0 + a[2], a[1], a[2]]);
        }
        inputs.push(geometry.legs[0].crank * geometry.legs[1].crank);
        let numbers = trace.idealize(&inputs);
        let rotation = geometry.direct(&theta).expect("joined");
        let jacobians = geometry.jacobians(&rotation, &theta);
        let map = jacobians.torque_map().expect("regular");
        for k in 0..9 {
            let (i, j) = (k / 3, k % 3);
            let error = trace.ideal(&numbers, answer.columns[i][j]) - rotation[(j, i)];
            assert!(error.abs() < 1e-7, "column {i} {j}: {error:e}");
            let error = trace.ideal(&numbers, answer.rows[i][j]) - map[(i, j)];
            assert!(error.abs() < 1e-7, "row {i} {j}: {error:e}");
        }
        let error = trace.ideal(&numbers, answer.determinant) - jacobians.det_a();
        assert!(error.abs() < 1e-7, "det A: {error:e}");
    }
    assert!(answers > 5_000, "only {answers} answers");
}

/// Returns an angle in radians.
pub fn radians(angle: Angle) -> f64 {
    f64::from(angle.to_q29()) / f64::from(1 << 29)
}
