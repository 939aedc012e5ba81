//! `eel nodes`, `read`, `write`, `faults`, `scope`, `nmt`, `store`, `lss` and `head` against simulated vertebrae.

use std::env;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use eel_protocol::NodeId;
use serde_json::Value;

use crate::nodes::Nodes;
use crate::support::interface;

/// Returns the program beside this test.
pub fn program() -> String {
    let test = env::current_exe().expect("a path");
    let folder = test.ancestors().nth(2).expect("target/debug");
    folder.join("eel").display().to_string()
}

/// Runs `eel` on the interface and returns its exit code and output.
pub fn eel(interface: &str, arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(program())
        .args(arguments)
        .env("EEL_BUS", interface)
        .stdin(Stdio::null())
        .output()
        .expect("cargo builds eel with the workspace");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let code = output.status.code().expect("an exit code");
    (code, text(&output.stdout), text(&output.stderr))
}

pub fn json(interface: &str, arguments: &[&str]) -> Value {
    let (code, out, err) = eel(interface, arguments);
    assert_eq!(code, 0, "{arguments:?}: {err}");
    serde_json::from_str(&out).unwrap_or_else(|error| panic!("{error}: {out}"))
}

/// Starts vertebrae 3 and 5 and waits until both answer.
pub fn start(interface: &str) -> Nodes {
    let chosen = [3, 5].map(|id| NodeId::new(id).expect("a vertebra"));
    let nodes = Nodes::start(interface, chosen.to_vec());
    let has_both = || {
        let (_, out, _) = eel(interface, &["nodes", "--json"]);
        let all: Value = serde_json::from_str(&out).expect("JSON");
        let all = all.as_array().expect("an array").clone();
        all.len() == 2 && all.iter().all(|node| node["vertebra"].is_string())
    };
    assert!((0..20).any(|_| has_both()), "both vertebrae are found");
    nodes
}

#[test]
fn values_are_read_written_stored_and_restored_by_name_and_unit() {
    let Some(name) = interface() else { return };
    let _nodes = start(&name);
    let all = json(&name, &["nodes", "--json"]);
    let ids: Vec<_> = all.as_array().expect("an array").iter().collect();
    assert_eq!([&ids[0]["node"], &ids[1]["node"]], [3, 5]);
    assert_eq!(ids[0]["serial"], 0x5EE1_0003);
    assert_eq!(ids[0]["device"], "Anguilla vertebra");

    let (code, out, _) = eel(&name, &["read", "3", "gains.peak_torque", "device.name"]);
    let expected = "gains.peak_torque  3.000 N.m\ndevice.name        Anguilla vertebra\n";
    assert_eq!((code, out.as_str()), (0, expected));
    let (code, out, _) = eel(&name, &["write", "3", "gains.peak_torque=2.5"]);
    assert_eq!(
        (code, out.as_str()),
        (0, "gains.peak_torque  2.500 N.m  written\n")
    );
    let peak = || json(&name, &["read", "3", "0x2020:7", "--json"])["values"][0]["value"].clone();
    assert_eq!(peak(), 2.5);
    let (code, out, _) = eel(&name, &["store", "3"]);
    assert_eq!(
        (code, out.as_str()),
        (0, "vertebra 3: all parameters stored\n")
    );
    let reset = || {
        let (code, out, err) = eel(&name, &["nmt", "3", "reset"]);
        assert_eq!((code, out.as_str()), (0, "vertebra 3: boot-up\n"), "{err}");
    };
    reset();
    assert_eq!(peak(), 2.5);
    assert_eq!(eel(&name, &["store", "3", "restore"]).0, 0);
    reset();
    assert_eq!(peak(), 3.0);

    // What was written before one is refused is told.
    let words = [
        "write",
        "3",
        "gains.peak_torque=2",
        "0x3000=hex:01",
        "--json",
    ];
    let (code, out, err) = eel(&name, &words);
    assert_eq!(code, 1);
    assert!(err.contains("0x3000:0"), "{err}");
    let told: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(told["written"].as_array().map(Vec::len), Some(1), "{out}");
    assert_eq!(peak(), 2.0);

    let (code, out, err) = eel(&name, &["read", "3", "0x5000"]);
    assert_eq!((code, out.as_str()), (1, ""));
    assert!(err.contains("no such object (0x06020000)"), "{err}");
    let (code, _, err) = eel(&name, &["read", "4", "pose.yaw"]);
    assert_eq!(code, 1);
    assert!(err.contains("node 4 does not answer"), "{err}");
}

#[test]
fn everything_that_a_vertebra_has_can_be_read() {
    let Some(name) = interface() else { return };
    let _nodes = start(&name);
    let all = json(&name, &["read", "5", "all", "--json"]);
    let values = all["values"].as_array().expect("an array");
    assert!(values.len() > 120, "{}", values.len());
    let refused = values.iter().filter(|value| !value["error"].is_null());
    // The history of errors is empty.
    assert!(
        refused.clone().all(|value| value["error"] == "no data"),
        "{all}"
    );
    let file = env::temp_dir().join(format!("eel-{}.eds", std::process::id()));
    let path = file.display().to_string();
    let (code, out, err) = eel(&name, &["read", "5", "eds.data", "--out", &path]);
    assert_eq!(code, 0, "{out}{err}");
    let served = std::fs::read_to_string(&file).expect("a file");
    let _ = std::fs::remove_file(&file);
    let mut written = String::new();
    eel_protocol::export::write_eds(&mut written).expect("a text");
    assert!(served == written);
}

#[test]
fn states_are_commanded_and_reported() {
    let Some(name) = interface() else { return };
    let _nodes = start(&name);
    let (code, out, err) = eel(&name, &["nmt", "3", "start"]);
    assert_eq!(
        (code, out.as_str()),
        (0, "vertebra 3: operational\n"),
        "{err}"
    );
    let (code, _, err) = eel(&name, &["write", "3", "gains.peak_torque=1"]);
    assert_eq!(code, 1);
    assert!(
        err.contains("stop it first: `eel nmt 3 pre-operational`"),
        "{err}"
    );
    let (code, out, _) = eel(&name, &["nmt", "5", "stop"]);
    assert_eq!((code, out.as_str()), (0, "vertebra 5: stopped\n"));
    let (code, _, err) = eel(&name, &["nmt", "7", "stop"]);
    assert_eq!(code, 1);
    assert!(
        err.contains("node 7 did not report the state in time"),
        "{err}"
    );
}

/// Nothing here depends on how well the eel swims: the guest's clock is too coarse for that.
#[test]
fn the_head_leads_stops_in_order_and_is_alone() {
    let Some(name) = interface() else { return };
    let _nodes = start(&name);
    let words = ["head", "--nodes", "3,5", "--seconds", "3", "--json"];
    let (_, out, err) = eel(&name, &words);
    let lines: Vec<Value> = out
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let (last, events) = lines.split_last().expect("lines");
    assert_eq!(last["stopped"], "in-order", "{out}{err}");
    assert_eq!(last["running"], 2, "{out}");
    assert!(last["sync_sent"].as_u64() > Some(100), "{out}");
    let has = |name: &str, node: u8| {
        events
            .iter()
            .any(|event| event["event"] == name && event["node"] == node)
    };
    assert!(has("running", 3) && has("running", 5), "{out}");
    assert!(events.iter().any(|event| event["event"] == "gait-started"));
    // Interrupted, it stops in order too.
    let mut head = Command::new(program())
        .args(["head", &name, "--json"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("a program");
    let mut lines = BufReader::new(head.stdout.take().expect("a pipe")).lines();
    let first = lines.next().expect("a vertebra is met").expect("text");
    assert!(first.contains("time_s"), "{first}");
    let (code, _, err) = eel(&name, &["head", "--seconds", "0.1"]);
    assert_eq!(code, 2, "{err}");
    assert!(err.contains("another head (node 127) is on"), "{err}");
    let process = head.id().to_string();
    let sent = Command::new("kill").args(["-INT", &process]).status();
    assert!(sent.is_ok_and(|status| status.success()));
    let last = lines.map_while(Result::ok).last().expect("a summary");
    head.wait().expect("it ends");
    assert!(last.contains("\"in-order\""), "{last}");
}

/// Whoever ends the head, the robot is not let go in the middle of a stroke.
#[test]
fn the_head_stops_in_order_when_the_system_ends_it_or_nobody_reads_it() {
    let Some(name) = interface() else { return };
    let _nodes = start(&name);
    for signal in ["-TERM", ""] {
        let mut head = Command::new(program())
            .args(["head", &name, "--nodes", "3,5", "--seconds", "20", "--json"])
            .stdout(Stdio::piped())
            .spawn()
            .expect("a program");
        let mut lines = BufReader::new(head.stdout.take().expect("a pipe")).lines();
        let first = lines.next().expect("a vertebra is met").expect("text");
        assert!(first.contains("time_s"), "{first}");
        if signal.is_empty() {
            // The next event finds the pipe closed.
            drop(lines);
        } else {
            let process = head.id().to_string();
            let sent = Command::new("kill").args([signal, &process]).status();
            assert!(sent.is_ok_and(|status| status.success()));
            let last = lines.map_while(Result::ok).last().expect("a summary");
            assert!(last.contains("\"in-order\""), "{signal}: {last}");
        }
        let status = head.wait().expect("it ends");
        assert!(status.code().is_some(), "{signal}: {status}");
        // An end at once leaves them stopped.
        let all = eel(&name, &["nodes", "--json"]).1;
        assert_eq!(all.matches("\"pre-operational\"").count(), 2, "{all}");
    }
}

/// A vertebra that is taken out of operation while it moves has a frozen frame and a capture around it.
#[test]
fn a_stop_is_captured_by_the_scope_and_told_by_the_freeze_frame() {
    let Some(name) = interface() else { return };
    let _nodes = start(&name);
    let (code, out, err) = eel(&name, &["faults"]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(
        out.matches("nothing has gone wrong since power-up").count(),
        2,
        "{out}"
    );
    let capture = json(
        &name,
        &["scope", "3", "pose.yaw", "health.supply", "--json"],
    );
    assert_eq!(
        (&capture["state"], &capture["every_ms"]),
        (&"full".into(), &1.into())
    );
    for signal in capture["signals"].as_array().expect("an array") {
        assert_eq!(signal["values"].as_array().map(Vec::len), Some(512));
    }

    let mut head = Command::new(program())
        .args(["head", &name, "--nodes", "3,5", "--seconds", "20", "--json"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("a program");
    let mut lines = BufReader::new(head.stdout.take().expect("a pipe")).lines();
    let runs = |line: &String| line.contains("gait-started");
    assert!(lines.by_ref().map_while(Result::ok).any(|line| runs(&line)));
    let words = [
        "scope",
        "3",
        "pose.yaw",
        "--on-fault",
        "--seconds",
        "20",
        "--json",
    ];
    let scope = Command::new(program())
        .args(words)
        .env("EEL_BUS", &name)
        .stdout(Stdio::piped())
        .spawn()
        .expect("a program");
    // It captures before the stop comes.
    let waits = || eel(&name, &["read", "3", "scope.state"]).1.contains(" 2");
    assert!((0..50).any(|_| waits()));
    assert_eq!(eel(&name, &["nmt", "3", "pre-operational"]).0, 0);
    let captured = scope.wait_with_output().expect("it ends");
    let captured: Value = serde_json::from_slice(&captured.stdout).expect("JSON");
    assert!(
        captured["fault"].is_u64() && captured["state"] == "full",
        "{captured}"
    );

    let told = json(&name, &["faults", "3", "--json"]);
    let frame = &told[0]["frame"];
    assert_eq!(frame["name"], "stopped-by-nmt", "{told}");
    assert_eq!((&frame["motor"], &frame["count"]), (&0.into(), &1.into()));
    let (code, out, err) = eel(&name, &["faults", "3", "7"]);
    assert_eq!(code, 1);
    assert!(out.contains("advice       An NMT command took"), "{out}");
    assert!(err.contains("node 7 does not answer"), "{err}");
    let process = head.id().to_string();
    let sent = Command::new("kill").args(["-INT", &process]).status();
    assert!(sent.is_ok_and(|status| status.success()));
    head.wait().expect("it ends");
}

#[test]
fn a_command_that_nobody_was_heard_to_follow_is_no_success() {
    let Some(name) = interface() else { return };
    let (code, out, err) = eel(&name, &["nmt", "all", "stop"]);
    assert_eq!((code, out.as_str()), (1, ""));
    assert!(err.contains("nobody was heard on"), "{err}");
}
