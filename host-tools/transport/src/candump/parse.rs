//! From text to frames, without a copy and without an allocation.

use std::fmt;

use eel_protocol::{Frame, Id};
use embedded_can::{ExtendedId, StandardId};

use super::{Direction, FlexibleFrame, Line, Record};
use crate::bus::ErrorFrame;

/// Marks an error report in an 8-digit identifier.
const ERROR_FLAG: u32 = 0x2000_0000;
/// The bits of an error report's classes, and of a 29-bit identifier.
const EXTENDED_MASK: u32 = 0x1FFF_FFFF;
/// The greatest number of characters of an interface's name.
const NAME_MAX: usize = 32;

/// What is wrong with a line, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParseError {
    /// The column of the first character that can't be right, counted from 1.
    pub column: usize,
    /// What was expected there.
    pub kind: ParseErrorKind,
}

/// What was expected and not found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParseErrorKind {
    /// The line does not begin with a time such as `(1609459200.123456)`.
    Time,
    /// The time is beyond the year 2554.
    TimeTooLate,
    /// There is no interface such as `vcan0`.
    Interface,
    /// There is no identifier of 3 or 8 hexadecimal digits before `#`.
    Identifier,
    /// A 3-digit identifier is above 7FF, or an 8-digit one above 1FFFFFFF.
    IdentifierTooLarge,
    /// A byte is not two hexadecimal digits.
    Data,
    /// A classic frame has more than 8 bytes, or a CAN FD frame more than 64.
    TooMuchData,
    /// A CAN FD frame has no flags digit, or a length that its length code can't say.
    Flexible,
    /// The length of a remote frame is no digit from 0 to 8.
    RemoteLength,
    /// The frame has a length code above 8 (`_9` to `_F`), which this project does not keep.
    LengthCode,
    /// The frame is CAN XL, which this project does not read.
    ExtraLong,
    /// After the frame comes something that is neither `R` nor `T`.
    Trailing,
}

impl fmt::Display for ParseErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Time => "expected a time such as (1609459200.123456)",
            Self::TimeTooLate => "the time is beyond the year 2554",
            Self::Interface => "expected an interface such as vcan0",
            Self::Identifier => "expected an identifier of 3 or 8 hexadecimal digits and #",
            Self::IdentifierTooLarge => {
                "the identifier is too large: at most 7FF with 3 digits, 1FFFFFFF with 8"
            }
            Self::Data => "expected data bytes of two hexadecimal digits",
            Self::TooMuchData => "too many data bytes: a classic frame has 8, a CAN FD frame 64",
            Self::Flexible => "the CAN FD frame has no flags digit or a length that can't be",
            Self::RemoteLength => "the length of a remote frame is a digit from 0 to 8",
            Self::LengthCode => "length codes above 8 are not supported",
            Self::ExtraLong => "CAN XL frames are not supported",
            Self::Trailing => "expected R, T or the end of the line after the frame",
        })
    }
}

impl fmt::Display for ParseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.column, self.kind)
    }
}

impl std::error::Error for ParseError {}

/// Reads one line, with or without its line end.
///
/// # Errors
/// The column and the kind of the first thing that is not as candump writes it.
pub fn parse_line(line: &[u8]) -> Result<Line<'_>, ParseError> {
    let mut text = Text {
        bytes: line.trim_ascii_end(),
        at: 0,
    };
    text.skip_blanks();
    let time_ns = time(&mut text)?;
    text.skip_blanks();
    let interface = interface(&mut text)?;
    text.skip_blanks();
    let body = body(&mut text)?;
    let direction = direction(&mut text)?;
    Ok(match body {
        Body::Frame(frame) => Line::Frame(Record {
            time_ns,
            interface,
            frame,
            direction,
        }),
        Body::Flexible(frame) => Line::Flexible(Record {
            time_ns,
            interface,
            frame,
            direction,
        }),
        Body::Error(frame) => Line::Error(Record {
            time_ns,
            interface,
            frame,
            direction,
        }),
    })
}

/// Reads a classic frame alone, such as `123#DEADBEEF` or `12345678#R4`.
///
/// # Errors
/// As [`parse_line`]; CAN FD frames and error reports are refused, as nobody can send them here.
pub fn parse_frame(text: &str) -> Result<Frame, ParseError> {
    let mut text = Text {
        bytes: text.as_bytes(),
        at: 0,
    };
    match body(&mut text)? {
        Body::Frame(_) if text.peek().is_some() => Err(text.error(ParseErrorKind::Trailing)),
        Body::Frame(frame) => Ok(frame),
        Body::Flexible(_) => Err(ParseError {
            column: 1,
            kind: ParseErrorKind::Flexible,
        }),
        Body::Error(_) => Err(ParseError {
            column: 1,
            kind: ParseErrorKind::IdentifierTooLarge,
        }),
    }
}

enum Body {
    Frame(Frame),
    Flexible(FlexibleFrame),
    Error(ErrorFrame),
}

struct Text<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Text<'_> {
    #[inline]
    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    #[inline]
    fn take(&mut self, byte: u8) -> bool {
        let found = self.peek() == Some(byte);
        self.at += usize::from(found);
        found
    }

    #[inline]
    fn skip_blanks(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t')) {
            self.at += 1;
        }
    }

    /// Takes one hexadecimal digit.
    #[inline]
    fn digit(&mut self) -> Option<u8> {
        let value = HEX[usize::from(self.peek()?)];
        if value > 15 {
            return None;
        }
        self.at += 1;
        Some(value)
    }

    fn error(&self, kind: ParseErrorKind) -> ParseError {
        ParseError {
            column: self.at + 1,
            kind,
        }
    }
}

/// The value of a hexadecimal digit, or 255.
static HEX: [u8; 256] = hex_table();

const fn hex_table() -> [u8; 256] {
    let mut table = [255; 256];
    let mut value = 0;
    while value < 16 {
        table[b"0123456789ABCDEF"[value as usize] as usize] = value;
        table[b"0123456789abcdef"[value as usize] as usize] = value;
        value += 1;
    }
    table
}

/// Reads `(seconds.fraction)` with one to nine digits of fraction.
fn time(text: &mut Text<'_>) -> Result<u64, ParseError> {
    let start = text.error(ParseErrorKind::TimeTooLate);
    if !text.take(b'(') {
        return Err(text.error(ParseErrorKind::Time));
    }
    let (seconds, digits) = decimal(text, 11);
    if digits == 0 || !text.take(b'.') {
        return Err(text.error(ParseErrorKind::Time));
    }
    let (fraction, digits) = decimal(text, 9);
    if digits == 0 || !text.take(b')') {
        return Err(text.error(ParseErrorKind::Time));
    }
    let nanoseconds = fraction * POWERS[9 - digits];
    seconds
        .checked_mul(1_000_000_000)
        .and_then(|whole| whole.checked_add(nanoseconds))
        .ok_or(start)
}

const POWERS: [u64; 10] = [
    1,
    10,
    100,
    1_000,
    10_000,
    100_000,
    1_000_000,
    10_000_000,
    100_000_000,
    1_000_000_000,
];

/// Reads at most `max` decimal digits; returns their value and number.
#[inline]
fn decimal(text: &mut Text<'_>, max: usize) -> (u64, usize) {
    let mut value = 0u64;
    let mut digits = 0;
    while digits < max {
        let Some(byte @ b'0'..=b'9') = text.peek() else {
            break;
        };
        value = value * 10 + u64::from(byte - b'0');
        text.at += 1;
        digits += 1;
    }
    (value, digits)
}

fn interface<'a>(text: &mut Text<'a>) -> Result<&'a str, ParseError> {
    let start = text.at;
    while matches!(text.peek(), Some(0x21..=0x7E)) && text.at - start < NAME_MAX {
        text.at += 1;
    }
    let name = text.bytes.get(start..text.at).unwrap_or(&[]);
    match std::str::from_utf8(name) {
        Ok(name) if !name.is_empty() && text.peek() == Some(b' ') => Ok(name),
        _ => Err(text.error(ParseErrorKind::Interface)),
    }
}

fn body(text: &mut Text<'_>) -> Result<Body, ParseError> {
    let start = text.at;
    let mut raw = 0u32;
    while text.at - start < 8 {
        let Some(digit) = text.digit() else { break };
        raw = raw << 4 | u32::from(digit);
    }
    let digits = text.at - start;
    if !(digits == 3 || digits == 8) || !text.take(b'#') {
        return Err(text.error(ParseErrorKind::Identifier));
    }
    if digits == 8 && raw & !EXTENDED_MASK == ERROR_FLAG {
        return error_frame(text, raw & EXTENDED_MASK);
    }
    let too_large = ParseError {
        column: start + 1,
        kind: ParseErrorKind::IdentifierTooLarge,
    };
    let id: Id = if digits == 3 {
        StandardId::new(raw as u16).ok_or(too_large)?.into()
    } else {
        ExtendedId::new(raw).ok_or(too_large)?.into()
    };
    match text.peek() {
        Some(b'#') => flexible(text, id),
        Some(b'R' | b'r') => remote(text, id),
        _ => {
            let (length, bytes) = data::<8>(text)?;
            let frame = bytes.get(..length).and_then(|data| Frame::new(id, data));
            frame
                .map(Body::Frame)
                .ok_or_else(|| text.error(ParseErrorKind::TooMuchData))
        }
    }
}

/// Reads bytes of two digits, with or without dots between them.
#[inline]
fn data<const N: usize>(text: &mut Text<'_>) -> Result<(usize, [u8; N]), ParseError> {
    let mut bytes = [0; N];
    let mut length = 0;
    while let Some(high) = text.digit() {
        let Some(low) = text.digit() else {
            return Err(text.error(ParseErrorKind::Data));
        };
        let Some(byte) = bytes.get_mut(length) else {
            text.at -= 2;
            return Err(text.error(ParseErrorKind::TooMuchData));
        };
        *byte = high << 4 | low;
        length += 1;
        text.take(b'.');
    }
    match text.peek() {
        None | Some(b' ' | b'\t') => Ok((length, bytes)),
        Some(b'_') => Err(text.error(ParseErrorKind::LengthCode)),
        Some(b':') => Err(text.error(ParseErrorKind::ExtraLong)),
        Some(_) => Err(text.error(ParseErrorKind::Data)),
    }
}

fn remote(text: &mut Text<'_>, id: Id) -> Result<Body, ParseError> {
    text.at += 1;
    let length = match text.peek() {
        None | Some(b' ' | b'\t') => 0,
        Some(byte @ b'0'..=b'8') => {
            text.at += 1;
            byte - b'0'
        }
        Some(_) => return Err(text.error(ParseErrorKind::RemoteLength)),
    };
    match text.peek() {
        None | Some(b' ' | b'\t') => {}
        Some(b'_') => return Err(text.error(ParseErrorKind::LengthCode)),
        Some(_) => return Err(text.error(ParseErrorKind::RemoteLength)),
    }
    let frame = Frame::remote(id, length);
    frame
        .map(Body::Frame)
        .ok_or_else(|| text.error(ParseErrorKind::RemoteLength))
}

fn flexible(text: &mut Text<'_>, id: Id) -> Result<Body, ParseError> {
    text.at += 1;
    let Some(flags) = text.digit() else {
        return Err(text.error(ParseErrorKind::Flexible));
    };
    let (length, bytes) = data::<64>(text)?;
    let possible = length <= 8 || matches!(length, 12 | 16 | 20 | 24 | 32 | 48 | 64);
    let frame = bytes
        .get(..length)
        .and_then(|data| Frame::<64>::new(id, data));
    match frame {
        Some(frame) if possible => Ok(Body::Flexible(FlexibleFrame { frame, flags })),
        _ => Err(text.error(ParseErrorKind::Flexible)),
    }
}

fn error_frame(text: &mut Text<'_>, classes: u32) -> Result<Body, ParseError> {
    let (_, data) = data::<8>(text)?;
    Ok(Body::Error(ErrorFrame { classes, data }))
}

fn direction(text: &mut Text<'_>) -> Result<Option<Direction>, ParseError> {
    text.skip_blanks();
    let direction = match text.peek() {
        None => return Ok(None),
        Some(b'R') => Direction::Received,
        Some(b'T') => Direction::Transmitted,
        Some(_) => return Err(text.error(ParseErrorKind::Trailing)),
    };
    text.at += 1;
    match text.peek() {
        None => Ok(Some(direction)),
        Some(_) => Err(text.error(ParseErrorKind::Trailing)),
    }
}
