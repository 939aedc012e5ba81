//! Where the platform is asked to be, and the general model there.

use std::f64::consts::FRAC_PI_4;

use anyhow::Result;
use eel_kinematics::design::{self, Geometry, Jacobians, Matrix3};

use super::args::At;
use super::number::{Unit, wrapped};
use super::refused;

/// Below this cos φ the third motor's angle is no longer determined.
const LEAST_COS_PHI: f64 = 1e-9;

/// A pose that can be reached, and the general model's answer in the home working mode.
pub struct Place {
    /// Yaw, pitch and roll in rad.
    pub pose: [f64; 3],
    /// The motors' angles in rad.
    pub theta: [f64; 3],
    /// All four solutions in rad, home's first.
    pub solutions: [[f64; 3]; 4],
    /// A and B.
    pub jacobians: Jacobians,
    /// Margins of legs 1, 2, 3 (by B) over home's.
    pub serial: [f64; 3],
}

impl Place {
    /// Finds the pose that the arguments name.
    pub fn find(at: &At, unit: Unit) -> Result<Self> {
        let (pose, rotation) = orientation(at, unit)?;
        let geometry = at.common.architecture.geometry();
        let Some(solutions) = geometry.inverse_all(&rotation) else {
            return Err(out_of_reach(&geometry, pose, &rotation));
        };
        if rotation[(0, 0)].hypot(rotation[(1, 0)]) < LEAST_COS_PHI {
            return Err(refused(
                "at phi = ±π/2 every angle of motor 3 gives this pose; turn the pose a little towards home",
            ));
        }
        let solutions = solutions.map(|theta| theta.map(wrapped));
        let theta = solutions[0];
        let jacobians = geometry.jacobians(&rotation, &theta);
        let home = at_home(&geometry);
        let serial = [0, 1, 2].map(|leg| jacobians.b[leg] / home.b[leg]);
        Ok(Self {
            pose,
            theta,
            solutions,
            jacobians,
            serial,
        })
    }

    /// Returns the serial margin as the kernel defines it: the lesser of legs 1 and 2.
    pub fn margin(&self) -> f64 {
        self.serial[0].min(self.serial[1])
    }
}

/// Returns A and B at home; every architecture of the paper reaches it with θ = (0, 0, π/4).
pub fn at_home(geometry: &Geometry) -> Jacobians {
    let rotation = design::rotation(0.0, 0.0, 0.0);
    geometry.jacobians(&rotation, &[0.0, 0.0, FRAC_PI_4])
}

fn orientation(at: &At, unit: Unit) -> Result<([f64; 3], Matrix3<f64>)> {
    let asked = &at.pose;
    let radians = |angle: Option<f64>, home: f64| angle.map_or(Ok(home), |a| unit.read(a));
    if asked.theta3.or(asked.phi).or(asked.psi).is_none() {
        let pose = [
            radians(asked.yaw, 0.0)?,
            radians(asked.pitch, 0.0)?,
            radians(asked.roll, 0.0)?,
        ];
        return Ok((pose, design::rotation(pose[0], pose[1], pose[2])));
    }
    let phi = radians(asked.phi, 0.0)?;
    if phi.abs() > std::f64::consts::FRAC_PI_2 {
        return Err(refused(
            "--phi must be within ±90° (π/2 rad): beyond it the same orientation is reached with \
             theta3 + 180°, 180° - phi, psi + 180°",
        ));
    }
    let rotation = design::rotation_from_platform(
        radians(asked.theta3, FRAC_PI_4)?,
        phi,
        radians(asked.psi, 0.0)?,
    );
    Ok((design::pose(&rotation), rotation))
}

/// Says which leg is too short, and how much of the pose is in reach.
fn out_of_reach(geometry: &Geometry, pose: [f64; 3], rotation: &Matrix3<f64>) -> anyhow::Error {
    let short: Vec<String> = geometry
        .legs
        .iter()
        .enumerate()
        .filter(|(k, leg)| leg.inverse(&rotation.column(*k).into_owned()).is_none())
        .map(|(k, _)| (k + 1).to_string())
        .collect();
    // The largest share of the pose that is in reach on the straight way from home.
    let is_reached = |share: f64| {
        let [yaw, pitch, roll] = pose.map(|angle| angle * share);
        geometry
            .inverse(&design::rotation(yaw, pitch, roll))
            .is_some()
    };
    let steps = 1_000;
    let reached = (0..=steps)
        .take_while(|step| is_reached(f64::from(*step) / f64::from(steps)))
        .last()
        .unwrap_or(0);
    refused(format!(
        "out of reach: leg {} can't get there; yaw, pitch and roll scaled by {:.3} are still in reach \
         (the paper's workspace is yaw ±30°, pitch ±15°, roll ±4°; angles are in radians without --degrees)",
        short.join(" and leg "),
        f64::from(reached) / f64::from(steps)
    ))
}
