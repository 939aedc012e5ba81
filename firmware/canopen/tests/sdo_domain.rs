//! Domains stream through the SDO server, and whatever breaks a download off ends it exactly once.
//! (The application of these tests checks order, gaps and pairing on every call.)

mod streams;

use eel_canopen::Abort;
use streams::blocks::{DONE, START, acknowledge, download, end, segments, upload};
use streams::{
    CRC, Call, DEVICE_STATE, DOMAIN, GENERAL, Line, NO_OBJECT, NOT_MAPPABLE, READ_ONLY, Random,
    TIMEOUT, TOGGLE, TOO_LONG, TOO_SHORT, VALUE, WRITE_ONLY, abort, about, pattern,
};

const HARDWARE: u32 = 0x0606_0000;

/// Downloads in segments and returns the last answer.
fn download_segmented(line: &mut Line, size: Option<u32>, bytes: &[u8]) -> [u8; 8] {
    let command = if size.is_some() { 0x21 } else { 0x20 };
    let mut answer = line.sdo(about(command, DOMAIN, 1, size.unwrap_or(0)));
    let count = bytes.len().div_ceil(7).max(1);
    for number in 0..count {
        if answer[0] == 0x80 {
            break;
        }
        let part = &bytes[number * 7..bytes.len().min(number * 7 + 7)];
        let mut request = [0xEE; 8];
        let last = u8::from(number + 1 == count);
        request[0] = (number as u8 & 1) << 4 | (7 - part.len() as u8) << 1 | last;
        request[1..=part.len()].copy_from_slice(part);
        answer = line.sdo(request);
    }
    answer
}

/// Uploads in segments.
fn upload_segmented(line: &mut Line) -> Vec<u8> {
    let answer = line.sdo(about(0x40, DOMAIN, 1, 0));
    if answer[0] & 2 != 0 {
        return answer[4..8 - usize::from(answer[0] >> 2 & 3)].to_vec();
    }
    let length = u32::from_le_bytes(answer[4..].try_into().unwrap());
    let mut bytes = Vec::new();
    for toggle in [0x00, 0x10].into_iter().cycle() {
        let [flags, data @ ..] = line.sdo([0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(flags & 0xF0, toggle);
        bytes.extend(&data[..7 - usize::from(flags >> 1 & 7)]);
        if flags & 1 != 0 {
            break;
        }
    }
    assert_eq!(bytes.len(), length as usize);
    bytes
}

#[test]
fn every_length_goes_and_comes_in_segments() {
    let mut line = Line::new();
    for length in (0..40).chain([888, 889, 890, 2_000, 10_000]) {
        let bytes = pattern(length);
        for size in [None, Some(length as u32)] {
            line.app.domain.clear();
            let answer = download_segmented(&mut line, size, &bytes);
            assert_eq!(answer[0] & 0xE0, 0x20, "{length}");
            assert_eq!(line.app.domain, bytes);
            let calls = [
                Call::Begin(DOMAIN, 1, size),
                Call::End(DOMAIN, 1, Some(length as u32)),
            ];
            assert_eq!(line.app.calls(), calls);
        }
        assert_eq!(upload_segmented(&mut line), bytes);
    }
}

#[test]
fn four_bytes_go_in_one_message() {
    let mut line = Line::new();
    assert_eq!(
        line.sdo([0x27, 0x30, 0x20, 1, 1, 2, 3, 0xEE]),
        [0x60, 0x30, 0x20, 1, 0, 0, 0, 0]
    );
    assert_eq!(line.app.domain, [1, 2, 3]);
    assert_eq!(
        line.app.calls(),
        [
            Call::Begin(DOMAIN, 1, Some(3)),
            Call::End(DOMAIN, 1, Some(3))
        ]
    );
    assert_eq!(
        line.sdo(about(0x40, DOMAIN, 1, 0)),
        [0x47, 0x30, 0x20, 1, 1, 2, 3, 0]
    );
    line.sdo([0x22, 0x30, 0x20, 1, 5, 6, 7, 8]);
    assert_eq!(line.app.domain, [5, 6, 7, 8]);
    assert_eq!(
        line.app.calls(),
        [Call::Begin(DOMAIN, 1, None), Call::End(DOMAIN, 1, Some(4))]
    );
}

#[test]
fn a_domain_of_unknown_length_goes_in_blocks() {
    let mut line = Line::new();
    let bytes = pattern(2_000);
    line.sdo(about(0xC4, DOMAIN, 3, 0));
    for segment in segments(&bytes) {
        line.ask(segment);
    }
    assert_eq!(line.app.calls(), [Call::Begin(DOMAIN, 3, None)]);
    assert!(line.app.is_writing());
    assert_eq!(line.sdo(end(&bytes)), DONE);
    assert_eq!(line.app.calls(), [Call::End(DOMAIN, 3, Some(2_000))]);
    assert_eq!(line.app.domain, bytes);
}

#[test]
fn says_why_a_domain_can_not_be_accessed() {
    let mut line = Line::new();
    for read in [0x40, 0xA4] {
        let request = about(read, DOMAIN, 3, 127);
        assert_eq!(line.sdo(request), abort(DOMAIN, 3, WRITE_ONLY));
    }
    for write in [0x23, 0x21, 0xC6] {
        let request = about(write, DOMAIN, 2, 4);
        assert_eq!(line.sdo(request), abort(DOMAIN, 2, READ_ONLY));
    }
    line.app.refuse_open = Some(Abort::NoData);
    line.app.refuse_begin = Some(Abort::DeviceState);
    for read in [0x40, 0xA4] {
        let request = about(read, DOMAIN, 1, 127);
        assert_eq!(line.sdo(request), abort(DOMAIN, 1, 0x0800_0024));
    }
    for write in [0x23, 0x21, 0xC6] {
        let request = about(write, DOMAIN, 1, 4);
        assert_eq!(line.sdo(request), abort(DOMAIN, 1, DEVICE_STATE));
    }
    assert_eq!(line.app.calls(), [], "what was not begun is not ended");
}

#[test]
fn a_domain_that_fails_while_it_is_read_ends_the_transfer() {
    for (cut, code) in [(false, HARDWARE), (true, GENERAL)] {
        let mut line = Line::new();
        line.app.domain = pattern(100);
        let at = Some(21);
        (line.app.fail_at, line.app.cut_at) = if cut { (None, at) } else { (at, None) };
        line.sdo(about(0xA4, DOMAIN, 1, 127));
        line.tell(START);
        let said = line.stream();
        assert_eq!(said.len(), 4);
        assert_eq!(said[3], abort(DOMAIN, 1, code));
        line.sdo(about(0x40, DOMAIN, 1, 0));
        for toggle in [0x60, 0x70, 0x60] {
            line.sdo([toggle, 0, 0, 0, 0, 0, 0, 0]);
        }
        assert_eq!(
            line.sdo([0x70, 0, 0, 0, 0, 0, 0, 0]),
            abort(DOMAIN, 1, code)
        );
        // It may work again the next time.
        (line.app.fail_at, line.app.cut_at) = (None, None);
        assert_eq!(upload(&mut line, DOMAIN, 1, 127), pattern(100));
    }
}

#[test]
fn a_domain_that_fails_while_it_is_written_is_ended() {
    let void = Call::End(DOMAIN, 1, None);
    let mut line = Line::new();
    let bytes = pattern(2_000);
    line.app.fail_at = Some(21);
    assert_eq!(
        download(&mut line, DOMAIN, 1, &bytes),
        abort(DOMAIN, 1, HARDWARE)
    );
    assert_eq!(line.app.calls()[1..], [void]);
    let answer = download_segmented(&mut line, None, &bytes);
    assert_eq!(answer, abort(DOMAIN, 1, HARDWARE));
    assert_eq!(line.app.calls()[1..], [void]);
    // The last bytes come with the end.
    line.app.fail_at = Some(1_995);
    assert_eq!(
        download(&mut line, DOMAIN, 1, &bytes),
        abort(DOMAIN, 1, HARDWARE)
    );
    assert_eq!(line.app.calls()[1..], [void]);
    line.app.fail_at = Some(0);
    assert_eq!(
        line.sdo(about(0x23, DOMAIN, 1, 0)),
        abort(DOMAIN, 1, HARDWARE)
    );
    assert_eq!(line.app.calls()[1..], [void]);
    // Who refuses the end has been told the end.
    line.app.fail_at = None;
    line.app.refuse_end = Some(Abort::Transfer);
    for length in [4, 2_000] {
        assert_eq!(
            download(&mut line, DOMAIN, 1, &pattern(length)),
            abort(DOMAIN, 1, 0x0800_0020)
        );
        assert_eq!(
            line.app.calls()[1..],
            [Call::End(DOMAIN, 1, Some(length as u32))]
        );
    }
    assert_eq!(line.app.domain, b"");
}

/// Does something to a node that receives a domain, and returns what it says.
type Break = fn(&mut Line) -> Vec<[u8; 8]>;

#[test]
fn whatever_breaks_a_download_off_ends_the_domain_once() {
    let by_segments: &[[u8; 8]] = &[about(0x21, DOMAIN, 1, 100), [0, 1, 2, 3, 4, 5, 6, 7]];
    let by_blocks: &[[u8; 8]] = &[about(0xC6, DOMAIN, 1, 100), [1, 1, 2, 3, 4, 5, 6, 7]];
    let at_the_end: &[[u8; 8]] = &[about(0xC4, DOMAIN, 1, 0), [0x81, 1, 2, 3, 4, 5, 6, 7]];
    let any: &[(Break, Option<[u8; 8]>)] = &[
        (|line| line.ask(abort(DOMAIN, 1, GENERAL)), None),
        (
            |line| line.pass_ms(1_001).split_off(0),
            Some(abort(DOMAIN, 1, TIMEOUT)),
        ),
        (|line| nmt(line, 2), None),
        (|line| nmt(line, 129), None),
        (|line| nmt(line, 130), None),
    ];
    // In the middle of a block a request can't be told from a segment.
    let between: &[(Break, Option<[u8; 8]>)] = &[
        (
            |line| line.ask(about(0x40, VALUE, 0, 0)),
            Some(about(0x41, VALUE, 0, 0)),
        ),
        (
            |line| line.ask(about(0x40, 0x3000, 0, 0)),
            Some(abort(0x3000, 0, NO_OBJECT)),
        ),
        (
            |line| line.ask(about(0xA4, VALUE, 0, 127)),
            Some(about(0xC6, VALUE, 0, 0)),
        ),
        (
            |line| line.ask([0xFF; 8]),
            Some(abort(DOMAIN, 1, 0x0504_0001)),
        ),
    ];
    let cases = [
        (by_segments, any),
        (by_segments, between),
        (by_blocks, any),
        (at_the_end, any),
        (at_the_end, between),
    ];
    for (before, breaks) in cases {
        for (action, expected) in breaks {
            let mut line = Line::new();
            for request in before {
                line.ask(*request);
            }
            assert_eq!(line.app.calls().len(), 1);
            let said = action(&mut line);
            assert_eq!(said.last(), expected.as_ref(), "{before:02X?}");
            assert_eq!(line.app.calls(), [Call::End(DOMAIN, 1, None)]);
            line.pass_ms(2_000);
            line.hear(0, &[129, 0]);
            assert_eq!(line.app.calls(), [], "once");
        }
    }
}

/// Sends an NMT command; what the node then says beside its boot-up is the SDO server's.
fn nmt(line: &mut Line, command: u8) -> Vec<[u8; 8]> {
    line.hear(0, &[command, 5]);
    let mut frames = line.frames();
    frames.retain(|(cob_id, _)| *cob_id != 0x705);
    assert_eq!(frames, []);
    line.pass_ms(3_000)
}

#[test]
fn what_is_wrong_with_a_download_ends_the_domain_once() {
    let mut line = Line::new();
    let void = [Call::End(DOMAIN, 1, None)];
    line.sdo(about(0x21, DOMAIN, 1, 9));
    line.sdo([0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(line.sdo([0; 8]), abort(DOMAIN, 1, TOGGLE));
    assert_eq!(line.app.calls()[1..], void);
    for (size, code) in [(8, TOO_LONG), (10, TOO_SHORT)] {
        let answer = download_segmented(&mut line, Some(size), b"123456789");
        assert_eq!(answer, abort(DOMAIN, 1, code));
        assert_eq!(line.app.calls()[1..], void);
    }
    line.sdo(about(0xC6, DOMAIN, 1, 7));
    line.sdo([0x81, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(line.sdo([0xC1, 0, 0, 0, 0, 0, 0, 0]), abort(DOMAIN, 1, CRC));
    assert_eq!(line.app.calls()[1..], void);
    // The next one starts over.
    line.sdo(about(0x21, DOMAIN, 1, 9));
    line.sdo(about(0x21, DOMAIN, 3, 9));
    assert_eq!(
        line.app.calls(),
        [
            Call::Begin(DOMAIN, 1, Some(9)),
            Call::End(DOMAIN, 1, None),
            Call::Begin(DOMAIN, 3, Some(9))
        ]
    );
}

#[test]
fn the_eds_and_programs_are_the_application_s() {
    let mut line = Line::new();
    line.app.domain = pattern(300);
    assert_eq!(upload(&mut line, 0x1021, 0, 127), pattern(300));
    assert_eq!(
        line.sdo(about(0x40, 0x1022, 0, 0)),
        about(0x4F, 0x1022, 0, 0)
    );
    assert_eq!(
        line.sdo(about(0x2F, 0x1022, 0, 0)),
        abort(0x1022, 0, READ_ONLY)
    );
    for index in [0x1F50, 0x1F5F] {
        assert_eq!(download(&mut line, index, 1, &pattern(1_000)), DONE);
        assert_eq!(line.app.domain, pattern(1_000));
    }
    line.sdo([0x2B, 0x51, 0x1F, 1, 0x34, 0x12, 0, 0]);
    assert_eq!(line.app.word, 0x1234);
    for index in [0x1020, 0x1023, 0x1F4F, 0x1F60, 0x1FFF] {
        let request = about(0x40, index, 1, 0);
        assert_eq!(line.sdo(request), abort(index, 1, NO_OBJECT));
    }
}

#[test]
fn a_pdo_carries_no_domain() {
    let mut line = Line::new();
    for mapping in [0x1600, 0x1A01] {
        for object in [0x2030_0100, 0x2030_0108, 0x2030_0140] {
            assert_eq!(
                line.sdo(about(0x23, mapping, 1, object)),
                abort(mapping, 1, NOT_MAPPABLE)
            );
        }
        assert_eq!(
            line.sdo(about(0x23, mapping, 1, 0x2021_0010)),
            about(0x60, mapping, 1, 0)
        );
    }
}

#[test]
fn any_requests_keep_begin_and_end_in_pairs() {
    let seeds = [
        about(0x21, DOMAIN, 1, 100),
        about(0x20, DOMAIN, 1, 0),
        about(0x23, DOMAIN, 1, 0x0102_0304),
        about(0x40, DOMAIN, 1, 0),
        about(0xC6, DOMAIN, 1, 20),
        about(0xC4, DOMAIN, 3, 0),
        about(0xA4, DOMAIN, 1, 127),
        about(0xA4, DOMAIN, 2, 0x1403),
        about(0x40, VALUE, 0, 0),
        about(0xC6, VALUE, 0, 20),
        [0x00, 1, 2, 3, 4, 5, 6, 7],
        [0x10, 1, 2, 3, 4, 5, 6, 7],
        [0x11, 1, 2, 3, 4, 5, 6, 7],
        [0x60, 0, 0, 0, 0, 0, 0, 0],
        [0x70, 0, 0, 0, 0, 0, 0, 0],
        [0x01, 1, 2, 3, 4, 5, 6, 7],
        [0x02, 1, 2, 3, 4, 5, 6, 7],
        [0x83, 1, 2, 3, 4, 5, 6, 7],
        [0x81, 1, 2, 3, 4, 5, 6, 7],
        [0xC1, 0, 0, 0, 0, 0, 0, 0],
        START,
        DONE,
        acknowledge(3, 127),
        acknowledge(1, 1),
        acknowledge(0, 64),
        abort(DOMAIN, 1, GENERAL),
    ];
    let seed = 0x5D0;
    println!("seed {seed}");
    let mut random = Random(seed);
    let mut line = Line::new();
    line.app.domain = pattern(100);
    let (mut begun, mut complete, mut void) = (0, 0, 0);
    for _ in 0..300_000 {
        let mut request = random.pick(&seeds);
        if random.below(6) == 0 {
            request[random.below(8) as usize] ^= 1 << random.below(8);
        }
        line.now_us += random.pick(&[0, 0, 100, 1_000, 1_000, 250_000, 1_000_000]);
        match random.below(60) {
            0 => line.hear(0, &[random.pick(&[1, 2, 128, 128, 129, 130]), 0]),
            1 => line.app.fail_at = random.pick(&[None, Some(7), Some(50)]),
            2 => line.app.refuse_begin = random.pick(&[None, None, Some(Abort::LocalControl)]),
            3 => line.app.refuse_end = random.pick(&[None, None, Some(Abort::Transfer)]),
            4 => line.app.domain = pattern(random.below(300) as usize),
            5..=25 => line.node.tick(line.now_us, &mut line.app),
            _ => line.hear(0x605, &request),
        }
        if random.below(3) == 0 {
            line.frames();
        }
        for call in line.app.calls() {
            match call {
                Call::Begin(..) => begun += 1,
                Call::End(_, _, Some(_)) => complete += 1,
                Call::End(_, _, None) => void += 1,
            }
            assert!(begun - complete - void <= 1);
        }
    }
    println!("{begun} begun, {complete} complete, {void} void");
    assert_eq!(begun - complete - void, i32::from(line.app.is_writing()));
    assert!(complete > 1_000 && void > 1_000);
    line.hear(0, &[129, 0]);
    assert!(!line.app.is_writing());
}
