//! How exact the kernel and single precision are, against the model in double precision.

use core::fmt;

use eel_kinematics::design::{Geometry, Matrix3, Vector3, rotation};
use eel_kinematics::{Direct, Joints, Pose, Wrist};
use eel_units::Angle;

use crate::floating::{self, PAPER, Vector};
use crate::numbers::{Numbers, float};

/// How many poses of the workspace are compared.
const POSES: u32 = 100_000;
/// The seed of the poses.
const SEED: u64 = 0x0EE1_0000_0005;

/// The largest errors, of the kernel and of single precision.
#[derive(Default)]
pub struct Errors {
    /// An angle of the inverse, radians.
    inverse: [f64; 2],
    /// The orientation of the direct kinematics, radians.
    direct: [f64; 2],
    /// A motor's torque for a moment of 1 N·m, N·m.
    torque: [f64; 2],
}

/// Compares both with `design`, whose double precision is exact beside them. Both get the same poses and
/// the same motor angles, which single precision holds exactly.
///
/// Returns nothing where a pose has no answer.
pub fn measure() -> Option<Errors> {
    let geometry = Geometry::PARALLEL_ACTUATORS;
    let mut numbers = Numbers::new(SEED);
    let mut errors = Errors::default();
    for _ in 0..POSES {
        let angles = numbers.pose();
        let [yaw, pitch, roll] = angles;
        let [exact_yaw, exact_pitch, exact_roll] = angles.map(radians);
        let exact = geometry.inverse(&rotation(exact_yaw, exact_pitch, exact_roll))?;
        let ours = Wrist::PAPER.inverse(&Pose { yaw, pitch, roll }).ok()?;
        let theirs = floating::inverse(&PAPER, &angles.map(|it| float::<29>(it.to_q29())))?;
        let found = [ours.joints.0.map(radians), theirs.joints.map(f64::from)];
        for (worst, found) in errors.inverse.iter_mut().zip(found) {
            let apart = found.iter().zip(exact).map(|(found, exact)| found - exact);
            *worst = apart.map(f64::abs).fold(*worst, f64::max);
        }
        errors.add_direct(&geometry, ours.joints)?;
    }
    Some(errors)
}

impl Errors {
    /// Compares orientation and map of torques at motor angles.
    fn add_direct(&mut self, geometry: &Geometry, joints: Joints) -> Option<()> {
        // As many digits as single precision has.
        let joints = joints.0.map(|it| Angle::from_q29(it.to_q29() & !31));
        let exact_joints = joints.map(radians);
        let exact = geometry.direct(&exact_joints)?;
        let exact_map = geometry.jacobians(&exact, &exact_joints).torque_map()?;

        let Direct {
            rotation, jacobian, ..
        } = Wrist::PAPER.direct(&Joints(joints)).ok()?;
        let theirs = floating::direct(&PAPER, &joints.map(|it| float::<29>(it.to_q29())))?;
        let scaled = |bits: u32| move |raw: i32| f64::from(raw) / (1u64 << bits) as f64;
        let columns = rotation.columns().map(|it| it.map(scaled(30)));
        let rows = jacobian.torque_rows().map(|it| it.map(scaled(26)));
        let widened = |vectors: [Vector; 3]| vectors.map(|it| it.map(f64::from));
        let orientations = [columns, widened(theirs.columns)];
        for (worst, columns) in self.direct.iter_mut().zip(orientations) {
            *worst = worst.max(angle_between(&exact, &columns));
        }
        let maps = [rows, widened(theirs.torque)];
        for (worst, rows) in self.torque.iter_mut().zip(maps) {
            for (index, row) in rows.into_iter().enumerate() {
                let apart = Vector3::from(row) - exact_map.row(index).transpose();
                // The moment that shows it most is along it.
                *worst = worst.max(apart.norm());
            }
        }
        Some(())
    }
}

impl fmt::Display for Errors {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "poses\t{POSES}")?;
        for (name, [ours, theirs]) in [
            ("inverse", self.inverse),
            ("direct", self.direct),
            ("torque", self.torque),
        ] {
            writeln!(out, "{name}\t{ours:e}\t{theirs:e}")?;
        }
        Ok(())
    }
}

fn radians(angle: Angle) -> f64 {
    f64::from(angle.to_q29()) / (1u64 << 29) as f64
}

/// Returns the angle between an orientation and one that is nearly it, given by its columns.
fn angle_between(exact: &Matrix3<f64>, columns: &[[f64; 3]; 3]) -> f64 {
    let mut twice = Vector3::zeros();
    for (exact, column) in exact.column_iter().zip(columns) {
        twice += exact.cross(&Vector3::from(*column));
    }
    twice.norm() / 2.0
}
