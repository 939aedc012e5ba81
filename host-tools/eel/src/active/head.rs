//! `eel head`: the head of the eel as a program.

use std::io::{Write, stdout};
use std::time::Duration;

use anyhow::Result;
use clap::{Args, ValueEnum};
use eel_client::{Client, ClientError};
use eel_head::{Config, Gait, GaitError, Plane};
use eel_protocol::{HEAD_NODE, NodeId};

use super::bus::{self, AnyBus, BusOption, Consent};
use super::live::{Live, Outcome};
use super::map;
use crate::source;
use crate::usage::Usage;

/// How long another head is listened for.
const OTHER: Duration = Duration::from_millis(350);

const AFTER: &str = "\
Starts the vertebrae on the bus, leads each from where it is into the gait, and stops them in order:
after --seconds, at Ctrl-C or SIGTERM, or when its terminal or the reader of its output goes away, the gait
fades out, the eel straightens, drives are switched off and the nodes leave operation. A second Ctrl-C ends
it at once: NMT stop to all, and vertebrae that move let go. Where the head itself dies, vertebrae let go
within 0.1 s. Vertebrae may be boards, simulated, or both. Where the line beside the bus (see eel map) says
that node ids don't rise from head to tail, the head does not start.

Needs --yes except on a virtual interface. Only one head may be on a bus.

--json: JSON lines. Each event: time_s (number, s since the start), event (string: booted, running, lost,
latched, emergency, gait-started, stopped, not-stopped), and where they apply node (number), state
(string), code (number), name, severity, sentence (strings). The last line: seconds, sync_sent,
frames_sent, frames_received, running (numbers: of vertebrae, at most), late_max_ms (number: of a SYNC),
stopped (string: in-order, at-once).

Exit codes: 0 swam and stopped in order; 1 a vertebra fell silent, latched or did not stop, nobody swam,
or it was ended at once; 2 wrong usage; 3 the bus failed.

Examples:
  eel head vcan0 --gait swim --seconds 20
  eel head --frequency 0.5 --amplitude 0.05 --nodes 1-5
  eel head can0 --yes --reset                  acknowledge stops that are latched now, then swim";

/// Lead the vertebrae through a gait: NMT master, SYNC, targets, and a stop in order
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Head {
    /// The bus, as --bus
    #[arg(value_name = "BUS", conflicts_with = "bus")]
    positional: Option<String>,
    #[command(flatten)]
    bus: BusOption,
    /// How to move
    #[arg(long, default_value = "swim")]
    gait: Kind,
    /// Waves a second, Hz: 0.001 to 3
    #[arg(long, value_name = "HZ", default_value_t = 1.0)]
    frequency: f64,
    /// Amplitude of the tail, body lengths: 0 to 0.2
    #[arg(long, value_name = "L", default_value_t = 0.08)]
    amplitude: f64,
    /// Length of the wave, body lengths: 0.2 to 3
    #[arg(long, value_name = "L", default_value_t = 0.8)]
    wavelength: f64,
    /// Plane of the wave
    #[arg(long, default_value = "lateral")]
    plane: PlaneName,
    /// Vertebrae that are waited for before the gait begins: 3,5 or 1-4; others swim along
    #[arg(long, value_name = "NODES", default_value = "1-10", value_parser = expected)]
    nodes: u16,
    /// SYNCs a second, Hz: 50 to 200
    #[arg(long, value_name = "HZ", default_value_t = 100, value_parser = clap::value_parser!(u32).range(50..=200))]
    sync_hz: u32,
    /// Stop in order after so many seconds
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// Acknowledge stops that were latched before the head came, so that those vertebrae run again
    #[arg(long)]
    reset: bool,
    #[command(flatten)]
    consent: Consent,
    /// Write JSON lines (schema below)
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Kind {
    /// A travelling wave from head to tail
    Swim,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum PlaneName {
    /// Left and right, by yaw
    Lateral,
    /// Up and down, by pitch
    Vertical,
}

pub(super) fn seconds(text: &str) -> Result<f64, String> {
    let time = text
        .parse()
        .ok()
        .filter(|time| (0.0..=1e6).contains(time) && *time > 0.0);
    time.ok_or_else(|| "a time of more than 0 s".to_owned())
}

/// Reads `3,5` or `1-4` as one bit for each vertebra, bit 0 the first.
pub(super) fn expected(text: &str) -> Result<u16, String> {
    let wrong = || format!("{text:?} are no vertebrae: write 3,5 or 1-4, each 1 to 10");
    let mut all = 0;
    for part in text.split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let node = |text: &str| {
            let id = text.trim().parse().ok().and_then(NodeId::new);
            id.ok_or_else(wrong)
        };
        let (first, last) = (node(first)?, node(last)?);
        if first > last {
            return Err(wrong());
        }
        for index in first.index()..=last.index() {
            all |= 1 << index;
        }
    }
    Ok(all)
}

impl Head {
    /// Leads until the end, and returns 0 where all went well.
    pub fn run(&self) -> Result<u64> {
        let gait = self.gait()?;
        let name = match &self.positional {
            Some(name) => name.clone(),
            None => self.bus.name()?,
        };
        self.consent.check(&name, "the head")?;
        source::catch_interrupt()?;
        let bus = in_order(alone(bus::open(&name)?, &name)?)?;
        let config = Config {
            sync_period: eel_units::Duration::from_micros(1_000_000 / self.sync_hz),
            expected: self.nodes,
            ..Config::new(gait)
        };
        let mut live = Live::new(bus, config, self.json);
        live.resets_first = self.reset;
        let limit = self.seconds.map(Duration::from_secs_f64);
        let outcome = live.run(limit)?;
        self.tell(&outcome)?;
        Ok(u64::from(!outcome.is_fine()))
    }

    fn gait(&self) -> Result<Gait> {
        let Kind::Swim = self.gait;
        let plane = match self.plane {
            PlaneName::Lateral => Plane::Lateral,
            PlaneName::Vertical => Plane::Vertical,
        };
        // What is negative or no number becomes 0, and too much saturates; both are refused below
        // where they are out of range.
        let scaled = |value: f64, factor: f64| (value * factor).round();
        if self.amplitude.is_nan() || self.amplitude < 0.0 {
            return Err(Usage("--amplitude is 0 to 0.2 body lengths".to_owned()).into());
        }
        Gait::new(
            scaled(self.frequency, 1e3) as u32,
            scaled(self.amplitude, 1e4) as u16,
            scaled(self.wavelength, 1e4) as u16,
            plane,
        )
        .map_err(|error| {
            let text = match error {
                GaitError::Frequency => "--frequency is 0.001 to 3 Hz",
                GaitError::Amplitude => "--amplitude is 0 to 0.2 body lengths",
                GaitError::Wavelength => "--wavelength is 0.2 to 3 body lengths",
            };
            Usage(text.to_owned()).into()
        })
    }

    fn tell(&self, outcome: &Outcome) -> std::io::Result<()> {
        let Outcome {
            elapsed,
            syncs,
            sent,
            received,
            most_running,
            latest,
            at_once,
            ..
        } = outcome;
        let (elapsed, late) = (elapsed.as_secs_f64(), latest.as_secs_f64() * 1e3);
        if self.json {
            return writeln!(stdout(), "{}", outcome.json());
        }
        let how = if *at_once {
            "ended at once"
        } else {
            "stopped in order"
        };
        writeln!(
            stdout(),
            "{how} after {elapsed:.1} s: {most_running} vertebrae swam, {syncs} SYNCs (late by \
             {late:.1} ms at most), {sent} frames out, {received} in"
        )
    }
}

/// Makes sure that no other head is on the bus.
pub(super) fn alone(bus: AnyBus, name: &str) -> Result<AnyBus> {
    let mut client = Client::new(bus);
    client.listen(OTHER)?;
    if client.heard(HEAD_NODE).is_some() {
        return Err(Usage(format!(
            "another head (node {HEAD_NODE}) is on {name}: stop it first, two would fight"
        ))
        .into());
    }
    Ok(client.into_bus())
}

/// Makes sure that the ids rise from head to tail, as far as the line beside the bus tells.
fn in_order(bus: AnyBus) -> Result<AnyBus> {
    let mut client = Client::new(bus);
    match map::find_fall(&mut client) {
        Ok(None) => {}
        Ok(Some((node, next))) => {
            return Err(Usage(format!(
                "vertebra {next} is the next behind vertebra {node}, and would bend where another \
                 should: `eel map` shows the order and how to mend it"
            ))
            .into());
        }
        Err(error @ ClientError::Bus(_)) => return Err(error.into()),
        // A vertebra of another make, or one that is silent, which the head tells of.
        Err(error) => eprintln!("eel: the order of the spine is not checked: {error}"),
    }
    Ok(client.into_bus())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertebrae_are_chosen_by_number_and_range() {
        assert_eq!(expected("1-10"), Ok(0x3FF));
        assert_eq!(expected("3,5"), Ok(0b1_0100));
        assert_eq!(expected("1-2,10"), Ok(0x203));
        assert!(expected("0").is_err() && expected("5-3").is_err() && expected("11").is_err());
        assert!(expected("").is_err());
    }
}
