//! Promises on the wire: pinned bytes, generated files, and a vertebra that serves what its data
//! sheet says.
//!
//! The bytes below are never edited: a change of them breaks every vertebra in the field.

mod wire_files;

use eel_canopen::Frame;
use eel_protocol::emergency::{Emergency, EmergencyReport, Source};
use eel_protocol::{
    Cob, Counter, Effort, Flags, FrameError, LimitCode, Mode, Moment, NodeId, PoseReport, State,
    Target,
};
use eel_units::{Angle, Torque};

fn angle(tenth_milliradians: i16) -> Angle {
    Angle::from_tenth_milliradians(tenth_milliradians)
}

fn counter(raw: u8) -> Counter {
    Counter::new(raw).unwrap()
}

/// The last byte of each line was computed by Python's `crccheck` 1.3.1, class `Crc8Autosar`, over
/// the seven bytes before it and the identifier, low byte first.
#[test]
fn a_target_is_these_bytes() {
    let pinned = [
        (
            3,
            [-1234, 2618, -698],
            Mode::Run,
            9,
            [0x2E, 0xFB, 0x3A, 0x0A, 0x46, 0xFD, 0x94, 0x62],
        ),
        (
            1,
            [0, 0, 0],
            Mode::Off,
            0,
            [0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x56],
        ),
        (
            10,
            [5236, -2618, 698],
            Mode::FaultReset,
            14,
            [0x74, 0x14, 0xC6, 0xF5, 0xBA, 0x02, 0xEF, 0x1D],
        ),
    ];
    for (node, [yaw, pitch, roll], mode, count, bytes) in pinned {
        let target = Target {
            yaw: angle(yaw),
            pitch: angle(pitch),
            roll: angle(roll),
            mode,
            counter: counter(count),
        };
        let frame = target.to_frame(NodeId::new(node).unwrap()).unwrap();
        assert_eq!(
            frame,
            Frame::standard(0x200 + u16::from(node), &bytes).unwrap()
        );
        assert_eq!(
            Target::from_frame(&frame),
            Ok((NodeId::new(node).unwrap(), target))
        );
    }
}

/// Protection bytes as in the test before.
#[test]
fn a_pose_is_these_bytes() {
    let pinned = [
        (
            10,
            [5236, -2618, 698],
            State::Run,
            7,
            [0x74, 0x14, 0xC6, 0xF5, 0xBA, 0x02, 0x73, 0x0E],
        ),
        (
            1,
            [-1, 1, 0],
            State::Fault,
            0,
            [0xFF, 0xFF, 0x01, 0x00, 0x00, 0x00, 0x0A, 0x78],
        ),
    ];
    for (node, [yaw, pitch, roll], state, count, bytes) in pinned {
        let report = PoseReport {
            yaw: angle(yaw),
            pitch: angle(pitch),
            roll: angle(roll),
            state,
            counter: counter(count),
        };
        let frame = Frame::standard(0x180 + u16::from(node), &bytes).unwrap();
        assert_eq!(report.to_bytes(0x180 + u16::from(node)), bytes);
        assert_eq!(
            PoseReport::from_frame(&frame),
            Ok((NodeId::new(node).unwrap(), report))
        );
    }
}

#[test]
fn an_effort_is_these_bytes() {
    let effort = Effort {
        torque: [-2_100, 32_767, 1].map(Torque::from_millinewton_metres),
        limit: [LimitCode::Peak, LimitCode::Singularity, LimitCode::Off],
        flags: Flags {
            command_lost: true,
            target_limited: true,
            ..Flags::default()
        },
    };
    let bytes = [0xCC, 0xF7, 0xFF, 0x7F, 0x01, 0x00, 0x91, 0x5F];
    assert_eq!(effort.to_bytes(), bytes);
    assert_eq!(Effort::from_bytes(&bytes), Ok(effort));
    assert_eq!(effort.limits(), 0x5F91);
}

#[test]
fn a_moment_is_these_bytes() {
    let moment = Moment {
        moment: [1_000, -1, -32_768].map(Torque::from_millinewton_metres),
        stiffness: 0x8000,
    };
    let bytes = [0xE8, 0x03, 0xFF, 0xFF, 0x00, 0x80, 0x00, 0x80];
    assert_eq!(moment.to_bytes(), bytes);
    assert_eq!(Moment::from_bytes(&bytes), moment);
}

#[test]
fn an_emergency_is_these_bytes() {
    let Emergency { code, register, .. } = Emergency::COMMAND_LOST;
    let source = Source {
        motor: 0,
        limit: 2,
        detail: 100,
    };
    let bytes = [0x50, 0x82, 0x11, 0x00, 0x02, 0x64, 0x00, 0x00];
    assert_eq!(
        EmergencyReport {
            code,
            register,
            source
        }
        .to_bytes(),
        bytes
    );
}

#[test]
fn codes_are_these_numbers() {
    let modes: Vec<_> = Mode::ALL
        .iter()
        .map(|mode| (mode.code(), mode.name()))
        .collect();
    let pinned = [
        (0, "off"),
        (1, "brake"),
        (2, "damped"),
        (3, "hold"),
        (4, "run"),
        (5, "moment"),
        (6, "motor"),
        (15, "fault-reset"),
    ];
    assert_eq!(modes, pinned);
    let states: Vec<_> = State::ALL
        .iter()
        .map(|state| (state.code(), state.name()))
        .collect();
    let pinned = [
        (0, "not-ready"),
        (1, "switched-off"),
        (2, "ready"),
        (3, "run"),
        (4, "hold"),
        (5, "damped"),
        (6, "brake"),
        (7, "stop-damped"),
        (8, "stop-brake"),
        (9, "stop-off"),
        (10, "fault"),
        (12, "moment"),
        (13, "motor"),
        (14, "test"),
    ];
    assert_eq!(states, pinned);
    let limits: Vec<_> = LimitCode::ALL
        .iter()
        .map(|limit| (limit.code(), limit.name()))
        .collect();
    let pinned = [
        (0, "none"),
        (1, "peak"),
        (2, "command"),
        (3, "thermal"),
        (4, "board"),
        (5, "undervoltage"),
        (6, "overvoltage"),
        (7, "travel"),
        (8, "speed"),
        (9, "singularity"),
        (15, "off"),
    ];
    assert_eq!(limits, pinned);
}

#[test]
fn identifiers_are_these_numbers() {
    let pinned = [
        (Cob::Nmt, 0x000),
        (Cob::Sync, 0x080),
        (Cob::Emergency(3), 0x083),
        (Cob::Time, 0x100),
        (Cob::Pose(3), 0x183),
        (Cob::Target(3), 0x203),
        (Cob::Effort(3), 0x283),
        (Cob::Moment(3), 0x303),
        (Cob::SdoResponse(3), 0x583),
        (Cob::SdoRequest(3), 0x603),
        (Cob::Heartbeat(127), 0x77F),
        (Cob::LssResponse, 0x7E4),
        (Cob::LssRequest, 0x7E5),
    ];
    for (cob, id) in pinned {
        assert_eq!(cob.id(), id);
        assert_eq!(Cob::from_id(id), cob);
    }
    for id in 0..0x800 {
        assert_eq!(Cob::from_id(id).id(), id);
    }
}

#[test]
fn a_counter_runs_from_0_to_14_and_never_shows_15() {
    let mut count = Counter::default();
    for expected in (0..=14).chain(0..=14) {
        assert_eq!(count.get(), expected);
        count = count.next();
    }
    assert_eq!(Counter::new(15), None);
    for (late, early) in (0..15).flat_map(|a| (0..15).map(move |b| (a, b))) {
        let steps = counter(late).since(counter(early));
        let walked = (0..steps).fold(counter(early), |count, _| count.next());
        assert_eq!(walked, counter(late));
        assert!(steps <= 14);
    }
}

#[test]
fn a_frame_that_is_not_what_it_should_be_is_refused_with_the_reason() {
    let good = [0x2E, 0xFB, 0x3A, 0x0A, 0x46, 0xFD, 0x94, 0x62];
    let read = |id, bytes: &[u8]| Target::from_frame(&Frame::standard(id, bytes).unwrap());
    assert!(read(0x203, &good).is_ok());
    assert_eq!(read(0x204, &good), Err(FrameError::Crc));
    assert_eq!(read(0x183, &good), Err(FrameError::Identifier));
    assert_eq!(read(0x27F, &good), Err(FrameError::Identifier));
    assert_eq!(read(0x203, &good[..7]), Err(FrameError::Length));
    let with_code = |code| {
        let [a, b, c, d, e, f, ..] = good;
        let crc = eel_protocol::protection(&[a, b, c, d, e, f, code], 0x203);
        [a, b, c, d, e, f, code, crc]
    };
    assert_eq!(read(0x203, &with_code(0xF4)), Err(FrameError::Value));
    assert_eq!(read(0x203, &with_code(0x9E)), Err(FrameError::Value));
}
