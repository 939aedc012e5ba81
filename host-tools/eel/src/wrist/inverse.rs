//! `eel wrist ik`: motor angles for a pose.

use std::io::Write;

use anyhow::Result;
use serde::Serialize;

use super::args::{Architecture, Ik, Kernel};
use super::fixed::{self, Choice};
use super::number::{Unit, plain};
use super::place::Place;

/// Working modes in the order of the solutions: the signs of (l×r)·i on legs 1 and 2.
const MODES: [&str; 4] = ["++", "+-", "-+", "--"];

#[derive(Serialize)]
struct Answer {
    architecture: Architecture,
    kernel: Kernel,
    unit: &'static str,
    pose: Pose,
    theta: [f64; 3],
    theta_f64: [f64; 3],
    theta_fixed: Option<[f64; 3]>,
    fixed_refusal: Option<&'static str>,
    det_a: f64,
    b: [f64; 3],
    condition: f64,
    condition_of_rates: f64,
    margin: f64,
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

/// Answers `eel wrist ik`.
pub fn run(out: &mut dyn Write, ik: &Ik) -> Result<()> {
    let common = &ik.at.common;
    let unit = Unit::of(common);
    let place = Place::find(&ik.at, unit)?;
    let choice = fixed::choose(common, || fixed::inverse(place.pose))?;
    if !common.json {
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
        architecture: common.architecture,
        kernel: choice.used,
        unit: unit.name,
        pose: Pose { yaw, pitch, roll },
        theta: answered.map_or(theta_f64, |found| unit.show(found.theta)),
        theta_f64,
        theta_fixed,
        fixed_refusal: choice.refusal,
        det_a: place.jacobians.det_a(),
        b: place.jacobians.b.into(),
        condition: place.jacobians.condition(),
        condition_of_rates: place.jacobians.condition_of_rates(),
        margin: answered.map_or(place.margin(), |found| found.margin),
        solutions: ik
            .all
            .then(|| place.solutions.map(|theta| unit.show(theta))),
        working_modes: ik.all.then_some(MODES),
    };
    serde_json::to_writer(&mut *out, &answer)?;
    Ok(writeln!(out)?)
}

fn write_text(
    out: &mut dyn Write,
    ik: &Ik,
    unit: Unit,
    place: &Place,
    choice: &Choice<fixed::Inverse>,
) -> Result<()> {
    let name = ik.at.common.architecture.name();
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
    writeln!(out, "  f64      {}", unit.columns(&place.theta))?;
    if ik.all {
        for (mode, theta) in MODES.iter().zip(&place.solutions) {
            let home = if *mode == "++" { "  home" } else { "" };
            writeln!(out, "  mode {mode}  {}{home}", unit.columns(theta))?;
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
        plain(place.margin(), 6),
    )?;
    if jacobians.det_a() <= 0.0 {
        writeln!(out, "  not in home's assembly mode: det A is not positive")?;
    }
    Ok(())
}
