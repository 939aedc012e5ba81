//! `eel head` and a vertebra that nobody here wrote: durand, a CANopen slave in Python.

use std::env;

use eel_protocol::{Cob, Frame};
use eel_transport::{Bus, SocketBus};
use serde_json::{Value, json};

use crate::support::{PATIENCE, Program, interface, own_program, run};

/// Waits until node 3 shows that it is there.
fn wait_for_heartbeat(bus: &mut SocketBus) {
    let heartbeat = Some(Cob::Heartbeat(3).id());
    loop {
        let received = bus.receive(PATIENCE).unwrap().expect("a heartbeat");
        if received.frame().and_then(Frame::cob_id) == heartbeat {
            return;
        }
    }
}

#[test]
fn the_head_leads_a_slave_of_durand() {
    let Some(name) = interface() else { return };
    let mut bus = SocketBus::open(&name).unwrap();
    let python = env::var("ANGUILLA_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let slave = Program::start(&[&python, "tests/python/slave.py", &name]);
    wait_for_heartbeat(&mut bus);
    let eel = own_program("eel");
    let words = ["head", &name, "--nodes", "3", "--seconds", "5", "--json"];
    let text = run(&[&[eel.as_str()], &words[..]].concat());
    let lines: Vec<Value> = text
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect();
    let (last, events) = lines.split_last().expect("lines");
    assert_eq!(last["stopped"], "in-order", "{text}");
    assert_eq!(last["running"], 1, "{text}");
    let names: Vec<&str> = events
        .iter()
        .filter_map(|event| event["event"].as_str())
        .collect();
    assert_eq!(
        names,
        ["booted", "running", "gait-started", "emergency", "stopped"]
    );
    assert_eq!(events[3]["name"], "target-limited", "{text}");

    // What the slave was told.
    let told: Value = serde_json::from_str(&slave.output()).expect("JSON");
    let (operational, pre_operational) = (5, 127);
    assert_eq!(told["states"], json!([operational, pre_operational]));
    let (off, run) = (0, 4);
    assert_eq!(told["modes"], json!([off, run, off]));
    assert_eq!(
        (&told["wrong protection"], &told["counter gaps"]),
        (&json!(0), &json!(0))
    );
    let number = |name: &str| told[name].as_u64().unwrap();
    // It hears every SYNC until its end, which the last one may follow.
    let sent = last["sync_sent"].as_u64().unwrap();
    assert!(
        (sent - 1..=sent).contains(&number("syncs")),
        "{told} {sent}"
    );
    // A target with every SYNC from the start of the node to its end.
    assert!(
        number("targets") > 300 && number("targets") <= number("syncs"),
        "{told}"
    );
    let yaws: Vec<i64> = serde_json::from_value(told["yaw"].clone()).unwrap();
    assert!(yaws[0] < -500 && yaws[1] > 500, "{told}: it waves");
}
