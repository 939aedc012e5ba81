//! The head in real time on a bus.

use std::collections::VecDeque;
use std::fmt;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};
use eel_client::NmtCommand;
use eel_head::{Config, Event, Head, Phase};
use eel_protocol::emergency::{self, Severity};
use eel_protocol::{Cob, Frame, NodeId};
use eel_transport::{Bus, BusError, Received};
use serde_json::json;

use super::bus::AnyBus;
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
    /// Whether stops that were latched before the head came are acknowledged.
    pub resets_first: bool,
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
            resets_first: false,
            has_reset: 0,
        }
    }

    /// Leads until `limit` or Ctrl-C and stops in order; a second Ctrl-C ends it at once.
    ///
    /// # Errors
    /// What the bus fails with.
    pub fn run(&mut self, limit: Option<Duration>) -> Result<Outcome> {
        source::catch_interrupt()?;
        self.start = Instant::now();
        let result = self.lead(limit);
        self.status.clear();
        if result.is_err() {
            // Perhaps it still gets through; if not, vertebrae let go as the head is silent.
            let _ = self.stop_all();
        }
        result?;
        self.outcome.elapsed = self.start.elapsed();
        Ok(self.outcome)
    }

    fn lead(&mut self, limit: Option<Duration>) -> Result<()> {
        let mut next = self.start;
        loop {
            self.receive()?;
            let elapsed = self.start.elapsed();
            let now = eel_units::Instant::from_micros(elapsed.as_micros() as u64);
            match source::interrupts() {
                0 if limit.is_none_or(|limit| elapsed < limit) => {}
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
            self.events(elapsed)?;
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
            }
        }
        Ok(())
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
    fn events(&mut self, elapsed: Duration) -> Result<()> {
        let mut lines: Vec<(String, Vec<u8>)> = Vec::new();
        while let Some(event) = self.head.poll_event() {
            let acknowledged = self.acknowledge(&event, elapsed);
            self.outcome.troubles += u64::from(is_trouble(&event) && !acknowledged);
            if self.is_json {
                writeln!(stdout(), "{}", json_of(&event, elapsed))?;
                continue;
            }
            let (node, text) = words(&event, acknowledged);
            match lines.iter_mut().find(|(other, _)| *other == text) {
                Some((_, nodes)) => nodes.extend(node.filter(|node| !nodes.contains(node))),
                None => lines.push((text, node.into_iter().collect())),
            }
        }
        if lines.is_empty() {
            return Ok(());
        }
        self.status.clear();
        let mut out = stdout().lock();
        for (text, nodes) in lines {
            let who = Who(&nodes).to_string();
            writeln!(out, "{:9.3}  {who:<16}  {text}", elapsed.as_secs_f64())?;
        }
        Ok(out.flush()?)
    }
}

/// Vertebrae as a list, `vertebrae 1-3, 7`; the head for none.
struct Who<'a>(&'a [u8]);

impl fmt::Display for Who<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            [] => return write!(out, "head"),
            [one] => return write!(out, "vertebra {one}"),
            _ => write!(out, "vertebrae")?,
        }
        let mut rest = self.0;
        let mut lead = ' ';
        while let [first, others @ ..] = rest {
            let follows = (1..)
                .zip(others)
                .take_while(|(step, node)| **node == first + step);
            let run = follows.count();
            write!(out, "{lead}{first}")?;
            if run > 0 {
                write!(out, "-{}", first + run as u8)?;
            }
            lead = ',';
            rest = others.get(run..).unwrap_or(&[]);
        }
        Ok(())
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
            eprintln!("eel: nobody is on the bus yet; the head goes on and starts whoever comes");
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
        // What can't be shown is no reason to end.
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

fn is_trouble(event: &Event) -> bool {
    match event {
        Event::Lost(_) | Event::Latched(..) | Event::NotStopped(_) => true,
        Event::Emergency(_, report) => {
            emergency::from_code(report.code).is_none_or(|known| known.severity == Severity::Fault)
        }
        Event::Booted(_) | Event::Running(_) | Event::GaitStarted | Event::Stopped => false,
    }
}

/// Returns whose event it is, and the event in words.
fn words(event: &Event, acknowledged: bool) -> (Option<u8>, String) {
    let (node, text) = match event {
        Event::Booted(node) => (node, "on the bus".to_owned()),
        Event::Running(node) => (node, "follows the gait".to_owned()),
        Event::Lost(node) => (node, "fell silent: check its supply and cable".to_owned()),
        Event::Latched(node, state) if acknowledged => (
            node,
            format!("was latched ({}), acknowledged", state.name()),
        ),
        Event::Latched(node, state) => (
            node,
            format!(
                "latched ({}): find the cause, then start the head with --reset",
                state.name()
            ),
        ),
        Event::Emergency(node, report) => {
            let text = match emergency::from_code(report.code) {
                Some(known) if known.severity == Severity::Cleared => {
                    format!("{}: {}", known.name, known.sentence)
                }
                Some(known) => format!(
                    "{} {}: {}",
                    known.severity.name(),
                    known.name,
                    known.sentence
                ),
                None => format!("emergency 0x{:04X}", report.code),
            };
            (node, text)
        }
        Event::GaitStarted => return (None, "the gait begins".to_owned()),
        Event::Stopped => return (None, "all drives are off".to_owned()),
        Event::NotStopped(node) => (node, "was told to switch off and still drives".to_owned()),
    };
    (Some(node.get()), text)
}

fn json_of(event: &Event, elapsed: Duration) -> serde_json::Value {
    let mut all = json!({"time_s": elapsed.as_secs_f64()});
    let (name, node) = match event {
        Event::Booted(node) => ("booted", Some(node)),
        Event::Running(node) => ("running", Some(node)),
        Event::Lost(node) => ("lost", Some(node)),
        Event::Latched(node, state) => {
            all["state"] = json!(state.name());
            ("latched", Some(node))
        }
        Event::Emergency(node, report) => {
            all["code"] = json!(report.code);
            if let Some(known) = emergency::from_code(report.code) {
                all["name"] = json!(known.name);
                all["severity"] = json!(known.severity.name());
                all["sentence"] = json!(known.sentence);
            }
            ("emergency", Some(node))
        }
        Event::GaitStarted => ("gait-started", None),
        Event::Stopped => ("stopped", None),
        Event::NotStopped(node) => ("not-stopped", Some(node)),
    };
    all["event"] = json!(name);
    if let Some(node) = node {
        all["node"] = json!(node.get());
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertebrae_are_listed_in_runs() {
        let who = |nodes: &[u8]| Who(nodes).to_string();
        assert_eq!(who(&[]), "head");
        assert_eq!(who(&[3]), "vertebra 3");
        assert_eq!(who(&[1, 2, 3, 7, 9, 10]), "vertebrae 1-3,7,9-10");
        assert_eq!(who(&[2, 1]), "vertebrae 2,1");
    }
}
