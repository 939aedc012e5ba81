//! The command as its users call it: output, exit codes, files.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const GOOD: &str = "\
(0000000010.000000) vcan0 77F#05
(0000000010.010000) vcan0 080#01
(0000000010.010200) vcan0 203#2EFB3A0A46FD9462
(0000000010.010400) vcan0 283#CCF7FF7F0100915F
(0000000010.020000) vcan0 080#02
";

fn file(name: &str, text: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&path, text).unwrap();
    path
}

fn eel(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_eel"))
        .args(arguments)
        .output()
        .unwrap()
}

fn eel_on(name: &str, text: &str, arguments: &[&str]) -> (i32, String, String) {
    let path = file(name, text);
    let mut all = vec![arguments[0], path.to_str().unwrap()];
    all.extend_from_slice(&arguments[1..]);
    told(&eel(&all))
}

fn told(output: &Output) -> (i32, String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (
        output.status.code().unwrap(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

#[test]
fn a_recording_becomes_lines_with_names_and_units_and_no_colours() {
    let (code, out, err) = eel_on("lines.log", GOOD, &["decode"]);
    assert_eq!((code, err.as_str()), (0, ""));
    let expected = [
        "    0.000000  head         heartbeat     state operational",
        "    0.010000               sync          counter 1",
        "    0.010200  vertebra 3   target        yaw -0.1234 rad  pitch 0.2618 rad  \
         roll -0.0698 rad  mode run  counter 9  crc 0x62",
        "    0.010400  vertebra 3   effort        motor1 -2.100 N.m  motor2 32.767 N.m  \
         motor3 0.001 N.m  limit1 peak  limit2 singularity  limit3 off  target_limited  \
         command_lost",
        "    0.020000               sync          counter 2",
    ];
    assert_eq!(out.lines().collect::<Vec<_>>(), expected);
}

#[test]
fn standard_input_is_a_bus_too() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_eel"))
        .args(["decode", "-", "--json", "--name", "target.yaw"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child
        .stdin
        .take()
        .unwrap()
        .write_all(GOOD.as_bytes())
        .unwrap();
    let output = child.wait_with_output().unwrap();
    let line: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(line["signals"], serde_json::json!({ "yaw": -0.1234 }));
    assert_eq!(line["node"], 3);
}

#[test]
fn a_line_that_cannot_be_read_is_told_with_line_and_column_skipped_and_counted() {
    let text = GOOD.replace("080#01", "08G#01");
    let (code, out, err) = eel_on("damaged.log", &text, &["decode"]);
    assert_eq!(code, 1);
    assert_eq!(out.lines().count(), 4);
    assert!(
        err.contains("damaged.log:2:29: expected an identifier"),
        "{err}"
    );
    let (code, out, err) = eel_on("damaged.log", &text, &["decode", "--strict"]);
    assert_eq!((code, out.lines().count()), (3, 1));
    assert!(err.contains("damaged.log:2:29"), "{err}");
}

#[test]
fn a_flood_of_bad_lines_is_told_ten_times_and_counted() {
    let text = "nonsense\n".repeat(1_000);
    let (code, out, err) = eel_on("flood.log", &text, &["stats"]);
    assert_eq!(code, 1);
    assert_eq!(err.lines().count(), 11);
    assert!(err.contains("1000 malformed lines in all"), "{err}");
    assert!(out.contains("1000 lines could not be read"), "{out}");
}

#[test]
fn a_frame_that_fails_its_protection_is_a_fault() {
    let text = GOOD.replace("46FD9462", "46FD9463");
    let (code, out, _) = eel_on("protection.log", &text, &["decode"]);
    assert_eq!(code, 1);
    assert!(
        out.contains("! wrong protection byte, 0x62 would match"),
        "{out}"
    );
}

#[test]
fn what_is_recorded_is_what_was_read() {
    let copy = Path::new(env!("CARGO_TARGET_TMPDIR")).join("copy.log");
    let arguments = [
        "sniff",
        "--record",
        copy.to_str().unwrap(),
        "--name",
        "sync",
        "--stats",
    ];
    let (code, out, err) = eel_on("vcan0.log", GOOD, &arguments);
    assert_eq!((code, out.lines().count()), (0, 2), "{err}");
    assert!(err.contains("5 frames in 0.020"), "{err}");
    let recorded = fs::read_to_string(copy).unwrap();
    assert_eq!(recorded, GOOD.replace(" vcan0 ", " vcan0.log "));
}

#[test]
fn statistics_are_one_json_object() {
    let (code, out, _) = eel_on("stats.log", GOOD, &["stats", "--json"]);
    assert_eq!(code, 0);
    let all: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(all["frames"], 5);
    assert_eq!(all["problems"], 0);
    let sync = all["ids"]
        .as_array()
        .unwrap()
        .iter()
        .find(|row| row["id"] == 0x80)
        .unwrap();
    assert_eq!(sync["count"], 2);
    assert_eq!(sync["period_mean_ms"], 10.0);
    assert_eq!(sync["jitter_us"], 0.0);
    let bits = all["bits"].as_f64().unwrap();
    let load = bits / 1e6 / all["duration_s"].as_f64().unwrap() * 100.0;
    assert!((all["load_percent"].as_f64().unwrap() - load).abs() < 1e-9);
}

#[test]
fn half_the_bit_rate_is_twice_the_load() {
    let load = |rate: &str| {
        let (_, out, _) = eel_on("rate.log", GOOD, &["stats", "--json", "--bitrate", rate]);
        let all: serde_json::Value = serde_json::from_str(&out).unwrap();
        all["load_percent"].as_f64().unwrap() * all["duration_s"].as_f64().unwrap()
    };
    assert!((load("500000") - 2.0 * load("1000000")).abs() < 1e-9);
}

#[test]
fn exit_codes_tell_wrong_usage_from_a_bus_that_fails() {
    let (code, _, err) = told(&eel(&["decode", "./no-such.log"]));
    assert_eq!(code, 3);
    assert!(
        err.contains("no-such.log") && err.lines().count() == 1,
        "{err}"
    );
    let (code, _, err) = told(&eel(&["decode", "x.log", "--name", "poze"]));
    assert_eq!(code, 2);
    assert!(err.contains("there is no message \"poze\""), "{err}");
    assert_eq!(told(&eel(&["stats", "x.log", "--bitrate", "5"])).0, 2);
    assert_eq!(told(&eel(&["nonsense"])).0, 2);
}

#[test]
fn help_names_exit_codes_buses_and_the_json_schema() {
    let (code, out, _) = told(&eel(&["--help"]));
    assert_eq!(code, 0);
    assert!(out.contains("Exit codes: 0 fine; 1 found a fault") && out.contains("vcan0"));
    assert!(told(&eel(&["decode", "--help"])).1.contains("time_s"));
    assert!(
        told(&eel(&["stats", "--help"]))
            .1
            .contains("busiest_100ms_percent")
    );
}

#[test]
fn every_format_is_exported_to_standard_output_and_to_a_folder() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("exported");
    let (code, ..) = told(&eel(&["export", "all", "--out", folder.to_str().unwrap()]));
    assert_eq!(code, 0);
    for (format, name) in [
        ("eds", "vertebra.eds"),
        ("dbc", "vertebra.dbc"),
        ("md", "dictionary.md"),
    ] {
        let (_, out, _) = told(&eel(&["export", format]));
        assert_eq!(fs::read_to_string(folder.join(name)).unwrap(), out);
        assert!(out.len() > 10_000);
    }
}
