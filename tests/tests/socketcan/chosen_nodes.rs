//! Some vertebrae on a real interface, as beside boards that are the others.

use std::collections::BTreeSet;

use eel_protocol::{Cob, Frame, NodeId, VERTEBRAE, identity};
use eel_transport::{Bus, SocketBus};

use crate::nodes::Nodes;
use crate::support::{PATIENCE, interface};

/// Returns the next frame, whatever it is.
fn next(bus: &mut SocketBus) -> Frame {
    loop {
        let received = bus.receive(PATIENCE).unwrap().expect("a frame in time");
        if let Some(frame) = received.frame() {
            return *frame;
        }
    }
}

#[test]
fn only_the_chosen_vertebrae_boot_and_answer() {
    let Some(name) = interface() else { return };
    let mut bus = SocketBus::open(&name).unwrap();
    let chosen = [3, 5].map(|id| NodeId::new(id).unwrap());
    let nodes = Nodes::start(&name, chosen.to_vec());
    let is = |frame: &Frame, cob: Cob| frame.cob_id() == Some(cob.id());
    while !is(&next(&mut bus), Cob::Heartbeat(5)) {}
    let upload = [0x40, 0x00, 0x10, 0, 0, 0, 0, 0];
    for node in 1..=VERTEBRAE {
        let request = Frame::standard(Cob::SdoRequest(node).id(), &upload).unwrap();
        bus.send(&request).unwrap();
    }
    // All simulated vertebrae take their turns one after the other: once the fifth has beaten three
    // times more, each of them has had time to answer.
    let (mut beats, mut senders) = (0, BTreeSet::new());
    while beats < 3 {
        let frame = next(&mut bus);
        beats += u32::from(is(&frame, Cob::Heartbeat(5)));
        let cob = Cob::from_id(frame.cob_id().unwrap());
        if let Cob::SdoResponse(node) = cob {
            assert_eq!(frame.data()[4..], identity::DEVICE_TYPE.to_le_bytes());
            assert!(senders.insert(node), "node {node} answers once");
        }
    }
    assert_eq!(senders, BTreeSet::from([3, 5]));
    let counters = nodes.end();
    assert_eq!(counters.dropped, 0);
    assert!(counters.received >= u64::from(VERTEBRAE), "{counters:?}");
}
