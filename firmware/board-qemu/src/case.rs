//! A pose of the workspace with everything that the measured calls take, and the check of their answers.

use eel_kinematics::{Bounds, Direct, Inverse, Policy, Pose, Wrist};
use eel_units::{Angle, Torque};

use crate::floating::{self, Vector};
use crate::numbers::{Numbers, float};

/// How far an angle of the two inverses may lie apart: 4 µrad in Q29. That is some tens of roundings
/// in single precision.
const APART_ANGLE: f32 = 4e-6;
/// How far any other number may lie apart.
const APART: f32 = 8e-6;

/// Why a case is no good.
#[derive(Debug)]
pub enum Failure {
    /// A pose of the workspace has no answer.
    Refused,
    /// A moment was bounded that should be free, or the other way round.
    Bounds,
    /// Single precision gives another answer.
    Apart,
}

/// One pose and everything that the calls take.
pub struct Case {
    pub pose: Pose,
    pub inverse: Inverse,
    pub direct: Direct,
    pub tangent: i32,
    pub square: i32,
    pub number: i32,
    pub divisor: i32,
    /// A moment that fits the bounds.
    pub moment: [Torque; 3],
    /// One that doesn't.
    pub overload: [Torque; 3],
    pub bounds: [Bounds; 3],
    /// A target twice as far in yaw, three times in pitch and roll: many are out of reach.
    pub beyond: Pose,
    pub floats: Floats,
}

/// The same in single precision, as far as it is measured.
pub struct Floats {
    pub pose: Vector,
    pub joints: Vector,
    pub map: [Vector; 3],
    pub tangent: f32,
    pub square: f32,
    pub number: f32,
    pub divisor: f32,
    pub moment: Vector,
    pub bounds: [[f32; 2]; 3],
}

impl Case {
    /// Draws a case, and checks that the calls do with it what their names say.
    pub fn draw(numbers: &mut Numbers) -> Result<Self, Failure> {
        let [yaw, pitch, roll] = numbers.pose();
        let pose = Pose { yaw, pitch, roll };
        let inverse = Wrist::PAPER.inverse(&pose).map_err(|_| Failure::Refused)?;
        let direct = Wrist::PAPER
            .direct(&inverse.joints)
            .map_err(|_| Failure::Refused)?;
        let tangent = numbers.part(1 << 30);
        let square = (5 << 27) + numbers.part(7 << 26);
        let divisor = (3 << 28) + numbers.part(1 << 28);
        let number = numbers.part(divisor >> 1);
        // 0.3 N·m at most, against bounds of 3 N·m; 8 to 12 N·m in yaw.
        let moment = [0; 3].map(|_| Torque::from_q24(numbers.part(5_033_165)));
        let overload = [
            Torque::from_q24((10 << 24) + numbers.part(2 << 24)),
            Torque::from_q24(numbers.part(4 << 24)),
            Torque::from_q24(numbers.part(4 << 24)),
        ];
        let bounds = [Bounds {
            low: Torque::from_millinewton_metres(-3_000),
            high: Torque::from_millinewton_metres(3_000),
        }; 3];
        let beyond = Pose {
            yaw: Angle::from_q29(yaw.to_q29() * 2),
            pitch: Angle::from_q29(pitch.to_q29() * 3),
            roll: Angle::from_q29(roll.to_q29() * 3),
        };
        let case = Self {
            floats: Floats {
                pose: [yaw, pitch, roll].map(|angle| float::<29>(angle.to_q29())),
                joints: inverse.joints.0.map(|angle| float::<29>(angle.to_q29())),
                map: direct
                    .jacobian
                    .torque_rows()
                    .map(|row| row.map(float::<26>)),
                tangent: float::<31>(tangent),
                square: float::<31>(square),
                number: float::<30>(number),
                divisor: float::<30>(divisor),
                moment: moment.map(|torque| float::<24>(torque.to_q24())),
                bounds: [[-3.0, 3.0]; 3],
            },
            pose,
            inverse,
            direct,
            tangent,
            square,
            number,
            divisor,
            moment,
            overload,
            bounds,
            beyond,
        };
        case.check_bounds()?;
        case.check_floats()?;
        Ok(case)
    }

    /// Checks that the one moment is free and the other is not.
    fn check_bounds(&self) -> Result<(), Failure> {
        let jacobian = &self.direct.jacobian;
        let bound = |moment: &[Torque; 3], policy| {
            let shared = jacobian.share(moment, &self.bounds, policy);
            shared.bound.iter().any(Option::is_some)
        };
        let free = !bound(&self.moment, Policy::YawFirst);
        let policies = [Policy::YawFirst, Policy::KeepDirection];
        let bounded = policies
            .into_iter()
            .all(|policy| bound(&self.overload, policy));
        if free && bounded {
            Ok(())
        } else {
            Err(Failure::Bounds)
        }
    }

    /// Checks that single precision gives the kernel's answers.
    fn check_floats(&self) -> Result<(), Failure> {
        let Self {
            floats,
            inverse,
            direct,
            ..
        } = self;
        let legs = &floating::PAPER;
        let found = floating::inverse(legs, &floats.pose).ok_or(Failure::Refused)?;
        check(&floats.joints, &found.joints, APART_ANGLE)?;
        check(&[float::<30>(inverse.margin())], &[found.margin], APART)?;

        let found = floating::direct(legs, &floats.joints).ok_or(Failure::Refused)?;
        let columns = direct.rotation.columns().map(|it| it.map(float::<30>));
        check(columns.as_flattened(), found.columns.as_flattened(), APART)?;
        check(
            floats.map.as_flattened(),
            found.torque.as_flattened(),
            APART,
        )?;
        let numbers = [direct.jacobian.det_a(), direct.margin()].map(float::<30>);
        check(&numbers, &[found.determinant, found.margin], APART)?;

        let exact = direct.jacobian.torques(self.moment);
        let exact = exact.map(|torque| float::<24>(torque.to_q24()));
        let found = floating::share(&found.torque, &floats.moment, &floats.bounds);
        check(&exact, &found.ok_or(Failure::Refused)?, APART)
    }
}

/// Checks that no number lies further from its counterpart than that.
fn check(ours: &[f32], theirs: &[f32], apart: f32) -> Result<(), Failure> {
    let near = |(a, b): (&f32, &f32)| (a - b).abs() <= apart;
    if ours.len() == theirs.len() && ours.iter().zip(theirs).all(near) {
        Ok(())
    } else {
        Err(Failure::Apart)
    }
}
