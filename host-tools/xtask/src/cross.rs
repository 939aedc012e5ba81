//! A toolchain for the Cortex-M4F and the Cortex-M3, wherever one can be had.
//!
//! The first that holds: the target is installed; Debian's own compiler with its library's source;
//! rustup can fetch the target.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::process::{self, clean_root, command, output, target_dir};
use crate::setup;

/// The target of every image: Cortex-M4 with single-precision floating point.
pub const TARGET: &str = "thumbv7em-none-eabihf";
/// The target that is only measured: Cortex-M3, without the DSP instructions and without floats.
pub const CORTEX_M3: &str = "thumbv7m-none-eabi";

const DEBIAN_CARGO: &str = "/usr/bin/cargo";
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_LIBRARY: &str = "/usr/lib/rustlib/src/rust/library/core/Cargo.toml";

/// Where the compiler comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Toolchain {
    /// The toolchain that runs this program has the target.
    Installed,
    /// Debian's compiler, which builds its `core` from source.
    Debian,
}

/// Starts a cross `cargo build` of one package with the profile that is flashed.
///
/// # Errors
/// When there is no toolchain and none can be had.
pub fn build_command() -> Result<Command> {
    build_command_for(TARGET)
}

/// Starts a cross build as [`build_command`] does, for a target that is named.
///
/// # Errors
/// When there is no toolchain and none can be had.
pub fn build_command_for(target: &str) -> Result<Command> {
    let variable = target.to_uppercase().replace('-', "_");
    let mut build = match choose(target)? {
        Toolchain::Installed => {
            let mut build = process::cargo();
            build.arg("build");
            build
        }
        Toolchain::Debian => {
            let mut build = command(DEBIAN_CARGO);
            build.args([
                "build",
                "-Zbuild-std=core",
                "--config",
                "build.rustc-wrapper=''",
            ]);
            build.env("RUSTC", DEBIAN_RUSTC);
            build.env(format!("CARGO_TARGET_{variable}_LINKER"), linker()?);
            build
        }
    };
    // For the core library's build and for the sizes of stack frames, see `rust_flags`.
    build.env("RUSTC_BOOTSTRAP", "1");
    build.args(["--profile", "firmware", "--target", target]);
    // Of their own, or host and cross builds would make each other stale.
    build.arg("--target-dir").arg(cross_dir());
    build.env(
        format!("CARGO_TARGET_{variable}_RUSTFLAGS"),
        rust_flags(target),
    );
    for variable in [
        "RUSTFLAGS",
        "CARGO_ENCODED_RUSTFLAGS",
        "CARGO_BUILD_TARGET",
        "CARGO",
    ] {
        build.env_remove(variable);
    }
    Ok(build)
}

/// Returns the target folder of cross builds.
pub fn cross_dir() -> PathBuf {
    target_dir().join("cross")
}

/// Returns where the linked image of a binary is.
pub fn built(binary: &str) -> PathBuf {
    built_for(TARGET, binary)
}

/// Returns where the linked image of a binary is for a target that is named.
pub fn built_for(target: &str, binary: &str) -> PathBuf {
    cross_dir().join(target).join("firmware").join(binary)
}

/// Chooses the toolchain, and installs what it takes where that is possible.
fn choose(target: &str) -> Result<Toolchain> {
    if host_sysroot()?.join("lib/rustlib").join(target).is_dir() {
        return Ok(Toolchain::Installed);
    }
    if has_debian_toolchain() {
        return Ok(Toolchain::Debian);
    }
    if setup::can_use_apt() {
        setup::install_packages(&["rustc-web", "cargo-web", "rust-web-src"])?;
        if has_debian_toolchain() {
            return Ok(Toolchain::Debian);
        }
    }
    eprintln!("no compiler for {target}: running `rustup target add {target}`");
    process::run(command("rustup").args(["target", "add", target]))
        .with_context(|| format!("the images need the target {target}"))?;
    Ok(Toolchain::Installed)
}

/// Tells whether Debian's compiler is there with its library's source, and new enough.
fn has_debian_toolchain() -> bool {
    let files = [DEBIAN_CARGO, DEBIAN_RUSTC, DEBIAN_LIBRARY];
    if !files.iter().all(|path| Path::new(path).is_file()) {
        return false;
    }
    let version = output(command(DEBIAN_RUSTC).arg("--version")).unwrap_or_default();
    let mut numbers = version
        .split([' ', '.'])
        .skip(1)
        .filter_map(|word| word.parse::<u32>().ok());
    (numbers.next(), numbers.next()) >= (Some(1), Some(95))
}

/// Returns the folder of the toolchain that runs this program.
fn host_sysroot() -> Result<PathBuf> {
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    Ok(output(command(rustc).args(["--print", "sysroot"]))?
        .trim()
        .into())
}

/// Finds the linker that rustup ships with every toolchain, or another LLVM linker.
fn linker() -> Result<PathBuf> {
    let folder = host_sysroot()?.join("lib/rustlib");
    let hosts = fs::read_dir(&folder).with_context(|| format!("no {}", folder.display()))?;
    let shipped = hosts
        .filter_map(Result::ok)
        .map(|host| host.path().join("bin/rust-lld"))
        .find(|candidate| candidate.is_file());
    match shipped.or_else(|| process::find("ld.lld")) {
        Some(path) => Ok(path),
        None => bail!("neither rust-lld nor ld.lld found: install rustup's stable toolchain"),
    }
}

/// Returns compiler flags for the processor that the target stands for, and such that take the
/// build's folders out of the image.
///
/// LLVM's scheduler is off: it moves multiplications ahead of their use for a processor that would
/// gain by it, and pays with a spilled register each. The order of the source is the better one.
///
/// Each function's stack frame goes into a section that is not loaded, for `cargo xtask stack`.
fn rust_flags(target: &str) -> String {
    let processor = if target == CORTEX_M3 {
        "cortex-m3"
    } else {
        "cortex-m4"
    };
    let home = env::var("HOME").unwrap_or_else(|_| "/root".into());
    let cargo = env::var("CARGO_HOME").unwrap_or_else(|_| format!("{home}/.cargo"));
    format!(
        "-Ctarget-cpu={processor} -Cllvm-args=-enable-misched=false -Zemit-stack-sizes \
         --remap-path-prefix={}=anguilla --remap-path-prefix={cargo}=cargo",
        clean_root().display()
    )
}
