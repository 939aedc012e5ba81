//! Ten vertebrae and a head swim for a minute on a real interface, watched by can-utils, and what was
//! seen is read by tshark and cantools.
//!
//! Vertebrae and head take turns, a millisecond of theirs after the other and never faster than the
//! clock, but all their frames go through the kernel, from one socket to the other. So a slow host makes
//! the swim longer and changes nothing else, and every answer must come before the next SYNC.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration as HostDuration, Instant as HostInstant};

use eel_head::{Config, Event, Gait, Head, Phase};
use eel_protocol::{Cob, Counter, Frame, NodeId, PoseReport, SYNC_COUNTER_OVERFLOW, VERTEBRAE};
use eel_transport::{Bus, SocketBus, frame_bits};
use eel_units::Instant;
use hil_sim::plant::Config as Plant;
use hil_sim::realtime::{Counters, Realtime};
use serde_json::Value;

use crate::dissect::dissect;
use crate::support::{Program, Recording, frames_of, interface, listeners, own_program};
use crate::support::{python, root, run, wait_for_listeners};

/// SYNCs at 100 Hz that a minute has.
const BEATS: usize = 6_000;
/// Frames that cantools decodes, some ten seconds of them; it takes its time.
const DECODED: usize = 30_000;
const MILLISECOND: HostDuration = HostDuration::from_millis(1);

/// Vertebrae and head, each with a socket of its own.
struct Swim {
    vertebrae: Realtime<SocketBus>,
    bus: SocketBus,
    head: Head,
    /// Milliseconds since the start.
    now: u64,
    syncs: usize,
    events: Vec<Event>,
}

impl Swim {
    fn new(interface: &str) -> Self {
        let open = || SocketBus::open(interface).unwrap();
        Self {
            vertebrae: Realtime::new(open(), &Plant::default(), 1),
            bus: open(),
            head: Head::new(Config::new(Gait::SWIM), Instant::from_micros(0)),
            now: 0,
            syncs: 0,
            events: Vec::new(),
        }
    }

    /// Swims for a minute, stops in order, and returns what happened.
    fn run(mut self) -> (Counters, Vec<Event>) {
        let mut due = HostInstant::now();
        while self.head.phase() != Phase::Stopped {
            self.turn();
            if self.syncs == BEATS {
                self.head.stop(self.time());
            }
            // A host that is late goes on from here.
            due = (due + MILLISECOND).max(HostInstant::now() - MILLISECOND);
            thread::sleep(due.saturating_duration_since(HostInstant::now()));
        }
        assert_eq!(self.head.dropped(), 0);
        (self.vertebrae.counters(), self.events)
    }

    fn time(&self) -> Instant {
        Instant::from_micros(self.now * 1_000)
    }

    fn turn(&mut self) {
        self.vertebrae.tick().unwrap();
        let time = self.time();
        while let Some(received) = self.bus.receive(HostDuration::ZERO).unwrap() {
            self.head.handle_frame(time, received.frame().unwrap());
        }
        self.head.tick(time);
        while let Some(frame) = self.head.poll_transmit() {
            self.bus.send(&frame).unwrap();
            self.syncs += usize::from(frame.cob_id() == Some(Cob::Sync.id()));
        }
        while let Some(event) = self.head.poll_event() {
            self.events.push(event);
        }
        self.now += 1;
    }
}

/// What others saw of the swim.
struct Seen {
    file: PathBuf,
    log: String,
    canbusload: String,
    eel: Value,
}

/// Swims while can-utils and `eel` watch.
fn swim(interface: &str) -> (Counters, Vec<Event>, Seen) {
    let recording = Recording::start(interface, "swim");
    let before = listeners();
    let canbusload = Program::start(&["canbusload", "-e", &format!("{interface}@1000000")]);
    let eel = Program::start(&[&own_program("eel"), "stats", interface, "--json"]);
    wait_for_listeners(before, 3); // `eel` has one for frames and one for errors.
    let (counters, events) = Swim::new(interface).run();
    // It prints once a second what came in that second.
    thread::sleep(HostDuration::from_secs(3));
    canbusload.interrupt();
    eel.interrupt();
    let eel = serde_json::from_str(&eel.output()).unwrap();
    let canbusload = canbusload.output();
    let (file, log) = recording.end();
    let seen = Seen {
        file,
        log,
        canbusload,
        eel,
    };
    (counters, events, seen)
}

#[test]
fn ten_vertebrae_answer_every_sync_of_a_minute() {
    let Some(name) = interface() else { return };
    let (counters, events, seen) = swim(&name);
    println!("{counters:?}");
    let frames = frames_of(&seen.log);
    check_events(&events);
    check_beats(&frames);
    assert_eq!(counters.dropped, 0);
    check_load(&frames, &seen);
    dissect(&seen.file, &frames);
    check_values(&seen.file);
}

/// All ten run, nothing goes wrong, and all are off at the end.
fn check_events(events: &[Event]) {
    let count =
        |wanted: &dyn Fn(&Event) -> bool| events.iter().filter(|event| wanted(event)).count();
    let all = usize::from(VERTEBRAE);
    assert_eq!(count(&|event| matches!(event, Event::Booted(_))), all);
    assert_eq!(count(&|event| matches!(event, Event::Running(_))), all);
    assert_eq!(count(&|event| *event == Event::GaitStarted), 1);
    assert_eq!(events.last(), Some(&Event::Stopped));
    assert_eq!(events.len(), 2 * all + 2, "{events:?}");
}

/// Between one SYNC and the next, each vertebra that was operational reports its pose once, with the
/// next counter, and every second time its torques; nothing else is on the bus than there must be.
fn check_beats(frames: &[Frame]) {
    let is = |frame: &Frame, cob: Cob| frame.cob_id() == Some(cob.id());
    let starts: Vec<usize> = (0..frames.len())
        .filter(|place| is(&frames[*place], Cob::Sync))
        .collect();
    let starts_of_nodes = frames
        .iter()
        .rposition(|frame| is(frame, Cob::Nmt) && frame.data()[0] == 1)
        .unwrap();
    let end = frames
        .iter()
        .rposition(|frame| is(frame, Cob::Nmt))
        .unwrap();
    assert_eq!(frames[end].data(), [128, 0], "pre-operational at the end");
    let mut counters = [None::<Counter>; VERTEBRAE as usize];
    let (mut beats, mut efforts) = (0_usize, 0_usize);
    for pair in starts.windows(2) {
        let (first, last) = (pair[0], pair[1]);
        let count = |place: usize| frames[place].data()[0];
        assert_eq!(count(last), count(first) % SYNC_COUNTER_OVERFLOW + 1);
        if first < starts_of_nodes || last > end {
            continue;
        }
        beats += 1;
        for node in NodeId::all() {
            let of = |cob: Cob| {
                frames[first..last]
                    .iter()
                    .filter(move |frame| is(frame, cob))
            };
            let poses: Vec<_> = of(Cob::Pose(node.get())).collect();
            assert_eq!(poses.len(), 1, "node {node:?}, frame {first}");
            let (_, report) = PoseReport::from_frame(poses[0]).unwrap();
            let counter = &mut counters[node.index()];
            assert!(counter.is_none_or(|before| before.next() == report.counter));
            *counter = Some(report.counter);
            efforts += of(Cob::Effort(node.get())).count();
        }
    }
    let all = usize::from(VERTEBRAE);
    assert!(beats > BEATS, "{beats}");
    assert!(efforts.abs_diff(beats * all / 2) <= all, "{efforts}");
    println!("{} frames, {beats} beats", frames.len());
}

/// cantools finds the same values in ten seconds of the recording as `eel decode`.
fn check_values(file: &Path) {
    let part = file.with_file_name("part.log");
    let log = fs::read_to_string(file).unwrap();
    let lines: Vec<&str> = log.lines().collect();
    let places = lines.len() / 2..lines.len() / 2 + DECODED;
    fs::write(&part, lines[places].join("\n") + "\n").unwrap();
    let decoded = part.with_extension("jsonl");
    let words = [&own_program("eel"), "decode", text(&part), "--json"];
    fs::write(&decoded, run(&words)).unwrap();
    let dbc = "docs/generated/vertebra.dbc";
    let script = root().join("tests/python/decode_dbc.py");
    let report = python(&script, &[dbc, text(&part), text(&decoded)]);
    assert!(
        report.starts_with(&format!("{DECODED} frames agree")),
        "{report}"
    );
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// canbusload, `eel` and the recording count the same frames and bits, and agree on the load, which is
/// below the worst case of stuff bits.
fn check_load(frames: &[Frame], seen: &Seen) {
    let seconds: Vec<(u64, u64)> = seen
        .canbusload
        .lines()
        .filter(|line| line.contains("@1000000 "))
        .filter_map(|line| {
            let mut numbers = line.split_whitespace().skip(1).map(str::parse);
            Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
        })
        .filter(|(count, _)| *count > 0)
        .collect();
    let bits: u64 = frames
        .iter()
        .map(|frame| u64::from(frame_bits(frame)))
        .sum();
    let sum = |part: fn(&(u64, u64)) -> u64| seconds.iter().map(part).sum::<u64>();
    assert_eq!(
        (sum(|it| it.0), sum(|it| it.1)),
        (frames.len() as u64, bits)
    );
    assert_eq!(seen.eel["dropped"], 0);
    assert_eq!(seen.eel["frames"], frames.len());
    assert_eq!(seen.eel["bits"], bits);
    // Its first and its last second are not whole ones of the swim.
    let whole = &seconds[1..seconds.len() - 1];
    let theirs = whole.iter().map(|it| it.1).sum::<u64>() as f64 / whole.len() as f64 / 1e4;
    let ours = seen.eel["load_percent"].as_f64().unwrap();
    println!("load {ours:.2} % by eel, {theirs:.2} % by canbusload");
    assert!((ours - theirs).abs() < 1.0, "{ours} {theirs}");
    assert!(ours < 35.0, "{ours}");
}
