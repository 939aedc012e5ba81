//! What the wrist's kernel costs and gives on the target: `cargo xtask cycles` runs it.
//!
//! In QEMU the image prints, tab-separated, the ticks of each measured call for each pose, after a
//! line of names, and then the hash of its answers. The same program on the host prints the hash
//! alone, which must be the same.
#![cfg_attr(target_os = "none", no_std, no_main)]

mod answers;
#[cfg(target_os = "none")]
mod console;
#[cfg(target_os = "none")]
mod floating;
#[cfg(target_os = "none")]
mod measure;
#[cfg(target_os = "none")]
mod stopwatch;

/// Prints the hash of the same answers as the image computes.
#[cfg(not(target_os = "none"))]
fn main() {
    println!("hash\t{:016x}", answers::hash());
}
