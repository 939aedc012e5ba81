//! Between a CAN controller and the program: the queues that interrupts fill and empty.

use std::collections::VecDeque;

use eel_protocol::{Cob, Frame};
use eel_units::Duration;

use crate::bus::{Bus, ControllerConfig, ControllerId};

/// Frames that wait for a program.
const DEPTH: usize = 32;
/// Frames of a vertebra that wait for the controller, as on its board.
pub const SENDING: usize = 8;

/// One program's end of the bus.
#[derive(Debug)]
pub struct Link {
    controller: ControllerId,
    received: Vec<Frame>,
    /// When the newest SYNC arrived that nobody has asked for.
    sync_ns: Option<u64>,
    waiting: VecDeque<Frame>,
    overruns: u64,
    dropped: u64,
}

impl Link {
    /// Attaches a controller to the bus.
    ///
    /// # Errors
    /// Where the bus or the hardware has no room.
    pub fn attach(bus: &mut Bus, config: ControllerConfig) -> anyhow::Result<Self> {
        let controller = bus
            .attach(config)
            .map_err(|error| anyhow::anyhow!("controller not attached: {error:?}"))?;
        Ok(Self {
            controller,
            received: Vec::with_capacity(DEPTH),
            sync_ns: None,
            waiting: VecDeque::with_capacity(DEPTH),
            overruns: 0,
            dropped: 0,
        })
    }

    /// Serves the controller: takes what came, and loads what waits into free buffers.
    pub fn serve(&mut self, bus: &mut Bus, now_ns: u64) {
        if bus.has_received(self.controller) {
            while let Some((_, frame)) = bus.receive(self.controller) {
                if frame.cob_id() == Some(Cob::Sync.id()) {
                    self.sync_ns = Some(now_ns);
                }
                if self.received.len() < DEPTH {
                    self.received.push(frame);
                } else {
                    self.overruns += 1;
                }
            }
        }
        while let Some(frame) = self.waiting.front() {
            if bus.enqueue(now_ns, self.controller, *frame).is_err() {
                break;
            }
            self.waiting.pop_front();
        }
    }

    /// Sends a frame: at once where a buffer is free and nothing waits, later otherwise.
    pub fn send(&mut self, bus: &mut Bus, now_ns: u64, frame: Frame) {
        if self.waiting.len() >= DEPTH {
            self.dropped += 1;
            return;
        }
        self.waiting.push_back(frame);
        self.serve(bus, now_ns);
    }

    /// Returns how many frames find room to wait.
    pub fn room(&self) -> usize {
        SENDING.saturating_sub(self.waiting.len())
    }

    /// Returns how long ago the newest SYNC arrived, where one has since the last call.
    pub fn sync_age(&mut self, now_ns: u64) -> Option<Duration> {
        let age_ns = now_ns.saturating_sub(self.sync_ns.take()?);
        Some(Duration::from_micros((age_ns / 1_000) as u32))
    }

    /// Takes what was received since the last call.
    pub fn received(&mut self) -> Vec<Frame> {
        std::mem::take(&mut self.received)
    }

    /// Switches the controller; off, everything that waits is gone.
    pub fn power(&mut self, bus: &mut Bus, now_ns: u64, on: bool) {
        bus.set_powered(now_ns, self.controller, on);
        self.received.clear();
        self.sync_ns = None;
        self.waiting.clear();
    }

    /// Returns how many frames were lost here.
    pub fn lost(&self, bus: &Bus) -> u64 {
        let hardware = bus
            .controller(self.controller)
            .map_or(0, |counters| counters.overruns.iter().sum());
        hardware + self.overruns + self.dropped
    }
}
