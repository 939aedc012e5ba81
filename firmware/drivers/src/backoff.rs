//! How long a node that was thrown off its bus stays away.

use eel_units::{Duration, Instant};

/// The first pause.
const SHORTEST: Duration = Duration::from_millis(100);
/// The longest pause.
const LONGEST: Duration = Duration::from_millis(1_000);
/// Time without a bus-off after which the bus counts as well again.
const CALM: Duration = Duration::from_millis(10_000);

/// Pauses of 100, 200, 400, 800 and then 1000 ms before a node that is bus-off rejoins.
///
/// A node with a defect of its own, which destroys others' frames, so takes at most a few
/// milliseconds of each second from them; one that was the victim of a disturbance is back soon.
#[derive(Clone, Copy, Debug, Default)]
pub struct Backoff {
    last: Option<(Instant, Duration)>,
}

impl Backoff {
    /// Returns the pause for a bus-off at `now`. It begins at 100 ms again when the one before was
    /// 10 s ago or more.
    pub fn pause(&mut self, now: Instant) -> Duration {
        let pause = match self.last {
            Some((then, pause)) if now.since(then) < CALM => {
                let doubled = pause.to_micros().saturating_mul(2);
                Duration::from_micros(doubled.min(LONGEST.to_micros()))
            }
            _ => SHORTEST,
        };
        self.last = Some((now, pause));
        pause
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::from_micros(millis * 1_000)
    }

    #[test]
    fn stays_away_longer_each_time_and_never_longer_than_a_second() {
        let mut backoff = Backoff::default();
        let mut now = 5;
        for expected in [100, 200, 400, 800, 1_000, 1_000, 1_000] {
            let pause = backoff.pause(at(now));
            assert_eq!(pause, Duration::from_millis(expected));
            now += u64::from(expected) + 4;
        }
    }

    #[test]
    fn begins_anew_after_ten_calm_seconds() {
        let mut backoff = Backoff::default();
        backoff.pause(at(0));
        assert_eq!(backoff.pause(at(9_999)), Duration::from_millis(200));
        assert_eq!(backoff.pause(at(19_999)), Duration::from_millis(100));
    }
}
