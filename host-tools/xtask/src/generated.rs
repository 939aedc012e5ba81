//! The files that come from the object dictionary: those in docs/generated, and the data sheet that
//! vertebrae carry.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::process::{cargo, clean_root, run, target_dir};

/// The compressed data sheet, part of `eel-protocol`'s source.
const CARRIED: &str = "firmware/protocol/src/eds/vertebra.grammar";

/// Writes the files, or compares them with what would be written.
///
/// # Errors
/// When the generator fails, or a checked-in file differs from what it writes.
pub fn run_generator(check: bool) -> Result<()> {
    let kept = clean_root().join("docs/generated");
    let carried = clean_root().join(CARRIED);
    if !check {
        export("all", &kept)?;
        return export("carried", &carried);
    }
    let fresh = target_dir().join("generated");
    let _ = fs::remove_dir_all(&fresh);
    fs::create_dir_all(&fresh)?;
    let again = target_dir().join("vertebra.grammar");
    export("all", &fresh)?;
    export("carried", &again)?;
    let (old, new) = (read_all(&kept)?, read_all(&fresh)?);
    let mut stale: Vec<_> = old
        .keys()
        .chain(new.keys())
        .filter(|name| old.get(*name) != new.get(*name))
        .map(|name| format!("docs/generated/{}", name.display()))
        .collect();
    if fs::read(&carried).ok() != Some(fs::read(&again)?) {
        stale.push(CARRIED.to_owned());
    }
    if !stale.is_empty() {
        bail!("stale: {}; run `cargo xtask gen`", stale.join(", "));
    }
    println!(
        "docs/generated and {CARRIED}: {} files are up to date",
        new.len() + 1
    );
    Ok(())
}

/// Calls the generator.
fn export(format: &str, out: &Path) -> Result<()> {
    let mut generator = cargo();
    generator.args([
        "run", "--quiet", "-p", "eel", "--", "export", format, "--out",
    ]);
    run(generator.arg(out))
}

/// Reads every file of a folder, which holds no folders.
fn read_all(folder: &Path) -> Result<BTreeMap<PathBuf, Vec<u8>>> {
    let entries = fs::read_dir(folder).with_context(|| format!("no {}", folder.display()))?;
    let mut files = BTreeMap::new();
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().into();
        files.insert(name, fs::read(&path)?);
    }
    Ok(files)
}
