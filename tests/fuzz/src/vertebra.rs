//! A whole vertebra with any frames and any measurements: it never panics, its bridges are off in every
//! state that says so, and it answers afterwards.

use eel_canopen::{Frame, NmtState};
use eel_protocol::{Cob, Counter, HEAD_NODE, Mode, NodeId, State, Target};
use eel_units::{Angle, Current, Duration, Instant, Temperature, Voltage};
use eel_vertebra::store::{RamFlash, Store, Stored, serve};
use eel_vertebra::{Drive, Motor, Sample, Settings, Vertebra};

use crate::draw;
use crate::flash::Failing;
use crate::input::Input;

/// The place of the vertebra in the chain.
const PLACE: u8 = 3;

/// A vertebra with its flash, its measurements and the time.
struct Bench {
    vertebra: Vertebra,
    store: Store<Failing>,
    sample: Sample,
    now: Instant,
    counter: Counter,
}

/// Does with a vertebra what the bytes say.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let mut bench = Bench::new();
    while !input.is_empty() {
        bench.step(&mut input);
    }
    bench.check_alive();
}

impl Bench {
    fn new() -> Self {
        let node = NodeId::new(PLACE).expect("a place");
        let now = Instant::ZERO;
        let vertebra = Vertebra::with_stored(Settings::prototype(node, 1), &Stored::Nothing, now);
        let home = [Angle::from_q29(0), Angle::from_q29(0), Angle::FRAC_PI_4];
        Self {
            vertebra,
            store: Store::new(Failing::new(RamFlash::new())),
            sample: Sample {
                encoder_counts: [0; 3],
                absolute: home.map(Some),
                current: [Current::from_milliamps(0); 3],
                supply: Voltage::from_millivolts(24_000),
                board_temperature: Temperature::from_decidegrees(250),
                motor_temperature: [Temperature::from_decidegrees(250); 3],
                bridge_fault: [false; 3],
                over_current: [false; 3],
                sync_age: None,
                chain_in: true,
                emergency_stop: false,
            },
            now,
            counter: Counter::default(),
        }
    }

    fn step(&mut self, input: &mut Input<'_>) {
        match input.below(16) {
            0..=2 => {
                let id = self.vertebra.node_id().map_or(0xFF, NodeId::get);
                let frame = draw::frame(input, id);
                self.hear(&frame);
            }
            3..=6 => self.beat(input),
            7..=9 => self.measure(input),
            10..=12 => {
                for _ in 0..=input.below(64) {
                    self.tick();
                }
            }
            13 => self.start(),
            14 => {
                self.store.flash_mut().fail_after(input.byte());
                serve(&mut self.vertebra, &mut self.store, self.now);
            }
            _ => {
                let micros = u32::from(input.byte()) * 10_000;
                self.now = self.now + Duration::from_micros(micros);
            }
        }
    }

    fn hear(&mut self, frame: &Frame) {
        self.vertebra.handle_frame(self.now, frame);
        self.drain();
    }

    /// Starts the node, lets the head be heard, and asks for bridges that are off, which arms.
    fn start(&mut self) {
        let id = self.vertebra.node_id().map_or(0, NodeId::get);
        for (cob_id, data) in [(0, &[1, id][..]), (0x700 + u16::from(HEAD_NODE), &[5])] {
            self.hear(&Frame::standard(cob_id, data).expect("two bytes"));
        }
        self.aim([0; 3], Mode::Off);
        for _ in 0..20 {
            self.tick();
        }
        self.aim([0; 3], Mode::Off);
    }

    /// Sends a target as the head does, and SYNC.
    fn beat(&mut self, input: &mut Input<'_>) {
        let angles = input
            .array::<3>()
            .map(|byte| i16::from(byte.cast_signed()) * 40);
        let mode = input.pick(Mode::ALL);
        self.aim(angles, mode);
        for _ in 0..10 {
            self.tick();
        }
    }

    fn aim(&mut self, angles: [i16; 3], mode: Mode) {
        let Some(node) = self.vertebra.node_id() else {
            return;
        };
        let [yaw, pitch, roll] = angles.map(Angle::from_tenth_milliradians);
        self.counter = self.counter.next();
        let target = Target {
            yaw,
            pitch,
            roll,
            mode,
            counter: self.counter,
        };
        self.hear(&target.to_frame(node).expect("a frame"));
        let sync = [self.counter.get() + 1];
        self.hear(&Frame::standard(Cob::Sync.id(), &sync).expect("a byte"));
    }

    /// Changes what is measured, until it is changed again.
    fn measure(&mut self, input: &mut Input<'_>) {
        let motor = input.below(3);
        let sample = &mut self.sample;
        match input.below(10) {
            0 => sample.encoder_counts[motor] = input.long().cast_signed(),
            1 => {
                let step = i32::from(input.byte().cast_signed());
                sample.encoder_counts[motor] = sample.encoder_counts[motor].wrapping_add(step);
            }
            2 => {
                let angle = Angle::from_q29(input.long().cast_signed());
                sample.absolute[motor] = (input.byte() & 1 == 0).then_some(angle);
            }
            3 => sample.current[motor] = Current::from_microamps(input.long().cast_signed()),
            4 => sample.supply = Voltage::from_millivolts(input.long().cast_signed()),
            5 => {
                sample.board_temperature =
                    Temperature::from_decidegrees(input.long().cast_signed());
            }
            6 => {
                sample.motor_temperature[motor] =
                    Temperature::from_decidegrees(input.long().cast_signed());
            }
            7 => sample.bridge_fault[motor] ^= true,
            8 => sample.over_current[motor] ^= true,
            _ => sample.emergency_stop ^= true,
        }
    }

    fn tick(&mut self) {
        self.now = self.now + Duration::from_millis(1);
        let drives = self.vertebra.handle_sample(self.now, &self.sample);
        let state = self.vertebra.state();
        for drive in drives {
            if let Drive::Current(setpoint) = drive {
                let limit = Motor::PROTOTYPE.current_limit;
                assert!(setpoint.current.abs() <= limit, "{setpoint:?}");
            }
            let may_drive = match state {
                State::Run
                | State::Hold
                | State::Moment
                | State::Motor
                | State::Damped
                | State::StopDamped => true,
                State::Brake | State::StopBrake | State::Fault => {
                    !matches!(drive, Drive::Current(_))
                }
                _ => drive == Drive::Off,
            };
            assert!(may_drive, "{drive:?} in {}", state.name());
        }
        self.drain();
    }

    fn drain(&mut self) {
        let mut sent = 0;
        while let Some(frame) = self.vertebra.poll_transmit() {
            sent += 1;
            assert!(sent <= 32, "frames without an end");
            assert!(!frame.is_extended() && !frame.is_remote(), "{frame:?}");
        }
        while self.vertebra.poll_event().is_some() {}
    }

    /// Checks that it boots and answers after a reset, where it has an id.
    fn check_alive(&mut self) {
        self.sample.emergency_stop = false;
        self.tick();
        // What LSS has prepared is done first: an id given, or taken away.
        let reset = |bench: &mut Self| {
            let frame = Frame::standard(0, &[129, 0]).expect("two bytes");
            bench.vertebra.handle_frame(bench.now, &frame);
        };
        reset(self);
        let Some(id) = self.vertebra.node_id() else {
            assert_eq!(self.vertebra.nmt_state(), NmtState::Initialising);
            return;
        };
        let id = u16::from(id.get());
        assert_eq!(
            self.vertebra.poll_transmit(),
            Frame::standard(0x700 + id, &[0])
        );
        self.drain();
        let request = [0x40, 0x00, 0x10, 0, 0, 0, 0, 0];
        let frame = Frame::standard(0x600 + id, &request).expect("eight bytes");
        self.vertebra.handle_frame(self.now, &frame);
        let answer = [0x43, 0x00, 0x10, 0, 0, 0, 3, 0];
        let expected = Frame::standard(0x580 + id, &answer);
        let answers: Vec<_> = std::iter::from_fn(|| self.vertebra.poll_transmit()).collect();
        assert!(answers.iter().any(|frame| Some(frame) == expected.as_ref()));
        self.tick();
    }
}
