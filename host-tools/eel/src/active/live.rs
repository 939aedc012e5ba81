//! The head in real time on a bus.

use std::collections::VecDeque;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};
use eel_client::{NmtCommand, abort};
use eel_head::{Config, Event, Head, Phase};
use eel_protocol::{Cob, Frame, Moment, NodeId};
use eel_transport::{Bus, BusError, Received};
use serde_json::json;

use super::bus::AnyBus;
use super::events::{Who, is_trouble, json_of, words};
use crate::source;

/// Time between two calls of the head.
const TICK: Duration = Duration::from_millis(1);
/// Frames that are taken from the bus between two calls.
const RECEIVED_PER_TICK: usize = 512;
/// Frames that wait to be sent while the bus takes none: more than those of that time.
const WAITING: usize = 2_048;
/// How long the bus may take no frame before the head gives up.
const STUCK: Duration = Duration::from_millis(500);
/// Time between two status lines.
const SHOWN: Duration = Duration::from_millis(500);
/// After which time without a vertebra this is told.
const ALONE: Duration = Duration::from_secs(3);
/// Until when a latched stop counts as one from before the head came.
const BEFORE: Duration = Duration::from_secs(3);

/// A head on a bus.
pub struct Live {
    bus: AnyBus,
    head: Head,
    start: Instant,
    waiting: VecDeque<Frame>,
    stuck_since: Option<Instant>,
    is_json: bool,
    status: Status,
    outcome: Outcome,
    last_sync: Option<Instant>,
    sync_period: Duration,
    /// Why nothing more can be told.
    mute: Option<std::io::Error>,
    /// Whether stops that were latched before the head came are acknowledged.
    pub resets_first: bool,
    /// What a vertebra is sent when it begins its task.
    pub greetings: Vec<(NodeId, Frame)>,
    has_reset: u16,
}

/// How it went.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outcome {
    /// From the first to the last frame.
    pub elapsed: Duration,
    /// SYNCs sent.
    pub syncs: u64,
    /// All frames sent.
    pub sent: u64,
    /// Frames received.
    pub received: u64,
    /// Vertebrae that followed the gait at one time, at most.
    pub most_running: usize,
    /// How much longer than its period the time between two SYNCs was, at most.
    pub latest: Duration,
    /// Whether it was ended without the order of a stop.
    pub at_once: bool,
    /// Vertebrae lost, latched or not stopped, and emergencies that are faults.
    pub troubles: u64,
}

impl Outcome {
    /// Returns how it went, for programs.
    pub fn json(&self) -> serde_json::Value {
        json!({
            "seconds": self.elapsed.as_secs_f64(), "sync_sent": self.syncs,
            "frames_sent": self.sent, "frames_received": self.received,
            "running": self.most_running, "late_max_ms": self.latest.as_secs_f64() * 1e3,
            "stopped": if self.at_once { "at-once" } else { "in-order" },
        })
    }

    /// Tells whether vertebrae swam and stopped in order.
    pub const fn is_fine(&self) -> bool {
        self.troubles == 0 && !self.at_once && self.most_running > 0
    }
}

/// One line that is written over, where somebody looks.
struct Status {
    is_on: bool,
    due: Duration,
    has_told_alone: bool,
}

impl Live {
    /// Makes a head that begins at once.
    pub fn new(bus: AnyBus, config: Config, is_json: bool) -> Self {
        Self {
            bus,
            head: Head::new(config, eel_units::Instant::ZERO),
            start: Instant::now(),
            waiting: VecDeque::new(),
            stuck_since: None,
            is_json,
            status: Status {
                is_on: stderr().is_terminal() && !is_json,
                due: SHOWN,
                has_told_alone: false,
            },
            outcome: Outcome::default(),
            last_sync: None,
            sync_period: Duration::from_micros(u64::from(config.sync_period.to_micros())),
            mute: None,
            resets_first: false,
            greetings: Vec::new(),
            has_reset: 0,
        }
    }

    /// Leads until `limit` or Ctrl-C and stops in order, also where nobody reads what it tells any more; a
    /// second Ctrl-C ends it at once. Ctrl-C must be [caught](source::catch_interrupt) already.
    ///
    /// # Errors
    /// What the bus fails with, and after a stop in order what the output failed with.
    pub fn run(&mut self, limit: Option<Duration>) -> Result<Outcome> {
        self.start = Instant::now();
        let result = self.lead(limit);
        self.status.clear();
        if result.is_err() {
            // Perhaps it still gets through; if not, vertebrae let go as the head is silent.
            let _ = self.stop_all();
        }
        result?;
        if let Some(error) = self.mute.take() {
            return Err(error.into());
        }
        self.outcome.elapsed = self.start.elapsed();
        Ok(self.outcome)
    }

    /// Sets what RPDO2 tells a vertebra with every target.
    pub fn set_moment(&mut self, id: NodeId, moment: Option<Moment>) {
        self.head.set_moment(id, moment);
    }

    /// Gives the bus back.
    pub fn into_bus(self) -> AnyBus {
        self.bus
    }

    fn lead(&mut self, limit: Option<Duration>) -> Result<()> {
        let mut next = self.start;
        loop {
            self.receive()?;
            let elapsed = self.start.elapsed();
            let now = eel_units::Instant::from_micros(elapsed.as_micros() as u64);
            let is_over = self.mute.is_some() || limit.is_some_and(|limit| elapsed >= limit);
            match source::interrupts() {
                0 if !is_over => {}
                0 | 1 => self.head.stop(now),
                _ => {
                    self.outcome.at_once = true;
                    return self.stop_all();
                }
            }
            self.head.tick(now);
            while let Some(frame) = self.head.poll_transmit() {
                self.waiting.push_back(frame);
            }
            self.send()?;
            self.events(elapsed);
            self.outcome.most_running = self.outcome.most_running.max(self.head.running());
            if self.head.phase() == Phase::Stopped && self.waiting.is_empty() {
                return Ok(());
            }
            self.status.show(elapsed, &self.head, &self.outcome);
            next += TICK;
            let late = Instant::now();
            if next > late {
                std::thread::sleep(next - late);
            } else {
                // What was missed is not made up for: the head asks for the time itself.
                next = late;
            }
        }
    }

    fn receive(&mut self) -> Result<()> {
        for _ in 0..RECEIVED_PER_TICK {
            let received = self
                .bus
                .receive(Duration::ZERO)
                .map_err(|error| told(&error))?;
            let Some(received) = received else { break };
            if let Some(frame) = Received::frame(&received) {
                self.outcome.received += 1;
                let elapsed = self.start.elapsed().as_micros() as u64;
                let now = eel_units::Instant::from_micros(elapsed);
                self.head.handle_frame(now, frame);
                let frame = *frame;
                self.hear_refusal(&frame);
            }
        }
        Ok(())
    }

    /// Tells where a vertebra refuses what it was sent when it began its task.
    fn hear_refusal(&mut self, frame: &Frame) {
        let Some(Cob::SdoResponse(node)) = frame.cob_id().map(Cob::from_id) else {
            return;
        };
        let was_sent = self.greetings.iter().any(|(to, _)| to.get() == node);
        if let [0x80, _, _, _, code @ ..] = frame.data()
            && let Ok(code) = code.try_into()
            && was_sent
        {
            let code = abort(u32::from_le_bytes(code));
            self.outcome.troubles += 1;
            let elapsed = self.start.elapsed().as_secs_f64();
            if self.is_json {
                let all = json!({
                    "time_s": elapsed, "event": "refused", "node": node, "code": code.code
                });
                self.tell(format_args!("{all}"));
            } else {
                self.tell(format_args!(
                    "{elapsed:9.3}  vertebra {node:<7}  refuses: {}: {}",
                    code.meaning, code.cure
                ));
            }
        }
    }

    /// Sends what waits; what the bus does not take waits on.
    fn send(&mut self) -> Result<()> {
        while let Some(frame) = self.waiting.front() {
            match self.bus.send(frame) {
                Ok(()) => {}
                Err(BusError::Full) => {
                    let since = *self.stuck_since.get_or_insert_with(Instant::now);
                    if since.elapsed() > STUCK || self.waiting.len() > WAITING {
                        return Err(told(&BusError::Full));
                    }
                    return Ok(());
                }
                Err(error) => return Err(told(&error)),
            }
            self.stuck_since = None;
            self.outcome.sent += 1;
            if frame.cob_id() == Some(Cob::Sync.id()) {
                self.outcome.syncs += 1;
                let now = Instant::now();
                if let Some(last) = self.last_sync.replace(now) {
                    let late = (now - last).saturating_sub(self.sync_period);
                    self.outcome.latest = self.outcome.latest.max(late);
                }
            }
            self.waiting.pop_front();
        }
        Ok(())
    }

    /// Takes all nodes out of operation at once.
    fn stop_all(&mut self) -> Result<()> {
        let data = [NmtCommand::Stop as u8, 0];
        let Some(frame) = Frame::standard(Cob::Nmt.id(), &data) else {
            return Ok(());
        };
        let begin = Instant::now();
        loop {
            match self.bus.send(&frame) {
                Err(BusError::Full) if begin.elapsed() < STUCK => std::thread::sleep(TICK),
                sent => return sent.map_err(|error| told(&error)),
            }
        }
    }

    /// Acknowledges a stop that was latched before the head came, where that is wanted, once for
    /// each vertebra; tells whether it did.
    fn acknowledge(&mut self, event: &Event, elapsed: Duration) -> bool {
        let Event::Latched(node, _) = event else {
            return false;
        };
        let bit = 1 << node.index();
        let is_due = self.resets_first && elapsed < BEFORE && self.has_reset & bit == 0;
        if is_due {
            self.has_reset |= bit;
            self.head.reset();
        }
        is_due
    }

    /// Tells what happened; what happened to several vertebrae at once is one line.
    fn events(&mut self, elapsed: Duration) {
        let mut lines: Vec<(String, Vec<u8>)> = Vec::new();
        while let Some(event) = self.head.poll_event() {
            let acknowledged = self.acknowledge(&event, elapsed);
            if let Event::Running(node) = &event {
                let greetings = self.greetings.iter().filter(|(to, _)| to == node);
                self.waiting.extend(greetings.map(|(_, frame)| *frame));
            }
            self.outcome.troubles += u64::from(is_trouble(&event) && !acknowledged);
            if self.is_json {
                self.tell(format_args!("{}", json_of(&event, elapsed)));
                continue;
            }
            let (node, text) = words(&event, acknowledged);
            match lines.iter_mut().find(|(other, _)| *other == text) {
                Some((_, nodes)) => nodes.extend(node.filter(|node| !nodes.contains(node))),
                None => lines.push((text, node.into_iter().collect())),
            }
        }
        if !lines.is_empty() {
            self.status.clear();
        }
        for (text, nodes) in lines {
            let (who, time) = (Who(&nodes).to_string(), elapsed.as_secs_f64());
            self.tell(format_args!("{time:9.3}  {who:<16}  {text}"));
        }
    }

    /// Writes a line. An output that fails must not let go of a robot that moves: it only ends the run.
    fn tell(&mut self, line: std::fmt::Arguments<'_>) {
        if self.mute.is_none() {
            self.mute = writeln!(stdout(), "{line}").err();
        }
    }
}

fn told(error: &BusError) -> anyhow::Error {
    // The message of a bus error holds its cause already.
    anyhow!(error.to_string())
}

impl Status {
    fn show(&mut self, elapsed: Duration, head: &Head, outcome: &Outcome) {
        if !self.has_told_alone && elapsed > ALONE && outcome.received == 0 {
            self.has_told_alone = true;
            // What can't be shown is no reason to end.
            let _ = writeln!(
                stderr(),
                "eel: nobody is on the bus yet; the head goes on and starts whoever comes"
            );
        }
        if !self.is_on || elapsed < self.due {
            return;
        }
        self.due = elapsed + SHOWN;
        let phase = match head.phase() {
            Phase::Starting => "starting",
            Phase::Swimming => "swimming",
            Phase::Straightening => "straightening",
            Phase::SwitchingOff => "switching off",
            Phase::Stopped => "stopped",
        };
        let there = NodeId::all()
            .filter_map(|id| head.node(id))
            .filter(|node| node.stage != eel_head::Stage::Missing)
            .count();
        let _ = write!(
            stderr(),
            "\r{:7.1} s  {phase}, {} of {there} vertebrae run, {} SYNCs, late by {:.1} ms at most, \
             Ctrl-C stops\x1b[K",
            elapsed.as_secs_f64(),
            head.running(),
            outcome.syncs,
            outcome.latest.as_secs_f64() * 1e3,
        );
    }

    fn clear(&self) {
        if self.is_on {
            let _ = write!(stderr(), "\r\x1b[K");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use eel_head::Gait;

    use super::*;

    /// A bus that takes two frames of three, or none at all.
    struct Narrow {
        taken: Arc<Mutex<Vec<Frame>>>,
        offered: u32,
        is_stuck: bool,
    }

    impl Bus for Narrow {
        fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
            self.offered += 1;
            if self.is_stuck || self.offered.is_multiple_of(3) {
                return Err(BusError::Full);
            }
            self.taken.lock().unwrap().push(*frame);
            Ok(())
        }

        fn receive(&mut self, _: Duration) -> Result<Option<Received>, BusError> {
            Ok(None)
        }
    }

    fn live(is_stuck: bool) -> (Live, Arc<Mutex<Vec<Frame>>>) {
        let taken = Arc::default();
        let narrow = Narrow {
            taken: Arc::clone(&taken),
            offered: 0,
            is_stuck,
        };
        let config = Config::new(Gait::SWIM);
        (Live::new(Box::new(narrow), config, true), taken)
    }

    #[test]
    fn no_frame_is_lost_while_the_queue_is_full_and_the_end_is_in_order() {
        let (mut live, taken) = live(false);
        let outcome = live.run(Some(Duration::from_millis(100))).unwrap();
        let taken = taken.lock().unwrap();
        assert_eq!(outcome.sent, taken.len() as u64);
        let syncs = taken.iter().filter(|frame| frame.cob_id() == Some(0x080));
        let counters: Vec<u8> = syncs.map(|frame| frame.data()[0]).collect();
        assert!(counters.len() > 50 && counters[0] == 1, "{counters:?}");
        assert!(counters.windows(2).all(|pair| pair[1] == pair[0] % 240 + 1));
        let end = Frame::standard(0x000, &[0x80, 0]).unwrap();
        assert!(taken.iter().rev().take(4).any(|frame| *frame == end));
        // Nobody swam: that is no success.
        assert!(!outcome.at_once && !outcome.is_fine());
    }

    #[test]
    fn a_bus_that_takes_nothing_ends_the_head_with_the_reason() {
        let (mut live, _) = live(true);
        let error = live.run(None).unwrap_err();
        assert!(
            error.to_string().contains("no other node acknowledges"),
            "{error}"
        );
    }
}
