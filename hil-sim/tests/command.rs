//! `hil-sim` as a user runs it: what it prints, writes and ends with.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;

/// Keys that others read from `--json`.
const KEYS: [&str; 14] = [
    "speed_m_s",
    "stride_body_lengths",
    "slip",
    "strouhal",
    "tail_amplitude_body_lengths",
    "mean_power_w",
    "peak_torque_nm",
    "max_tracking_error_rad",
    "nodes_operational",
    "frames",
    "frames_lost",
    "bus_load_percent",
    "real_time_factor",
    "frame_log_sha256",
];

/// Returns an empty folder of a test's own.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).expect("a folder for the test");
    path
}

fn hil_sim(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hil-sim"));
    command.args(words).stdin(Stdio::null());
    command
}

fn run(words: &[&str]) -> Output {
    hil_sim(words).output().expect("it starts")
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

#[test]
fn json_is_one_object_with_all_keys_and_nothing_else_is_printed() {
    let out = folder("json");
    let output = run(&[
        "swim",
        "--seconds",
        "9",
        "--json",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(text(&output.stderr), "");
    let summary: Value = serde_json::from_slice(&output.stdout).expect("one object");
    for key in KEYS {
        assert!(!summary[key].is_null(), "{key} is missing in {summary}");
    }
    assert_eq!(summary["nodes_operational"], 10);
    let written = fs::read(out.join("summary.json")).expect("it is a record too");
    assert_eq!(
        serde_json::from_slice::<Value>(&written).expect("JSON"),
        summary
    );
    let log = fs::read_to_string(out.join("bus.log")).expect("the frames");
    assert_eq!(
        log.lines().count() as u64,
        summary["frames"].as_u64().unwrap()
    );
}

#[test]
fn wrong_words_end_with_2_and_name_what_is_right() {
    for (words, cure) in [
        (&["swim", "--seconds", "0"][..], "0.1 to 3600"),
        (&["swim", "--frequency", "fast"], "0.05 to 3"),
        (&["swim", "--amplitude", "0.21"], "0 to 0.2"),
        (&["swim", "--wavelength", "NaN"], "0.2 to 3"),
        (&["--can", "vcan0", "--nodes", "3-11"], "1 to 10"),
        (&["--nodes", "3"], "--can IFACE"),
        (&["--unconfigured", "3"], "--can IFACE"),
        (&["--can", "vcan0", "--unconfigured", "0"], "1 to 10"),
        (&["--seconds", "3"], "hil-sim swim"),
        (&["swim", "--seconds", "1", "--out", "/dev/null/x"], "--out"),
    ] {
        let output = run(words);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        assert!(
            text(&output.stderr).contains(cure),
            "{words:?}: {}",
            text(&output.stderr)
        );
        assert_eq!(text(&output.stdout), "");
    }
}

#[test]
fn an_interface_that_is_not_there_is_told_with_the_cure() {
    let output = run(&["--can", "vcan99", "--seconds", "1"]);
    assert_eq!(output.status.code(), Some(2));
    let told = text(&output.stderr);
    if cfg!(target_os = "linux") {
        assert!(told.contains("ip link add dev vcan99 type vcan"), "{told}");
        assert!(told.contains("cargo xtask vcan -- COMMAND"), "{told}");
    } else {
        assert!(told.contains("Linux only"), "{told}");
    }
}

#[test]
fn a_reader_that_leaves_is_no_failure() {
    let out = folder("pipe");
    let mut child = hil_sim(&[
        "swim",
        "--seconds",
        "1",
        "--json",
        "--out",
        out.to_str().unwrap(),
    ])
    .stdout(Stdio::piped())
    .stderr(Stdio::piped())
    .spawn()
    .expect("it starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), ""));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_with_the_file() {
    let out = folder("full");
    std::os::unix::fs::symlink("/dev/full", out.join("bus.log")).expect("a link");
    let output = run(&["swim", "--seconds", "3600", "--out", out.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("can't write bus.log: No space left"));
}

/// Waits until a run has written some of its bus log.
#[cfg(unix)]
fn wait_for_log(child: &mut Child, log: &Path) {
    while !fs::metadata(log).is_ok_and(|data| data.len() > 0) {
        assert!(
            child.try_wait().expect("a child").is_none(),
            "it runs for long enough"
        );
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_the_swim_in_order_with_whole_records() {
    let out = folder("interrupted");
    fs::write(out.join("stride.svg"), "of an older run").expect("a file");
    let words = [
        "swim",
        "--seconds",
        "3600",
        "--json",
        "--out",
        out.to_str().unwrap(),
    ];
    let mut child = hil_sim(&words)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    wait_for_log(&mut child, &out.join("bus.log"));
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(sent.is_ok_and(|status| status.success()));
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).starts_with("hil-sim: stopped early, after "));

    let summary: Value = serde_json::from_slice(&output.stdout).expect("one object");
    assert_eq!(
        (&summary["interrupted"], &summary["stopped_in_order"]),
        (&true.into(), &true.into())
    );
    let log = fs::read_to_string(out.join("bus.log")).expect("the frames");
    assert!(log.ends_with('\n'));
    assert_eq!(
        log.lines().count() as u64,
        summary["frames"].as_u64().unwrap()
    );
    let states = fs::read_to_string(out.join("states.csv")).expect("the states");
    let columns = |line: &str| line.split(',').count();
    let header = columns(states.lines().next().expect("a header"));
    assert!(header > 100 && states.lines().all(|line| columns(line) == header));
    assert!(
        !out.join("stride.svg").exists(),
        "no stride was planned to be over"
    );
}
