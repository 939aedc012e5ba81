//! Block transfers, byte by byte (CiA 301, 7.2.4.3.9 to 7.2.4.3.16).

mod streams;

use streams::blocks::{DONE, START, acknowledge, download, end, upload};
use streams::{
    BLOCK_SIZE, COMMAND, DOMAIN, Line, OUT_OF_MEMORY, SEQUENCE, VALUE, abort, about, pattern,
};

#[test]
fn the_standard_s_bytes_of_a_download() {
    let mut line = Line::new();
    for (request, answer) in [
        (
            [0xC6, 0x20, 0x20, 0, 9, 0, 0, 0],
            Some([0xA4, 0x20, 0x20, 0, 127, 0, 0, 0]),
        ),
        (*b"\x011234567", None),
        (
            *b"\x8289\xEE\xEE\xEE\xEE\xEE",
            Some([0xA2, 2, 127, 0, 0, 0, 0, 0]),
        ),
        // Five bytes do not count; the check value of CRC-16/XMODEM.
        (
            [0xD5, 0xC3, 0x31, 0, 0, 0, 0, 0],
            Some([0xA1, 0, 0, 0, 0, 0, 0, 0]),
        ),
    ] {
        assert_eq!(line.app.values_written, 0);
        assert_eq!(line.ask(request), Vec::from_iter(answer));
    }
    assert_eq!(line.app.value, b"123456789");
    assert_eq!(line.app.values_written, 1);
}

#[test]
fn the_standard_s_bytes_of_an_upload() {
    let mut line = Line::new();
    line.app.value = b"123456789".to_vec();
    assert_eq!(
        line.sdo([0xA4, 0x20, 0x20, 0, 127, 0, 0, 0]),
        [0xC6, 0x20, 0x20, 0, 9, 0, 0, 0]
    );
    line.tell([0xA3, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(line.stream(), [*b"\x011234567", *b"\x8289\0\0\0\0\0"]);
    assert_eq!(
        line.sdo([0xA2, 2, 127, 0, 0, 0, 0, 0]),
        [0xD5, 0xC3, 0x31, 0, 0, 0, 0, 0]
    );
    line.tell([0xA1, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(line.sdo(DONE), abort(0, 0, COMMAND), "it is over");
}

#[test]
fn a_client_without_crc_gets_none_and_gives_none() {
    let mut line = Line::new();
    line.sdo([0xC2, 0x20, 0x20, 0, 9, 0, 0, 0]);
    line.tell(*b"\x011234567");
    line.sdo(*b"\x8289\0\0\0\0\0");
    assert_eq!(line.sdo([0xD5, 0xAB, 0xCD, 0, 0, 0, 0, 0]), DONE);
    assert_eq!(line.app.value, b"123456789");

    assert_eq!(
        line.sdo([0xA0, 0x20, 0x20, 0, 127, 0, 0, 0]),
        [0xC2, 0x20, 0x20, 0, 9, 0, 0, 0]
    );
    line.tell(START);
    line.stream();
    assert_eq!(line.sdo(acknowledge(2, 127)), [0xD5, 0, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn every_length_comes_back_as_it_went() {
    let mut line = Line::new();
    for length in [0, 1, 6, 7, 8, 14, 888, 889, 890, 2_000, 10_000] {
        let bytes = pattern(length);
        assert_eq!(download(&mut line, DOMAIN, 1, &bytes), DONE, "{length}");
        assert_eq!(line.app.domain, bytes);
        assert_eq!(upload(&mut line, DOMAIN, 1, 127), bytes);
        let answer = download(&mut line, VALUE, 0, &bytes);
        if length > 889 {
            assert_eq!(answer, abort(VALUE, 0, OUT_OF_MEMORY));
            continue;
        }
        assert_eq!(answer, DONE, "{length}");
        assert_eq!(line.app.value, bytes);
        assert_eq!(upload(&mut line, VALUE, 0, 127), bytes);
    }
    for length in 0..200 {
        let bytes = pattern(length);
        assert_eq!(download(&mut line, DOMAIN, 1, &bytes), DONE, "{length}");
        assert_eq!(upload(&mut line, DOMAIN, 1, 10), bytes);
    }
}

#[test]
fn every_block_size_will_do() {
    let mut line = Line::new();
    line.app.domain = pattern(2_000);
    for size in 1..=127 {
        assert_eq!(upload(&mut line, DOMAIN, 2, size), line.app.domain);
    }
    for size in [0, 128, 255] {
        assert_eq!(
            line.sdo(about(0xA4, DOMAIN, 2, size)),
            abort(DOMAIN, 2, BLOCK_SIZE)
        );
        line.sdo(about(0xA4, DOMAIN, 2, 1));
        line.tell(START);
        line.stream();
        let answer = line.sdo(acknowledge(1, size as u8));
        assert_eq!(answer, abort(DOMAIN, 2, BLOCK_SIZE));
        assert_eq!(line.stream(), [[0; 8]; 0], "the transfer is over");
    }
}

#[test]
fn the_block_size_may_change_with_every_block() {
    let mut line = Line::new();
    line.app.domain = pattern(500);
    line.sdo(about(0xA4, DOMAIN, 1, 3));
    line.tell(START);
    let mut bytes: Vec<u8> = Vec::new();
    for (expected, next) in [(3, 20), (20, 1), (1, 127), (48, 127)] {
        let block = line.stream();
        assert_eq!(block.len(), expected);
        bytes.extend(block.iter().flat_map(|segment| &segment[1..]));
        line.ask(acknowledge(expected as u8, next));
    }
    line.tell(DONE);
    assert_eq!(bytes[..500], line.app.domain);
}

#[test]
fn what_is_short_enough_for_the_client_comes_without_blocks() {
    let mut line = Line::new();
    line.app.value = b"123456789".to_vec();
    let with_threshold = |threshold: u32| about(0xA4, VALUE, 0, threshold << 8 | 127);
    assert_eq!(line.sdo(with_threshold(9)), about(0x41, VALUE, 0, 9));
    assert_eq!(line.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]), *b"\x001234567");
    assert_eq!(line.sdo([0x70, 0, 0, 0, 0, 0, 0, 0]), *b"\x1B89\0\0\0\0\0");
    assert_eq!(line.sdo(with_threshold(8)), about(0xC6, VALUE, 0, 9));
    line.app.value = vec![0xAB, 0xCD];
    assert_eq!(line.sdo(with_threshold(2)), about(0x4B, VALUE, 0, 0xCDAB));
    line.app.domain = pattern(20);
    let answer = line.sdo(about(0xA4, DOMAIN, 1, 255 << 8 | 127));
    assert_eq!(answer, about(0x41, DOMAIN, 1, 20));
}

#[test]
fn lost_segments_of_an_upload_are_sent_again_without_asking_twice() {
    let mut line = Line::new();
    line.app.domain = pattern(889 + 100);
    line.sdo(about(0xA4, DOMAIN, 1, 127));
    line.tell(START);
    let first = line.stream();
    assert_eq!(first.len(), 127);
    assert_eq!(line.app.read, 889);
    // None of them has arrived, then four, then all but the last.
    line.tell(acknowledge(0, 127));
    assert_eq!(line.stream(), first);
    assert_eq!(line.app.read, 889);
    line.tell(acknowledge(4, 123));
    let again = line.stream();
    assert_eq!(again.len(), 123);
    for (segment, (number, old)) in again.iter().zip((1..).zip(&first[4..])) {
        assert_eq!((segment[0], &segment[1..]), (number, &old[1..]));
    }
    line.tell(acknowledge(122, 127));
    let rest = line.stream();
    assert_eq!(rest[0][1..], first[126][1..]);
    assert_eq!(rest.len(), 1 + 15);
    assert_eq!(line.app.read, 989);
    // The client has lost the end, and asks for a part of the last block.
    line.tell(acknowledge(15, 127));
    let last = line.stream();
    assert_eq!(last.len(), 1);
    assert_eq!(last[0][0], 0x81);
    assert_eq!(line.sdo(acknowledge(1, 127)), end(&pattern(989)));
}

#[test]
fn an_acknowledgement_in_the_middle_of_a_block_starts_the_next() {
    let mut line = Line::new();
    line.app.domain = pattern(700);
    line.sdo(about(0xA4, DOMAIN, 1, 100));
    line.tell(START);
    assert_eq!(line.pass_ms(4).len(), 16);
    line.tell(acknowledge(10, 90));
    let again = line.stream();
    assert_eq!(again.len(), 90);
    assert_eq!(again[0][1..], line.app.domain[70..77]);
    assert_eq!(line.sdo(acknowledge(90, 90)), end(&pattern(700)));
}

#[test]
fn nobody_can_have_more_than_was_sent() {
    let mut line = Line::new();
    line.app.domain = pattern(100);
    line.sdo(about(0xA4, DOMAIN, 1, 5));
    line.tell(START);
    line.stream();
    assert_eq!(line.sdo(acknowledge(6, 5)), abort(DOMAIN, 1, SEQUENCE));
    assert_eq!(line.stream(), [[0; 8]; 0]);
}
