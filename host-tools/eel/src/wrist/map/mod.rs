//! `eel wrist workspace`: margin and conditioning over yaw and pitch.

mod chart;
mod colour;
mod contour;
mod field;
mod scale;

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::io::Write;

use anyhow::Result;
use eel_kinematics::design::{Range, Travel};
use serde::Serialize;

use super::args::{Architecture, Workspace};
use super::number::{Unit, plain, signed};
use super::{check_out, deliver, refused};
use chart::Heading;
use field::{Extreme, Extremes, Map, Summary};

/// Where the drawing goes if nothing is said.
const OUT: &str = "workspace.svg";
/// Yaw and pitch if nothing is said, degrees to each side: past the singularities of the prototype.
const YAW: f64 = 75.0;
const PITCH: f64 = 50.0;

#[derive(Serialize)]
struct Answer {
    architecture: Architecture,
    unit: &'static str,
    roll: f64,
    yaw: Vec<f64>,
    pitch: Vec<f64>,
    of: BTreeMap<String, Vec<Vec<Option<f64>>>>,
    reach: Vec<Vec<bool>>,
    summary: SummaryAnswer,
}

#[derive(Serialize)]
struct SummaryAnswer {
    #[serde(rename = "box")]
    within: BTreeMap<&'static str, [f64; 2]>,
    at_roll: ExtremesAnswer,
    any_roll: ExtremesAnswer,
    largest_box: f64,
    global_isotropy: f64,
    global_isotropy_of_rates: f64,
}

#[derive(Serialize)]
struct ExtremesAnswer {
    least_margin: ExtremeAnswer,
    worst_condition: ExtremeAnswer,
}

/// A number and where it is; null where it is infinite.
#[derive(Serialize)]
struct ExtremeAnswer {
    value: Option<f64>,
    yaw: f64,
    pitch: f64,
    roll: f64,
}

/// Answers `eel wrist workspace`.
pub fn run(out: &mut dyn Write, asked: &Workspace) -> Result<()> {
    let subject = &asked.subject;
    let unit = Unit::of(subject);
    check_out(subject.json, asked.out.as_deref())?;
    let roll = unit.read(asked.roll)?;
    let yaw = range("--yaw-range", &asked.yaw_range, YAW, PI, unit)?;
    let pitch = range("--pitch-range", &asked.pitch_range, PITCH, FRAC_PI_2, unit)?;
    let mut measures = Vec::new();
    for measure in &asked.of {
        if !measures.contains(measure) {
            measures.push(*measure);
        }
    }
    let geometry = subject.architecture.geometry();
    let map = Map::compute(&geometry, [&yaw, &pitch], roll, asked.cells, &measures);
    let (Some(map), Some(summary)) = (map, Summary::of(&geometry, roll)) else {
        return Err(refused("this geometry does not reach its home"));
    };
    let name = subject.architecture.name();
    let [least_yaw, least_pitch, _] = summary.at_roll.margin.pose;
    let heading = Heading {
        title: format!("Workspace of the wrist with {}", name.replace('-', " ")),
        subtitle: format!(
            "home's working mode ++, roll {}°; the box ±30° × ±15° × ±4° may grow {} times",
            signed(roll.to_degrees(), 1),
            plain(summary.largest_box, 2)
        ),
        least: [least_yaw, least_pitch],
    };
    if subject.json {
        write_json(out, asked, unit, &map, &summary)?;
        if let Some(target) = &asked.out {
            deliver(out, target, &chart::draw(&map, &heading))?;
        }
        return Ok(());
    }
    let target = asked.out.as_deref().unwrap_or(OUT);
    let mut text = summary_text(name, roll, &summary);
    match deliver(out, target, &chart::draw(&map, &heading))? {
        Some(line) => writeln!(out, "{text}  {line}")?,
        None => {
            text.truncate(text.trim_end().len());
            eprintln!("{text}");
        }
    }
    Ok(())
}

/// Returns a range in rad: two ends, or one number for both sides, or what is usual.
fn range(option: &str, given: &[f64], usual: f64, most: f64, unit: Unit) -> Result<Range> {
    let range = match *given {
        [] => return Ok(Range::from_degrees(-usual, usual)),
        [side] => Range {
            low: -unit.read(side)?,
            high: unit.read(side)?,
        },
        [low, high] => Range {
            low: unit.read(low)?,
            high: unit.read(high)?,
        },
        _ => {
            return Err(refused(format!(
                "{option} takes LOW,HIGH or one number for both sides; {} came",
                given.len()
            )));
        }
    };
    let slack = 1e-9;
    if range.low < -most - slack || range.high > most + slack {
        return Err(refused(format!(
            "{option} must be within ±{}° ({} rad); angles are in radians without --degrees",
            plain(most.to_degrees(), 0),
            plain(most, 4)
        )));
    }
    // Less than a tenth of a degree is no map.
    if range.high - range.low < 1.7e-3 {
        return Err(refused(format!(
            "{option} needs LOW below HIGH by at least 0.1° (0.0018 rad), as in {option} {}",
            if unit.name == "deg" {
                "-30,30"
            } else {
                "-0.5,0.5"
            }
        )));
    }
    Ok(range)
}

/// Says what holds in the paper's box.
fn summary_text(name: &str, roll: f64, summary: &Summary) -> String {
    let at = |pose: [f64; 3]| {
        let [yaw, pitch, roll] = pose.map(|angle| plain(angle.to_degrees(), 1));
        format!("yaw {yaw}°, pitch {pitch}°, roll {roll}°")
    };
    let number = |value: f64| {
        if value.is_finite() {
            plain(value, 4)
        } else {
            "∞".to_owned()
        }
    };
    let lines = |extremes: &Extremes| {
        format!(
            "    least margin             {:>8}  at {}\n    worst condition of rates {:>8}  at {}\n",
            number(extremes.margin.value),
            at(extremes.margin.pose),
            number(extremes.condition.value),
            at(extremes.condition.pose)
        )
    };
    let growth = if summary.largest_box > 1.0 {
        format!(
            "free of singularities, and may grow {} times",
            plain(summary.largest_box, 3)
        )
    } else {
        format!(
            "holds a singularity: free of them if scaled by {}",
            plain(summary.largest_box, 3)
        )
    };
    format!(
        "{name}, home's working mode\n  \
         the paper's box, yaw ±30°, pitch ±15°, at roll {}°\n{}  \
         the same at any roll within ±4°: {growth}\n{}    \
         mean of 1/κ              {:>8}  of A, {} of the motors' rates\n",
        plain(roll.to_degrees(), 1),
        lines(&summary.at_roll),
        lines(&summary.any_roll),
        plain(summary.isotropy.of_a, 4),
        plain(summary.isotropy.of_rates, 4),
    )
}

fn write_json(
    out: &mut dyn Write,
    asked: &Workspace,
    unit: Unit,
    map: &Map,
    summary: &Summary,
) -> Result<()> {
    let shown = |angles: &[f64]| angles.iter().map(|angle| unit.show([*angle])[0]).collect();
    let reach = &map.reach.values;
    let of = map.values.iter().map(|(measure, field)| {
        let rows = field.values.iter().zip(reach).map(|(row, reach)| {
            let cells = row.iter().zip(reach);
            cells
                .map(|(value, reach)| (*reach >= 0.0).then(|| measure.number(*value)).flatten())
                .collect()
        });
        (measure.name(), rows.collect())
    });
    let [yaw, pitch, roll] = Travel::PAPER.map(|range| unit.show([range.low, range.high]));
    let answer = Answer {
        architecture: asked.subject.architecture,
        unit: unit.name,
        roll: asked.roll,
        yaw: shown(&map.yaw),
        pitch: shown(&map.pitch),
        of: of.collect(),
        reach: reach
            .iter()
            .map(|row| row.iter().map(|reach| *reach >= 0.0).collect())
            .collect(),
        summary: SummaryAnswer {
            within: [("yaw", yaw), ("pitch", pitch), ("roll", roll)].into(),
            at_roll: ExtremesAnswer::of(&summary.at_roll, unit),
            any_roll: ExtremesAnswer::of(&summary.any_roll, unit),
            largest_box: summary.largest_box,
            global_isotropy: summary.isotropy.of_a,
            global_isotropy_of_rates: summary.isotropy.of_rates,
        },
    };
    serde_json::to_writer(&mut *out, &answer)?;
    Ok(writeln!(out)?)
}

impl ExtremesAnswer {
    fn of(extremes: &Extremes, unit: Unit) -> Self {
        let answer = |extreme: &Extreme| {
            let [yaw, pitch, roll] = unit.show(extreme.pose);
            ExtremeAnswer {
                value: Some(extreme.value).filter(|value| value.is_finite()),
                yaw,
                pitch,
                roll,
            }
        };
        Self {
            least_margin: answer(&extremes.margin),
            worst_condition: answer(&extremes.condition),
        }
    }
}
