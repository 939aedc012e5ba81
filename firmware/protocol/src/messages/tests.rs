use eel_units::{Angle, Torque};

use super::*;
use crate::{Counter, Effort, Flags, Moment, NodeId, PoseReport, Target};
use std::vec::Vec;

fn value(cob: Cob, name: &str, bytes: &[u8]) -> i64 {
    let signals = Message::of(cob).unwrap().signals;
    signals
        .iter()
        .find(|signal| signal.name == name)
        .unwrap()
        .raw(bytes)
        .unwrap()
}

#[test]
fn signals_neither_overlap_nor_leave_the_message() {
    for message in MESSAGES {
        let mut taken = 0_u64;
        for signal in message.signals {
            assert!((1..=16).contains(&signal.bits));
            let mask = ((1_u64 << signal.bits) - 1) << signal.start;
            assert_eq!(taken & mask, 0, "{}.{}", message.name, signal.name);
            taken |= mask;
            let length = u32::from(message.length) * 8;
            assert!(u32::from(signal.start + signal.bits) <= length);
            assert_eq!(
                signal
                    .raw(&[0; 8][..usize::from(message.length) - 1])
                    .is_none(),
                u32::from(signal.start + signal.bits) > length - 8
            );
        }
    }
}

#[test]
fn signals_of_a_target_are_what_its_type_holds() {
    let target = Target {
        yaw: Angle::from_tenth_milliradians(-5_236),
        pitch: Angle::from_tenth_milliradians(2_618),
        roll: Angle::from_tenth_milliradians(-1),
        mode: Mode::Run,
        counter: Counter::new(13).unwrap(),
    };
    let cob = Cob::Target(NodeId::new(4).unwrap().get());
    let bytes = target.to_bytes(cob.id());
    assert_eq!(value(cob, "yaw", &bytes), -5_236);
    assert_eq!(value(cob, "pitch", &bytes), 2_618);
    assert_eq!(value(cob, "roll", &bytes), -1);
    assert_eq!(Choices::Mode.name(value(cob, "mode", &bytes)), Some("run"));
    assert_eq!(value(cob, "counter", &bytes), 13);
    assert_eq!(value(cob, "crc", &bytes), i64::from(bytes[7]));
}

#[test]
fn signals_of_a_pose_and_an_effort_are_what_their_types_hold() {
    let pose = PoseReport {
        yaw: Angle::from_tenth_milliradians(1_000),
        pitch: Angle::ZERO,
        roll: Angle::from_tenth_milliradians(698),
        state: State::StopBrake,
        counter: Counter::default(),
    };
    let cob = Cob::Pose(10);
    let bytes = pose.to_bytes(cob.id());
    assert_eq!(value(cob, "yaw", &bytes), 1_000);
    assert_eq!(
        Choices::State.name(value(cob, "state", &bytes)),
        Some("stop-brake")
    );
    let effort = Effort {
        torque: [-2_100, 0, 32_000].map(Torque::from_millinewton_metres),
        limit: [LimitCode::Peak, LimitCode::None, LimitCode::Off],
        flags: Flags {
            moment_limited: true,
            warning: true,
            ..Flags::default()
        },
    };
    let cob = Cob::Effort(10);
    let bytes = effort.to_bytes();
    assert_eq!(value(cob, "motor1", &bytes), -2_100);
    assert_eq!(value(cob, "motor3", &bytes), 32_000);
    assert_eq!(
        Choices::Limit.name(value(cob, "limit1", &bytes)),
        Some("peak")
    );
    assert_eq!(
        Choices::Limit.name(value(cob, "limit3", &bytes)),
        Some("off")
    );
    let flags = [
        "target_limited",
        "moment_limited",
        "command_lost",
        "warning",
    ]
    .map(|name| value(cob, name, &bytes));
    assert_eq!(flags, [0, 1, 0, 1]);
}

#[test]
fn signals_of_a_moment_are_what_its_type_holds() {
    let moment = Moment {
        moment: [-32_768, 1, 32_767].map(Torque::from_millinewton_metres),
        stiffness: 0xABCD,
    };
    let cob = Cob::Moment(3);
    let bytes = moment.to_bytes();
    let signals = Message::of(cob).unwrap().signals;
    let values: Vec<_> = signals.iter().map(|signal| signal.raw(&bytes)).collect();
    assert_eq!(values, [-32_768, 1, 32_767, 0xABCD].map(Some));
    assert_eq!(Moment::from_bytes(&bytes), moment);
}

#[test]
fn an_identifier_has_the_message_that_is_defined_for_it_or_none() {
    let mut found = 0;
    for id in 0..0x800 {
        let cob = Cob::from_id(id);
        assert_eq!(cob.id(), id);
        let Some(message) = Message::of(cob) else {
            continue;
        };
        assert_eq!(
            message.cob_id_base,
            id - u16::from(cob.node().unwrap_or_default())
        );
        found += 1;
    }
    // NMT and SYNC have one, the six others one for each of 127 nodes.
    assert_eq!(found, 2 + 6 * 127);
}
