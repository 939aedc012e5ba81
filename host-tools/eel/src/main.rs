//! The `eel` command: what is on the bus, in words and numbers, and what the wrist answers.

mod active;
mod channels;
mod cli;
mod decode;
mod export;
mod filter;
mod json;
mod listen;
mod lss;
mod object;
mod report;
mod sdo;
mod service;
mod source;
mod stats;
mod text;
mod usage;
mod value;
mod wrist;

use std::io::{BufWriter, ErrorKind, IsTerminal, Write, stderr, stdout};
use std::process::ExitCode;

use anyhow::{Context, Result};
use eel_transport::Received;

use cli::{Colour, Command, Lines, Stats};
use listen::{Form, Listener, Recording};
use source::{Limits, Seen, Sink};
use stats::Statistics;

/// Bytes that are gathered before they are written.
const BUFFER: usize = 1 << 16;

fn main() -> ExitCode {
    let eel = cli::parse();
    let result = match eel.command {
        Command::Sniff(sniff) => {
            let record = sniff.record.as_deref();
            listen(
                &sniff.bus,
                &sniff.lines,
                sniff.limits(),
                record,
                sniff.statistics(),
            )
        }
        Command::Decode(decode) => listen(
            &decode.file,
            &decode.lines,
            decode.lines.limits(),
            None,
            None,
        ),
        Command::Stats(stats) => measure(&stats),
        Command::Export(export) => export::export(export.format, export.out.as_deref()).map(|()| 0),
        Command::Wrist(wrist) => wrist::run(&wrist),
        Command::Nodes(nodes) => nodes.run(),
        Command::Read(read) => read.run(),
        Command::Faults(faults) => faults.run(),
        Command::Scope(scope) => scope.run(),
        Command::Drive(drive) => drive.run(),
        Command::Write(write) => write.run(),
        Command::Nmt(nmt) => nmt.run(),
        Command::Lss(lss) => lss.run(),
        Command::Map(map) => map.run(),
        Command::Store(store) => store.run(),
        Command::Calibrate(calibrate) => calibrate.run(),
        Command::SelfTest(test) => test.run(),
        Command::Head(head) => head.run(),
    };
    match result {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::from(1),
        // Whoever read our output has had enough.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("eel: {error:#}");
            ExitCode::from(if error.is::<wrist::Refused>() {
                2
            } else {
                active::exit_code(&error)
            })
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let io = cause.downcast_ref::<std::io::Error>();
        let json = cause.downcast_ref::<serde_json::Error>();
        io.map(std::io::Error::kind) == Some(ErrorKind::BrokenPipe)
            || json.and_then(serde_json::Error::io_error_kind) == Some(ErrorKind::BrokenPipe)
    })
}

/// Shows what comes, and returns how much was wrong.
fn listen(
    url: &str,
    lines: &Lines,
    limits: Limits,
    record: Option<&str>,
    statistics: Option<Statistics>,
) -> Result<u64> {
    let is_terminal = stdout().is_terminal();
    let colour = match lines.color {
        Colour::Auto => is_terminal && std::env::var_os("NO_COLOR").is_none(),
        Colour::Always => true,
        Colour::Never => false,
    };
    let form = if lines.json {
        Form::Json
    } else {
        Form::Text {
            colour,
            raw: lines.raw,
            absolute: lines.absolute,
        }
    };
    let mut bus = source::open(url)?;
    source::catch_interrupt()?;
    let out = BufWriter::with_capacity(BUFFER, stdout().lock());
    let mut listener = Listener::new(out, form, lines.filter());
    if let Some(path) = record {
        let recording = Recording::create(path, url);
        listener.record(recording.with_context(|| format!("can't write {path}"))?);
    }
    if let Some(statistics) = statistics {
        listener.gather(statistics);
    }
    let seen = source::run(bus.as_mut(), limits, &mut listener)?;
    let problems = listener.problems() + seen.malformed + seen.dropped;
    if let Some(statistics) = listener.into_statistics() {
        report::write_table(&mut stderr().lock(), url, &statistics, &seen)?;
        return Ok(report::problems(&statistics, &seen));
    }
    Ok(problems)
}

/// Adds up what comes, and returns how much was wrong.
fn measure(stats: &Stats) -> Result<u64> {
    struct Gather(Statistics);
    impl Sink for Gather {
        fn take(&mut self, received: &Received) -> std::io::Result<()> {
            self.0.add(received);
            Ok(())
        }

        fn idle(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let mut bus = source::open(&stats.bus)?;
    source::catch_interrupt()?;
    let mut gather = Gather(stats.physical.statistics());
    let seen: Seen = source::run(bus.as_mut(), stats.limits(), &mut gather)?;
    let mut out = BufWriter::new(stdout().lock());
    if stats.json {
        report::write_json(&mut out, &stats.bus, &gather.0, &seen)?;
    } else {
        report::write_table(&mut out, &stats.bus, &gather.0, &seen)?;
    }
    out.flush()?;
    Ok(report::problems(&gather.0, &seen))
}
