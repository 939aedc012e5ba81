//! Python's tools against the generated files: cantools reads the DBC and decodes what `eel`
//! decodes, python-canopen reads the EDS.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use eel_protocol::emergency::{CATALOGUE, EmergencyReport, Source};
use eel_protocol::{
    Cob, Counter, Effort, Flags, Frame, HEAD_NODE, LimitCode, Mode, Moment, NodeId, PoseReport,
    State, Target,
};
use eel_tests::skip;
use eel_transport::candump::{Record, format_line};
use eel_units::{Angle, Torque};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Returns the interpreter that has the tools, or tells how to get it; in CI it must be there.
fn python() -> Option<PathBuf> {
    let python = std::env::var_os("ANGUILLA_PYTHON")
        .map_or_else(|| root().join("target/venv/bin/python"), PathBuf::from);
    if python.is_file() {
        return Some(python);
    }
    skip(&format!(
        "no Python at {}: `cargo xtask setup` gets it",
        python.display()
    ));
    None
}

fn checked(mut command: Command) -> Output {
    let output = command
        .output()
        .unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(
        output.status.success(),
        "{command:?}\n{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

/// Runs `eel` as it is in this tree.
fn eel(arguments: &[&str]) -> Vec<u8> {
    let mut command = Command::new(env!("CARGO"));
    command
        .current_dir(root())
        .args(["run", "--quiet", "--package", "eel", "--"])
        .args(arguments);
    checked(command).stdout
}

fn run_script(python: &Path, script: &str, arguments: &[&Path]) -> String {
    let mut command = Command::new(python);
    command
        .current_dir(root())
        .arg(Path::new("tests/python").join(script))
        .args(arguments);
    String::from_utf8(checked(command).stdout).unwrap()
}

/// Numbers that look random and are the same in every run (Knuth's MMIX generator).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u32 {
        let Self(state) = self;
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*state >> 32) as u32
    }

    fn word(&mut self) -> i16 {
        self.next() as i16
    }

    fn torque(&mut self) -> Torque {
        Torque::from_millinewton_metres(i32::from(self.word()))
    }

    fn angle(&mut self) -> Angle {
        Angle::from_tenth_milliradians(self.word())
    }

    fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.next() as usize % list.len()]
    }

    fn counter(&mut self) -> Counter {
        Counter::new((self.next() % 15) as u8).unwrap()
    }
}

/// Makes every message of one node with arbitrary content.
fn frames(node: NodeId, numbers: &mut Numbers) -> Vec<Frame> {
    let number = node.get();
    let [yaw, pitch, roll] = [(); 3].map(|()| numbers.angle());
    let target = Target {
        yaw,
        pitch,
        roll,
        mode: numbers.pick(Mode::ALL),
        counter: numbers.counter(),
    };
    let state = numbers.pick(State::ALL);
    let pose = PoseReport {
        yaw: roll,
        pitch: yaw,
        roll: pitch,
        state,
        counter: numbers.counter(),
    };
    let effort = Effort {
        torque: [(); 3].map(|()| numbers.torque()),
        limit: [(); 3].map(|()| numbers.pick(LimitCode::ALL)),
        flags: Flags::from_bits(numbers.next() as u8 & 15),
    };
    let moment = Moment {
        moment: [(); 3].map(|()| numbers.torque()),
        stiffness: numbers.next() as u16,
    };
    let known = numbers.pick(CATALOGUE);
    let limit = numbers.pick(LimitCode::ALL).code();
    let source = Source {
        motor: (numbers.next() % 4) as u8,
        limit,
        detail: numbers.next() as u16,
    };
    let emergency = EmergencyReport {
        code: known.code,
        register: known.register,
        source,
    };
    let heartbeat = numbers.pick(&[0, 4, 5, 127]);
    let of = |cob: Cob, data: &[u8]| Frame::standard(cob.id(), data).unwrap();
    vec![
        target.to_frame(node).unwrap(),
        of(Cob::Pose(number), &pose.to_bytes(Cob::Pose(number).id())),
        of(Cob::Effort(number), &effort.to_bytes()),
        of(Cob::Moment(number), &moment.to_bytes()),
        of(Cob::Emergency(number), &emergency.to_bytes()),
        of(Cob::Heartbeat(number), &[heartbeat]),
    ]
}

/// Writes a recording of 200 rounds of every message of all ten nodes.
fn recording() -> PathBuf {
    let mut numbers = Numbers(2);
    let mut text = String::new();
    let mut time_ns = 0;
    for round in 0..200_u32 {
        let beat = [Frame::standard(0x80, &[(round % 240 + 1) as u8]).unwrap()];
        let command = numbers.pick(&[1, 2, 128, 129, 130]);
        let nmt = [Frame::standard(0, &[command, (round % 128) as u8]).unwrap()];
        let head = [Frame::standard(Cob::Heartbeat(HEAD_NODE).id(), &[5]).unwrap()];
        let of_nodes = NodeId::all().flat_map(|node| frames(node, &mut numbers));
        let all: Vec<_> = nmt
            .into_iter()
            .chain(beat)
            .chain(head)
            .chain(of_nodes)
            .collect();
        for frame in all {
            time_ns += 150_000;
            let record = Record {
                time_ns,
                interface: "vcan0",
                frame,
                direction: None,
            };
            writeln!(text, "{}", format_line(&record)).unwrap();
        }
    }
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("interop.log");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn cantools_decodes_every_frame_to_the_same_values_as_eel() {
    let Some(python) = python() else { return };
    let log = recording();
    let decoded = log.with_extension("jsonl");
    fs::write(&decoded, eel(&["decode", log.to_str().unwrap(), "--json"])).unwrap();
    let dbc = Path::new("docs/generated/vertebra.dbc");
    let report = run_script(&python, "decode_dbc.py", &[dbc, &log, &decoded]);
    // 200 rounds of 3 frames of the head and 6 of each of ten vertebrae.
    assert_eq!(report.trim(), "12600 frames agree, 63 of 63 messages");
}

#[test]
fn lely_s_checker_finds_nothing_wrong_with_the_data_sheet() {
    let Some(python) = python() else { return };
    let eds = fs::read_to_string(root().join("docs/generated/vertebra.eds")).unwrap();
    // Keys beyond CiA 306 that python-canopen reads; dcfchk warns of whatever it does not know.
    let is_extension = |line: &str| {
        ["Factor=", "Unit=", "Description="]
            .iter()
            .any(|key| line.starts_with(key))
    };
    let (mut in_entry, mut standard) = (false, String::new());
    for line in eds.lines() {
        in_entry = in_entry && !line.is_empty() || line.contains("sub");
        if !(in_entry && is_extension(line)) {
            writeln!(standard, "{line}").unwrap();
        }
    }
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("standard.eds");
    fs::write(&path, standard).unwrap();
    for node in NodeId::all() {
        let mut dcfchk = Command::new(python.with_file_name("dcfchk"));
        dcfchk.args(["-n", &node.get().to_string()]).arg(&path);
        let output = checked(dcfchk);
        let text = [output.stdout, output.stderr].concat();
        assert_eq!(String::from_utf8_lossy(&text), "", "{node:?}");
    }
}

#[test]
fn python_canopen_reads_the_data_sheet_with_every_object() {
    let Some(python) = python() else { return };
    let eds = Path::new("docs/generated/vertebra.eds");
    let report = run_script(&python, "read_eds.py", &[eds]);
    let mut lines = report.lines();
    for (object, sub) in eel_protocol::dictionary::entries() {
        let scale = f64::from(sub.scale.numerator) / f64::from(sub.scale.denominator);
        let (index, number) = (object.index, sub.subindex);
        let name = object.dotted(sub);
        let (code, unit) = (sub.data_type.code(), sub.unit);
        let expected = format!("{index:04X}:{number} {name} {code} {scale:e} {unit}");
        assert_eq!(lines.next(), Some(expected.trim_end()));
    }
    assert_eq!(lines.next(), None);
}
