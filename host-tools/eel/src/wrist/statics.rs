//! `eel wrist jacobian` and `eel wrist margin`.

use std::io::Write;

use anyhow::Result;
use eel_kinematics::design::Matrix3;
use serde::Serialize;

use super::args::{Architecture, At, Kernel};
use super::fixed;
use super::number::{Unit, columns, plain};
use super::place::Place;
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
    least: f64,
    fixed_refusal: Option<&'static str>,
}

/// Returns the rows of a matrix.
fn rows(matrix: &Matrix3<f64>) -> Rows {
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| matrix[(row, column)]))
}

/// Answers `eel wrist jacobian`.
pub fn jacobian(out: &mut dyn Write, at: &At) -> Result<()> {
    let unit = Unit::of(&at.common);
    let place = Place::find(at, unit)?;
    let choice = fixed::choose(&at.common, || fixed::at(place.pose))?;
    let jacobians = &place.jacobians;
    let Some(torque_map) = jacobians.torque_map() else {
        return Err(refused(
            "A is singular at this pose, no torque map exists; move the pose a little",
        ));
    };
    let answer = JacobianAnswer {
        architecture: at.common.architecture,
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
    if at.common.json {
        serde_json::to_writer(&mut *out, &answer)?;
        return Ok(writeln!(out)?);
    }
    let name = at.common.architecture.name();
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
    let place = Place::find(at, Unit::of(&at.common))?;
    let choice = fixed::choose(&at.common, || fixed::inverse(place.pose))?;
    let of_kernel = choice.fixed.as_ref().map(|found| found.margin);
    let assembly = place.jacobians.det_a();
    let least = place.serial.into_iter().fold(assembly, f64::min);
    let answer = MarginAnswer {
        architecture: at.common.architecture,
        kernel: choice.used,
        margin: of_kernel
            .filter(|_| choice.used == Kernel::Fixed)
            .unwrap_or(place.margin()),
        serial: place.serial,
        assembly,
        least,
        fixed_refusal: choice.refusal,
    };
    if at.common.json {
        serde_json::to_writer(&mut *out, &answer)?;
        return Ok(writeln!(out)?);
    }
    writeln!(
        out,
        "{}, 1 at home, 0 at a singularity",
        at.common.architecture.name()
    )?;
    let mut line = |name: &str, margin: f64| writeln!(out, "  {name:<28}{:>12}", plain(margin, 9));
    line("serial, leg 1", place.serial[0])?;
    line("serial, leg 2", place.serial[1])?;
    line("serial, leg 3 (cos phi)", place.serial[2])?;
    line("assembly (det A)", assembly)?;
    line("least", least)?;
    if let Some(margin) = of_kernel {
        line("the kernel's (legs 1 and 2)", margin)?;
    }
    if let Some(reason) = choice.refusal {
        writeln!(out, "  the kernel does not answer: {reason}")?;
    }
    Ok(())
}
