//! The command line.

use std::path::PathBuf;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};

use crate::active::{
    Calibrate, Drive, Faults, Head, Lss, Map, Nmt, Nodes, Read, Scope, SelfTest, Store, Write,
};
use crate::export::Format;
use crate::filter::{Filter, Ids, Name, Node};
use crate::source::Limits;
use crate::stats::Statistics;
use crate::wrist::Wrist;
use crate::{json, report};

const AFTER: &str = "\
Buses: vcan0 or can0 (SocketCAN, Linux), a candump file (candump -L; its name has a dot or a
slash), or - for a candump recording on standard input. Commands that send take an interface: --bus,
or the variable EEL_BUS, or the only one that is up. What can move a robot needs --yes, except on a
virtual interface.

Exit codes: 0 fine; 1 found a fault (bad, lost, repeated or late frames, a fault emergency, a line
that can't be read, a node that refuses or is silent); 2 wrong usage, or a wrist that can't; 3 the bus
or the file failed.

Examples:
  eel sniff vcan0 --node 3 --name pose        what vertebra 3 reports, live
  eel sniff can0 --record dive.log --stats    everything, recorded, with a table at the end
  eel decode swim.log --name target.yaw --json
  eel stats swim.log                          load, rates, jitter, losses
  eel export all --out docs/generated         EDS, DBC and tables for other tools
  eel nodes                                   who is on the bus, and how they are
  eel read 3 pose.yaw                         one value of vertebra 3, in rad
  eel write 3 gains.peak_torque=2.5           in N.m, range-checked
  eel faults 3                                what stopped vertebra 3, and how it was
  eel scope 3 pose.yaw motor.angle1           every millisecond for half a second, plotted
  eel map                                     in which order vertebrae are connected
  eel calibrate 3 --yes                       zeros, offsets and senses of vertebra 3, step by step
  eel self-test 3 --yes                       its sensors and bridges
  eel drive 3 pose --yaw 10 --degrees         vertebra 3 by hand
  eel head vcan0 --gait swim --seconds 20     lead simulated vertebrae through a gait
  eel wrist ik --yaw 20 --degrees             motor angles for a pose; eel wrist --help says more";

/// Anguilla's bus and its wrist: listen, measure, bring nodes up, lead them, ask
#[derive(Debug, Parser)]
#[command(name = "eel", version, after_help = AFTER, disable_help_subcommand = true)]
pub struct Eel {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Show what comes on a bus, decoded, line by line
    #[command(after_help = listen_help())]
    Sniff(Sniff),
    /// Show a recorded candump file, decoded, line by line
    #[command(after_help = listen_help())]
    Decode(Decode),
    /// Add up a file or a live bus: load, and rate, period, jitter and losses of each identifier
    #[command(after_help = format!("--json: {}", report::SCHEMA))]
    Stats(Stats),
    /// Write the dictionary as EDS, DBC or markdown
    Export(Export),
    /// Ask the wrist: inverse, direct, Jacobian, torques, margins, maps, drawings, the paper's claims
    Wrist(Wrist),
    Nodes(Nodes),
    Read(Read),
    Faults(Faults),
    Scope(Scope),
    Write(Write),
    Nmt(Nmt),
    Lss(Lss),
    Map(Map),
    Store(Store),
    Calibrate(Calibrate),
    SelfTest(SelfTest),
    Drive(Drive),
    Head(Head),
}

/// The commands as `eel --help` lists them.
const GROUPS: [(&str, &[&str]); 3] = [
    (
        "Listen to a bus or a recording (nothing is sent)",
        &["sniff", "decode", "stats"],
    ),
    (
        "Ask and command nodes (these send)",
        &[
            "nodes",
            "read",
            "write",
            "faults",
            "scope",
            "nmt",
            "lss",
            "map",
            "store",
            "calibrate",
            "self-test",
            "drive",
            "head",
        ],
    ),
    ("Without a bus", &["export", "wrist"]),
];

/// Returns the command line with its commands in groups.
fn command() -> clap::Command {
    let command = Eel::command();
    let mut template = String::from("{about}\n\n{usage-heading} {usage}\n");
    for (title, names) in GROUPS {
        template.push_str(&format!("\n{title}:\n"));
        for name in names {
            let about = command
                .find_subcommand(name)
                .and_then(clap::Command::get_about);
            let about = about.map(ToString::to_string).unwrap_or_default();
            template.push_str(&format!("  {name:<10}{about}\n"));
        }
    }
    template.push_str("\nOptions:\n{options}{after-help}");
    command.help_template(template)
}

/// Reads the command line; ends the program where it is wrong or asks for help.
pub fn parse() -> Eel {
    let matches = command().get_matches();
    Eel::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
}

fn listen_help() -> String {
    format!(
        "Each line: time in s since the first frame, whose frame, message, signals with units, and \
         after ! what is wrong with it.\n\n--json: {}",
        json::SCHEMA
    )
}

/// What both kinds of listening have in common.
#[derive(Debug, Args)]
pub struct Lines {
    /// Only these identifiers: 0x203, 515, or a range 0x180-0x18A; may be repeated
    #[arg(long = "id", value_name = "ID", value_delimiter = ',')]
    ids: Vec<Ids>,
    /// Only frames from or to this node: 1 to 127, or head; may be repeated
    #[arg(long = "node", value_name = "NODE", value_delimiter = ',')]
    nodes: Vec<Node>,
    /// Only this message, or one signal of it: pose, pose.yaw; may be repeated
    #[arg(long = "name", value_name = "NAME", value_delimiter = ',')]
    names: Vec<Name>,
    /// Write JSON lines (schema below)
    #[arg(long)]
    pub json: bool,
    /// Show identifier and bytes too
    #[arg(long)]
    pub raw: bool,
    /// Show times as recorded instead of since the first frame
    #[arg(long)]
    pub absolute: bool,
    /// Colours: auto is on a terminal only, and never where NO_COLOR is set
    #[arg(long, value_name = "WHEN", default_value = "auto")]
    pub color: Colour,
    /// Stop at the first line of a file that can't be read (otherwise it is told, skipped and counted)
    #[arg(long)]
    strict: bool,
    /// Stop after so many frames
    #[arg(long, value_name = "N")]
    count: Option<u64>,
}

/// When to use colours.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Colour {
    /// On a terminal
    Auto,
    /// Also into a pipe
    Always,
    /// Not at all
    Never,
}

#[derive(Debug, Args)]
pub struct Sniff {
    /// The bus: vcan0, can0, a candump file, or -
    pub bus: String,
    #[command(flatten)]
    pub lines: Lines,
    /// Record everything, filtered or not, to a candump file
    #[arg(long, value_name = "FILE")]
    pub record: Option<String>,
    /// Print rates, periods, jitter and load to standard error at the end
    #[arg(long)]
    stats: bool,
    /// Stop after so many seconds
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    #[command(flatten)]
    physical: Physical,
}

#[derive(Debug, Args)]
pub struct Decode {
    /// The candump file, or - for standard input
    pub file: String,
    #[command(flatten)]
    pub lines: Lines,
}

#[derive(Debug, Args)]
pub struct Stats {
    /// The bus: a candump file, -, vcan0 or can0 (live until Ctrl-C or --seconds)
    pub bus: String,
    #[command(flatten)]
    pub physical: Physical,
    /// Write one JSON object (schema below)
    #[arg(long)]
    pub json: bool,
    /// Stop at the first line of a file that can't be read (otherwise it is told, skipped and counted)
    #[arg(long)]
    strict: bool,
    /// Stop after so many seconds
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
}

/// What the numbers depend on.
#[derive(Debug, Args)]
pub struct Physical {
    /// Bits a second of the bus
    #[arg(long, value_name = "BIT/S", default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(10_000..=1_000_000))]
    bitrate: u32,
    /// SYNCs a second, against which gaps are judged
    #[arg(long, value_name = "HZ", default_value_t = 100.0, value_parser = sync_hz)]
    sync_hz: f64,
}

#[derive(Debug, Args)]
pub struct Export {
    /// What to write
    pub format: Format,
    /// The file, or the folder of `all`; standard output without it (`all`: the current folder)
    #[arg(long, value_name = "PATH")]
    pub out: Option<PathBuf>,
}

fn sync_hz(text: &str) -> Result<f64, String> {
    let rate = text
        .parse()
        .ok()
        .filter(|rate: &f64| (1.0..=1000.0).contains(rate));
    rate.ok_or_else(|| "a rate from 1 to 1000 Hz".to_owned())
}

impl Lines {
    /// Returns which frames are shown.
    pub fn filter(&self) -> Filter {
        Filter {
            ids: self.ids.clone(),
            nodes: self.nodes.clone(),
            names: self.names.clone(),
        }
    }

    /// Returns when to stop.
    pub const fn limits(&self) -> Limits {
        Limits {
            strict: self.strict,
            count: self.count,
            seconds: None,
        }
    }
}

impl Sniff {
    /// Returns when to stop.
    pub const fn limits(&self) -> Limits {
        Limits {
            seconds: self.seconds,
            ..self.lines.limits()
        }
    }

    /// Returns what gathers the statistics, where they are wanted.
    pub fn statistics(&self) -> Option<Statistics> {
        self.stats.then(|| self.physical.statistics())
    }
}

impl Stats {
    /// Returns when to stop.
    pub const fn limits(&self) -> Limits {
        Limits {
            strict: self.strict,
            count: None,
            seconds: self.seconds,
        }
    }
}

impl Physical {
    /// Returns empty statistics.
    pub fn statistics(&self) -> Statistics {
        Statistics::new(self.bitrate, self.sync_hz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed_and_every_command_is_in_a_group() {
        command().debug_assert();
        let mut grouped: Vec<_> = GROUPS.iter().flat_map(|(_, names)| names.iter()).collect();
        let all = command();
        let mut all: Vec<_> = all.get_subcommands().map(clap::Command::get_name).collect();
        grouped.sort();
        all.sort_unstable();
        assert!(grouped.into_iter().eq(&all));
        assert!(
            command()
                .render_help()
                .to_string()
                .contains("  nmt       Command")
        );
    }
}
