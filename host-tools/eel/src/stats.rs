//! What a stretch of traffic adds up to: load, rates, periods, losses.
//!
//! A period is the time between two frames of one identifier. Jitter is the standard deviation of
//! the periods. A gap is a period longer than one and a half of what the dictionary promises; the
//! time around a boot-up or an NMT command is no gap. A lost frame is a step of its counter by more
//! than one.

use std::collections::HashMap;

use eel_protocol::emergency::{self, EmergencyReport};
use eel_protocol::messages::Message;
use eel_protocol::{Cob, Counter, HEAD_HEARTBEAT_MS, HEAD_NODE, SYNC_PERIOD_US};
use eel_transport::{Content, Received, frame_bits};

use crate::decode::Decoded;

/// Length of the window in which the greatest load is sought, in ns.
const WINDOW_NS: u64 = 100_000_000;
/// Marks a 29-bit identifier in a key.
const EXTENDED: u32 = 1 << 31;
/// Emergencies that are kept for the report.
const KEPT: usize = 100;

/// What one identifier adds up to.
#[derive(Clone, Debug, Default)]
pub struct PerId {
    /// Frames.
    pub count: u64,
    /// Frames that are wrong in length, protection or code.
    pub bad: u64,
    /// Frames missing by their counter.
    pub lost: u64,
    /// Frames with the counter of the one before.
    pub repeated: u64,
    /// Periods that are too long.
    pub gaps: u64,
    /// Bits on the wire.
    pub bits: u64,
    /// Measured periods.
    pub periods: u64,
    /// Shortest period in ns.
    pub min_ns: u64,
    /// Longest period in ns.
    pub max_ns: u64,
    sum_ns: u128,
    sum_of_squares: u128,
    last_ns: Option<u64>,
    last_counter: Option<Counter>,
}

/// An emergency that was seen.
#[derive(Clone, Copy, Debug)]
pub struct SeenEmergency {
    /// When.
    pub time_ns: u64,
    /// Whose.
    pub node: u8,
    /// What.
    pub report: EmergencyReport,
}

/// What the whole bus adds up to.
#[derive(Clone, Debug)]
pub struct Statistics {
    bitrate: u32,
    sync_period_ns: u64,
    first_ns: Option<u64>,
    end_ns: u64,
    window: Window,
    ids: HashMap<u32, PerId>,
    /// Frames.
    pub frames: u64,
    /// Bits on the wire.
    pub bits: u64,
    /// Error reports of the interface.
    pub error_reports: u64,
    /// The first emergencies.
    pub emergencies: Vec<SeenEmergency>,
    /// All emergencies that are faults or that nobody knows.
    pub faults: u64,
}

/// The load of the last 100 ms: a ring of one-millisecond slots.
#[derive(Clone, Debug)]
struct Window {
    slots: [u64; 100],
    slot: u64,
    sum: u64,
    max: u64,
}

impl Window {
    const SLOT_NS: u64 = WINDOW_NS / 100;

    fn add(&mut self, time_ns: u64, bits: u64) {
        let slot = time_ns / Self::SLOT_NS;
        for passed in self.slot + 1..=slot.min(self.slot + 100) {
            let place = &mut self.slots[(passed % 100) as usize];
            self.sum -= *place;
            *place = 0;
        }
        self.slot = self.slot.max(slot);
        self.slots[(self.slot % 100) as usize] += bits;
        self.sum += bits;
        self.max = self.max.max(self.sum);
    }
}

impl PerId {
    /// Returns the mean period in ns.
    pub fn mean_ns(&self) -> Option<f64> {
        (self.periods > 0).then(|| self.sum_ns as f64 / self.periods as f64)
    }

    /// Returns the standard deviation of the periods in ns.
    pub fn jitter_ns(&self) -> Option<f64> {
        if self.periods == 0 {
            return None;
        }
        let count = u128::from(self.periods);
        // n Σx² − (Σx)², exact in integers, is n² times the variance.
        let scaled = (count * self.sum_of_squares).saturating_sub(self.sum_ns * self.sum_ns);
        Some((scaled as f64).sqrt() / count as f64)
    }

    fn add_time(&mut self, time_ns: u64, longest_ns: Option<u64>) {
        if let Some(last_ns) = self.last_ns.replace(time_ns) {
            let period = time_ns.saturating_sub(last_ns);
            self.min_ns = if self.periods == 0 {
                period
            } else {
                self.min_ns.min(period)
            };
            self.max_ns = self.max_ns.max(period);
            self.periods += 1;
            self.sum_ns += u128::from(period);
            self.sum_of_squares += u128::from(period).pow(2);
            self.gaps += u64::from(longest_ns.is_some_and(|longest| period > longest));
        }
    }

    fn add_counter(&mut self, counter: Counter) {
        if let Some(last) = self.last_counter.replace(counter) {
            match counter.since(last) {
                0 => self.repeated += 1,
                steps => self.lost += u64::from(steps) - 1,
            }
        }
    }

    /// Forgets the last frame, since the next is not its successor.
    fn break_off(&mut self) {
        self.last_ns = None;
        self.last_counter = None;
    }
}

impl Statistics {
    /// Makes empty statistics of a bus with `bitrate` bits a second and `sync_hz` SYNCs a second.
    pub fn new(bitrate: u32, sync_hz: f64) -> Self {
        Self {
            bitrate,
            sync_period_ns: (1e9 / sync_hz) as u64,
            first_ns: None,
            end_ns: 0,
            window: Window {
                slots: [0; 100],
                slot: 0,
                sum: 0,
                max: 0,
            },
            ids: HashMap::new(),
            frames: 0,
            bits: 0,
            error_reports: 0,
            emergencies: Vec::new(),
            faults: 0,
        }
    }

    /// Adds what was received.
    pub fn add(&mut self, received: &Received) {
        let Content::Frame(frame) = &received.content else {
            self.error_reports += 1;
            return;
        };
        let (time_ns, bits) = (received.time_ns, u64::from(frame_bits(frame)));
        let duration = bits * 1_000_000_000 / u64::from(self.bitrate);
        let first_ns = self.first_ns.get_or_insert(time_ns);
        *first_ns = (*first_ns).min(time_ns);
        self.end_ns = self.end_ns.max(time_ns + duration);
        self.frames += 1;
        self.bits += bits;
        self.window.add(time_ns, bits);
        let decoded = Decoded::of(frame);
        if let Some(cob) = decoded.cob {
            self.note(time_ns, cob, &decoded);
        }
        let longest_ns = self.expected_ns(&decoded).map(|period| period + period / 2);
        let extended = if frame.is_extended() { EXTENDED } else { 0 };
        let entry = self.ids.entry(frame.raw_id() | extended).or_default();
        entry.count += 1;
        entry.bits += bits;
        entry.bad += u64::from(decoded.problem.is_some());
        if decoded.raw("state") == Some(0) && decoded.name() == "heartbeat" {
            // A boot-up is no beat.
            return;
        }
        entry.add_time(time_ns, longest_ns);
        if let (Some(Cob::Target(_) | Cob::Pose(_)), None) = (decoded.cob, decoded.problem)
            && let Some(counter) = decoded
                .raw("counter")
                .and_then(|raw| u8::try_from(raw).ok())
                .and_then(Counter::new)
        {
            entry.add_counter(counter);
        }
    }

    /// Keeps emergencies, and breaks periods off where a node starts, stops or is reset.
    fn note(&mut self, time_ns: u64, cob: Cob, decoded: &Decoded<'_>) {
        match cob {
            Cob::Emergency(node) => {
                let Ok(bytes) = decoded.frame.data().try_into() else {
                    return;
                };
                let report = EmergencyReport::from_bytes(bytes);
                let severity = emergency::from_code(report.code).map(|known| known.severity);
                self.faults +=
                    u64::from(matches!(severity, None | Some(emergency::Severity::Fault)));
                if self.emergencies.len() < KEPT {
                    self.emergencies.push(SeenEmergency {
                        time_ns,
                        node,
                        report,
                    });
                }
            }
            Cob::Nmt => {
                let node = decoded.raw("node").and_then(|node| u8::try_from(node).ok());
                self.break_off(node.filter(|node| *node != 0));
            }
            Cob::Heartbeat(HEAD_NODE) if decoded.raw("state") == Some(0) => self.break_off(None),
            Cob::Heartbeat(node) if decoded.raw("state") == Some(0) => self.break_off(Some(node)),
            _ => {}
        }
    }

    /// Breaks off the process data of `node`, or of all.
    fn break_off(&mut self, node: Option<u8>) {
        for (key, entry) in &mut self.ids {
            let cob = u16::try_from(*key).ok().map(Cob::from_id);
            let is_concerned = match cob {
                Some(
                    Cob::Target(own)
                    | Cob::Moment(own)
                    | Cob::Pose(own)
                    | Cob::Effort(own)
                    | Cob::Heartbeat(own),
                ) => node.is_none_or(|node| node == own),
                Some(Cob::Sync) => node.is_none(),
                _ => false,
            };
            if is_concerned {
                entry.break_off();
            }
        }
    }

    /// Returns the period that the dictionary promises, in ns.
    fn expected_ns(&self, decoded: &Decoded<'_>) -> Option<u64> {
        let message = decoded.message?;
        Some(match (decoded.cob?, message.period_ms) {
            (_, 0) => return None,
            (Cob::Heartbeat(HEAD_NODE), _) => u64::from(HEAD_HEARTBEAT_MS) * 1_000_000,
            (Cob::Heartbeat(_), period_ms) => u64::from(period_ms) * 1_000_000,
            (_, period_ms) => {
                self.sync_period_ns * u64::from(period_ms) * 1_000 / u64::from(SYNC_PERIOD_US)
            }
        })
    }

    /// Returns the time from the first frame to the end of the last, in s.
    pub fn duration_s(&self) -> f64 {
        self.first_ns
            .map_or(0.0, |first| (self.end_ns - first) as f64 / 1e9)
    }

    /// Returns the share of time that the bus was busy, in percent.
    pub fn load_percent(&self) -> f64 {
        let duration = self.duration_s();
        if duration == 0.0 {
            return 0.0;
        }
        self.bits as f64 / f64::from(self.bitrate) / duration * 100.0
    }

    /// Returns the load of the busiest 100 ms, in percent; frames count where they begin.
    pub fn busiest_percent(&self) -> f64 {
        let capacity = f64::from(self.bitrate) * WINDOW_NS as f64 / 1e9;
        self.window.max as f64 / capacity * 100.0
    }

    /// Returns every identifier in the order of arbitration: its number, whether it has 29 bits,
    /// its message, what it adds up to.
    pub fn by_id(&self) -> Vec<(u32, bool, Option<&'static Message>, &PerId)> {
        let mut rows: Vec<_> = self
            .ids
            .iter()
            .map(|(key, entry)| {
                let is_extended = key & EXTENDED != 0;
                let message = match u16::try_from(*key) {
                    Ok(id) => Message::of(Cob::from_id(id)),
                    Err(_) => None,
                };
                (key & !EXTENDED, is_extended, message, entry)
            })
            .collect();
        rows.sort_by_key(|(id, is_extended, ..)| (*is_extended, *id));
        rows
    }

    /// Returns how much is wrong: bad, lost, repeated frames, gaps, fault emergencies, reports.
    pub fn problems(&self) -> u64 {
        let of_ids = |entry: &PerId| entry.bad + entry.lost + entry.repeated + entry.gaps;
        self.ids.values().map(of_ids).sum::<u64>() + self.faults + self.error_reports
    }
}

#[cfg(test)]
mod tests {
    use eel_protocol::{Frame, Mode, NodeId, Target};
    use eel_units::Angle;

    use super::*;

    fn received(time_us: u64, frame: Frame) -> Received {
        Received {
            time_ns: time_us * 1_000,
            content: Content::Frame(frame),
            direction: None,
        }
    }

    fn target(counter: u8) -> Frame {
        let zero = Angle::ZERO;
        let counter = Counter::new(counter).unwrap();
        let target = Target {
            yaw: zero,
            pitch: zero,
            roll: zero,
            mode: Mode::Run,
            counter,
        };
        target.to_frame(NodeId::new(3).unwrap()).unwrap()
    }

    #[test]
    fn load_is_bits_over_time() {
        let mut statistics = Statistics::new(1_000_000, 100.0);
        let sync = Frame::standard(0x80, &[1]).unwrap();
        for beat in 0..101 {
            statistics.add(&received(beat * 10_000, sync));
        }
        let bits = u64::from(frame_bits(&sync));
        assert_eq!(statistics.bits, 101 * bits);
        let duration = 1.0 + bits as f64 * 1e-6;
        assert!((statistics.duration_s() - duration).abs() < 1e-12);
        let load = 101.0 * bits as f64 / 1e6 / duration * 100.0;
        assert!((statistics.load_percent() - load).abs() < 1e-9);
        let busiest = 10.0 * bits as f64 / 1e5 * 100.0;
        assert!((statistics.busiest_percent() - busiest).abs() < 1e-9);
        assert_eq!(statistics.problems(), 0);
    }

    #[test]
    fn jitter_is_the_standard_deviation_of_the_periods() {
        let mut statistics = Statistics::new(1_000_000, 100.0);
        let sync = Frame::standard(0x80, &[1]).unwrap();
        for time_us in [0, 9_000, 20_000, 29_000, 40_000] {
            statistics.add(&received(time_us, sync));
        }
        let rows = statistics.by_id();
        let (_, _, _, entry) = rows[0];
        assert_eq!((entry.min_ns, entry.max_ns), (9_000_000, 11_000_000));
        assert_eq!(entry.mean_ns(), Some(10_000_000.0));
        assert_eq!(entry.jitter_ns(), Some(1_000_000.0));
    }

    #[test]
    fn counters_find_what_is_missing_and_what_comes_twice() {
        let mut statistics = Statistics::new(1_000_000, 100.0);
        for (beat, counter) in [12, 13, 14, 0, 3, 3, 4].into_iter().enumerate() {
            statistics.add(&received(beat as u64 * 10_000, target(counter)));
        }
        let rows = statistics.by_id();
        let (_, _, _, entry) = rows[0];
        assert_eq!(
            (entry.lost, entry.repeated, entry.gaps, entry.bad),
            (2, 1, 0, 0)
        );
        assert_eq!(statistics.problems(), 3);
    }

    #[test]
    fn a_gap_is_told_but_for_a_node_that_was_restarted() {
        let pause = |between: Option<Frame>| {
            let mut statistics = Statistics::new(1_000_000, 100.0);
            statistics.add(&received(0, target(1)));
            statistics.add(&received(10_000, target(2)));
            if let Some(frame) = between {
                statistics.add(&received(20_000, frame));
            }
            statistics.add(&received(500_000, target(9)));
            statistics.problems()
        };
        assert_eq!(pause(None), 1 + 6);
        assert_eq!(pause(Frame::standard(0x703, &[0])), 0);
        assert_eq!(pause(Frame::standard(0x704, &[0])), 7);
        assert_eq!(pause(Frame::standard(0x000, &[129, 0])), 0);
    }

    #[test]
    fn an_emergency_counts_when_it_is_a_fault() {
        let mut statistics = Statistics::new(1_000_000, 100.0);
        let emergency = |code: u16| {
            let [low, high] = code.to_le_bytes();
            Frame::standard(0x083, &[low, high, 1, 0, 0, 0, 0, 0]).unwrap()
        };
        for code in [0x0000, 0xFF20, 0x2310] {
            statistics.add(&received(0, emergency(code)));
        }
        assert_eq!((statistics.emergencies.len(), statistics.faults), (3, 1));
    }
}
