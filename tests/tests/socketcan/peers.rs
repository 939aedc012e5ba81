//! Clients from the Rust registry, which know nothing of this project: canopen-cli and zencan-cli.

use eel_protocol::{Frame, NodeId, identity};
use eel_transport::{Bus, SocketBus};

use crate::nodes::Nodes;
use crate::support::{PATIENCE, fails, interface, peer, run};

/// Starts vertebrae 3 and 5 and waits until both have booted.
fn two_vertebrae(interface: &str) -> Nodes {
    let mut bus = SocketBus::open(interface).unwrap();
    let nodes = Nodes::start(
        interface,
        [3, 5].map(|id| NodeId::new(id).unwrap()).to_vec(),
    );
    let mut missing = vec![0x703, 0x705];
    while !missing.is_empty() {
        let received = bus.receive(PATIENCE).unwrap().expect("a boot-up message");
        let id = received.frame().and_then(Frame::cob_id);
        missing.retain(|wanted| Some(*wanted) != id);
    }
    nodes
}

#[test]
fn canopen_cli_reads_writes_and_starts_a_vertebra() {
    let Some(name) = interface() else { return };
    let nodes = two_vertebrae(&name);
    let canopen = peer("canopen");
    let say = |words: &[&str]| {
        run(&[&[canopen.as_str()], words].concat())
            .trim()
            .to_owned()
    };
    let read = |object: &str, kind: &str| say(&["read", &name, "3", object, kind]);
    let device_type = format!("Unsigned32({})", identity::DEVICE_TYPE);
    assert_eq!(read("1000", "u32"), device_type);
    assert_eq!(read("2020:8", "i16"), "Integer16(5236)");
    assert_eq!(say(&["write", &name, "3", "1017", "u16", "150"]), "ok");
    assert_eq!(read("1017", "u16"), "Unsigned16(150)");
    let refusal = fails(&[&canopen, "read", &name, "3", "5fff", "u8"]);
    assert!(
        refusal.to_lowercase().contains("06020000") || refusal.contains("ObjectDoesNotExist"),
        "{refusal}"
    );
    assert_eq!(read("2010:6", "u32"), "Unsigned32(256)", "not operational");
    say(&["nmt", &name, "start", "3"]);
    assert_eq!(read("2010:6", "u32"), "Unsigned32(0)", "nothing in the way");
    let sheet = say(&["eds", "docs/generated/vertebra.eds"]);
    for (object, sub) in eel_protocol::dictionary::entries() {
        let entry = format!("0x{:04x}:{:02x}", object.index, sub.subindex);
        let found = sheet.lines().find(|line| line.contains(&entry));
        assert!(
            found.is_some_and(|line| line.ends_with(sub.name)),
            "{entry}: {found:?}"
        );
    }
    assert_eq!(nodes.end().dropped, 0);
}

#[test]
fn zencan_cli_scans_reads_writes_and_starts_vertebrae() {
    let Some(name) = interface() else { return };
    let nodes = two_vertebrae(&name);
    let zencan = peer("zencan-cli");
    let say = |command: &str| {
        run(&[&zencan, "--command", command, &name])
            .trim()
            .to_owned()
    };
    let found = say("scan");
    for node in [3, 5] {
        assert!(found.contains(&format!("Node {node}: ")), "{found}");
    }
    assert_eq!(found.matches("Node ").count(), 2, "{found}");
    let product = format!("product: {:X}", identity::PRODUCT);
    for text in [product.as_str(), identity::DEVICE_NAME] {
        assert_eq!(found.matches(text).count(), 2, "{found}");
    }
    let device_type = format!("Value: {}", identity::DEVICE_TYPE);
    assert_eq!(say("read 3 0x1000 0 u32"), device_type);
    let device_name = format!("Value: {}", identity::DEVICE_NAME);
    assert_eq!(say("read 3 0x1008 0 utf8"), device_name);
    say("write 3 0x2020 1 u32 123456");
    assert_eq!(say("read 3 0x2020 1 u32"), "Value: 123456");
    let refusal = say("write 3 0x2020 1 u32 600000");
    assert!(refusal.contains("ValueTooHigh"), "{refusal}");
    say("nmt start 3");
    let found = say("scan");
    assert!(found.contains("Node 3: Operational"), "{found}");
    assert!(found.contains("Node 5: PreOperational"), "{found}");
    let pdos = say("scan-pdo-config 3");
    let listed = "valid=true, COB=Std(0x183), transmission_type=1";
    assert!(pdos.contains(listed), "{pdos}");
    let entries = [(0x2010, 5), (0x2011, 4), (0x2000, 5), (0x2001, 4)];
    for (index, count) in entries {
        let entry = format!("index=0x{index:04X}");
        assert_eq!(pdos.matches(&entry).count(), count, "{pdos}");
    }
    assert_eq!(nodes.end().dropped, 0);
}

#[test]
fn zencan_cli_finds_vertebrae_without_ids_and_gives_them_some() {
    let Some(name) = interface() else { return };
    let places = [3, 5].map(|id| NodeId::new(id).unwrap());
    let nodes = Nodes::unconfigured(&name, places.to_vec());
    let zencan = peer("zencan-cli");
    let say = |command: &str| run(&[&zencan, "--command", command, &name]);
    // 100 ms for an answer.
    let found = say("lss fastscan 100");
    assert!(found.starts_with("Found 2 unconfigured nodes"), "{found}");
    for id in [3, 5] {
        let (vendor, product) = (identity::VENDOR, identity::PRODUCT);
        let (revision, serial) = (identity::REVISION, 0x5EE1_0000 + id);
        let address = format!("{vendor:#x} {product:#x} {revision:#x} {serial:#x}");
        assert!(found.contains(&address), "{found}");
        let given = say(&format!("lss set-node-id {id} {address}"));
        assert_eq!(given.trim(), "Success!");
        let stored = say(&format!("lss store-config {address}"));
        assert!(stored.ends_with("Success!\n"), "{stored}");
    }
    say("lss global 0");
    let found = say("scan");
    for id in [3, 5] {
        let node = format!("Node {id}: PreOperational");
        let serial = format!("serial: {:X}", 0x5EE1_0000 + id);
        assert!(found.contains(&node) && found.contains(&serial), "{found}");
    }
    // It writes the signature "save" the wrong way round (CiA 301, 7.5.2.13), so nothing is stored.
    let refusal = say("save-objects 3");
    assert!(refusal.contains("CantStore"), "{refusal}");
    assert_eq!(nodes.end().dropped, 0);
}
