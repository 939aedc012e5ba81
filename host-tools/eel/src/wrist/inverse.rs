//! `eel wrist ik`: motor angles for a pose.

use std::io::Write;

use anyhow::Result;
use eel_kinematics::design::{AssemblyMode, WorkingMode};
use serde::Serialize;

use super::args::{Architecture, Ik, Kernel};
use super::fixed::{self, Choice};
use super::number::{Unit, plain};
use super::place::{Place, Room, travel_line};

#[derive(Serialize)]
struct Answer {
    architecture: Architecture,
    kernel: Kernel,
    unit: &'static str,
    pose: Pose,
    working_mode: &'static str,
    assembly_mode: Option<&'static str>,
    theta: [f64; 3],
    theta_f64: [f64; 3],
    theta_fixed: Option<[f64; 3]>,
    fixed_refusal: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    nearest: Option<NearestAnswer>,
    det_a: f64,
    b: [f64; 3],
    condition: f64,
    condition_of_rates: f64,
    isotropy: f64,
    isotropy_of_rates: f64,
    manipulability: f64,
    manipulability_of_rates: f64,
    margin: f64,
    travel: Room,
    #[serde(skip_serializing_if = "Option::is_none")]
    solutions: Option<[[f64; 3]; 4]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    working_modes: Option<[&'static str; 4]>,
}

#[derive(Serialize)]
struct Pose {
    yaw: f64,
    pitch: f64,
    roll: f64,
}

/// The nearest pose that the kernel reaches, where it refuses the one that is asked.
#[derive(Serialize)]
struct NearestAnswer {
    yaw: f64,
    pitch: f64,
    roll: f64,
    theta: [f64; 3],
    obstacle: &'static str,
}

/// Answers `eel wrist ik`.
pub fn run(out: &mut dyn Write, ik: &Ik) -> Result<()> {
    let common = &ik.at.common;
    let unit = Unit::of(&common.subject);
    let mode = ik.working_mode;
    let place = Place::find_in(mode, &common.subject, &ik.at.pose, unit)?;
    let other = (mode != WorkingMode::HOME).then(|| mode.name());
    let choice = fixed::choose(common, other, || fixed::inverse(place.pose))?;
    if !common.subject.json {
        return write_text(out, ik, unit, &place, &choice);
    }
    let answered = choice
        .fixed
        .as_ref()
        .filter(|_| choice.used == Kernel::Fixed);
    let theta_fixed = choice.fixed.as_ref().map(|found| unit.show(found.theta));
    let theta_f64 = unit.show(place.theta);
    let [yaw, pitch, roll] = unit.show(place.pose);
    let answer = Answer {
        architecture: common.subject.architecture,
        kernel: choice.used,
        unit: unit.name,
        pose: Pose { yaw, pitch, roll },
        working_mode: mode.name(),
        assembly_mode: place.assembly_mode.map(AssemblyMode::name),
        theta: answered.map_or(theta_f64, |found| unit.show(found.theta)),
        theta_f64,
        theta_fixed,
        fixed_refusal: choice.refusal,
        nearest: nearest(place.pose, &choice).map(|found| {
            let [yaw, pitch, roll] = unit.show(found.pose);
            NearestAnswer {
                yaw,
                pitch,
                roll,
                theta: unit.show(found.theta),
                obstacle: found.obstacle,
            }
        }),
        det_a: place.jacobians.det_a(),
        b: place.jacobians.b.into(),
        condition: place.jacobians.condition(),
        condition_of_rates: place.jacobians.condition_of_rates(),
        isotropy: place.jacobians.isotropy(),
        isotropy_of_rates: place.jacobians.isotropy_of_rates(),
        manipulability: place.jacobians.manipulability(),
        manipulability_of_rates: place.jacobians.manipulability_of_rates(),
        margin: answered.map_or(place.margins.legs(), |found| found.margin),
        travel: Room::of(&place.limit, unit),
        solutions: ik
            .all
            .then(|| place.solutions.map(|theta| unit.show(theta))),
        working_modes: ik.all.then(|| WorkingMode::ALL.map(WorkingMode::name)),
    };
    serde_json::to_writer(&mut *out, &answer)?;
    Ok(writeln!(out)?)
}

/// Returns the nearest pose that the kernel reaches where it refuses this one.
fn nearest(pose: [f64; 3], choice: &Choice<fixed::Inverse>) -> Option<fixed::Nearest> {
    choice.refusal.and_then(|_| fixed::nearest(pose))
}

fn write_text(
    out: &mut dyn Write,
    ik: &Ik,
    unit: Unit,
    place: &Place,
    choice: &Choice<fixed::Inverse>,
) -> Result<()> {
    let name = ik.at.common.subject.architecture.name();
    writeln!(out, "{name}, angles in {}", unit.name)?;
    writeln!(out, "           {:>14}{:>14}{:>14}", "yaw", "pitch", "roll")?;
    writeln!(out, "  pose     {}", unit.columns(&place.pose))?;
    writeln!(
        out,
        "           {:>14}{:>14}{:>14}",
        "theta1", "theta2", "theta3"
    )?;
    if let Some(found) = &choice.fixed {
        writeln!(out, "  fixed    {}", unit.columns(&found.theta))?;
    }
    if let Some(reason) = choice.refusal {
        writeln!(out, "  fixed    none: {reason}")?;
    }
    if let Some(found) = nearest(place.pose, choice) {
        let pose = unit.columns(&found.pose);
        let pose: Vec<&str> = pose.split_whitespace().collect();
        let obstacle = match found.obstacle {
            "range" => "the range of the angles",
            "singular" => "a singularity",
            _ => "the reach of the legs",
        };
        writeln!(
            out,
            "  nearest  {}  at yaw, pitch, roll {} ({obstacle} is in the way)",
            unit.columns(&found.theta),
            pose.join(", "),
        )?;
    }
    writeln!(out, "  f64      {}", unit.columns(&place.theta))?;
    if ik.all {
        for (mode, theta) in WorkingMode::ALL.into_iter().zip(&place.solutions) {
            let home = if mode == WorkingMode::HOME {
                "  home"
            } else {
                ""
            };
            writeln!(out, "  mode {}  {}{home}", mode.name(), unit.columns(theta))?;
        }
    }
    let jacobians = &place.jacobians;
    let b: Vec<String> = jacobians.b.iter().map(|entry| plain(*entry, 6)).collect();
    writeln!(
        out,
        "  det A {}  b ({})  condition {} (of rates {})  margin {}",
        plain(jacobians.det_a(), 6),
        b.join(", "),
        plain(jacobians.condition(), 4),
        plain(jacobians.condition_of_rates(), 4),
        plain(place.margins.legs(), 6),
    )?;
    if ik.working_mode != WorkingMode::HOME || place.assembly_mode != Some(AssemblyMode::HOME) {
        let assembly = place
            .assembly_mode
            .map_or("none: det A = 0", AssemblyMode::name);
        let working = ik.working_mode.name();
        writeln!(out, "  working mode {working}, assembly mode {assembly}")?;
    }
    if place.limit.is_passed() {
        writeln!(out, "  {}", travel_line(&place.limit, unit))?;
    }
    Ok(())
}
