use eel_protocol::Frame;
use embedded_can::{ExtendedId, StandardId};

use super::*;

fn frame_of(line: &str) -> Record<'_> {
    match parse_line(line.as_bytes()) {
        Ok(Line::Frame(record)) => record,
        other => panic!("{line}: {other:?}"),
    }
}

fn error_of(line: &str) -> (usize, ParseErrorKind) {
    let error = parse_line(line.as_bytes()).expect_err(line);
    (error.column, error.kind)
}

#[test]
fn reads_what_candump_writes() {
    let record = frame_of("(1609459200.123456) vcan0 123#DEADBEEF\n");
    assert_eq!(record.time_ns, 1_609_459_200_123_456_000);
    assert_eq!(record.interface, "vcan0");
    assert_eq!(
        record.frame,
        Frame::standard(0x123, &[0xDE, 0xAD, 0xBE, 0xEF]).unwrap()
    );
    assert_eq!(record.direction, None);
}

#[test]
fn tells_a_short_identifier_from_a_long_one_by_its_digits() {
    let short = frame_of("(0.0) can0 001#");
    assert_eq!(
        short.frame,
        Frame::new(StandardId::new(1).unwrap(), &[]).unwrap()
    );
    let long = frame_of("(0.0) can0 00000001#");
    assert_eq!(
        long.frame,
        Frame::new(ExtendedId::new(1).unwrap(), &[]).unwrap()
    );
}

#[test]
fn reads_remote_frames_with_and_without_a_length() {
    let id = StandardId::new(0x701).unwrap();
    assert_eq!(
        frame_of("(0.0) c 701#R").frame,
        Frame::remote(id, 0).unwrap()
    );
    assert_eq!(
        frame_of("(0.0) c 701#R4 T").frame,
        Frame::remote(id, 4).unwrap()
    );
    assert_eq!(
        frame_of("(0.0) c 701#R4 T").direction,
        Some(Direction::Transmitted)
    );
    let long = ExtendedId::new(0x1234_5678).unwrap();
    assert_eq!(
        frame_of("(0.0) c 12345678#R8 R").frame,
        Frame::remote(long, 8).unwrap()
    );
}

#[test]
fn keeps_nanoseconds_that_a_line_gives() {
    assert_eq!(frame_of("(1.000000001) c 1FF#").time_ns, 1_000_000_001);
    assert_eq!(frame_of("(1.5) c 1FF#").time_ns, 1_500_000_000);
    assert_eq!(frame_of("(18446744073.709551615) c 1FF#").time_ns, u64::MAX);
}

#[test]
fn an_error_report_is_no_frame() {
    let line = "(1.0) can0 20000088#0000080000000000";
    let Ok(Line::Error(record)) = parse_line(line.as_bytes()) else {
        panic!()
    };
    assert_eq!(record.frame.classes, 0x88);
    assert_eq!(record.frame.data, [0, 0, 8, 0, 0, 0, 0, 0]);
}

#[test]
fn a_flexible_frame_is_a_kind_of_its_own() {
    let line = "(1.0) can0 123##1001122334455667788990011";
    let Ok(Line::Flexible(record)) = parse_line(line.as_bytes()) else {
        panic!()
    };
    assert_eq!(record.frame.flags, 1);
    assert_eq!(record.frame.frame.length(), 12);
    assert_eq!(
        error_of("(1.0) can0 123##1112233445566778899").1,
        ParseErrorKind::Flexible
    );
}

#[test]
fn says_in_which_column_a_line_goes_wrong() {
    use ParseErrorKind::*;
    for (line, column, kind) in [
        ("", 1, Time),
        ("1.0 can0 123#", 1, Time),
        ("(1) can0 123#", 3, Time),
        ("(1.) can0 123#", 4, Time),
        ("(1.0000000001) can0 123#", 13, Time),
        ("(18446744073.709551616) can0 123#", 1, TimeTooLate),
        ("(1.0)", 6, Interface),
        ("(1.0) can0", 11, Interface),
        ("(1.0) can0 12#", 14, Identifier),
        ("(1.0) can0 12G#", 14, Identifier),
        ("(1.0) can0 1234#", 16, Identifier),
        ("(1.0) can0 123456789#", 20, Identifier),
        ("(1.0) can0 800#", 12, IdentifierTooLarge),
        ("(1.0) can0 40000000#", 12, IdentifierTooLarge),
        ("(1.0) can0 123#1", 17, Data),
        ("(1.0) can0 123#1G", 17, Data),
        ("(1.0) can0 123#112233445566778899", 32, TooMuchData),
        ("(1.0) can0 123#R9", 17, RemoteLength),
        ("(1.0) can0 123#R12", 18, RemoteLength),
        ("(1.0) can0 123#1122334455667788_B", 32, LengthCode),
        ("(1.0) can0 123#81:00:12345678#11", 18, ExtraLong),
        ("(1.0) can0 123#11 X", 19, Trailing),
        ("(1.0) can0 123#11 R 1", 20, Trailing),
    ] {
        assert_eq!(error_of(line), (column, kind), "{line}");
    }
    let error = parse_line(b"(1.0) can0 800#").unwrap_err();
    assert_eq!(
        error.to_string(),
        "12: the identifier is too large: at most 7FF with 3 digits, 1FFFFFFF with 8"
    );
}

#[test]
fn what_is_written_reads_back_the_same() {
    for line in [
        "(1609459200.123456) vcan0 123#DEADBEEF",
        "(0000000000.000000) vcan0 000#",
        "(0000000007.000042) can0 1FFFFFFF#0011223344556677 R",
        "(18446744073.709551) can1 00000000#R T",
        "(0000000007.000042) can0 7FF#R8",
    ] {
        assert_eq!(format_line(&frame_of(line)), line);
    }
}

#[test]
fn cuts_the_time_to_microseconds_when_it_writes() {
    let frame = Frame::standard(0x80, &[1]).unwrap();
    let record = Record {
        time_ns: 1_999_999_999,
        interface: "eel",
        frame,
        direction: None,
    };
    assert_eq!(format_line(&record), "(0000000001.999999) eel 080#01");
}

#[test]
fn survives_every_damaged_line() {
    let good = "(1609459200.123456) vcan0 123##1DEADBEEF R";
    for at in 0..good.len() {
        for byte in 0..=255u8 {
            let mut line = good.as_bytes().to_vec();
            line[at] = byte;
            if let Err(error) = parse_line(&line) {
                assert!(error.column <= line.len() + 1, "{line:?}");
            }
            let _ = parse_line(&line[..at]);
        }
    }
}

#[test]
fn a_frame_alone_must_be_alone_and_sendable() {
    assert_eq!(
        parse_frame("080#07").unwrap(),
        Frame::standard(0x080, &[7]).unwrap()
    );
    assert_eq!(
        parse_frame("080#07 R").unwrap_err().kind,
        ParseErrorKind::Trailing
    );
    assert_eq!(
        parse_frame("080##107").unwrap_err().kind,
        ParseErrorKind::Flexible
    );
    assert!(parse_frame("20000001#0000000000000000").is_err());
}
