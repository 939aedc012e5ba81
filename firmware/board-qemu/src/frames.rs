//! What frames cost the CANopen node on the target: `cargo xtask cycles` runs it.
//!
//! In QEMU the image prints, tab-separated, the ticks that the node takes for one frame or one tick
//! of each kind, in the heaviest state that was found for it.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod console;
#[cfg(target_os = "none")]
mod cost;
#[cfg(target_os = "none")]
mod costs;
#[cfg(target_os = "none")]
mod stopwatch;
#[cfg(target_os = "none")]
mod transfers;
#[cfg(target_os = "none")]
mod values;

/// Says what to do: the image only runs in QEMU.
#[cfg(not(target_os = "none"))]
fn main() {
    println!("cargo xtask cycles");
}
