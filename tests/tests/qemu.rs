//! The image for QEMU's Cortex-M4 does what the same crate does on this machine, bit for bit.
//!
//! `cargo xtask firmware qemu` builds the image. What one vertebra hears and measures in a run of
//! the simulator is recorded; then it is made worse: targets outside the workspace, frames that
//! mean nothing, failing sensors, a head that falls silent, a second power-up. The same packets go
//! to the image and to the crate here, and every answer must be the same.

#[path = "qemu/swim.rs"]
mod swim;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use eel_head::{Config as HeadConfig, Event as HeadEvent, Gait};
use eel_protocol::{Cob, Frame, NodeId, Target};
use eel_tests::skip;
use eel_units::{Angle, Instant as Moment, Voltage};
use eel_vertebra::lockstep::{HEADER, Header, Input, Kind, Output, Start};
use eel_vertebra::store::{self, RamFlash, Store};
use eel_vertebra::{Drive, Keepsake, Settings, Vertebra, turn};
use hil_sim::bus::Event as BusEvent;
use hil_sim::plant::Plant;
use hil_sim::robot::{Config, Node, Observer, Robot, Turn};

/// The vertebra that is recorded: the fifth, in the middle.
const RECORDED: u8 = 5;
const SERIAL: u32 = 0x5EE1_0005;
/// How long the recorded run is, and so how many turns.
const RUN_MS: u64 = 7_000;
/// When everything is well no more, in turns.
const OUT_OF_WORKSPACE: std::ops::Range<usize> = 2_000..2_300;
const GARBAGE: std::ops::Range<usize> = 2_600..3_200;
const BLIND: std::ops::Range<usize> = 3_400..3_410;
const SILENCE: std::ops::Range<usize> = 3_800..7_000;
/// When a client asks for a heartbeat every 20 ms, and for that to be stored.
const STORED: usize = 6_500;
/// When the vertebra is powered up again, among garbage.
const SECOND_START: usize = 6_800;
/// Most instructions that half of the turns may take in which the motors are driven.
const MEDIAN_BUDGET: u64 = 6_000;
/// Most instructions of any turn of this script.
const WORST_BUDGET: u64 = 9_000;
/// Most instructions of a turn in which the motors are driven.
const DRIVEN_BUDGET: u64 = 9_000;
/// Longest time that QEMU may take.
const PATIENCE: Duration = Duration::from_secs(60);

#[test]
fn gives_the_same_bits_as_natively() {
    let Some((emulator, image)) = find_tools() else {
        return;
    };
    let node = NodeId::new(RECORDED).expect("one of ten");
    let script = spoil(record(node), node);
    let expected = run_natively(&script);
    check_that_much_happened(&expected);
    let (found, said) = run_in_qemu(&emulator, &image, &script);
    compare(&expected, &found);
    check_cost(&said);
}

/// Finds QEMU and the image. Says what is missing, and fails for that only in CI.
fn find_tools() -> Option<(PathBuf, PathBuf)> {
    let image = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/firmware/board-qemu.elf");
    let path = std::env::var_os("PATH").unwrap_or_default();
    let emulator = std::env::split_paths(&path)
        .map(|folder| folder.join("qemu-system-arm"))
        .find(|candidate| candidate.is_file());
    let missing = match (&emulator, image.is_file()) {
        (None, _) => "no qemu-system-arm; Debian has it in qemu-system-arm",
        (_, false) => "no image; `cargo xtask firmware qemu` builds it",
        (Some(emulator), true) => return Some((emulator.clone(), image)),
    };
    skip(missing);
    None
}

/// One packet for the vertebra.
enum Step {
    Start(Start),
    Turn(Box<Input>),
}

/// Keeps what one vertebra is given.
struct Recorder {
    node: NodeId,
    inputs: Vec<Input>,
}

impl Observer for Recorder {
    fn bus(&mut self, _: &BusEvent) {}

    fn turn(&mut self, id: NodeId, _: &dyn Node, turn: &Turn<'_>, _: &Plant) {
        if id == self.node {
            let frames = turn.frames.iter().copied().collect();
            self.inputs.push(Input {
                now: turn.now,
                sample: *turn.sample,
                frames,
                room: turn.room as u8,
            });
        }
    }

    fn head(&mut self, _: Moment, _: HeadEvent) {}
}

/// Records a vertebra while the eel starts and swims.
fn record(node: NodeId) -> Vec<Input> {
    let mut robot = Robot::new(&Config::new(HeadConfig::new(Gait::SWIM), 1)).expect("a robot");
    let mut recorder = Recorder {
        node,
        inputs: Vec::new(),
    };
    robot.run(RUN_MS * 1_000_000, &mut recorder);
    assert!(
        recorder.inputs.len() as u64 >= RUN_MS - 1,
        "{} turns",
        recorder.inputs.len()
    );
    recorder.inputs
}

/// Numbers that are the same in every run: Knuth's linear congruential generator.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u32 {
        let Self(state) = self;
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*state >> 32) as u32
    }

    fn below(&mut self, limit: u32) -> u32 {
        self.next() % limit
    }
}

/// Makes a recorded run worse.
fn spoil(inputs: Vec<Input>, node: NodeId) -> Vec<Step> {
    let seed = 0xEE1;
    println!("seed {seed:#x}");
    let mut numbers = Numbers(seed);
    let first = inputs.first().map_or(Moment::ZERO, |input| input.now);
    let mut steps = vec![Step::Start(Start {
        node,
        serial: SERIAL,
        now: first,
        failed: false,
    })];
    for (index, mut input) in inputs.into_iter().enumerate() {
        if OUT_OF_WORKSPACE.contains(&index) {
            input.frames.iter_mut().for_each(move_target_out);
        }
        if SILENCE.contains(&index) {
            input.frames.clear();
        }
        if BLIND.contains(&index) {
            input.sample.absolute[index % 3] = None;
            input.sample.supply = Voltage::from_millivolts(numbers.below(40_000) as i32);
        }
        if index == STORED {
            let request = |data: [u8; 8]| {
                Frame::standard(Cob::SdoRequest(node.get()).id(), &data).expect("eight bytes")
            };
            let requests = [
                request([0x2B, 0x17, 0x10, 0, 20, 0, 0, 0]),
                request([0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e']),
            ];
            input.frames.extend(requests);
        }
        if index == SECOND_START {
            steps.push(Step::Start(Start {
                node,
                serial: SERIAL,
                now: input.now,
                failed: true,
            }));
        }
        if GARBAGE.contains(&index) || index >= SECOND_START {
            for _ in 0..numbers.below(4) {
                // A full packet is full enough.
                let _ = input.frames.push(garbage(&mut numbers, node));
            }
        }
        steps.push(Step::Turn(Box::new(input)));
    }
    steps
}

/// Turns a target into one that no wrist can take; its counter and protection stay right.
fn move_target_out(frame: &mut Frame) {
    if let Ok((node, mut target)) = Target::from_frame(frame) {
        target.yaw = Angle::from_milliradians(1_500);
        target.roll = Angle::from_milliradians(-900);
        *frame = target.to_frame(node).expect("eight bytes");
    }
}

/// Makes a frame of any kind, often one that the vertebra listens to.
fn garbage(numbers: &mut Numbers, node: NodeId) -> Frame {
    let own = node.get();
    let listened = [
        Cob::Sync,
        Cob::Target(own),
        Cob::Moment(own),
        Cob::SdoRequest(own),
        Cob::SdoRequest(own),
        Cob::Heartbeat(127),
        Cob::LssRequest,
        Cob::Heartbeat(own),
    ];
    let cob_id = match numbers.below(3) {
        0 => numbers.below(0x800) as u16,
        _ => listened[numbers.below(listened.len() as u32) as usize].id(),
    };
    if cob_id == Cob::SdoRequest(own).id() && numbers.below(2) == 0 {
        return upload_request(numbers, cob_id);
    }
    let data: Vec<u8> = (0..numbers.below(9))
        .map(|_| numbers.next() as u8)
        .collect();
    Frame::standard(cob_id, &data).expect("at most eight bytes")
}

/// Makes a request to read an object that may exist.
fn upload_request(numbers: &mut Numbers, cob_id: u16) -> Frame {
    let area = [0x1000, 0x1010, 0x1400, 0x1A00, 0x2000, 0x2040][numbers.below(6) as usize];
    let [low, high] = (area + numbers.below(16) as u16).to_le_bytes();
    let subindex = numbers.below(4) as u8;
    Frame::standard(cob_id, &[0x40, low, high, subindex, 0, 0, 0, 0]).expect("eight bytes")
}

/// Runs the crate on this machine.
fn run_natively(script: &[Step]) -> Vec<Output> {
    let mut vertebra = None;
    // Outlives a start, as the image's does.
    let mut store = Store::new(RamFlash::new());
    let mut kept = Keepsake::EMPTY;
    let mut outputs = Vec::new();
    for step in script {
        match step {
            Step::Start(start) => {
                let settings = Settings::prototype(start.node, start.serial);
                let (stored, now) = (store.load(), start.now);
                let made = vertebra.insert(Vertebra::with_stored(settings, &stored, now));
                if start.failed {
                    made.stop_after_failure(&kept);
                }
            }
            Step::Turn(input) => {
                let vertebra = vertebra.as_mut().expect("started");
                let mut output = Output {
                    drives: [Drive::Off; 3],
                    trim_ns: 0,
                    chain_out: false,
                    frames: Default::default(),
                };
                let heard = input.frames.iter().copied();
                let (sample, room) = (&input.sample, input.room.into());
                output.drives = turn(vertebra, input.now, heard, sample, room, |frame| {
                    output
                        .frames
                        .push(frame)
                        .expect("room for what was asked for");
                });
                output.trim_ns = vertebra.tick_trim_ns();
                output.chain_out = vertebra.chain_out();
                store::serve(vertebra, &mut store, input.now);
                kept = vertebra.poll_keepsake().unwrap_or(kept);
                outputs.push(output);
            }
        }
    }
    outputs
}

/// Checks that the script is worth comparing: every kind of drive, reports, emergencies.
fn check_that_much_happened(outputs: &[Output]) {
    let count = |wanted: fn(&Drive) -> bool| {
        outputs
            .iter()
            .filter(|output| output.drives.iter().any(wanted))
            .count()
    };
    let driven = count(
        |drive| matches!(drive, Drive::Current(setpoint) if setpoint.current.to_microamps() != 0),
    );
    let braked = count(|drive| matches!(drive, Drive::Brake));
    let free = count(|drive| matches!(drive, Drive::Off));
    let frames = || outputs.iter().flat_map(|output| &output.frames);
    let node = |frame: &&Frame| frame.cob_id().map(Cob::from_id);
    let emergencies = frames()
        .filter(|it| matches!(node(it), Some(Cob::Emergency(_))))
        .count();
    let answers = frames()
        .filter(|it| matches!(node(it), Some(Cob::SdoResponse(_))))
        .count();
    println!(
        "{} turns: {driven} driven, {braked} braked, {free} free; {} frames, {emergencies} \
         emergencies, {answers} SDO answers",
        outputs.len(),
        frames().count()
    );
    assert!(
        driven > 1_000 && braked > 100 && free > 100,
        "the script is too tame"
    );
    assert!(emergencies > 2 && answers > 20, "the script is too tame");
    let stored = Frame::standard(
        Cob::SdoResponse(RECORDED).id(),
        &[0x60, 0x10, 0x10, 1, 0, 0, 0, 0],
    );
    assert!(frames().any(|frame| Some(*frame) == stored));
    let heartbeats = outputs[SECOND_START..SECOND_START + 100]
        .iter()
        .flat_map(|output| &output.frames)
        .filter(|it| matches!(node(it), Some(Cob::Heartbeat(_))))
        .count();
    assert!(heartbeats >= 4, "nothing was stored: {heartbeats}");
}

/// Holds what the turns cost against the budget; instructions in virtual time are the same in every run.
fn check_cost(said: &str) {
    let before = |unit: &str| {
        let words: Vec<&str> = said.split([' ', ',']).collect();
        let place = words.iter().position(|word| *word == unit);
        let number = place.and_then(|place| words.get(place.checked_sub(1)?)?.parse().ok());
        number.unwrap_or_else(|| panic!("no {unit} in {said:?}"))
    };
    let (median, longest, worst): (u64, u64, u64) =
        (before("median"), before("longest"), before("worst"));
    assert!(
        median <= MEDIAN_BUDGET,
        "half of the turns take {median} instructions and more"
    );
    assert!(
        longest <= DRIVEN_BUDGET,
        "a driven turn takes {longest} instructions"
    );
    assert!(worst <= WORST_BUDGET, "a turn takes {worst} instructions");
}

/// Runs the image, and returns its answers and what it said.
fn run_in_qemu(emulator: &Path, image: &Path, script: &[Step]) -> (Vec<u8>, String) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("qemu");
    fs::create_dir_all(&folder).expect("a folder");
    let mut input = Vec::new();
    for step in script {
        let packet = match step {
            Step::Start(start) => start.encode(),
            Step::Turn(turn) => turn.encode(),
        };
        input.extend_from_slice(packet.as_bytes());
    }
    fs::write(folder.join("lockstep.in"), input).expect("the input");
    let _ = fs::remove_file(folder.join("lockstep.out"));

    let start = Instant::now();
    let mut machine = Command::new(emulator)
        .args([
            "-M",
            "netduinoplus2",
            "-display",
            "none",
            "-monitor",
            "none",
            "-serial",
            "none",
        ])
        .args(["-semihosting-config", "enable=on,target=native"])
        .args(["-icount", "shift=0,sleep=off", "-kernel"])
        .arg(image)
        .current_dir(&folder)
        .stdin(Stdio::null())
        .stdout(fs::File::create(folder.join("said")).expect("a file"))
        .spawn()
        .expect("QEMU starts");
    let status = loop {
        if let Some(status) = machine.try_wait().expect("QEMU runs") {
            break status;
        }
        if start.elapsed() > PATIENCE {
            machine.kill().expect("QEMU ends");
            panic!("QEMU did not end within {PATIENCE:?}");
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    let said = fs::read_to_string(folder.join("said")).unwrap_or_default();
    println!(
        "in QEMU, {:.1} s: {}",
        start.elapsed().as_secs_f64(),
        said.trim()
    );
    assert!(status.success(), "the image failed: {status}, {said}");
    let answers = fs::read(folder.join("lockstep.out")).expect("the output");
    (answers, said.trim().to_owned())
}

/// Compares the answers of the image, packet by packet.
fn compare(expected: &[Output], mut found: &[u8]) {
    let hint = "is the image that of this source? `cargo xtask firmware qemu` builds it";
    for (index, expected) in expected.iter().enumerate() {
        let (header, rest) = found
            .split_first_chunk::<HEADER>()
            .expect("as many answers");
        let Header { kind, length } = Header::decode(*header).expect("a header");
        assert_eq!(kind, Kind::Output);
        let (body, rest) = rest.split_at(length);
        let answer = Output::decode(body).expect("an answer");
        assert_eq!(answer, *expected, "turn {index}; {hint}");
        assert_eq!(
            [header.as_slice(), body].concat(),
            expected.encode().as_bytes()
        );
        found = rest;
    }
    assert!(found.is_empty(), "more answers than turns");
}
