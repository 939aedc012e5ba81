//! A node with a small application, and the words to talk to it.
#![allow(dead_code, reason = "every test file uses a part")]

use eel_canopen::{
    Abort, Access, Application, Config, Entry, Event, Frame, Identity, Mapped, Node, PdoDefault,
};

/// The node id of the node under test.
pub const ID: u8 = 5;
/// The node that it watches.
pub const MASTER: u8 = 127;

const TARGET: &[Mapped] = &[
    Mapped::new(0x2000, 1, 16),
    Mapped::new(0x2000, 2, 16),
    Mapped::new(0x2000, 3, 16),
    Mapped::new(0x2000, 4, 8),
    Mapped::new(0x2000, 5, 8),
];
const MOMENT: &[Mapped] = &[Mapped::new(0x2001, 1, 16), Mapped::new(0x2001, 2, 16)];
const POSE: &[Mapped] = &[
    Mapped::new(0x2010, 1, 16),
    Mapped::new(0x2010, 2, 32),
    Mapped::new(0x1001, 0, 8),
];
const EFFORT: &[Mapped] = &[Mapped::new(0x2010, 1, 16)];

/// Two RPDOs (SYNC, event) and three TPDOs (every SYNC, every second, event).
pub const CONFIG: Config = Config {
    node_id: ID,
    node_ids: (1, 127),
    identity: Identity {
        vendor: 0x1234_5678,
        product: 0x0000_0EE1,
        revision: 0x0001_0002,
        serial: 0xCAFE_F00D,
    },
    device_type: 0x0002_0192,
    device_name: "Anguilla vertebra",
    hardware_version: "A1",
    software_version: "0.1.0",
    heartbeat_ms: 200,
    consumer: Some((MASTER, 300)),
    sync_cob_id: 0x080,
    sync_counter_overflow: 0,
    time_cob_id: 0x100,
    error_behaviour: 1,
    rpdos: &[
        PdoDefault {
            cob_id_base: 0x200,
            transmission: 1,
            enabled: true,
            mapping: TARGET,
        },
        PdoDefault {
            cob_id_base: 0x300,
            transmission: 255,
            enabled: true,
            mapping: MOMENT,
        },
        PdoDefault {
            cob_id_base: 0x400,
            transmission: 1,
            enabled: false,
            mapping: &[],
        },
    ],
    tpdos: &[
        PdoDefault {
            cob_id_base: 0x180,
            transmission: 1,
            enabled: true,
            mapping: POSE,
        },
        PdoDefault {
            cob_id_base: 0x280,
            transmission: 2,
            enabled: true,
            mapping: EFFORT,
        },
        PdoDefault {
            cob_id_base: 0x380,
            transmission: 254,
            enabled: true,
            mapping: EFFORT,
        },
    ],
};

/// What the application was told, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Call {
    Write(u16, u8, Vec<u8>),
    Applied(u8, u16),
    Synchronised(Option<u8>),
    Due(u8, u16),
}

/// An application that stores what it is given.
#[derive(Debug)]
pub struct Store {
    pub calls: Vec<Call>,
    pub target: [i16; 3],
    pub mode: [u8; 2],
    pub moment: [i16; 2],
    pub pose: i16,
    pub status: u32,
    pub text: Vec<u8>,
    /// 0x2023: a domain.
    pub domain: Vec<u8>,
    /// How much of a domain has come, while one comes.
    pub coming: Option<u32>,
    pub refuse: bool,
    pub refuse_configuration: bool,
}

impl Store {
    pub fn new() -> Self {
        Self {
            calls: Vec::new(),
            target: [0; 3],
            mode: [0; 2],
            moment: [0; 2],
            pose: 0x1122,
            status: 0x3344_5566,
            text: Vec::new(),
            domain: (0..2_000_u32).map(|at| at as u8).collect(),
            coming: None,
            refuse: false,
            refuse_configuration: false,
        }
    }
}

impl Application for Store {
    fn entry(&self, index: u16, subindex: u8) -> Result<Entry, Abort> {
        let (length, access, tpdo, rpdo) = match (index, subindex) {
            (0x2000 | 0x2001 | 0x2010, 0) => (1, Access::Constant, false, false),
            (0x2000, 1..=3) | (0x2001, 1..=2) => (2, Access::ReadWrite, false, true),
            (0x2000, 4..=5) => (1, Access::ReadWrite, false, true),
            (0x2010, 1) => (2, Access::ReadOnly, true, false),
            (0x2010, 2) => (4, Access::ReadOnly, true, false),
            (0x2020, 0) => (0, Access::ReadWrite, false, false),
            (0x2021, 0) => (4, Access::WriteOnly, false, false),
            (0x2022, 0) => (8, Access::ReadWrite, true, true),
            (0x2023, 0) => (0, Access::ReadWrite, false, false),
            (0x2000 | 0x2001 | 0x2010 | 0x2020..=0x2023, _) => {
                return Err(Abort::NoSubindex);
            }
            _ => return Err(Abort::NoObject),
        };
        Ok(Entry {
            length,
            domain: index == 0x2023,
            access,
            tpdo,
            rpdo,
        })
    }

    fn read(&self, index: u16, subindex: u8, out: &mut [u8]) -> Result<usize, Abort> {
        if self.refuse {
            return Err(Abort::DeviceState);
        }
        let value: Vec<u8> = match (index, subindex) {
            (0x2000, at @ 1..=3) => self.target[usize::from(at) - 1].to_le_bytes().to_vec(),
            (0x2001, at @ 1..=2) => self.moment[usize::from(at) - 1].to_le_bytes().to_vec(),
            (0x2000, at @ 4..=5) => vec![self.mode[usize::from(at) - 4]],
            (0x2010, 1) => self.pose.to_le_bytes().to_vec(),
            (0x2010, 2) => self.status.to_le_bytes().to_vec(),
            (0x2020, 0) => self.text.clone(),
            (0x2022, 0) => vec![1, 2, 3, 4, 5, 6, 7, 8],
            (0x2000 | 0x2001 | 0x2010, 0) => vec![5],
            _ => return Err(Abort::NoObject),
        };
        out.get_mut(..value.len())
            .ok_or(Abort::OutOfMemory)?
            .copy_from_slice(&value);
        Ok(value.len())
    }

    fn write(&mut self, index: u16, subindex: u8, data: &[u8]) -> Result<(), Abort> {
        if self.refuse {
            return Err(Abort::Value);
        }
        let word = || {
            data.try_into()
                .map(i16::from_le_bytes)
                .map_err(|_| Abort::Length)
        };
        match (index, subindex) {
            (0x2000, at @ 1..=3) => self.target[usize::from(at) - 1] = word()?,
            (0x2001, at @ 1..=2) => self.moment[usize::from(at) - 1] = word()?,
            (0x2000, at @ 4..=5) => self.mode[usize::from(at) - 4] = data[0],
            (0x2020, 0) => self.text = data.to_vec(),
            (0x2021 | 0x2022, 0) => {}
            _ => return Err(Abort::NoObject),
        }
        self.calls.push(Call::Write(index, subindex, data.to_vec()));
        Ok(())
    }

    fn open_domain(&mut self, _: u16, _: u8) -> Result<u32, Abort> {
        Ok(self.domain.len() as u32)
    }

    fn read_domain(&mut self, _: u16, _: u8, offset: u32, out: &mut [u8]) -> Result<usize, Abort> {
        let rest = self.domain.get(offset as usize..).ok_or(Abort::NoData)?;
        let length = rest.len().min(out.len());
        out[..length].copy_from_slice(&rest[..length]);
        Ok(length)
    }

    fn begin_domain(&mut self, _: u16, _: u8, _: Option<u32>) -> Result<(), Abort> {
        assert_eq!(self.coming.replace(0), None, "the one before was ended");
        Ok(())
    }

    fn write_domain(&mut self, _: u16, _: u8, offset: u32, data: &[u8]) -> Result<(), Abort> {
        assert_eq!(self.coming, Some(offset), "in order and without gaps");
        self.coming = Some(offset + data.len() as u32);
        if self.refuse {
            return Err(Abort::Hardware);
        }
        Ok(())
    }

    fn end_domain(&mut self, _: u16, _: u8, length: Option<u32>) -> Result<(), Abort> {
        let came = self.coming.take();
        assert!(came.is_some() && (length.is_none() || length == came));
        Ok(())
    }

    fn may_configure(&self) -> Result<(), Abort> {
        if self.refuse_configuration {
            Err(Abort::DeviceState)
        } else {
            Ok(())
        }
    }

    fn rpdo_applied(&mut self, number: u8, cob_id: u16) {
        self.calls.push(Call::Applied(number, cob_id));
    }

    fn tpdo_due(&mut self, number: u8, cob_id: u16, _: &[Mapped]) -> Option<[u8; 8]> {
        self.calls.push(Call::Due(number, cob_id));
        None
    }

    fn synchronised(&mut self, counter: Option<u8>) {
        self.calls.push(Call::Synchronised(counter));
    }
}

/// A node, its application and the time.
pub struct Bench {
    pub node: Node,
    pub app: Store,
    pub now_us: u64,
}

/// A frame as `(identifier, data)`.
pub type Sent = (u16, Vec<u8>);

impl Bench {
    /// A node as it is after power-on, its boot-up message not yet polled.
    pub fn with(config: Config) -> Self {
        Self::stored(config, &[])
    }

    /// A node as it is after power-on, with stored parameters.
    pub fn stored(config: Config, stored: &[u8]) -> Self {
        let app = Store::new();
        Self {
            node: Node::new(config, stored, &app, 0),
            app,
            now_us: 0,
        }
    }

    /// A Pre-operational node whose boot-up message is gone.
    pub fn pre_operational() -> Self {
        let mut bench = Self::with(CONFIG);
        bench.sent();
        bench
    }

    /// An Operational node with empty queues.
    pub fn operational() -> Self {
        let mut bench = Self::pre_operational();
        bench.hear(0, &[1, ID]);
        bench.events();
        bench
    }

    /// Hands a frame to the node.
    pub fn hear(&mut self, cob_id: u16, data: &[u8]) {
        let frame = Frame::standard(cob_id, data).unwrap();
        self.node.handle_frame(self.now_us, &frame, &mut self.app);
    }

    /// Hands a frame to the node and returns what it sends.
    pub fn ask(&mut self, cob_id: u16, data: &[u8]) -> Vec<Sent> {
        self.hear(cob_id, data);
        self.sent()
    }

    /// Hands an SDO request to the node and returns its only answer; other frames are lost.
    pub fn sdo(&mut self, request: [u8; 8]) -> [u8; 8] {
        let mut sent = self.ask(0x600 + u16::from(ID), &request);
        sent.retain(|(cob_id, _)| *cob_id == 0x585);
        let [(0x585, answer)] = sent.as_slice() else {
            panic!("{request:02X?}: {sent:02X?}")
        };
        answer.as_slice().try_into().unwrap()
    }

    /// Reads an object of up to four bytes.
    pub fn read(&mut self, index: u16, subindex: u8) -> Result<u32, u32> {
        let [low, high] = index.to_le_bytes();
        let [command, _, _, _, data @ ..] = self.sdo([0x40, low, high, subindex, 0, 0, 0, 0]);
        let value = u32::from_le_bytes(data);
        match command {
            0x80 => Err(value),
            0x43 | 0x47 | 0x4B | 0x4F => Ok(value),
            _ => panic!("command {command:02X}"),
        }
    }

    /// Writes an object of `length` bytes.
    pub fn write(&mut self, index: u16, subindex: u8, value: u32, length: u8) -> Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let command = 0x23 | (4 - length) << 2;
        let [command, _, _, _, data @ ..] = self.sdo([command, low, high, subindex, a, b, c, d]);
        match command {
            0x80 => Err(u32::from_le_bytes(data)),
            0x60 => Ok(()),
            _ => panic!("command {command:02X}"),
        }
    }

    /// Lets time pass in steps of a millisecond.
    pub fn pass_ms(&mut self, milliseconds: u64) {
        for _ in 0..milliseconds {
            self.now_us += 1_000;
            self.node.tick(self.now_us, &mut self.app);
        }
    }

    /// Polls every frame.
    pub fn sent(&mut self) -> Vec<Sent> {
        std::iter::from_fn(|| self.node.poll_transmit())
            .map(|frame| (frame.cob_id().unwrap(), frame.data().to_vec()))
            .collect()
    }

    /// Polls every event.
    pub fn events(&mut self) -> Vec<Event> {
        std::iter::from_fn(|| self.node.poll_event()).collect()
    }

    /// Takes the calls that the application got.
    pub fn calls(&mut self) -> Vec<Call> {
        std::mem::take(&mut self.app.calls)
    }
}
