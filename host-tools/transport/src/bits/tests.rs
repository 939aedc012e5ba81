use eel_protocol::Frame;
use embedded_can::ExtendedId;

use super::*;
use crate::candump::parse_frame;

#[test]
fn agrees_with_the_independent_computation_bit_by_bit() {
    // Made by tests/python/frame_bits.py.
    let mut checked = 0;
    for line in include_str!("pinned.txt").lines() {
        let (frame, bits) = line.split_once(' ').unwrap();
        assert_eq!(
            frame_bits(&parse_frame(frame).unwrap()),
            bits.parse::<u32>().unwrap(),
            "{line}"
        );
        checked += 1;
    }
    assert_eq!(checked, 1000);
}

#[test]
fn counts_a_frame_worked_out_by_hand() {
    // Identifier 0, no data: start of frame to CRC are 34 dominant bits (the remainder of 0 is 0).
    // Each five of them are followed by a recessive stuff bit, which makes six stuff bits; the
    // tail has ten bits and the interframe space three.
    assert_eq!(frame_bits(&Frame::standard(0, &[]).unwrap()), 34 + 6 + 13);
}

#[test]
fn an_eight_byte_frame_takes_111_to_135_bits() {
    assert_eq!(frame_bits_max(8), 135);
    assert_eq!(frame_bits_max_extended(8), 160);
    assert_eq!((frame_bits_max(0), frame_bits_max(255)), (55, 135));
    let mut random = Random(0x1234_5678_9ABC_DEF0);
    let (mut shortest, mut longest) = (u32::MAX, 0);
    for _ in 0..20_000 {
        let raw = random.next();
        // Half of the frames repeat a byte pair, which stuffs more than chance does.
        let data = if raw & 1 == 0 {
            random.next()
        } else {
            raw >> 48 | (raw >> 48) << 16
        };
        let frame = Frame::standard((raw >> 8) as u16, &data.to_be_bytes()).unwrap();
        let bits = frame_bits(&frame);
        shortest = shortest.min(bits);
        longest = longest.max(bits);
    }
    assert!((111..=114).contains(&shortest), "{shortest}");
    assert!((125..=135).contains(&longest), "{longest}");
}

#[test]
fn agrees_with_pushing_single_bits_through_a_shift_register() {
    let seed = 0x00E7_1E57_u64;
    println!("seed {seed:#x}");
    let mut random = Random(seed);
    for _ in 0..50_000 {
        let raw = random.next();
        let mut data = random.next().to_be_bytes();
        if raw & 0x30 == 0 {
            data = data.map(|byte| if byte & 1 == 0 { 0x00 } else { 0xFF });
        }
        let length = (raw >> 40) as usize % 9;
        let extended = raw & 1 == 0;
        let frame = match (extended, raw & 6 == 0) {
            (false, false) => Frame::standard((raw >> 8) as u16, &data[..length]),
            (false, true) => Frame::remote(standard((raw >> 8) as u16 & 0x7FF), length as u8),
            (true, false) => Frame::new(extended_id(raw), &data[..length]),
            (true, true) => Frame::remote(extended_id(raw), length as u8),
        }
        .unwrap();
        assert_eq!(frame_bits(&frame), slow_bits(&frame), "{frame:?}");
        let max = if extended {
            frame_bits_max_extended
        } else {
            frame_bits_max
        };
        assert!(frame_bits(&frame) <= max(frame.length()), "{frame:?}");
    }
}

fn standard(id: u16) -> embedded_can::StandardId {
    embedded_can::StandardId::new(id).unwrap()
}

fn extended_id(raw: u64) -> ExtendedId {
    ExtendedId::new((raw >> 8) as u32 & 0x1FFF_FFFF).unwrap()
}

/// The bits one by one, with the shift register of ISO 11898-1 (and Bosch CAN 2.0, section 3.1.1).
fn slow_bits(frame: &Frame) -> u32 {
    let mut bits = vec![false];
    let mut push = |value: u32, count: u32| {
        for place in (0..count).rev() {
            bits.push(value >> place & 1 == 1);
        }
    };
    let id = frame.raw_id();
    if frame.is_extended() {
        push(id >> 18, 11);
        push(0b11, 2);
        push(id & 0x3_FFFF, 18);
        push(u32::from(frame.is_remote()), 1);
        push(0, 2);
    } else {
        push(id, 11);
        push(u32::from(frame.is_remote()), 1);
        push(0, 2);
    }
    push(u32::from(frame.length()), 4);
    for byte in frame.data() {
        push(u32::from(*byte), 8);
    }
    let mut register = 0u16;
    for bit in bits.clone() {
        let next = bit ^ (register & 0x4000 != 0);
        register = register << 1 & 0x7FFF;
        if next {
            register ^= 0x4599;
        }
    }
    for place in (0..15).rev() {
        bits.push(register >> place & 1 == 1);
    }
    let (mut count, mut run, mut last) = (0, 0, true);
    for bit in bits {
        run = if bit == last { run + 1 } else { 1 };
        last = bit;
        count += 1;
        if run == 5 {
            count += 1;
            run = 1;
            last = !bit;
        }
    }
    count + 13
}

/// Xorshift64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }
}
