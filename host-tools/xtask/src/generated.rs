//! The files in docs/generated, which come from the object dictionary.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::process::{cargo, clean_root, run, target_dir};

/// Writes the files, or compares them with what would be written.
///
/// # Errors
/// When the generator fails, or a checked-in file differs from what it writes.
pub fn run_generator(check: bool) -> Result<()> {
    let kept = clean_root().join("docs/generated");
    if !check {
        return export(&kept);
    }
    let fresh = target_dir().join("generated");
    let _ = fs::remove_dir_all(&fresh);
    export(&fresh)?;
    let (old, new) = (read_all(&kept)?, read_all(&fresh)?);
    let stale: Vec<_> = old
        .keys()
        .chain(new.keys())
        .filter(|name| old.get(*name) != new.get(*name))
        .map(|name| name.display().to_string())
        .collect();
    if !stale.is_empty() {
        bail!(
            "stale in docs/generated: {}; run `cargo xtask gen`",
            stale.join(", ")
        );
    }
    println!("docs/generated: {} files are up to date", new.len());
    Ok(())
}

/// Calls the generator.
fn export(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder)?;
    let mut generator = cargo();
    generator.args([
        "run", "--quiet", "-p", "eel", "--", "export", "all", "--out",
    ]);
    run(generator.arg(folder))
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
