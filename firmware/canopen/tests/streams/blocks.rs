//! A client of block transfers on a good line.
#![allow(dead_code, reason = "every test file uses a part")]

use super::{Line, about, crc};

/// Asks for the first block of an upload.
pub const START: [u8; 8] = [0xA3, 0, 0, 0, 0, 0, 0, 0];
/// Ends a block upload; and what a block download ends with.
pub const DONE: [u8; 8] = [0xA1, 0, 0, 0, 0, 0, 0, 0];

/// The acknowledgement of a block, in both directions.
pub fn acknowledge(sequence: u8, size: u8) -> [u8; 8] {
    [0xA2, sequence, size, 0, 0, 0, 0, 0]
}

/// The segments that carry `bytes`, numbered from 1; the last is marked.
pub fn segments(bytes: &[u8]) -> Vec<[u8; 8]> {
    let mut all = Vec::new();
    for part in bytes.chunks(7) {
        let mut segment = [0; 8];
        segment[0] = (all.len() % 127) as u8 + 1;
        segment[1..=part.len()].copy_from_slice(part);
        all.push(segment);
    }
    if all.is_empty() {
        all.push([1, 0, 0, 0, 0, 0, 0, 0]);
    }
    all.last_mut().unwrap()[0] |= 0x80;
    all
}

/// The message that ends a block download of `bytes`.
pub fn end(bytes: &[u8]) -> [u8; 8] {
    let unused = match bytes.len() {
        0 => 7,
        length => (7 - length % 7) % 7,
    };
    let [low, high] = crc(bytes).to_le_bytes();
    [0xC1 | (unused as u8) << 2, low, high, 0, 0, 0, 0, 0]
}

/// Downloads as a client does on a good line, and returns the last answer.
pub fn download(line: &mut Line, index: u16, subindex: u8, bytes: &[u8]) -> [u8; 8] {
    let answer = line.sdo(about(0xC6, index, subindex, bytes.len() as u32));
    if answer[0] == 0x80 {
        return answer;
    }
    assert_eq!(answer, about(0xA4, index, subindex, 127));
    for block in segments(bytes).chunks(127) {
        let (last, others) = block.split_last().unwrap();
        for segment in others {
            line.tell(*segment);
        }
        let answer = line.sdo(*last);
        if answer[0] == 0x80 {
            return answer;
        }
        assert_eq!(answer, acknowledge(block.len() as u8, 127));
    }
    line.sdo(end(bytes))
}

/// Uploads in blocks of `size` as a client does on a good line.
pub fn upload(line: &mut Line, index: u16, subindex: u8, size: u8) -> Vec<u8> {
    let answer = line.sdo(about(0xA4, index, subindex, u32::from(size)));
    assert_eq!(answer[..4], about(0xC6, index, subindex, 0)[..4]);
    let length = u32::from_le_bytes(answer[4..].try_into().unwrap()) as usize;
    line.tell(START);
    let mut bytes = Vec::new();
    loop {
        let block = line.stream();
        let count = block.len() as u8;
        for (segment, number) in block.iter().zip(1..) {
            assert_eq!(segment[0] & 0x7F, number);
            bytes.extend(&segment[1..]);
        }
        let last = block.last().unwrap()[0] & 0x80 != 0;
        assert!(last || count == size);
        if last {
            let answer = line.sdo(acknowledge(count, size));
            bytes.truncate(length);
            assert_eq!(answer, end(&bytes));
            line.tell(DONE);
            return bytes;
        }
        line.tell(acknowledge(count, size));
    }
}
