//! Every service of a vertebra as python-canopen uses it, which knows nothing of this project.
//!
//! The scripts in tests/python say what they found; what it must be is here, after CiA 301 and 305.

use std::fs;
use std::path::Path;

use eel_protocol::{HEAD_HEARTBEAT_TIMEOUT_MS, HEAD_NODE, NodeId, identity};
use serde_json::{Value, json};

use crate::dissect::dissect;
use crate::nodes::Nodes;
use crate::support::{Recording, frames_of, interface, python, root, script};

/// Runs a script beside some vertebrae and returns what it found.
fn meet(nodes: &[u8], name: &str) -> Option<Value> {
    let interface = interface()?;
    let vertebrae = Nodes::start(&interface, ids(nodes));
    let found = script(name, &[&interface]);
    assert_eq!(vertebrae.end().dropped, 0);
    Some(found)
}

fn ids(numbers: &[u8]) -> Vec<NodeId> {
    let valid = numbers.iter().map(|id| NodeId::new(*id).unwrap());
    valid.collect()
}

/// Runs a script that has every frame dissected as what it is, too.
fn meet_dissected(vertebrae: Nodes, interface: &str, name: &str) -> Value {
    let recording = Recording::start(interface, name);
    let found = script(name, &[interface]);
    assert_eq!(vertebrae.end().dropped, 0);
    let (file, log) = recording.end();
    dissect(&file, &frames_of(&log));
    found
}

/// Tells whether a count is what it must be, give or take one at the edge.
fn is_about(count: &Value, expected: u64) -> bool {
    count
        .as_u64()
        .is_some_and(|count| count.abs_diff(expected) <= 1)
}

#[test]
fn nmt_and_heartbeats_do_what_they_are_told() {
    if let Some(found) = meet(&[3, 5], "nmt.py") {
        check_nmt(&found);
    }
}

/// Holds what nmt.py found to CiA 301, 7.2.8, and to what the head's silence must do.
pub fn check_nmt(found: &Value) {
    assert_eq!(
        found["states"],
        json!({
            "start": 5,
            "stop": 4,
            "answers in stopped": 0,
            "pre-operational": 127,
            "reset node": [0, 127],
            "reset communication": [0, 127],
            "after strange commands": 127,
            "boot-ups of 3": 2,
            "states of 5": [5, 127],
        })
    );
    let heartbeats = &found["heartbeats"];
    assert!(is_about(&heartbeats["20"], 50), "{heartbeats}");
    assert!(is_about(&heartbeats["50"], 20), "{heartbeats}");
    assert!(is_about(&heartbeats["200"], 5), "{heartbeats}");
    assert_eq!(heartbeats["0"], 0);
    let consumer = &found["consumer"];
    let watched = u32::from(HEAD_NODE) << 16 | u32::from(HEAD_HEARTBEAT_TIMEOUT_MS);
    assert_eq!(consumer["default"], watched);
    assert_eq!(
        consumer["emergency"], "3081917f00000000",
        "head-lost, by 127"
    );
    assert_eq!(consumer["history"], json!([1, 0x007F_8130]));
    assert_eq!(consumer["register"], 0x91);
    let (head_lost, latched) = (1 << 11, 1 << 9);
    let status = consumer["status"].as_u64().unwrap();
    assert_eq!(status & (head_lost | latched), head_lost | latched);
    assert_eq!(
        consumer["back"], "0000810000000000",
        "communication is well again"
    );
    assert_eq!(consumer["unwatched"], json!([]));
    assert_eq!(consumer["refused"], "06090030");
}

#[test]
fn pdos_are_mapped_anew_while_the_vertebra_runs() {
    let Some(found) = meet(&[3], "pdo.py") else {
        return;
    };
    assert_eq!(
        found["defaults"],
        json!([[1, 0], [1, 1], [1, 0], [1, 1], [1, 0], [1, 1]])
    );
    let transmit = &found["transmit"];
    let names = ["motor1", "motor2", "motor3", "limits"].map(|name| format!("effort.{name}"));
    assert_eq!(transmit["before"], json!(names));
    assert_eq!(transmit["length"], 7);
    let number = |list: &str, place: usize| transmit[list][place].as_i64().unwrap();
    for (place, tolerance) in [(0, 100), (1, 100), (2, 0)] {
        let gap = number("carried", place) - number("read", place);
        assert!(gap.abs() <= tolerance, "{transmit}");
    }
    assert_eq!(transmit["old identifier"], 0);
    assert!(is_about(&transmit["by timer"], 25), "{transmit}");
    assert!(is_about(&transmit["inhibited"], 10), "{transmit}");
    assert_eq!(transmit["every third"], 3);
    assert_eq!(
        found["receive"],
        json!({
            "before": [32_768, 0],
            "before sync": [32_768, 0],
            "after sync": [20_000, -321],
            "at once": [30_000, 55],
            "short": "1082110200000000",
            "after short": [30_000, 55],
            "long": [40_000, 7],
        })
    );
    assert_eq!(
        found["beats"],
        json!({
            "none": [0, ["4082110000000000"]],
            "two bytes": [0, []],
            "right": [1, ["0000000000000000"]],
        })
    );
    check_pdo_refusals(&found["refusals"]);
}

/// Every rule of 7.5.2.36 and 7.5.2.38, broken.
fn check_pdo_refusals(found: &Value) {
    let (access, value) = ("06010000", "06090030");
    let (not_mappable, too_long) = ("06040041", "06040042");
    assert_eq!(
        found,
        &json!({
            "map while enabled": access,
            "count while enabled": access,
            "identifier while enabled": value,
            "reserved type": value,
            "remote frames": value,
            "extended identifier": value,
            "disable": null,
            "identifier of SDO": value,
            "map while mapped": access,
            "free": null,
            "no object": "06020000",
            "no subindex": "06090011",
            "wrong way": not_mappable,
            "wrong length": not_mappable,
            "dummy in a report": not_mappable,
            "four bytes": null,
            "four more": null,
            "two more": null,
            "ten bytes": too_long,
            "empty": null,
            "empty entry": "06040043",
            "nine entries": too_long,
            "enable the empty": value,
            "eight bytes": null,
            "enable": null,
            "carried": true,
        })
    );
}

#[test]
fn values_of_every_length_move_in_every_way_of_sdo() {
    let Some(name) = interface() else { return };
    let found = meet_dissected(Nodes::start(&name, ids(&[3])), &name, "sdo.py");
    assert_eq!(
        found["short values"],
        json!({
            "1001": 0,
            "1017": 200,
            "1000": 0x0003_0000,
            "written": ["2c01", "40e20100", "d204", "64"],
            "text": "Anguilla vertebra",
        })
    );
    let transfers = found["transfers"].as_object().unwrap();
    assert_eq!(transfers.len(), 4 * 5, "four ways, five lengths");
    for (transfer, arrived) in transfers {
        assert_eq!(arrived, &json!([true, true]), "{transfer}: down, up");
    }
    assert_eq!(
        found["refusals"],
        json!({
            "no object": "06020000",
            "no subindex": "06090011",
            "write to what is read only": "06010002",
            "write to a constant": "06010002",
            "too long": "06070012",
            "too short": "06070013",
            "too high": "06090031",
            "too low": "06090032",
            "not a counter": "06090030",
        })
    );
    assert_eq!(
        found["broken protocol"],
        json!({
            "unknown command": "05040001",
            "segment of nothing": "05040001",
            "toggle": ["41", "00", "05030000"],
            "block of 0": "05040002",
            "block of 128": "05040002",
            "block refused": ["C6", "05040001"],
            "crc": ["A4", "A2", "05040004"],
            "silence": ["41", "05040000"],
            "afterwards": "Anguilla vertebra",
        })
    );
}

#[test]
fn parameters_are_stored_and_restored() {
    let Some(found) = meet(&[3], "store.py") else {
        return;
    };
    assert_eq!(
        found,
        json!({
            "offers": [3, 1, 1, 1],
            "default": [200, 2, 400_000],
            "not stored": [200, 2, 400_000],
            "wrong signatures": ["08000020", "08000020", "06070013", "06090011"],
            "stored": [250, 7, 123_456],
            "until reset": [250, 7, 123_456],
            "application restored": [250, 7, 400_000],
            "restored": [200, 2, 400_000],
        })
    );
}

#[test]
fn a_tool_can_learn_everything_from_the_vertebra_itself() {
    let Some(found) = meet(&[3], "data_sheet.py") else {
        return;
    };
    let pose = ["yaw", "pitch", "roll", "code", "crc"].map(|name| format!("pose.{name}"));
    assert_eq!(
        found,
        json!({
            "objects": true,
            "same": true,
            "format": 0,
            "name": "Anguilla vertebra",
            "stiffness": 99_500,
            "pose": pose,
        })
    );
}

#[test]
fn two_vertebrae_without_ids_are_found_and_named() {
    let Some(name) = interface() else { return };
    let vertebrae = Nodes::unconfigured(&name, ids(&[3, 5]));
    let found = meet_dissected(vertebrae, &name, "lss.py");
    let one = |serial: u32| {
        let address = [
            identity::VENDOR,
            identity::PRODUCT,
            identity::REVISION,
            serial,
        ];
        // The id of before is in use until the node boots anew: none, 255.
        json!([address, address, 255, 255])
    };
    let serials = [0x5EE1_0003_u32, 0x5EE1_0005];
    assert_eq!(
        found,
        json!({
            // Two answers each: "non-configured slave" and "slave".
            "identified": [[0x50, 0x50], [0x4F, 0x4F]],
            "scanned": serials.map(one),
            "booted": [0, 0],
            "serials": serials,
            "refusals": {
                "selected": true,
                "id 0": "LSS Error: 1",
                "id 128": "LSS Error: 1",
                "125 kbit/s": "LSS Error: 1",
                "1 Mbit/s": "accepted",
            },
            "after reset": serials,
        })
    );
}

#[test]
fn a_running_vertebra_lets_go_when_the_head_falls_silent_and_knows_when() {
    // A host that stands still for 90 ms loses targets too, and gets another try.
    let lost_targets = |found: &Value| found["emergencies"].to_string().contains("\"5082");
    let Some(name) = interface() else { return };
    let found = (0..5)
        .map(|_| meet_dissected(Nodes::start(&name, ids(&[3])), &name, "safe.py"))
        .find(|found| !lost_targets(found))
        .expect("a host that does not stand still");
    let (off, ready, run, stop_damped, stop_brake) = (1, 2, 3, 7, 8);
    // Off is over before the first report where the host was slow.
    let running = &found["running"];
    let ways = [json!([off, ready, run]), json!([ready, run])];
    assert!(ways.contains(running), "{running}");
    // A host that stands still for less is told of late targets, and that they are back.
    let emergencies = found["emergencies"].as_array().unwrap().iter();
    let is_late = |it: &&Value| {
        ["\"10ff", "\"0000"]
            .iter()
            .any(|code| it.to_string().starts_with(code))
    };
    let faults: Vec<&Value> = emergencies.filter(|it| !is_late(it)).collect();
    assert_eq!(faults, ["30817f0000"], "8130, the node is 127");
    assert_eq!(found["let go"], json!([run, stop_damped, stop_brake]));
    assert_eq!(found["again"], json!([stop_brake, off, ready, run]));
    let freeze = &found["freeze"];
    assert_eq!(freeze["bytes"], 128);
    assert_eq!(
        (&freeze["code"], &freeze["detail"]),
        (&json!(0x8130), &json!(127))
    );
    // TIME was told, and runs on until the stop.
    let (clock, told) = (&freeze["clock"], &found["told"]);
    assert_eq!((&clock[0], &clock[1]), (&json!(1), &told[0]));
    let later_ms = clock[2].as_i64().unwrap() - told[1].as_i64().unwrap();
    assert!((1..60_000).contains(&later_ms), "{freeze} {told}");
}

/// Lets a vertebra nod and returns how high it was told to and did, in degrees; a host that stood
/// still for too long gets another try.
fn nod(interface: &str, picture: &Path) -> (f64, f64) {
    let example = root().join("examples/python/nod.py");
    for _ in 0..5 {
        let vertebrae = Nodes::start(interface, vec![NodeId::new(3).unwrap()]);
        let report = python(&example, &[interface, picture.to_str().unwrap()]);
        assert_eq!(vertebrae.end().dropped, 0);
        // It stops where it misses targets for 90 ms, and says so.
        if report.contains("0x8250") {
            println!("{report}");
            continue;
        }
        // "told 11.46 degrees, reached 11.47; drawn in …"
        let line = report.lines().last().unwrap_or_default();
        let mut numbers = line.split([' ', ';']).filter_map(|word| word.parse().ok());
        if let (Some(told), Some(reached)) = (numbers.next(), numbers.next()) {
            return (told, reached);
        }
        panic!("{report}");
    }
    panic!("this host stands still for 90 ms at a time");
}

#[test]
fn the_example_lets_a_vertebra_nod_and_draws_it() {
    let Some(name) = interface() else { return };
    let picture = Path::new(env!("CARGO_TARGET_TMPDIR")).join("nod.png");
    let _ = fs::remove_file(&picture);
    let (told, reached) = nod(&name, &picture);
    assert!((told - 11.46).abs() < 0.01, "{told}");
    assert!((reached - told).abs() < 0.5, "{told} {reached}");
    let png = fs::read(&picture).unwrap();
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n") && png.len() > 10_000);
}
