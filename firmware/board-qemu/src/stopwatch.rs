//! How many instructions a piece of code takes, by QEMU's virtual time.
//!
//! With `-icount shift=0` an instruction is a nanosecond, and SysTick counts the processor's clock
//! in virtual time: 168 ticks in 1000 instructions on `netduinoplus2`.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

const RELOAD: u32 = 0x00FF_FFFF;

/// SysTick, running freely.
pub struct Stopwatch {
    // Nobody else may stop it.
    _timer: SYST,
}

impl Stopwatch {
    /// Starts SysTick.
    pub fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
        Self { _timer: timer }
    }

    /// Does the work and returns the ticks that it took, below 2²⁴, beside its result.
    #[inline(always)]
    pub fn time<Result>(&self, work: impl FnOnce() -> Result) -> (Result, u32) {
        let before = SYST::get_current();
        let result = work();
        // It counts down.
        let ticks = before.wrapping_sub(SYST::get_current()) & RELOAD;
        (result, ticks)
    }
}
