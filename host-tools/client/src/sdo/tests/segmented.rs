//! Expedited and segmented transfers, silence, strangers.

use super::*;

#[test]
fn one_to_four_bytes_are_read_and_written_in_one_frame() {
    let commands = [
        (1, 0x4F, 0x2F),
        (2, 0x4B, 0x2B),
        (3, 0x47, 0x27),
        (4, 0x43, 0x23),
    ];
    for (length, upload, download) in commands {
        let bytes = [0x11, 0x22, 0x33, 0x44];
        let expected = &bytes[..length];
        let mut padded = [0; 4];
        padded[..length].copy_from_slice(expected);
        let mut script = Script::default();
        step(&mut script, named(0x40, [0; 4]), &[named(upload, padded)]);
        step(&mut script, named(download, padded), &[named(0x60, [0; 4])]);
        let mut client = client(script);
        assert_eq!(read(&mut client, Method::Automatic).unwrap(), expected);
        write(&mut client, expected, Method::Automatic).unwrap();
        client.into_bus().finish();
    }
}

#[test]
fn an_answer_without_a_size_is_four_bytes() {
    let mut script = Script::default();
    step(
        &mut script,
        named(0x40, [0; 4]),
        &[named(0x42, [1, 2, 3, 4])],
    );
    let mut client = client(script);
    assert_eq!(read(&mut client, Method::Automatic).unwrap(), [1, 2, 3, 4]);
}

/// The bytes of a whole transfer, nothing computed.
#[test]
fn eight_bytes_are_two_segments_byte_for_byte() {
    let mut script = Script::default();
    for (data, answer) in [
        (
            [0x40, 0x01, 0x21, 0x01, 0, 0, 0, 0],
            [0x41, 0x01, 0x21, 0x01, 8, 0, 0, 0],
        ),
        (
            [0x60, 0, 0, 0, 0, 0, 0, 0],
            [0x00, 0, 7, 14, 21, 28, 35, 42],
        ),
        ([0x70, 0, 0, 0, 0, 0, 0, 0], [0x1D, 49, 0, 0, 0, 0, 0, 0]),
        (
            [0x21, 0x01, 0x21, 0x01, 8, 0, 0, 0],
            [0x60, 0x01, 0x21, 0x01, 0, 0, 0, 0],
        ),
        (
            [0x00, 0, 7, 14, 21, 28, 35, 42],
            [0x20, 0, 0, 0, 0, 0, 0, 0],
        ),
        ([0x1D, 49, 0, 0, 0, 0, 0, 0], [0x30, 0, 0, 0, 0, 0, 0, 0]),
    ] {
        script.add((0x603, &data), &[(0x583, &answer)]);
    }
    let mut client = client(script);
    let eight = [0, 7, 14, 21, 28, 35, 42, 49];
    assert_eq!(read(&mut client, Method::Segmented).unwrap(), eight);
    write(&mut client, &eight, Method::Segmented).unwrap();
    client.into_bus().finish();
}

/// The segments of a value: toggle in bit 4, bytes without data in bits 1-3, the end in bit 0.
fn segments(data: &[u8]) -> Vec<[u8; 8]> {
    let count = data.len().div_ceil(7);
    let chunks = data.chunks(7).enumerate();
    let frames = chunks.map(|(place, chunk)| {
        let toggle = if place % 2 == 1 { 0x10 } else { 0 };
        let last = u8::from(place + 1 == count);
        let mut frame = [0; 8];
        frame[0] = toggle + 2 * (7 - chunk.len() as u8) + last;
        frame[1..=chunk.len()].copy_from_slice(chunk);
        frame
    });
    frames.collect()
}

#[test]
fn any_length_is_read_in_segments_with_its_length_or_without() {
    for length in LENGTHS {
        for told in [true, false] {
            let data = value(length);
            let mut script = Script::default();
            let size = (length as u32).to_le_bytes();
            let answer = if told {
                named(0x41, size)
            } else {
                named(0x40, [0; 4])
            };
            step(&mut script, named(0x40, [0; 4]), &[answer]);
            for (place, segment) in segments(&data).into_iter().enumerate() {
                let toggle = if place % 2 == 1 { 0x70 } else { 0x60 };
                step(&mut script, plain(toggle, 0, 0), &[segment]);
            }
            let mut client = client(script);
            let mut seen = Vec::new();
            let mut progress = |step: Progress| seen.push(step);
            let came = client.upload(NODE, OBJECT, Method::Segmented, &mut progress);
            assert_eq!(came.unwrap(), data, "{length}");
            let total = told.then_some(length);
            assert_eq!(
                seen.last(),
                Some(&Progress {
                    done: length,
                    total
                })
            );
            client.into_bus().finish();
        }
    }
}

#[test]
fn any_length_is_written_in_segments() {
    for length in [0].into_iter().chain(LENGTHS) {
        let data = value(length);
        let mut script = Script::default();
        let size = (length as u32).to_le_bytes();
        step(&mut script, named(0x21, size), &[named(0x60, [0; 4])]);
        let mut all = segments(&data);
        if length == 0 {
            all.push([0x0F, 0, 0, 0, 0, 0, 0, 0]);
        }
        for (place, segment) in all.into_iter().enumerate() {
            let answer = if place % 2 == 1 { 0x30 } else { 0x20 };
            step(&mut script, segment, &[plain(answer, 0, 0)]);
        }
        let mut client = client(script);
        write(&mut client, &data, Method::Segmented).unwrap();
        client.into_bus().finish();
    }
}

#[test]
fn a_toggle_bit_that_stays_ends_the_transfer_with_its_abort_code() {
    let mut script = Script::default();
    step(
        &mut script,
        named(0x40, [0; 4]),
        &[named(0x41, [20, 0, 0, 0])],
    );
    step(&mut script, plain(0x60, 0, 0), &[plain(0x10, 0, 0)]);
    step(&mut script, named(0x80, [0, 0, 0x03, 0x05]), &[]);
    step(
        &mut script,
        named(0x21, [8, 0, 0, 0]),
        &[named(0x60, [0; 4])],
    );
    step(
        &mut script,
        [0, 0, 7, 14, 21, 28, 35, 42],
        &[plain(0x30, 0, 0)],
    );
    step(&mut script, named(0x80, [0, 0, 0x03, 0x05]), &[]);
    let mut client = client(script);
    let error = read(&mut client, Method::Segmented).unwrap_err();
    assert_eq!(violation(error), Violation::Toggle);
    let error = write(&mut client, &value(8), Method::Segmented).unwrap_err();
    assert_eq!(violation(error), Violation::Toggle);
    client.into_bus().finish();
}

#[test]
fn more_or_fewer_bytes_than_announced_are_refused() {
    for (announced, came) in [(5, 7), (20, 14)] {
        let mut script = Script::default();
        step(
            &mut script,
            named(0x40, [0; 4]),
            &[named(0x41, [announced, 0, 0, 0])],
        );
        for (place, segment) in segments(&value(came)).into_iter().enumerate() {
            let toggle = if place % 2 == 1 { 0x70 } else { 0x60 };
            step(&mut script, plain(toggle, 0, 0), &[segment]);
        }
        step(&mut script, named(0x80, [0x10, 0, 0x07, 0x06]), &[]);
        let mut client = client(script);
        let error = read(&mut client, Method::Segmented).unwrap_err();
        let announced = usize::from(announced);
        assert_eq!(violation(error), Violation::Length { announced, came });
        client.into_bus().finish();
    }
}

#[test]
fn a_refusal_comes_back_with_its_code_at_the_beginning_and_in_the_middle() {
    let refused = |error| match error {
        ClientError::Aborted {
            node: NODE,
            object: OBJECT,
            code,
        } => code,
        other => panic!("{other:?}"),
    };
    let mut script = Script::default();
    let state = named(0x80, [0x22, 0, 0, 0x08]);
    step(&mut script, named(0x40, [0; 4]), &[state]);
    step(&mut script, named(0x2F, [1, 0, 0, 0]), &[state]);
    step(
        &mut script,
        named(0x21, [8, 0, 0, 0]),
        &[named(0x60, [0; 4])],
    );
    step(&mut script, [0, 0, 7, 14, 21, 28, 35, 42], &[state]);
    let mut client = client(script);
    let error = read(&mut client, Method::Automatic).unwrap_err();
    assert_eq!(refused(error), 0x0800_0022);
    let error = write(&mut client, &[1], Method::Automatic).unwrap_err();
    assert_eq!(refused(error), 0x0800_0022);
    let error = write(&mut client, &value(8), Method::Segmented).unwrap_err();
    assert_eq!(refused(error), 0x0800_0022);
    client.into_bus().finish();
}

#[test]
fn frames_of_others_are_no_answers_and_no_errors() {
    let mut script = Script::default();
    let other_object = [0x4F, 0x17, 0x10, 0, 9, 0, 0, 0];
    let other_abort = [0x80, 0x17, 0x10, 0, 0, 0, 2, 6];
    let wanted = named(0x4F, [5, 0, 0, 0]);
    script.add(
        (REQUEST, &named(0x40, [0; 4])),
        &[
            (0x703, &[5]),
            (0x080, &[1]),
            (0x584, &named(0x4F, [6, 0, 0, 0])),
            (0x583, &[0x4F, 0x01]),
            (0x583, &other_object),
            (0x583, &other_abort),
            (0x083, &[0x10, 0x23, 3, 1, 0, 0, 0, 0]),
            (0x583, &wanted),
        ],
    );
    let mut client = client(script);
    assert_eq!(read(&mut client, Method::Automatic).unwrap(), [5]);
    let [(node, report)] = client.take_emergencies()[..] else {
        panic!("one emergency")
    };
    assert_eq!((node, report.code), (3, 0x2310));
}

#[test]
fn silence_is_a_time_out_reads_are_tried_again_and_writes_are_not() {
    let timed_out = named(0x80, [0, 0, 0x04, 0x05]);
    let mut script = Script::default();
    step(&mut script, named(0x40, [0; 4]), &[]);
    step(&mut script, timed_out, &[]);
    step(
        &mut script,
        named(0x40, [0; 4]),
        &[named(0x4F, [1, 0, 0, 0])],
    );
    step(&mut script, named(0x2F, [1, 0, 0, 0]), &[]);
    step(&mut script, timed_out, &[]);
    let mut client = client(script);
    client.settings_mut().attempts = 2;
    assert_eq!(read(&mut client, Method::Automatic).unwrap(), [1]);
    let error = write(&mut client, &[1], Method::Automatic).unwrap_err();
    assert!(matches!(
        error,
        ClientError::Timeout {
            node: NODE,
            object: OBJECT
        }
    ));
    client.into_bus().finish();
}

#[test]
fn a_command_that_cannot_come_ends_the_transfer() {
    let mut script = Script::default();
    step(&mut script, named(0x40, [0; 4]), &[named(0x60, [0; 4])]);
    step(&mut script, named(0x80, [1, 0, 0x04, 0x05]), &[]);
    step(
        &mut script,
        named(0x2F, [1, 0, 0, 0]),
        &[named(0xA0, [127, 0, 0, 0])],
    );
    step(&mut script, named(0x80, [1, 0, 0x04, 0x05]), &[]);
    let mut client = client(script);
    let error = read(&mut client, Method::Automatic).unwrap_err();
    assert_eq!(violation(error), Violation::Command(0x60));
    let error = write(&mut client, &[1], Method::Automatic).unwrap_err();
    assert_eq!(violation(error), Violation::Command(0xA0));
    client.into_bus().finish();
}
