//! How many instructions the turns take.
//!
//! Instructions are no cycles: flash, branches and the FPU cost more on silicon.

use cortex_m::peripheral::SYST;

use crate::stopwatch::Stopwatch;

const INSTRUCTIONS: u64 = 1_000;
const TICKS: u64 = 168;
/// Instructions that count as the same where the median is looked for.
const GRAIN: u64 = 16;
/// Grains that are told apart; longer turns count as the last.
const GRAINS: usize = 1024;

/// Counts the instructions of turns.
pub struct Meter {
    stopwatch: Stopwatch,
    turns: u64,
    total: u64,
    worst: u64,
    worst_driven: u64,
    driven: u64,
    /// How many driven turns took so many grains.
    spread: [u32; GRAINS],
}

/// What the turns took.
#[derive(Clone, Copy)]
pub struct Reading {
    /// How many turns.
    pub turns: u64,
    /// Instructions of a turn, mean.
    pub mean: u64,
    /// Instructions that half of the turns in which the motors are driven don't exceed, rounded up to the grain of 16.
    pub median: u64,
    /// Instructions of the longest turn in which the motors are driven.
    pub worst_driven: u64,
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
            worst_driven: 0,
            driven: 0,
            spread: [0; GRAINS],
        }
    }

    /// Does a turn and counts it, with those that are driven where it is one.
    pub fn count<Result>(
        &mut self,
        turn: impl FnOnce() -> Result,
        is_driven: impl FnOnce(&Result) -> bool,
    ) -> Result {
        let (result, ticks) = self.stopwatch.time(turn);
        let instructions = u64::from(ticks) * INSTRUCTIONS / TICKS;
        self.turns += 1;
        self.total += instructions;
        self.worst = self.worst.max(instructions);
        if !is_driven(&result) {
            return result;
        }
        self.driven += 1;
        self.worst_driven = self.worst_driven.max(instructions);
        let grain = (instructions / GRAIN).min(GRAINS as u64 - 1) as usize;
        if let Some(count) = self.spread.get_mut(grain) {
            *count += 1;
        }
        result
    }

    /// Returns what was counted.
    pub fn read(&self) -> Reading {
        Reading {
            turns: self.turns,
            mean: self.total / self.turns.max(1),
            worst_driven: self.worst_driven,
            worst: self.worst,
            median: self.median(),
        }
    }

    fn median(&self) -> u64 {
        let mut counted = 0;
        let half = self.spread.iter().position(|count| {
            counted += u64::from(*count);
            counted * 2 >= self.driven
        });
        half.map_or(0, |grain| (grain as u64 + 1) * GRAIN)
    }
}
