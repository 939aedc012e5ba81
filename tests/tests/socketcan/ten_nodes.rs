//! Ten vertebrae on a real interface, met by python-canopen and watched by candump.

use eel_protocol::{Cob, NodeId, VERTEBRAE, identity};

use crate::nodes::Nodes;
use crate::support::{Program, frames_of, interface, listeners, script, wait_for_listeners};

#[test]
fn python_canopen_meets_ten_vertebrae_and_candump_sees_them() {
    let Some(name) = interface() else { return };
    let before = listeners();
    let candump = Program::start(&["candump", "-L", &name]);
    wait_for_listeners(before, 1);
    let nodes = Nodes::start(&name, NodeId::all().collect());
    let found = script("ten_nodes.py", &[&name]);
    let counters = nodes.end();
    candump.interrupt();
    let log = candump.output();

    let mut serials = Vec::new();
    for node in 1..=VERTEBRAE {
        let node = &found[node.to_string()];
        assert_eq!(node["first_state"], "PRE-OPERATIONAL");
        assert_eq!(node["device_type"], identity::DEVICE_TYPE);
        assert_eq!(node["vendor"], identity::VENDOR);
        assert_eq!(node["heartbeat_ms"], eel_protocol::VERTEBRA_HEARTBEAT_MS);
        assert_eq!(node["missing_object"], 0x0602_0000, "object does not exist");
        serials.push(node["serial"].as_u64().expect("a serial number"));
    }
    serials.dedup();
    assert_eq!(
        serials.len(),
        usize::from(VERTEBRAE),
        "every node is one of its own"
    );

    let frames = frames_of(&log);
    for node in 1..=VERTEBRAE {
        let of = |cob: Cob| {
            frames
                .iter()
                .filter(move |frame| frame.cob_id() == Some(cob.id()))
        };
        let states: Vec<u8> = of(Cob::Heartbeat(node))
            .map(|frame| frame.data()[0])
            .collect();
        assert_eq!(states.first(), Some(&0x00), "node {node} boots up once");
        for state in [0x7F, 0x05] {
            assert!(states[1..].contains(&state), "node {node}: {states:02X?}");
        }
        assert!(
            !states[1..].contains(&0x00),
            "node {node} restarted: {states:02X?}"
        );
        assert_eq!(
            of(Cob::SdoRequest(node)).count(),
            of(Cob::SdoResponse(node)).count()
        );
    }
    assert_eq!(counters.dropped, 0);
    println!("{counters:?}, candump saw {} frames", frames.len());
}
