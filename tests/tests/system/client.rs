//! The host's CANopen client against the vertebra's own node, in real time over a bus in memory.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use eel_client::{
    Client, ClientError, LssAddress, Method, Multiplexor, NmtCommand, NmtState, Progress,
};
use eel_protocol::scope::{ScopeHeader, ScopeState};
use eel_protocol::{Frame, NodeId, identity};
use eel_transport::{Bus, BusError, MemoryBus, Received, pair};
use hil_sim::plant::Config;
use hil_sim::realtime::Realtime;

/// Lengths at the edges: one segment, two, one block of 127, more than one.
const LENGTHS: [usize; 7] = [1, 4, 7, 14, 889, 890, 2_000];
/// Objects of the transfer test.
const LINK_DATA: Multiplexor = Multiplexor::new(0x2101, 1);
const LINK_LENGTH: Multiplexor = Multiplexor::new(0x2101, 2);
const LINK_CRC: Multiplexor = Multiplexor::new(0x2101, 3);
const HEARTBEAT: Multiplexor = Multiplexor::new(0x1017, 0);
const PEAK_TORQUE: Multiplexor = Multiplexor::new(0x2020, 7);

/// Vertebrae that tick a millisecond a millisecond until they are dropped.
struct Nodes {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Nodes {
    fn start(configured: &[u8], unconfigured: &[u8]) -> (Self, MemoryBus) {
        let ids = |all: &[u8]| -> Vec<NodeId> {
            let ids = all.iter().map(|id| NodeId::new(*id).expect("a vertebra"));
            ids.collect()
        };
        let (configured, unconfigured) = (ids(configured), ids(unconfigured));
        let (theirs, ours) = pair();
        let stop = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&stop);
        let thread = thread::spawn(move || {
            let plant = Config::default();
            let mut nodes =
                Realtime::with_unconfigured(theirs, &plant, 1, &configured, &unconfigured);
            match nodes.run(|_| !told.load(Ordering::Relaxed)) {
                Ok(_) | Err(BusError::Ended) => {}
                Err(error) => panic!("{error}"),
            }
        });
        let nodes = Self {
            stop,
            thread: Some(thread),
        };
        (nodes, ours)
    }
}

impl Drop for Nodes {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || thread::panicking());
        }
    }
}

/// A client with the patience of a busy computer.
fn client<B: Bus>(bus: B) -> Client<B> {
    let mut client = Client::new(bus);
    client.settings_mut().answer = Duration::from_secs(5);
    client.settings_mut().lss = Duration::from_millis(30);
    client
}

fn read<B: Bus>(client: &mut Client<B>, node: u8, object: Multiplexor, method: Method) -> Vec<u8> {
    client
        .upload(node, object, method, &mut |_| ())
        .unwrap_or_else(|error| panic!("{error}"))
}

fn write<B: Bus>(
    client: &mut Client<B>,
    node: u8,
    object: Multiplexor,
    data: &[u8],
    method: Method,
) {
    client
        .download(node, object, data, method, &mut |_| ())
        .unwrap_or_else(|error| panic!("{error}"));
}

/// Waits until a node has booted.
fn await_boot<B: Bus>(client: &mut Client<B>, node: u8) {
    let patience = Duration::from_secs(10);
    client
        .wait_for(node, patience, |_| true)
        .unwrap_or_else(|error| panic!("{error}"));
}

/// What link.data reads as, by the words of the dictionary.
fn pattern(length: usize) -> Vec<u8> {
    (0..length).map(|k| (7 * k + k / 256) as u8).collect()
}

/// CRC-32/ISO-HDLC, bit by bit.
fn crc32(data: &[u8]) -> u32 {
    let sum = data.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| {
            sum >> 1 ^ if sum & 1 == 1 { 0xEDB8_8320 } else { 0 }
        })
    });
    !sum
}

#[test]
fn nodes_are_found_identified_read_written_and_commanded() {
    let (_nodes, bus) = Nodes::start(&[2, 3, 10], &[]);
    let mut client = client(bus);
    await_boot(&mut client, 10);
    let found = client.find_nodes(1..=127, Duration::from_secs(1)).unwrap();
    let ids: Vec<_> = found.iter().map(|found| found.node).collect();
    assert_eq!(ids, [2, 3, 10]);
    for found in found {
        assert_eq!(found.state, Some(NmtState::PreOperational));
        assert_eq!(found.device_type, Some(identity::DEVICE_TYPE));
        let address = client.identify(found.node).unwrap().address;
        assert_eq!(address, vertebra(found.node));
    }
    let name = Multiplexor::new(0x1008, 0);
    assert_eq!(client.text(3, name).unwrap(), identity::DEVICE_NAME);
    assert_eq!(client.history(3).unwrap(), []);

    assert_eq!(client.number(3, PEAK_TORQUE).unwrap(), 3_000);
    write(
        &mut client,
        3,
        PEAK_TORQUE,
        &2_500_u16.to_le_bytes(),
        Method::Automatic,
    );
    assert_eq!(client.number(3, PEAK_TORQUE).unwrap(), 2_500);
    for (object, data, expected) in [
        (PEAK_TORQUE, &[0xFF, 0xFF][..], 0x0609_0031),
        (PEAK_TORQUE, &[1], 0x0607_0013),
        (name, b"x", 0x0601_0002),
        (Multiplexor::new(0x5000, 0), &[1], 0x0602_0000),
        (Multiplexor::new(0x2020, 99), &[1, 0], 0x0609_0011),
    ] {
        let refused = client.download(3, object, data, Method::Automatic, &mut |_| ());
        assert!(
            matches!(refused, Err(ClientError::Aborted { code, .. }) if code == expected),
            "{object}: {refused:?}"
        );
    }

    client.command(NmtCommand::Start, 3).unwrap();
    let state = client.wait_for(3, Duration::from_secs(5), |state| {
        state == NmtState::Operational
    });
    assert_eq!(state.unwrap(), NmtState::Operational);
    client.command(NmtCommand::Stop, 0).unwrap();
    let stopped = client.wait_for(3, Duration::from_secs(5), |state| {
        state == NmtState::Stopped
    });
    assert_eq!(stopped.unwrap(), NmtState::Stopped);
    client.settings_mut().answer = Duration::from_millis(100);
    let silent = client.number(3, HEARTBEAT);
    assert!(matches!(silent, Err(ClientError::Timeout { node: 3, .. })));
}

#[test]
fn any_length_goes_both_ways_in_segments_and_in_blocks() {
    let (_nodes, bus) = Nodes::start(&[3], &[]);
    let mut client = client(bus);
    await_boot(&mut client, 3);
    for length in LENGTHS {
        for method in [Method::Segmented, Method::Block, Method::Automatic] {
            transfer(&mut client, length, method);
        }
    }
}

/// Reads and writes so many bytes.
fn transfer<B: Bus>(client: &mut Client<B>, length: usize, method: Method) {
    let expected = pattern(length);
    let count = (length as u32).to_le_bytes();
    write(client, 3, LINK_LENGTH, &count, Method::Automatic);
    assert_eq!(
        read(client, 3, LINK_DATA, method),
        expected,
        "{length} {method:?}"
    );
    let sent: Vec<_> = expected.iter().rev().map(|byte| !byte).collect();
    let mut last = None;
    let mut progress = |step: Progress| last = Some(step);
    client
        .download(3, LINK_DATA, &sent, method, &mut progress)
        .unwrap_or_else(|error| panic!("{length} {method:?}: {error}"));
    assert_eq!(client.number(3, LINK_CRC).unwrap(), crc32(&sent));
    if method == Method::Block {
        let whole = Progress {
            done: length,
            total: Some(length),
        };
        assert_eq!(last, Some(whole));
    }
}

/// A bus that loses every fifth segment of a block in both directions.
struct Lossy {
    bus: MemoryBus,
    segments: u32,
    lost: u32,
}

impl Lossy {
    /// Tells whether a frame gets lost: of those that are certainly no commands of a block transfer.
    fn loses(&mut self, frame: &Frame) -> bool {
        let is_sdo = matches!(frame.cob_id(), Some(0x583 | 0x603));
        let is_segment = is_sdo && matches!(frame.data(), [1..=0x1F, ..]);
        self.segments += u32::from(is_segment);
        let is_lost = is_segment && self.segments.is_multiple_of(5);
        self.lost += u32::from(is_lost);
        is_lost
    }
}

impl Bus for Lossy {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        if self.loses(frame) {
            return Ok(());
        }
        self.bus.send(frame)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Received>, BusError> {
        let received = self.bus.receive(timeout)?;
        Ok(received.filter(|received| !received.frame().is_some_and(|frame| self.loses(frame))))
    }
}

#[test]
fn lost_segments_of_blocks_are_sent_again_in_both_directions() {
    let (_nodes, bus) = Nodes::start(&[3], &[]);
    let mut client = client(Lossy {
        bus,
        segments: 0,
        lost: 0,
    });
    await_boot(&mut client, 3);
    let count = 2_000_u32.to_le_bytes();
    write(&mut client, 3, LINK_LENGTH, &count, Method::Automatic);
    let expected = pattern(2_000);
    assert_eq!(read(&mut client, 3, LINK_DATA, Method::Block), expected);
    write(&mut client, 3, LINK_DATA, &expected, Method::Block);
    assert_eq!(client.number(3, LINK_CRC).unwrap(), crc32(&expected));
    let lost = client.into_bus().lost;
    println!("{lost} segments lost and sent again");
    assert!(lost > 20, "only {lost} segments were lost");
}

#[test]
fn a_node_serves_its_own_data_sheet() {
    let (_nodes, bus) = Nodes::start(&[3], &[]);
    let mut client = client(bus);
    await_boot(&mut client, 3);
    let served = read(
        &mut client,
        3,
        Multiplexor::new(0x1021, 0),
        Method::Automatic,
    );
    let mut written = String::new();
    eel_protocol::export::write_eds(&mut written).unwrap();
    assert!(served == written.as_bytes(), "{} bytes", served.len());
}

/// Returns the identity of the simulated vertebra at a place.
const fn vertebra(place: u8) -> LssAddress {
    LssAddress {
        vendor: identity::VENDOR,
        product: identity::PRODUCT,
        revision: identity::REVISION,
        serial: 0x5EE1_0000 + place as u32,
    }
}

#[test]
fn two_nodes_without_an_id_are_found_and_get_one() {
    let (_nodes, bus) = Nodes::start(&[1, 2], &[3, 5]);
    let mut client = client(bus);
    await_boot(&mut client, 1);
    let listed = client.lss().list().unwrap();
    assert_eq!(listed, [vertebra(3), vertebra(5)]);
    for (place, id) in [(3, 7), (5, 4)] {
        assert!(client.lss().any_without_id().unwrap());
        // One is found without a guess, the other with one.
        let guess = (place == 5).then_some(vertebra(0));
        let mut lss = client.lss();
        assert_eq!(lss.scan(guess).unwrap(), Some(vertebra(place)));
        assert_eq!(lss.identity().unwrap(), vertebra(place));
        assert_eq!(lss.node_id().unwrap(), None);
        lss.set_node_id(id).unwrap();
        lss.store().unwrap();
        lss.switch_all(false).unwrap();
        let booted = client.wait_for(id, Duration::from_secs(5), |state| {
            state == NmtState::Initialising
        });
        assert!(booted.is_ok());
        assert_eq!(client.identify(id).unwrap().address, vertebra(place));
    }
    assert_eq!(client.lss().scan(None).unwrap(), None);
    assert!(!client.lss().any_without_id().unwrap());
    // One that has an id is selected by its identity and keeps the new id for its next reset.
    let mut lss = client.lss();
    lss.switch_to(vertebra(2)).unwrap();
    assert_eq!(lss.node_id().unwrap(), Some(2));
    lss.set_node_id(6).unwrap();
    lss.switch_all(false).unwrap();
    client.command(NmtCommand::ResetCommunication, 2).unwrap();
    await_boot(&mut client, 6);
    assert_eq!(client.identify(6).unwrap().address, vertebra(2));
}

#[test]
fn what_is_stored_outlasts_a_reset_until_it_is_restored() {
    let (_nodes, bus) = Nodes::start(&[3], &[]);
    let mut client = client(bus);
    await_boot(&mut client, 3);
    let reset = |client: &mut Client<MemoryBus>| {
        client.command(NmtCommand::ResetNode, 3).unwrap();
        let booted = client.wait_for(3, Duration::from_secs(5), |state| {
            state == NmtState::Initialising
        });
        assert!(booted.is_ok());
        let heartbeat = client.number(3, HEARTBEAT).unwrap();
        (heartbeat, client.number(3, PEAK_TORQUE).unwrap())
    };
    let change = |client: &mut Client<MemoryBus>| {
        write(client, 3, HEARTBEAT, &[150, 0], Method::Automatic);
        write(client, 3, PEAK_TORQUE, &[0xC4, 9], Method::Automatic);
    };
    change(&mut client);
    assert_eq!(reset(&mut client), (200, 3_000), "nothing was stored");
    change(&mut client);
    let save = Multiplexor::new(0x1010, 1);
    let wrong = client.download(3, save, b"evas", Method::Automatic, &mut |_| ());
    assert!(matches!(
        wrong,
        Err(ClientError::Aborted {
            code: 0x0800_0020,
            ..
        })
    ));
    write(&mut client, 3, save, b"save", Method::Automatic);
    assert_eq!(reset(&mut client), (150, 2_500), "all was stored");
    let restore_communication = Multiplexor::new(0x1011, 2);
    write(
        &mut client,
        3,
        restore_communication,
        b"load",
        Method::Automatic,
    );
    assert_eq!(reset(&mut client), (200, 2_500), "one group was restored");
    let restore_all = Multiplexor::new(0x1011, 1);
    write(&mut client, 3, restore_all, b"load", Method::Automatic);
    assert_eq!(reset(&mut client), (200, 3_000), "all was restored");
}

/// What `eel scope` and `eel faults` do on the bus, and what they take apart.
#[test]
fn the_scope_fills_its_memory_and_there_is_no_freeze_frame_before_a_fault() {
    let (_nodes, bus) = Nodes::start(&[3], &[]);
    let mut client = client(bus);
    await_boot(&mut client, 3);
    let freeze = Multiplexor::new(0x2100, 1);
    let none = client.upload(3, freeze, Method::Automatic, &mut |_| ());
    assert!(
        matches!(none, Err(ClientError::Aborted { code, .. }) if code == 0x0800_0024),
        "{none:?}"
    );

    let channels = [0x2012_0120, 0x2030_0110, 0, 0_u32];
    let scope = |subindex| Multiplexor::new(0x2050, subindex);
    for (subindex, raw) in (1..).zip(channels) {
        let raw = raw.to_le_bytes();
        write(&mut client, 3, scope(subindex), &raw, Method::Automatic);
    }
    write(&mut client, 3, scope(6), &[1], Method::Automatic);
    while client.number(3, scope(7)).unwrap() != ScopeState::Full as u32 {
        client.listen(Duration::from_millis(20)).unwrap();
    }
    let record = read(
        &mut client,
        3,
        Multiplexor::new(0x2100, 2),
        Method::Automatic,
    );
    let (header, samples) = ScopeHeader::from_bytes(&record).unwrap();
    assert_eq!((header.channels, header.samples), (channels, 512));
    assert_eq!((header.state, header.fault), (ScopeState::Full, None));
    let (words, _) = samples.as_chunks::<4>();
    let supply: Vec<_> = words.iter().skip(1).step_by(2).collect();
    assert!(
        supply
            .iter()
            .all(|word| (20_000..30_000).contains(&i32::from_le_bytes(**word))),
        "about 24 V"
    );
}
