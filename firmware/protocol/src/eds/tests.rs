//! The grammar against the text, and bytes that are no grammar.

use std::string::String;
use std::vec::Vec as List;
use std::{println, vec};

use super::*;
use crate::export::write_eds;

fn text() -> String {
    let mut text = String::new();
    write_eds(&mut text).unwrap();
    text
}

#[test]
fn the_data_sheet_that_is_carried_is_the_one_that_the_table_gives() {
    let grammar = Grammar::new(COMPRESSED).unwrap();
    let text = text();
    println!("{} bytes for {}", COMPRESSED.len(), text.len());
    let mut whole = vec![0; text.len() + 1];
    let count = Reader::default().read(&grammar, 0, &mut whole);
    assert!(
        whole[..count] == *text.as_bytes(),
        "firmware/protocol/src/eds/vertebra.grammar is stale: run `cargo xtask gen`"
    );
    assert_eq!(grammar.length() as usize, text.len());
    assert!(COMPRESSED.len() <= 8 * 1024, "{}", COMPRESSED.len());
}

#[test]
fn a_reader_goes_on_where_it_ended_and_back_to_any_place() {
    let grammar = Grammar::new(COMPRESSED).unwrap();
    let text = text();
    let text = text.as_bytes();
    let mut reader = Reader::default();
    let mut offset = 0;
    for length in [1, 7, 889, 2, 0, 4_000].into_iter().cycle() {
        let mut out = vec![0; length];
        let count = reader.read(&grammar, offset as u32, &mut out);
        assert_eq!(out[..count], text[offset..offset + count]);
        offset += count;
        assert_eq!(reader.offset() as usize, offset);
        if count < length {
            break;
        }
    }
    assert_eq!(offset, text.len());
    for offset in [20_000, 3, 3, 19_999, text.len() - 1, 0] {
        let mut out = [0; 16];
        let count = reader.read(&grammar, offset as u32, &mut out);
        assert_eq!(out[..count], text[offset..(offset + 16).min(text.len())]);
    }
    let mut out = [0; 4];
    assert_eq!(reader.read(&grammar, text.len() as u32 + 9, &mut out), 0);
}

/// Numbers of a fixed row (xorshift64*).
fn numbers() -> impl FnMut() -> u64 {
    let mut state = 0x5EED_u64;
    move || {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 20
    }
}

#[test]
fn any_bytes_end_and_yield_no_more_than_they_promise() {
    let mut next = numbers();
    let mut read = 0;
    for round in 0..4_000 {
        let mut bytes: List<u8> = COMPRESSED.to_vec();
        if round % 2 == 0 {
            for _ in 0..1 + next() % 40 {
                let at = next() as usize % bytes.len();
                bytes[at] = next() as u8;
            }
        } else {
            bytes = (0..HEADER as u64 + next() % 60)
                .map(|_| next() as u8)
                .collect();
            // Small counts, so that some of them fit.
            bytes[..HEADER].copy_from_slice(&[200, 0, 0, 0, 4, 5, 0, 3, 0, 4]);
            bytes.resize(HEADER + 4 + 7, 0x5A);
        }
        let Some(grammar) = Grammar::new(&bytes) else {
            continue;
        };
        let mut out = [0; 512];
        let mut reader = Reader::default();
        let mut offset = 0;
        while offset < 60_000 {
            let count = reader.read(&grammar, offset, &mut out);
            assert!(offset + count as u32 <= grammar.length());
            offset += count as u32;
            read += count;
            if count < out.len() {
                break;
            }
        }
    }
    assert!(read > 1_000_000, "the bytes were too wrong: {read}");
}

#[test]
fn a_rule_that_stands_for_itself_ends_the_text() {
    // One character, one rule (code 1) of twice itself, one symbol, codes of two bits.
    let bytes = [9, 0, 0, 0, 1, 1, 0, 1, 0, 2, b'a', 0b01_01_01];
    let grammar = Grammar::new(&bytes).unwrap();
    assert_eq!(Reader::default().read(&grammar, 0, &mut [0; 9]), 0);
    assert!(Grammar::new(&bytes[..11]).is_none());
    assert!(Grammar::new(&[0; HEADER - 1]).is_none());
}
