//! No panic can be reached from the logic crates: shown on the linked code.

use anyhow::{Result, bail};

use crate::cross;
use crate::image::Image;
use crate::process::run;

/// Parts of mangled names that stand for a panic or for the text of one.
const FORBIDDEN: [&str; 5] = [
    "panicking",
    "unwrap_failed",
    "expect_failed",
    "4core3fmt",
    "panic_bounds",
];

/// Links the logic crates alone and looks for panicking symbols.
///
/// # Errors
/// When the build fails or such a symbol is there.
pub fn check() -> Result<()> {
    run(cross::build_command()?.args(["-p", "board-qemu", "--bin", "logic"]))?;
    let image = Image::read(&cross::built("logic"))?;
    let symbols = image.symbols()?;
    let turns = symbols.iter().filter(|name| name.contains("eel_")).count();
    if turns == 0 {
        bail!("the image holds nothing of the logic crates: the check would prove nothing");
    }
    let found: Vec<_> = symbols
        .iter()
        .filter(|name| FORBIDDEN.iter().any(|part| name.contains(part)))
        .collect();
    println!(
        "logic crates on the target: {} bytes, {turns} symbols of theirs, {} that panic",
        image.size()?.flash,
        found.len()
    );
    if !found.is_empty() {
        bail!("panicking symbols: {found:#?}");
    }
    Ok(())
}
