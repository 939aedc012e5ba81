//! A node in a state of choice, and the ticks that a frame costs it.

use core::hint::black_box;

use eel_canopen::{Config, Event, Frame, Mapped, Node, PdoDefault, STORED_PARAMETERS};

use crate::stopwatch::Stopwatch;
use crate::values::{Values, config};

/// The node's id.
pub const ID: u8 = 5;
/// The identifier of requests to it.
pub const REQUEST: u16 = 0x600 + ID as u16;
/// The identifier of its answers.
const ANSWER: u16 = 0x580 + ID as u16;

/// Eight objects of one byte each: the dearest mapping that there is.
const IN_BYTES: &[Mapped] = &[Mapped::new(0x2000, 4, 8); 8];
const OUT_BYTES: &[Mapped] = &[Mapped::new(0x2010, 4, 8); 8];

const fn pdo(cob_id_base: u16, transmission: u8, mapping: &'static [Mapped]) -> PdoDefault {
    PdoDefault {
        cob_id_base,
        transmission,
        enabled: true,
        mapping,
    }
}

const RPDOS: &[PdoDefault] = &[
    pdo(0x200, 1, IN_BYTES),
    pdo(0x300, 1, IN_BYTES),
    pdo(0x400, 1, IN_BYTES),
    pdo(0x500, 1, IN_BYTES),
];
const TPDOS: &[PdoDefault] = &[
    pdo(0x180, 1, OUT_BYTES),
    pdo(0x280, 1, OUT_BYTES),
    pdo(0x380, 1, OUT_BYTES),
    pdo(0x480, 1, OUT_BYTES),
];

/// Returns a vertebra's configuration with the dearest mappings that anybody on the bus can give its two
/// RPDOs and two TPDOs.
pub fn heavy() -> Config {
    config(
        ID,
        RPDOS.get(..2).unwrap_or_default(),
        TPDOS.get(..2).unwrap_or_default(),
        0,
    )
}

/// Returns a configuration with as many PDOs as a node can have, mapped likewise.
pub fn heaviest() -> Config {
    config(ID, RPDOS, TPDOS, 0)
}

/// A node, its application and the time.
pub struct Bench<'a> {
    stopwatch: &'a Stopwatch,
    pub node: Node,
    pub app: Values,
    pub now_us: u64,
}

impl<'a> Bench<'a> {
    /// Powers a node up and takes its boot-up message.
    pub fn new(stopwatch: &'a Stopwatch, config: Config) -> Self {
        let app = Values::new();
        let node = Node::new(config, &[], &app, 0);
        let mut bench = Self {
            stopwatch,
            node,
            app,
            now_us: 0,
        };
        bench.drain();
        bench
    }

    /// Powers a node up and starts it.
    pub fn operational(stopwatch: &'a Stopwatch, config: Config) -> Self {
        let mut bench = Self::new(stopwatch, config);
        bench.hear(0, &[1, ID]);
        bench.drain();
        bench
    }

    /// Hands the node a frame and returns the ticks that it takes.
    pub fn cost(&mut self, cob_id: u16, data: &[u8]) -> u32 {
        let Some(frame) = Frame::standard(cob_id, data) else {
            return 0;
        };
        let frame = black_box(&frame);
        self.time(|node, app, now_us| node.handle_frame(now_us, frame, app))
    }

    /// Hands the node a frame.
    pub fn hear(&mut self, cob_id: u16, data: &[u8]) {
        self.cost(cob_id, data);
    }

    /// Lets time pass and returns the ticks that the node takes.
    pub fn tick(&mut self, micros: u64) -> u32 {
        self.now_us += micros;
        self.time(|node, app, now_us| node.tick(now_us, app))
    }

    /// Returns the ticks that a call of the node takes.
    pub fn time(&mut self, call: impl FnOnce(&mut Node, &mut Values, u64)) -> u32 {
        let Self {
            stopwatch,
            node,
            app,
            now_us,
        } = self;
        let now_us = black_box(*now_us);
        let ((), ticks) = stopwatch.time(|| call(node, app, now_us));
        black_box(&node);
        ticks
    }

    /// Takes everything that waits.
    pub fn drain(&mut self) {
        while self.node.poll_transmit().is_some() {}
        while self.node.poll_event().is_some() {}
    }

    /// Takes everything that waits and tells whether the SDO server's last answer begins with this.
    pub fn is_answered(&mut self, command: u8) -> bool {
        let mut last = None;
        while let Some(frame) = self.node.poll_transmit() {
            if frame.cob_id() == Some(ANSWER) {
                last = frame.data().first().copied();
            }
        }
        last == Some(command)
    }

    /// Stores what is asked to be stored.
    pub fn store(&mut self) {
        while let Some(event) = self.node.poll_event() {
            if let Event::Store(_) = event {
                let mut bytes = [0; STORED_PARAMETERS];
                let length = self.node.save_parameters(&mut bytes).unwrap_or_default();
                let saved = bytes.get(..length).unwrap_or_default();
                self.node.finish_store(self.now_us, Ok(saved));
            }
        }
    }

    /// Fills the queues of frames and events as far as the next frame can still make use of: what
    /// comes then looks through all of them.
    pub fn clutter(&mut self) {
        for code in 0..12 {
            self.node.emergency(self.now_us, code, 1, [1; 5]);
        }
        for _ in 0..16 {
            self.hear(0x77F, &[5]);
            self.hear(0x77F, &[4]);
        }
    }

    /// Lets time pass until the watched node and the SDO client have been silent for too long.
    pub fn neglect(&mut self) {
        self.now_us += 2_000_000;
    }
}
