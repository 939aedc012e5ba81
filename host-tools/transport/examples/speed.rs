//! How many frames a second the host counts, writes and reads:
//! `cargo run --release -p eel-transport --example speed`.

use std::time::Instant;

use eel_protocol::Frame;
use eel_transport::candump::{Line, Record, parse_line, write_line};
use eel_transport::frame_bits;

const FRAMES: usize = 2_000_000;

fn main() {
    let frames: Vec<Frame> = (0..FRAMES as u64)
        .filter_map(|number| {
            let scrambled = number.wrapping_mul(0x9E37_79B9_7F4A_7C15);
            Frame::standard((scrambled >> 53) as u16, &scrambled.to_be_bytes())
        })
        .collect();

    let start = Instant::now();
    let bits: u64 = frames
        .iter()
        .map(|frame| u64::from(frame_bits(frame)))
        .sum();
    report("frame_bits", start);

    let start = Instant::now();
    let mut text = Vec::with_capacity(FRAMES * 48);
    for (number, frame) in frames.iter().enumerate() {
        let time_ns = number as u64 * 120_000;
        write_line(
            &mut text,
            &Record {
                time_ns,
                interface: "eel",
                frame: *frame,
                direction: None,
            },
        );
    }
    report("write_line", start);

    let start = Instant::now();
    let mut same = 0;
    for (line, frame) in text.split(|byte| *byte == b'\n').zip(&frames) {
        if let Ok(Line::Frame(record)) = parse_line(line) {
            same += usize::from(record.frame == *frame);
        }
    }
    report("parse_line", start);
    println!("{same} of {FRAMES} frames read back the same, {bits} bits");
}

fn report(what: &str, start: Instant) {
    let seconds = start.elapsed().as_secs_f64();
    println!("{what}: {:.1} M frames/s", FRAMES as f64 / seconds / 1e6);
}
