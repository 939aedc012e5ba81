//! What the wrist's kernel costs on the target, and how exact it is: `cargo xtask cycles` runs it.
//!
//! In QEMU the image prints, tab-separated, the ticks of each measured call for each pose, after a
//! line of names. On the host the same program prints the largest errors of the kernel and of single
//! precision.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod case;
#[cfg(target_os = "none")]
mod console;
#[cfg(not(target_os = "none"))]
mod errors;
#[cfg_attr(
    not(target_os = "none"),
    expect(dead_code, reason = "margins and sharing are compared in the image")
)]
mod floating;
#[cfg(target_os = "none")]
mod measure;
mod numbers;
#[cfg(target_os = "none")]
mod stopwatch;

/// Prints the errors.
#[cfg(not(target_os = "none"))]
fn main() {
    match errors::measure() {
        Some(errors) => print!("{errors}"),
        None => {
            eprintln!("a pose of the workspace has no answer");
            std::process::exit(1);
        }
    }
}
