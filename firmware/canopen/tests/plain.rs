//! An application that has values and nothing else: what a node does for it by itself.

mod common;

use common::CONFIG;
use eel_canopen::{Abort, Access, Application, Entry, Frame, Node};
use embedded_can::{ExtendedId, Frame as _, StandardId};

const NO_DATA: u32 = 0x0800_0024;
const READ_ONLY: u32 = 0x0601_0002;

/// Bytes by their subindex, which PDOs may carry, and two domains that nothing is behind.
struct Values {
    bytes: [u8; 8],
    applied: Vec<(u8, u16)>,
}

impl Application for Values {
    fn entry(&self, index: u16, subindex: u8) -> Result<Entry, Abort> {
        let (length, domain) = match (index, subindex) {
            (0x2010, 2) => (4, false),
            (0x2000..=0x2010, 1..=3) => (2, false),
            (0x2000..=0x2010, 4..=5) => (1, false),
            (0x2020, 1) => (0, true),
            _ => return Err(Abort::NoObject),
        };
        Ok(Entry {
            length,
            domain,
            access: Access::ReadWrite,
            tpdo: true,
            rpdo: true,
        })
    }

    fn read(&self, index: u16, subindex: u8, out: &mut [u8]) -> Result<usize, Abort> {
        let length = usize::from(self.entry(index, subindex)?.length);
        let value = [self.bytes[usize::from(subindex)]; 4];
        out[..length].copy_from_slice(&value[..length]);
        Ok(length)
    }

    fn write(&mut self, _: u16, subindex: u8, data: &[u8]) -> Result<(), Abort> {
        self.bytes[usize::from(subindex)] = data[0];
        Ok(())
    }

    fn rpdo_applied(&mut self, number: u8, cob_id: u16) {
        self.applied.push((number, cob_id));
    }
}

/// An Operational node with such an application.
fn operational() -> (Node, Values) {
    let mut app = Values {
        bytes: [0; 8],
        applied: Vec::new(),
    };
    let mut node = Node::new(CONFIG, &[], &app, 0);
    hear(&mut node, &mut app, 0, &[1, common::ID]);
    (node, app)
}

/// Hands a frame to the node and returns what it sends.
fn hear(node: &mut Node, app: &mut Values, cob_id: u16, data: &[u8]) -> Vec<(u16, Vec<u8>)> {
    node.handle_frame(0, &Frame::standard(cob_id, data).unwrap(), app);
    let sent = std::iter::from_fn(|| node.poll_transmit());
    sent.map(|frame| (frame.cob_id().unwrap(), frame.data().to_vec()))
        .collect()
}

/// Asks by SDO and returns the abort code that comes.
fn refusal(node: &mut Node, app: &mut Values, request: [u8; 8]) -> u32 {
    let sent = hear(node, app, 0x605, &request);
    let [(0x585, answer)] = sent.as_slice() else {
        panic!("{sent:02X?}")
    };
    assert_eq!(answer[0], 0x80, "{answer:02X?}");
    u32::from_le_bytes(answer[4..].try_into().unwrap())
}

#[test]
fn pdos_reach_it_object_by_object() {
    let (mut node, mut app) = operational();
    hear(&mut node, &mut app, 0x205, &[11, 0, 22, 0, 33, 0, 44, 55]);
    assert_eq!(app.bytes, [0; 8], "not before SYNC");
    let sent = hear(&mut node, &mut app, 0x080, &[]);
    assert_eq!(app.bytes, [0, 11, 22, 33, 44, 55, 0, 0]);
    assert_eq!(app.applied, [(1, 0x205)]);
    let pose = sent.iter().find(|(cob_id, _)| *cob_id == 0x185);
    // Its last byte is the node's own, the error register.
    assert_eq!(pose.expect("TPDO1").1, [11, 11, 22, 22, 22, 22, 0]);
}

#[test]
fn a_domain_that_it_says_nothing_of_has_no_data_and_takes_none() {
    let (mut node, mut app) = operational();
    let upload = [0x40, 0x20, 0x20, 1, 0, 0, 0, 0];
    assert_eq!(refusal(&mut node, &mut app, upload), NO_DATA);
    let download = [0x21, 0x20, 0x20, 1, 100, 0, 0, 0];
    assert_eq!(refusal(&mut node, &mut app, download), READ_ONLY);
}

#[test]
fn its_node_may_always_be_configured() {
    let (mut node, mut app) = operational();
    let heartbeat = [0x2B, 0x17, 0x10, 0, 0xE8, 0x03, 0, 0];
    let sent = hear(&mut node, &mut app, 0x605, &heartbeat);
    assert_eq!(sent, [(0x585, vec![0x60, 0x17, 0x10, 0, 0, 0, 0, 0])]);
}

#[test]
fn what_it_does_not_override_refuses_domains_and_nothing_else() {
    let (_, mut app) = operational();
    assert_eq!(
        app.read_domain(0x2020, 1, 0, &mut [0; 8]),
        Err(Abort::NoData)
    );
    assert_eq!(app.write_domain(0x2020, 1, 0, &[1]), Err(Abort::ReadOnly));
    // There is nothing to undo in a download that never began.
    assert_eq!(app.end_domain(0x2020, 1, None), Ok(()));
}

/// Sends on what it gets, as a gateway between two drivers does that knows frames by their trait.
fn copy<From: embedded_can::Frame, To: embedded_can::Frame>(frame: &From) -> Option<To> {
    if frame.is_remote_frame() {
        To::new_remote(frame.id(), frame.dlc())
    } else {
        To::new(frame.id(), frame.data())
    }
}

#[test]
fn a_frame_goes_through_the_common_trait_and_stays_what_it_is() {
    let standard = StandardId::new(0x185).unwrap();
    let extended = ExtendedId::new(0x1234_5678).unwrap();
    let frames = [
        Frame::standard(0x185, &[1, 2, 3]).unwrap(),
        Frame::standard(0x080, &[]).unwrap(),
        <Frame>::new(extended, &[9; 8]).unwrap(),
        <Frame>::remote(standard, 4).unwrap(),
    ];
    for frame in &frames {
        assert_eq!(copy::<Frame, Frame>(frame).as_ref(), Some(frame));
    }
    let [data, _, long, remote] = frames;
    assert!(data.is_data_frame() && data.is_standard());
    assert!(long.is_extended() && remote.is_remote_frame());
    assert_eq!((remote.dlc(), remote.data()), (4, &[][..]));
    assert_eq!(<Frame as embedded_can::Frame>::new(standard, &[0; 9]), None);
    assert_eq!(
        <Frame as embedded_can::Frame>::new_remote(standard, 9),
        None
    );
    assert_eq!(
        <Frame as embedded_can::Frame>::new_remote(standard, 260),
        None
    );
}
