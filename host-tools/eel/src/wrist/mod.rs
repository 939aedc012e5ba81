//! `eel wrist`: asks the wrist of a vertebra, in double precision and as the firmware answers.
//!
//! The general model (`eel_kinematics::design`) answers for all three architectures of the paper;
//! the firmware's fixed-point kernel for the prototype's, in the home branch. Both answers are shown.

mod args;
mod direct;
mod fixed;
mod inverse;
mod map;
mod number;
mod paper;
mod place;
mod share;
mod sketch;
mod statics;
pub mod svg;

use std::fmt;
use std::io::{BufWriter, Write, stdout};

use anyhow::{Context, Result};

use args::Command;
pub use args::Wrist;

/// A question that has no answer, with the cure. The exit code is 2.
#[derive(Debug)]
pub struct Refused(String);

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Refused {}

/// Makes the error of a question without an answer.
fn refused(text: impl Into<String>) -> anyhow::Error {
    anyhow::Error::new(Refused(text.into()))
}

/// Answers, and returns how many claims that should hold do not.
pub fn run(wrist: &Wrist) -> Result<u64> {
    let mut out = BufWriter::new(stdout().lock());
    let problems = match &wrist.command {
        Command::Ik(ik) => inverse::run(&mut out, ik).map(|()| 0),
        Command::Fk(fk) => direct::run(&mut out, fk).map(|()| 0),
        Command::Jacobian(at) => statics::jacobian(&mut out, at).map(|()| 0),
        Command::Torque(torque) => share::run(&mut out, torque).map(|()| 0),
        Command::Margin(at) => statics::margin(&mut out, at).map(|()| 0),
        Command::Workspace(asked) => map::run(&mut out, asked).map(|()| 0),
        Command::Draw(asked) => sketch::run(&mut out, asked).map(|()| 0),
        Command::Paper(paper) => paper::run(&mut out, paper.json),
    }?;
    out.flush()?;
    Ok(problems)
}

/// Writes a drawing to a file, or to the terminal for `-`, and says where it is if that is not the
/// terminal.
fn deliver(out: &mut dyn Write, target: &str, drawing: &str) -> Result<Option<String>> {
    if target == "-" {
        out.write_all(drawing.as_bytes())?;
        return Ok(None);
    }
    std::fs::write(target, drawing).with_context(|| {
        format!("can't write {target}; --out takes a file in a folder that exists, or - for the terminal")
    })?;
    Ok(Some(format!(
        "wrote {target} ({} KB)",
        drawing.len().div_ceil(1024)
    )))
}

/// Refuses JSON and a drawing on the same terminal.
fn check_out(json: bool, target: Option<&str>) -> Result<()> {
    if json && target == Some("-") {
        return Err(refused(
            "--json and --out - would both go to the terminal; leave one out, or name a file with --out",
        ));
    }
    Ok(())
}
