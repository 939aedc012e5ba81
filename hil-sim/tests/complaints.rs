//! A run that did not go as it should says why.

use eel_head::Gait;
use eel_protocol::NodeId;
use hil_sim::robot::{Fault, FaultKind};
use hil_sim::swim::{Emulated, Options, run, run_while};

fn options(faults: Vec<Fault>) -> Options {
    Options {
        seconds: 3.0,
        gait: Gait::SWIM,
        frequency_hz: 1.0,
        amplitude: 0.08,
        wavelength: 0.8,
        seed: 1,
        out: None,
        faults,
        emulated: None,
        progress: false,
    }
}

#[test]
fn a_run_as_planned_has_nothing_to_complain_about() {
    let summary = run(&options(Vec::new())).expect("nothing is written");
    assert_eq!(summary.complaints(), [""; 0]);
    assert!(!summary.interrupted);
}

#[test]
fn an_image_that_is_missing_is_named_with_the_cure() {
    let emulated = Emulated {
        nodes: vec![NodeId::FIRST],
        image: "no/such/image.elf".into(),
    };
    let options = Options {
        emulated: Some(emulated),
        ..options(Vec::new())
    };
    let text = format!("{:#}", run(&options).expect_err("no image"));
    assert!(text.contains("no/such/image.elf"), "{text}");
    assert!(text.contains("cargo xtask firmware qemu"), "{text}");
}

#[test]
fn a_head_that_falls_silent_shows_in_the_vertebrae_and_in_the_stop() {
    let silent = Fault {
        at_ns: 2_000_000_000,
        kind: FaultKind::HeadSilent,
    };
    let summary = run(&options(vec![silent])).expect("nothing is written");
    let complaints = summary.complaints();
    assert!(
        complaints[0].starts_with("0 of 10 vertebrae followed"),
        "{complaints:?}"
    );
    assert!(complaints[1].contains("not straightened"), "{complaints:?}");
    assert_eq!(complaints.len(), 2);
}

#[test]
fn an_early_end_is_told_and_stops_in_order() {
    let mut asked = 0;
    let summary = run_while(&options(Vec::new()), || {
        asked += 1;
        asked <= 150
    })
    .expect("nothing is written");
    assert!(summary.interrupted && summary.stopped_in_order);
    assert!((summary.seconds - 1.5).abs() < 1e-9, "{}", summary.seconds);
    assert!(
        (summary.simulated_s - 3.05).abs() < 0.02,
        "a cycle, half a second, 50 ms on top"
    );
    assert_eq!(summary.complaints().len(), 1);
}
