//! A vertebra as the simulator knows it: something that takes turns.

use eel_protocol::{Frame, NodeId, State};
use eel_units::Instant;
use eel_vertebra::store::{self, RamFlash, Store};
use eel_vertebra::{Calibration, Drive, Event, Keepsake, Sample, Settings, Vertebra, turn};

/// Everything that went into a turn and came out of it.
#[derive(Clone, Copy, Debug)]
pub struct Turn<'a> {
    /// The node's clock.
    pub now: Instant,
    /// What it received since its last turn.
    pub frames: &'a [Frame],
    /// What it measured.
    pub sample: &'a Sample,
    /// How many frames its platform took at most.
    pub room: usize,
    /// What it sent.
    pub sent: &'a [Frame],
    /// What its bridges do.
    pub drives: [Drive; 3],
}

/// Why a microcontroller starts anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// Its power or the reset pin: nothing but the flash is remembered.
    Power,
    /// A watchdog, a panic or a fault of the CPU: its memory is what it was.
    Failure,
}

/// Something that is a vertebra: natively, in an emulator, or on a board.
pub trait Node {
    /// Takes one turn of the control tick and appends what is to be sent, at most `room` frames.
    fn turn(
        &mut self,
        now: Instant,
        frames: &[Frame],
        sample: &Sample,
        room: usize,
        sent: &mut Vec<Frame>,
    ) -> [Drive; 3];

    /// Returns by how much its next tick shall be longer than a millisecond, ns.
    fn tick_trim_ns(&self) -> i32 {
        self.vertebra().map_or(0, Vertebra::tick_trim_ns)
    }

    /// Returns the level of the daisy line's OUT.
    fn chain_out(&self) -> bool {
        self.vertebra().is_some_and(Vertebra::chain_out)
    }

    /// Starts anew.
    fn reset(&mut self, now: Instant, cause: Reset);

    /// Returns the vertebra itself where it lives in this process.
    fn vertebra(&self) -> Option<&Vertebra>;

    /// Returns the next thing that happened, where the node tells.
    fn poll_event(&mut self) -> Option<Event>;

    /// Returns why the node could not go on, once; it has been silent and free since.
    fn take_failure(&mut self) -> Option<anyhow::Error> {
        None
    }

    /// Returns the state, where the node tells.
    fn state(&self) -> Option<State> {
        self.vertebra().map(Vertebra::state)
    }
}

/// A vertebra in this process. Its flash lasts as long as it does, over every reset.
#[derive(Debug)]
pub struct NativeNode {
    settings: Settings,
    store: Store<RamFlash>,
    kept: Keepsake,
    vertebra: Vertebra,
}

impl NativeNode {
    /// Powers a prototype up.
    pub fn new(id: NodeId) -> Self {
        Self::with_settings(prototype(id))
    }

    /// Powers a prototype up that has no node id, at the place `id` in the chain.
    pub fn unconfigured(id: NodeId) -> Self {
        Self::with_settings(Settings {
            node: None,
            ..prototype(id)
        })
    }

    /// Powers a vertebra with these settings and an empty flash up.
    pub fn with_settings(settings: Settings) -> Self {
        Self {
            settings,
            store: Store::new(RamFlash::new()),
            kept: Keepsake::EMPTY,
            vertebra: Vertebra::new(settings, Instant::ZERO),
        }
    }
}

impl NativeNode {
    /// Returns the same vertebra as it is before its first calibration, with an empty flash.
    pub fn uncalibrated(&self) -> Self {
        Self::with_settings(Settings {
            calibration: Calibration::NONE,
            ..self.settings
        })
    }
}

/// Returns the settings of the simulated vertebra; its serial number tells its place.
pub fn prototype(id: NodeId) -> Settings {
    Settings::prototype(id, 0x5EE1_0000 + u32::from(id.get()))
}

impl Node for NativeNode {
    fn turn(
        &mut self,
        now: Instant,
        frames: &[Frame],
        sample: &Sample,
        room: usize,
        sent: &mut Vec<Frame>,
    ) -> [Drive; 3] {
        let frames = frames.iter().copied();
        let drives = turn(&mut self.vertebra, now, frames, sample, room, |frame| {
            sent.push(frame);
        });
        store::serve(&mut self.vertebra, &mut self.store, now);
        self.kept = self.vertebra.poll_keepsake().unwrap_or(self.kept);
        drives
    }

    fn reset(&mut self, now: Instant, cause: Reset) {
        self.vertebra = Vertebra::with_stored(self.settings, &self.store.load(), now);
        if cause == Reset::Failure {
            self.vertebra.stop_after_failure(&self.kept);
        }
    }

    fn vertebra(&self) -> Option<&Vertebra> {
        Some(&self.vertebra)
    }

    fn poll_event(&mut self) -> Option<Event> {
        self.vertebra.poll_event()
    }
}
