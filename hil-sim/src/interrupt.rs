//! Ctrl-C: the first asks the run to end in order, the second ends the program.

use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Exit code of a program that Ctrl-C ended, as shells count it.
const INTERRUPT_CODE: i32 = 130;

/// Listens for Ctrl-C from now on.
///
/// # Errors
/// When the system refuses.
pub fn listen() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(INTERRUPT_CODE);
        }
    })
    .context("can't listen for Ctrl-C")
}

/// Tells whether Ctrl-C was pressed.
pub fn came() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}
