//! What a vertebra remembers over a failure of its microcontroller, in memory that no start clears.
//!
//! The platform keeps the newest [`Keepsake`] there and hands it to [`Vertebra::stop_after_failure`]: how
//! warm the windings are, so that a restart cools none of them, and a freeze frame. While a stop or fault
//! is latched that is its frame; else what the vertebra was doing, at most a twentieth of a second before
//! the failure.

use eel_protocol::emergency::{Emergency, Source};
use eel_protocol::freeze::{FREEZE_BYTES, FreezeFrame};

use crate::core::Core;
use crate::spare::Spare;
use crate::thermal::{HEAT_BYTES, Thermal};
use crate::vertebra::Vertebra;

/// Length of a keepsake: the heat of three motors, a freeze frame, a check of 32 bits.
pub const KEEPSAKE_BYTES: usize = 3 * HEAT_BYTES + FREEZE_BYTES + 4;
/// Where the check begins, so that zeros are no keepsake.
const SEED: u32 = 0x0EE1_5EED;

/// Everything that is remembered, as bytes with a check: memory may hold anything after a failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Keepsake([u8; KEEPSAKE_BYTES]);

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
        let [one, two, three] = thermal.each_ref().map(|motor| motor.to_bytes());
        // The lengths are those of the array.
        if let Some((heat, rest)) = bytes.split_first_chunk_mut::<{ 3 * HEAT_BYTES }>() {
            for (to, from) in heat.as_chunks_mut().0.iter_mut().zip([one, two, three]) {
                *to = from;
            }
            if let Some(place) = rest.first_chunk_mut::<FREEZE_BYTES>() {
                *place = frame.to_bytes();
            }
        }
        let check = checksum(&bytes).to_le_bytes();
        if let Some(place) = bytes.last_chunk_mut::<4>() {
            *place = check;
        }
        Self(bytes)
    }

    /// Returns what it holds; `None` where it was never written, or is damaged.
    fn read(&self) -> Option<([Thermal; 3], FreezeFrame)> {
        let (_, check) = self.0.split_last_chunk::<4>()?;
        let (heat, rest) = self.0.split_first_chunk::<{ 3 * HEAT_BYTES }>()?;
        let (frame, _) = rest.split_first_chunk::<FREEZE_BYTES>()?;
        let (motors, _) = heat.as_chunks::<HEAT_BYTES>();
        let &[one, two, three] = motors.first_chunk::<3>()?;
        if u32::from_le_bytes(*check) != checksum(&self.0) {
            return None;
        }
        let frame = FreezeFrame::from_bytes(frame).ok()?;
        Some(([one, two, three].map(Thermal::from_bytes), frame))
    }
}

/// Returns the check of all but the last four bytes: enough to tell memory that was never written, or not
/// to its end, in a fraction of the time of a CRC.
fn checksum(bytes: &[u8; KEEPSAKE_BYTES]) -> u32 {
    let [content @ .., _, _, _, _] = bytes;
    let (words, _) = content.as_chunks::<4>();
    words.iter().fold(SEED, |sum, word| {
        sum.rotate_left(5).wrapping_add(u32::from_le_bytes(*word)) ^ SEED
    })
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

    /// Notes what the vertebra is doing, or what it was when it stopped.
    #[cold]
    #[inline(never)]
    fn note(&mut self) {
        let state = self.machine.state();
        let frame = self.freeze.filter(|_| state.is_latched());
        self.snapshot =
            Some(frame.unwrap_or_else(|| self.frame(state, Emergency::RESTARTED, Source::WHOLE)));
    }

    /// Makes what is to be kept of what was noted last.
    #[cold]
    #[inline(never)]
    fn keepsake(&self) -> Option<Keepsake> {
        let frame = self.snapshot.as_ref()?;
        Some(Keepsake::new(&self.thermal, frame))
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
    /// Returns what the platform shall keep from now on in place of what it has, about thirty times a second.
    /// Call it after each turn.
    #[inline]
    pub fn poll_keepsake(&mut self) -> Option<Keepsake> {
        let core = &mut self.core;
        match core.spare() {
            Spare::Snapshot if !core.was_long => core.note(),
            Spare::Memory if !core.was_long => return core.keepsake(),
            _ => {}
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use eel_units::Instant;

    use super::*;
    use crate::settings::Settings;

    /// Returns a core that has something to remember.
    fn core() -> Core {
        let settings = Settings::unconfigured(7);
        let mut core = Core::new(settings, Instant::ZERO);
        core.thermal = [[9, 8, 7, 0, 5, 4, 3, 0]; 3].map(Thermal::from_bytes);
        core
    }

    #[test]
    fn what_is_kept_comes_back_and_what_is_damaged_does_not() {
        let core = core();
        let frame = core.frame(core.machine.state(), Emergency::RESTARTED, Source::WHOLE);
        let keepsake = Keepsake::new(&core.thermal, &frame);
        let (thermal, found) = keepsake.read().unwrap();
        assert_eq!(found, frame);
        assert!(
            thermal
                .iter()
                .all(|motor| motor.to_bytes() == [9, 8, 7, 0, 5, 4, 3, 0])
        );
        for bit in 0..8 * KEEPSAKE_BYTES {
            let mut bytes = *keepsake.as_bytes();
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(Keepsake::from_bytes(bytes).read().is_none(), "bit {bit}");
        }
        for byte in [0, 0x55, 0xFF] {
            assert!(
                Keepsake::from_bytes([byte; KEEPSAKE_BYTES])
                    .read()
                    .is_none()
            );
        }
    }
}
