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
    pub checks: Vec<Check>,
}

/// Runs every check of the plant.
pub fn run() -> Report {
    let checks = all();
    Report {
        passed: checks.iter().all(|row| row.passed),
        checks,
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
            let Check {
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
