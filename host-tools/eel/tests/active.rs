//! The commands that send, as their users call them, where there is no bus: what is refused and why.

use std::process::Command;

fn eel(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_eel"))
        .args(arguments)
        .env_remove("EEL_BUS")
        .output()
        .unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (
        output.status.code().unwrap(),
        text(output.stdout),
        text(output.stderr),
    )
}

/// Fails unless the command ends with `code`, writes nothing and says `words` in one line.
fn refused(arguments: &[&str], code: i32, words: &str) {
    let (status, out, err) = eel(arguments);
    assert_eq!((status, out.as_str()), (code, ""), "{arguments:?}: {err}");
    assert!(err.contains(words), "{arguments:?}: {err}");
}

#[test]
fn wrong_names_and_values_are_told_before_a_bus_is_opened() {
    refused(&["read", "3", "pose.jaw"], 2, "pose has yaw, pitch, roll");
    refused(&["read", "0", "pose"], 2, "write head or a number 1 to 127");
    refused(
        &["read", "3", "pose", "--out", "x"],
        2,
        "--out takes the bytes of one",
    );
    refused(
        &["write", "3", "gains.peak_torque=40"],
        2,
        "takes 0.001 N.m to 32.000 N.m; 40 is outside",
    );
    refused(
        &["write", "3", "pose.yaw=0.1"],
        2,
        "pose.yaw can only be read",
    );
    refused(&["write", "3", "gains.peak_torque"], 2, "write NAME=VALUE");
    refused(&["nmt", "3", "go"], 2, "possible values: start, stop");
    refused(&["head", "vcan0", "--frequency", "9"], 2, "0.001 to 3 Hz");
    refused(&["head", "vcan0", "--amplitude", "-1"], 2, "");
    refused(&["head", "vcan0", "--nodes", "11"], 2, "each 1 to 10");
    refused(&["lss", "assign", "0"], 2, "0 is not in 1..=126");
    refused(
        &["scope", "3", "pose"],
        2,
        "pose is a group: name up to four of pose.yaw",
    );
    refused(&["scope", "3", "pose.jaw"], 2, "pose has yaw, pitch, roll");
    refused(
        &["scope", "3", "eds.data"],
        2,
        "eds.data can't be captured: the scope takes numbers from 0x2000 on",
    );
    let five = ["pose.yaw"; 5];
    refused(
        &[&["scope", "3"], &five[..]].concat(),
        2,
        "takes four signals at a time, not 5",
    );
    refused(&["scope", "3", "pose.yaw", "--every", "0"], 2, "1..=65535");
    refused(&["scope", "3"], 2, "<SIGNAL>");
    refused(&["faults", "0"], 2, "write head or a number 1 to 127");
    refused(&["store", "3", "burn"], 2, "possible values: save, restore");
}

#[test]
fn what_can_move_a_robot_needs_consent_on_a_cable() {
    let words =
        "is no virtual interface: make sure that nobody is within its reach, then say --yes";
    for arguments in [
        &["head", "cable0"][..],
        &["nmt", "-b", "cable0", "3", "start"],
        &["nmt", "-b", "cable0", "all", "start"],
        &["write", "-b", "cable0", "3", "target.yaw=0.1"],
        &[
            "write",
            "-b",
            "cable0",
            "3",
            "gains.peak_torque=1",
            "moment.x=1",
        ],
        &["write", "-b", "cable0", "3", "rpdo2.cob_id=0x303"],
        &["write", "-b", "cable0", "3", "0x3000=hex:01"],
    ] {
        refused(arguments, 2, words);
    }
    // With consent, or where nothing moves, the bus is what fails.
    for arguments in [
        &["head", "cable0", "--yes"][..],
        &["nmt", "-b", "cable0", "3", "stop"],
        &["write", "-b", "cable0", "3", "target.yaw=0.1", "--yes"],
        &["write", "-b", "cable0", "3", "gains.peak_torque=1"],
        &["store", "-b", "cable0", "3"],
        &["nodes", "cable0"],
        &["faults", "-b", "cable0"],
        &["scope", "-b", "cable0", "3", "pose.yaw", "--on-fault"],
        &["lss", "-b", "cable0", "scan"],
    ] {
        let (code, _, err) = eel(arguments);
        assert_eq!(code, 3, "{arguments:?}: {err}");
        assert!(err.contains("cable0"), "{err}");
    }
}

#[test]
fn a_recording_is_not_sent_to() {
    refused(
        &["nodes", "dive.log"],
        2,
        "is a recording and can't be sent to",
    );
    refused(
        &["read", "-b", "-", "3", "pose"],
        2,
        "name an interface such as vcan0",
    );
}

#[test]
fn every_command_explains_itself_with_examples_exit_codes_and_schema() {
    for name in [
        "nodes", "read", "write", "faults", "scope", "nmt", "lss", "store", "head",
    ] {
        let (code, out, _) = eel(&[name, "--help"]);
        assert_eq!(code, 0);
        for words in [
            "Examples:",
            "Exit codes:",
            "--json:",
            &format!("  eel {name}"),
            "EEL_BUS",
        ] {
            assert!(out.contains(words), "{name}: {words}");
        }
        let wide = out.lines().find(|line| line.chars().count() > 120);
        assert_eq!(wide, None, "{name}");
    }
}
