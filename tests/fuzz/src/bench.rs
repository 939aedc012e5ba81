//! A node with its application, the time, and eyes on everything that it sends.

use eel_canopen::{
    Abort, Application, Config, Entry, Event, Frame, Identity, Mapped, NmtState, Node, PdoDefault,
    STORED_PARAMETERS,
};

use crate::application::Objects;
use crate::oracle::{Allowed, is_reserved};

/// The node id of a node that has one.
pub const ID: u8 = 5;
/// The node id of a node that has none.
pub const NO_ID: u8 = 0xFF;
/// Object 0x1018.
pub const IDENTITY: [u32; 4] = [0x0000_03E7, 0x0000_0EE1, 0x0001_0002, 0xCAFE_F00D];
/// Object 0x1000.
const DEVICE_TYPE: u32 = 0x0002_0192;
/// The most frames that wait in a node: those of its queue and those of the SDO server.
const MOST_FRAMES: usize = 32;
/// After so many ticks at one time there is nothing left to do at that time: a block of 127 segments, four a
/// tick, and some.
const MOST_TICKS: usize = 40;

const fn pdo(cob_id_base: u16, transmission: u8, mapping: &'static [Mapped]) -> PdoDefault {
    PdoDefault {
        cob_id_base,
        transmission,
        enabled: !mapping.is_empty(),
        mapping,
    }
}

const TARGET: &[Mapped] = &[
    Mapped::new(0x2000, 1, 16),
    Mapped::new(0x2000, 2, 16),
    Mapped::new(0x2000, 3, 16),
    Mapped::new(0x2000, 4, 8),
    Mapped::new(0x2000, 5, 8),
];
const BYTES: &[Mapped] = &[
    Mapped::new(0x2002, 1, 8),
    Mapped::new(0x2002, 2, 8),
    Mapped::new(0x2002, 3, 8),
    Mapped::new(0x2002, 4, 8),
    Mapped::new(0x2002, 5, 8),
    Mapped::new(0x2002, 6, 8),
    Mapped::new(0x2002, 7, 8),
    Mapped::new(0x2002, 8, 8),
];
const MIXED: &[Mapped] = &[
    Mapped::new(0x2010, 1, 16),
    Mapped::new(0x2010, 2, 32),
    Mapped::new(0x1001, 0, 8),
];
const LONG: &[Mapped] = &[Mapped::new(0x2010, 3, 64)];

const RPDOS: &[PdoDefault] = &[
    pdo(0x200, 1, TARGET),
    pdo(0x300, 255, BYTES),
    pdo(0x400, 1, &[]),
];
const TPDOS: &[PdoDefault] = &[
    pdo(0x180, 1, MIXED),
    pdo(0x280, 2, BYTES),
    pdo(0x380, 254, LONG),
    pdo(0x480, 0, &[]),
];

/// Returns a configuration with three RPDOs and four TPDOs of every kind.
pub const fn config(node_id: u8) -> Config {
    let [vendor, product, revision, serial] = IDENTITY;
    Config {
        node_id,
        node_ids: (1, 127),
        identity: Identity {
            vendor,
            product,
            revision,
            serial,
        },
        device_type: DEVICE_TYPE,
        device_name: "a node that is being fuzzed",
        hardware_version: "1",
        software_version: "0.1.0",
        heartbeat_ms: 200,
        consumer: Some((127, 300)),
        sync_cob_id: 0x080,
        sync_counter_overflow: 0,
        time_cob_id: 0x100,
        error_behaviour: 0,
        rpdos: RPDOS,
        tpdos: TPDOS,
    }
}

/// A node, its application and the time.
#[derive(Clone)]
pub struct Bench {
    pub node: Node,
    pub app: Objects,
    pub now_us: u64,
    allowed: Allowed,
    /// Whether SDO requests may change the identifiers that are allowed.
    pub watches: bool,
    /// Whether the client has left a block upload whose last segments may still wait.
    leaving: bool,
}

impl Bench {
    /// Powers a node up.
    pub fn new(node_id: u8, stored: &[u8]) -> Self {
        let app = Objects::new();
        let mut bench = Self {
            node: Node::new(config(node_id), stored, &app, 0),
            app,
            now_us: 0,
            allowed: Allowed::default(),
            watches: true,
            leaving: false,
        };
        bench.learn();
        bench
    }

    /// Hands the node a frame.
    pub fn hear(&mut self, frame: &Frame) {
        let id = self.node.node_id();
        self.app.start_counting();
        self.node.handle_frame(self.now_us, frame, &mut self.app);
        self.app.check_work();
        let is_request = frame.cob_id() == Some(0x600 + u16::from(id));
        if let (true, Some(command)) = (is_request, frame.data().first()) {
            let starts = command & 0xE3 == 0xA3;
            self.allowed.segments |= starts;
            self.leaving = command >> 5 != 5;
        }
        let was_reset = matches!((frame.cob_id(), frame.data()), (Some(0), [129 | 130, _]));
        if self.watches && is_request || was_reset || frame.cob_id() == Some(0x7E5) {
            self.learn();
        }
    }

    /// Lets time pass and the node do what it demands.
    pub fn tick(&mut self, micros: u64) {
        self.now_us += micros;
        self.app.start_counting();
        self.node.tick(self.now_us, &mut self.app);
        self.app.check_work();
    }

    /// Takes the next frame.
    pub fn poll(&mut self) -> Option<Frame> {
        let frame = self.node.poll_transmit();
        if let Some(frame) = &frame {
            self.allowed.check(self.node.node_id(), frame);
        } else if self.leaving {
            self.allowed.segments = false;
        }
        frame
    }

    /// Takes every frame that waits.
    pub fn sent(&mut self) -> Vec<Frame> {
        let sent: Vec<_> = std::iter::from_fn(|| self.poll()).collect();
        assert!(sent.len() <= MOST_FRAMES, "{} frames waited", sent.len());
        sent
    }

    /// Ends what the node asked to be stored.
    pub fn finish_store(&mut self, outcome: Result<(), Abort>) {
        let mut bytes = [0; STORED_PARAMETERS];
        let length = self.node.save_parameters(&mut bytes).expect("room");
        let outcome = outcome.map(|()| &bytes[..length]);
        self.node.finish_store(self.now_us, outcome);
    }

    /// Takes every event.
    pub fn events(&mut self) -> Vec<Event> {
        std::iter::from_fn(|| self.node.poll_event()).collect()
    }

    /// Hands the node a frame and returns what it sends.
    pub fn ask(&mut self, cob_id: u16, data: &[u8]) -> Vec<Frame> {
        self.hear(&Frame::standard(cob_id, data).expect("at most eight bytes"));
        self.sent()
    }

    /// Hands the node an SDO request and returns what it answers; other frames are lost.
    pub fn sdo(&mut self, request: [u8; 8]) -> Option<[u8; 8]> {
        let id = u16::from(self.node.node_id());
        let sent = self.ask(0x600 + id, &request);
        let mut answers = sent.iter().filter(|it| it.cob_id() == Some(0x580 + id));
        let answer = answers.next()?.data().try_into().ok()?;
        assert!(answers.next().is_none(), "one answer: {sent:02X?}");
        Some(answer)
    }

    /// Reads an object of at most four bytes.
    pub fn read(&mut self, index: u16, subindex: u8) -> Option<u32> {
        let [low, high] = index.to_le_bytes();
        let [command, a, b, c, data @ ..] = self.sdo([0x40, low, high, subindex, 0, 0, 0, 0])?;
        if command == 0x80 {
            return None;
        }
        assert_eq!(([a, b, c], command & 0xF3), ([low, high, subindex], 0x43));
        Some(u32::from_le_bytes(data))
    }

    /// Checks that the time comes at which the node has nothing left to do.
    pub fn check_rest(&mut self) {
        for _ in 0..MOST_TICKS {
            self.tick(0);
            if self.sent().is_empty() {
                return;
            }
        }
        panic!("always something to do at {} µs", self.now_us);
    }

    /// Checks that the node still is what it should be, after whatever happened.
    pub fn check_alive(&mut self) {
        let factory = self.node.stored_parameters().is_empty();
        self.app.refuse = false;
        if !matches!(self.node.node_id(), 1..=127) {
            self.give_id();
        }
        self.sent();
        self.events();
        self.hear(&Frame::standard(0, &[130, 0]).expect("two bytes"));
        if !matches!(self.node.node_id(), 1..=127) {
            // LSS took its id away, from the next reset on.
            self.give_id();
            self.hear(&Frame::standard(0, &[130, 0]).expect("two bytes"));
        }
        let id = self.node.node_id();
        assert_eq!(self.node.nmt_state(), NmtState::PreOperational);
        assert!(!self.app.is_writing(), "a reset ends a transfer");
        let boot_up = Frame::standard(0x700 + u16::from(id), &[0]);
        assert_eq!(self.sent().first(), boot_up.as_ref(), "boot-up comes first");
        assert_eq!(self.read(0x1000, 0), Some(DEVICE_TYPE));
        assert_eq!(self.read(0x1018, 4), Some(IDENTITY[3]));
        assert_eq!(
            self.sdo([0x40, 0xFF, 0x3F, 7, 0, 0, 0, 0]),
            Some([0x80, 0xFF, 0x3F, 7, 0, 0, 2, 6]),
            "what does not exist is refused by name"
        );
        self.ask(0, &[1, id]);
        assert_eq!(self.node.nmt_state(), NmtState::Operational);
        if factory {
            let id = u16::from(id);
            self.ask(0x200 + id, &[1, 0, 2, 0, 3, 0, 4, 5]);
            let sent = self.ask(0x080, &[]);
            let ids: Vec<_> = sent.iter().filter_map(Frame::cob_id).collect();
            assert_eq!(ids, [0x180 + id], "SYNC brings TPDO1: {sent:02X?}");
            assert_eq!(self.app.target, [[1, 0], [2, 0], [3, 0], [4, 2], [5, 2]]);
        }
        self.check_rest();
    }

    /// Gives a node that has no id one by LSS.
    fn give_id(&mut self) {
        self.ask(0x7E5, &[0x04, 1, 0, 0, 0, 0, 0, 0]);
        let answer = self.ask(0x7E5, &[0x11, ID, 0, 0, 0, 0, 0, 0]);
        let expected = Frame::standard(0x7E4, &[0x11, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(answer.last(), expected.as_ref());
        self.hear(&Frame::standard(0x7E5, &[0x04, 0, 0, 0, 0, 0, 0, 0]).expect("eight bytes"));
        assert_eq!(self.node.node_id(), ID, "it takes its id at once");
        let boot_up = Frame::standard(0x700 + u16::from(ID), &[0]);
        assert_eq!(self.sent().first(), boot_up.as_ref());
    }

    /// Asks a copy of the node for the identifiers that it may send with.
    fn learn(&mut self) {
        let id = u16::from(self.node.node_id());
        if !matches!(id, 1..=127) {
            return;
        }
        let mut copy = self.node.clone();
        let mut ask = |index: u16, subindex| {
            while copy.poll_transmit().is_some() {}
            let [low, high] = index.to_le_bytes();
            let request = [0x40, low, high, subindex, 0, 0, 0, 0];
            let request = Frame::standard(0x600 + id, &request)?;
            copy.handle_frame(self.now_us, &request, &mut Nothing);
            let answer = copy.poll_transmit()?;
            match answer.data() {
                [0x43, _, _, _, low, high, _, _] => Some(u16::from_le_bytes([*low, *high]) & 0x7FF),
                _ => None,
            }
        };
        let objects = [
            (0x1014, 0),
            (0x1800, 1),
            (0x1801, 1),
            (0x1802, 1),
            (0x1803, 1),
        ];
        for cob_id in objects
            .into_iter()
            .filter_map(|(index, sub)| ask(index, sub))
        {
            assert!(!is_reserved(cob_id), "{cob_id:03X} belongs to others");
            if !self.allowed.cob_ids.contains(&cob_id) {
                self.allowed.cob_ids.push(cob_id);
            }
        }
    }
}

/// An application without objects, for a copy of the node that is only asked for its own.
struct Nothing;

impl Application for Nothing {
    fn entry(&self, _: u16, _: u8) -> Result<Entry, Abort> {
        Err(Abort::NoObject)
    }

    fn read(&self, _: u16, _: u8, _: &mut [u8]) -> Result<usize, Abort> {
        Err(Abort::NoObject)
    }

    fn write(&mut self, _: u16, _: u8, _: &[u8]) -> Result<(), Abort> {
        Err(Abort::NoObject)
    }

    fn rpdo_applied(&mut self, _: u8, _: u16) {}
}
