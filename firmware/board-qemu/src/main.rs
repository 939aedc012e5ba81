//! The same vertebra on a Cortex-M4 in QEMU (`-M netduinoplus2`), in lock-step with a world outside.
//!
//! The image reads packets of [`eel_vertebra::lockstep`] from the file or pipe `lockstep.in` in
//! QEMU's folder and writes its answers to `lockstep.out`, over semihosting; at the end of the input
//! it says how many instructions its turns took and leaves. It has no clock, no bus and no plant of
//! its own, and decides nothing.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod console;
#[cfg(target_os = "none")]
mod image;
#[cfg(target_os = "none")]
mod meter;
#[cfg(target_os = "none")]
mod pipe;
#[cfg(target_os = "none")]
mod stopwatch;

/// Says what to do: the image only runs in QEMU.
#[cfg(not(target_os = "none"))]
fn main() {
    println!("cargo xtask firmware qemu && cargo test -p eel-tests --test qemu");
}
