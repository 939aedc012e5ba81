//! The stream of targets: which frames count, and when the stream has been lost.

use eel_protocol::{Counter, FrameError, SYNC_PERIOD_US, Target};
use eel_units::{Duration, Instant};

/// Silence after which the vertebra lets go: 90 ms, so that it is damped within 100 ms whatever
/// the phase of its tick.
pub const TARGET_TIMEOUT: Duration = Duration::from_millis(90);
/// SYNC periods that a missing target is bridged as if the motion went on.
pub const BRIDGED_PERIODS: u8 = 2;
/// Bad targets in a row that count as loss.
const BAD_LIMIT: u8 = 3;
/// Shortest and longest SYNC period that is believed: 200 Hz and 50 Hz, with a tick to spare.
const PERIOD_RANGE_US: (u32, u32) = (4_000, 21_000);
/// A SYNC so soon after the segment began is none to follow: a head that sends faster than 200 Hz
/// must not lead faster than the rate limit.
const EARLY: Duration = Duration::from_micros(3_500);

/// What has gone wrong with targets since power-up, for object 0x2030.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TargetCounters {
    /// Frames whose protection did not match or whose codes mean nothing.
    pub bad: u32,
    /// Frames that the counter shows never to have arrived.
    pub lost: u32,
    /// Frames that came twice.
    pub repeated: u32,
}

/// The receiving end of the stream of targets.
#[derive(Clone, Copy, Debug)]
pub struct CommandStream {
    counters: TargetCounters,
    last: Option<Counter>,
    last_good: Instant,
    bad_in_a_row: u8,
    missed: u8,
    segment_start: Instant,
    last_sync: Instant,
    period: Duration,
    fresh: bool,
}

/// What a received frame is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// A target to follow.
    Target(Target),
    /// A frame not to follow: repeated, or the first bad ones.
    Ignored,
    /// One bad frame too many.
    TooManyBad,
}

impl CommandStream {
    /// Starts without a target.
    pub const fn new(now: Instant) -> Self {
        Self {
            counters: TargetCounters {
                bad: 0,
                lost: 0,
                repeated: 0,
            },
            last: None,
            last_good: now,
            bad_in_a_row: 0,
            missed: 0,
            segment_start: now,
            last_sync: now,
            period: Duration::from_micros(SYNC_PERIOD_US),
            fresh: false,
        }
    }

    /// Takes the bytes of RPDO1 that a SYNC has released.
    pub fn receive(&mut self, now: Instant, bytes: &[u8; 8], cob_id: u16) -> Received {
        let target = match Target::from_bytes(bytes, cob_id) {
            Ok(target) => target,
            Err(error) => return self.reject(error),
        };
        let repeated = self
            .last
            .is_some_and(|last| target.counter.since(last) == 0);
        if repeated {
            self.counters.repeated = self.counters.repeated.saturating_add(1);
            return Received::Ignored;
        }
        if let Some(last) = self.last {
            let skipped = u32::from(target.counter.since(last).saturating_sub(1));
            self.counters.lost = self.counters.lost.saturating_add(skipped);
        }
        self.last = Some(target.counter);
        self.last_good = now;
        self.bad_in_a_row = 0;
        self.missed = 0;
        self.fresh = true;
        Received::Target(target)
    }

    /// Takes the SYNC at `now`; the next segment begins. Tells how many periods have now passed
    /// without a target.
    pub fn synchronise(&mut self, now: Instant) -> u8 {
        let (shortest, longest) = PERIOD_RANGE_US;
        let measured = now.since(self.last_sync).to_micros();
        self.last_sync = now;
        if (shortest..=longest).contains(&measured) {
            // A low pass over eight periods: the tick resolves a SYNC to a millisecond only.
            let smoothed = (self.period.to_micros() * 7 + measured + 4) / 8;
            self.period = Duration::from_micros(smoothed);
        }
        self.begin_segment(now)
    }

    /// Tells whether a SYNC at `now` would come too soon to begin a segment.
    pub fn is_early(&self, now: Instant) -> bool {
        now.since(self.segment_start) < EARLY
    }

    /// Forgets that a target came, because no segment ends there.
    pub const fn discard(&mut self) {
        self.fresh = false;
    }

    /// Tells whether a SYNC is overdue by so much that the path must go on without it.
    pub fn sync_overdue(&self, now: Instant) -> bool {
        now.since(self.segment_start).to_micros() > self.period.to_micros().saturating_add(2_500)
    }

    /// Begins a segment without a SYNC. Tells how many periods have passed without a target.
    pub const fn begin_segment(&mut self, now: Instant) -> u8 {
        self.segment_start = now;
        if !self.fresh {
            self.missed = self.missed.saturating_add(1);
        }
        self.fresh = false;
        self.missed
    }

    /// Tells whether no target came for so long that the vertebra must let go.
    pub fn is_lost(&self, now: Instant) -> bool {
        now.since(self.last_good) >= TARGET_TIMEOUT
    }

    /// Returns the time since the segment began, and its length.
    pub const fn place(&self, now: Instant) -> (Duration, Duration) {
        (now.since(self.segment_start), self.period)
    }

    /// Returns what has gone wrong.
    pub const fn counters(&self) -> TargetCounters {
        self.counters
    }

    fn reject(&mut self, _error: FrameError) -> Received {
        self.counters.bad = self.counters.bad.saturating_add(1);
        self.bad_in_a_row = self.bad_in_a_row.saturating_add(1);
        if self.bad_in_a_row == BAD_LIMIT {
            Received::TooManyBad
        } else {
            Received::Ignored
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eel_protocol::Mode;
    use eel_units::Angle;

    const COB: u16 = 0x203;

    fn target(counter: u8) -> [u8; 8] {
        let counter = Counter::new(counter).unwrap();
        let (yaw, pitch, roll) = (Angle::FRAC_PI_4, Angle::ZERO, Angle::ZERO);
        Target {
            yaw,
            pitch,
            roll,
            mode: Mode::Run,
            counter,
        }
        .to_bytes(COB)
    }

    fn at(millis: u64) -> Instant {
        Instant::from_micros(millis * 1_000)
    }

    #[test]
    fn a_repeated_frame_does_not_keep_the_stream_alive() {
        let mut stream = CommandStream::new(at(0));
        assert!(matches!(
            stream.receive(at(1), &target(5), COB),
            Received::Target(_)
        ));
        for time in 2..91 {
            assert_eq!(stream.receive(at(time), &target(5), COB), Received::Ignored);
            assert!(!stream.is_lost(at(time)));
        }
        assert!(stream.is_lost(at(91)));
        assert_eq!(stream.counters().repeated, 89);
    }

    #[test]
    fn counts_what_never_arrived_across_the_wrap() {
        let mut stream = CommandStream::new(at(0));
        stream.receive(at(1), &target(13), COB);
        stream.receive(at(2), &target(2), COB);
        assert_eq!(stream.counters().lost, 3);
    }

    #[test]
    fn three_bad_targets_in_a_row_are_one_too_many() {
        let mut stream = CommandStream::new(at(0));
        let mut bad = target(1);
        bad[3] ^= 0x10;
        assert_eq!(stream.receive(at(1), &bad, COB), Received::Ignored);
        assert_eq!(stream.receive(at(2), &bad, COB), Received::Ignored);
        assert!(matches!(
            stream.receive(at(3), &target(1), COB),
            Received::Target(_)
        ));
        assert_eq!(stream.receive(at(4), &bad, COB), Received::Ignored);
        assert_eq!(stream.receive(at(5), &bad, COB), Received::Ignored);
        assert_eq!(stream.receive(at(6), &bad, COB), Received::TooManyBad);
        assert_eq!(stream.counters().bad, 5);
    }

    #[test]
    fn a_target_under_a_wrong_identifier_is_bad() {
        let mut stream = CommandStream::new(at(0));
        assert_eq!(
            stream.receive(at(1), &target(1), COB + 1),
            Received::Ignored
        );
        assert_eq!(stream.counters().bad, 1);
    }

    #[test]
    fn learns_the_period_of_sync() {
        let mut stream = CommandStream::new(at(0));
        for beat in 1..100 {
            stream.synchronise(at(beat * 20));
        }
        let (_, period) = stream.place(at(1_980));
        assert!(period.to_micros().abs_diff(20_000) < 20, "{period:?}");
    }
}
