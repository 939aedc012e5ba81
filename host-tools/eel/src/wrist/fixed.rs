//! The firmware's kernel behind numbers in double precision.

use anyhow::Result;
use eel_kinematics::design::Matrix3;
use eel_kinematics::{Direct, Joints, Obstacle, Pose, PoseError, Reach, Rotation, Wrist};
use eel_units::{Angle, Torque};

use super::args::{Architecture, Common, Kernel};
use super::refused;

const Q24: f64 = (1u64 << 24) as f64;
const Q26: f64 = (1u64 << 26) as f64;
const Q29: f64 = (1u64 << 29) as f64;
const Q30: f64 = (1u64 << 30) as f64;
/// What an angle (rad) and a torque (N·m) hold, a little less.
const MOST_RADIANS: f64 = 3.99;
const MOST_NEWTON_METRES: f64 = 127.9;

/// The kernel's answer, where it has one, and whose answer is given.
pub struct Choice<T> {
    /// The kernel's answer.
    pub fixed: Option<T>,
    /// Who answers.
    pub used: Kernel,
    /// Why the kernel does not answer.
    pub refusal: Option<&'static str>,
}

/// Asks the kernel, as far as it knows the architecture and no other mode than home's is asked for, and
/// decides who answers.
pub fn choose<T>(
    common: &Common,
    other_mode: Option<&str>,
    ask: impl FnOnce() -> Result<T, &'static str>,
) -> Result<Choice<T>> {
    let architecture = common.subject.architecture;
    if architecture != Architecture::ParallelActuators || other_mode.is_some() {
        if common.kernel == Some(Kernel::Fixed) {
            let beyond = match other_mode {
                Some(mode) => format!("home's modes only, not {mode}"),
                None => format!("parallel-actuators only, not {}", architecture.name()),
            };
            return Err(refused(format!(
                "the fixed-point kernel knows {beyond}; leave --kernel out or say --kernel f64"
            )));
        }
        return Ok(Choice {
            fixed: None,
            used: Kernel::F64,
            refusal: None,
        });
    }
    let used = common.kernel.unwrap_or(Kernel::Fixed);
    match ask() {
        Ok(answer) => Ok(Choice {
            fixed: Some(answer),
            used,
            refusal: None,
        }),
        Err(reason) if common.kernel == Some(Kernel::Fixed) => Err(refused(format!(
            "the firmware's kernel refuses: {reason}; --kernel f64 answers"
        ))),
        Err(reason) => Ok(Choice {
            fixed: None,
            used: Kernel::F64,
            refusal: Some(reason),
        }),
    }
}

/// Motor angles and serial margin as the kernel gives them.
pub struct Inverse {
    /// The motors' angles in rad.
    pub theta: [f64; 3],
    /// The serial margin: 1 at home.
    pub margin: f64,
}

/// Returns the kernel's inverse for (yaw, pitch, roll) in rad.
pub fn inverse(pose: [f64; 3]) -> Result<Inverse, &'static str> {
    let found = Wrist::PAPER.inverse(&pose_of(pose)?).map_err(reason)?;
    Ok(Inverse {
        theta: found.joints.0.map(radians),
        margin: f64::from(found.margin()) / Q30,
    })
}

/// The pose nearest to one that the kernel does not reach.
pub struct Nearest {
    /// Yaw, pitch and roll in rad.
    pub pose: [f64; 3],
    /// Its motors' angles in rad.
    pub theta: [f64; 3],
    /// What is in the way of the pose that was asked.
    pub obstacle: &'static str,
}

/// Returns the pose nearest to (yaw, pitch, roll) in rad that the kernel reaches; nothing where it
/// reaches that.
pub fn nearest(pose: [f64; 3]) -> Option<Nearest> {
    let found = Wrist::PAPER.nearest(&pose_of(pose).ok()?, &Reach::kernel());
    let found = found.ok()?;
    Some(Nearest {
        pose: [found.pose.yaw, found.pose.pitch, found.pose.roll].map(radians),
        theta: found.inverse.joints.0.map(radians),
        obstacle: match found.obstacle? {
            Obstacle::Range => "range",
            Obstacle::OutOfReach => "out-of-reach",
            Obstacle::Singular => "singular",
        },
    })
}

/// Returns the kernel's direct kinematics for motor angles in rad.
pub fn direct(theta: &[f64; 3]) -> Result<Direct, &'static str> {
    let [a, b, c] = *theta;
    let joints = Joints([angle(a)?, angle(b)?, angle(c)?]);
    Wrist::PAPER.direct(&joints).map_err(direct_reason)
}

/// Returns what the kernel knows at (yaw, pitch, roll) in rad: its inverse, then its direct.
pub fn at(pose: [f64; 3]) -> Result<Direct, &'static str> {
    let found = Wrist::PAPER.inverse(&pose_of(pose)?).map_err(reason)?;
    Wrist::PAPER.direct(&found.joints).map_err(reason)
}

/// Returns the kernel's torque map B A⁻ᵀ.
pub fn torque_map(direct: &Direct) -> Matrix3<f64> {
    let rows = direct.jacobian.torque_rows();
    Matrix3::from_fn(|motor, axis| f64::from(rows[motor][axis]) / Q26)
}

/// Returns an orientation as a matrix.
pub fn matrix(rotation: &Rotation) -> Matrix3<f64> {
    let columns = rotation.columns();
    Matrix3::from_fn(|row, column| f64::from(columns[column][row]) / Q30)
}

/// Returns the fixed-point torque nearest to N·m; nothing beyond what the firmware can hold.
pub fn torque(newton_metres: f64) -> Result<Torque, &'static str> {
    held(newton_metres, f64::round)
}

/// Returns the fixed-point bound nearest to N·m that does not pass it.
pub fn bound(newton_metres: f64) -> Result<Torque, &'static str> {
    held(newton_metres, f64::trunc)
}

fn held(newton_metres: f64, rounding: fn(f64) -> f64) -> Result<Torque, &'static str> {
    if newton_metres.abs() > MOST_NEWTON_METRES {
        return Err("it holds torques within ±127.9 N·m");
    }
    Ok(Torque::from_q24(rounding(newton_metres * Q24) as i32))
}

/// Returns N·m.
pub fn newton_metres(torque: Torque) -> f64 {
    f64::from(torque.to_q24()) / Q24
}

/// Returns rad.
pub fn radians(angle: Angle) -> f64 {
    f64::from(angle.to_q29()) / Q29
}

/// Returns the pose nearest to (yaw, pitch, roll) in rad, each within half a turn.
fn pose_of(angles: [f64; 3]) -> Result<Pose, &'static str> {
    let [yaw, pitch, roll] = angles.map(wrapped);
    Ok(Pose {
        yaw: angle(yaw)?,
        pitch: angle(pitch)?,
        roll: angle(roll)?,
    })
}

/// Returns the same angle within ±π.
fn wrapped(radians: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if radians.abs() <= PI {
        radians
    } else {
        (radians + PI).rem_euclid(TAU) - PI
    }
}

fn angle(radians: f64) -> Result<Angle, &'static str> {
    if radians.abs() > MOST_RADIANS {
        return Err(reason(PoseError::OutOfReach));
    }
    Ok(Angle::from_q29((radians * Q29).round() as i32))
}

const fn reason(error: PoseError) -> &'static str {
    match error {
        PoseError::OutOfReach => {
            "out of reach, or beyond its range (yaw ±1 rad, pitch and roll ±0.5 rad; cranks ±0.97 rad, motor 3 \
             ±0.49 rad from home)"
        }
        PoseError::Singular => "too near a singularity",
    }
}

/// Says why the direct kinematics refuses, whose range is a little wider.
const fn direct_reason(error: PoseError) -> &'static str {
    match error {
        PoseError::OutOfReach => {
            "the parts can't be joined, or a motor is beyond its range (cranks ±1 rad, motor 3 ±0.5 rad from home)"
        }
        PoseError::Singular => "too near a singularity",
    }
}
