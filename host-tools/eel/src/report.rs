//! Statistics as a table or as one JSON object.

use std::io::{Result, Write};

use eel_protocol::{Cob, HEAD_NODE, VERTEBRAE, emergency};
use serde::Serialize;

use crate::source::Seen;
use crate::stats::{PerId, Statistics};

/// The schema, for `--help`.
pub const SCHEMA: &str = "\
One JSON object: bus (string), duration_s, frames, bits, load_percent, busiest_100ms_percent,
malformed_lines, dropped (by the system), error_reports, problems (numbers; problems is the sum of bad, lost and repeated
frames, gaps, fault emergencies, error reports, dropped frames and malformed lines), ids (array of id, extended, node
or null, message or null, count, rate_hz or null, period_mean_ms, period_min_ms, period_max_ms,
jitter_us (each null below two frames), load_percent, gaps, lost, repeated, bad), emergencies (array
of time_s, node, code, name or null, severity or null, motor, limit, detail).";

#[derive(Serialize)]
struct Summary<'a> {
    bus: &'a str,
    duration_s: f64,
    frames: u64,
    bits: u64,
    load_percent: f64,
    busiest_100ms_percent: f64,
    malformed_lines: u64,
    dropped: u64,
    error_reports: u64,
    problems: u64,
    ids: Vec<Row>,
    emergencies: Vec<Told>,
}

#[derive(Serialize)]
struct Row {
    id: u32,
    extended: bool,
    node: Option<u8>,
    message: Option<&'static str>,
    count: u64,
    rate_hz: Option<f64>,
    period_mean_ms: Option<f64>,
    period_min_ms: Option<f64>,
    period_max_ms: Option<f64>,
    jitter_us: Option<f64>,
    load_percent: f64,
    gaps: u64,
    lost: u64,
    repeated: u64,
    bad: u64,
}

#[derive(Serialize)]
struct Told {
    time_s: f64,
    node: u8,
    code: u16,
    name: Option<&'static str>,
    severity: Option<&'static str>,
    motor: u8,
    limit: u8,
    detail: u16,
}

impl Row {
    fn of(
        statistics: &Statistics,
        id: u32,
        extended: bool,
        message: Option<&'static str>,
        entry: &PerId,
    ) -> Self {
        let cob = u16::try_from(id)
            .ok()
            .filter(|_| !extended)
            .map(Cob::from_id);
        let has_period = entry.periods > 0;
        let milliseconds = |ns: u64| has_period.then_some(ns as f64 / 1e6);
        let share = entry.bits as f64 / statistics.bits as f64;
        Self {
            id,
            extended,
            node: cob.and_then(Cob::node),
            message,
            count: entry.count,
            rate_hz: entry
                .mean_ns()
                .filter(|mean| *mean > 0.0)
                .map(|mean| 1e9 / mean),
            period_mean_ms: entry.mean_ns().map(|mean| mean / 1e6),
            period_min_ms: milliseconds(entry.min_ns),
            period_max_ms: milliseconds(entry.max_ns),
            jitter_us: entry.jitter_ns().map(|jitter| jitter / 1e3),
            load_percent: share * statistics.load_percent(),
            gaps: entry.gaps,
            lost: entry.lost,
            repeated: entry.repeated,
            bad: entry.bad,
        }
    }
}

/// Returns everything that is wrong with a pass: the frames, and the lines that were none.
pub fn problems(statistics: &Statistics, seen: &Seen) -> u64 {
    statistics.problems() + seen.malformed + seen.dropped
}

fn summary<'a>(bus: &'a str, statistics: &Statistics, seen: &Seen) -> Summary<'a> {
    let rows = statistics
        .by_id()
        .into_iter()
        .map(|(id, extended, message, entry)| {
            Row::of(
                statistics,
                id,
                extended,
                message.map(|message| message.name),
                entry,
            )
        });
    let emergencies = statistics.emergencies.iter().map(|seen| {
        let known = emergency::from_code(seen.report.code);
        Told {
            time_s: seen.time_ns as f64 / 1e9,
            node: seen.node,
            code: seen.report.code,
            name: known.map(|known| known.name),
            severity: known.map(|known| known.severity.name()),
            motor: seen.report.source.motor,
            limit: seen.report.source.limit,
            detail: seen.report.source.detail,
        }
    });
    Summary {
        bus,
        duration_s: statistics.duration_s(),
        frames: statistics.frames,
        bits: statistics.bits,
        load_percent: statistics.load_percent(),
        busiest_100ms_percent: statistics.busiest_percent(),
        malformed_lines: seen.malformed,
        dropped: seen.dropped,
        error_reports: statistics.error_reports,
        problems: problems(statistics, seen),
        ids: rows.collect(),
        emergencies: emergencies.collect(),
    }
}

/// Writes the JSON object.
///
/// # Errors
/// Those of `out`.
pub fn write_json(
    out: &mut dyn Write,
    bus: &str,
    statistics: &Statistics,
    seen: &Seen,
) -> Result<()> {
    serde_json::to_writer(&mut *out, &summary(bus, statistics, seen))?;
    writeln!(out)
}

/// Writes the table.
///
/// # Errors
/// Those of `out`.
pub fn write_table(
    out: &mut dyn Write,
    bus: &str,
    statistics: &Statistics,
    seen: &Seen,
) -> Result<()> {
    let summary = summary(bus, statistics, seen);
    writeln!(
        out,
        "{bus}: {} frames in {:.3} s",
        summary.frames, summary.duration_s
    )?;
    writeln!(
        out,
        "bus load {:.2} % with stuff bits, {:.2} % in the busiest 100 ms\n",
        summary.load_percent, summary.busiest_100ms_percent
    )?;
    writeln!(
        out,
        "{:>8}  {:<12}{:<13}{:>9}{:>10}{:>11}{:>11}{:>11}{:>11}{:>8}  wrong",
        "id",
        "from or to",
        "message",
        "frames",
        "rate/Hz",
        "period/ms",
        "min/ms",
        "max/ms",
        "jitter/us",
        "load/%"
    )?;
    for row in &summary.ids {
        write_row(out, row)?;
    }
    write_emergencies(out, statistics)?;
    writeln!(out)?;
    if summary.malformed_lines > 0 {
        writeln!(out, "{} lines could not be read", summary.malformed_lines)?;
    }
    if summary.dropped > 0 {
        writeln!(out, "{} frames dropped by the system", summary.dropped)?;
    }
    if summary.error_reports > 0 {
        writeln!(
            out,
            "{} error reports of the interface",
            summary.error_reports
        )?;
    }
    match summary.problems {
        0 => writeln!(out, "no frame bad, lost or late; no fault"),
        problems => writeln!(out, "{problems} problems"),
    }
}

fn write_row(out: &mut dyn Write, row: &Row) -> Result<()> {
    let node = match row.node {
        Some(HEAD_NODE) => "head".to_owned(),
        Some(node) if node <= VERTEBRAE => format!("vertebra {node}"),
        Some(node) => format!("node {node}"),
        None => String::new(),
    };
    let number = |value: Option<f64>, digits: usize| {
        value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
    };
    let id = if row.extended {
        format!("{:08X}", row.id)
    } else {
        format!("{:03X}", row.id)
    };
    write!(
        out,
        "{id:>8}  {node:<12}{:<13}{:>9}",
        row.message.unwrap_or("-"),
        row.count
    )?;
    write!(
        out,
        "{:>10}{:>11}",
        number(row.rate_hz, 2),
        number(row.period_mean_ms, 4)
    )?;
    write!(
        out,
        "{:>11}{:>11}",
        number(row.period_min_ms, 4),
        number(row.period_max_ms, 4)
    )?;
    write!(
        out,
        "{:>11}{:>8.2}",
        number(row.jitter_us, 2),
        row.load_percent
    )?;
    let wrong = [
        (row.bad, "bad"),
        (row.lost, "lost"),
        (row.repeated, "repeated"),
        (row.gaps, "gaps"),
    ];
    for (count, name) in wrong.into_iter().filter(|(count, _)| *count > 0) {
        write!(out, "  {count} {name}")?;
    }
    writeln!(out)
}

fn write_emergencies(out: &mut dyn Write, statistics: &Statistics) -> Result<()> {
    if !statistics.emergencies.is_empty() {
        writeln!(out, "\nemergencies")?;
    }
    for seen in &statistics.emergencies {
        let code = seen.report.code;
        let (name, sentence) = emergency::from_code(code)
            .map_or(("unknown", ""), |known| (known.name, known.sentence));
        let time = seen.time_ns as f64 / 1e9;
        writeln!(
            out,
            "{time:.6}  node {}  {code:04X} {name}: {sentence}",
            seen.node
        )?;
    }
    Ok(())
}
