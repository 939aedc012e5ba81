//! Ten vertebrae and a head swim for a minute on a real interface, watched by can-utils, tshark and
//! cantools.
//!
//! The vertebrae and the head are processes of their own, so what is lost would be lost for real. What
//! is asserted is the order of frames, never a time.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use eel_head::Event;
use eel_protocol::{Cob, Frame, NodeId, PoseReport, SYNC_COUNTER_OVERFLOW, VERTEBRAE};
use serde_json::Value;

use crate::head::Head;
use crate::support::{Program, frames_of, interface, listeners, own_program, wait_for_listeners};

/// SYNCs at 100 Hz that a minute has.
const BEATS: usize = 6_000;
/// Bits a second of the bus.
const BITRATE: u32 = 1_000_000;

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// What was seen of a swim.
struct Seen {
    log: PathBuf,
    canbusload: String,
    live: Value,
    vertebrae: String,
    events: Vec<Event>,
}

/// Lets them swim and records it.
fn swim(interface: &str) -> Seen {
    let log = file("swim.log");
    let before = listeners();
    // Its own receive buffer, as the machine may be busy; -d tells of frames that didn't fit.
    let candump = Program::start_into(
        &["candump", "-L", "-d", "-r", "4000000", interface],
        File::create(&log).unwrap(),
    );
    wait_for_listeners(before, 1);
    let hil_sim = own_program("hil-sim");
    let vertebrae = Program::start(&[&hil_sim, "--can", interface]);
    wait_for_listeners(before, 3); // It has one for frames and one for errors.
    let head = Head::start(interface, (1 << VERTEBRAE) - 1);
    head.wait_until_it_swims();
    let canbusload = Program::start(&["canbusload", "-e", &format!("{interface}@{BITRATE}")]);
    let live = Program::start(&[
        &own_program("eel"),
        "stats",
        interface,
        "--json",
        "--seconds",
        "20",
    ]);
    let live = serde_json::from_str(&live.output()).unwrap();
    canbusload.interrupt();
    head.wait_for_beats(BEATS);
    let events = head.stop();
    vertebrae.interrupt();
    let vertebrae = vertebrae.output();
    candump.interrupt();
    candump.output();
    Seen {
        log,
        canbusload: canbusload.output(),
        live,
        vertebrae,
        events,
    }
}

/// The frames from the head's first SYNC after `from` to its last before `to`, between SYNCs.
fn beats(frames: &[Frame]) -> Vec<&[Frame]> {
    let is_sync = |frame: &Frame| frame.cob_id() == Some(Cob::Sync.id());
    let starts: Vec<usize> = (0..frames.len())
        .filter(|place| is_sync(&frames[*place]))
        .collect();
    starts
        .windows(2)
        .map(|pair| &frames[pair[0]..pair[1]])
        .collect()
}

#[test]
fn ten_vertebrae_answer_every_sync_of_a_minute() {
    let Some(name) = interface() else { return };
    let seen = swim(&name);
    let log = fs::read_to_string(&seen.log).unwrap();
    println!("{}", seen.vertebrae);
    println!("{}", seen.canbusload);
    println!("{}", seen.live);
    println!("{:?}", seen.events);
    assert!(!log.contains("DROPCOUNT"));
    let frames = frames_of(&log);
    let beats = beats(&frames);
    println!("{} frames, {} beats", frames.len(), beats.len());
    for node in 1..=VERTEBRAE {
        let mut poses = [0; 4];
        for beat in &beats {
            let n = beat
                .iter()
                .filter(|frame| frame.cob_id() == Some(Cob::Pose(node).id()))
                .count();
            poses[n.min(3)] += 1;
        }
        println!("{node}: {poses:?}");
    }
}
