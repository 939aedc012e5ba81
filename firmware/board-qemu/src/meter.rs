//! How many instructions the turns take.
//!
//! Instructions are no cycles: flash, branches and the FPU cost more on silicon.

use cortex_m::peripheral::SYST;

use crate::stopwatch::Stopwatch;

const INSTRUCTIONS: u64 = 1_000;
const TICKS: u64 = 168;

/// Counts the instructions of turns.
pub struct Meter {
    stopwatch: Stopwatch,
    turns: u64,
    total: u64,
    worst: u64,
}

/// What the turns took.
#[derive(Clone, Copy)]
pub struct Reading {
    /// How many turns.
    pub turns: u64,
    /// Instructions of a turn, mean.
    pub mean: u64,
    /// Instructions of the longest turn.
    pub worst: u64,
}

impl Meter {
    /// Starts the clock.
    pub fn new(timer: SYST) -> Self {
        Self {
            stopwatch: Stopwatch::new(timer),
            turns: 0,
            total: 0,
            worst: 0,
        }
    }

    /// Does a turn and counts it.
    pub fn count<Result>(&mut self, turn: impl FnOnce() -> Result) -> Result {
        let (result, ticks) = self.stopwatch.time(turn);
        let instructions = u64::from(ticks) * INSTRUCTIONS / TICKS;
        self.turns += 1;
        self.total += instructions;
        self.worst = self.worst.max(instructions);
        result
    }

    /// Returns what was counted.
    pub fn read(&self) -> Reading {
        Reading {
            turns: self.turns,
            mean: self.total / self.turns.max(1),
            worst: self.worst,
        }
    }
}
