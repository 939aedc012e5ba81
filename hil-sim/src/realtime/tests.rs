//! The ten nodes tick by tick on a bus in memory, without a clock.

use eel_protocol::{Cob, HEAD_NODE, VERTEBRAE, identity};
use eel_transport::{MemoryBus, pair};

use super::*;

fn ten_nodes() -> (Realtime<MemoryBus>, MemoryBus) {
    let (ours, theirs) = pair();
    (Realtime::new(ours, &PlantConfig::default(), 1), theirs)
}

/// Lets ticks pass and returns what the nodes sent.
fn ticks(nodes: &mut Realtime<MemoryBus>, bus: &mut MemoryBus, count: u32) -> Vec<Frame> {
    let mut seen = Vec::new();
    for _ in 0..count {
        nodes.tick().unwrap();
        while let Some(received) = bus.receive(Duration::ZERO).unwrap() {
            seen.extend(received.frame());
        }
    }
    seen
}

fn send(bus: &mut MemoryBus, cob: Cob, data: &[u8]) {
    bus.send(&Frame::standard(cob.id(), data).unwrap()).unwrap();
}

#[test]
fn all_ten_boot_beat_and_tell_their_device_type() {
    let (mut nodes, mut bus) = ten_nodes();
    let seen = ticks(&mut nodes, &mut bus, 500);
    for node in 1..=VERTEBRAE {
        let states: Vec<u8> = seen
            .iter()
            .filter(|frame| frame.cob_id() == Some(Cob::Heartbeat(node).id()))
            .map(|frame| frame.data()[0])
            .collect();
        assert_eq!(
            states,
            [0x00, 0x7F, 0x7F],
            "node {node}: boot-up, then pre-operational"
        );
        send(
            &mut bus,
            Cob::SdoRequest(node),
            &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0],
        );
    }
    let answers = ticks(&mut nodes, &mut bus, 5);
    for node in 1..=VERTEBRAE {
        let [a, b, c, d] = identity::DEVICE_TYPE.to_le_bytes();
        let expected = Frame::standard(
            Cob::SdoResponse(node).id(),
            &[0x43, 0x00, 0x10, 0, a, b, c, d],
        );
        assert!(
            answers.contains(&expected.unwrap()),
            "node {node}: {answers:?}"
        );
    }
    assert_eq!(nodes.counters().dropped, 0);
    assert_eq!(nodes.counters().received, 10);
    assert_eq!(nodes.counters().ticks, 505);
}

#[test]
fn only_the_chosen_vertebrae_are_there_and_the_motors_of_the_others_are_off() {
    let (ours, mut bus) = pair();
    let chosen = [5, 3].map(|id| NodeId::new(id).unwrap());
    let mut nodes = Realtime::with_nodes(ours, &PlantConfig::default(), 1, &chosen);
    let seen = ticks(&mut nodes, &mut bus, 500);
    let from: Vec<u16> = seen.iter().filter_map(Frame::cob_id).take(2).collect();
    assert_eq!(from, [Cob::Heartbeat(3).id(), Cob::Heartbeat(5).id()]);
    assert!(
        seen.iter()
            .all(|frame| from.contains(&frame.cob_id().unwrap()))
    );
    for id in NodeId::all() {
        assert_eq!(nodes.node(id).is_some(), chosen.contains(&id), "{id:?}");
        assert!(chosen.contains(&id) || nodes.drives[id.index()] == [Drive::Off; 3]);
    }
}

#[test]
fn started_nodes_report_their_pose_at_every_sync() {
    let (mut nodes, mut bus) = ten_nodes();
    ticks(&mut nodes, &mut bus, 10);
    send(&mut bus, Cob::Heartbeat(HEAD_NODE), &[5]);
    send(&mut bus, Cob::Nmt, &[1, 0]);
    ticks(&mut nodes, &mut bus, 2);
    for sync in 1..=3 {
        send(&mut bus, Cob::Sync, &[sync]);
        let seen = ticks(&mut nodes, &mut bus, 3);
        for node in 1..=VERTEBRAE {
            let of_node = |frame: &&Frame| frame.cob_id() == Some(Cob::Pose(node).id());
            assert_eq!(
                seen.iter().filter(of_node).count(),
                1,
                "node {node}, SYNC {sync}"
            );
        }
    }
}

#[test]
fn equal_frames_in_equal_ticks_give_equal_answers() {
    let run = || {
        let (mut nodes, mut bus) = ten_nodes();
        let mut seen = ticks(&mut nodes, &mut bus, 10);
        send(&mut bus, Cob::Nmt, &[1, 0]);
        for sync in 0..20 {
            send(&mut bus, Cob::Heartbeat(HEAD_NODE), &[5]);
            send(&mut bus, Cob::Sync, &[sync]);
            seen.extend(ticks(&mut nodes, &mut bus, 10));
        }
        (seen, nodes.plant().fingerprint())
    };
    assert_eq!(run(), run());
}

#[test]
fn a_bus_that_ends_ends_the_run() {
    let (mut nodes, bus) = ten_nodes();
    drop(bus);
    assert!(matches!(nodes.run(|_| true), Err(BusError::Ended)));
}
