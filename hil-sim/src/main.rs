//! `hil-sim`: ten vertebrae swim in simulated water.

mod interrupt;
mod live;

use std::io::{ErrorKind, Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::{Args, Parser, Subcommand};
use eel_head::{Gait, GaitError, Plane};
use eel_protocol::{NodeId, VERTEBRAE};
use hil_sim::{checks, reactions, swim};
use indicatif::ProgressBar;

/// Simulates the eel: ten vertebrae with their real firmware logic, the CAN bus, the water.
#[derive(Parser)]
#[command(name = "hil-sim", version, about, long_about = None)]
#[command(args_conflicts_with_subcommands = true)]
#[command(
    after_help = "Without a command and options it swims with the defaults of `swim`.\n\
    Exit codes: 0 fine, 1 a check failed, vertebrae did not follow, frames were lost or Ctrl-C came, \
    2 wrong usage, files or interface."
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    live: LiveArgs,
}

#[derive(Args)]
struct LiveArgs {
    /// Run the vertebrae in real time on a SocketCAN interface instead, for other programs to talk
    /// to, until Ctrl-C; `cargo xtask vcan -- COMMAND` runs a command beside a vcan0
    #[arg(long, value_name = "IFACE")]
    can: Option<String>,
    /// With --can: which vertebrae, by node id, as 3,5 or 1-4,9; all ten without it, or those that
    /// are not unconfigured
    #[arg(long, value_name = "IDS", value_parser = node_ids)]
    nodes: Option<NodeList>,
    /// With --can: which vertebrae, by their place in the chain, have no node id: they are silent until
    /// an LSS master gives them one
    #[arg(long, value_name = "PLACES", value_parser = node_ids)]
    unconfigured: Option<NodeList>,
    /// With --can: these vertebrae are built in at random, by the seed, and were never calibrated: each
    /// refuses to be enabled until `eel calibrate` has been at it. Hands turn its wrist when it asks for it
    #[arg(long, value_name = "IDS", value_parser = node_ids)]
    uncalibrated: Option<NodeList>,
    /// With --can: the order in which the line beside the bus goes through the places, as 3,1,2; by their
    /// numbers without it
    #[arg(long, value_name = "PLACES", value_parser = places)]
    chain: Option<NodeList>,
    /// With --can: time until the end, s [0.1 to 1e6]
    #[arg(long, value_parser = between(0.1, 1e6))]
    seconds: Option<f64>,
    /// With --can: seed of encoder positions and sensor noise [default: 1]
    #[arg(long)]
    seed: Option<u64>,
}

impl LiveArgs {
    /// Tells whether an option was given that means nothing without an interface.
    fn is_used(&self) -> bool {
        self.nodes.is_some()
            || self.uncalibrated.is_some()
            || self.chain.is_some()
            || self.unconfigured.is_some()
            || self.seconds.is_some()
            || self.seed.is_some()
    }
}

/// Vertebrae in the order of their node ids.
#[derive(Clone)]
struct NodeList(Vec<NodeId>);

#[derive(Subcommand)]
enum Command {
    /// Ten vertebrae boot, are started by the head, swim, and are stopped in order
    Swim(SwimArgs),
    /// Injects faults into a swimming eel and measures how soon each vertebra reacts
    Reactions(ReactionArgs),
    /// Compares the plant with what is known exactly: energy, added mass, glide, rest
    Check(CheckArgs),
}

#[derive(Args)]
struct SwimArgs {
    /// Simulated time of swimming, s; the orderly stop comes on top [0.1 to 3600]
    #[arg(long, default_value_t = 20.0, value_parser = between(0.1, 3600.0))]
    seconds: f64,
    /// Cycles of the body wave a second, Hz [0.05 to 3]; above about 1.4 at the default amplitude
    /// the motors can no longer follow
    #[arg(long, default_value_t = 1.0, value_parser = between(0.05, 3.0))]
    frequency: f64,
    /// Amplitude of the tail edge, body lengths [0 to 0.2]; above about 0.09 the last vertebrae
    /// meet the end of their workspace and limit their targets
    #[arg(long, default_value_t = 0.08, value_parser = between(0.0, 0.2))]
    amplitude: f64,
    /// Length of the body wave, body lengths [0.2 to 3]
    #[arg(long, default_value_t = 0.8, value_parser = between(0.2, 3.0))]
    wavelength: f64,
    /// Seed of encoder positions and sensor noise; equal seeds give equal frame logs
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for bus.log (candump), states.csv, stride.svg and summary.json
    #[arg(long, default_value = "out/swim", value_name = "DIR")]
    out: PathBuf,
    /// Run these vertebrae, or all without IDS, as the Cortex-M4 image in QEMU, one process each, in
    /// lock-step; the frame log is the same. Takes qemu-system-arm and `cargo xtask firmware qemu`
    #[arg(long, value_name = "IDS", value_parser = node_ids, num_args = 0..=1,
        default_missing_value = "1-10")]
    qemu: Option<NodeList>,
    /// With --qemu: the image [default: target/firmware/board-qemu.elf]
    #[arg(long, value_name = "FILE", requires = "qemu")]
    image: Option<PathBuf>,
    /// Print one JSON object instead of the table, and no progress bar
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct ReactionArgs {
    /// How often each kind of fault is measured, rounded up to tens [1 to 100000]
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    cases: u32,
    /// Seed of moments, motors and sizes; equal seeds give equal tables
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print one JSON object instead of the tables, and no progress bar
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct CheckArgs {
    /// Print one JSON object instead of the table
    #[arg(long)]
    json: bool,
}

/// Returns a parser of numbers in a range; its error names the range.
fn between(low: f64, high: f64) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync {
    move |text| match text.parse::<f64>() {
        Ok(value) if value >= low && value <= high => Ok(value),
        Ok(value) => Err(format!("{value} is outside {low} to {high}")),
        Err(_) => Err(format!("not a number; give one from {low} to {high}")),
    }
}

/// Reads node ids and ranges of them, separated by commas.
fn node_ids(text: &str) -> Result<NodeList, String> {
    let wrong = || format!("give node ids from 1 to {VERTEBRAE}, as 3,5 or 1-4,9");
    let one = |text: &str| {
        text.trim()
            .parse()
            .ok()
            .and_then(NodeId::new)
            .ok_or_else(wrong)
    };
    let mut chosen = Vec::new();
    for part in text.split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last) = (one(first)?, one(last)?);
        if first > last {
            return Err(wrong());
        }
        chosen.extend(NodeId::all().filter(|id| (first..=last).contains(id)));
    }
    chosen.sort();
    chosen.dedup();
    Ok(NodeList(chosen))
}

/// Reads node ids in an order that counts.
fn places(text: &str) -> Result<NodeList, String> {
    let places = text
        .split(',')
        .map(|place| node_ids(place).map(|NodeList(ids)| ids));
    let places: Vec<NodeId> = places.collect::<Result<Vec<_>, _>>()?.concat();
    Ok(NodeList(places))
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = match (&cli.command, &cli.live.can) {
        (Some(Command::Swim(args)), _) => run_swim(args),
        (Some(Command::Reactions(args)), _) => run_reactions(args),
        (Some(Command::Check(args)), _) => run_checks(args),
        (None, Some(interface)) => run_live(interface, &cli.live),
        (None, None) if cli.live.is_used() => Err(anyhow::anyhow!(
            "--nodes, --unconfigured, --uncalibrated, --chain, --seconds and --seed go with --can IFACE; to swim in simulated \
             time, put `swim` before the options: hil-sim swim --seconds 5"
        )),
        (None, None) => run_swim(&SwimArgs::defaults()),
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        // Whoever read the output has seen enough of it.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("hil-sim: {error:#}");
            ExitCode::from(2)
        }
    }
}

impl SwimArgs {
    /// Returns what the options are when none is given.
    fn defaults() -> Self {
        match Cli::parse_from(["hil-sim", "swim"]).command {
            Some(Command::Swim(args)) => args,
            _ => unreachable!("swim parses as swim"),
        }
    }
}

/// Swims, prints what came of it and tells whether all followed to the end.
fn run_swim(args: &SwimArgs) -> anyhow::Result<bool> {
    let options = swim::Options {
        seconds: args.seconds,
        gait: gait(args)?,
        frequency_hz: args.frequency,
        amplitude: args.amplitude,
        wavelength: args.wavelength,
        seed: args.seed,
        out: Some(args.out.clone()),
        faults: Vec::new(),
        emulated: args.qemu.clone().map(|NodeList(nodes)| swim::Emulated {
            nodes,
            image: args.image.clone().unwrap_or_else(default_image),
        }),
        progress: !args.json,
    };
    interrupt::listen()?;
    let summary = swim::run_while(&options, || !interrupt::came())?;
    if args.json {
        write(format_args!("{}\n", serde_json::to_string(&summary)?))?;
    } else {
        write(format_args!("{summary}"))?;
    }
    let complaints = summary.complaints();
    for complaint in &complaints {
        eprintln!("hil-sim: {complaint}");
    }
    Ok(complaints.is_empty())
}

/// Returns where `cargo xtask firmware qemu` puts the image, beside the folder of this program.
fn default_image() -> PathBuf {
    let program = std::env::current_exe().unwrap_or_default();
    let target = program.parent().and_then(std::path::Path::parent);
    target
        .unwrap_or(std::path::Path::new("target"))
        .join("firmware/board-qemu.elf")
}

/// Runs vertebrae on an interface and tells whether the bus took all that they sent.
fn run_live(interface: &str, args: &LiveArgs) -> anyhow::Result<bool> {
    let nodes = args
        .nodes
        .clone()
        .unwrap_or_else(|| NodeList(NodeId::all().collect()));
    let unconfigured = args.unconfigured.as_ref().map_or(&[][..], |list| &list.0);
    let uncalibrated = args.uncalibrated.as_ref().map_or(&[][..], |list| &list.0);
    let chain = args.chain.as_ref().map(|list| &list.0[..]);
    let (seconds, seed) = (args.seconds, args.seed.unwrap_or(1));
    interrupt::listen()?;
    live::run(&live::Live {
        interface,
        nodes: &nodes.0,
        unconfigured,
        uncalibrated,
        chain,
        seconds,
        seed,
    })
}

/// Writes to standard output.
fn write(text: std::fmt::Arguments<'_>) -> anyhow::Result<()> {
    let mut out = stdout().lock();
    out.write_fmt(text)
        .and_then(|()| out.flush())
        .context("can't write the result")
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let io = error.downcast_ref::<std::io::Error>();
    io.is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
}

/// Brings the options into the head's units: mHz and ten-thousandths of a body length.
fn gait(args: &SwimArgs) -> anyhow::Result<Gait> {
    let rounded = |value: f64| value.round();
    let frequency = rounded(args.frequency * 1e3) as u32;
    let amplitude = rounded(args.amplitude * 1e4) as u16;
    let wavelength = rounded(args.wavelength * 1e4) as u16;
    Gait::new(frequency, amplitude, wavelength, Plane::Lateral).map_err(|error| {
        anyhow::anyhow!(match error {
            GaitError::Frequency => "--frequency must be 0.001 to 3 Hz",
            GaitError::Amplitude => "--amplitude must be 0 to 0.2 body lengths",
            GaitError::Wavelength => "--wavelength must be 0.2 to 3 body lengths",
        })
    })
}

/// Measures the reactions and tells whether every promise was kept.
fn run_reactions(args: &ReactionArgs) -> anyhow::Result<bool> {
    let options = reactions::Options {
        cases: args.cases,
        seed: args.seed,
    };
    let bar = if args.json {
        ProgressBar::hidden()
    } else {
        ProgressBar::new(reactions::CLASSES.len() as u64)
    };
    let report = reactions::run(&options, |done| bar.set_position(done as u64))?;
    bar.finish_and_clear();
    if args.json {
        write(format_args!("{}\n", serde_json::to_string(&report)?))?;
    } else {
        write(format_args!("{report}"))?;
    }
    Ok(report.passed)
}

/// Runs the plant's checks and tells whether all passed.
fn run_checks(args: &CheckArgs) -> anyhow::Result<bool> {
    let report = checks::run();
    if args.json {
        write(format_args!("{}\n", serde_json::to_string(&report)?))?;
    } else {
        write(format_args!("{report}"))?;
    }
    Ok(report.passed)
}
