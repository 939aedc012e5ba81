//! The images: built, measured, flashed.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};
use clap::ValueEnum;

use crate::cross;
use crate::image::{FLASH, Image, RAM, Size};
use crate::process::{self, clean_root, command, run};

/// A board that an image is built for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// The vertebra's own board.
    Stm32g474,
    /// QEMU's `netduinoplus2`, a Cortex-M4 with the same memory map.
    Qemu,
}

impl Board {
    /// Every board.
    pub const ALL: [Self; 2] = [Self::Stm32g474, Self::Qemu];

    /// Returns the package, which is also the name of its binary.
    pub const fn package(self) -> &'static str {
        match self {
            Self::Stm32g474 => "board-stm32g474",
            Self::Qemu => "board-qemu",
        }
    }

    /// Returns the most that the image may take.
    const fn ceiling(self) -> Size {
        match self {
            Self::Stm32g474 => Size {
                flash: 128 * 1024,
                ram: 32 * 1024,
            },
            Self::Qemu => Size {
                flash: FLASH.end - FLASH.start,
                ram: (RAM.end - RAM.start) / 2,
            },
        }
    }

    /// Returns where the image is put, without an extension.
    fn artifact(self) -> PathBuf {
        clean_root().join("target/firmware").join(self.package())
    }

    /// Returns the finished ELF file.
    pub fn elf(self) -> PathBuf {
        self.artifact().with_extension("elf")
    }
}

/// Builds one board's image or all of them, and holds each to its ceiling.
///
/// # Errors
/// When a build fails or an image is too large.
pub fn build(board: Option<Board>) -> Result<()> {
    let boards = board.map_or_else(|| Board::ALL.to_vec(), |board| vec![board]);
    for board in boards {
        let package = board.package();
        run(cross::build_command()?.args(["-p", package, "--bin", package]))?;
        let image = Image::read(&cross::built(package))?;
        let folder = clean_root().join("target/firmware");
        fs::create_dir_all(&folder)?;
        fs::copy(cross::built(package), board.elf()).context("could not copy the image")?;
        fs::write(board.artifact().with_extension("bin"), image.to_binary()?)?;
        print_size(board)?;
    }
    Ok(())
}

/// Prints what the images take that were built last.
///
/// # Errors
/// When none was built, or one is too large.
pub fn print_sizes() -> Result<()> {
    let built: Vec<_> = Board::ALL
        .into_iter()
        .filter(|board| board.elf().is_file())
        .collect();
    ensure!(
        !built.is_empty(),
        "no image yet: run `cargo xtask firmware`"
    );
    built.into_iter().try_for_each(print_size)
}

/// Prints what one image takes, and fails above the ceiling.
fn print_size(board: Board) -> Result<()> {
    let size = Image::read(&board.elf())?.size()?;
    let ceiling = board.ceiling();
    println!(
        "{}: flash {} of {} bytes, RAM {} of {} bytes ({})",
        board.package(),
        size.flash,
        ceiling.flash,
        size.ram,
        ceiling.ram,
        board.elf().display()
    );
    if size.flash > ceiling.flash || size.ram > ceiling.ram {
        bail!("the image of {} is too large", board.package());
    }
    Ok(())
}

/// Builds the image and writes it to the board on the probe.
///
/// # Errors
/// When the board has no flash to write, probe-rs is missing, or the probe fails.
pub fn flash(board: Board) -> Result<()> {
    ensure!(
        board == Board::Stm32g474,
        "only stm32g474 can be flashed; QEMU runs its image as is"
    );
    let Some(probe) = process::find("probe-rs") else {
        bail!(
            "probe-rs is missing. Get it with `cargo install probe-rs-tools --locked`, or see \
             https://probe.rs/docs/getting-started/installation/"
        );
    };
    build(Some(board))?;
    run(command(probe)
        .args(["run", "--chip", "STM32G474RETx"])
        .arg(board.elf()))
}
