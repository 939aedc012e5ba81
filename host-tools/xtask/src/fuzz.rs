//! Fuzzing with libFuzzer, through cargo-fuzz on the stable compiler.
//!
//! The targets are in tests/fuzz. New inputs go to target/fuzz/corpus; what is worth keeping is put into
//! tests/fuzz/corpus by `--minimise`, and replayed by a plain `cargo test`.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::Mutex;
use std::thread;

use anyhow::{Context, Result, bail, ensure};

use crate::process::{self, clean_root, command, output, run, target_dir};
use crate::setup;

/// A target, and the longest input that it makes sense of: short ones are found and run sooner.
struct Target {
    name: &'static str,
    longest: u32,
}

const TARGETS: [Target; 5] = [
    Target {
        name: "node",
        longest: 192,
    },
    Target {
        name: "sdo",
        longest: 192,
    },
    Target {
        name: "lss",
        longest: 256,
    },
    Target {
        name: "stored",
        longest: 400,
    },
    Target {
        name: "vertebra",
        longest: 192,
    },
];

/// The most bytes that all committed inputs may take together.
const MOST_COMMITTED: u64 = 500_000;
/// Lines of a failed run that are shown.
const SHOWN: usize = 30;

/// Fuzzes one target or all, as many at a time as there are processors.
///
/// # Errors
/// When a tool is missing, the build fails, or an input breaks a promise.
pub fn run_targets(target: Option<&str>, seconds: u64, minimise: bool) -> Result<()> {
    let targets = choose(target)?;
    build()?;
    if minimise {
        return targets.into_iter().try_for_each(minimise_corpus);
    }
    let waiting = Mutex::new(targets.iter().rev().copied().collect::<Vec<_>>());
    let failures = Mutex::new(Vec::new());
    let processors = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..processors.min(targets.len()) {
            scope.spawn(|| {
                while let Some(target) = waiting.lock().ok().and_then(|mut them| them.pop()) {
                    if let Err(error) = fuzz(target, seconds)
                        && let Ok(mut failures) = failures.lock()
                    {
                        failures.push(format!("{error:#}"));
                    }
                }
            });
        }
    });
    let failures = failures.into_inner().unwrap_or_default();
    ensure!(failures.is_empty(), "{}", failures.join("\n"));
    Ok(())
}

/// Runs one input without libFuzzer.
///
/// # Errors
/// When it breaks a promise, or no target is named.
pub fn reproduce(target: Option<&str>, input: &Path) -> Result<()> {
    let name = target.context("which target is the input for?")?;
    let path = input
        .canonicalize()
        .with_context(|| format!("no {}", input.display()))?;
    run(inputs(name).arg(path))
}

/// Starts the program that knows a target's inputs.
fn inputs(name: &str) -> Command {
    let mut program = process::cargo();
    program.args(["run", "--quiet", "-p", "eel-fuzz", "--", name]);
    program
}

fn choose(name: Option<&str>) -> Result<Vec<&'static Target>> {
    let fits = |target: &&Target| name.is_none_or(|name| name == target.name);
    let targets: Vec<_> = TARGETS.iter().filter(fits).collect();
    if targets.is_empty() {
        let names = TARGETS.map(|target| target.name);
        bail!("no such target; there are {}", names.join(", "));
    }
    Ok(targets)
}

/// Builds every target with coverage, debug assertions and overflow checks.
///
/// Without a sanitizer: what is tested has no unsafe code, and runs twice as often so.
fn build() -> Result<()> {
    let program = setup::venv().join("bin/cargo-fuzz");
    let found = program.is_file().then_some(program);
    let Some(program) = found.or_else(|| process::find("cargo-fuzz")) else {
        bail!("cargo-fuzz is missing: `cargo xtask setup` puts it into target/venv");
    };
    let mut build = command(program);
    build
        .args(["fuzz", "build", "--sanitizer", "none"])
        .args(["--fuzz-dir", "tests/fuzz/libfuzzer", "--target-dir"])
        .arg(folder())
        .env("RUSTC_BOOTSTRAP", "1");
    // What the shell has set for the host's own builds.
    for variable in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_TARGET"] {
        build.env_remove(variable);
    }
    run(&mut build)
}

/// Fuzzes for so many seconds.
fn fuzz(target: &Target, seconds: u64) -> Result<()> {
    let name = target.name;
    let fresh = folder().join("corpus").join(name);
    let crashes = folder().join("crashes");
    let seeds = unpack(name)?;
    fs::create_dir_all(&fresh)?;
    fs::create_dir_all(&crashes)?;
    let log = folder().join(format!("{name}.log"));
    let mut fuzzer = fuzzer(target)?;
    fuzzer
        .arg(format!("-max_total_time={seconds}"))
        .args([
            "-use_value_profile=1",
            "-timeout=10",
            "-print_final_stats=1",
        ])
        .arg(format!(
            "-artifact_prefix={}",
            crashes.join(format!("{name}-")).display()
        ))
        .args([&fresh, &seeds]);
    let status = to_log(&mut fuzzer, &log)?;
    let text = fs::read_to_string(&log).unwrap_or_default();
    let word = |mark: &str| {
        let line = text.lines().rev().find(|line| line.contains(mark));
        line.and_then(|line| line.split(mark).nth(1)?.split_whitespace().next())
            .unwrap_or("?")
            .to_owned()
    };
    if status.success() {
        let (runs, edges) = (word("stat::number_of_executed_units:"), word("cov:"));
        println!("{name}: {runs} runs in {seconds} s, {edges} edges, every promise kept");
        return Ok(());
    }
    println!("{}", failure(&text));
    let input = word("Base64:");
    bail!(
        "{name}: an input breaks a promise ({}); to see it again: \
         cargo run -p eel-fuzz -- {name} --base64 {input}",
        log.display()
    );
}

/// Returns the lines that tell what went wrong.
fn failure(log: &str) -> String {
    let lines: Vec<_> = log.lines().collect();
    let panic = lines.iter().position(|line| line.contains("panicked at"));
    let start = panic.unwrap_or(lines.len().saturating_sub(SHOWN));
    let shown = lines.iter().skip(start).take(SHOWN);
    shown.copied().collect::<Vec<_>>().join("\n")
}

/// Puts the inputs that are needed to reach all that is reached into tests/fuzz/corpus.
fn minimise_corpus(target: &Target) -> Result<()> {
    let name = target.name;
    let (seeds, fresh) = (unpack(name)?, folder().join("corpus").join(name));
    let merged = folder().join("merged").join(name);
    if merged.is_dir() {
        fs::remove_dir_all(&merged)?;
    }
    fs::create_dir_all(&merged)?;
    fs::create_dir_all(&fresh)?;
    let mut fuzzer = fuzzer(target)?;
    fuzzer.arg("-merge=1").args([&merged, &seeds, &fresh]);
    let log = folder().join(format!("{name}.log"));
    let status = to_log(&mut fuzzer, &log)?;
    ensure!(status.success(), "{name}: see {}", log.display());
    run(inputs(name).arg("--pack").arg(merged))?;
    let files = fs::read_dir(clean_root().join("tests/fuzz/corpus"))?;
    let all: u64 = files
        .filter_map(|entry| Some(entry.ok()?.metadata().ok()?.len()))
        .sum();
    ensure!(
        all <= MOST_COMMITTED,
        "the committed inputs take {all} bytes, more than {MOST_COMMITTED}"
    );
    Ok(())
}

/// Puts the committed inputs of a target where libFuzzer can read them.
fn unpack(name: &str) -> Result<PathBuf> {
    let seeds = folder().join("seeds").join(name);
    if seeds.is_dir() {
        fs::remove_dir_all(&seeds)?;
    }
    run(inputs(name).arg("--unpack").arg(&seeds))?;
    Ok(seeds)
}

/// Starts a target's program.
fn fuzzer(target: &Target) -> Result<Command> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let version = output(command(rustc).arg("-vV"))?;
    let host = version.lines().find_map(|line| line.strip_prefix("host: "));
    let host = host.context("rustc does not name its host")?;
    let mut fuzzer = command(folder().join(host).join("release").join(target.name));
    fuzzer.arg(format!("-max_len={}", target.longest));
    Ok(fuzzer)
}

/// Runs a command whose output goes to a file.
fn to_log(command: &mut Command, log: &Path) -> Result<ExitStatus> {
    let file = File::create(log)?;
    command
        .stdin(Stdio::null())
        .stdout(file.try_clone()?)
        .stderr(file)
        .status()
        .with_context(|| format!("could not start {:?}", command.get_program()))
}

/// Returns where programs, new inputs and crashes are.
fn folder() -> PathBuf {
    target_dir().join("fuzz")
}

#[cfg(test)]
mod tests {
    use super::{choose, failure};

    #[test]
    fn knows_its_targets() {
        assert_eq!(choose(None).map(|all| all.len()).ok(), Some(5));
        assert_eq!(choose(Some("lss")).map(|all| all.len()).ok(), Some(1));
        assert!(choose(Some("nonsense")).is_err());
    }

    #[test]
    fn shows_a_failure_from_its_first_words_on() {
        let log = "INFO: 1\n#2 NEW\nthread panicked at a.rs:1\nassertion failed\nBase64: fw==";
        assert!(failure(log).starts_with("thread panicked"));
        assert!(failure("INFO: 1\n==1== libFuzzer: timeout").contains("timeout"));
    }
}
