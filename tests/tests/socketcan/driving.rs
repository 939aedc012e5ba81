//! `eel drive` against simulated vertebrae.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use serde_json::Value;

use crate::bring_up::{eel, json, program, start};
use crate::support::interface;

/// `eel drive` in the background, in its mode.
struct Driving {
    process: Child,
    lines: std::io::Lines<BufReader<std::process::ChildStdout>>,
}

impl Driving {
    /// Begins to drive vertebra 3 and waits until it is in the mode.
    fn begin(interface: &str, task: &[&str]) -> Self {
        let mut process = Command::new(program())
            .args(["drive", "3"])
            .args(task)
            .args(["--json"])
            .env("EEL_BUS", interface)
            .stdout(Stdio::piped())
            .spawn()
            .expect("a program");
        let out = process.stdout.take().expect("a pipe");
        let mut lines = BufReader::new(out).lines();
        let runs = |line: String| line.contains("\"running\"");
        assert!(lines.by_ref().map_while(Result::ok).any(runs), "{task:?}");
        Self { process, lines }
    }

    /// Interrupts it and returns its last line.
    fn end(mut self) -> Value {
        let process = self.process.id().to_string();
        let sent = Command::new("kill").args(["-INT", &process]).status();
        assert!(sent.is_ok_and(|status| status.success()));
        let last = self.lines.map_while(Result::ok).last().expect("a summary");
        let status = self.process.wait().expect("it ends");
        assert_eq!(status.code(), Some(0), "{last}");
        serde_json::from_str(&last).expect("JSON")
    }
}

/// Reads a number of vertebra 3 until it is as wanted.
fn settles(interface: &str, name: &str, is_wanted: impl Fn(f64) -> bool) -> Result<(), f64> {
    let mut last = f64::NAN;
    for _ in 0..100 {
        let read = json(interface, &["read", "3", name, "--json"]);
        last = read["values"][0]["value"].as_f64().expect("a number");
        if is_wanted(last) {
            return Ok(());
        }
    }
    Err(last)
}

#[test]
fn a_vertebra_takes_a_pose_alone_and_is_switched_off_in_order() {
    let Some(name) = interface() else { return };
    let _nodes = start(&name);
    let driving = Driving::begin(&name, &["pose", "--yaw", "6", "--degrees"]);
    let near = |yaw: f64| (yaw - 0.1047).abs() < 0.02;
    assert_eq!(settles(&name, "pose.yaw", near), Ok(()));
    let last = driving.end();
    assert_eq!(
        (&last["stopped"], &last["running"]),
        (&"in-order".into(), &1.into())
    );
    // The neighbour was never touched.
    let (_, all, _) = eel(&name, &["nodes", "--json"]);
    assert_eq!(all.matches("\"pre-operational\"").count(), 2, "{all}");
}

#[test]
fn a_motor_and_a_moment_act_and_end() {
    let Some(name) = interface() else { return };
    let _nodes = start(&name);
    let driving = Driving::begin(&name, &["motor", "1=0.25"]);
    assert_eq!(
        settles(&name, "motor_torque.motor1", |torque| torque == 0.25),
        Ok(())
    );
    // The crank turns up to where the limits hold it.
    assert_eq!(settles(&name, "motor.angle1", |angle| angle > 0.3), Ok(()));
    driving.end();
    let driving = Driving::begin(&name, &["moment", "--x", "0.4", "--z=-0.1"]);
    assert_eq!(settles(&name, "moment.x", |moment| moment == 0.4), Ok(()));
    assert_eq!(settles(&name, "moment.z", |moment| moment == -0.1), Ok(()));
    // It leads to the end of the workspace, 30 degrees, where the controller's spring holds it.
    let end = |yaw: f64| (0.45..0.545).contains(&yaw);
    assert_eq!(settles(&name, "pose.yaw", end), Ok(()));
    driving.end();
    // RPDO2 is off again.
    let read = json(&name, &["read", "3", "0x1401:1", "--json"]);
    let cob_id = read["values"][0]["value"].as_u64().expect("a number");
    assert_eq!(cob_id >> 31, 1, "{read}");
}

#[test]
fn what_can_not_be_driven_is_refused_before_anything_is_sent() {
    for (words, cure) in [
        (&["drive", "3", "motor", "4=1"][..], "write 1=0.3"),
        (&["drive", "3", "pose", "--yaw", "5"], "--degrees"),
        (&["drive", "3", "moment", "--x", "99"], "at most 32.767"),
        (&["drive", "12", "hold"], "each 1 to 10"),
    ] {
        let (code, _, err) = eel("vcan0", words);
        assert_eq!(code, 2, "{words:?}: {err}");
        assert!(err.contains(cure), "{words:?}: {err}");
    }
}
