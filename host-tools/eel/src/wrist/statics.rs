//! `eel wrist jacobian` and `eel wrist margin`.

use std::io::Write;

use anyhow::Result;
use eel_kinematics::design::Matrix3;
use serde::Serialize;

use super::args::{Architecture, At, Kernel};
use super::fixed;
use super::number::{Unit, columns, plain};
use super::place::{Place, Room, travel_line};
use super::refused;

type Rows = [[f64; 3]; 3];

#[derive(Serialize)]
struct JacobianAnswer {
    architecture: Architecture,
    unit: &'static str,
    theta: [f64; 3],
    a: Rows,
    b: [f64; 3],
    rate_map: Rows,
    torque_map: Rows,
    torque_map_fixed: Option<Rows>,
    fixed_refusal: Option<&'static str>,
    det_a: f64,
    condition: f64,
    condition_of_rates: f64,
}

#[derive(Serialize)]
struct MarginAnswer {
    architecture: Architecture,
    kernel: Kernel,
    margin: f64,
    serial: [f64; 3],
    assembly: f64,
    depths: [f64; 2],
    least_singular: f64,
    least: f64,
    travel: Room,
    fixed_refusal: Option<&'static str>,
}

/// Returns the rows of a matrix.
fn rows(matrix: &Matrix3<f64>) -> Rows {
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| matrix[(row, column)]))
}

/// Answers `eel wrist jacobian`.
pub fn jacobian(out: &mut dyn Write, at: &At) -> Result<()> {
    let unit = Unit::of(&at.common.subject);
    let place = Place::find(at, unit)?;
    let choice = fixed::choose(&at.common, None, || fixed::at(place.pose))?;
    let jacobians = &place.jacobians;
    let Some(torque_map) = jacobians.torque_map() else {
        return Err(refused(
            "A is singular at this pose, no torque map exists; move the pose a little",
        ));
    };
    let answer = JacobianAnswer {
        architecture: at.common.subject.architecture,
        unit: unit.name,
        theta: unit.show(place.theta),
        a: rows(&jacobians.a),
        b: jacobians.b.into(),
        rate_map: rows(&jacobians.rate_map()),
        torque_map: rows(&torque_map),
        torque_map_fixed: choice
            .fixed
            .as_ref()
            .map(|found| rows(&fixed::torque_map(found))),
        fixed_refusal: choice.refusal,
        det_a: jacobians.det_a(),
        condition: jacobians.condition(),
        condition_of_rates: jacobians.condition_of_rates(),
    };
    if at.common.subject.json {
        serde_json::to_writer(&mut *out, &answer)?;
        return Ok(writeln!(out)?);
    }
    let name = at.common.subject.architecture.name();
    writeln!(
        out,
        "{name}, theta{} {}",
        unit.columns(&place.theta),
        unit.name
    )?;
    let mut table = |title: &str, rows: &Rows| -> Result<()> {
        writeln!(out, "\n  {title}")?;
        for row in rows {
            writeln!(out, "  {}", columns(row, 9))?;
        }
        Ok(())
    };
    table("A, rows p1×r1, p2×r2, z''", &answer.a)?;
    table("rates of the motors from ω, B⁻¹A", &answer.rate_map)?;
    table(
        "torques of the motors from M, B A⁻ᵀ, f64",
        &answer.torque_map,
    )?;
    if let Some(rows) = &answer.torque_map_fixed {
        table("the same, fixed point", rows)?;
    }
    writeln!(out, "\n  b{}", columns(&answer.b, 9))?;
    writeln!(
        out,
        "  det A {}  condition {} (of rates {})",
        plain(answer.det_a, 6),
        plain(answer.condition, 4),
        plain(answer.condition_of_rates, 4)
    )?;
    Ok(())
}

/// Answers `eel wrist margin`.
pub fn margin(out: &mut dyn Write, at: &At) -> Result<()> {
    let unit = Unit::of(&at.common.subject);
    let place = Place::find(at, unit)?;
    let margins = &place.margins;
    let choice = fixed::choose(&at.common, None, || fixed::inverse(place.pose))?;
    let of_kernel = choice.fixed.as_ref().map(|found| found.margin);
    let answer = MarginAnswer {
        architecture: at.common.subject.architecture,
        kernel: choice.used,
        margin: of_kernel
            .filter(|_| choice.used == Kernel::Fixed)
            .unwrap_or(margins.legs()),
        serial: margins.serial,
        assembly: margins.parallel,
        depths: margins.depths,
        least_singular: margins.least_singular,
        least: margins.least(),
        travel: Room::of(&place.limit, unit),
        fixed_refusal: choice.refusal,
    };
    if at.common.subject.json {
        serde_json::to_writer(&mut *out, &answer)?;
        return Ok(writeln!(out)?);
    }
    writeln!(
        out,
        "{}, 1 at home, 0 at a singularity",
        at.common.subject.architecture.name()
    )?;
    let mut line = |name: &str, margin: f64| writeln!(out, "  {name:<28}{:>12}", plain(margin, 9));
    line("serial, leg 1", margins.serial[0])?;
    line("serial, leg 2", margins.serial[1])?;
    line("serial, leg 3 (cos phi)", margins.serial[2])?;
    line("assembly (det A)", margins.parallel)?;
    line("  its factor of leg 1", margins.depths[0])?;
    line("  its factor of leg 2", margins.depths[1])?;
    line("least singular value of A", margins.least_singular)?;
    line("least", margins.least())?;
    if let Some(margin) = of_kernel {
        line("the kernel's (legs 1 and 2)", margin)?;
    }
    if let Some(reason) = choice.refusal {
        writeln!(out, "  the kernel does not answer: {reason}")?;
    }
    Ok(writeln!(out, "  {}", travel_line(&place.limit, unit))?)
}
