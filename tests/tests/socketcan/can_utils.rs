//! eel-transport beside can-utils, which know nothing of it.

use std::process::Command;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use eel_protocol::{Frame, NodeId};
use eel_transport::candump::{Line, parse_frame, parse_line};
use eel_transport::{Bus, BusError, SocketBus, frame_bits, open};

use crate::nodes::Nodes;
use crate::python_canopen::check_nmt;
use crate::support::{PATIENCE, Program, interface, listeners, run, script, wait_for_listeners};

/// Frames of all kinds; remote frames ask for nothing, as canbusload counts data they don't have.
const FRAMES: [&str; 10] = [
    "000#",
    "080#07",
    "7FF#FFFFFFFFFFFFFFFF",
    "000#0000000000000000",
    "201#0011223344556677",
    "00000000#",
    "1FFFFFFF#0102030405",
    "12345678#00FF00FF00FF00FF",
    "701#R",
    "1ABCDEF0#R",
];

fn frames() -> Vec<Frame> {
    FRAMES
        .iter()
        .map(|text| parse_frame(text).unwrap())
        .collect()
}

#[test]
fn candump_shows_what_is_sent() {
    let Some(name) = interface() else { return };
    let before = listeners();
    let mut bus = SocketBus::open(&name).unwrap();
    let candump = Program::start(&["candump", "-L", "-n", "10", &name]);
    wait_for_listeners(before, 3); // Ours has one for frames and one for errors.
    for frame in frames() {
        bus.send(&frame).unwrap();
    }
    let text = candump.output();
    let seen: Vec<Frame> = text
        .lines()
        .map(|line| match parse_line(line.as_bytes()) {
            Ok(Line::Frame(record)) => {
                assert_eq!(record.interface, name);
                record.frame
            }
            other => panic!("{line}: {other:?}"),
        })
        .collect();
    assert_eq!(seen, frames());
}

#[test]
fn what_cansend_sends_is_received_with_the_time_of_the_kernel() {
    let Some(name) = interface() else { return };
    let mut bus = open(&name).unwrap();
    let now_ns = || {
        SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap()
            .as_nanos() as u64
    };
    for (text, frame) in FRAMES.iter().zip(frames()) {
        let start_ns = now_ns();
        let sent = Command::new("cansend")
            .args([&name, *text])
            .status()
            .unwrap();
        assert!(sent.success(), "cansend {name} {text}");
        let received = bus.receive(PATIENCE).unwrap().expect("a frame in time");
        assert_eq!(received.frame(), Some(&frame), "{text}");
        assert!((start_ns..=now_ns()).contains(&received.time_ns), "{text}");
    }
    assert_eq!(bus.receive(Duration::ZERO).unwrap(), None);
    assert_eq!(bus.receive(Duration::from_millis(1)).unwrap(), None);
}

#[test]
fn canbusload_counts_the_same_bits() {
    const ROUNDS: usize = 40;
    let Some(name) = interface() else { return };
    let mut bus = open(&name).unwrap();
    let before = listeners();
    let canbusload = Program::start(&["canbusload", "-e", &format!("{name}@1000000")]);
    wait_for_listeners(before, 1);
    for _ in 0..ROUNDS {
        for frame in frames() {
            bus.send(&frame).unwrap();
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    // It prints once a second what came in that second.
    std::thread::sleep(Duration::from_secs(3));
    canbusload.interrupt();
    let text = canbusload.output();
    let (mut counted, mut bits) = (0, 0);
    for line in text.lines().filter(|line| line.contains("@1000000 ")) {
        let numbers: Vec<u64> = line
            .split_whitespace()
            .skip(1)
            .filter_map(|word| word.parse().ok())
            .collect();
        counted += numbers[0];
        bits += numbers[1];
    }
    let expected: u64 = frames()
        .iter()
        .map(|frame| u64::from(frame_bits(frame)))
        .sum();
    assert_eq!(counted, (ROUNDS * FRAMES.len()) as u64, "{text}");
    assert_eq!(bits, expected * ROUNDS as u64, "{text}");
}

#[test]
fn a_missing_interface_is_told_from_a_missing_kernel_module() {
    let Some(_) = interface() else { return };
    assert!(matches!(open("vcan87"), Err(BusError::NoInterface { name }) if name == "vcan87"));
}

/// Random frames of every kind as fast as they go, among them commands, SDO requests and SYNCs.
#[test]
fn vertebrae_live_through_a_storm_of_random_frames() {
    const FRAMES: u64 = 20_000;
    let Some(name) = interface() else { return };
    let chosen = [3, 5].map(|id| NodeId::new(id).unwrap());
    let nodes = Nodes::start(&name, chosen.to_vec());
    let count = FRAMES.to_string();
    for kind in [&[][..], &["-e"], &["-R"]] {
        // -p waits where the queue is full.
        let words = ["cangen", &name, "-g", "0", "-p", "10", "-n", &count];
        run(&[&words, kind].concat());
    }
    // Whatever they were told, a reset makes them what they were. Who answers has been reset, as what
    // comes first is served first.
    let mut bus = open(&name).unwrap();
    run(&["cansend", &name, "000#8100"]);
    for id in ["3", "5"] {
        run(&["cansend", &name, &format!("60{id}#4000100000000000")]);
    }
    let mut missing = vec![0x583, 0x585];
    while !missing.is_empty() {
        let received = bus.receive(PATIENCE).unwrap().expect("an answer");
        let id = received.frame().and_then(Frame::cob_id);
        missing.retain(|wanted| Some(*wanted) != id);
    }
    check_nmt(&script("nmt.py", &[&name]));
    let counters = nodes.end();
    assert_eq!(counters.dropped, 0);
    println!("{counters:?}");
}
