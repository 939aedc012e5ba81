//! How many instructions a turn takes, by QEMU's virtual time.
//!
//! With `-icount shift=0` an instruction is a nanosecond, and SysTick counts 168 ticks in 1000 of
//! them. Instructions are no cycles: flash, branches and the FPU cost more on silicon.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

const RELOAD: u32 = 0x00FF_FFFF;
const INSTRUCTIONS: u64 = 1_000;
const TICKS: u64 = 168;

/// Counts instructions between two points.
pub struct Meter {
    // Nobody else may stop it.
    _timer: SYST,
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
    /// Starts SysTick.
    pub fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
        Self {
            _timer: timer,
            turns: 0,
            total: 0,
            worst: 0,
        }
    }

    /// Does a turn and counts it.
    pub fn count<Result>(&mut self, turn: impl FnOnce() -> Result) -> Result {
        let before = SYST::get_current();
        let result = turn();
        // It counts down.
        let ticks = before.wrapping_sub(SYST::get_current()) & RELOAD;
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
