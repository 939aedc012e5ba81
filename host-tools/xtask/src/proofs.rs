//! The kernel's proofs: scripts written from its own constants, and Gappa's word on each.
//!
//! A script that proves too much is as bad as one that fails: each is also run with a false goal, which it
//! must not prove (its hypotheses would contradict each other), and with its last bound a thousandth.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use crate::process::{self, cargo, command, run as run_command, target_dir};

/// What separates hypotheses from goals in a script.
const TURNSTILE: &str = "\n->\n";
/// The rules that Gappa takes without checking them, since it does not compute with roots:
/// √a − √b = (a − b) / (√a + √b) and a − b² = (√a − b)(√a + b).
const ROOT_RULES: [&str; 2] = ["Warning: sqrt(root_of) - ", "Warning: root_of - "];

/// How Gappa says that it understood a script and can't prove it.
const REFUSALS: [&str; 2] = [
    "some properties were not satisfied",
    "no contradiction was found",
];

/// A script of the list.
struct Proof {
    path: PathBuf,
    stage: String,
    /// What is bounded, and the bound.
    claims: Vec<(String, String)>,
}

/// What became of a script.
struct Outcome {
    complaint: Option<String>,
    time: Duration,
}

/// Writes the scripts, runs Gappa on all of them and prints what they prove.
///
/// # Errors
/// When Gappa is missing, a stage is not proven, or a script proves what is false.
pub fn run() -> Result<()> {
    let Some(gappa) = process::find("gappa") else {
        bail!("gappa is missing; on Debian: apt-get install gappa");
    };
    let folder = target_dir().join("proofs");
    let proofs = write_scripts(&folder)?;
    ensure!(!proofs.is_empty(), "no script was written");
    let outcomes = examine_all(&gappa, &proofs);
    println!("{:<48} {:>8}  bounds", "stage", "seconds");
    let mut failed = Vec::new();
    for (proof, outcome) in proofs.iter().zip(&outcomes) {
        let claims: Vec<_> = proof
            .claims
            .iter()
            .map(|(what, bound)| format!("{what} {bound}"))
            .collect();
        let seconds = outcome.time.as_secs_f64();
        println!("{:<48} {seconds:>8.1}  {}", proof.stage, claims.join("; "));
        if let Some(complaint) = &outcome.complaint {
            println!("    FAILED: {}\n{complaint}", proof.path.display());
            failed.push(proof.stage.clone());
        }
    }
    println!("scripts: {}", folder.display());
    ensure!(failed.is_empty(), "not proven: {}", failed.join("; "));
    println!(
        "{} scripts are proven; none proves a false goal or a thousandth of its bound",
        proofs.len()
    );
    Ok(())
}

/// Calls the generator, and reads its list.
fn write_scripts(folder: &Path) -> Result<Vec<Proof>> {
    let _ = fs::remove_dir_all(folder);
    let mut generator = cargo();
    generator.args(["run", "--quiet", "-p", "eel-kinematics"]);
    run_command(generator.args(["--example", "proofs", "--"]).arg(folder))?;
    let list = fs::read_to_string(folder.join("list.tsv")).context("no list of scripts")?;
    list.lines()
        .map(|line| read_line(folder, line).with_context(|| format!("no entry of a list: {line}")))
        .collect()
}

/// Reads a line of the list: file, stage, and what is bounded beside its bound.
fn read_line(folder: &Path, line: &str) -> Option<Proof> {
    let mut words = line.split('\t').map(str::to_owned);
    let path = folder.join(words.next()?).with_extension("g");
    let stage = words.next()?;
    let rest: Vec<_> = words.collect();
    let (pairs, []) = rest.as_chunks::<2>() else {
        return None;
    };
    let claims = pairs.iter().cloned().map(|[what, bound]| (what, bound));
    Some(Proof {
        path,
        stage,
        claims: claims.collect(),
    })
}

/// Examines all scripts, as many at once as there are processors.
fn examine_all(gappa: &Path, proofs: &[Proof]) -> Vec<Outcome> {
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Outcome)>> = Mutex::default();
    let work = || {
        while let Some((index, proof)) = {
            let index = next.fetch_add(1, Ordering::Relaxed);
            proofs.get(index).map(|proof| (index, proof))
        } {
            let start = Instant::now();
            let complaint = examine(gappa, &proof.path).err();
            let outcome = Outcome {
                complaint: complaint.map(|error| format!("{error:#}")),
                time: start.elapsed(),
            };
            if let Ok(mut done) = done.lock() {
                done.push((index, outcome));
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    let mut done = done.into_inner().unwrap_or_default();
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, outcome)| outcome).collect()
}

/// Runs a script as it is, with a false goal, and with a bound that is too small.
fn examine(gappa: &Path, path: &Path) -> Result<()> {
    let text = fs::read_to_string(path)?;
    prove(gappa, path)?;
    let wrong = [
        ("false", with_false_goal(&text)),
        ("tight", with_tight_bound(&text)),
    ];
    for (name, text) in wrong {
        let Some(text) = text else {
            bail!("the script has no goal or no bound");
        };
        let path = path.with_extension(format!("{name}.g"));
        fs::write(&path, text)?;
        let Err(error) = prove(gappa, &path) else {
            bail!("{} is proven and should not be", path.display());
        };
        let text = error.to_string();
        ensure!(
            REFUSALS.iter().any(|refusal| text.contains(refusal)),
            "{} is no script: {text}",
            path.display()
        );
    }
    Ok(())
}

/// Runs Gappa on a script.
///
/// # Errors
/// With what Gappa printed, when a goal is not proven or a rule is not an identity.
fn prove(gappa: &Path, path: &Path) -> Result<()> {
    let output = command(gappa)
        .arg("-Eno-auto-dichotomy")
        .arg(path)
        .stdin(Stdio::null())
        .output()?;
    let printed = String::from_utf8_lossy(&output.stderr);
    let is_root_rule = |line: &str| ROOT_RULES.iter().any(|rule| line.starts_with(rule));
    let wrong_rules = printed
        .lines()
        .any(|line| line.contains("not trivially equal") && !is_root_rule(line));
    if output.status.success() && !wrong_rules {
        return Ok(());
    }
    let lines = printed.lines().filter(|line| !line.contains("iterations"));
    bail!("{}", lines.collect::<Vec<_>>().join("\n"))
}

/// Returns a script that asks for what is false.
fn with_false_goal(text: &str) -> Option<String> {
    let (before, after) = text.split_once(TURNSTILE)?;
    let (_, hints) = after.split_once(" }\n")?;
    Some(format!("{before}{TURNSTILE}1 <= 0 }}\n{hints}"))
}

/// Returns a script whose last bound is too small to be true.
fn with_tight_bound(text: &str) -> Option<String> {
    let (before, after) = text.split_once(TURNSTILE)?;
    let (goals, hints) = after.split_once(" }\n")?;
    let mut goals: Vec<_> = goals.split(" /\\\n").map(str::to_owned).collect();
    let last = goals.iter().rposition(|goal| tightened(goal).is_some())?;
    goals[last] = tightened(&goals[last])?;
    let goals = goals.join(" /\\\n");
    Some(format!("{before}{TURNSTILE}{goals} }}\n{hints}"))
}

/// Makes a goal harder; nothing where it says that a number fits its integer.
fn tightened(goal: &str) -> Option<String> {
    if let Some((what, bound)) = goal.split_once("| <= ") {
        return Some(format!("{what}| <= {:e}", bound.parse::<f64>().ok()? / 1e3));
    }
    if let Some((what, range)) = goal.split_once(" in [") {
        let (low, high) = range.strip_suffix(']')?.split_once(',')?;
        let (low, high): (f64, f64) = (low.parse().ok()?, high.parse().ok()?);
        return Some(format!(
            "{what} in [{low:e},{:e}]",
            low + (high - low) / 1e3
        ));
    }
    let (what, bound) = goal.split_once(" >= ")?;
    Some(format!("{what} >= {:e}", bound.parse::<f64>().ok()? * 10.0))
}

#[cfg(test)]
mod tests {
    use super::{prove, read_line, with_false_goal, with_tight_bound};
    use crate::process;
    use std::path::Path;

    const SCRIPT: &str = "y = fixed<-30,dn>(x * x);\n{ x in [-1,1]\n->\ny in [-2147483648b-30,2147483647b-30] /\\\n|y - x * x| <= 1e-9 }\n";

    /// Whether Gappa proves a text; nothing where there is no Gappa.
    fn is_proven(name: &str, text: &str) -> Option<bool> {
        let gappa = process::find("gappa");
        assert!(gappa.is_some() || !process::is_ci(), "no gappa in CI");
        let path = std::env::temp_dir().join(format!("{name}-{}.g", std::process::id()));
        std::fs::write(&path, text).expect("a temporary file");
        let proven = prove(&gappa?, &path).is_ok();
        std::fs::remove_file(path).expect("the file");
        Some(proven)
    }

    #[test]
    fn a_proof_fails_when_its_claim_is_too_much() {
        assert_ne!(is_proven("plain", SCRIPT), Some(false));
        let tight = with_tight_bound(SCRIPT).expect("has a bound");
        assert!(tight.contains("1e-12"), "{tight}");
        assert_ne!(is_proven("tight", &tight), Some(true));
        let false_goal = with_false_goal(SCRIPT).expect("has goals");
        assert_ne!(is_proven("false", &false_goal), Some(true));
    }

    #[test]
    fn a_format_with_one_bit_more_overflows() {
        let longer = SCRIPT
            .replace("b-30", "b-31")
            .replace("fixed<-30", "fixed<-31");
        let above = longer.replace("x in [-1,1]", "x in [-1.01,1]");
        assert_ne!(is_proven("overflow", &above), Some(true));
    }

    #[test]
    fn a_rule_that_is_no_identity_is_refused() {
        let wrong = format!("{SCRIPT}y - x * x -> y + x * x;\n");
        assert_ne!(is_proven("rule", &wrong), Some(true));
    }

    #[test]
    fn reads_the_list_and_nothing_that_was_cut() {
        let proof = read_line(Path::new("a"), "f\tstage\terror\t1e-9").expect("whole");
        assert_eq!(proof.path, Path::new("a/f.g"));
        assert_eq!(proof.claims, [("error".to_owned(), "1e-9".to_owned())]);
        assert!(read_line(Path::new("a"), "f\tstage\terror").is_none());
        assert!(read_line(Path::new("a"), "f").is_none());
    }
}
