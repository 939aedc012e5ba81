//! `hil-sim`: ten vertebrae swim in simulated water.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use eel_head::{Gait, GaitError, Plane};
use hil_sim::{checks, swim};

/// Simulates the eel: ten vertebrae with their real firmware logic, the CAN bus, the water.
#[derive(Parser)]
#[command(name = "hil-sim", version, about, long_about = None)]
#[command(after_help = "Without a command it swims with the defaults.\n\
    Exit codes: 0 fine, 1 a check failed or vertebrae did not follow, 2 wrong usage or files.")]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Ten vertebrae boot, are started by the head, swim, and are stopped in order
    Swim(SwimArgs),
    /// Compares the plant with what is known exactly: energy, added mass, glide, rest
    Check(CheckArgs),
}

#[derive(Args)]
struct SwimArgs {
    /// Simulated time of swimming, s; the orderly stop comes on top [0.1 to 3600]
    #[arg(long, default_value_t = 20.0, value_parser = between(0.1, 3600.0))]
    seconds: f64,
    /// Cycles of the body wave a second, Hz [0.05 to 3]
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
    /// Print one JSON object instead of the table, and no progress bar
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

fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = match &cli.command {
        None => run_swim(&SwimArgs::defaults()),
        Some(Command::Swim(args)) => run_swim(args),
        Some(Command::Check(args)) => run_checks(args),
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
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
        progress: !args.json,
    };
    let summary = swim::run(&options)?;
    if args.json {
        println!("{}", serde_json::to_string(&summary)?);
    } else {
        print!("{summary}");
    }
    Ok(summary.nodes_operational == hil_sim::robot::NODES && summary.frames_lost == 0)
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

/// Runs the plant's checks and tells whether all passed.
fn run_checks(args: &CheckArgs) -> anyhow::Result<bool> {
    let report = checks::run();
    if args.json {
        println!("{}", serde_json::to_string(&report)?);
    } else {
        print!("{report}");
    }
    Ok(report.passed)
}
