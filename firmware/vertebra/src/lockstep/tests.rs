//! Packets there and back, and bytes that are none.

use proptest::prelude::*;

use super::*;

fn frame() -> impl Strategy<Value = Frame> {
    let data = prop::collection::vec(any::<u8>(), 0..=8);
    (any::<u32>(), any::<bool>(), any::<bool>(), data).prop_map(
        |(raw, is_extended, is_remote, data)| {
            let id = if is_extended {
                Id::Extended(ExtendedId::new(raw & 0x1FFF_FFFF).unwrap())
            } else {
                Id::Standard(StandardId::new((raw & 0x7FF) as u16).unwrap())
            };
            if is_remote {
                Frame::remote(id, data.len() as u8).unwrap()
            } else {
                Frame::new(id, &data).unwrap()
            }
        },
    )
}

fn frames() -> impl Strategy<Value = Frames> {
    prop::collection::vec(frame(), 0..=MAX_FRAMES).prop_map(|list| list.into_iter().collect())
}

fn input() -> impl Strategy<Value = Input> {
    type Three = [i32; 3];
    let numbers = any::<(Three, [Option<i32>; 3], Three, i32, i32, Three)>();
    let others = (
        any::<([bool; 3], [bool; 3], bool, bool, Option<u32>)>(),
        frames(),
        0..=MAX_FRAMES as u8,
    );
    (any::<u64>(), numbers, others).prop_map(
        |(now, (counts, angles, currents, supply, board, motors), others)| {
            let ((faults, tripped, stop, chain_in, age), frames, room) = others;
            let sample = Sample {
                encoder_counts: counts,
                absolute: angles.map(|angle| angle.map(Angle::from_q29)),
                current: currents.map(Current::from_microamps),
                supply: Voltage::from_millivolts(supply),
                board_temperature: Temperature::from_decidegrees(board),
                motor_temperature: motors.map(Temperature::from_decidegrees),
                bridge_fault: faults,
                over_current: tripped,
                chain_in,
                sync_age: age.map(|age| Duration::from_micros(age >> 1)),
                emergency_stop: stop,
            };
            Input {
                now: Instant::from_micros(now),
                sample,
                frames,
                room,
            }
        },
    )
}

fn drive() -> impl Strategy<Value = Drive> {
    prop_oneof![
        Just(Drive::Off),
        Just(Drive::Brake),
        any::<(i32, i32)>().prop_map(|(current, emf)| Drive::Current(Setpoint {
            current: Current::from_microamps(current),
            emf: Voltage::from_millivolts(emf),
        })),
    ]
}

/// Splits a packet whose header must be right.
fn open(packet: &Packet, kind: Kind) -> &[u8] {
    let (header, body) = packet.as_bytes().split_first_chunk().unwrap();
    assert_eq!(
        Header::decode(*header),
        Ok(Header {
            kind,
            length: body.len()
        })
    );
    body
}

proptest! {
    #[test]
    fn an_input_survives_the_way_there_and_back(input in input()) {
        let packet = input.encode();
        prop_assert_eq!(Input::decode(open(&packet, Kind::Input)), Ok(input));
    }

    #[test]
    fn an_output_survives_the_way_there_and_back(
        drives in [drive(), drive(), drive()], trim_ns in any::<i32>(), chain_out in any::<bool>(), frames in frames()
    ) {
        let output = Output { drives, trim_ns, chain_out, frames };
        let packet = output.encode();
        prop_assert_eq!(Output::decode(open(&packet, Kind::Output)), Ok(output));
    }

    #[test]
    fn what_is_decoded_encodes_to_the_same_bytes(
        input in input(), at in any::<prop::sample::Index>(), bits in any::<u8>()
    ) {
        let packet = input.encode();
        let mut bytes = packet.as_bytes().to_vec();
        let at = HEADER + at.index(bytes.len() - HEADER);
        bytes[at] ^= bits;
        if let Ok(decoded) = Input::decode(&bytes[HEADER..]) {
            let again = decoded.encode();
            prop_assert_eq!(again.as_bytes(), &bytes[..]);
        }
    }

    #[test]
    fn a_packet_cut_short_is_none(input in input(), cut in 1_usize..40) {
        let packet = input.encode();
        let body = open(&packet, Kind::Input);
        let short = &body[..body.len().saturating_sub(cut)];
        prop_assert_eq!(Input::decode(short), Err(PacketError::Length));
    }
}

#[test]
fn a_start_has_these_bytes() {
    let start = Start {
        node: NodeId::new(7).unwrap(),
        serial: 0x1234_5678,
        now: Instant::from_micros(1_000),
        failed: true,
    };
    let bytes = [
        b'S', 4, 14, 0, 7, 0x78, 0x56, 0x34, 0x12, 0xE8, 0x03, 0, 0, 0, 0, 0, 0, 1,
    ];
    assert_eq!(start.encode().as_bytes(), bytes);
    assert_eq!(Start::decode(&bytes[HEADER..]), Ok(start));
    assert_eq!(
        Start::decode(&[11, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]),
        Err(PacketError::Value)
    );
}

#[test]
fn headers_of_others_are_refused() {
    assert_eq!(
        Header::decode([b'X', VERSION, 0, 0]),
        Err(PacketError::Kind)
    );
    assert_eq!(
        Header::decode([b'I', VERSION + 1, 0, 0]),
        Err(PacketError::Version)
    );
    assert_eq!(
        Header::decode([b'I', VERSION, 0xFF, 0xFF]),
        Err(PacketError::Length)
    );
}

#[test]
fn the_longest_packet_has_room() {
    let frame = Frame::standard(0x7FF, &[0xFF; 8]).unwrap();
    let frames: Frames = core::iter::repeat_n(frame, MAX_FRAMES).collect();
    let output = Output {
        drives: [Drive::Brake; 3],
        trim_ns: i32::MIN,
        chain_out: true,
        frames,
    };
    let packet = output.encode();
    assert_eq!(Output::decode(open(&packet, Kind::Output)), Ok(output));
}
