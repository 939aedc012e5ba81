//! LLVM's tools, of the version that the compiler is made with.

use std::env;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::process::{self, command, output};
use crate::setup;

/// Finds one of LLVM's tools such as `llvm-objdump`, and installs it where that is possible.
///
/// # Errors
/// When it is missing and can't be had.
pub fn tool(name: &str) -> Result<PathBuf> {
    let major = major()?;
    if let Some(path) = find(name, &major) {
        return Ok(path);
    }
    let package = format!("llvm-{major}");
    if setup::can_use_apt() {
        setup::install_packages(&[&package])?;
    }
    let Some(path) = find(name, &major) else {
        bail!(
            "{name} of LLVM {major} is missing; on Debian: apt-get install {package}, \
             elsewhere: put {name}-{major} on the path"
        );
    };
    Ok(path)
}

/// Returns the major version of the compiler's LLVM.
fn major() -> Result<String> {
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    major_of(&output(command(rustc).arg("-vV"))?)
        .context("`rustc -vV` does not say which LLVM it is made with")
}

fn major_of(version: &str) -> Option<String> {
    let mut lines = version.lines();
    let number = lines.find_map(|line| line.strip_prefix("LLVM version: "))?;
    let major = number.split('.').next()?;
    major.parse::<u32>().ok().map(|major| major.to_string())
}

/// Finds a tool under its name with the version, or in the folder of the version's tools on Debian.
fn find(name: &str, major: &str) -> Option<PathBuf> {
    process::find(&format!("{name}-{major}")).or_else(|| {
        let path = Path::new("/usr/lib").join(format!("llvm-{major}/bin/{name}"));
        path.is_file().then_some(path)
    })
}

#[cfg(test)]
mod tests {
    use super::major_of;

    #[test]
    fn reads_which_llvm_a_compiler_is_made_with() {
        let version =
            "rustc 1.95.0 (59807616e 2026-04-14)\nrelease: 1.95.0\nLLVM version: 22.1.2\n";
        assert_eq!(major_of(version).as_deref(), Some("22"));
        assert_eq!(major_of("rustc 1.95.0\nrelease: 1.95.0"), None);
        assert_eq!(major_of("LLVM version: unknown"), None);
    }
}
