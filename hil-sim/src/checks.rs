//! The plant's checks as a report.

use std::fmt;

use serde::Serialize;

use crate::plant::checks::{Check, all};

/// All checks and whether every one passed.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Whether every check passed.
    pub passed: bool,
    /// Each check.
    pub checks: Vec<Row>,
}

/// One check.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Its number and what it looks at.
    pub name: &'static str,
    /// What came out.
    pub figure: f64,
    /// What may come out at most.
    pub bound: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Whether the figure keeps the bound.
    pub passed: bool,
}

/// Runs every check of the plant.
pub fn run() -> Report {
    let checks: Vec<Row> = all().into_iter().map(Row::from).collect();
    Report {
        passed: checks.iter().all(|row| row.passed),
        checks,
    }
}

impl From<Check> for Row {
    fn from(check: Check) -> Self {
        let Check {
            name,
            figure,
            bound,
            unit,
            passed,
        } = check;
        Self {
            name,
            figure,
            bound,
            unit,
            passed,
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self
            .checks
            .iter()
            .map(|row| row.name.len())
            .max()
            .unwrap_or(0);
        for row in &self.checks {
            let verdict = if row.passed { "pass" } else { "FAIL" };
            let Row {
                name,
                figure,
                bound,
                unit,
                ..
            } = row;
            writeln!(
                out,
                "{verdict}  {name:width$}  {figure:10.3e} ≤ {bound:.1e} {unit}"
            )?;
        }
        Ok(())
    }
}
