//! Calibration step by step and the self test, on a rig whose motors are built in at random.

mod support;

use std::f64::consts::{FRAC_PI_4, TAU};

use eel_canopen::NmtCommand;
use eel_protocol::procedure::{Check, Progress, Reason, Step};
use eel_protocol::{Condition, Mode, State};
use eel_units::{Angle, Current, Voltage};
use eel_vertebra::{Calibration, Drive, Sense, Settings};

use support::{Bench, Random, node, pose};

const SERIAL: u32 = 77;
const HOME: [f64; 3] = [0.0, 0.0, FRAC_PI_4];
const COUNTS: f64 = 88_064.0;
const DEVICE_STATE: u32 = 0x0800_0022;

/// One motor as it happens to be built in, by its own physics.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Built {
    leads: f64,
    counter: f64,
    crank: f64,
    /// What the absolute encoder reads at home, rad.
    zero: f64,
    offset_ma: i32,
}

/// A bench with three cranks that turn as their motors' currents say.
struct Rig {
    bench: Bench,
    built: [Built; 3],
    /// How far each crank is from home, rad.
    turned: [f64; 3],
    /// How far a crank turns with an ampere in a millisecond, rad; 0 where it is stuck.
    gain: [f64; 3],
    /// Whether the bridges carry what they are told.
    is_dead: [bool; 3],
}

impl Rig {
    fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let mut sign = |_| if random.once_in(2) { -1.0 } else { 1.0 };
        let signs: Vec<[f64; 3]> = (0..3).map(|_| [(); 3].map(&mut sign)).collect();
        let built = core::array::from_fn(|motor| Built {
            leads: signs[motor][0],
            counter: signs[motor][1],
            crank: signs[motor][2],
            zero: f64::from(random.within(-3_140, 3_140)) / 1e3,
            offset_ma: random.within(-90, 90),
        });
        let settings = Settings {
            calibration: Calibration::NONE,
            ..Settings::prototype(node(), SERIAL)
        };
        let mut bench = Bench::with(settings);
        bench.measures = false;
        bench.follows = false;
        bench.stream = false;
        let mut rig = Self {
            bench,
            built,
            turned: [0.0; 3],
            gain: [0.02; 3],
            is_dead: [false; 3],
        };
        rig.run(400);
        rig
    }

    /// Lets a millisecond pass: motors turn, sensors read.
    fn tick(&mut self) {
        for (motor, built) in self.built.into_iter().enumerate() {
            let told = match self.bench.drives[motor] {
                Drive::Current(setpoint) if !self.is_dead[motor] => {
                    setpoint.current.to_microamps() - built.offset_ma * 1_000
                }
                _ => 0,
            };
            let amps = f64::from(told) / 1e6;
            self.turned[motor] += built.leads * amps * self.gain[motor];
            let sample = &mut self.bench.sample;
            sample.current[motor] = Current::from_microamps(told + built.offset_ma * 1_000);
            let counts = self.turned[motor] * built.counter * COUNTS / TAU;
            sample.encoder_counts[motor] = counts.floor() as i32;
            let read = built.zero + built.crank * self.turned[motor];
            let read = read - TAU * (read / TAU).round();
            let read = Angle::from_q29((read * f64::from(1 << 29)) as i32);
            sample.absolute[motor] = Some(read);
        }
        self.bench.tick();
    }

    fn run(&mut self, millis: u64) {
        for _ in 0..millis {
            self.tick();
        }
    }

    /// Turns the cranks by hand to so many rad from home.
    fn turn(&mut self, to: [f64; 3], millis: u32) {
        let from = self.turned;
        for step in 1..=millis {
            let share = f64::from(step) / f64::from(millis);
            self.turned = core::array::from_fn(|i| from[i] + (to[i] - from[i]) * share);
            self.tick();
        }
    }

    fn order(&mut self, step: Step) -> Result<(), u32> {
        self.bench.download(0x2060, 1, &[step as u8])
    }

    fn read(&mut self, subindex: u8) -> u8 {
        self.bench.upload(0x2060, subindex).expect("an entry")[0]
    }

    /// Orders a step, lets so much time pass, and returns how it ended.
    fn perform(&mut self, step: Step, millis: u64) -> (Option<Progress>, Option<Reason>, u8) {
        self.order(step).expect("a step that may begin");
        self.run(millis);
        self.outcome()
    }

    fn outcome(&mut self) -> (Option<Progress>, Option<Reason>, u8) {
        let (progress, reason) = (self.read(2), self.read(3));
        (
            Progress::from_code(progress),
            Reason::from_code(reason),
            self.read(4),
        )
    }

    /// Turns the wrist by hand as step 3 wants it: to a yaw of 24° and back, to a roll of 3°.
    fn turn_by_hand(&mut self) {
        for (yaw, roll) in [(420, 0), (0, 0), (0, 52)] {
            let joints = eel_kinematics::Wrist::PAPER
                .inverse(&pose(yaw, 0, roll))
                .expect("a pose")
                .joints;
            let radians = joints.0.map(support::radians);
            self.turn(core::array::from_fn(|i| radians[i] - HOME[i]), 500);
        }
    }

    fn calibrate(&mut self) {
        for step in [Step::Offsets, Step::Home] {
            assert_eq!(self.perform(step, 300), DONE, "{step:?}");
        }
        self.order(Step::Senses).expect("it may begin");
        self.turn_by_hand();
        self.run(20);
        assert_eq!(self.outcome(), DONE);
        self.turn([0.0; 3], 200);
        assert_eq!(self.perform(Step::Leads, 2_500), DONE);
    }
}

const DONE: (Option<Progress>, Option<Reason>, u8) = (Some(Progress::Done), Some(Reason::None), 0);

const fn failed(reason: Reason, motor: u8) -> (Option<Progress>, Option<Reason>, u8) {
    (Some(Progress::Failed), Some(reason), motor)
}

#[test]
fn whatever_is_built_in_how_is_found_and_then_the_wrist_may_run() {
    for seed in 1..=40 {
        let mut rig = Rig::new(seed);
        assert!(
            rig.bench.holds(Condition::Calibration),
            "it is not calibrated yet"
        );
        rig.calibrate();
        let built = rig.built;
        let word = |rig: &mut Rig, subindex| {
            let bytes = rig.bench.upload(0x2022, subindex).expect("an entry");
            bytes
                .iter()
                .rev()
                .fold(0_i64, |all, byte| all << 8 | i64::from(*byte)) as i32
        };
        assert_eq!(word(&mut rig, 1), SERIAL as i32);
        let mut reversed = 0;
        for (motor, built) in built.into_iter().enumerate() {
            let zero = f64::from(word(&mut rig, 2 + motor as u8)) / 1e6;
            let apart = (zero - built.zero).abs();
            assert!(
                apart.min(TAU - apart) < 2e-6,
                "seed {seed}: {zero} of {built:?}"
            );
            let offset = word(&mut rig, 5 + motor as u8);
            assert!(
                (offset - built.offset_ma * 1_000).abs() < 2,
                "{offset} of {built:?}"
            );
            for (sense, sign) in [
                (Sense::Leads, built.leads),
                (Sense::Counter, built.counter),
                (Sense::Crank, built.crank),
            ] {
                reversed |= i32::from(sign < 0.0) << (sense as i32 + motor as i32);
            }
        }
        assert_eq!(word(&mut rig, 8), reversed, "seed {seed}");
        // The self test likes it, and the wrist may be enabled.
        assert_eq!(rig.perform(Step::Test, 600), DONE);
        rig.turn([0.0; 3], 50);
        rig.bench.nmt(NmtCommand::Start);
        rig.bench.stream = true;
        rig.run(400);
        assert_eq!(
            rig.bench.state(),
            State::Ready,
            "{:?}",
            rig.bench.vertebra.status()
        );
        rig.bench.mode = Mode::Damped;
        rig.run(30);
        assert_eq!(rig.bench.state(), State::Damped);
    }
}

#[test]
fn what_goes_wrong_is_said_with_the_motor_and_changes_nothing() {
    let mut rig = Rig::new(3);
    rig.built[1].offset_ma = 170;
    rig.tick();
    assert_eq!(rig.perform(Step::Offsets, 300), failed(Reason::Offset, 2));
    rig.built[1].offset_ma = 0;
    rig.tick();

    rig.order(Step::Home).expect("it may begin");
    rig.turn([0.0, 0.0, 0.02], 50);
    assert_eq!(rig.outcome(), failed(Reason::Moved, 3));

    // Pitch instead of yaw does not reach far enough, whichever way the encoders count.
    rig.turn([0.0; 3], 50);
    assert_eq!(rig.perform(Step::Home, 300), DONE);
    rig.order(Step::Senses).expect("it may begin");
    rig.turn([-0.29, 0.29, 0.06], 500);
    rig.run(60_000);
    assert_eq!(rig.outcome(), failed(Reason::Timeout, 1));

    rig.turn([0.0; 3], 50);
    rig.gain[1] = 0.0;
    assert_eq!(rig.perform(Step::Leads, 2_500), failed(Reason::Still, 2));
    assert!(rig.bench.is_off(), "the motor is let go of");
    assert!(rig.bench.holds(Condition::Calibration));
}

#[test]
fn a_step_needs_a_node_that_neither_runs_nor_is_stopped_nor_busy() {
    let mut rig = Rig::new(5);
    rig.order(Step::Home).expect("it may begin");
    assert_eq!(rig.order(Step::Offsets), Err(DEVICE_STATE), "one at a time");
    rig.bench
        .download(0x2060, 1, &[0])
        .expect("it may be ended");
    assert_eq!(rig.outcome(), failed(Reason::Ended, 0));
    rig.order(Step::Leads).expect("it may begin");
    rig.run(102);
    assert_eq!(rig.bench.state(), State::Test);
    assert!(rig.bench.is_driven());
    // Nothing can be written while a motor may carry current, and the start of the node ends it.
    let torque = 2_000_u16.to_le_bytes();
    assert_eq!(rig.bench.download(0x2020, 7, &torque), Err(DEVICE_STATE));
    rig.bench.nmt(NmtCommand::Start);
    rig.run(5);
    assert_eq!(rig.outcome(), failed(Reason::Stopped, 0));
    assert!(rig.bench.is_off());
    assert_eq!(rig.order(Step::Home), Err(DEVICE_STATE), "operational");
}

#[test]
fn an_emergency_stop_and_a_fault_end_a_step_that_drives_at_once() {
    type Break = fn(&mut Bench);
    let breaks: [(Break, State); 4] = [
        (|bench| bench.sample.emergency_stop = true, State::StopOff),
        (|bench| bench.sample.bridge_fault[2] = true, State::Fault),
        (|bench| bench.sample.over_current[0] = true, State::Fault),
        (
            |bench| bench.sample.supply = Voltage::from_millivolts(12_000),
            State::Fault,
        ),
    ];
    for (number, (act, state)) in breaks.into_iter().enumerate() {
        let mut rig = Rig::new(7);
        rig.order(Step::Leads).expect("it may begin");
        rig.run(110);
        assert!(rig.bench.is_driven());
        act(&mut rig.bench);
        rig.tick();
        assert!(rig.bench.is_off(), "{number}");
        assert_eq!(rig.bench.state(), state, "{number}");
        rig.tick();
        assert_eq!(rig.outcome(), failed(Reason::Stopped, 0), "{number}");
        assert_eq!(rig.order(Step::Home), Err(DEVICE_STATE), "latched");
    }
}

#[test]
fn the_self_test_names_what_fails_and_puts_no_current_on_motors_then() {
    type Break = fn(&mut Rig);
    let breaks: [(Break, Check, u8); 4] = [
        (|rig| rig.built[0].offset_ma += 60, Check::Offsets, 0),
        (|rig| rig.built[1].zero += 0.05, Check::Noise, 0),
        (
            |rig| rig.bench.sample.supply = Voltage::from_millivolts(16_000),
            Check::Supply,
            0,
        ),
        (|rig| rig.is_dead[2] = true, Check::Bridges, 3),
    ];
    for (act, check, motor) in breaks {
        let mut rig = Rig::new(11);
        rig.calibrate();
        rig.run(300);
        rig.order(Step::Test).expect("it may begin");
        act(&mut rig);
        let mut driven = 0;
        for _ in 0..600 {
            rig.tick();
            driven += u32::from(rig.bench.is_driven());
        }
        if rig.bench.state() == State::Fault {
            // What is a fault anyway ends the test as such.
            assert_eq!(rig.outcome(), failed(Reason::Stopped, 0), "{check:?}");
        } else {
            assert_eq!(rig.outcome(), failed(Reason::Checks, motor), "{check:?}");
            let failed = rig.bench.upload(0x2060, 6).expect("an entry");
            assert_eq!(failed, check.mask().to_le_bytes(), "{check:?}");
        }
        assert_eq!(
            driven > 0,
            check == Check::Bridges,
            "{check:?}: {driven} ms"
        );
    }
}
