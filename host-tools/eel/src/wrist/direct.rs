//! `eel wrist fk`: the pose for motor angles.

use std::io::Write;

use anyhow::Result;
use eel_kinematics::Direct;
use eel_kinematics::design::{self, AssemblyMode, Geometry, Matrix3};
use serde::Serialize;

use super::args::{Architecture, Fk, Kernel};
use super::fixed::{self, Choice};
use super::number::{Unit, plain};
use super::refused;

#[derive(Serialize)]
struct Answer {
    architecture: Architecture,
    kernel: Kernel,
    unit: &'static str,
    theta: [f64; 3],
    assembly_mode: &'static str,
    #[serde(flatten)]
    answer: Platform,
    f64: Platform,
    fixed: Option<Platform>,
    fixed_refusal: Option<&'static str>,
    solutions: Vec<Solution>,
}

/// A platform's angles, the paper's and ours, and det A there.
#[derive(Clone, Copy, Serialize)]
pub struct Platform {
    phi: f64,
    psi: f64,
    yaw: f64,
    pitch: f64,
    roll: f64,
    det_a: f64,
}

#[derive(Serialize)]
struct Solution {
    assembly_mode: &'static str,
    #[serde(flatten)]
    platform: Platform,
}

impl Platform {
    /// Returns the angles in rad of an orientation that motor 3 turned by a known angle.
    pub fn of(rotation: &Matrix3<f64>, theta3: f64, det_a: f64) -> Self {
        let [phi, psi] = phi_psi(rotation, theta3);
        let [yaw, pitch, roll] = design::pose(rotation);
        Self {
            phi,
            psi,
            yaw,
            pitch,
            roll,
            det_a,
        }
    }

    fn angles(&self) -> [f64; 5] {
        [self.phi, self.psi, self.yaw, self.pitch, self.roll]
    }

    /// Returns the same with angles in a unit.
    pub fn in_unit(&self, unit: Unit) -> Self {
        let [phi, psi, yaw, pitch, roll] = unit.show(self.angles());
        Self {
            phi,
            psi,
            yaw,
            pitch,
            roll,
            det_a: self.det_a,
        }
    }
}

/// Returns φ and ψ of R = Rz(θ3) Ry(φ) Rx(ψ) where θ3 is known; φ may be beyond ±π/2.
pub fn phi_psi(rotation: &Matrix3<f64>, theta3: f64) -> [f64; 2] {
    let turned = design::rotation_from_platform(-theta3, 0.0, 0.0) * rotation;
    [
        (-turned[(2, 0)]).atan2(turned[(0, 0)]),
        (-turned[(1, 2)]).atan2(turned[(1, 1)]),
    ]
}

/// Answers `eel wrist fk`.
pub fn run(out: &mut dyn Write, fk: &Fk) -> Result<()> {
    let unit = Unit::of(&fk.common.subject);
    let Ok(asked) = <[f64; 3]>::try_from(fk.theta.clone()) else {
        return Err(refused(format!(
            "--theta takes three angles, as in --theta 0.1,0.2,0.785; {} came",
            fk.theta.len()
        )));
    };
    let [a, b, c] = asked;
    let theta = [unit.read(a)?, unit.read(b)?, unit.read(c)?];
    let geometry = fk.common.subject.architecture.geometry();
    let all = platforms(&geometry, &theta);
    let mode = fk.assembly_mode;
    let exists = is_joined(&geometry, mode, &theta);
    let Some((_, asked_for)) = all.iter().find(|(name, _)| exists && *name == mode.name()) else {
        return Err(no_platform(mode, all.iter().map(|(name, _)| *name)));
    };
    let other = (mode != AssemblyMode::HOME).then(|| mode.name());
    let choice = fixed::choose(&fk.common, other, || fixed::direct(&theta))?;
    let of_kernel = choice
        .fixed
        .as_ref()
        .map(|found| kernel_platform(found, theta[2]));
    if !fk.common.subject.json {
        return write_text(
            out,
            fk,
            unit,
            (asked_for, of_kernel.as_ref()),
            &all,
            &choice,
        );
    }
    let fixed = of_kernel.map(|platform| platform.in_unit(unit));
    let f64 = asked_for.in_unit(unit);
    let solutions = all.iter().map(|(assembly_mode, platform)| Solution {
        assembly_mode,
        platform: platform.in_unit(unit),
    });
    let answer = Answer {
        architecture: fk.common.subject.architecture,
        kernel: choice.used,
        unit: unit.name,
        theta: asked,
        assembly_mode: mode.name(),
        answer: fixed
            .filter(|_| choice.used == Kernel::Fixed)
            .unwrap_or(f64),
        f64,
        fixed,
        fixed_refusal: choice.refusal,
        solutions: solutions.collect(),
    };
    serde_json::to_writer(&mut *out, &answer)?;
    Ok(writeln!(out)?)
}

/// Tells whether an assembly mode may be asked for: in home's branch cos φ must be positive too.
pub fn is_joined(geometry: &Geometry, mode: AssemblyMode, theta: &[f64; 3]) -> bool {
    mode != AssemblyMode::HOME || geometry.direct(theta).is_some()
}

/// Says that the motors' angles can't be joined in a mode, and in which they can.
pub fn no_platform<'a>(
    mode: AssemblyMode,
    found: impl IntoIterator<Item = &'a str>,
) -> anyhow::Error {
    let others: Vec<&str> = found
        .into_iter()
        .filter(|name| *name != mode.name())
        .collect();
    let cure = if others.is_empty() {
        String::new()
    } else {
        format!(", or say --assembly-mode {}", others.join(" or "))
    };
    refused(format!(
        "no platform joins these motor angles in the {} branch; bring theta nearer to home, \
         (0, 0, π/4) rad{cure} (angles are in radians without --degrees)",
        mode.name()
    ))
}

/// Returns every direct solution with the name of its mode, home's first.
fn platforms(geometry: &Geometry, theta: &[f64; 3]) -> Vec<(&'static str, Platform)> {
    let names = AssemblyMode::ALL.map(AssemblyMode::name);
    let found = names.into_iter().zip(geometry.direct_all(theta));
    found
        .filter_map(|(name, rotation)| {
            let rotation = rotation?;
            let det_a = geometry.jacobians(&rotation, theta).det_a();
            Some((name, Platform::of(&rotation, theta[2], det_a)))
        })
        .collect()
}

fn kernel_platform(found: &Direct, theta3: f64) -> Platform {
    let det_a = f64::from(found.jacobian.det_a()) / f64::from(1 << 30);
    let mut platform = Platform::of(&fixed::matrix(&found.rotation), theta3, det_a);
    let pose = found.rotation.to_pose();
    [platform.yaw, platform.pitch, platform.roll] =
        [pose.yaw, pose.pitch, pose.roll].map(fixed::radians);
    platform
}

fn write_text(
    out: &mut dyn Write,
    fk: &Fk,
    unit: Unit,
    (asked_for, of_kernel): (&Platform, Option<&Platform>),
    all: &[(&'static str, Platform)],
    choice: &Choice<Direct>,
) -> Result<()> {
    writeln!(
        out,
        "{}, angles in {}",
        fk.common.subject.architecture.name(),
        unit.name
    )?;
    let heads = ["phi", "psi", "yaw", "pitch", "roll", "det A"];
    let heads: String = heads.iter().map(|head| format!("{head:>14}")).collect();
    writeln!(out, "            {heads}")?;
    let mut line = |name: &str, platform: &Platform| {
        let angles = unit.columns(&platform.angles());
        writeln!(out, "  {name:<10}{angles}{:>14}", plain(platform.det_a, 6))
    };
    if let Some(platform) = of_kernel {
        line("fixed", platform)?;
    }
    line("f64", asked_for)?;
    if fk.all {
        for (name, platform) in all {
            line(name, platform)?;
        }
    }
    if let Some(reason) = choice.refusal {
        writeln!(out, "  fixed     none: {reason}")?;
    }
    Ok(())
}
