//! What a vertebra remembers over a failure of its microcontroller, in memory that no start clears.
//!
//! The platform keeps the newest [`Keepsake`] there and hands it to [`Vertebra::stop_after_failure`]: how
//! warm the windings are, so that a restart cools none of them, and a freeze frame. While a stop or fault
//! is latched that is its frame; else what the vertebra was doing, at most a tenth of a second before the
//! failure.

use eel_protocol::Crc32;
use eel_protocol::emergency::{Emergency, Source};
use eel_protocol::freeze::{FREEZE_BYTES, FreezeFrame};
use eel_units::{Duration, Instant};

use crate::core::Core;
use crate::thermal::{HEAT_BYTES, Thermal};
use crate::vertebra::Vertebra;

/// Length of a keepsake: the heat of three motors, a freeze frame, CRC-32.
pub const KEEPSAKE_BYTES: usize = 3 * HEAT_BYTES + FREEZE_BYTES + 4;
/// Time between two of them.
const PERIOD: Duration = Duration::from_millis(100);

/// Everything that is remembered, as bytes with a check: memory may hold anything after a failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Keepsake([u8; KEEPSAKE_BYTES]);

/// When the last one was made, and of which freeze frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Kept {
    at: Option<Instant>,
    count: u32,
}

impl Keepsake {
    /// Stands for nothing, as memory that was never written.
    pub const EMPTY: Self = Self([0; KEEPSAKE_BYTES]);

    /// Takes what memory holds; whether it is a keepsake shows when it is used.
    pub const fn from_bytes(bytes: [u8; KEEPSAKE_BYTES]) -> Self {
        Self(bytes)
    }

    /// Returns the bytes.
    pub const fn as_bytes(&self) -> &[u8; KEEPSAKE_BYTES] {
        &self.0
    }

    /// Makes one of the heat and a frame.
    fn new(thermal: &[Thermal; 3], frame: &FreezeFrame) -> Self {
        let mut bytes = [0; KEEPSAKE_BYTES];
        let heat = thermal.iter().flat_map(|motor| motor.to_bytes());
        let content = heat.chain(frame.to_bytes());
        for (to, from) in bytes.iter_mut().zip(content) {
            *to = from;
        }
        let crc = checksum(&bytes).to_le_bytes();
        for (to, from) in bytes.iter_mut().skip(KEEPSAKE_BYTES - 4).zip(crc) {
            *to = from;
        }
        Self(bytes)
    }

    /// Returns what it holds; `None` where it was never written, or is damaged.
    fn read(&self) -> Option<([Thermal; 3], FreezeFrame)> {
        let (_, crc) = self.0.split_last_chunk::<4>()?;
        let (heat, rest) = self.0.split_first_chunk::<{ 3 * HEAT_BYTES }>()?;
        let (frame, _) = rest.split_first_chunk::<FREEZE_BYTES>()?;
        let (motors, _) = heat.as_chunks::<HEAT_BYTES>();
        let &[one, two, three] = motors.first_chunk::<3>()?;
        if u32::from_le_bytes(*crc) != checksum(&self.0) {
            return None;
        }
        let frame = FreezeFrame::from_bytes(frame).ok()?;
        Some(([one, two, three].map(Thermal::from_bytes), frame))
    }
}

/// Returns the check of all but the last four bytes.
fn checksum(bytes: &[u8; KEEPSAKE_BYTES]) -> u32 {
    let mut crc = Crc32::default();
    let [content @ .., _, _, _, _] = bytes;
    crc.update(content);
    crc.value()
}

impl Core {
    /// Remembers what was kept; tells whether there was anything.
    fn remember(&mut self, keepsake: &Keepsake) -> bool {
        let Some((thermal, frame)) = keepsake.read() else {
            return false;
        };
        self.thermal = thermal;
        self.freeze = Some(frame);
        true
    }

    /// Latches after a failure. What was kept tells more of it than this moment.
    pub fn restart(&mut self, keepsake: &Keepsake) {
        let is_known = self.remember(keepsake);
        let frame = self.freeze;
        self.emergency_stop(Emergency::RESTARTED);
        if is_known {
            self.freeze = frame;
        }
    }
}

impl Vertebra {
    /// Returns what the platform shall keep from now on in place of what it has: with every new freeze
    /// frame, and ten times a second.
    pub fn poll_keepsake(&mut self) -> Option<Keepsake> {
        let core = &self.core;
        let Kept { at, count } = self.kept;
        let newest = core.freeze.map_or(0, |frame| frame.count);
        let is_due = at.is_none_or(|at| core.now.since(at) >= PERIOD);
        if !is_due && newest == count {
            return None;
        }
        self.kept = Kept {
            at: Some(core.now),
            count: newest,
        };
        let state = core.machine.state();
        let frame = core
            .freeze
            .filter(|_| state.is_latched())
            .unwrap_or_else(|| core.frame(state, Emergency::RESTARTED, Source::WHOLE));
        Some(Keepsake::new(&core.thermal, &frame))
    }
}
