//! What came of the injections, as a table in Markdown and as JSON.

use std::fmt;

use eel_protocol::NodeId;
use eel_vertebra::{Drive, Settings};
use serde::Serialize;

use super::{Class, Reaction, limits};
use crate::plant::config::Motor;
use crate::robot::{NODES, Robot};

/// Time in which a free wrist is caught that moves with the water.
const CAUGHT_NS: u64 = 300_000_000;

/// One reaction to one class of faults.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The class.
    pub class: &'static str,
    /// What happened, in words.
    pub what: &'static str,
    /// What was expected.
    pub reaction: &'static str,
    /// How often it was measured.
    pub cases: usize,
    /// How often it was not seen at all.
    pub missing: usize,
    /// The median, ms.
    pub median_ms: f64,
    /// The worst, ms.
    pub worst_ms: f64,
    /// What is promised, ms.
    pub bound_ms: f64,
    /// Whether the promise was kept in every case.
    pub passed: bool,
}

/// The largest that a quantity became, of all vertebrae in all runs.
#[derive(Clone, Debug, Serialize)]
pub struct Extreme {
    /// What it is.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The largest.
    pub worst: f64,
    /// The class in whose runs that was.
    pub class: &'static str,
    /// What must not be exceeded.
    pub limit: f64,
    #[serde(skip)]
    pick: fn(&Robot, NodeId) -> f64,
    /// Whether it counts only where a bridge drives, and has for a while: a free wrist goes where the
    /// water takes it, up to its stops, and is caught there.
    #[serde(skip)]
    only_driven: bool,
    /// Since when each vertebra is driven.
    #[serde(skip)]
    driven_ns: [Option<u64>; NODES],
}

/// Everything.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Whether every promise was kept.
    pub passed: bool,
    /// Injections, counted for each vertebra that had to react.
    pub injections: usize,
    /// Each reaction.
    pub rows: Vec<Row>,
    /// Torque, angles and rate.
    pub extremes: Vec<Extreme>,
}

impl Row {
    /// Adds up the times in ns after the injection; `None` where nothing was seen.
    pub fn new(
        class: &Class,
        reaction: Reaction,
        bound_us: u64,
        times: impl Iterator<Item = Option<u64>>,
    ) -> Self {
        let times: Vec<_> = times.collect();
        let mut seen: Vec<f64> = times.iter().flatten().map(|ns| *ns as f64 / 1e6).collect();
        seen.sort_by(f64::total_cmp);
        let median_ms = seen.get(seen.len() / 2).copied().unwrap_or(f64::NAN);
        let worst_ms = seen.last().copied().unwrap_or(f64::NAN);
        let bound_ms = bound_us as f64 / 1e3;
        let missing = times.len() - seen.len();
        Self {
            class: class.name,
            what: class.what,
            reaction: reaction.name(),
            cases: times.len(),
            missing,
            median_ms,
            worst_ms,
            bound_ms,
            passed: missing == 0 && worst_ms <= bound_ms,
        }
    }
}

impl Extreme {
    /// Returns what is watched, with the limits of a vertebra and of the motors in its bridges.
    pub fn all(settings: &Settings, motor: &Motor) -> Vec<Self> {
        let [torque, yaw, pitch, roll, rate] = limits(settings);
        let of = |name, unit, limit, pick| Self {
            name,
            unit,
            worst: 0.0,
            class: "",
            limit,
            pick,
            only_driven: unit == "rad",
            driven_ns: [None; NODES],
        };
        let bridge = motor.constant * motor.current_limit_a;
        vec![
            of("torque told to a motor", "N·m", torque, |robot, id| {
                let constant = robot.plant().config().motor.constant;
                constant * largest(robot.drives(id).map(told_a))
            }),
            of("torque of a motor", "N·m", bridge, |robot, id| {
                largest(robot.plant().motor_torque(id.index()))
            }),
            of("yaw, driven for 0.3 s", "rad", yaw, |robot, id| {
                robot.plant().joint_pose(id.index())[0]
            }),
            of("pitch, driven for 0.3 s", "rad", pitch, |robot, id| {
                robot.plant().joint_pose(id.index())[1]
            }),
            of("roll, driven for 0.3 s", "rad", roll, |robot, id| {
                robot.plant().joint_pose(id.index())[2]
            }),
            of("rate of an angle", "rad/s", rate, |robot, id| {
                largest(robot.plant().joint_rate(id.index()))
            }),
        ]
    }

    /// Begins with another robot.
    pub fn begin(&mut self) {
        self.driven_ns = [Some(0); NODES];
    }

    /// Takes what the robot does now.
    pub fn look(&mut self, class: &Class, robot: &Robot) {
        for id in NodeId::all() {
            let drives = robot.drives(id);
            let is_driven = drives.iter().any(|it| matches!(it, Drive::Current(_)));
            let since_ns = &mut self.driven_ns[id.index()];
            *since_ns = is_driven.then(|| since_ns.unwrap_or(robot.now_ns()));
            let is_caught = since_ns.is_some_and(|since_ns| robot.now_ns() - since_ns >= CAUGHT_NS);
            if self.only_driven && !is_caught {
                continue;
            }
            let value = (self.pick)(robot, id).abs();
            if value > self.worst {
                (self.worst, self.class) = (value, class.name);
            }
        }
    }
}

/// Returns the current that a bridge is told, A.
fn told_a(drive: Drive) -> f64 {
    match drive {
        Drive::Current(setpoint) => f64::from(setpoint.current.to_microamps()) / 1e6,
        Drive::Off | Drive::Brake => 0.0,
    }
}

/// Returns the largest magnitude.
fn largest(values: [f64; 3]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

impl Report {
    /// Puts a report together.
    pub fn new(rows: Vec<Row>, extremes: Vec<Extreme>) -> Self {
        let within = extremes.iter().all(|it| it.worst <= it.limit);
        let mut injections = 0;
        let mut last = "";
        for row in &rows {
            if row.class != last {
                injections += row.cases;
            }
            last = row.class;
        }
        Self {
            passed: within && rows.iter().all(|row| row.passed),
            injections,
            rows,
            extremes,
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            out,
            "| fault | what happens | reaction | cases | median, ms | worst, ms | promised, ms | |"
        )?;
        writeln!(out, "|---|---|---|--:|--:|--:|--:|---|")?;
        for row in &self.rows {
            let verdict = if row.passed { "kept" } else { "BROKEN" };
            writeln!(
                out,
                "| {} | {} | {} | {} | {:.2} | {:.2} | {:.0} | {verdict} |",
                row.class,
                row.what,
                row.reaction,
                row.cases,
                row.median_ms,
                row.worst_ms,
                row.bound_ms
            )?;
        }
        writeln!(out)?;
        writeln!(
            out,
            "| quantity, all vertebrae, all runs | largest | with the fault | limit |"
        )?;
        writeln!(out, "|---|--:|---|--:|")?;
        for it in &self.extremes {
            let verdict = if it.worst <= it.limit {
                ""
            } else {
                " EXCEEDED"
            };
            writeln!(
                out,
                "| {}, {} | {:.3}{verdict} | {} | {:.3} |",
                it.name, it.unit, it.worst, it.class, it.limit
            )?;
        }
        writeln!(out)?;
        writeln!(
            out,
            "{} injections, each counted for every vertebra that had to react.",
            self.injections
        )
    }
}
