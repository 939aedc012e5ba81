//! Block transfers in which something is lost, wrong or late.

mod streams;

use streams::blocks::{DONE, START, acknowledge, download, end, segments};
use streams::{
    COMMAND, CRC, DOMAIN, Line, OUT_OF_MEMORY, SEQUENCE, TIMEOUT, TOO_LONG, TOO_SHORT, VALUE, WORD,
    abort, about, pattern,
};

#[test]
fn a_segment_of_a_download_that_is_out_of_turn_is_ignored() {
    let mut line = Line::new();
    let bytes = pattern(100);
    let all = segments(&bytes);
    line.sdo(about(0xC6, DOMAIN, 1, 100));
    for segment in [0, 1, 1, 0, 2, 4, 5] {
        line.tell(all[segment]);
    }
    let mut answer = [0; 8];
    for segment in &all[6..] {
        answer = line.ask(*segment).first().copied().unwrap_or_default();
    }
    assert_eq!(answer, acknowledge(3, 127), "the fourth is missing");
    let mut rest = segments(&bytes[21..]);
    let last = rest.pop().unwrap();
    for segment in rest {
        line.tell(segment);
    }
    assert_eq!(line.sdo(last), acknowledge(12, 127));
    assert_eq!(line.sdo(end(&bytes)), DONE);
    assert_eq!(line.app.domain, bytes);
}

#[test]
fn a_lost_last_segment_is_asked_for_after_a_fifth_of_a_second() {
    let mut line = Line::new();
    let bytes = pattern(1_000);
    let all = segments(&bytes);
    line.sdo(about(0xC6, DOMAIN, 1, 1_000));
    for segment in &all[..126] {
        line.tell(*segment);
    }
    assert_eq!(line.pass_ms(199), [[0; 8]; 0]);
    assert_eq!(line.pass_ms(1), [acknowledge(126, 127)]);
    let rest = segments(&bytes[126 * 7..]);
    for segment in &rest[..rest.len() - 1] {
        line.tell(*segment);
    }
    assert_eq!(line.pass_ms(200), [acknowledge(rest.len() as u8 - 1, 127)]);
    assert_eq!(
        line.sdo([
            0x81,
            all[142][1],
            all[142][2],
            all[142][3],
            all[142][4],
            all[142][5],
            all[142][6],
            0
        ]),
        acknowledge(1, 127)
    );
    assert_eq!(line.sdo(end(&bytes)), DONE);
    assert_eq!(line.app.domain, bytes);
}

#[test]
fn a_client_that_is_only_slow_is_not_taken_for_one_that_has_lost_something() {
    let mut line = Line::new();
    line.sdo(about(0xC2, DOMAIN, 1, 70));
    let all = segments(&pattern(70));
    line.tell(all[0]);
    line.tell(all[1]);
    assert_eq!(line.pass_ms(200), [acknowledge(2, 127)]);
    // It has not seen that, and goes on. Later it would take the acknowledgement for another one.
    for segment in &all[2..] {
        line.tell(*segment);
    }
    for segment in segments(&pattern(70)[14..]) {
        line.tell(segment);
    }
    assert_eq!(line.pass_ms(199), [[0; 8]; 0]);
    assert_eq!(line.pass_ms(1), [abort(DOMAIN, 1, SEQUENCE)]);
}

#[test]
fn a_block_may_take_long_while_it_goes_on() {
    let mut line = Line::new();
    let bytes = pattern(127 * 7 + 140);
    line.sdo(about(0xC6, DOMAIN, 1, bytes.len() as u32));
    for segment in &segments(&bytes)[..127] {
        line.ask(*segment);
    }
    // The first of the next block is lost; the other nineteen take almost three seconds.
    let rest = segments(&bytes[889..]);
    for segment in &rest[1..19] {
        assert_eq!(line.pass_ms(150), [[0; 8]; 0]);
        line.tell(*segment);
    }
    assert_eq!(line.sdo(rest[19]), acknowledge(0, 127));
    for segment in &rest[..19] {
        line.tell(*segment);
    }
    assert_eq!(line.sdo(rest[19]), acknowledge(20, 127));
    assert_eq!(line.sdo(end(&bytes)), DONE);
    assert_eq!(line.app.domain, bytes);
}

#[test]
fn blocks_that_bring_nothing_come_to_an_end() {
    let mut line = Line::new();
    line.sdo(about(0xC6, DOMAIN, 1, 2_000));
    for round in 0..5 {
        for sequence in 2..127 {
            line.tell([sequence, 0, 0, 0, 0, 0, 0, 0]);
        }
        line.now_us += 100_000;
        let answer = line.sdo([127, 0, 0, 0, 0, 0, 0, 0]);
        if round < 4 {
            assert_eq!(answer, acknowledge(0, 127));
        } else {
            assert_eq!(answer, abort(DOMAIN, 1, TIMEOUT));
        }
    }
    // The same when what comes is always the same.
    line.sdo(about(0xC6, DOMAIN, 1, 2_000));
    let mut answers = Vec::new();
    for _ in 0..20 {
        line.tell([9, 0, 0, 0, 0, 0, 0, 0]);
        answers = line.pass_ms(100);
        if !answers.is_empty() {
            break;
        }
    }
    assert_eq!(answers, [abort(DOMAIN, 1, TIMEOUT)]);
}

#[test]
fn sequence_number_0_ends_the_transfer_when_the_client_listens() {
    let mut line = Line::new();
    line.sdo(about(0xC6, DOMAIN, 1, 2_000));
    line.tell([0; 8]);
    line.tell([1, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(line.pass_ms(200), [abort(DOMAIN, 1, SEQUENCE)]);
    line.sdo(about(0xC6, DOMAIN, 1, 2_000));
    line.tell([1, 0, 0, 0, 0, 0, 0, 0]);
    line.tell([0; 8]);
    assert_eq!(
        line.sdo([127, 0, 0, 0, 0, 0, 0, 0]),
        abort(DOMAIN, 1, SEQUENCE)
    );
}

#[test]
fn a_wrong_crc_writes_nothing() {
    let mut line = Line::new();
    for (index, subindex) in [(VALUE, 0), (DOMAIN, 1)] {
        line.sdo(about(0xC6, index, subindex, 9));
        line.tell(*b"\x011234567");
        line.sdo(*b"\x8289\0\0\0\0\0");
        assert_eq!(
            line.sdo([0xD5, 0xC3, 0x30, 0, 0, 0, 0, 0]),
            abort(index, subindex, CRC)
        );
        // The size is right, but of a byte that was changed.
        line.sdo(about(0xC6, index, subindex, 9));
        line.tell(*b"\x011234568");
        line.sdo(*b"\x8289\0\0\0\0\0");
        assert_eq!(
            line.sdo([0xD5, 0xC3, 0x31, 0, 0, 0, 0, 0]),
            abort(index, subindex, CRC)
        );
    }
    assert_eq!(line.app.values_written, 0);
    assert_eq!(line.app.domain, b"");
}

#[test]
fn a_download_must_bring_what_it_promised() {
    let mut line = Line::new();
    for (index, subindex) in [(VALUE, 0), (DOMAIN, 1)] {
        for (size, code) in [(10, TOO_SHORT), (8, TOO_LONG)] {
            line.sdo(about(0xC6, index, subindex, size));
            line.tell(*b"\x011234567");
            line.sdo(*b"\x8289\0\0\0\0\0");
            assert_eq!(
                line.sdo([0xD5, 0xC3, 0x31, 0, 0, 0, 0, 0]),
                abort(index, subindex, code)
            );
        }
        // Without a promise any length will do.
        line.sdo(about(0xC4, index, subindex, 0));
        line.tell(*b"\x011234567");
        line.sdo(*b"\x8289\0\0\0\0\0");
        assert_eq!(line.sdo([0xD5, 0xC3, 0x31, 0, 0, 0, 0, 0]), DONE);
    }
    let refused = line.sdo(about(0xC6, WORD, 0, 3));
    assert_eq!(refused, abort(WORD, 0, TOO_LONG));
    assert_eq!(line.sdo(about(0xC6, WORD, 0, 1)), abort(WORD, 0, TOO_SHORT));
    assert_eq!(download(&mut line, WORD, 0, &[0x34, 0x12]), DONE);
    assert_eq!(line.app.word, 0x1234);
}

#[test]
fn what_is_wrong_in_a_block_is_said_at_its_end() {
    let mut line = Line::new();
    // An abort in between would have the rest taken for requests, such as this write of 0x2021.
    let like_a_request = [0x2B, 0x21, 0x20, 0, 0xEE, 0xEE, 0, 0];
    line.sdo(about(0xC6, DOMAIN, 1, 20));
    for sequence in 1..127 {
        line.tell([sequence, 0, 0, 0, 0, 0, 0, 0]);
    }
    line.tell(like_a_request);
    assert_eq!(
        line.sdo([127, 0, 0, 0, 0, 0, 0, 0]),
        abort(DOMAIN, 1, TOO_LONG)
    );
    assert_eq!(line.app.word, 0);
    // A value that does not fit, of unknown length.
    line.sdo(about(0xC4, VALUE, 0, 0));
    let mut answers = Vec::new();
    for segment in segments(&pattern(889 + 8)) {
        answers.extend(line.ask(segment));
    }
    assert_eq!(answers[0], acknowledge(127, 127));
    assert_eq!(answers[1], abort(VALUE, 0, OUT_OF_MEMORY));
}

#[test]
fn commands_out_of_turn_end_the_transfer() {
    let upload: &[[u8; 8]] = &[about(0xA4, VALUE, 0, 127)];
    let running: &[[u8; 8]] = &[upload[0], START];
    let ending: &[[u8; 8]] = &[upload[0], START, acknowledge(2, 127)];
    let received: &[[u8; 8]] = &[
        about(0xC6, VALUE, 0, 9),
        *b"\x011234567",
        *b"\x8289\0\0\0\0\0",
    ];
    let segmented_up: &[[u8; 8]] = &[about(0x40, VALUE, 0, 0)];
    let segmented_down: &[[u8; 8]] = &[about(0x21, VALUE, 0, 9)];
    let segment = [0x00, 0, 0, 0, 0, 0, 0, 0];
    let next = [0x60, 0, 0, 0, 0, 0, 0, 0];
    let unknown = [0xE0, 0, 0, 0, 0, 0, 0, 0];
    let end = end(b"123456789");
    for (before, wrong) in [
        (
            upload,
            &[segment, next, acknowledge(1, 1), DONE, end, unknown][..],
        ),
        (running, &[segment, next, START, DONE, end, unknown]),
        (
            ending,
            &[segment, next, START, acknowledge(2, 1), end, unknown],
        ),
        (
            received,
            &[segment, next, START, acknowledge(1, 1), DONE, unknown],
        ),
        (
            segmented_up,
            &[segment, START, acknowledge(1, 1), DONE, end, unknown],
        ),
        (
            segmented_down,
            &[next, START, acknowledge(1, 1), DONE, end, unknown],
        ),
        (
            &[],
            &[segment, next, START, acknowledge(0, 1), DONE, end, unknown],
        ),
    ] {
        for request in wrong {
            let mut line = Line::new();
            line.app.value = b"123456789".to_vec();
            for request in before {
                line.ask(*request);
                line.stream();
            }
            let object = if before.is_empty() { 0 } else { VALUE };
            let answer = line.sdo(*request);
            assert_eq!(answer, abort(object, 0, COMMAND), "{request:02X?}");
            assert_eq!(line.sdo(next), abort(0, 0, COMMAND), "it is over");
            assert_eq!(line.app.values_written, 0);
        }
    }
}

#[test]
fn a_silent_client_loses_its_transfer_in_every_state() {
    let download = about(0xC6, VALUE, 0, 9);
    for (before, silence_ms) in [
        (&[about(0xA4, VALUE, 0, 127)][..], 1_000),
        (&[about(0xA4, VALUE, 0, 127), START], 1_000),
        (
            &[about(0xA4, VALUE, 0, 127), START, acknowledge(2, 9)],
            1_000,
        ),
        (&[download], 1_000),
        (&[download, *b"\x8189\0\0\0\0\0"], 1_000),
    ] {
        let mut line = Line::new();
        line.app.value = b"123456789".to_vec();
        for request in before {
            line.ask(*request);
            line.stream();
        }
        // The last request was heard, or the last segment sent, one or two steps ago.
        let said = line.pass_ms(silence_ms - 3);
        assert_eq!(said, [[0; 8]; 0], "{before:02X?}");
        assert_eq!(line.pass_ms(3), [abort(VALUE, 0, TIMEOUT)]);
        assert_eq!(line.pass_ms(3_000), [[0; 8]; 0]);
    }
    // In the middle of a block the server says first what it has.
    let mut line = Line::new();
    line.sdo(download);
    line.tell(*b"\x011234567");
    assert_eq!(
        line.pass_ms(1_000),
        [acknowledge(1, 127), abort(VALUE, 0, TIMEOUT)]
    );
}
