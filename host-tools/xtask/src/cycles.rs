//! What the wrist's kernel costs and how exact it is: instructions in QEMU, bytes of flash, errors, and
//! whether every machine answers with the same bits. What the CANopen node costs comes with it.
//!
//! Instructions are no cycles, and no stand-in for a measurement on silicon.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};

use crate::counts::{Counts, TOLERANCE};
use crate::cross;
use crate::errors::Errors;
use crate::image::Image;
use crate::node::Node;
use crate::process::{self, cargo, clean_root, command, output, run as run_command};

/// A processor that is measured, and the machine of QEMU that has it.
pub struct Core {
    /// Its name in the budget.
    pub name: &'static str,
    target: &'static str,
    machine: &'static str,
    /// SysTick's ticks in 1000 instructions: the machine's clock in MHz.
    pub ticks: f64,
    /// The most flash that the kernel may take, in bytes, where a vertebra has this processor.
    ceiling: Option<u64>,
}

/// The vertebra's processor, and one without floats and DSP instructions.
pub const CORES: [Core; 2] = [
    Core {
        name: "cortex-m4",
        target: cross::TARGET,
        machine: "netduinoplus2",
        ticks: 168.0,
        ceiling: Some(3_584),
    },
    Core {
        name: "cortex-m3",
        target: cross::CORTEX_M3,
        machine: "netduino2",
        ticks: 120.0,
        ceiling: None,
    },
];

/// The fewest poses that are worth a hash.
const LEAST_HASHED: u64 = 1_000_000;

/// The hash of what the kernel answers.
#[derive(PartialEq, Eq)]
struct Answers {
    poses: u64,
    /// How many of them the kernel doesn't refuse.
    answered: u64,
    hash: String,
}

/// The kernel's bytes of flash.
struct Flash {
    /// All that an image with the kernel has more than one without.
    whole: u64,
    /// What each function takes of it; the rest is tables and constants.
    parts: [(&'static str, u64); 3],
}

/// What was found out about one processor.
struct Measured {
    core: &'static Core,
    counts: Counts,
    answers: Answers,
    flash: Flash,
}

/// Measures on both processors, prints, and compares the answers with this machine's; the CANopen node
/// too, or alone.
///
/// # Errors
/// When an image can't be built or fails, its answers differ from the native ones, or while `check` is
/// set a budget, the spread or the ceiling of flash is exceeded, or single precision comes too near.
pub fn run(json: bool, check: bool, node_alone: bool) -> Result<()> {
    let Some(emulator) = process::find("qemu-system-arm") else {
        bail!("qemu-system-arm is missing; Debian has it in the package of that name");
    };
    let (mut found, mut complaints) = (json!({}), Vec::new());
    if !node_alone {
        (found, complaints) = measure_kernel(&emulator, json, check)?;
    }
    let node = Node::measure(&CORES[0], &emulator)?;
    if json {
        found["node"] = node.to_json();
        println!("{found:#}");
    } else {
        println!("\n{node}");
    }
    if check {
        complaints.extend(node.complaints()?);
        ensure!(complaints.is_empty(), "{}", complaints.join("; "));
        if !json {
            println!("everything is within its bound");
        }
    }
    Ok(())
}

/// Measures the kernel, prints unless JSON is wanted, and returns that with what exceeds its bound.
fn measure_kernel(emulator: &Path, json: bool, check: bool) -> Result<(Value, Vec<String>)> {
    let errors = Errors::read(&native("cycles")?)?;
    let answers = Answers::read(&native("answers")?)?;
    let mut all = Vec::new();
    for core in &CORES {
        all.push(Measured::take(core, emulator)?);
    }
    if !json {
        all.iter().for_each(Measured::print);
        println!("\n{errors}");
        println!("\n{answers}, this machine");
    }
    for measured in &all {
        ensure!(
            measured.answers == answers,
            "{} answers with other bits than this machine: {} instead of {answers}",
            measured.core.name,
            measured.answers
        );
    }
    let complaints = if check {
        complaints(&all, &errors)?
    } else {
        Vec::new()
    };
    Ok((to_json(&all, &answers, &errors), complaints))
}

/// Returns what exceeds its bound.
fn complaints(all: &[Measured], errors: &Errors) -> Result<Vec<String>> {
    let budget = read_budget()?;
    let mut complaints = errors.complaints();
    for measured in all {
        let Measured {
            core,
            counts,
            flash,
            ..
        } = measured;
        complaints.extend(counts.complaints(core.name, &budget[core.name]));
        if let Some(ceiling) = core
            .ceiling
            .filter(|ceiling| flash.whole as f64 > *ceiling as f64 * TOLERANCE)
        {
            complaints.push(format!(
                "the kernel takes {} bytes of flash on {}, ceiling {ceiling}",
                flash.whole, core.name
            ));
        }
    }
    Ok(complaints)
}

/// Runs one of the measuring programs on this machine and returns what it printed.
fn native(binary: &str) -> Result<String> {
    output(cargo().args(["run", "--quiet", "-p", "board-qemu", "--bin", binary]))
}

impl Measured {
    /// Builds the images for a processor, runs them and reads what they print.
    fn take(core: &'static Core, emulator: &Path) -> Result<Self> {
        let mut build = cross::build_command_for(core.target)?;
        build.args(["-p", "board-qemu"]);
        for binary in ["cycles", "answers", "kernel", "bare"] {
            build.args(["--bin", binary]);
        }
        run_command(&mut build)?;
        // Virtual time makes counting possible and QEMU slow: answers do without.
        let counts = core.run(emulator, "cycles", &["-icount", "shift=0,sleep=off"])?;
        let answers = core.run(emulator, "answers", &[])?;
        let nonsense = || format!("what {} printed makes no sense", core.name);
        Ok(Self {
            core,
            counts: Counts::read(core, &counts).with_context(nonsense)?,
            answers: Answers::read(&answers).with_context(nonsense)?,
            flash: Flash::measure(core)?,
        })
    }

    fn print(&self) {
        let Self {
            core,
            counts,
            answers,
            flash,
        } = self;
        println!("\ninstructions on {}\n{counts}", core.name);
        let parts = flash.parts.map(|(name, size)| format!("{name} {size}"));
        let ceiling = core.ceiling.map_or_else(
            || "no ceiling".to_owned(),
            |ceiling| format!("ceiling {ceiling}"),
        );
        println!(
            "flash of the kernel: {} bytes ({}, tables and the rest {}), {ceiling}",
            flash.whole,
            parts.join(", "),
            flash.rest()
        );
        println!("{answers}");
    }
}

impl Core {
    /// Runs an image in QEMU and returns what it printed.
    ///
    /// # Errors
    /// When QEMU can't be started or the image fails.
    pub fn run(&self, emulator: &Path, binary: &str, options: &[&str]) -> Result<String> {
        let mut machine = command(emulator);
        machine
            .args(["-M", self.machine, "-display", "none", "-monitor", "none"])
            .args(["-serial", "none"])
            .args(options)
            .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
            .arg(cross::built_for(self.target, binary));
        output(&mut machine)
    }
}

impl Answers {
    /// Reads poses, answered poses and hash.
    fn read(text: &str) -> Result<Self> {
        let mut lines = text.lines();
        let mut value = |name: &str| {
            let words = lines.next().and_then(|line| line.split_once('\t'));
            let found = words.filter(|(word, _)| *word == name);
            found.with_context(|| format!("no {name}"))
        };
        let (_, poses) = value("poses")?;
        let (_, answered) = value("answered")?;
        let (_, hash) = value("hash")?;
        let answers = Self {
            poses: poses.parse()?,
            answered: answered.parse()?,
            hash: hash.to_owned(),
        };
        ensure!(
            answers.poses >= LEAST_HASHED && answers.answered >= LEAST_HASHED / 2,
            "too few: {answers}"
        );
        Ok(answers)
    }
}

impl std::fmt::Display for Answers {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            poses,
            answered,
            hash,
        } = self;
        write!(
            out,
            "answers to {poses} poses, {answered} not refused: hash {hash}"
        )
    }
}

impl Flash {
    /// Compares the image with the kernel and the one without it.
    fn measure(core: &Core) -> Result<Self> {
        let read = |binary| Image::read(&cross::built_for(core.target, binary));
        let (kernel, bare) = (read("kernel")?, read("bare")?);
        let functions = kernel.functions()?;
        let part = |of: &'static str, mark: &str| {
            let named = functions.iter().filter(|(name, _)| name.contains(mark));
            (of, named.map(|(_, size)| size).sum())
        };
        let whole = kernel.size()?.flash.checked_sub(bare.size()?.flash);
        let flash = Self {
            whole: whole.context("an image with the kernel is smaller than one without")?,
            parts: [
                part("inverse", "5image7inverse"),
                part("direct", "5image6direct"),
                part("sharing", "5share"),
            ],
        };
        // Sharing's helper bears its file's or its own name.
        let sum: u64 = flash.parts.iter().map(|(_, size)| size).sum();
        ensure!(
            flash.parts.iter().all(|(_, size)| *size > 0) && sum < flash.whole,
            "the functions of the kernel aren't in its image"
        );
        Ok(flash)
    }

    /// Returns what is no function: tables, constants, and three addresses.
    fn rest(&self) -> u64 {
        self.whole - self.parts.iter().map(|(_, size)| size).sum::<u64>()
    }
}

fn to_json(all: &[Measured], native: &Answers, errors: &Errors) -> Value {
    let hashed = |answers: &Answers| {
        json!({
            "poses": answers.poses, "answered": answers.answered, "hash": answers.hash,
        })
    };
    let mut value = json!({});
    for measured in all {
        let Measured {
            core,
            counts,
            answers,
            flash,
        } = measured;
        let mut bytes = json!({
            "kernel": flash.whole, "ceiling": core.ceiling, "tables_and_rest": flash.rest(),
        });
        for (name, size) in flash.parts {
            bytes[name] = json!(size);
        }
        let mut found = counts.to_json();
        found["flash"] = bytes;
        found["answers"] = hashed(answers);
        value[core.name] = found;
    }
    value["native"] = json!({ "answers": hashed(native), "errors": errors.to_json() });
    value
}

/// Returns where the budget is.
fn budget_path() -> PathBuf {
    clean_root().join("firmware/kinematics/budget.json")
}

fn read_budget() -> Result<Value> {
    let path = budget_path();
    let text =
        fs::read_to_string(&path).with_context(|| format!("could not read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is no JSON", path.display()))
}

#[cfg(test)]
mod tests {
    use super::Answers;

    #[test]
    fn refuses_answers_that_are_cut_or_mostly_refusals() {
        let text = |answered| format!("poses\t1000000\nanswered\t{answered}\nhash\tabc\n");
        assert!(Answers::read(&text(800_000)).is_ok());
        assert!(Answers::read(&text(400_000)).is_err());
        assert!(Answers::read("poses\t1000000\nanswered\t800000").is_err());
        assert!(Answers::read("poses\t1000\nanswered\t800\nhash\tabc").is_err());
    }
}
