//! What is in a linked image: memory use, the bytes to flash, symbols.

use std::fs;
use std::ops::Range;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};
use object::{Endianness, Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

/// Flash for programs of both boards: bank 1 here, half of 512 KB, where the STM32F405 in QEMU has 1 MB.
pub const FLASH: Range<u64> = 0x0800_0000..0x0804_0000;
/// Static RAM of both boards that is one piece: 96 KB here.
pub const RAM: Range<u64> = 0x2000_0000..0x2001_8000;

/// One stretch of bytes and where it is flashed.
struct Segment {
    address: u64,
    bytes: Vec<u8>,
}

/// How much of the two memories an image takes, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Code, constants and the initial values of variables.
    pub flash: u64,
    /// Variables; the stack has the rest of the RAM.
    pub ram: u64,
}

/// A linked image for a 32-bit little-endian target.
pub struct Image {
    bytes: Vec<u8>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// When the file can't be read.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = fs::read(path).with_context(|| format!("could not read {}", path.display()))?;
        Ok(Self { bytes })
    }

    /// Returns the memory use.
    ///
    /// # Errors
    /// When the ELF file is malformed.
    pub fn size(&self) -> Result<Size> {
        let flash = self
            .segments()?
            .iter()
            .map(|segment| segment.bytes.len() as u64)
            .sum();
        let file = object::File::parse(self.bytes.as_slice())?;
        let ram = file
            .sections()
            .filter(|section| RAM.contains(&section.address()))
            .filter(|section| section.kind() != SectionKind::Metadata)
            .map(|section| section.size())
            .sum();
        Ok(Size { flash, ram })
    }

    /// Returns the bytes to flash, from the first address of the flash on; gaps are erased flash.
    ///
    /// # Errors
    /// When the ELF file is malformed or has something to load outside the flash.
    pub fn to_binary(&self) -> Result<Vec<u8>> {
        let mut binary = Vec::new();
        for segment in self.segments()? {
            let start = usize::try_from(segment.address - FLASH.start)?;
            let end = start + segment.bytes.len();
            if binary.len() < end {
                binary.resize(end, 0xFF);
            }
            binary[start..end].copy_from_slice(&segment.bytes);
        }
        ensure!(!binary.is_empty(), "nothing to flash");
        Ok(binary)
    }

    /// Returns the mangled names of all symbols.
    ///
    /// # Errors
    /// When the ELF file is malformed.
    pub fn symbols(&self) -> Result<Vec<String>> {
        let file = object::File::parse(self.bytes.as_slice())?;
        Ok(file
            .symbols()
            .filter_map(|symbol| symbol.name().ok().map(str::to_owned))
            .collect())
    }

    /// Returns the mangled names of all functions with the bytes that each takes.
    ///
    /// # Errors
    /// When the ELF file is malformed.
    pub fn functions(&self) -> Result<Vec<(String, u64)>> {
        let file = object::File::parse(self.bytes.as_slice())?;
        let functions = file
            .symbols()
            .filter(|symbol| symbol.kind() == SymbolKind::Text);
        Ok(functions
            .filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), symbol.size())))
            .collect())
    }

    /// Returns what is loaded, by its address in flash.
    fn segments(&self) -> Result<Vec<Segment>> {
        let header = FileHeader32::<Endianness>::parse(self.bytes.as_slice())?;
        let endian = header.endian()?;
        let mut segments = Vec::new();
        for program in header.program_headers(endian, self.bytes.as_slice())? {
            let bytes = program
                .data(endian, self.bytes.as_slice())
                .map_err(|()| anyhow::anyhow!("a segment lies outside the file"))?;
            if program.p_type(endian) != PT_LOAD || bytes.is_empty() {
                continue;
            }
            let address = u64::from(program.p_paddr(endian));
            let end = address + bytes.len() as u64;
            ensure!(
                FLASH.contains(&address) && end <= FLASH.end,
                "a segment at {address:#010x}..{end:#010x} is outside the flash"
            );
            segments.push(Segment {
                address,
                bytes: bytes.to_vec(),
            });
        }
        Ok(segments)
    }
}
