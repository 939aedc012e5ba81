//! A node whose application keeps values and domains and watches over its own interface: whatever a
//! test does, a domain is read and written in order, without gaps, and ended exactly once.
#![allow(dead_code, reason = "every test file uses a part")]

pub mod blocks;

use eel_canopen::{
    Abort, Access, Application, Config, Entry, Frame, Identity, Mapped, Node, PdoDefault,
};

/// An object of any length up to the server's buffer.
pub const VALUE: u16 = 0x2020;
/// An object of two bytes.
pub const WORD: u16 = 0x2021;
/// Domains: subindex 1 can be read and written, 2 only read, 3 only written.
pub const DOMAIN: u16 = 0x2030;

pub const TOGGLE: u32 = 0x0503_0000;
pub const TIMEOUT: u32 = 0x0504_0000;
pub const COMMAND: u32 = 0x0504_0001;
pub const BLOCK_SIZE: u32 = 0x0504_0002;
pub const SEQUENCE: u32 = 0x0504_0003;
pub const CRC: u32 = 0x0504_0004;
pub const OUT_OF_MEMORY: u32 = 0x0504_0005;
pub const WRITE_ONLY: u32 = 0x0601_0001;
pub const READ_ONLY: u32 = 0x0601_0002;
pub const NO_OBJECT: u32 = 0x0602_0000;
pub const NOT_MAPPABLE: u32 = 0x0604_0041;
pub const TOO_LONG: u32 = 0x0607_0012;
pub const TOO_SHORT: u32 = 0x0607_0013;
pub const GENERAL: u32 = 0x0800_0000;
pub const DEVICE_STATE: u32 = 0x0800_0022;

pub const CONFIG: Config = Config {
    node_id: 5,
    node_ids: (1, 127),
    identity: Identity {
        vendor: 1,
        product: 2,
        revision: 3,
        serial: 4,
    },
    device_type: 0,
    device_name: "streams",
    hardware_version: "",
    software_version: "",
    heartbeat_ms: 0,
    consumer: None,
    sync_cob_id: 0x080,
    sync_counter_overflow: 0,
    time_cob_id: 0x100,
    error_behaviour: 1,
    rpdos: &[PdoDefault {
        cob_id_base: 0x200,
        transmission: 255,
        enabled: false,
        mapping: &[],
    }],
    tpdos: &[
        PdoDefault {
            cob_id_base: 0x180,
            transmission: 1,
            enabled: true,
            mapping: &[Mapped::new(WORD, 0, 16)],
        },
        PdoDefault {
            cob_id_base: 0x280,
            transmission: 1,
            enabled: false,
            mapping: &[],
        },
    ],
};

/// What happened to a domain that is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Call {
    Begin(u16, u8, Option<u32>),
    End(u16, u8, Option<u32>),
}

/// The application.
#[derive(Debug, Default)]
pub struct Streams {
    pub value: Vec<u8>,
    pub values_written: u32,
    pub word: u16,
    /// What a domain holds; a complete download replaces it.
    pub domain: Vec<u8>,
    pub calls: Vec<Call>,
    /// How many bytes have been read since the domain was opened.
    pub read: usize,
    writing: Option<(u16, u8, Vec<u8>)>,
    reading: Option<(u16, u8)>,
    pub refuse_open: Option<Abort>,
    pub refuse_begin: Option<Abort>,
    pub refuse_end: Option<Abort>,
    /// From which byte on reading or writing fails.
    pub fail_at: Option<u32>,
    /// From which byte on the domain has less than it said.
    pub cut_at: Option<u32>,
}

impl Streams {
    /// Tells whether a domain was begun and not ended.
    pub fn is_writing(&self) -> bool {
        self.writing.is_some()
    }

    pub fn calls(&mut self) -> Vec<Call> {
        std::mem::take(&mut self.calls)
    }
}

impl Application for Streams {
    fn entry(&self, index: u16, subindex: u8) -> Result<Entry, Abort> {
        let (length, domain, access) = match (index, subindex) {
            (VALUE, 0) => (0, false, Access::ReadWrite),
            (WORD, 0) => (2, false, Access::ReadWrite),
            (DOMAIN, 1) => (0, true, Access::ReadWrite),
            (DOMAIN, 2) => (0, true, Access::ReadOnly),
            (DOMAIN, 3) => (0, true, Access::WriteOnly),
            (0x1021, 0) => (0, true, Access::Constant),
            (0x1022, 0) => (1, false, Access::Constant),
            (0x1F50 | 0x1F5F, 1) => (0, true, Access::ReadWrite),
            (0x1F51, 1) => (2, false, Access::ReadWrite),
            (VALUE | WORD | DOMAIN, _) => return Err(Abort::NoSubindex),
            _ => return Err(Abort::NoObject),
        };
        Ok(Entry {
            length,
            domain,
            access,
            tpdo: true,
            rpdo: true,
        })
    }

    fn read(&self, index: u16, _: u8, out: &mut [u8]) -> Result<usize, Abort> {
        let value: &[u8] = match index {
            VALUE => &self.value,
            WORD | 0x1F51 => &self.word.to_le_bytes(),
            0x1022 => &[0],
            _ => return Err(Abort::NoObject),
        };
        out.get_mut(..value.len())
            .ok_or(Abort::OutOfMemory)?
            .copy_from_slice(value);
        Ok(value.len())
    }

    fn write(&mut self, index: u16, _: u8, data: &[u8]) -> Result<(), Abort> {
        match index {
            VALUE => self.value = data.to_vec(),
            WORD | 0x1F51 => self.word = u16::from_le_bytes(data.try_into().unwrap()),
            _ => return Err(Abort::NoObject),
        }
        self.values_written += 1;
        Ok(())
    }

    fn rpdo_applied(&mut self, _: u8, _: u16) {}

    fn open_domain(&mut self, index: u16, subindex: u8) -> Result<u32, Abort> {
        assert!(self.writing.is_none(), "read while it is written");
        if let Some(abort) = self.refuse_open {
            return Err(abort);
        }
        self.reading = Some((index, subindex));
        self.read = 0;
        Ok(self.domain.len() as u32)
    }

    fn read_domain(
        &mut self,
        index: u16,
        subindex: u8,
        offset: u32,
        out: &mut [u8],
    ) -> Result<usize, Abort> {
        assert_eq!(self.reading, Some((index, subindex)));
        assert_eq!(offset as usize, self.read, "in order and once");
        assert!(!out.is_empty() && out.len() <= 889);
        if self.fail_at.is_some_and(|at| offset >= at) {
            return Err(Abort::Hardware);
        }
        if self.cut_at.is_some_and(|at| offset >= at) {
            return Ok(out.len() - 1);
        }
        let rest = &self.domain[self.read..];
        let length = rest.len().min(out.len());
        out[..length].copy_from_slice(&rest[..length]);
        self.read += length;
        Ok(length)
    }

    fn begin_domain(&mut self, index: u16, subindex: u8, length: Option<u32>) -> Result<(), Abort> {
        assert!(self.writing.is_none(), "begun twice");
        if let Some(abort) = self.refuse_begin {
            return Err(abort);
        }
        self.writing = Some((index, subindex, Vec::new()));
        self.calls.push(Call::Begin(index, subindex, length));
        Ok(())
    }

    fn write_domain(
        &mut self,
        index: u16,
        subindex: u8,
        offset: u32,
        data: &[u8],
    ) -> Result<(), Abort> {
        let (at, sub, bytes) = self.writing.as_mut().expect("a domain that was begun");
        assert_eq!((*at, *sub), (index, subindex));
        assert_eq!(offset as usize, bytes.len(), "in order and without gaps");
        assert!(!data.is_empty() && data.len() <= 7);
        if self.fail_at.is_some_and(|at| offset >= at) {
            return Err(Abort::Hardware);
        }
        bytes.extend(data);
        Ok(())
    }

    fn end_domain(&mut self, index: u16, subindex: u8, length: Option<u32>) -> Result<(), Abort> {
        let (at, sub, bytes) = self.writing.take().expect("ended once");
        assert_eq!((at, sub), (index, subindex));
        self.calls.push(Call::End(index, subindex, length));
        if let Some(length) = length {
            assert_eq!(length as usize, bytes.len());
            if let Some(abort) = self.refuse_end {
                return Err(abort);
            }
            self.domain = bytes;
        }
        Ok(())
    }
}

/// A node, its application and the time.
pub struct Line {
    pub node: Node,
    pub app: Streams,
    pub now_us: u64,
}

impl Line {
    /// A Pre-operational node with empty queues.
    pub fn new() -> Self {
        let app = Streams::default();
        let mut node = Node::new(CONFIG, &[], &app, 0);
        while node.poll_transmit().is_some() {}
        Self {
            node,
            app,
            now_us: 0,
        }
    }

    /// Hands a frame to the node.
    pub fn hear(&mut self, cob_id: u16, data: &[u8]) {
        let frame = Frame::standard(cob_id, data).unwrap();
        self.node.handle_frame(self.now_us, &frame, &mut self.app);
    }

    /// Polls every frame.
    pub fn frames(&mut self) -> Vec<(u16, Vec<u8>)> {
        std::iter::from_fn(|| self.node.poll_transmit())
            .map(|frame| (frame.cob_id().unwrap(), frame.data().to_vec()))
            .collect()
    }

    /// Polls every frame; all are the SDO server's.
    pub fn messages(&mut self) -> Vec<[u8; 8]> {
        self.frames()
            .into_iter()
            .map(|(cob_id, data)| {
                assert_eq!(cob_id, 0x585);
                data.try_into().unwrap()
            })
            .collect()
    }

    /// Hands a request to the node and returns what it says at once.
    pub fn ask(&mut self, request: [u8; 8]) -> Vec<[u8; 8]> {
        self.hear(0x605, &request);
        self.messages()
    }

    /// Hands a request to the node that it says nothing to.
    pub fn tell(&mut self, request: [u8; 8]) {
        assert_eq!(self.ask(request), [[0; 8]; 0], "{request:02X?}");
    }

    /// Hands a request to the node and returns its only answer.
    pub fn sdo(&mut self, request: [u8; 8]) -> [u8; 8] {
        let answers = self.ask(request);
        let [answer] = answers.as_slice() else {
            panic!("{request:02X?}: {answers:02X?}")
        };
        *answer
    }

    /// Lets time pass in steps of a millisecond and returns what the SDO server says meanwhile.
    pub fn pass_ms(&mut self, milliseconds: u64) -> Vec<[u8; 8]> {
        let mut messages = Vec::new();
        for _ in 0..milliseconds {
            self.now_us += 1_000;
            self.node.tick(self.now_us, &mut self.app);
            messages.extend(self.messages());
        }
        messages
    }

    /// Lets the node send until it waits for the client.
    pub fn stream(&mut self) -> Vec<[u8; 8]> {
        let mut messages = self.messages();
        loop {
            self.now_us += 1_000;
            self.node.tick(self.now_us, &mut self.app);
            let more = self.messages();
            assert!(more.len() <= 8, "bounded work");
            if more.is_empty() {
                return messages;
            }
            messages.extend(more);
        }
    }
}

/// The message that starts something about an object, with the four bytes of `data`.
pub fn about(command: u8, index: u16, subindex: u8, data: u32) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    let [a, b, c, d] = data.to_le_bytes();
    [command, low, high, subindex, a, b, c, d]
}

/// The message of an abort.
pub fn abort(index: u16, subindex: u8, code: u32) -> [u8; 8] {
    about(0x80, index, subindex, code)
}

/// Bytes that differ from place to place and from length to length.
pub fn pattern(length: usize) -> Vec<u8> {
    (0..length)
        .map(|at| (at * 7 + at / 256 + length) as u8)
        .collect()
}

/// CRC-16/XMODEM, one bit after the other.
pub fn crc(bytes: &[u8]) -> u16 {
    let mut register = 0u32;
    for byte in bytes {
        register ^= u32::from(*byte) << 8;
        for _ in 0..8 {
            register <<= 1;
            if register & 0x1_0000 != 0 {
                register ^= 0x1_1021;
            }
        }
    }
    register as u16
}

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    pub fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound
    }

    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len() as u64) as usize]
    }
}
