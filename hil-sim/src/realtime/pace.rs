//! How many ticks are due.

use std::time::Duration;

use crate::robot::TICK_NS;

/// Ticks that are made up for at most, 100 ms.
pub const CATCH_UP_TICKS: u64 = 100;

/// Keeps ticks beside a clock that may jump ahead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pace {
    /// Ticks done or left out; the next is due this many ticks after the start.
    passed: u64,
    skipped: u64,
}

impl Pace {
    /// Returns how many ticks are due `elapsed` after the start, and counts them as done; at most
    /// [`CATCH_UP_TICKS`], more are left out.
    pub fn due(&mut self, elapsed: Duration) -> u64 {
        let reached = u64::try_from(elapsed.as_nanos()).unwrap_or(u64::MAX) / TICK_NS + 1;
        let due = reached.saturating_sub(self.passed);
        let left_out = due.saturating_sub(CATCH_UP_TICKS);
        self.skipped += left_out;
        self.passed += due;
        due - left_out
    }

    /// Returns the time until the next tick, none when it is due already.
    pub fn until_next(&self, elapsed: Duration) -> Duration {
        Duration::from_nanos(self.passed * TICK_NS).saturating_sub(elapsed)
    }

    /// Returns how many ticks were left out.
    pub const fn skipped(&self) -> u64 {
        self.skipped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_is_due_at_the_start_and_every_millisecond() {
        let mut pace = Pace::default();
        assert_eq!(pace.due(Duration::ZERO), 1);
        assert_eq!(
            pace.until_next(Duration::from_micros(300)),
            Duration::from_micros(700)
        );
        assert_eq!(pace.due(Duration::from_micros(999)), 0);
        assert_eq!(pace.due(Duration::from_millis(1)), 1);
        assert_eq!(pace.due(Duration::from_millis(5)), 4);
        assert_eq!(pace.skipped(), 0);
    }

    #[test]
    fn a_late_host_catches_up_and_leaves_out_what_is_too_much() {
        let mut pace = Pace::default();
        assert_eq!(pace.due(Duration::from_millis(50)), 51);
        assert_eq!(pace.due(Duration::from_millis(1_050)), CATCH_UP_TICKS);
        assert_eq!(pace.skipped(), 900);
        assert_eq!(pace.due(Duration::from_millis(1_051)), 1);
        assert_eq!(pace.until_next(Duration::from_secs(9)), Duration::ZERO);
    }
}
