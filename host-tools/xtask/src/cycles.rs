//! Instructions of the wrist's kernel, counted in QEMU and held to a budget.
//!
//! The image prints ticks of virtual time, one line a pose; what a loop alone takes is subtracted
//! here. Instructions are no cycles, and no stand-in for a measurement on silicon.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Map, Value, json};

use crate::cross;
use crate::process::{self, cargo, clean_root, command, output, run as run_command};

/// A processor that is measured, and the machine of QEMU that has it.
struct Core {
    name: &'static str,
    target: &'static str,
    machine: &'static str,
    /// SysTick's ticks in 1000 instructions: the machine's clock in MHz.
    ticks: f64,
}

const CORES: [Core; 2] = [
    Core {
        name: "cortex-m4",
        target: cross::TARGET,
        machine: "netduinoplus2",
        ticks: 168.0,
    },
    Core {
        name: "cortex-m3",
        target: cross::CORTEX_M3,
        machine: "netduino2",
        ticks: 120.0,
    },
];

/// By how much a median may exceed its budget.
const TOLERANCE: f64 = 1.02;
/// The column that is measured against, and so has no budget.
const FLOATING: &str = "inverse_f32";
/// The fewest poses that are worth a median.
const LEAST_POSES: usize = 1_000;

/// Instructions of one call over all poses.
struct Row {
    name: String,
    least: f64,
    median: f64,
    most: f64,
}

/// What one processor took and answered.
struct Measured {
    core: &'static str,
    poses: usize,
    rows: Vec<Row>,
    hash: String,
}

/// Measures on both processors, prints, and compares the answers with this machine's.
///
/// # Errors
/// When the image can't be built or fails, its answers differ from the native ones, or a budget is
/// exceeded while `check` is set.
pub fn run(json: bool, check: bool) -> Result<()> {
    let Some(emulator) = process::find("qemu-system-arm") else {
        bail!("qemu-system-arm is missing; Debian has it in the package of that name");
    };
    let native = native_hash()?;
    let mut all = Vec::new();
    for core in &CORES {
        all.push(measure(core, &emulator)?);
    }
    if json {
        println!("{:#}", to_json(&all, &native));
    } else {
        all.iter().for_each(print_table);
        println!("\nhash of the answers on this machine: {native}");
    }
    for measured in &all {
        ensure!(
            measured.hash == native,
            "{} answers with other bits than this machine: {} instead of {native}",
            measured.core,
            measured.hash
        );
    }
    if check {
        let complaints = compare(&all, &read_budget()?);
        ensure!(complaints.is_empty(), "{}", complaints.join("; "));
        if !json {
            println!("every median is within its budget");
        }
    }
    Ok(())
}

/// Builds the image for a processor, runs it and reads what it printed.
fn measure(core: &Core, emulator: &Path) -> Result<Measured> {
    let mut build = cross::build_command_for(core.target)?;
    run_command(build.args(["-p", "board-qemu", "--bin", "cycles"]))?;
    let mut machine = command(emulator);
    machine
        .args(["-M", core.machine, "-display", "none", "-monitor", "none"])
        .args(["-serial", "none", "-icount", "shift=0,sleep=off"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(cross::built_for(core.target, "cycles"));
    let text = output(&mut machine)?;
    read(core, &text).with_context(|| format!("what {} printed makes no sense", core.name))
}

/// Returns the hash of the answers on this machine.
fn native_hash() -> Result<String> {
    let mut program = cargo();
    program.args(["run", "--quiet", "-p", "board-qemu", "--bin", "cycles"]);
    let text = output(&mut program)?;
    let hash = text.trim().strip_prefix("hash\t");
    Ok(hash.context("no hash")?.to_owned())
}

/// Reads the image's output: repeats, names, ticks of each pose, hash.
fn read(core: &Core, text: &str) -> Result<Measured> {
    let (mut repeats, mut names, mut hash) = (0.0, Vec::new(), None);
    let mut poses: Vec<Vec<f64>> = Vec::new();
    for line in text.lines() {
        let mut words = line.split('\t');
        match words.next() {
            Some("repeats") => repeats = words.next().unwrap_or_default().parse()?,
            Some("names") => names = words.collect(),
            Some("ticks") => poses.push(words.map(str::parse).collect::<Result<_, _>>()?),
            Some("hash") => hash = words.next(),
            _ => bail!("unexpected: {line}"),
        }
    }
    ensure!(repeats > 0.0, "it does not say how often it repeats");
    ensure!(poses.len() >= LEAST_POSES, "only {} poses", poses.len());
    ensure!(
        names.len() > 1 && poses.iter().all(|ticks| ticks.len() == names.len()),
        "names and ticks do not match"
    );
    let scale = 1_000.0 / core.ticks / repeats;
    let rows = names.iter().enumerate().skip(1).map(|(column, name)| {
        let taken = poses.iter().map(|ticks| (ticks[column] - ticks[0]) * scale);
        let mut sorted: Vec<f64> = taken.map(f64::round).collect();
        sorted.sort_by(f64::total_cmp);
        Row {
            name: (*name).to_owned(),
            least: sorted[0],
            median: sorted[sorted.len() / 2],
            most: sorted[sorted.len() - 1],
        }
    });
    Ok(Measured {
        core: core.name,
        poses: poses.len(),
        rows: rows.collect(),
        hash: hash.context("no hash")?.to_owned(),
    })
}

fn print_table(measured: &Measured) {
    let Measured {
        core,
        poses,
        rows,
        hash,
    } = measured;
    println!("\ninstructions on {core}, {poses} poses");
    println!("{:<18}{:>8}{:>8}{:>8}", "", "min", "median", "max");
    for row in rows {
        let Row {
            name,
            least,
            median,
            most,
        } = row;
        println!("{name:<18}{least:>8}{median:>8}{most:>8}");
    }
    let median = |wanted| rows.iter().find(|row| row.name == wanted);
    if let (Some(ours), Some(floating)) = (median("inverse"), median(FLOATING)) {
        let ratio = floating.median / ours.median;
        println!("the inverse in f32 with libm takes {ratio:.1} times as many");
    }
    println!("hash of the answers: {hash}");
}

fn to_json(all: &[Measured], native: &str) -> Value {
    let cores = all.iter().map(|measured| {
        let rows = measured.rows.iter().map(|row| {
            let Row {
                name,
                least,
                median,
                most,
            } = row;
            let numbers = json!({
                "min": *least as i64, "median": *median as i64, "max": *most as i64,
            });
            (name.clone(), numbers)
        });
        let value = json!({
            "poses": measured.poses,
            "instructions": rows.collect::<Map<_, _>>(),
            "hash": measured.hash,
        });
        (measured.core.to_owned(), value)
    });
    let mut value = Value::Object(cores.collect());
    value["native"] = json!({ "hash": native });
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

/// Returns what exceeds its budget, has none, or is budgeted and not measured.
fn compare(all: &[Measured], budget: &Value) -> Vec<String> {
    let mut complaints = Vec::new();
    for Measured { core, rows, .. } in all {
        for row in rows.iter().filter(|row| row.name != FLOATING) {
            let Row { name, median, .. } = row;
            match budget[*core][name].as_f64() {
                Some(limit) if *median <= limit * TOLERANCE => {}
                Some(limit) => complaints.push(format!(
                    "{name} takes {median} instructions on {core}, budget {limit}"
                )),
                None => complaints.push(format!("{name} has no budget on {core}")),
            }
        }
        for name in budget[*core].as_object().into_iter().flat_map(Map::keys) {
            if !rows.iter().any(|row| row.name == *name) {
                complaints.push(format!("{name} on {core} has a budget and is not measured"));
            }
        }
    }
    complaints
}

#[cfg(test)]
mod tests {
    use super::{CORES, compare, read};
    use serde_json::json;

    /// Two calls of 10 and 84 ticks a repeat beside a loop of 2, with an outlier.
    fn sample() -> String {
        let mut text = "repeats\t1\nnames\tloop\troot\tinverse_f32".to_owned();
        for pose in 0..1_001 {
            let root = if pose == 7 { 422 } else { 170 };
            text.push_str(&format!("\nticks\t2\t{root}\t338"));
        }
        text + "\nhash\tabc"
    }

    #[test]
    fn subtracts_the_loop_and_keeps_the_extremes() {
        let measured = read(&CORES[0], &sample()).expect("well formed");
        let [root, floating] = measured.rows.as_slice() else {
            panic!("two rows");
        };
        assert_eq!((root.least, root.median, root.most), (1e3, 1e3, 2.5e3));
        assert_eq!(floating.median, 2e3);
        assert_eq!(measured.hash, "abc");
    }

    #[test]
    fn complains_two_percent_above_a_budget_and_not_before() {
        let measured = [read(&CORES[0], &sample()).expect("well formed")];
        let complaints = |budget| compare(&measured, &json!({ "cortex-m4": budget })).len();
        assert_eq!(complaints(json!({ "root": 1_000 })), 0);
        assert_eq!(complaints(json!({ "root": 981 })), 0);
        assert_eq!(complaints(json!({ "root": 980 })), 1);
        assert_eq!(complaints(json!({})), 1);
        assert_eq!(complaints(json!({ "root": 1_000, "gone": 5 })), 1);
    }

    #[test]
    fn refuses_an_output_that_was_cut() {
        assert!(read(&CORES[0], "repeats\t32\nnames\tloop\troot").is_err());
        assert!(read(&CORES[0], sample().trim_end_matches("\nhash\tabc")).is_err());
        assert!(read(&CORES[0], "failed\tRefused").is_err());
    }
}
