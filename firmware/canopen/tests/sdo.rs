//! The SDO server, byte by byte (CiA 301, 7.2.4).

mod common;

use common::{Bench, CONFIG};
use eel_canopen::{Config, SDO_BUFFER};

const TOGGLE: u32 = 0x0503_0000;
const TIMEOUT: u32 = 0x0504_0000;
const COMMAND: u32 = 0x0504_0001;
const OUT_OF_MEMORY: u32 = 0x0504_0005;
const TOO_LONG: u32 = 0x0607_0012;
const TOO_SHORT: u32 = 0x0607_0013;

fn abort(index: u16, subindex: u8, code: u32) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    let [a, b, c, d] = code.to_le_bytes();
    [0x80, low, high, subindex, a, b, c, d]
}

/// Uploads an object as a client does, and returns the bytes.
fn upload(bench: &mut Bench, index: u16, subindex: u8) -> Vec<u8> {
    let [low, high] = index.to_le_bytes();
    let [command, _, _, _, size @ ..] = bench.sdo([0x40, low, high, subindex, 0, 0, 0, 0]);
    if command & 2 != 0 {
        return size[..4 - usize::from(command >> 2 & 3)].to_vec();
    }
    assert_eq!(command, 0x41);
    let mut bytes = Vec::new();
    for toggle in [0x00, 0x10].into_iter().cycle() {
        let [command, data @ ..] = bench.sdo([0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(command & 0xF0, toggle);
        bytes.extend(&data[..7 - usize::from(command >> 1 & 7)]);
        if command & 1 != 0 {
            break;
        }
    }
    assert_eq!(bytes.len(), u32::from_le_bytes(size) as usize);
    bytes
}

/// Downloads an object in segments and returns the last answer.
fn download(bench: &mut Bench, index: u16, bytes: &[u8]) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    let [a, b, c, d] = (bytes.len() as u32).to_le_bytes();
    let mut answer = bench.sdo([0x21, low, high, 0, a, b, c, d]);
    let segments = bytes.len().div_ceil(7).max(1);
    for segment in 0..segments {
        if answer[0] == 0x80 {
            break;
        }
        let part = &bytes[segment * 7..bytes.len().min(segment * 7 + 7)];
        let mut request = [0xEE; 8];
        request[0] = (segment as u8 & 1) << 4
            | (7 - part.len() as u8) << 1
            | u8::from(segment + 1 == segments);
        request[1..=part.len()].copy_from_slice(part);
        answer = bench.sdo(request);
    }
    answer
}

#[test]
fn reads_short_objects_expedited() {
    let mut bench = Bench::pre_operational();
    for (request, answer) in [
        // One, two and four bytes.
        (
            [0x40, 0x18, 0x10, 0, 0, 0, 0, 0],
            [0x4F, 0x18, 0x10, 0, 4, 0, 0, 0],
        ),
        (
            [0x40, 0x17, 0x10, 0, 0, 0, 0, 0],
            [0x4B, 0x17, 0x10, 0, 200, 0, 0, 0],
        ),
        (
            [0x40, 0x00, 0x10, 0, 0, 0, 0, 0],
            [0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0x00],
        ),
        (
            [0x40, 0x10, 0x20, 1, 0, 0, 0, 0],
            [0x4B, 0x10, 0x20, 1, 0x22, 0x11, 0, 0],
        ),
    ] {
        assert_eq!(bench.sdo(request), answer);
    }
}

#[test]
fn tells_who_it_is() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.read(0x1018, 1), Ok(0x1234_5678));
    assert_eq!(bench.read(0x1018, 2), Ok(0x0EE1));
    assert_eq!(bench.read(0x1018, 3), Ok(0x0001_0002));
    assert_eq!(bench.read(0x1018, 4), Ok(0xCAFE_F00D));
    assert_eq!(bench.read(0x1200, 1), Ok(0x605));
    assert_eq!(bench.read(0x1200, 2), Ok(0x585));
    assert_eq!(upload(&mut bench, 0x1008, 0), b"Anguilla vertebra");
    assert_eq!(upload(&mut bench, 0x1009, 0), b"A1");
    assert_eq!(upload(&mut bench, 0x100A, 0), b"0.1.0");
}

#[test]
fn reads_a_text_in_segments() {
    let mut bench = Bench::pre_operational();
    for (request, answer) in [
        (
            [0x40, 0x08, 0x10, 0, 0, 0, 0, 0],
            [0x41, 0x08, 0x10, 0, 17, 0, 0, 0],
        ),
        ([0x60, 0, 0, 0, 0, 0, 0, 0], *b"\x00Anguill"),
        ([0x70, 0, 0, 0, 0, 0, 0, 0], *b"\x10a verte"),
        ([0x60, 0, 0, 0, 0, 0, 0, 0], *b"\x09bra\0\0\0\0"),
    ] {
        assert_eq!(bench.sdo(request), answer);
    }
    // The transfer is over.
    assert_eq!(bench.sdo([0x70, 0, 0, 0, 0, 0, 0, 0]), abort(0, 0, COMMAND));
}

#[test]
fn reads_an_empty_value_in_one_empty_segment() {
    let mut bench = Bench::with(Config {
        device_name: "",
        ..CONFIG
    });
    bench.sent();
    assert_eq!(bench.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0])[..1], [0x41]);
    assert_eq!(
        bench.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]),
        [0x0F, 0, 0, 0, 0, 0, 0, 0]
    );
}

#[test]
fn writes_short_objects_expedited() {
    let mut bench = Bench::pre_operational();
    for (request, answer) in [
        (
            [0x2B, 0x00, 0x20, 1, 0x34, 0x12, 0, 0],
            [0x60, 0x00, 0x20, 1, 0, 0, 0, 0],
        ),
        (
            [0x2F, 0x00, 0x20, 4, 0x56, 0, 0, 0],
            [0x60, 0x00, 0x20, 4, 0, 0, 0, 0],
        ),
        // Without a size the object's own length holds.
        (
            [0x22, 0x00, 0x20, 2, 0x78, 0x56, 0xFF, 0xFF],
            [0x60, 0x00, 0x20, 2, 0, 0, 0, 0],
        ),
    ] {
        assert_eq!(bench.sdo(request), answer);
    }
    assert_eq!(bench.app.target, [0x1234, 0x5678, 0]);
    assert_eq!(bench.app.mode, [0x56, 0]);
}

#[test]
fn writes_in_segments() {
    let mut bench = Bench::pre_operational();
    for (request, answer) in [
        (
            [0x21, 0x20, 0x20, 0, 9, 0, 0, 0],
            [0x60, 0x20, 0x20, 0, 0, 0, 0, 0],
        ),
        (*b"\x00swim is", [0x20, 0, 0, 0, 0, 0, 0, 0]),
        (*b"\x1B a\0\0\0\0\0", [0x30, 0, 0, 0, 0, 0, 0, 0]),
    ] {
        assert_eq!(bench.sdo(request), answer);
    }
    assert_eq!(bench.app.text, b"swim is a");
    // Four bytes or fewer may come in a segment too, and a size need not be told.
    assert_eq!(bench.sdo([0x20, 0x17, 0x10, 0, 0, 0, 0, 0])[0], 0x60);
    assert_eq!(bench.sdo([0x0B, 0x64, 0x00, 0, 0, 0, 0, 0])[0], 0x20);
    assert_eq!(bench.read(0x1017, 0), Ok(100));
}

#[test]
fn every_length_up_to_the_buffer_comes_back_as_it_went() {
    let mut bench = Bench::pre_operational();
    for length in 0..=SDO_BUFFER {
        let bytes: Vec<u8> = (0..length).map(|at| (at * 7 + length) as u8).collect();
        assert_eq!(
            download(&mut bench, 0x2020, &bytes)[0] & 0xE0,
            0x20,
            "{length}"
        );
        assert_eq!(bench.app.text, bytes);
        assert_eq!(upload(&mut bench, 0x2020, 0), bytes);
    }
    let bytes = [7; SDO_BUFFER + 1];
    assert_eq!(
        download(&mut bench, 0x2020, &bytes),
        abort(0x2020, 0, OUT_OF_MEMORY)
    );
    bench.app.text = bytes.to_vec();
    assert_eq!(bench.read(0x2020, 0), Err(OUT_OF_MEMORY));
}

#[test]
fn says_why_an_object_can_not_be_accessed() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.read(0x3000, 0), Err(0x0602_0000));
    assert_eq!(bench.read(0x1F50, 1), Err(0x0602_0000));
    assert_eq!(bench.read(0x1013, 1), Err(0x0602_0000));
    assert_eq!(bench.read(0x0005, 0), Err(0x0602_0000));
    assert_eq!(bench.read(0x2000, 9), Err(0x0609_0011));
    assert_eq!(bench.read(0x1000, 1), Err(0x0609_0011));
    assert_eq!(bench.read(0x1018, 5), Err(0x0609_0011));
    assert_eq!(bench.read(0x2021, 0), Err(0x0601_0001));
    assert_eq!(bench.write(0x2010, 1, 0, 2), Err(0x0601_0002));
    assert_eq!(bench.write(0x1000, 0, 0, 4), Err(0x0601_0002));
    assert_eq!(bench.write(0x1018, 0, 0, 1), Err(0x0601_0002));
    assert_eq!(bench.write(0x2000, 1, 0, 4), Err(TOO_LONG));
    assert_eq!(bench.write(0x2000, 1, 0, 1), Err(TOO_SHORT));
    assert_eq!(bench.write(0x1017, 0, 0, 4), Err(TOO_LONG));
    assert_eq!(bench.write(0x1005, 0, 0, 2), Err(TOO_SHORT));
    bench.app.refuse = true;
    assert_eq!(
        bench.write(0x2000, 1, 0, 2),
        Err(0x0609_0030),
        "the application's own word"
    );
}

#[test]
fn aborts_carry_the_object() {
    let mut bench = Bench::pre_operational();
    let answer = bench.sdo([0x40, 0x00, 0x30, 7, 0, 0, 0, 0]);
    assert_eq!(answer, [0x80, 0x00, 0x30, 7, 0x00, 0x00, 0x02, 0x06]);
}

#[test]
fn a_wrong_toggle_ends_the_transfer() {
    let mut bench = Bench::pre_operational();
    bench.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!(
        bench.sdo([0x70, 0, 0, 0, 0, 0, 0, 0]),
        abort(0x1008, 0, TOGGLE)
    );
    assert_eq!(bench.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]), abort(0, 0, COMMAND));
    bench.sdo([0x21, 0x20, 0x20, 0, 9, 0, 0, 0]);
    bench.sdo([0x00, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(
        bench.sdo([0x00, 1, 2, 3, 4, 5, 6, 7]),
        abort(0x2020, 0, TOGGLE)
    );
    assert_eq!(bench.app.text, b"");
}

#[test]
fn unknown_commands_and_segments_out_of_turn_are_refused() {
    let mut bench = Bench::pre_operational();
    assert_eq!(
        bench.sdo([0xE0, 0x08, 0x10, 0, 0, 0, 0, 0]),
        abort(0, 0, COMMAND)
    );
    assert_eq!(bench.sdo([0x00, 0, 0, 0, 0, 0, 0, 0]), abort(0, 0, COMMAND));
    assert_eq!(bench.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]), abort(0, 0, COMMAND));
    bench.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!(
        bench.sdo([0x00, 0, 0, 0, 0, 0, 0, 0]),
        abort(0x1008, 0, COMMAND)
    );
    bench.sdo([0x21, 0x20, 0x20, 0, 9, 0, 0, 0]);
    assert_eq!(
        bench.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]),
        abort(0x2020, 0, COMMAND)
    );
}

#[test]
fn a_download_must_bring_what_it_promised() {
    let mut bench = Bench::pre_operational();
    bench.sdo([0x21, 0x20, 0x20, 0, 9, 0, 0, 0]);
    assert_eq!(
        bench.sdo([0x01, 1, 2, 3, 4, 5, 6, 7]),
        abort(0x2020, 0, TOO_SHORT)
    );
    bench.sdo([0x21, 0x20, 0x20, 0, 5, 0, 0, 0]);
    assert_eq!(
        bench.sdo([0x00, 1, 2, 3, 4, 5, 6, 7]),
        abort(0x2020, 0, TOO_LONG)
    );
    assert_eq!(
        bench.sdo([0x21, 0x17, 0x10, 0, 5, 0, 0, 0]),
        abort(0x1017, 0, TOO_LONG)
    );
    assert_eq!(
        bench.sdo([0x21, 0x17, 0x10, 0, 1, 0, 0, 0]),
        abort(0x1017, 0, TOO_SHORT)
    );
    bench.sdo([0x20, 0x20, 0x20, 0, 0, 0, 0, 0]);
    for segment in 0..127 {
        bench.sdo([(segment & 1) << 4, 1, 2, 3, 4, 5, 6, 7]);
    }
    let answer = bench.sdo([0x10, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(
        answer,
        abort(0x2020, 0, OUT_OF_MEMORY),
        "128 segments are 896 bytes"
    );
    assert_eq!(bench.app.text, b"");
}

#[test]
fn a_silent_client_loses_its_transfer_after_a_second() {
    let mut bench = Bench::with(Config {
        heartbeat_ms: 0,
        ..CONFIG
    });
    bench.sent();
    bench.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    bench.pass_ms(999);
    bench.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]);
    bench.pass_ms(999);
    assert_eq!(bench.sent(), []);
    bench.pass_ms(1);
    assert_eq!(bench.sent(), [(0x585, abort(0x1008, 0, TIMEOUT).to_vec())]);
    bench.pass_ms(2_000);
    assert_eq!(bench.sent(), []);
}

#[test]
fn a_client_may_give_up_or_start_over() {
    let mut bench = Bench::pre_operational();
    bench.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!(bench.ask(0x605, &abort(0x1008, 0, TIMEOUT)), []);
    assert_eq!(bench.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]), abort(0, 0, COMMAND));
    bench.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    bench.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(upload(&mut bench, 0x1008, 0), b"Anguilla vertebra");
}

#[test]
fn ignores_requests_that_are_not_eight_bytes_or_for_another() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.ask(0x605, &[0x40, 0, 0x10, 0]), []);
    assert_eq!(bench.ask(0x606, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]), []);
    assert_eq!(bench.ask(0x585, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]), []);
}

#[test]
fn stopping_ends_a_transfer() {
    let mut bench = Bench::pre_operational();
    bench.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    bench.hear(0, &[2, 0]);
    bench.hear(0, &[128, 0]);
    assert_eq!(bench.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]), abort(0, 0, COMMAND));
}
