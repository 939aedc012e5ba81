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
/// Most steps by which a counter is newer; more means that the frame is an older one.
const NEWEST_STEP: u8 = 7;
/// Shortest and longest SYNC period that is believed: 200 Hz and 50 Hz, with a tick to spare.
const PERIOD_RANGE_US: (u32, u32) = (4_000, 21_000);
/// A SYNC so soon after the segment began is none to follow: a head that sends faster than 200 Hz
/// must not lead faster than the rate limit.
const EARLY: Duration = Duration::from_micros(3_500);
/// A SYNC within 2.5 ms of the expected moment continues the path; later it is overdue.
const REGULAR_US: i64 = 2_500;

/// What has gone wrong with targets since power-up, for object 0x2030.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TargetCounters {
    /// Frames whose protection did not match or whose codes mean nothing.
    pub bad: u32,
    /// Frames that the counter shows never to have arrived.
    pub lost: u32,
    /// Frames that came twice, or after newer ones.
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
    /// Where the segment begins, which is steadier than when its SYNC came.
    segment_start: Instant,
    /// When that was decided.
    begun: Instant,
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
            begun: now,
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
        // Whoever speaks after a silence may count anew, but not repeat the last word.
        let newest = if self.is_lost(now) {
            u8::MAX
        } else {
            NEWEST_STEP
        };
        let is_old = |last| !(1..=newest).contains(&target.counter.since(last));
        if self.last.is_some_and(is_old) {
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

    /// Takes the SYNC at `now`, with which the next segment begins unless it is early. Tells how
    /// many periods have then passed without a target.
    pub fn synchronise(&mut self, now: Instant) -> Option<u8> {
        let (shortest, longest) = PERIOD_RANGE_US;
        let measured = now.since(self.last_sync).to_micros();
        self.last_sync = now;
        let is_early = self.is_early(now);
        let lateness = self.lateness(now);
        if is_early {
            self.fresh = false;
        } else if lateness.abs() <= REGULAR_US {
            // The tick resolves a SYNC to a millisecond only: a quarter of that is followed.
            let begin = self.segment_start + self.period;
            self.begin(shifted(begin, lateness / 4), now);
        } else {
            self.begin(now, now);
        }
        if (shortest..=longest).contains(&measured) {
            let period = i64::from(self.period.to_micros());
            let error = i64::from(measured) - period;
            // A low pass over 32 periods, over 8 while it learns another one.
            let share = if error.abs() <= REGULAR_US { 32 } else { 8 };
            self.period = Duration::from_micros((period + error / share) as u32);
        }
        (!is_early).then(|| self.count_missed())
    }

    /// Tells whether a SYNC at `now` would come too soon to begin a segment.
    pub fn is_early(&self, now: Instant) -> bool {
        now.since(self.begun) < EARLY
    }

    /// Tells whether a SYNC at `now` would begin a segment elsewhere than where the one before ends.
    pub fn breaks_path(&self, now: Instant) -> bool {
        !self.is_early(now) && self.lateness(now).abs() > REGULAR_US
    }

    /// Tells whether a target came for the segment that begins with this SYNC.
    pub const fn is_fresh(&self) -> bool {
        self.fresh
    }

    /// Tells whether a SYNC is overdue by so much that the path must go on without it.
    pub fn sync_overdue(&self, now: Instant) -> bool {
        self.lateness(now) > REGULAR_US
    }

    /// Begins a segment without a SYNC. Tells how many periods have passed without a target.
    pub fn begin_segment(&mut self, now: Instant) -> u8 {
        let end = self.segment_start + self.period;
        let is_recent = now.since(end) < self.period;
        self.begin(if is_recent { end } else { now }, now);
        self.count_missed()
    }

    fn begin(&mut self, start: Instant, now: Instant) {
        self.segment_start = start;
        self.begun = now;
    }

    fn count_missed(&mut self) -> u8 {
        if !self.fresh {
            self.missed = self.missed.saturating_add(1);
        }
        self.fresh = false;
        self.missed
    }

    /// Returns by how many µs `now` is past the end of the segment.
    fn lateness(&self, now: Instant) -> i64 {
        signed(now, self.segment_start + self.period)
    }

    /// Tells whether no target came for so long that the vertebra must let go.
    pub fn is_lost(&self, now: Instant) -> bool {
        now.since(self.last_good) >= TARGET_TIMEOUT
    }

    /// Returns the time in µs since the segment began, which is before it by a little where a SYNC
    /// came sooner than expected, and the segment's length.
    pub fn place(&self, now: Instant) -> (i64, Duration) {
        (signed(now, self.segment_start), self.period)
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

/// Returns the time from `from` to `now` in µs.
fn signed(now: Instant, from: Instant) -> i64 {
    i64::from(now.since(from).to_micros()) - i64::from(from.since(now).to_micros())
}

/// Returns the moment `micros` later, or earlier where they are negative.
fn shifted(instant: Instant, micros: i64) -> Instant {
    Instant::from_micros(instant.to_micros().saturating_add_signed(micros))
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
        for beat in 1..400 {
            stream.synchronise(at(beat * 20));
        }
        let (_, period) = stream.place(at(7_980));
        assert!(period.to_micros().abs_diff(20_000) <= 32, "{period:?}");
    }
}
