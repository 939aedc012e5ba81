//! Whatever the bus and the sensors say: no panic, legal drives, legal states, and the reference
//! inside the workspace.

use eel_canopen::{Frame, NmtCommand};
use eel_kinematics::{Joints, Pose};
use eel_protocol::{Condition, Mode, State};
use eel_units::{Angle, Current, Temperature, Voltage};
use eel_vertebra::{Drive, Limits, Motor, Sample};

use support::{Bench, NODE, Random, counts, healthy, radians};

mod support;

/// Turns of all runs together.
const TURNS: u64 = 1_000_000;
/// Runs, each from power-up with a seed of its own.
const RUNS: u64 = 40;

/// How wild a run is.
#[derive(Clone, Copy, Debug)]
enum Mood {
    /// A healthy vertebra under an orderly head, disturbed now and then.
    Disturbed,
    /// Damaged frames and extreme readings all the time.
    Wild,
}

#[test]
fn a_million_random_turns_break_no_promise() {
    let seed = std::env::var("SEED")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(2026_u64);
    println!("seed {seed} (set SEED for another)");
    let mut driven = 0;
    let mut seen = [0_u64; 16];
    for run in 0..RUNS {
        let mood = if run % 2 == 0 {
            Mood::Disturbed
        } else {
            Mood::Wild
        };
        let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(run) | 1);
        let mut bench = Bench::new();
        bench.nmt(NmtCommand::Start);
        for _ in 0..TURNS / RUNS {
            let before = bench.state();
            disturb(&mut bench, &mut random, mood);
            bench.sent.clear();
            bench.tick();
            check(&bench, before);
            driven += u64::from(bench.is_driven());
            seen[usize::from(bench.state().code())] += 1;
        }
        still_works(&mut bench);
    }
    println!("driven in {driven} turns; turns in each state {seen:?}");
    assert!(driven > TURNS / 50, "the test drives too little: {driven}");
    let was_in = |state: &State| seen[usize::from(state.code())] > 0;
    assert!(State::ALL.iter().all(was_in), "{seen:?}");
}

/// Checks what must hold after any turn.
fn check(bench: &Bench, before: State) {
    let state = bench.state();
    let drives = bench.drives;
    for drive in drives {
        if let Drive::Current(setpoint) = drive {
            let limit = Motor::PROTOTYPE.current_limit;
            assert!(setpoint.current.abs() <= limit, "{setpoint:?}");
        }
    }
    match state {
        State::NotReady | State::SwitchedOff | State::Ready | State::StopOff => {
            assert!(bench.is_off(), "{state:?}: {drives:?}");
        }
        State::Brake | State::StopBrake => assert_eq!(drives, [Drive::Brake; 3]),
        State::Fault => assert!(!bench.is_driven(), "{drives:?}"),
        State::Test => {
            let driven = drives.iter().filter(|it| **it != Drive::Off).count();
            assert!(driven <= 1, "one motor at a time: {drives:?}");
        }
        State::Run
        | State::Hold
        | State::Moment
        | State::Motor
        | State::Damped
        | State::StopDamped => {
            assert!(!drives.contains(&Drive::Off), "{state:?}: {drives:?}");
        }
    }
    if bench.sample.emergency_stop || bench.sample.bridge_fault.contains(&true) {
        assert!(!bench.is_driven() && state.is_latched(), "{state:?}");
    }
    if bench.sample.emergency_stop {
        assert!(bench.is_off());
    }
    if let Some(reference) = bench.vertebra.reference() {
        // The wrist may be up to a quarter outside when it is enabled, and is led back from there.
        let Pose { yaw, pitch, roll } = Limits::PROTOTYPE.workspace;
        let inside = |value, range| radians(value).abs() <= radians(range) * 1.25 + 4e-9;
        assert!(inside(reference.yaw, yaw), "{reference:?}");
        assert!(inside(reference.pitch, pitch), "{reference:?}");
        assert!(inside(reference.roll, roll), "{reference:?}");
        assert!(matches!(state, State::Run | State::Hold));
    }
    assert!(is_legal(before, state), "{before:?} to {state:?}");
    assert!(
        bench.sent.len() <= 16,
        "{} frames in a turn",
        bench.sent.len()
    );
}

/// Tells whether one turn may lead from a state to another; a turn takes many frames, so several
/// steps may lie between, but a latched state is left by a reset alone and ends in an off state.
fn is_legal(from: State, to: State) -> bool {
    let is_enabled = |state| {
        matches!(
            state,
            State::Run | State::Hold | State::Moment | State::Motor | State::Damped | State::Brake
        )
    };
    match (from, to) {
        (from, to) if from == to => true,
        // A reset of the node, a fault and an emergency stop come at any time.
        (_, State::NotReady | State::Fault | State::StopOff) => true,
        // Enabled from ready alone.
        (State::Ready, to) if is_enabled(to) => true,
        (from, to) if is_enabled(from) => {
            is_enabled(to) || matches!(to, State::Ready | State::SwitchedOff | State::StopDamped)
        }
        (State::Ready, State::SwitchedOff | State::StopDamped) => true,
        (State::NotReady, State::SwitchedOff) | (State::SwitchedOff, State::Ready) => true,
        (State::StopDamped, State::StopBrake) => true,
        // Tried while nothing is enabled; it ends where it may have begun.
        (State::NotReady | State::SwitchedOff | State::Ready, State::Test) => true,
        // After a fault reset the same turn's checks may already allow enabling.
        (from, State::SwitchedOff | State::Ready) => from.is_latched(),
        _ => false,
    }
}

/// Throws switches of the bench and adds frames.
fn disturb(bench: &mut Bench, random: &mut Random, mood: Mood) {
    let modes = [
        Mode::Run,
        Mode::Run,
        Mode::Run,
        Mode::Hold,
        Mode::Moment,
        Mode::Motor,
        Mode::Damped,
        Mode::Brake,
    ];
    let often = match mood {
        Mood::Disturbed => 40,
        Mood::Wild => 4,
    };
    if random.once_in(400) {
        // A head that tries to get the vertebra going, or does something else.
        bench.mode = match bench.state() {
            State::Ready if bench.mode == Mode::Off => random.pick(&modes),
            State::NotReady | State::SwitchedOff | State::Ready => Mode::Off,
            state if state.is_latched() && bench.mode != Mode::FaultReset => Mode::FaultReset,
            state if state.is_latched() => Mode::Off,
            _ => random.pick(&modes),
        };
    }
    if random.once_in(20) {
        let angle = |random: &mut Random, range: i32| {
            let range = if random.once_in(10) { range * 8 } else { range };
            Angle::from_tenth_milliradians(random.within(-range, range) as i16)
        };
        bench.target = Pose {
            yaw: angle(random, 4_000),
            pitch: angle(random, 2_000),
            roll: angle(random, 500),
        };
    }
    if random.once_in(often * 100) {
        bench.stream = !random.once_in(3);
        bench.sync = !random.once_in(4);
        bench.heartbeat = !random.once_in(4);
        bench.period = random.pick(&[1, 3, 5, 9, 10, 10, 10, 11, 20]);
        bench.damage = if random.once_in(4) {
            random.next() as u8
        } else {
            0
        };
        bench.follows = !random.once_in(4);
    }
    if random.once_in(often * 4) {
        let count = 1 + random.below(3);
        for _ in 0..count {
            let frame = frame(bench, random);
            bench.extra.push(frame);
        }
    }
    if random.once_in(often * 50) {
        bench.sample = sample(random);
        bench.measures = random.once_in(2);
    } else if random.once_in(often * 5) {
        let (counts, absolute) = (bench.sample.encoder_counts, bench.sample.absolute);
        bench.sample = Sample {
            encoder_counts: counts,
            absolute,
            ..healthy()
        };
        if !bench.measures {
            bench.measures = true;
            bench.pose = Pose::HOME;
        }
    }
}

/// Makes a frame: noise, or one that the node listens to with noise in it.
fn frame(bench: &mut Bench, random: &mut Random) -> Frame {
    let bytes = random.next().to_le_bytes();
    let node = u16::from(NODE);
    let length = if random.once_in(3) {
        random.below(9) as usize
    } else {
        8
    };
    let data = &bytes[..length];
    match random.below(12) {
        0 => Frame::standard(random.next() as u16, data).unwrap(),
        1 => Frame::standard(0x200 + node, data).unwrap(),
        2 => Frame::standard(0x300 + node, data).unwrap(),
        3 => Frame::standard(0x600 + node, data).unwrap(),
        4 | 5 => Frame::standard(0x600 + node, &write(random)).unwrap(),
        6 => Frame::standard(0x080, data).unwrap(),
        7 => bench.next_sync(),
        8 => bench.next_target(),
        9 => Frame::standard(0x77F, &[random.pick(&[0, 4, 5, 127, 9])]).unwrap(),
        10 => {
            let command = random.pick(&[1, 1, 1, 1, 2, 128, 129, 130, 77]);
            Frame::standard(0, &[command, random.pick(&[0, NODE, 9])]).unwrap()
        }
        _ => {
            let id = embedded_can::StandardId::new(0x200 + node).unwrap();
            Frame::remote(id, length as u8).unwrap()
        }
    }
}

/// Makes an SDO request that writes something of the vertebra's, or of the communication's that
/// a test can go on with.
fn write(random: &mut Random) -> [u8; 8] {
    let index = random.pick(&[
        0x2000_u16, 0x2001, 0x2020, 0x2020, 0x2020, 0x2030, 0x2060, 0x1017, 0x1400,
    ]);
    let is_procedure = index == 0x2060;
    let length = if is_procedure {
        1
    } else {
        random.pick(&[1_u8, 2, 4])
    };
    let [low, high] = index.to_le_bytes();
    let value = random
        .pick(&[random.0 as u32, 0, 1, 4_000, u32::MAX])
        .to_le_bytes();
    let [a, b, c, d] = value;
    [
        0x23 | (4 - length) << 2,
        low,
        high,
        if is_procedure {
            1
        } else {
            random.below(13) as u8
        },
        if is_procedure {
            random.below(6) as u8
        } else {
            a
        },
        b,
        c,
        d,
    ]
}

/// Makes a sample of extremes.
fn sample(random: &mut Random) -> Sample {
    let any = |random: &mut Random, ordinary: i32| {
        if random.once_in(2) {
            ordinary
        } else {
            let noise = random.next() as i32;
            random.pick(&[i32::MIN, i32::MAX, 0, -1, noise, noise >> 12, ordinary])
        }
    };
    let Joints(home) = Joints::HOME;
    let healthy = healthy();
    Sample {
        encoder_counts: home.map(|angle| any(random, counts(angle))),
        absolute: home.map(|angle| {
            let angle = Angle::from_q29(any(random, angle.to_q29()));
            (!random.once_in(6)).then_some(angle)
        }),
        current: [0; 3].map(|zero| Current::from_microamps(any(random, zero))),
        supply: Voltage::from_millivolts(any(random, healthy.supply.to_millivolts())),
        board_temperature: Temperature::from_decidegrees(any(random, 300)),
        motor_temperature: [300; 3]
            .map(|ordinary| Temperature::from_decidegrees(any(random, ordinary))),
        bridge_fault: [false; 3].map(|_| random.once_in(12)),
        over_current: [false; 3].map(|_| random.once_in(12)),
        sync_age: None,
        chain_in: random.once_in(2),
        emergency_stop: random.once_in(12),
    }
}

/// Checks that a reset of the node leads back to a vertebra that works.
fn still_works(bench: &mut Bench) {
    let sample = healthy();
    bench.sample = sample;
    bench.measures = true;
    bench.follows = true;
    bench.pose = Pose::HOME;
    bench.target = Pose::HOME;
    (bench.stream, bench.sync, bench.heartbeat) = (true, true, true);
    (bench.period, bench.damage, bench.counts) = (10, 0, true);
    bench.extra.clear();
    bench.mode = Mode::Off;
    bench.nmt(NmtCommand::ResetNode);
    bench.nmt(NmtCommand::Start);
    bench.run(500);
    // The currents that it was told may have left windings that have to cool.
    let mut waited = 0;
    while bench.holds(Condition::Temperature) {
        bench.run(100);
        waited += 100;
        assert!(waited < 20_000, "{:?}", bench.vertebra.status());
    }
    if bench.state() == State::StopOff {
        // It was stopped when it was reset, and still is.
        bench.mode = Mode::FaultReset;
        bench.run(20);
        bench.mode = Mode::Off;
        bench.run(20);
    }
    assert_eq!(bench.state(), State::Ready, "{:?}", bench.vertebra.status());
    bench.mode = Mode::Run;
    bench.target = Pose {
        yaw: Angle::from_milliradians(200),
        ..Pose::HOME
    };
    bench.run(300);
    assert_eq!(bench.state(), State::Run, "{:?}", bench.vertebra.status());
    assert_eq!(bench.vertebra.reference(), Some(bench.target));
    assert!(bench.is_driven());
}
