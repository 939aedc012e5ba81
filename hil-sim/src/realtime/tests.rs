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

/// Switches the vertebra with this serial number to configuration, gives it an id, stores it, and
/// switches it back; returns all answers.
fn give_id(
    nodes: &mut Realtime<MemoryBus>,
    bus: &mut MemoryBus,
    serial: u32,
    id: u8,
) -> Vec<[u8; 8]> {
    let word = |command: u8, value: u32| {
        let [a, b, c, d] = value.to_le_bytes();
        [command, a, b, c, d, 0, 0, 0]
    };
    let requests = [
        word(0x40, identity::VENDOR),
        word(0x41, identity::PRODUCT),
        word(0x42, identity::REVISION),
        word(0x43, serial),
        [0x11, id, 0, 0, 0, 0, 0, 0],
        [0x17, 0, 0, 0, 0, 0, 0, 0],
        [0x04, 0, 0, 0, 0, 0, 0, 0],
    ];
    let mut answers = Vec::new();
    for request in requests {
        send(bus, Cob::LssRequest, &request);
        // What is stored is made in four ticks.
        let seen = ticks(nodes, bus, 8).into_iter();
        answers.extend(
            seen.filter(|frame| frame.cob_id() == Some(Cob::LssResponse.id()))
                .map(|frame| <[u8; 8]>::try_from(frame.data()).unwrap()),
        );
    }
    answers
}

#[test]
fn an_unconfigured_vertebra_is_silent_until_it_is_given_an_id_which_it_keeps() {
    let (ours, mut bus) = pair();
    let place = |number| NodeId::new(number).unwrap();
    let (configured, unconfigured) = ([place(1), place(5)], [place(3), place(5)]);
    let plant = PlantConfig::default();
    let mut nodes = Realtime::with_unconfigured(ours, &plant, 1, &configured, &unconfigured);
    let seen = ticks(&mut nodes, &mut bus, 500);
    let heartbeat = Cob::Heartbeat(1).id();
    assert!(seen.iter().all(|frame| frame.cob_id() == Some(heartbeat)));

    let serial = 0x5EE1_0003;
    let answers = give_id(&mut nodes, &mut bus, serial, 3);
    let expected = [
        [0x44, 0, 0, 0, 0, 0, 0, 0],
        [0x11, 0, 0, 0, 0, 0, 0, 0],
        [0x17, 0, 0, 0, 0, 0, 0, 0],
    ];
    assert_eq!(answers, expected);
    let seen = ticks(&mut nodes, &mut bus, 250);
    assert!(
        seen.contains(&Frame::standard(Cob::Heartbeat(3).id(), &[0x7F]).unwrap()),
        "it beats as node 3"
    );

    // The flash keeps the id over a loss of power, which the node does not see coming.
    let now = Instant::from_micros(nodes.counters().ticks * 1_000);
    let (_, node) = nodes.nodes.get_mut(1).unwrap();
    node.reset(now, crate::robot::Reset::Power);
    let boot_up = Frame::standard(Cob::Heartbeat(3).id(), &[0]).unwrap();
    assert!(ticks(&mut nodes, &mut bus, 2).contains(&boot_up));

    // An id beyond the chain is refused, with the code for it.
    let answers = give_id(&mut nodes, &mut bus, 0x5EE1_0005, 11);
    assert_eq!(answers[1], [0x11, 1, 0, 0, 0, 0, 0, 0]);
}

/// A bus whose frames came at times that the test says.
struct Stamped(VecDeque<(u64, Frame)>, Vec<Frame>);

impl Bus for Stamped {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.1.push(*frame);
        Ok(())
    }

    fn receive(&mut self, _timeout: Duration) -> Result<Option<Received>, BusError> {
        Ok(self.0.pop_front().map(|(time_ns, frame)| Received {
            time_ns,
            content: eel_transport::Content::Frame(frame),
            direction: None,
        }))
    }
}

#[test]
fn a_host_that_was_late_gives_each_tick_the_frames_of_its_own_millisecond() {
    const START_NS: u64 = 1_700_000_000_000_000_000;
    let frame = |cob: Cob, data: &[u8]| Frame::standard(cob.id(), data).unwrap();
    let mut came = VecDeque::from([(START_NS, frame(Cob::Nmt, &[1, 0]))]);
    for beat in 1..=5 {
        let time_ns = START_NS + u64::from(beat) * 10 * TICK_NS;
        came.push_back((time_ns, frame(Cob::Sync, &[beat])));
    }
    let one = [NodeId::FIRST];
    let bus = Stamped(came, Vec::new());
    let mut nodes = Realtime::with_nodes(bus, &PlantConfig::default(), 1, &one);
    nodes.tick_until(START_NS).unwrap();
    // All five beats are in the queue already, and 60 ms are made up for.
    let mut beats = Vec::new();
    for tick in 1..=60 {
        nodes.tick_until(START_NS + tick * TICK_NS).unwrap();
        let poses = nodes.bus.1.drain(..);
        let count = poses
            .filter(|frame| frame.cob_id() == Some(Cob::Pose(1).id()))
            .count();
        beats.extend(std::iter::repeat_n(tick, count));
    }
    assert_eq!(beats, [10, 20, 30, 40, 50]);
    // A clock that was set back holds nothing up.
    let late = START_NS + 3_600_000_000_000;
    nodes.bus.0.push_back((late, frame(Cob::Sync, &[6])));
    nodes.tick_until(START_NS + 61 * TICK_NS).unwrap();
    assert_eq!(nodes.counters().received, 7);
}
