//! Everything that the project can test, step by step.

use std::env;
use std::ffi::OsStr;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use crate::process::{cargo, clean_root, output, run, target_dir};
use crate::{
    coverage, cycles, exhaustive, firmware, fuzz, generated, panics, proofs, setup, stack, vcan,
};

/// How long each fuzz target looks for new inputs.
pub const FUZZ_SECONDS: u64 = 60;
/// How many random and bent frames a node must live through.
const ANY_FRAMES: &str = "10000000";

/// One step: its name, and whether a fast run has it.
struct Step {
    name: &'static str,
    in_fast: bool,
    run: fn() -> Result<()>,
}

const STEPS: [Step; 17] = [
    Step {
        name: "tools",
        in_fast: false,
        run: setup::prepare,
    },
    Step {
        name: "format",
        in_fast: true,
        run: check_format,
    },
    Step {
        name: "lints",
        in_fast: true,
        run: check_lints,
    },
    Step {
        name: "firmware images",
        in_fast: false,
        run: || firmware::build(None),
    },
    Step {
        name: "no panic in logic",
        in_fast: false,
        run: panics::check,
    },
    Step {
        name: "stack below half",
        in_fast: false,
        run: stack::check,
    },
    Step {
        name: "budgets of kernel and node",
        in_fast: false,
        run: || cycles::run(false, true, false),
    },
    Step {
        name: "proofs",
        in_fast: false,
        run: proofs::run,
    },
    Step {
        name: "tests",
        in_fast: true,
        run: run_tests,
    },
    Step {
        name: "coverage of logic",
        in_fast: false,
        run: coverage::check,
    },
    Step {
        name: "every input of primitives",
        in_fast: false,
        run: exhaustive::check,
    },
    Step {
        name: "ten million frames",
        in_fast: false,
        run: run_any_frame,
    },
    Step {
        name: "fuzzing",
        in_fast: false,
        run: run_fuzzing,
    },
    Step {
        name: "tests on vcan0",
        in_fast: false,
        run: run_vcan_tests,
    },
    Step {
        name: "generated files",
        in_fast: true,
        run: || generated::run_generator(true),
    },
    Step {
        name: "the main job",
        in_fast: true,
        run: run_main_job,
    },
    Step {
        name: "debug and release agree",
        in_fast: true,
        run: compare_profiles,
    },
];

/// Runs every step and prints what each took.
///
/// # Errors
/// When a step failed.
pub fn run_all(fast: bool, stop: bool) -> Result<()> {
    let mut results: Vec<(&str, Result<()>, Duration)> = Vec::new();
    for step in STEPS.iter().filter(|step| !fast || step.in_fast) {
        println!("\n=== {} ===", step.name);
        let start = Instant::now();
        let result = (step.run)();
        if let Err(error) = &result {
            println!("failed: {error:#}");
        }
        let failed = result.is_err();
        results.push((step.name, result, start.elapsed()));
        if failed && stop {
            break;
        }
    }
    println!("\n{:<26} {:>8}  result", "step", "seconds");
    for (name, result, time) in &results {
        let word = if result.is_ok() { "ok" } else { "FAILED" };
        println!("{name:<26} {:>8.1}  {word}", time.as_secs_f64());
    }
    let total: Duration = results.iter().map(|(_, _, time)| *time).sum();
    println!("{:<26} {:>8.1}", "all", total.as_secs_f64());
    let failed: Vec<_> = results
        .iter()
        .filter(|(_, result, _)| result.is_err())
        .map(|(name, ..)| *name)
        .collect();
    if !failed.is_empty() {
        bail!("failed: {}", failed.join(", "));
    }
    println!("everything passed");
    Ok(())
}

fn check_format() -> Result<()> {
    run(cargo().args(["fmt", "--all", "--check"]))
}

fn check_lints() -> Result<()> {
    let arguments = [
        "clippy",
        "--workspace",
        "--all-targets",
        "--",
        "-D",
        "warnings",
    ];
    run(cargo().args(arguments))
}

/// Runs all tests but those that need a vcan0, which are told that their turn comes later.
fn run_tests() -> Result<()> {
    let mut tests = cargo();
    tests
        .args(["test", "--workspace", "--no-fail-fast"])
        .env("ANGUILLA_VCAN", "later");
    if setup::python().is_file() {
        tests.env("ANGUILLA_PYTHON", setup::python());
    }
    run(&mut tests)
}

/// Fires ten million frames at a node.
fn run_any_frame() -> Result<()> {
    let arguments = [
        "test",
        "--release",
        "-p",
        "eel-canopen",
        "--test",
        "any_frame",
    ];
    let words = ["--", "--nocapture"];
    run(cargo()
        .args(arguments)
        .args(words)
        .env("CANOPEN_FRAMES", ANY_FRAMES))
}

/// Looks for new inputs that break a promise; `ANGUILLA_FUZZ_SECONDS` says for how long.
fn run_fuzzing() -> Result<()> {
    let asked = env::var("ANGUILLA_FUZZ_SECONDS").ok();
    let seconds = asked.map_or(Ok(FUZZ_SECONDS), |text| text.parse());
    let seconds = seconds.context("ANGUILLA_FUZZ_SECONDS is no number")?;
    fuzz::run_targets(None, seconds, false)
}

/// Runs the tests that need a vcan0 beside one, with the programs that they start.
fn run_vcan_tests() -> Result<()> {
    run(cargo().args(["build", "--package", "hil-sim", "--package", "eel"]))?;
    let arguments = [
        "test",
        "--workspace",
        "--test",
        "socketcan",
        "--no-run",
        "--message-format=json",
    ];
    let messages = output(cargo().args(arguments))?;
    let test = messages
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter(|message| message["target"]["name"] == "socketcan")
        .find_map(|message| message["executable"].as_str().map(str::to_owned))
        .context("cargo built no test named socketcan")?;
    let folder = clean_root().join("tests");
    env::set_current_dir(&folder)?;
    let variables = [
        ("ANGUILLA_PYTHON", path_text(setup::python().as_os_str())),
        ("CARGO_MANIFEST_DIR", path_text(folder.as_os_str())),
    ];
    let words = [
        test,
        "--nocapture".to_owned(),
        "--test-threads=1".to_owned(),
    ];
    let status = vcan::run(&words, &variables)?;
    ensure!(status == 0, "the tests on vcan0 ended with status {status}");
    Ok(())
}

/// Runs what a user runs first, shortly.
fn run_main_job() -> Result<()> {
    let out = clean_root().join("target/main-job");
    let arguments = ["run", "--release", "--", "swim", "--seconds", "2", "--out"];
    run(cargo().args(arguments).arg(out))
}

/// Tells whether the same seed gives the same frames in the debug and in the release program.
fn compare_profiles() -> Result<()> {
    let log_hash = |profile: &str| -> Result<String> {
        let out = target_dir().join("agree").join(profile);
        let mut swim = cargo();
        swim.args([
            "run",
            "--quiet",
            "--profile",
            profile,
            "--package",
            "hil-sim",
            "--",
        ])
        .args(["swim", "--seconds", "3", "--json", "--out"])
        .arg(out);
        let text = output(&mut swim)?;
        let summary: serde_json::Value =
            serde_json::from_str(&text).context("hil-sim --json printed no JSON")?;
        let hash = summary["frame_log_sha256"].as_str().map(str::to_owned);
        hash.context("hil-sim --json has no frame_log_sha256")
    };
    let (debug, release) = (log_hash("dev")?, log_hash("release")?);
    println!("frame log in debug    {debug}\nframe log in release  {release}");
    ensure!(
        debug == release,
        "the same seed gives other frames in debug than in release; compare \
         target/agree/dev/bus.log with target/agree/release/bus.log"
    );
    Ok(())
}

fn path_text(path: &OsStr) -> String {
    path.to_string_lossy().into_owned()
}
