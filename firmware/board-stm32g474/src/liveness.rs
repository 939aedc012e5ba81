//! Who still runs: the watchdog is fed only when everyone has moved since the last time.

use core::sync::atomic::{AtomicU32, Ordering};

/// A task's sign of life.
pub struct Pulse(AtomicU32);

/// The current measurement, 20 kHz.
pub static CURRENT: Pulse = Pulse::new();
/// The control tick, 1 kHz.
pub static CONTROL: Pulse = Pulse::new();
/// The reception of frames, at least every 5 ms.
pub static RECEIVE: Pulse = Pulse::new();
/// The transmission of frames, at least every 5 ms.
pub static TRANSMIT: Pulse = Pulse::new();

impl Pulse {
    const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// Shows that the task runs.
    pub fn advance(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

/// The pulses as they were at the last look.
#[derive(Default)]
pub struct Watch {
    last: [u32; 4],
}

impl Watch {
    /// Tells whether every task has moved since the last look.
    pub fn all_advanced(&mut self) -> bool {
        let now = [&CURRENT, &CONTROL, &RECEIVE, &TRANSMIT].map(|it| it.0.load(Ordering::Relaxed));
        let moved = now.iter().zip(self.last).all(|(now, last)| *now != last);
        self.last = now;
        moved
    }
}
