//! `eel lss assign` and `eel map` on a spine that was put together in some order.

use eel_protocol::NodeId;

use crate::bring_up::{eel, json};
use crate::nodes::Nodes;
use crate::support::interface;

#[test]
fn new_vertebrae_get_their_ids_from_head_to_tail_and_the_map_shows_it() {
    let Some(interface) = interface() else { return };
    let order = [4, 1, 3].map(|place| NodeId::new(place).expect("a vertebra"));
    let _nodes = Nodes::connected(&interface, order.to_vec());

    let (code, out, err) = eel(&interface, &["lss", "assign", "1", "2", "3"]);
    assert_eq!(code, 0, "{out} {err}");
    let map = json(&interface, &["map", "--json"]);
    let serials = [0x5EE1_0004_u32, 0x5EE1_0001, 0x5EE1_0003];
    let chain = map["chain"].as_array().expect("a chain");
    assert_eq!(chain.len(), 3, "{map}");
    for ((place, row), serial) in (1..).zip(chain).zip(serials) {
        assert_eq!(row["place"], place, "{map}");
        assert_eq!(row["node"], place, "{map}");
        assert_eq!(row["serial"], serial, "{map}");
    }
    assert_eq!(map["ordered"], true);
    let head = ["head", "--nodes", "1-3", "--seconds", "1"];
    let (code, out, err) = eel(&interface, &head);
    assert_eq!((code, &err[..]), (0, ""), "{out}");

    // Two that changed places are found out.
    for (from, to) in [("1", "9"), ("2", "1"), ("9", "2")] {
        let (code, _, err) = eel(&interface, &["lss", "assign", to, "--from", from]);
        assert_eq!(code, 0, "{err}");
        let (code, _, err) = eel(&interface, &["nmt", from, "reset-communication"]);
        assert!(code <= 1, "{err}");
    }
    let (code, out, err) = eel(&interface, &["map"]);
    assert_eq!(code, 1, "{out} {err}");
    assert_eq!(out.matches("not its place").count(), 2, "{out}");
    assert!(out.contains("eel lss assign PLACE --from NODE"), "{out}");

    // The head leads no such spine.
    let (code, out, err) = eel(&interface, &head);
    assert_eq!(code, 2, "{out} {err}");
    assert!(
        err.contains("vertebra 1 is the next behind vertebra 2"),
        "{err}"
    );
}
