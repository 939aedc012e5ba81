//! Every input of every primitive, against double precision.

use anyhow::Result;

use crate::process::{cargo, run};

/// Checks all inputs on all processors of this machine, and prints the worst errors and the seconds.
///
/// # Errors
/// When an error exceeds its bound.
pub fn check() -> Result<()> {
    let arguments = [
        "test",
        "--release",
        "--package",
        "eel-units",
        "--test",
        "exhaustive",
        "--",
        "--ignored",
        "--nocapture",
        // One after the other, as each takes all processors.
        "--test-threads=1",
    ];
    run(cargo().args(arguments))
}
