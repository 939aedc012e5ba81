//! The robot is the same robot where some or all of its vertebrae are Cortex-M4 images in QEMU.

use std::fs;
use std::path::{Path, PathBuf};

use eel_head::Gait;
use eel_protocol::NodeId;
use hil_sim::robot::{Fault, FaultKind};
use hil_sim::swim::{Emulated, Options, Summary, run};

use super::find_tools;

/// A run that starts, swims, loses a vertebra's microcontroller for a moment, and stops.
fn options(name: &str, image: &Path, nodes: Vec<NodeId>) -> Options {
    let reset = Fault {
        at_ns: 2_500_000_000,
        kind: FaultKind::NodeReset(id(4)),
    };
    Options {
        seconds: 3.5,
        gait: Gait::SWIM,
        frequency_hz: 1.0,
        amplitude: 0.08,
        wavelength: 0.8,
        seed: 7,
        out: Some(folder(name)),
        faults: vec![reset],
        emulated: Some(Emulated {
            nodes,
            image: image.to_owned(),
        }),
        progress: false,
    }
}

fn id(node: u8) -> NodeId {
    NodeId::new(node).expect("one of ten")
}

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("qemu-swim")
        .join(name)
}

/// Swims and returns what came of it and the frame log.
fn swim(name: &str, image: &Path, nodes: Vec<NodeId>) -> (Summary, Vec<u8>) {
    let summary = run(&options(name, image, nodes)).expect("a run");
    println!("{name}: {:.1} x real time", summary.real_time_factor);
    let log = fs::read(folder(name).join("bus.log")).expect("a log");
    (summary, log)
}

#[test]
fn one_or_ten_vertebrae_in_qemu_give_the_frame_log_of_ten_native_ones() {
    let Some((_, image)) = find_tools() else {
        return;
    };
    let (native, expected) = swim("native", &image, Vec::new());
    assert_eq!(native.boots, 11, "ten, and one that was reset");
    assert!(expected.len() > 100_000, "the run is too tame");
    let one = swim("one", &image, vec![id(4)]);
    let ten = swim("ten", &image, NodeId::all().collect());
    for (name, (summary, log)) in [("one", one), ("ten", ten)] {
        let lines = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let (found, wanted) = (lines(&log), lines(&expected));
        let differing = found.lines().zip(wanted.lines()).find(|(a, b)| a != b);
        assert_eq!(differing, None, "{name} in QEMU");
        assert_eq!(
            log, expected,
            "{name} in QEMU: the log is longer or shorter"
        );
        assert_eq!(summary.frame_log_sha256, native.frame_log_sha256);
        assert_eq!(summary.nodes_operational, native.nodes_operational);
    }
}

#[test]
fn an_image_that_is_none_ends_the_run_and_is_named() {
    let Some(_) = find_tools() else {
        return;
    };
    fs::create_dir_all(folder("broken")).expect("a folder");
    let image = folder("broken").join("image.elf");
    fs::write(&image, "no image").expect("a file");
    let error = run(&options("broken", &image, vec![id(4)])).expect_err("no image");
    let text = format!("{error:#}");
    assert!(text.contains("vertebra 4 in QEMU"), "{text}");
    assert!(text.contains("cargo xtask firmware qemu"), "{text}");
}
