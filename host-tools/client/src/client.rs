//! The client and what it hears meanwhile.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use eel_canopen::NmtState;
use eel_protocol::emergency::EmergencyReport;
use eel_protocol::{Cob, Frame};
use eel_transport::{Bus, BusError, Received};

use crate::error::ClientError;

/// Emergencies that are remembered; the oldest is forgotten first.
const EMERGENCIES: usize = 256;
/// How long a full transmit queue is tried again.
const FULL: Duration = Duration::from_secs(2);
/// Pause between two tries.
const FULL_PAUSE: Duration = Duration::from_micros(200);

/// How long to wait, how often to try, and what is long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Longest wait for an answer.
    pub answer: Duration,
    /// Silence within a block after which what is missing is asked for again.
    pub quiet: Duration,
    /// How often a read is tried; a write is tried once, as it may have been done.
    pub attempts: u8,
    /// From how many bytes on a value is transferred in blocks.
    pub block_from: usize,
    /// Most bytes of a value that is read.
    pub longest: usize,
    /// Longest wait for an LSS answer.
    pub lss: Duration,
    /// Pause after an LSS answer in which those of other nodes come.
    pub lss_settle: Duration,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            answer: Duration::from_millis(500),
            quiet: Duration::from_millis(200),
            attempts: 2,
            block_from: 64,
            longest: 64 << 20,
            lss: Duration::from_millis(40),
            lss_settle: Duration::from_millis(4),
        }
    }
}

/// What a node's last heartbeat said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heard {
    /// The state; `Initialising` is the boot-up message.
    pub state: NmtState,
    /// When it came.
    pub at: Instant,
    /// How often one came.
    pub count: u32,
}

/// A CANopen client.
#[derive(Debug)]
pub struct Client<B> {
    bus: B,
    settings: Settings,
    heard: [Option<Heard>; 128],
    emergencies: VecDeque<(u8, EmergencyReport)>,
    /// Nodes that do not know block transfers, one bit each.
    pub(crate) blockless: u128,
}

impl<B: Bus> Client<B> {
    /// Makes a client with the default [`Settings`].
    #[must_use]
    pub const fn with_settings(bus: B, settings: Settings) -> Self {
        Self {
            bus,
            settings,
            heard: [None; 128],
            emergencies: VecDeque::new(),
            blockless: 0,
        }
    }

    /// Makes a client.
    #[must_use]
    pub fn new(bus: B) -> Self {
        Self::with_settings(bus, Settings::default())
    }

    /// Returns the settings.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Lets the settings be changed.
    pub const fn settings_mut(&mut self) -> &mut Settings {
        &mut self.settings
    }

    /// Returns what was last heard of a node.
    #[must_use]
    pub fn heard(&self, node: u8) -> Option<Heard> {
        self.heard.get(usize::from(node)).copied().flatten()
    }

    /// Takes the emergencies that came since the last call, oldest first, with their senders.
    pub fn take_emergencies(&mut self) -> Vec<(u8, EmergencyReport)> {
        self.emergencies.drain(..).collect()
    }

    /// Gives the bus back.
    pub fn into_bus(self) -> B {
        self.bus
    }

    /// Listens, and remembers heartbeats and emergencies.
    ///
    /// # Errors
    /// What the bus fails with.
    pub fn listen(&mut self, time: Duration) -> Result<(), ClientError> {
        let deadline = Instant::now() + time;
        while self.receive(deadline)?.is_some() {}
        Ok(())
    }

    /// Forgets what came and was not waited for, but for heartbeats and emergencies.
    pub(crate) fn drain(&mut self) -> Result<(), ClientError> {
        /// More than a socket's queue holds.
        const MOST: u32 = 100_000;
        for _ in 0..MOST {
            let Some(received) = self.bus.receive(Duration::ZERO)? else {
                break;
            };
            self.notice(&received);
        }
        Ok(())
    }

    /// Sends a frame, again and again while the queue is full.
    pub(crate) fn send(&mut self, id: u16, data: &[u8]) -> Result<(), ClientError> {
        let Some(frame) = Frame::standard(id, data) else {
            return Err(BusError::Io(std::io::ErrorKind::InvalidInput.into()).into());
        };
        let start = Instant::now();
        loop {
            match self.bus.send(&frame) {
                Err(BusError::Full) if start.elapsed() < FULL => std::thread::sleep(FULL_PAUSE),
                sent => return Ok(sent?),
            }
        }
    }

    /// Waits for any frame until `deadline`.
    pub(crate) fn receive(&mut self, deadline: Instant) -> Result<Option<Frame>, ClientError> {
        loop {
            let rest = deadline.saturating_duration_since(Instant::now());
            let received = self.bus.receive(rest)?;
            if let Some(received) = &received {
                self.notice(received);
            }
            match received.as_ref().and_then(Received::frame) {
                Some(frame) => return Ok(Some(*frame)),
                None if rest.is_zero() => return Ok(None),
                None => {}
            }
        }
    }

    /// Waits for a frame of 8 bytes with this identifier; what else comes is passed over.
    pub(crate) fn await_frame(
        &mut self,
        id: u16,
        deadline: Instant,
    ) -> Result<Option<[u8; 8]>, ClientError> {
        while let Some(frame) = self.receive(deadline)? {
            if frame.cob_id() == Some(id)
                && let Ok(data) = frame.data().try_into()
            {
                return Ok(Some(data));
            }
        }
        Ok(None)
    }

    fn notice(&mut self, received: &Received) {
        let Some(frame) = received.frame() else {
            return;
        };
        match (frame.cob_id().map(Cob::from_id), frame.data()) {
            (Some(Cob::Heartbeat(node)), &[byte]) => {
                // The highest bit is the toggle of node guarding.
                let state = NmtState::from_heartbeat(byte & 0x7F);
                if let (Some(state), Some(slot)) = (state, self.heard.get_mut(usize::from(node))) {
                    let count = slot.map_or(0, |heard| heard.count).saturating_add(1);
                    *slot = Some(Heard {
                        state,
                        at: Instant::now(),
                        count,
                    });
                }
            }
            (Some(Cob::Emergency(node)), data) => {
                if let Ok(bytes) = data.try_into() {
                    if self.emergencies.len() >= EMERGENCIES {
                        self.emergencies.pop_front();
                    }
                    self.emergencies
                        .push_back((node, EmergencyReport::from_bytes(bytes)));
                }
            }
            _ => {}
        }
    }
}
