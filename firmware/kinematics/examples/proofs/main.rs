//! Writes a Gappa script for each stage of the kernel: that nothing overflows, and how wrong it is.
//!
//! `cargo xtask proofs` runs it and then Gappa. The kernel's own source is a part of this program, so that
//! its limits and constants, private in the crate, are the ones that are proven.

use std::fmt::Write;
use std::path::PathBuf;
use std::{env, fs, io};

#[path = "../../../units/src/coefficients.rs"]
#[rustfmt::skip]
#[allow(dead_code, reason = "not all of it is of the kernel")]
mod coefficients;
#[path = "../../src/design/mod.rs"]
#[allow(dead_code, unused_imports, reason = "a part of it is used here")]
pub mod design;
#[path = "../../src/direct.rs"]
#[allow(dead_code, reason = "a part of it is used here")]
mod direct;
#[cfg(test)]
mod evaluate;
mod geometry;
#[path = "../../src/inverse.rs"]
#[allow(dead_code, reason = "a part of it is used here")]
mod inverse;
#[path = "../../src/jacobian.rs"]
#[allow(dead_code, reason = "a part of it is used here")]
mod jacobian;
mod minimax;
#[path = "../../src/pose.rs"]
#[allow(dead_code, reason = "a part of it is used here")]
mod pose;
#[path = "../../src/reach.rs"]
#[allow(dead_code, reason = "a part of it is used here")]
mod reach;
#[path = "../../src/rotation.rs"]
#[allow(clippy::wrong_self_convention, reason = "the crate exports it so")]
#[allow(dead_code, reason = "a part of it is used here")]
mod rotation;
mod script;
#[path = "../../src/share.rs"]
#[allow(dead_code, reason = "a part of it is used here")]
mod share;
mod stages;
#[cfg(test)]
mod tests;
mod trace;
#[path = "../../src/vector.rs"]
#[allow(dead_code, reason = "a part of it is used here")]
mod vector;
#[path = "../../src/wrist.rs"]
#[allow(dead_code, reason = "a part of it is used here")]
mod wrist;

// What the crate's root has.
use share::Side;

/// Writes the scripts into the folder given, and their list: file, stage, claim, bound.
fn main() -> io::Result<()> {
    let folder = PathBuf::from(env::args().nth(1).unwrap_or_else(|| ".".to_owned()));
    fs::create_dir_all(&folder)?;
    let mut list = String::new();
    for script in stages::scripts() {
        fs::write(folder.join(script.file).with_extension("g"), script.text())?;
        let claims: Vec<_> = script
            .claims
            .iter()
            .map(|(what, bound)| format!("{what}\t{bound:.2e}"))
            .collect();
        let _ = writeln!(
            list,
            "{}\t{}\t{}",
            script.file,
            script.stage,
            claims.join("\t")
        );
    }
    fs::write(folder.join("list.tsv"), list)
}
