//! `eel export`: the dictionary as files of other tools.

mod grammar;

use std::fs;
use std::io::Write as _;
use std::path::Path;

use anyhow::{Context, Result};
use eel_protocol::export::{write_dbc, write_eds, write_markdown};

/// A file that can be exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Electronic data sheet, for CANopen tools
    Eds,
    /// CAN database, for decoders
    Dbc,
    /// Tables in markdown, for people
    Md,
    /// The electronic data sheet as vertebrae carry it, compressed
    Carried,
    /// EDS, DBC and tables, into the folder given with --out
    All,
}

impl Format {
    /// Every single file.
    const EACH: [Self; 3] = [Self::Eds, Self::Dbc, Self::Md];

    const fn file_name(self) -> &'static str {
        match self {
            Self::Eds => "vertebra.eds",
            Self::Dbc => "vertebra.dbc",
            Self::Carried => "vertebra.grammar",
            Self::Md | Self::All => "dictionary.md",
        }
    }

    fn bytes(self) -> Result<Vec<u8>> {
        let mut text = String::new();
        match self {
            Self::Eds | Self::Carried => write_eds(&mut text)?,
            Self::Dbc => write_dbc(&mut text)?,
            Self::Md | Self::All => write_markdown(&mut text)?,
        }
        match self {
            Self::Carried => grammar::compress(text.as_bytes()),
            _ => Ok(text.into_bytes()),
        }
    }
}

/// Writes one format to standard output or to a file, or all into a folder.
///
/// # Errors
/// When something can't be written.
pub fn export(format: Format, out: Option<&Path>) -> Result<()> {
    match (format, out) {
        (Format::All, out) => {
            let folder = out.unwrap_or(Path::new("."));
            fs::create_dir_all(folder)
                .with_context(|| format!("can't make {}", folder.display()))?;
            Format::EACH
                .into_iter()
                .try_for_each(|format| write(format, &folder.join(format.file_name())))
        }
        (_, Some(path)) => write(format, path),
        (_, None) => Ok(std::io::stdout().write_all(&format.bytes()?)?),
    }
}

fn write(format: Format, path: &Path) -> Result<()> {
    fs::write(path, format.bytes()?).with_context(|| format!("can't write {}", path.display()))
}
