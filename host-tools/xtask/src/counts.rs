//! Instructions of each measured call over all poses, and the bounds they are held to.
//!
//! The image prints ticks of virtual time, one line a pose; what a loop alone takes is subtracted here.

use std::fmt;

use anyhow::{Result, bail, ensure};
use serde_json::{Map, Value, json};

use crate::cycles::Core;

/// By how much a median may exceed its budget.
pub const TOLERANCE: f64 = 1.02;
/// What the name of a call in single precision ends with: measured against, and so without a budget.
const SINGLE: &str = "_f32";
/// The calls that must take the same for every pose, and how much they may spread in parts of the median.
const STEADY: [&str; 3] = ["inverse", "direct", "step_free"];
const MOST_SPREAD: f64 = 0.03;
/// The calls that must take so many times fewer instructions than in single precision.
const FASTER: [&str; 3] = ["inverse", "direct", "step_free"];
const LEAST_RATIO: f64 = 15.0;
/// The fewest poses that are worth a median.
const LEAST_POSES: usize = 1_000;

/// Instructions of one call over all poses.
struct Row {
    name: String,
    least: f64,
    median: f64,
    most: f64,
}

/// Instructions of all calls.
pub struct Counts {
    poses: usize,
    rows: Vec<Row>,
}

impl Counts {
    /// Reads the image's output: repeats, names, ticks of each pose.
    ///
    /// # Errors
    /// When that is something else or too little.
    pub fn read(core: &Core, text: &str) -> Result<Self> {
        let (mut repeats, mut names) = (0.0, Vec::new());
        let mut poses: Vec<Vec<f64>> = Vec::new();
        for line in text.lines() {
            let mut words = line.split('\t');
            match words.next() {
                Some("repeats") => repeats = words.next().unwrap_or_default().parse()?,
                Some("names") => names = words.collect(),
                Some("ticks") => poses.push(words.map(str::parse).collect::<Result<_, _>>()?),
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
        Ok(Self {
            poses: poses.len(),
            rows: rows.collect(),
        })
    }

    fn find(&self, name: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.name == name)
    }

    /// Returns the calls of the kernel, each beside the same in single precision.
    fn ours(&self) -> impl Iterator<Item = (&Row, Option<&Row>)> {
        let ours = self.rows.iter().filter(|row| !row.name.ends_with(SINGLE));
        ours.map(|row| (row, self.find(&format!("{}{SINGLE}", row.name))))
    }

    /// Returns how many times fewer instructions a call takes than in single precision.
    fn ratio(&self, name: &str) -> Option<f64> {
        let single = self.find(&format!("{name}{SINGLE}"))?;
        Some(single.median / self.find(name)?.median)
    }

    /// Returns what exceeds its budget, has none, is budgeted and not measured, spreads, or isn't much
    /// faster than single precision.
    pub fn complaints(&self, core: &str, budget: &Value) -> Vec<String> {
        let mut complaints = Vec::new();
        for (Row { name, median, .. }, _) in self.ours() {
            match budget[name].as_f64() {
                Some(limit) if *median <= limit * TOLERANCE => {}
                Some(limit) => complaints.push(format!(
                    "{name} takes {median} instructions on {core}, budget {limit}"
                )),
                None => complaints.push(format!("{name} has no budget on {core}")),
            }
        }
        for name in budget.as_object().into_iter().flat_map(Map::keys) {
            if self.find(name).is_none() {
                complaints.push(format!("{name} on {core} has a budget and is not measured"));
            }
        }
        for name in STEADY {
            match self.find(name).map(Row::spread) {
                Some(spread) if spread <= MOST_SPREAD => {}
                Some(spread) => complaints.push(format!(
                    "{name} spreads by {:.1} % on {core}, {:.0} % allowed",
                    spread * 100.0,
                    MOST_SPREAD * 100.0
                )),
                None => complaints.push(format!("{name} is not measured on {core}")),
            }
        }
        for name in FASTER {
            match self.ratio(name) {
                Some(ratio) if ratio >= LEAST_RATIO => {}
                Some(ratio) => complaints.push(format!(
                    "{name} is only {ratio:.1} times faster than f32 on {core}, {LEAST_RATIO} wanted"
                )),
                None => complaints.push(format!("{name} has no f32 beside it on {core}")),
            }
        }
        complaints
    }

    /// Returns all of them.
    pub fn to_json(&self) -> Value {
        let mut rows = Map::new();
        let mut ratios = Map::new();
        for row in &self.rows {
            let Row {
                name,
                least,
                median,
                most,
            } = row;
            let numbers = json!({
                "min": *least as i64, "median": *median as i64, "max": *most as i64,
            });
            rows.insert(name.clone(), numbers);
            if let Some(ratio) = self.ratio(name) {
                ratios.insert(name.clone(), json!(ratio));
            }
        }
        json!({ "poses": self.poses, "instructions": rows, "f32_over_kernel": ratios })
    }
}

impl Row {
    /// Returns by how much it varies over the poses, in parts of the median.
    fn spread(&self) -> f64 {
        (self.most - self.least) / self.median
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{:<25}{:>21}{:>27}", "", "kernel", "f32 with libm")?;
        let columns = format!("{:>7}{:>7}{:>7}", "min", "median", "max");
        writeln!(out, "{:<25}{columns}  {columns}{:>7}", "", "times")?;
        let numbers = |row: &Row| format!("{:>7}{:>7}{:>7}", row.least, row.median, row.most);
        for (row, single) in self.ours() {
            write!(out, "{:<25}{}", row.name, numbers(row))?;
            if let Some(single) = single {
                write!(
                    out,
                    "  {}{:>7.1}",
                    numbers(single),
                    single.median / row.median
                )?;
            }
            writeln!(out)?;
        }
        write!(
            out,
            "{} poses; direct makes the Jacobian and the map of torques too, a step is inverse, direct \
             and sharing",
            self.poses
        )
    }
}

#[cfg(test)]
mod tests {
    use super::Counts;
    use crate::cycles::CORES;
    use serde_json::json;

    /// Calls of 10 ticks a repeat beside a loop of 2, `root` with an outlier, and their single precision.
    fn sample(spread: u32, single: u32) -> String {
        let mut text = "repeats\t1\nnames\tloop\troot\tinverse\tinverse_f32\tdirect\tdirect_f32\
             \tstep_free\tstep_free_f32"
            .to_owned();
        for pose in 0..1_001 {
            let root = if pose == 7 { 422 } else { 170 };
            let inverse = if pose == 8 { 170 + spread } else { 170 };
            let single = 2 + 168 * single;
            text.push_str(&format!(
                "\nticks\t2\t{root}\t{inverse}\t{single}\t170\t{single}\t170\t{single}"
            ));
        }
        text
    }

    fn counts(text: &str) -> Counts {
        Counts::read(&CORES[0], text).expect("well formed")
    }

    #[test]
    fn subtracts_the_loop_and_keeps_the_extremes() {
        let counts = counts(&sample(0, 16));
        let root = counts.find("root").expect("a row");
        assert_eq!((root.least, root.median, root.most), (1e3, 1e3, 2.5e3));
        assert_eq!(counts.ratio("inverse"), Some(16.0));
        assert_eq!(counts.ratio("root"), None);
    }

    #[test]
    fn complains_two_percent_above_a_budget_and_not_before() {
        let counts = counts(&sample(0, 16));
        let complaints = |root: Option<u32>, more: bool| {
            let mut budget = json!({ "inverse": 1_000, "direct": 1_000, "step_free": 1_000 });
            if let Some(root) = root {
                budget["root"] = json!(root);
            }
            if more {
                budget["gone"] = json!(5);
            }
            counts.complaints("cortex-m4", &budget).len()
        };
        assert_eq!(complaints(Some(1_000), false), 0);
        assert_eq!(complaints(Some(981), false), 0);
        assert_eq!(complaints(Some(980), false), 1);
        assert_eq!(complaints(None, false), 1);
        assert_eq!(complaints(Some(1_000), true), 1);
    }

    #[test]
    fn complains_of_a_spread_and_of_single_precision_that_comes_near() {
        let budget =
            json!({ "root": 1_000, "inverse": 1_000, "direct": 1_000, "step_free": 1_000 });
        let complaints = |spread, single| {
            counts(&sample(spread, single))
                .complaints("cortex-m4", &budget)
                .len()
        };
        assert_eq!(complaints(5, 15), 0);
        assert_eq!(complaints(6, 15), 1);
        assert_eq!(complaints(5, 14), 3);
    }

    #[test]
    fn refuses_an_output_that_was_cut() {
        assert!(Counts::read(&CORES[0], "repeats\t32\nnames\tloop\troot").is_err());
        let cut = sample(0, 16)
            .rsplit_once('\t')
            .map(|(text, _)| text.to_owned());
        assert!(Counts::read(&CORES[0], &cut.expect("tabs")).is_err());
        assert!(Counts::read(&CORES[0], "failed\tRefused").is_err());
    }
}
