//! Where the platform is asked to be, and the general model there.

use std::f64::consts::FRAC_PI_4;

use anyhow::Result;
use eel_kinematics::Side;
use eel_kinematics::design::{
    self, AssemblyMode, Geometry, Jacobians, Limit, Margins, Matrix3, WorkingMode,
};
use serde::Serialize;

use super::args::{Architecture, At, PoseArguments, Subject};
use super::fixed;
use super::number::{Unit, plain};
use super::refused;

/// Below this cos φ the third motor's angle is no longer determined.
const LEAST_COS_PHI: f64 = 1e-9;

/// A pose that can be reached, and the general model's answer in a working mode.
pub struct Place {
    /// Yaw, pitch and roll in rad.
    pub pose: [f64; 3],
    /// The same as a matrix.
    pub rotation: Matrix3<f64>,
    /// The motors' angles in rad.
    pub theta: [f64; 3],
    /// All four solutions in rad, in the order of `WorkingMode::ALL`.
    pub solutions: [[f64; 3]; 4],
    /// A and B.
    pub jacobians: Jacobians,
    /// How far each singularity is.
    pub margins: Margins,
    /// The assembly mode; nothing where det A vanishes.
    pub assembly_mode: Option<AssemblyMode>,
    /// The limit of travel with the least room.
    pub limit: Limit,
}

impl Place {
    /// Finds the pose that the arguments name, in home's working mode.
    pub fn find(at: &At, unit: Unit) -> Result<Self> {
        Self::find_in(WorkingMode::HOME, &at.common.subject, &at.pose, unit)
    }

    /// Finds the pose that the arguments name, in a working mode.
    pub fn find_in(
        mode: WorkingMode,
        subject: &Subject,
        asked: &PoseArguments,
        unit: Unit,
    ) -> Result<Self> {
        let (pose, rotation) = orientation(asked, unit)?;
        let geometry = subject.architecture.geometry();
        let (Some(solutions), Some(theta)) = (
            geometry.inverse_all(&rotation),
            geometry.inverse_in(mode, &rotation),
        ) else {
            let nearest = match subject.architecture {
                Architecture::ParallelActuators => fixed::nearest(pose),
                _ => None,
            };
            let nearest = nearest.map(|nearest| {
                let columns = unit.columns(&nearest.pose);
                let words: Vec<&str> = columns.split_whitespace().collect();
                format!("{} {}", words.join(", "), unit.name)
            });
            return Err(out_of_reach(&geometry, pose, &rotation, nearest.as_deref()));
        };
        if rotation[(0, 0)].hypot(rotation[(1, 0)]) < LEAST_COS_PHI {
            return Err(refused(
                "at phi = ±π/2 every angle of motor 3 gives this pose; turn the pose a little towards home",
            ));
        }
        let Some(margins) = geometry.margins(&rotation, &theta) else {
            return Err(refused("this geometry does not reach its home"));
        };
        Ok(Self {
            pose,
            rotation,
            theta,
            solutions,
            jacobians: geometry.jacobians(&rotation, &theta),
            margins,
            assembly_mode: geometry.assembly_mode(&rotation, &theta),
            limit: geometry.travel.nearest(&rotation, &theta),
        })
    }
}

/// The limit of travel with the least room, as JSON.
#[derive(Serialize)]
pub struct Room {
    within: bool,
    coordinate: &'static str,
    side: &'static str,
    room: f64,
}

impl Room {
    /// Returns the limit in the unit of the answer.
    pub fn of(limit: &Limit, unit: Unit) -> Self {
        let [room] = unit.show([limit.room]);
        Self {
            within: !limit.is_passed(),
            coordinate: limit.coordinate.name(),
            side: match limit.side {
                Side::Low => "low",
                Side::High => "high",
            },
            room,
        }
    }
}

/// Says how a configuration is to the limits of travel.
pub fn travel_line(limit: &Limit, unit: Unit) -> String {
    let room = Room::of(limit, unit);
    let (amount, coordinate, side) = (plain(room.room.abs(), 4), room.coordinate, room.side);
    let name = unit.name;
    if room.within {
        format!("within travel: {coordinate} has {amount} {name} left to its {side} limit")
    } else {
        format!("beyond travel: {coordinate} is {amount} {name} past its {side} limit")
    }
}

/// Returns A and B at home; every architecture of the paper reaches it with θ = (0, 0, π/4).
pub fn at_home(geometry: &Geometry) -> Jacobians {
    let rotation = design::rotation(0.0, 0.0, 0.0);
    geometry.jacobians(&rotation, &[0.0, 0.0, FRAC_PI_4])
}

/// Returns yaw, pitch and roll in rad, and the orientation, that the arguments name.
fn orientation(asked: &PoseArguments, unit: Unit) -> Result<([f64; 3], Matrix3<f64>)> {
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
fn out_of_reach(
    geometry: &Geometry,
    pose: [f64; 3],
    rotation: &Matrix3<f64>,
    nearest: Option<&str>,
) -> anyhow::Error {
    let reach = geometry.reach(rotation);
    let short: Vec<String> = (0..2)
        .filter(|leg| reach[*leg] < 0.0)
        .map(|leg| (leg + 1).to_string())
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
    let nearest = nearest.map_or_else(String::new, |angles| {
        format!("; the nearest pose that the firmware reaches is yaw, pitch, roll = {angles}")
    });
    refused(format!(
        "out of reach: leg {} can't get there; yaw, pitch and roll scaled by {:.3} are still in reach{nearest} \
         (the paper's workspace is yaw ±30°, pitch ±15°, roll ±4°; angles are in radians without --degrees)",
        short.join(" and leg "),
        f64::from(reached) / f64::from(steps)
    ))
}
