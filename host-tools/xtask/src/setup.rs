//! The tools around the project: found, installed, or named with where to get them.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::process::{self, clean_root, command, is_ci, is_root, root, run};

/// A tool, and where it comes from.
struct Tool {
    /// What it is needed for.
    purpose: &'static str,
    /// A program on the path, or a file, that shows that it is there.
    witness: &'static str,
    /// Debian's package.
    package: &'static str,
}

/// What the tests need beyond cargo and the cross compiler.
const TOOLS: [Tool; 10] = [
    Tool {
        purpose: "running images",
        witness: "qemu-system-arm",
        package: "qemu-system-arm",
    },
    Tool {
        purpose: "proofs of the kernel",
        witness: "gappa",
        package: "gappa",
    },
    Tool {
        purpose: "libFuzzer",
        witness: "c++",
        package: "g++",
    },
    Tool {
        purpose: "a vcan0",
        witness: "ip",
        package: "iproute2",
    },
    Tool {
        purpose: "reading a vcan0",
        witness: "candump",
        package: "can-utils",
    },
    Tool {
        purpose: "dissecting recordings",
        witness: "tshark",
        package: "tshark",
    },
    Tool {
        purpose: "a vcan0 without root",
        witness: "linux.uml",
        package: "user-mode-linux",
    },
    Tool {
        purpose: "loading modules",
        witness: "insmod",
        package: "kmod",
    },
    Tool {
        purpose: "Python tests",
        witness: "python3",
        package: "python3",
    },
    Tool {
        purpose: "Python environments",
        witness: "/usr/share/doc/python3-venv",
        package: "python3-venv",
    },
];

/// A CANopen client from the Rust registry, which knows nothing of this project.
struct Peer {
    package: &'static str,
    version: &'static str,
    program: &'static str,
}

/// Clients that the vertebrae are tested with.
const PEERS: [Peer; 2] = [
    Peer {
        package: "canopen-cli",
        version: "0.6.1",
        program: "canopen",
    },
    Peer {
        package: "zencan-cli",
        version: "0.0.5",
        program: "zencan-cli",
    },
];

/// Installs what is missing, or names it.
///
/// # Errors
/// When an installation fails, and in CI when something is missing.
pub fn prepare() -> Result<()> {
    let missing: Vec<_> = TOOLS.iter().filter(|tool| !tool.is_there()).collect();
    if !missing.is_empty() && can_use_apt() {
        let packages: Vec<_> = missing.iter().map(|tool| tool.package).collect();
        install_packages(&packages)?;
    }
    let mut lacking = 0;
    for tool in TOOLS.iter().filter(|tool| !tool.is_there()) {
        lacking += 1;
        println!(
            "missing: {} (for {}); on Debian: apt-get install {}",
            tool.witness, tool.purpose, tool.package
        );
    }
    if let Err(error) = make_python() {
        lacking += 1;
        println!("missing: a Python environment ({error:#})");
    }
    for peer in &PEERS {
        if let Err(error) = peer.prepare() {
            lacking += 1;
            println!("missing: {} ({error:#})", peer.program);
        }
    }
    if lacking > 0 && is_ci() {
        bail!("{lacking} tools are missing, which is a failure where CI is set");
    }
    if lacking == 0 {
        println!("every tool is there");
    }
    Ok(())
}

impl Tool {
    /// Tells whether the tool is there.
    fn is_there(&self) -> bool {
        if self.witness.starts_with('/') {
            // Elsewhere than on Debian, Python brings its own environments.
            return Path::new(self.witness).exists()
                || process::succeeds(command("python3").args(["-c", "import venv, ensurepip"]));
        }
        process::find(self.witness).is_some()
    }
}

impl Peer {
    /// Builds the client into target/peers, where it is not there yet in this version.
    fn prepare(&self) -> Result<()> {
        let folder = clean_root().join("target/peers");
        let Self {
            package,
            version,
            program,
        } = self;
        let installed = fs::read_to_string(folder.join(".crates.toml")).unwrap_or_default();
        let is_named = installed.contains(&format!("\"{package} {version} "));
        if is_named && folder.join("bin").join(program).is_file() {
            return Ok(());
        }
        println!("building {package} {version}");
        // In a hurry: its speed does not matter, and half the time goes into optimising it.
        run(process::cargo()
            .args(["install", package, "--version", version, "--locked"])
            .args(["--quiet", "--debug", "--force", "--bin", program, "--root"])
            .arg(&folder)
            .env("CARGO_PROFILE_DEV_DEBUG", "0")
            .env("CARGO_TARGET_DIR", folder.join("build")))?;
        fs::remove_dir_all(folder.join("build"))?;
        Ok(())
    }
}

/// Tells whether packages can be installed: root, on Debian or a system like it.
pub fn can_use_apt() -> bool {
    process::find("apt-get").is_some() && is_root()
}

/// Installs Debian packages, reading the package lists anew when the first try fails.
///
/// # Errors
/// When apt-get fails.
pub fn install_packages(packages: &[&str]) -> Result<()> {
    println!("installing {}", packages.join(" "));
    if install(packages).is_err() {
        run(apt().args(["update", "-q"]))?;
        install(packages)?;
    }
    Ok(())
}

/// Installs Debian packages.
fn install(packages: &[&str]) -> Result<()> {
    run(apt()
        .args(["install", "-y", "-q", "--no-install-recommends"])
        .args(packages))
}

/// Starts apt-get such that it asks nothing.
fn apt() -> std::process::Command {
    let mut apt = command("apt-get");
    apt.env("DEBIAN_FRONTEND", "noninteractive");
    apt
}

/// Returns the Python of the tests' environment.
pub fn python() -> PathBuf {
    venv().join("bin/python")
}

/// Returns the folder of the tests' environment, which has cargo-fuzz and cargo-llvm-cov too.
pub fn venv() -> PathBuf {
    clean_root().join("target/venv")
}

/// Makes the Python environment that tests/python/requirements.txt asks for.
fn make_python() -> Result<()> {
    let wanted = clean_root().join("tests/python/requirements.txt");
    let requirements = fs::read(&wanted).with_context(|| format!("no {}", wanted.display()))?;
    let folder = root().join("target/venv");
    let stamp = folder.join("requirements.txt");
    if python().is_file() && fs::read(&stamp).is_ok_and(|installed| installed == requirements) {
        return Ok(());
    }
    run(command("python3").args(["-m", "venv", "target/venv"]))?;
    run(command(python())
        .args(["-m", "pip", "install", "--quiet", "-r"])
        .arg(&wanted))?;
    fs::write(stamp, requirements)?;
    Ok(())
}
