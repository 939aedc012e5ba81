//! Committed inputs: a file for each target, in which each line is one input in base64, as libFuzzer prints it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Returns the committed inputs of a target.
///
/// # Errors
/// When the file can't be read or a line is not base64.
pub fn load(target: &str) -> io::Result<Vec<Vec<u8>>> {
    let text = fs::read_to_string(path(target))?;
    text.lines()
        .map(|line| decode(line).ok_or_else(|| io::Error::other(format!("{line} is not base64"))))
        .collect()
}

/// Writes the committed inputs of a target to a folder, a file each, for libFuzzer to read.
///
/// # Errors
/// When a file can't be read or written.
pub fn unpack(target: &str, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    for (number, input) in load(target)?.iter().enumerate() {
        fs::write(folder.join(number.to_string()), input)?;
    }
    Ok(())
}

/// Commits the files of a folder as the inputs of a target and returns how many there are.
///
/// # Errors
/// When a file can't be read or written.
pub fn pack(target: &str, folder: &Path) -> io::Result<usize> {
    let mut lines = Vec::new();
    for entry in fs::read_dir(folder)? {
        lines.push(encode(&fs::read(entry?.path())?));
    }
    lines.sort();
    let mut text = lines.join("\n");
    text.push('\n');
    fs::write(path(target), text)?;
    Ok(lines.len())
}

fn path(target: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    folder.join(target).with_extension("txt")
}

/// Writes base64.
pub fn encode(data: &[u8]) -> String {
    let mut text = String::new();
    for group in data.chunks(3) {
        let mut bytes = [0; 4];
        bytes[1..=group.len()].copy_from_slice(group);
        let bits = u32::from_be_bytes(bytes);
        for place in 0..4 {
            if place <= group.len() {
                let digit = bits >> (18 - 6 * place) & 63;
                text.push(char::from(DIGITS[digit as usize]));
            } else {
                text.push('=');
            }
        }
    }
    text
}

/// Reads base64; `None` where it is none.
pub fn decode(text: &str) -> Option<Vec<u8>> {
    let (mut bytes, mut bits, mut held) = (Vec::new(), 0_u32, 0);
    for digit in text.trim().trim_end_matches('=').bytes() {
        let value = DIGITS.iter().position(|known| *known == digit)?;
        bits = bits << 6 | value as u32;
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::{decode, encode};

    #[test]
    fn base64_is_what_a_fuzzer_prints() {
        assert_eq!(encode(&[0x7F]), "fw==");
        assert_eq!(decode("brAL"), Some(vec![0x6E, 0xB0, 0x0B]));
        assert_eq!(decode("fw-="), None);
        for length in 0..40 {
            let data: Vec<u8> = (0..length).map(|at: u8| at.wrapping_mul(37)).collect();
            assert_eq!(decode(&encode(&data)), Some(data));
        }
    }
}
