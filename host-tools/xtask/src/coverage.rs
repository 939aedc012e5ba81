//! Which lines of the logic crates their own tests run.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::process::{self, clean_root, command, run, target_dir};
use crate::{llvm, setup};

/// Everything in `firmware` but the boards; the packages are called `eel-` and that.
const CRATES: [&str; 7] = [
    "units",
    "kinematics",
    "protocol",
    "canopen",
    "vertebra",
    "head",
    "drivers",
];
/// The fewest lines that must run, in percent of all.
const LEAST: usize = 95;
/// How many files with lines that do not run are named.
const NAMED: usize = 15;
/// The fewest lines that the crates have.
const LEAST_LINES: usize = 5_000;

/// A file's lines of code, and whether each has run.
type Lines = BTreeMap<usize, bool>;

/// The lines of each file, by its path from the workspace on.
struct Coverage(BTreeMap<String, Lines>);

/// Runs the tests of the logic crates, prints which lines have run, and holds them to the bound.
///
/// # Errors
/// When a tool is missing, a test fails, or too few lines run.
pub fn check() -> Result<()> {
    let lcov = folder().join("lcov.info");
    // Programs of an older source would be counted too, with its lines.
    run(tool()?.args(["clean", "--workspace"]))?;
    let mut test = tool()?;
    test.args(["test", "--no-report", "--no-fail-fast"]);
    for name in CRATES {
        test.args(["--package", &format!("eel-{name}")]);
    }
    run(&mut test)?;
    run(tool()?
        .args(["report", "--lcov", "--output-path"])
        .arg(&lcov))?;
    let text = fs::read_to_string(&lcov).with_context(|| format!("no {}", lcov.display()))?;
    let coverage = Coverage::read(&text, &clean_root(), |path| fs::read_to_string(path))?;
    print!("{}", coverage.table());
    let (ran, all) = coverage.count("");
    ensure!(
        all >= LEAST_LINES,
        "only {all} lines are counted: the check proves nothing"
    );
    ensure!(
        is_enough(ran, all),
        "{ran} of {all} lines of the logic crates run in their tests, fewer than {LEAST} %: test what \
         the lines above do"
    );
    Ok(())
}

fn is_enough(ran: usize, all: usize) -> bool {
    ran * 100 >= all * LEAST
}

/// Returns where everything is built with counters in it.
fn folder() -> PathBuf {
    target_dir().join("coverage")
}

/// Starts cargo-llvm-cov.
fn tool() -> Result<Command> {
    let program = setup::venv().join("bin/cargo-llvm-cov");
    let found = program.is_file().then_some(program);
    let Some(program) = found.or_else(|| process::find("cargo-llvm-cov")) else {
        bail!("cargo-llvm-cov is missing: `cargo xtask setup` puts it into target/venv");
    };
    let mut tool = command(program);
    tool.arg("llvm-cov")
        .env("CARGO_TARGET_DIR", folder())
        .env("LLVM_COV", llvm::tool("llvm-cov")?)
        .env("LLVM_PROFDATA", llvm::tool("llvm-profdata")?);
    // What the shell has set for the host's own builds.
    for variable in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_TARGET"] {
        tool.env_remove(variable);
    }
    Ok(tool)
}

impl Coverage {
    /// Reads the lcov format: `SF:` and a path, then `DA:` and a line with how often it ran. Leaves out
    /// what is no source of a logic crate, and tests.
    fn read(
        text: &str,
        root: &Path,
        source: impl Fn(&Path) -> std::io::Result<String>,
    ) -> Result<Self> {
        let mut files: BTreeMap<String, Lines> = BTreeMap::new();
        let mut current: Option<(String, BTreeSet<usize>)> = None;
        for line in text.lines() {
            if let Some(path) = line.strip_prefix("SF:") {
                let name = Path::new(path).strip_prefix(root).ok();
                let name = name.map(|name| name.display().to_string());
                current = match name.filter(|name| is_logic(name)) {
                    Some(name) => {
                        let text = source(Path::new(path));
                        Some((
                            name,
                            test_lines(&text.with_context(|| format!("no {path}"))?),
                        ))
                    }
                    None => None,
                };
            }
            let (Some((name, tests)), Some(counted)) = (&current, line.strip_prefix("DA:")) else {
                continue;
            };
            let mut numbers = counted.split(',').map(str::parse::<usize>);
            let (Some(Ok(number)), Some(Ok(times))) = (numbers.next(), numbers.next()) else {
                bail!("llvm-cov wrote `{line}`");
            };
            if !tests.contains(&number) {
                let lines = files.entry(name.clone()).or_default();
                *lines.entry(number).or_default() |= times > 0;
            }
        }
        Ok(Self(files))
    }

    /// Counts the lines that ran and all, of files whose path begins so.
    fn count(&self, start: &str) -> (usize, usize) {
        let files = self.0.iter().filter(|(name, _)| name.starts_with(start));
        let lines = files.flat_map(|(_, lines)| lines.values());
        lines.fold((0, 0), |(ran, all), line| {
            (ran + usize::from(*line), all + 1)
        })
    }

    /// Writes the lines of each crate, then those that did not run, in the files that have most.
    fn table(&self) -> String {
        let mut table = format!("{:<12}{:>8}{:>8}\n", "crate", "lines", "run");
        let mut row = |name: &str, (ran, all): (usize, usize)| {
            let share = ran as f64 * 100.0 / all.max(1) as f64;
            let _ = writeln!(table, "{name:<12}{all:>8}{share:>6.1} %");
        };
        for name in CRATES {
            row(name, self.count(&format!("firmware/{name}/")));
        }
        row("all", self.count(""));
        let mut missed: Vec<(&str, Vec<usize>)> = self.0.iter().map(missed_lines).collect();
        missed.sort_by_key(|(_, lines)| std::cmp::Reverse(lines.len()));
        missed.retain(|(_, lines)| !lines.is_empty());
        table.push_str("lines that do not run:\n");
        for (name, lines) in missed.iter().take(NAMED) {
            let _ = writeln!(table, "{:>5}  {name}: {}", lines.len(), ranges(lines));
        }
        if missed.len() > NAMED {
            let rest = missed.iter().skip(NAMED);
            let lines: usize = rest.map(|(_, lines)| lines.len()).sum();
            let _ = writeln!(table, "{lines:>5}  in {} other files", missed.len() - NAMED);
        }
        table
    }
}

/// Tells whether a file is a logic crate's and not a test.
fn is_logic(name: &str) -> bool {
    let mut parts = name.split('/');
    parts.next() == Some("firmware")
        && parts.next().is_some_and(|name| CRATES.contains(&name))
        && parts.next() == Some("src")
        && !name.ends_with("/tests.rs")
}

/// Returns the lines of a file's test modules, counted from 1.
fn test_lines(text: &str) -> BTreeSet<usize> {
    let mut tests = BTreeSet::new();
    let (mut was_marked, mut is_inside) = (false, false);
    for (number, line) in (1..).zip(text.lines()) {
        is_inside |= was_marked && line.starts_with("mod ") && line.ends_with('{');
        was_marked = line == "#[cfg(test)]";
        if is_inside {
            tests.insert(number);
        }
        is_inside &= line != "}";
    }
    tests
}

/// Returns a file's name and its lines that did not run.
fn missed_lines<'a>((name, lines): (&'a String, &Lines)) -> (&'a str, Vec<usize>) {
    let missed = lines.iter().filter(|(_, ran)| !**ran);
    (name, missed.map(|(number, _)| *number).collect())
}

/// Writes ascending numbers such that neighbours are one range.
fn ranges(numbers: &[usize]) -> String {
    let pieces = numbers.chunk_by(|one, next| one + 1 == *next);
    let words: Vec<_> = pieces
        .filter_map(|piece| match piece {
            [] => None,
            [one] => Some(one.to_string()),
            [first, .., last] => Some(format!("{first}–{last}")),
        })
        .collect();
    words.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str =
        "fn a() {}\nfn b() {}\n\n#[cfg(test)]\nmod tests {\n    fn c() {}\n}\nfn d() {}";

    fn coverage(text: &str) -> Result<Coverage> {
        Coverage::read(text, Path::new("/root"), |_| Ok(SOURCE.to_owned()))
    }

    #[test]
    fn counts_lines_of_logic_without_tests_and_takes_the_better_of_two() {
        let text = "SF:/root/firmware/units/src/a.rs\nDA:1,0\nDA:2,0\nDA:6,0\nDA:8,7\nend_of_record\n\
                    SF:/root/firmware/units/src/a.rs\nDA:1,3\nend_of_record\n\
                    SF:/root/firmware/head/src/b.rs\nDA:1,1\nend_of_record\n\
                    SF:/root/firmware/head/src/b/tests.rs\nDA:1,0\nend_of_record\n\
                    SF:/root/firmware/board-qemu/src/c.rs\nDA:1,0\nend_of_record\n\
                    SF:/elsewhere/d.rs\nDA:1,0\nend_of_record\n";
        let coverage = coverage(text).unwrap();
        assert_eq!(coverage.count("firmware/units/"), (2, 3));
        assert_eq!(coverage.count("firmware/head/"), (1, 1));
        assert_eq!(coverage.count(""), (3, 4));
        let table = coverage.table();
        assert!(
            table.contains("    1  firmware/units/src/a.rs: 2\n"),
            "{table}"
        );
        assert!(!table.contains("head/src/b.rs"), "{table}");
    }

    #[test]
    fn refuses_what_llvm_does_not_write() {
        assert!(coverage("SF:/root/firmware/units/src/a.rs\nDA:1").is_err());
    }

    #[test]
    fn fewer_than_the_least_lines_are_not_enough() {
        assert!(is_enough(950, 1_000));
        assert!(!is_enough(949, 1_000));
    }

    #[test]
    fn neighbours_are_one_range() {
        assert_eq!(ranges(&[1, 2, 3, 7, 9, 10]), "1–3, 7, 9–10");
        assert_eq!(ranges(&[]), "");
    }
}
