//! Builds, tests and generates everything: `cargo xtask --help`.
//!
//! Knows the tools around the project (cross toolchain, QEMU, User-mode Linux, Python) and nothing
//! of its crates but their names.

mod counts;
mod coverage;
mod cross;
mod cycles;
mod errors;
mod exhaustive;
mod firmware;
mod fuzz;
mod generated;
mod image;
mod llvm;
mod node;
mod panics;
mod process;
mod proofs;
mod setup;
mod stack;
mod suite;
mod vcan;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::firmware::Board;

/// Builds, tests and generates everything in Anguilla.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Runs everything that the project can test, and prints what each step took.
    Test {
        /// Leaves out what needs a tool beyond cargo (firmware, QEMU, vcan and Python), and the primitives'
        /// every input.
        #[arg(long)]
        fast: bool,
        /// Stops at the first step that fails.
        #[arg(long)]
        stop: bool,
    },
    /// Builds flashable images into target/firmware and holds them to their ceilings.
    Firmware {
        /// The board; all of them when not given.
        board: Option<Board>,
    },
    /// Writes the image to a board with probe-rs.
    Flash {
        /// The board.
        board: Board,
    },
    /// Writes EDS, DBC and the object table to docs/generated.
    Gen {
        /// Changes nothing, and fails when a file is stale.
        #[arg(long)]
        check: bool,
    },
    /// Runs a command beside a real vcan0 and ends with its exit status.
    Vcan {
        /// The command and its arguments.
        #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
        command: Vec<String>,
    },
    /// Looks with libFuzzer for inputs that break a promise (tests/fuzz).
    Fuzz {
        /// node, sdo, lss, stored or vertebra; all of them when not given.
        target: Option<String>,
        /// For how long each.
        #[arg(long, default_value_t = suite::FUZZ_SECONDS)]
        seconds: u64,
        /// Puts the inputs that are worth it into tests/fuzz/corpus, and looks for no new ones.
        #[arg(long)]
        minimise: bool,
        /// Runs this one input, without libFuzzer.
        #[arg(long, value_name = "FILE")]
        reproduce: Option<PathBuf>,
    },
    /// Installs what the tests need, or names what is missing and how to get it.
    Setup,
    /// Prints flash and RAM use of the images that were built last.
    Size,
    /// Fails when a panicking symbol is reachable from the logic crates on the target.
    Panics,
    /// Finds in the code how much stack both images can take, and fails above half of what there is.
    Stack,
    /// Prints which lines of the logic crates their own tests run, and fails below 95 %.
    Coverage,
    /// Proves with Gappa that the wrist's kernel never overflows, and how wrong it can be.
    ///
    /// The scripts stay in target/proofs.
    Proofs,
    /// Checks every single input of the fixed-point primitives, on all processors of this machine.
    Exhaustive,
    /// Counts the instructions of the wrist's kernel on Cortex-M4 and Cortex-M3 in QEMU, beside f32 with
    /// libm; weighs its flash, compares its errors, and hashes its answers on all machines. Then the
    /// instructions that each kind of frame costs the CANopen node, its flash and its RAM.
    Cycles {
        /// Prints JSON.
        #[arg(long)]
        json: bool,
        /// Fails when a median exceeds firmware/kinematics/budget.json by more than 2 %, when spread,
        /// flash, or the distance to f32 miss their bound, or the node firmware/canopen/budget.json.
        #[arg(long)]
        check: bool,
        /// Measures the CANopen node alone.
        #[arg(long)]
        node: bool,
    },
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Test { fast, stop } => suite::run_all(fast, stop),
        Task::Firmware { board } => firmware::build(board),
        Task::Flash { board } => firmware::flash(board),
        Task::Gen { check } => generated::run_generator(check),
        Task::Vcan { command } => match vcan::run(&command, &[]) {
            Ok(status) => return ExitCode::from(status),
            Err(error) => Err(error),
        },
        Task::Fuzz {
            target,
            reproduce: Some(input),
            ..
        } => fuzz::reproduce(target.as_deref(), &input),
        Task::Fuzz {
            target,
            seconds,
            minimise,
            reproduce: None,
        } => fuzz::run_targets(target.as_deref(), seconds, minimise),
        Task::Setup => setup::prepare(),
        Task::Size => firmware::print_sizes(),
        Task::Panics => panics::check(),
        Task::Stack => stack::check(),
        Task::Coverage => coverage::check(),
        Task::Exhaustive => exhaustive::check(),
        Task::Proofs => proofs::run(),
        Task::Cycles { json, check, node } => cycles::run(json, check, node),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
