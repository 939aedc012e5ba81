//! Block transfers in both directions: losses, CRC, fallback.

use super::*;

/// The segments of the bytes from `start` on, at most `size`: number in bits 0-6, the end in bit 7.
fn segments(data: &[u8], start: usize, size: usize) -> Vec<[u8; 8]> {
    let count = data.len().div_ceil(7);
    let rest = data.chunks(7).enumerate().skip(start).take(size);
    let frames = rest.map(|(place, chunk)| {
        let mut frame = [0; 8];
        frame[0] = (place - start + 1) as u8 + if place + 1 == count { 0x80 } else { 0 };
        frame[1..=chunk.len()].copy_from_slice(chunk);
        frame
    });
    frames.collect()
}

/// The end of a transfer: bytes of the last segment that hold nothing in bits 2-4, then the CRC.
fn end(length: usize, crc: u16) -> [u8; 8] {
    let unused = (7 - length % 7) % 7;
    let [low, high] = crc.to_le_bytes();
    plain(0xC1 + 4 * unused as u8, low, high)
}

/// The client's request for a block upload with CRC, in blocks of 127, without a switch.
const ASK: [u8; 8] = [0xA4, 0x01, 0x21, 0x01, 127, 0, 0, 0];
const START: [u8; 8] = [0xA3, 0, 0, 0, 0, 0, 0, 0];
const DONE: [u8; 8] = [0xA1, 0, 0, 0, 0, 0, 0, 0];

#[test]
fn any_length_is_read_in_blocks() {
    for (length, crc) in LENGTHS.into_iter().zip(CRCS) {
        let data = value(length);
        let mut script = Script::default();
        let size = (length as u32).to_le_bytes();
        step(&mut script, ASK, &[named(0xC6, size)]);
        let count = length.div_ceil(7);
        let mut request = START;
        for start in (0..count).step_by(127) {
            let block = segments(&data, start, 127);
            step(&mut script, request, &block);
            request = plain(0xA2, block.len() as u8, 127);
        }
        step(&mut script, request, &[end(length, crc)]);
        step(&mut script, DONE, &[]);
        let mut client = client(script);
        assert_eq!(read(&mut client, Method::Block).unwrap(), data, "{length}");
        client.into_bus().finish();
    }
}

#[test]
fn any_length_is_written_in_blocks_of_any_size() {
    for (length, crc) in LENGTHS.into_iter().zip(CRCS) {
        for sizes in [[127, 127, 127], [1, 4, 126]] {
            let data = value(length);
            let mut script = Script::default();
            let mut sizes = sizes.into_iter().cycle();
            let mut size = sizes.next().unwrap();
            let announced = (length as u32).to_le_bytes();
            step(
                &mut script,
                named(0xC6, announced),
                &[named(0xA4, [size, 0, 0, 0])],
            );
            let count = length.div_ceil(7);
            let mut start = 0;
            while start < count {
                let block = segments(&data, start, usize::from(size));
                let (last, before) = block.split_last().unwrap();
                before
                    .iter()
                    .for_each(|frame| step(&mut script, *frame, &[]));
                start += block.len();
                size = sizes.next().unwrap();
                step(&mut script, *last, &[plain(0xA2, block.len() as u8, size)]);
            }
            step(&mut script, end(length, crc), &[plain(0xA1, 0, 0)]);
            let mut client = client(script);
            write(&mut client, &data, Method::Block).unwrap();
            client.into_bus().finish();
        }
    }
}

/// The bytes of a whole transfer with a loss in the middle, nothing computed.
#[test]
fn a_segment_lost_on_the_way_here_is_sent_again_byte_for_byte() {
    let mut script = Script::default();
    step(&mut script, ASK, &[named(0xC6, [15, 0, 0, 0])]);
    let first = [0x01, 0, 7, 14, 21, 28, 35, 42];
    let second = [0x02, 49, 56, 63, 70, 77, 84, 91];
    // Segment 2 is lost, segment 3 is the last.
    step(&mut script, START, &[first, [0x83, 98, 0, 0, 0, 0, 0, 0]]);
    // From segment 2 on, numbered from 1.
    let again = [
        [0x01, 49, 56, 63, 70, 77, 84, 91],
        [0x82, 98, 0, 0, 0, 0, 0, 0],
    ];
    step(&mut script, [0xA2, 1, 127, 0, 0, 0, 0, 0], &again);
    // binascii.crc_hqx of 0, 7 … 98 is 0x1D6C.
    step(
        &mut script,
        [0xA2, 2, 127, 0, 0, 0, 0, 0],
        &[[0xD9, 0x6C, 0x1D, 0, 0, 0, 0, 0]],
    );
    step(&mut script, DONE, &[]);
    let mut client = client(script);
    assert_eq!(read(&mut client, Method::Block).unwrap(), value(15));
    client.into_bus().finish();
    assert_eq!(second[1..], value(14)[7..]);
}

#[test]
fn lost_first_and_last_segments_are_asked_for_after_a_silence() {
    let data = value(14);
    let crc = CRCS[5];
    for lost in [0, 1] {
        let mut script = Script::default();
        step(&mut script, ASK, &[named(0xC6, [14, 0, 0, 0])]);
        let mut came = segments(&data, 0, 2);
        came.remove(lost);
        step(&mut script, START, &came);
        let rest = segments(&data, lost, 2);
        step(&mut script, plain(0xA2, lost as u8, 127), &rest);
        step(
            &mut script,
            plain(0xA2, rest.len() as u8, 127),
            &[end(14, crc)],
        );
        step(&mut script, DONE, &[]);
        let mut client = client(script);
        assert_eq!(
            read(&mut client, Method::Block).unwrap(),
            data,
            "{lost} lost"
        );
        client.into_bus().finish();
    }
}

#[test]
fn segments_lost_on_the_way_there_are_sent_again() {
    let data = value(2000);
    let mut script = Script::default();
    step(
        &mut script,
        named(0xC6, [0xD0, 7, 0, 0]),
        &[named(0xA4, [100, 0, 0, 0])],
    );
    // What the server acknowledges, and the size of the next block: losses in the middle, of the
    // first segment, of the last one.
    let mut start = 0;
    let mut size = 100;
    for (good, next) in [(41, 127), (0, 127), (127, 127), (117, 20), (1, 20)] {
        let block = segments(&data, start, size);
        let (last, before) = block.split_last().unwrap();
        before
            .iter()
            .for_each(|frame| step(&mut script, *frame, &[]));
        step(&mut script, *last, &[plain(0xA2, good, next)]);
        start += usize::from(good);
        size = usize::from(next);
    }
    assert_eq!(start, 286, "2000 bytes are 286 segments");
    step(&mut script, end(2000, CRCS[8]), &[plain(0xA1, 0, 0)]);
    let mut client = client(script);
    let mut done = Vec::new();
    let mut progress = |step: Progress| done.push(step.done);
    client
        .download(NODE, OBJECT, &data, Method::Block, &mut progress)
        .unwrap();
    assert_eq!(done, [287, 287, 1176, 1995, 2000]);
    client.into_bus().finish();
}

#[test]
fn what_is_lost_again_and_again_ends_the_transfer() {
    let mut script = Script::default();
    step(
        &mut script,
        named(0xC6, [8, 0, 0, 0]),
        &[named(0xA4, [127, 0, 0, 0])],
    );
    for _ in 0..5 {
        let block = segments(&value(8), 0, 2);
        step(&mut script, block[0], &[]);
        step(&mut script, block[1], &[plain(0xA2, 0, 127)]);
    }
    step(&mut script, named(0x80, [0, 0, 0x04, 0x05]), &[]);
    let mut client = client(script);
    let error = write(&mut client, &value(8), Method::Block).unwrap_err();
    assert_eq!(violation(error), Violation::Losses);
    client.into_bus().finish();
}

#[test]
fn a_wrong_crc_is_refused_here_and_told_from_there() {
    let mut script = Script::default();
    step(&mut script, ASK, &[named(0xC6, [7, 0, 0, 0])]);
    step(&mut script, START, &segments(&value(7), 0, 1));
    step(&mut script, plain(0xA2, 1, 127), &[end(7, CRCS[3] ^ 1)]);
    step(&mut script, named(0x80, [4, 0, 0x04, 0x05]), &[]);
    step(
        &mut script,
        named(0xC6, [7, 0, 0, 0]),
        &[named(0xA4, [127, 0, 0, 0])],
    );
    step(
        &mut script,
        segments(&value(7), 0, 1)[0],
        &[plain(0xA2, 1, 127)],
    );
    step(
        &mut script,
        end(7, CRCS[3]),
        &[named(0x80, [4, 0, 0x04, 0x05])],
    );
    let mut client = client(script);
    let error = read(&mut client, Method::Block).unwrap_err();
    assert_eq!(violation(error), Violation::Crc);
    let error = write(&mut client, &value(7), Method::Block).unwrap_err();
    assert!(matches!(
        error,
        ClientError::Aborted {
            code: 0x0504_0004,
            ..
        }
    ));
    client.into_bus().finish();
}

#[test]
fn a_server_without_crc_is_taken_at_its_word() {
    let mut script = Script::default();
    step(&mut script, ASK, &[named(0xC2, [7, 0, 0, 0])]);
    step(&mut script, START, &segments(&value(7), 0, 1));
    step(&mut script, plain(0xA2, 1, 127), &[plain(0xC1, 0, 0)]);
    step(&mut script, DONE, &[]);
    step(
        &mut script,
        named(0xC6, [7, 0, 0, 0]),
        &[named(0xA0, [127, 0, 0, 0])],
    );
    step(
        &mut script,
        segments(&value(7), 0, 1)[0],
        &[plain(0xA2, 1, 127)],
    );
    step(&mut script, plain(0xC1, 0, 0), &[plain(0xA1, 0, 0)]);
    let mut client = client(script);
    assert_eq!(read(&mut client, Method::Block).unwrap(), value(7));
    write(&mut client, &value(7), Method::Block).unwrap();
    client.into_bus().finish();
}

#[test]
fn wrong_sizes_numbers_and_lengths_end_the_transfer_with_their_abort_codes() {
    let begin = |script: &mut Script, size| {
        step(
            script,
            named(0xC6, [7, 0, 0, 0]),
            &[named(0xA4, [size, 0, 0, 0])],
        );
    };
    let mut script = Script::default();
    begin(&mut script, 128);
    step(&mut script, named(0x80, [2, 0, 0x04, 0x05]), &[]);
    begin(&mut script, 127);
    step(
        &mut script,
        segments(&value(7), 0, 1)[0],
        &[plain(0xA2, 2, 127)],
    );
    step(&mut script, named(0x80, [3, 0, 0x04, 0x05]), &[]);
    step(&mut script, ASK, &[named(0xC6, [9, 0, 0, 0])]);
    step(&mut script, START, &segments(&value(7), 0, 1));
    step(&mut script, plain(0xA2, 1, 127), &[end(7, CRCS[3])]);
    step(&mut script, named(0x80, [0x10, 0, 0x07, 0x06]), &[]);
    let mut client = client(script);
    let mut write = || violation(write(&mut client, &value(7), Method::Block).unwrap_err());
    assert_eq!(write(), Violation::BlockSize(128));
    assert_eq!(write(), Violation::Sequence(2));
    let wrong = Violation::Length {
        announced: 9,
        came: 7,
    };
    assert_eq!(
        violation(read(&mut client, Method::Block).unwrap_err()),
        wrong
    );
    client.into_bus().finish();
}

#[test]
fn silence_and_aborts_end_a_block_at_any_place() {
    let timed_out = named(0x80, [0, 0, 0x04, 0x05]);
    let mut script = Script::default();
    step(&mut script, ASK, &[named(0xC6, [7, 0, 0, 0])]);
    step(&mut script, START, &[]);
    step(&mut script, timed_out, &[]);
    step(&mut script, ASK, &[named(0xC6, [8, 0, 0, 0])]);
    let first = segments(&value(8), 0, 1)[0];
    step(&mut script, START, &[first, named(0x80, [0, 0, 0, 8])]);
    step(
        &mut script,
        named(0xC6, [7, 0, 0, 0]),
        &[named(0xA4, [127, 0, 0, 0])],
    );
    step(&mut script, segments(&value(7), 0, 1)[0], &[]);
    step(&mut script, timed_out, &[]);
    let mut client = client(script);
    let error = read(&mut client, Method::Block).unwrap_err();
    assert!(matches!(error, ClientError::Timeout { .. }));
    let error = read(&mut client, Method::Block).unwrap_err();
    assert!(matches!(
        error,
        ClientError::Aborted {
            code: 0x0800_0000,
            ..
        }
    ));
    let error = write(&mut client, &value(7), Method::Block).unwrap_err();
    assert!(matches!(error, ClientError::Timeout { .. }));
    client.into_bus().finish();
}

#[test]
fn a_server_may_switch_to_one_frame_or_to_segments() {
    let mut script = Script::default();
    step(&mut script, ASK, &[named(0x4B, [1, 2, 0, 0])]);
    step(&mut script, ASK, &[named(0x41, [5, 0, 0, 0])]);
    step(
        &mut script,
        plain(0x60, 0, 0),
        &[[0x05, 0, 7, 14, 21, 28, 0, 0]],
    );
    let mut client = client(script);
    assert_eq!(read(&mut client, Method::Block).unwrap(), [1, 2]);
    assert_eq!(read(&mut client, Method::Block).unwrap(), value(5));
    client.into_bus().finish();
}

#[test]
fn long_values_go_in_blocks_and_in_segments_where_the_server_knows_no_blocks() {
    let unknown = named(0x80, [1, 0, 0x04, 0x05]);
    let data = value(8);
    let mut script = Script::default();
    // A long read begins in segments, is given up, and goes on in blocks.
    step(
        &mut script,
        named(0x40, [0; 4]),
        &[named(0x41, [8, 0, 0, 0])],
    );
    step(&mut script, named(0x80, [0, 0, 0, 8]), &[]);
    step(&mut script, ASK, &[named(0xC6, [8, 0, 0, 0])]);
    step(&mut script, START, &segments(&data, 0, 2));
    step(&mut script, plain(0xA2, 2, 127), &[end(8, CRCS[4])]);
    step(&mut script, DONE, &[]);
    // A long write is refused in blocks, and goes on in segments; the next one is not even tried.
    step(&mut script, named(0xC6, [8, 0, 0, 0]), &[unknown]);
    for _ in 0..2 {
        step(
            &mut script,
            named(0x21, [8, 0, 0, 0]),
            &[named(0x60, [0; 4])],
        );
        step(
            &mut script,
            [0x00, 0, 7, 14, 21, 28, 35, 42],
            &[plain(0x20, 0, 0)],
        );
        step(
            &mut script,
            [0x1D, 49, 0, 0, 0, 0, 0, 0],
            &[plain(0x30, 0, 0)],
        );
    }
    step(
        &mut script,
        named(0x40, [0; 4]),
        &[named(0x41, [8, 0, 0, 0])],
    );
    step(
        &mut script,
        plain(0x60, 0, 0),
        &[[0x00, 0, 7, 14, 21, 28, 35, 42]],
    );
    step(
        &mut script,
        plain(0x70, 0, 0),
        &[[0x1D, 49, 0, 0, 0, 0, 0, 0]],
    );
    let mut client = client(script);
    client.settings_mut().block_from = 8;
    assert_eq!(read(&mut client, Method::Automatic).unwrap(), data);
    write(&mut client, &data, Method::Automatic).unwrap();
    write(&mut client, &data, Method::Automatic).unwrap();
    assert_eq!(read(&mut client, Method::Automatic).unwrap(), data);
    client.into_bus().finish();
}
