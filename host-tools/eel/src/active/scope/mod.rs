//! `eel scope`: up to four signals of a vertebra, tick by tick, as a plot, a drawing or a table.

mod capture;
mod drawing;
mod plot;

use std::io::{IsTerminal, Write, stderr, stdout};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use clap::Args;
use eel_client::{Client, ClientError, Method, Multiplexor};
use eel_protocol::dictionary;
use eel_protocol::scope::{SCOPE_CHANNELS, ScopeState, Trigger, captured};
use eel_transport::Bus;

use super::Node;
use super::bus::BusOption;
use crate::object::{self, Kind, Object};
use crate::source;
use crate::usage::Usage;
use capture::Capture;

/// Object 0x2050: channels 1–4, divider, trigger, state, samples.
const SCOPE: u16 = 0x2050;
const DIVIDER: Multiplexor = Multiplexor::new(SCOPE, 5);
const TRIGGER: Multiplexor = Multiplexor::new(SCOPE, 6);
const STATE: Multiplexor = Multiplexor::new(SCOPE, 7);
/// Object 0x2100:2.
const SAMPLES: Multiplexor = Multiplexor::new(0x2100, 2);
/// Time between two questions whether it is full.
const POLL: Duration = Duration::from_millis(50);
/// Characters of a plot from left to right.
const COLUMNS: usize = 72;

const AFTER: &str = "\
Signals are objects by the names of `eel export md`, 0x2000 and above: pose.yaw, motor.angle1, health.supply.
`eel read NODE all` lists them. The vertebra keeps 1024 numbers: 1024 ms of one signal, 256 ms of four, times
--every. With --on-fault it captures over what is old until a fault or stop, then half of its memory more;
Ctrl-C or --seconds end it before and show what there is. Nothing moves; a capture that runs is ended.

Times count from the first sample, or from the first sample after the fault.

--json: one object: node, every_ms, first_us (numbers: time of the first sample since power-up), fault
(number: the first sample after the fault, or null), state (string: full, or stopped where it was ended
before), signals (array of objects: name, unit (strings), min, max (numbers), values (array of numbers)).

Exit codes: 0 fine; 1 nothing was captured, no fault came, or the node refuses or does not answer; 2 wrong
usage; 3 the bus or a file failed.

Examples:
  eel scope 3 pose.yaw motor.angle1            every millisecond until memory is full
  eel scope 3 pose.yaw --every 10 --svg yaw.svg --csv yaw.csv
  eel scope 3 effort.motor1 effort.motor2 health.supply --on-fault
  eel scope -b can0 3 pose.roll --seconds 0.2 --json";

/// Capture up to four signals of a vertebra and plot them
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Scope {
    /// The vertebra: its node id
    node: Node,
    /// What to capture: up to four names of numbers
    #[arg(required = true, value_name = "SIGNAL")]
    signals: Vec<String>,
    #[command(flatten)]
    bus: BusOption,
    /// Control ticks of 1 ms from one sample to the next
    #[arg(long, value_name = "TICKS", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    every: u16,
    /// Capture around the next fault or stop
    #[arg(long)]
    on_fault: bool,
    /// End after so many seconds, full or not
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// Draw it into a file
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write it into a file, a line for each sample, in units
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write one JSON object instead of the plot (schema below)
    #[arg(long)]
    json: bool,
}

/// What the vertebra is told to capture.
struct Order {
    node: u8,
    channels: [u32; SCOPE_CHANNELS],
    every: u16,
    trigger: Trigger,
}

fn seconds(text: &str) -> Result<f64, String> {
    let time = text.parse().ok().filter(|time| (0.01..=1e6).contains(time));
    time.ok_or_else(|| "a time from 0.01 to 1000000 s".to_owned())
}

/// Returns the channel of a signal.
fn channel(name: &str) -> Result<u32, Usage> {
    let mut found = object::find(name)?;
    if found.len() > 1 {
        let names: Vec<_> = found.iter().map(|object| object.name.as_str()).collect();
        return Err(Usage(format!(
            "{name} is a group: name up to four of {}",
            names.join(", ")
        )));
    }
    let wrong = || {
        Usage(format!(
            "{name} can't be captured: the scope takes numbers from 0x2000 on, such as pose.yaw"
        ))
    };
    let Object { place, kind, .. } = found.pop().ok_or_else(wrong)?;
    let Kind::Number { bytes, .. } = kind else {
        return Err(wrong());
    };
    let (index, subindex) = (u32::from(place.index), u32::from(place.subindex));
    let raw = (index << 16) | (subindex << 8) | (8 * u32::from(bytes));
    let is_entry = dictionary::find(place.index, place.subindex).is_ok();
    if is_entry && captured(raw).is_some() {
        Ok(raw)
    } else {
        Err(wrong())
    }
}

/// Returns the channels of some signals; 0 for those without one.
fn channels(names: &[String]) -> Result<[u32; SCOPE_CHANNELS], Usage> {
    let mut channels = [0; SCOPE_CHANNELS];
    if names.len() > channels.len() {
        return Err(Usage(format!(
            "the scope takes four signals at a time, not {}: capture the others afterwards",
            names.len()
        )));
    }
    for (slot, name) in channels.iter_mut().zip(names) {
        *slot = channel(name)?;
    }
    Ok(channels)
}

impl Order {
    /// Captures until it is full or `goes_on` says no, and returns the capture's bytes.
    ///
    /// # Errors
    /// As [`Client::upload`] and [`Client::download`].
    fn carry_out<B: Bus>(
        &self,
        client: &mut Client<B>,
        goes_on: &mut dyn FnMut() -> bool,
    ) -> Result<Vec<u8>, ClientError> {
        // While one runs, nothing can be set.
        self.write(client, TRIGGER, &[Trigger::Stop as u8])?;
        for (subindex, raw) in (1..).zip(self.channels) {
            let place = Multiplexor::new(SCOPE, subindex);
            self.write(client, place, &raw.to_le_bytes())?;
        }
        self.write(client, DIVIDER, &self.every.to_le_bytes())?;
        self.write(client, TRIGGER, &[self.trigger as u8])?;
        while goes_on() {
            let code = client.number(self.node, STATE)?;
            let state = ScopeState::from_code(code as u8);
            if !state.is_some_and(ScopeState::is_running) {
                break;
            }
            client.listen(POLL)?;
        }
        client.upload(self.node, SAMPLES, Method::Automatic, &mut |_| ())
    }

    fn write<B: Bus>(
        &self,
        client: &mut Client<B>,
        place: Multiplexor,
        data: &[u8],
    ) -> Result<(), ClientError> {
        client.download(self.node, place, data, Method::Automatic, &mut |_| ())
    }
}

impl Scope {
    /// Captures and shows, and returns 1 where there is nothing of what was asked for.
    pub fn run(&self) -> Result<u64> {
        let channels = channels(&self.signals)?;
        let trigger = if self.on_fault {
            Trigger::Fault
        } else {
            Trigger::Once
        };
        let order = Order {
            node: self.node.0,
            channels,
            every: self.every,
            trigger,
        };
        let mut client = self.bus.client()?;
        source::catch_interrupt()?;
        if self.on_fault && stderr().is_terminal() {
            eprintln!("eel: waiting for a fault or stop; Ctrl-C ends it");
        }
        let begin = Instant::now();
        let is_over = |limit| begin.elapsed().as_secs_f64() >= limit;
        let bytes = order.carry_out(&mut client, &mut || {
            source::interrupts() == 0 && !self.seconds.is_some_and(is_over)
        })?;
        let capture = match Capture::of(self.node, &order.channels, &bytes) {
            Ok(capture) => capture,
            Err(words) => {
                eprintln!("eel: {}: {words}", self.node);
                return Ok(1);
            }
        };
        self.show(&capture)?;
        if self.on_fault && capture.fault.is_none() {
            eprintln!("eel: no fault came: this is what was before the end");
            return Ok(1);
        }
        Ok(0)
    }

    /// Prints the capture, and writes the files that are wanted.
    fn show(&self, capture: &Capture) -> Result<()> {
        if self.json {
            writeln!(stdout(), "{}", capture.json())?;
        } else {
            write!(stdout(), "{}", plot::text(capture, COLUMNS))?;
        }
        let files = [
            (&self.svg, drawing::svg as fn(&Capture) -> String),
            (&self.csv, Capture::csv),
        ];
        for (path, write) in files {
            if let Some(path) = path {
                std::fs::write(path, write(capture))
                    .with_context(|| format!("can't write {}", path.display()))?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
