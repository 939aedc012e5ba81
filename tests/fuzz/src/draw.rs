//! Frames out of bytes: most of them nearly sensible, some of them anything.

use eel_canopen::Frame;
use embedded_can::{ExtendedId, StandardId};

use crate::input::Input;

/// Objects that matter to the node, with the length in bytes of what is written there.
const OBJECTS: [(u16, u8, u8); 44] = [
    (0x1000, 0, 4),
    (0x1001, 0, 1),
    (0x1003, 0, 1),
    (0x1003, 1, 4),
    (0x1005, 0, 4),
    (0x1008, 0, 0),
    (0x100A, 0, 0),
    (0x1010, 0, 1),
    (0x1010, 1, 4),
    (0x1010, 2, 4),
    (0x1011, 1, 4),
    (0x1012, 0, 4),
    (0x1014, 0, 4),
    (0x1015, 0, 2),
    (0x1016, 1, 4),
    (0x1017, 0, 2),
    (0x1018, 4, 4),
    (0x1019, 0, 1),
    (0x1020, 1, 4),
    (0x1021, 0, 0),
    (0x1029, 1, 1),
    (0x1400, 1, 4),
    (0x1400, 2, 1),
    (0x1401, 1, 4),
    (0x1600, 0, 1),
    (0x1600, 1, 4),
    (0x1600, 2, 4),
    (0x1601, 0, 1),
    (0x1800, 1, 4),
    (0x1800, 2, 1),
    (0x1802, 1, 4),
    (0x1802, 3, 2),
    (0x1802, 5, 2),
    (0x1802, 6, 1),
    (0x1A00, 0, 1),
    (0x1A00, 1, 4),
    (0x1A02, 0, 1),
    (0x1A02, 2, 4),
    (0x2000, 1, 2),
    (0x2002, 3, 1),
    (0x2020, 0, 0),
    (0x2040, 0, 8),
    (0x2100, 1, 0),
    (0x2100, 2, 0),
];

/// What objects that the bus writes are given.
const VALUES: [u32; 32] = [
    0,
    1,
    2,
    8,
    240,
    255,
    0x80,
    0x100,
    0x181,
    0x205,
    0x385,
    0x8000_0205,
    0x8000_0185,
    0x4000_0185,
    0xC000_0185,
    0xC000_0385,
    0x6576_6173, // "save"
    0x6461_6F6C, // "load"
    0x007F_000A,
    0x2000_0110,
    0x2002_0308,
    0x2010_0110,
    0x2010_0340,
    0x0005_0008,
    // Identifiers that belong to others.
    0x0581,
    0x0601,
    0x4000_0581,
    0x4000_0701,
    // More objects and lengths.
    0x2040_0040,
    0x2010_0220,
    0x2000_0410,
    0x1001_0008,
];

/// Draws a frame; `id` is the node's.
pub fn frame(input: &mut Input<'_>, id: u8) -> Frame {
    let (cob_id, data): (u16, Vec<u8>) = match input.below(12) {
        0 => {
            let command = input.pick(&[1, 2, 128, 129, 130, 0]);
            (0, vec![command, input.pick(&[id, 0, id, id ^ 1])])
        }
        1 => {
            let byte = input.byte();
            (0x080, vec![byte; usize::from(byte & 1)])
        }
        2 => {
            let base = input.pick(&[0x200, 0x300, 0x400, 0x500]);
            let length = input.below(9);
            (base + u16::from(id), input.take(length).to_vec())
        }
        3 => (0x600 + u16::from(id), input.array::<8>().to_vec()),
        4 | 5 => (0x600 + u16::from(id), object_request(input).to_vec()),
        6 | 7 => (0x600 + u16::from(id), segment(input).to_vec()),
        8 => (
            0x77F,
            vec![input.pick(&[0, 4, 5, 127, 1]); 1 + input.below(8) / 7],
        ),
        9 => (0x7E5, lss(input).to_vec()),
        10 => (0x100, input.take(6).to_vec()),
        _ => return anything(input),
    };
    Frame::standard(cob_id, &data).expect("at most eight bytes")
}

/// Draws a frame of any kind.
fn anything(input: &mut Input<'_>) -> Frame {
    let number = input.long();
    let length = usize::from(input.byte() >> 4).min(8);
    let data = input.take(length);
    match number >> 29 {
        0 => Frame::new(ExtendedId::new(number).expect("29 bits"), data),
        1 => Frame::remote(
            StandardId::new(number as u16 & 0x7FF).expect("11 bits"),
            length as u8,
        ),
        _ => Frame::standard(number as u16, data),
    }
    .expect("at most eight bytes")
}

/// Draws a request that names an object.
fn object_request(input: &mut Input<'_>) -> [u8; 8] {
    let (index, subindex, length) = input.pick(&OBJECTS);
    let [low, high] = index.to_le_bytes();
    let fit = |length: u8| 0x23 | (4 - length.clamp(1, 4)) << 2;
    let command = match input.below(8) {
        0 => 0x40,
        1 | 2 => fit(length),
        3 => 0x21,
        4 => 0xA4 | (input.byte() & 4),
        5 => 0xC6,
        6 => 0x22,
        _ => input.byte(),
    };
    let value = match input.below(3) {
        0 => input.long(),
        1 => u32::from(input.byte()),
        _ => input.pick(&VALUES),
    };
    let [a, b, c, d] = value.to_le_bytes();
    [command, low, high, subindex, a, b, c, d]
}

/// Draws what goes on with a transfer: a segment, an acknowledgement, an end, an abort.
fn segment(input: &mut Input<'_>) -> [u8; 8] {
    let command = match input.below(8) {
        0 => input.pick(&[0x60, 0x70]),
        1 => input.pick(&[0x00, 0x10]),
        2 => 0x01 | (input.byte() & 0x1E),
        3 => input.pick(&[0xA3, 0xA2, 0xA1]),
        4 => 0xC1 | (input.byte() & 0x1C),
        5 => 0x80,
        6 => input.below(8) as u8 | 0x80,
        _ => input.below(8) as u8,
    };
    let [a, b, c, d, e, f, g] = input.array();
    [command, a, b, c, d, e, f, g]
}

/// Draws a request of LSS.
pub fn lss(input: &mut Input<'_>) -> [u8; 8] {
    let command = input.pick(&[
        0x04, 0x11, 0x13, 0x15, 0x17, 0x40, 0x41, 0x42, 0x43, 0x46, 0x47, 0x48, 0x49, 0x4A, 0x4B,
        0x4C, 0x51, 0x5A, 0x5B, 0x5C, 0x5D, 0x5E, 0x00,
    ]);
    let command = if command == 0 { input.byte() } else { command };
    let [a, b, c, d, e, f, g] = match input.below(3) {
        0 => input.array(),
        1 => [input.byte() & 0x87, 0, 0, 0, 0, 0, 0],
        _ => {
            let identity = input.pick(&crate::bench::IDENTITY);
            let [a, b, c, d] = (identity ^ (1 << 31 >> input.below(33).min(31))).to_le_bytes();
            [
                a,
                b,
                c,
                d,
                input.byte() & 0x1F,
                input.byte() & 3,
                input.byte() & 3,
            ]
        }
    };
    [command, a, b, c, d, e, f, g]
}
