//! From frames to text, by appending bytes.

use eel_protocol::Frame;

use super::{Direction, Record};

const DIGITS: &[u8; 16] = b"0123456789ABCDEF";

/// Appends a line with its line end; the time is cut to whole microseconds, as candump does.
pub fn write_line(out: &mut Vec<u8>, record: &Record<'_>) {
    write_time(out, record.time_ns);
    out.push(b' ');
    out.extend_from_slice(record.interface.as_bytes());
    out.push(b' ');
    write_frame(out, &record.frame);
    match record.direction {
        None => {}
        Some(Direction::Received) => out.extend_from_slice(b" R"),
        Some(Direction::Transmitted) => out.extend_from_slice(b" T"),
    }
    out.push(b'\n');
}

/// Returns a line without a line end.
pub fn format_line(record: &Record<'_>) -> String {
    let mut out = Vec::with_capacity(64);
    write_line(&mut out, record);
    out.pop();
    // What was appended is ASCII and the interface's name, which is a `str`.
    String::from_utf8(out).unwrap_or_default()
}

/// Appends a frame alone, such as `123#DEADBEEF`.
pub fn write_frame(out: &mut Vec<u8>, frame: &Frame) {
    // Room for the longest: 8 digits, a mark and 16 digits.
    let mut text = [0u8; 25];
    let mut end = 0;
    let mut put = |byte: u8| {
        if let Some(slot) = text.get_mut(end) {
            *slot = byte;
            end += 1;
        }
    };
    let id = frame.raw_id();
    let digits = if frame.is_extended() { 8 } else { 3 };
    for place in (0..digits).rev() {
        put(DIGITS[(id >> (4 * place) & 15) as usize]);
    }
    put(b'#');
    if frame.is_remote() {
        put(b'R');
        if frame.length() > 0 {
            put(b'0' + frame.length());
        }
    }
    for byte in frame.data() {
        put(DIGITS[usize::from(byte >> 4)]);
        put(DIGITS[usize::from(byte & 15)]);
    }
    out.extend_from_slice(text.get(..end).unwrap_or(&[]));
}

/// Appends `(1609459200.123456)`: ten digits of seconds, more where they need more.
fn write_time(out: &mut Vec<u8>, time_ns: u64) {
    let micros = time_ns / 1_000;
    let (mut seconds, mut fraction) = (micros / 1_000_000, micros % 1_000_000);
    let mut text = *b"(00000000000.000000)";
    for slot in text[13..19].iter_mut().rev() {
        *slot = b'0' + (fraction % 10) as u8;
        fraction /= 10;
    }
    for slot in text[1..12].iter_mut().rev() {
        *slot = b'0' + (seconds % 10) as u8;
        seconds /= 10;
    }
    if text[1] == b'0' {
        text[1] = b'(';
        out.extend_from_slice(&text[1..]);
    } else {
        out.extend_from_slice(&text);
    }
}
