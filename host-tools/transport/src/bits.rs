//! How long a frame keeps the bus busy, counted in bits.
//!
//! The length follows from the bits themselves (ISO 11898-1): start of frame to CRC sequence with
//! the stuff bits that they need, then the fixed tail. A table of 8 stuffing states by 256 byte
//! values and a CRC table take the frame a byte at a time. Error and overload frames are absent.

use eel_protocol::Frame;

/// Bits between two frames: the intermission.
pub const INTERFRAME_BITS: u32 = 3;
/// Bits after the CRC sequence without stuffing: CRC delimiter, acknowledge slot and delimiter,
/// end of frame.
pub const TAIL_BITS: u32 = 10;

/// Polynomial of CAN's CRC-15 without its highest term (ISO 11898-1).
const CRC_POLYNOMIAL: u16 = 0x4599;
/// Bits from start of frame to the length code, of an 11-bit and a 29-bit identifier.
const HEADER_BITS: [u32; 2] = [19, 39];

/// Returns the exact length of a frame on the wire in bit times, 47–160: start of frame to end of
/// frame with its stuff bits, and the three bits of interframe space that follow.
#[inline]
pub fn frame_bits(frame: &Frame) -> u32 {
    let data = frame.data();
    let (header, pad_bits, stuffed_pad, bytes) = header(frame);
    let mut crc = 0u16;
    let mut state = START_STATE;
    let mut stuff = 0u32;
    let padded = header | stuffed_pad;
    let first = 8 - bytes;
    for (plain, stuffed) in header
        .to_be_bytes()
        .iter()
        .zip(padded.to_be_bytes().iter())
        .skip(first)
    {
        crc = crc_byte(crc, *plain);
        (state, stuff) = stuff_byte(state, stuff, *stuffed);
    }
    for byte in data {
        crc = crc_byte(crc, *byte);
        (state, stuff) = stuff_byte(state, stuff, *byte);
    }
    // One bit fills the CRC up to two bytes: the complement of its last, which can't end a run.
    let tail = (crc << 1) | (!crc & 1);
    for byte in tail.to_be_bytes() {
        (state, stuff) = stuff_byte(state, stuff, byte);
    }
    let content = bytes as u32 * 8 - pad_bits + data.len() as u32 * 8 + 15;
    content + stuff + TAIL_BITS + INTERFRAME_BITS
}

/// Returns the bound on the length of a frame with an 11-bit identifier and `length` bytes (at most
/// 8) in bit times, interframe space included: 135 of 8 bytes.
///
/// Source: Davis, Burns, Bril, Lukkien, "Controller Area Network (CAN) schedulability analysis",
/// Real-Time Systems 35 (2007), equation 1.
pub const fn frame_bits_max(length: u8) -> u32 {
    bound(34, length)
}

/// Returns the bound like [`frame_bits_max`] for a 29-bit identifier: 160 of 8 bytes.
pub const fn frame_bits_max_extended(length: u8) -> u32 {
    bound(54, length)
}

const fn bound(header_and_crc: u32, length: u8) -> u32 {
    let length = if length > 8 { 8 } else { length as u32 };
    let stuffed = header_and_crc + 8 * length;
    stuffed + TAIL_BITS + INTERFRAME_BITS + (stuffed - 1) / 4
}

/// Returns the unstuffed header right-aligned, the bits that fill it up to whole bytes, those bits
/// as an alternating pattern that leaves the stuffing state as at a start of frame, and the bytes.
#[inline]
fn header(frame: &Frame) -> (u64, u32, u64, usize) {
    let id = u64::from(frame.raw_id());
    let remote = u64::from(frame.is_remote());
    let length = u64::from(frame.length());
    if frame.is_extended() {
        let base = id >> 18;
        let extension = id & 0x3_FFFF;
        let bits = (base << 27) | (0b11 << 25) | (extension << 7) | (remote << 6) | length;
        (bits, 40 - HEADER_BITS[1], 0b1 << 39, 5)
    } else {
        let bits = (id << 7) | (remote << 6) | length;
        (bits, 24 - HEADER_BITS[0], 0b10101 << 19, 3)
    }
}

#[inline]
fn crc_byte(crc: u16, byte: u8) -> u16 {
    let index = ((crc >> 7) as u8) ^ byte;
    (CRC_TABLE[usize::from(index)] ^ (crc << 8)) & 0x7FFF
}

#[inline]
fn stuff_byte(state: u8, stuff: u32, byte: u8) -> (u8, u32) {
    let entry = STUFF_TABLE[usize::from(state & 7)][usize::from(byte)];
    (entry & 7, stuff + u32::from(entry >> 3))
}

static CRC_TABLE: [u16; 256] = crc_table();

const fn crc_table() -> [u16; 256] {
    let mut table = [0u16; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut crc = (byte as u16) << 7;
        let mut bit = 0;
        while bit < 8 {
            let carry = crc & 0x4000 != 0;
            crc = (crc << 1) & 0x7FFF;
            if carry {
                crc ^= CRC_POLYNOMIAL;
            }
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
}

/// A run of one dominant bit. A state is the last bit's value times 4 plus the run's length
/// (1–4) minus 1.
const START_STATE: u8 = 0;

/// Next state in bits 0–2 and number of stuff bits in bits 3–4, by state and byte.
static STUFF_TABLE: [[u8; 256]; 8] = stuff_table();

const fn stuff_table() -> [[u8; 256]; 8] {
    let mut table = [[0u8; 256]; 8];
    let mut state = 0;
    while state < 8 {
        let mut byte = 0;
        while byte < 256 {
            table[state][byte] = stuff_entry(state as u8, byte as u8);
            byte += 1;
        }
        state += 1;
    }
    table
}

const fn stuff_entry(state: u8, byte: u8) -> u8 {
    let mut value = state >> 2;
    let mut run = (state & 3) + 1;
    let mut stuffed = 0;
    let mut bit = 8;
    while bit > 0 {
        bit -= 1;
        let next = (byte >> bit) & 1;
        run = if next == value { run + 1 } else { 1 };
        value = next;
        if run == 5 {
            stuffed += 1;
            value = 1 - value;
            run = 1;
        }
    }
    (stuffed << 3) | (value << 2) | (run - 1)
}

#[cfg(test)]
mod tests;
