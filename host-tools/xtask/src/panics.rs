//! No panic can be reached from the logic crates: shown on the linked code.

use anyhow::{Result, ensure};

use crate::cross;
use crate::image::Image;
use crate::process::run;

/// Parts of mangled names that stand for a panic or for the text of one.
const FORBIDDEN: [&str; 7] = [
    "panicking",
    "panic_reached",
    "panic_bounds",
    "begin_unwind",
    "unwrap_failed",
    "expect_failed",
    "4core3fmt",
];

/// Links the logic crates alone and looks for panicking symbols.
///
/// # Errors
/// When the build fails, such a symbol is there, or the check could not have found one.
pub fn check() -> Result<()> {
    let logic = symbols("logic")?;
    let own = logic.iter().filter(|name| name.contains("eel_")).count();
    ensure!(
        own > 0,
        "the image holds nothing of the logic crates: the check proves nothing"
    );
    let found: Vec<_> = logic.iter().filter(|name| can_panic(name)).collect();

    // The image for QEMU can print and panic: the same search must find that there.
    let control = symbols("board-qemu")?
        .iter()
        .filter(|name| can_panic(name))
        .count();
    ensure!(
        control > 0,
        "no panicking symbol where there are some: the check proves nothing"
    );

    println!(
        "logic crates on the target: {} bytes, {own} symbols of theirs, {} that panic \
         (board-qemu, which may: {control})",
        Image::read(&cross::built("logic"))?.size()?.flash,
        found.len()
    );
    ensure!(found.is_empty(), "panicking symbols: {found:#?}");
    Ok(())
}

/// Builds a binary of board-qemu and returns its symbols.
fn symbols(binary: &str) -> Result<Vec<String>> {
    run(cross::build_command()?.args(["-p", "board-qemu", "--bin", binary]))?;
    Image::read(&cross::built(binary))?.symbols()
}

/// Tells whether a symbol belongs to a panic.
fn can_panic(symbol: &str) -> bool {
    FORBIDDEN.iter().any(|part| symbol.contains(part))
}
