//! The SDO requests that are measured, each in the heaviest state that was found for it.

use crate::cost::{Bench, REQUEST, heavy};
use crate::costs::{check, tell};
use crate::stopwatch::Stopwatch;

/// A domain that can be read and written.
const DOMAIN: [u8; 3] = [0x01, 0x21, 1];

/// Measures every kind of request.
pub fn tell_all(stopwatch: &Stopwatch) {
    reading(stopwatch);
    writing(stopwatch);
    segmented(stopwatch);
    block_download(stopwatch);
    block_upload(stopwatch);
}

fn reading(stopwatch: &Stopwatch) {
    let mut bench = Bench::new(stopwatch, heavy());
    let mut read = |name, low: u8, high: u8, sub| {
        bench.drain();
        tell(
            name,
            bench.cost(REQUEST, &[0x40, low, high, sub, 0, 0, 0, 0]),
        );
    };
    read("sdo_read_1000", 0x00, 0x10, 0);
    read("sdo_read_1a01_8", 0x01, 0x1A, 8);
    read("sdo_read_2030_8", 0x30, 0x20, 8);
    read("sdo_read_nothing", 0xFF, 0x5F, 0);
}

fn writing(stopwatch: &Stopwatch) {
    let mut bench = Bench::new(stopwatch, heavy());
    let mut write = |name, command: u8, index: u16, sub: u8, value: u32| {
        bench.drain();
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let ticks = bench.cost(REQUEST, &[command, low, high, sub, a, b, c, d]);
        tell(name, ticks);
        check(name, bench.is_answered(0x60));
    };
    write("sdo_write_1017", 0x2B, 0x1017, 0, 100);
    write("sdo_write_1016", 0x23, 0x1016, 1, 0x007F_0100);
    write("sdo_write_1801_1_off", 0x23, 0x1801, 1, 0xC000_0285);
    write("sdo_write_1801_5", 0x2B, 0x1801, 5, 10);
    write("sdo_write_1a01_0_off", 0x2F, 0x1A01, 0, 0);
    write("sdo_write_1a01_8", 0x23, 0x1A01, 8, 0x2010_0408);
    write("sdo_write_1a01_0_on", 0x2F, 0x1A01, 0, 8);
    write("sdo_write_1801_1_on", 0x23, 0x1801, 1, 0x4000_0285);
    write("sdo_write_2020_6", 0x23, 0x2020, 6, 1);
}

fn segmented(stopwatch: &Stopwatch) {
    let mut bench = Bench::new(stopwatch, heavy());
    let [low, high, sub] = DOMAIN;
    let requests = [
        ("sdo_read_1008", [0x40, 0x08, 0x10, 0, 0, 0, 0, 0]),
        ("sdo_upload_segment", [0x60, 0, 0, 0, 0, 0, 0, 0]),
        ("sdo_abort", [0x80, 0, 0, 0, 0, 0, 0, 0]),
        ("sdo_download_start", [0x21, low, high, sub, 14, 0, 0, 0]),
        ("sdo_download_segment", [0x00, 1, 0, 0, 0, 0, 0, 0]),
        ("sdo_download_last", [0x11, 1, 0, 0, 0, 0, 0, 0]),
    ];
    for (name, request) in requests {
        bench.drain();
        tell(name, bench.cost(REQUEST, &request));
    }
    check("a segmented download", bench.is_answered(0x30));
}

fn block_download(stopwatch: &Stopwatch) {
    let mut bench = Bench::new(stopwatch, heavy());
    let [low, high, sub] = DOMAIN;
    bench.hear(REQUEST, &[0x21, low, high, sub, 14, 0, 0, 0]);
    let start = [0xC6, low, high, sub, 0x79, 0x03, 0, 0];
    tell("block_download_start", bench.cost(REQUEST, &start));
    bench.drain();
    let mut dearest = 0;
    for sequence in 1..=126 {
        let ticks = bench.cost(REQUEST, &[sequence, 1, 2, 3, 4, 5, 6, 7]);
        dearest = ticks.max(dearest);
    }
    tell("block_download_segment", dearest);
    tell(
        "block_download_last",
        bench.cost(REQUEST, &[0x80 | 127, 1, 2, 3, 4, 5, 6, 7]),
    );
    check("a block's acknowledgement", bench.is_answered(0xA2));
    // Which CRC is right the image is told by nobody: a wrong one costs the same.
    tell(
        "block_download_end",
        bench.cost(REQUEST, &[0xC1, 0, 0, 0, 0, 0, 0, 0]),
    );
    bench.drain();
    bench.hear(REQUEST, &[0xC2, low, high, sub, 0x07, 0, 0, 0]);
    bench.hear(REQUEST, &[0x81, 1, 2, 3, 4, 5, 6, 7]);
    tell(
        "block_download_finish",
        bench.cost(REQUEST, &[0xC1, 0, 0, 0, 0, 0, 0, 0]),
    );
    check("a block download", bench.is_answered(0xA1));
}

fn block_upload(stopwatch: &Stopwatch) {
    let mut bench = Bench::new(stopwatch, heavy());
    let [low, high, sub] = DOMAIN;
    bench.hear(REQUEST, &[0x21, low, high, sub, 14, 0, 0, 0]);
    let start = [0xA4, low, high, sub, 127, 0, 0, 0];
    tell("block_upload_start", bench.cost(REQUEST, &start));
    bench.drain();
    tell(
        "block_upload_go",
        bench.cost(REQUEST, &[0xA3, 0, 0, 0, 0, 0, 0, 0]),
    );
    let mut dearest = 0;
    for _ in 0..32 {
        dearest = bench.tick(0).max(dearest);
        bench.drain();
    }
    tell("tick_segments", dearest);
    tell(
        "block_upload_again",
        bench.cost(REQUEST, &[0xA2, 60, 127, 0, 0, 0, 0, 0]),
    );
    for _ in 0..32 {
        bench.tick(0);
        bench.drain();
    }
    tell(
        "block_upload_next",
        bench.cost(REQUEST, &[0xA2, 127, 127, 0, 0, 0, 0, 0]),
    );
    let name = [0xA4, 0x08, 0x10, 0, 127, 0, 0, 0];
    bench.drain();
    tell("block_upload_text", bench.cost(REQUEST, &name));
    bench.hear(REQUEST, &[0xA3, 0, 0, 0, 0, 0, 0, 0]);
    bench.tick(0);
    bench.drain();
    tell(
        "block_upload_done",
        bench.cost(REQUEST, &[0xA2, 3, 127, 0, 0, 0, 0, 0]),
    );
    check("a block upload", bench.is_answered(0xD1));
    tell(
        "block_upload_end",
        bench.cost(REQUEST, &[0xA1, 0, 0, 0, 0, 0, 0, 0]),
    );
}
