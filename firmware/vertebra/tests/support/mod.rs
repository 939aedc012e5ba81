//! A vertebra on a bench: a head that sends heartbeats, targets and SYNC, and a wrist that follows.
#![allow(dead_code, reason = "each test file uses its own part of the bench")]

pub mod sdo;

use eel_canopen::{Frame, NmtCommand};
use eel_kinematics::{Joints, Pose, Wrist};
use eel_protocol::emergency::EmergencyReport;
use eel_protocol::{
    Condition, Counter, Effort, HEAD_NODE, LimitCode, Mode, NodeId, PoseReport, State, Target,
};
use eel_units::{Angle, Current, Instant, Temperature, Voltage};
use eel_vertebra::store::{self, RamFlash, Store};
use eel_vertebra::{Drive, Motor, Sample, Settings, Vertebra, turn};

/// The vertebra under test is the third.
pub const NODE: u8 = 3;

/// Returns the node under test.
pub fn node() -> NodeId {
    NodeId::new(NODE).unwrap()
}

/// Returns a pose from milliradians.
pub fn pose(yaw: i32, pitch: i32, roll: i32) -> Pose {
    let [yaw, pitch, roll] = [yaw, pitch, roll].map(Angle::from_milliradians);
    Pose { yaw, pitch, roll }
}

/// Returns an angle in radians.
pub fn radians(angle: Angle) -> f64 {
    f64::from(angle.to_q29()) / f64::from(1 << 29)
}

/// The modes that enable a vertebra.
pub const ENABLING: [Mode; 6] = [
    Mode::Run,
    Mode::Hold,
    Mode::Moment,
    Mode::Motor,
    Mode::Damped,
    Mode::Brake,
];

/// A frame that the vertebra sent, and when.
#[derive(Clone, Copy, Debug)]
pub struct Sent {
    /// In ms since power-up.
    pub at: u64,
    /// What.
    pub frame: Frame,
}

/// A vertebra with everything around it; every switch may be thrown between two ticks.
pub struct Bench {
    /// The vertebra under test.
    pub vertebra: Vertebra,
    /// Time in ms since power-up.
    pub millis: u64,
    /// What the vertebra measures; the encoders are overwritten while `measures` holds.
    pub sample: Sample,
    /// Whether the encoders tell where the wrist is.
    pub measures: bool,
    /// Whether the wrist goes where the vertebra's reference is.
    pub follows: bool,
    /// Where the wrist is.
    pub pose: Pose,
    /// Whether the head's heartbeat comes, each 100 ms.
    pub heartbeat: bool,
    /// Whether target frames come, one before each SYNC.
    pub stream: bool,
    /// Whether SYNC comes.
    pub sync: bool,
    /// Time between two SYNCs in ms.
    pub period: u64,
    /// What the targets ask for.
    pub mode: Mode,
    /// Where the targets lead.
    pub target: Pose,
    /// Bits to flip in the last byte of each target.
    pub damage: u8,
    /// Whether the counter of the targets goes up.
    pub counts: bool,
    /// What the bridges were told last.
    pub drives: [Drive; 3],
    /// How many frames the bus takes in a tick.
    pub room: usize,
    /// Everything that was sent.
    pub sent: Vec<Sent>,
    /// Frames to give to the vertebra in the next tick, before all others.
    pub extra: Vec<Frame>,
    /// What keeps over a loss of power; it takes a tick to store something.
    pub store: Store<RamFlash>,
    counter: Counter,
    beat: u8,
}

impl Bench {
    /// Powers up the prototype.
    pub fn new() -> Self {
        Self::with(Settings::prototype(node(), 77))
    }

    /// Powers up a vertebra with these settings, at home, the head sending "off".
    pub fn with(settings: Settings) -> Self {
        Self {
            vertebra: Vertebra::new(settings, Instant::ZERO),
            millis: 0,
            sample: healthy(),
            measures: true,
            follows: true,
            pose: Pose::HOME,
            heartbeat: true,
            stream: true,
            sync: true,
            period: 10,
            mode: Mode::Off,
            target: Pose::HOME,
            damage: 0,
            counts: true,
            drives: [Drive::Off; 3],
            room: usize::MAX,
            sent: Vec::new(),
            extra: Vec::new(),
            store: Store::new(RamFlash::new()),
            counter: Counter::default(),
            beat: 0,
        }
    }

    /// Powers up and waits until the vertebra may be enabled.
    pub fn ready() -> Self {
        let mut bench = Self::new();
        bench.nmt(NmtCommand::Start);
        bench.run(400);
        assert_eq!(bench.state(), State::Ready, "{:?}", bench.vertebra.status());
        bench
    }

    /// Leaves operation, where settings may be written.
    pub fn maintain(&mut self) {
        self.nmt(NmtCommand::EnterPreOperational);
        self.run(2);
    }

    /// Returns to operation.
    pub fn operate(&mut self) {
        self.nmt(NmtCommand::Start);
        self.run(20);
    }

    /// Powers up and enables.
    pub fn running() -> Self {
        let mut bench = Self::ready();
        bench.mode = Mode::Run;
        bench.run(50);
        assert_eq!(bench.state(), State::Run);
        assert!(bench.is_driven());
        bench
    }

    /// Enables the mode that leads to one of the enabled states.
    pub fn enabled(mode: Mode) -> Self {
        let mut bench = Self::ready();
        bench.mode = mode;
        bench.run(50);
        bench
    }

    /// Queues an NMT command to all nodes for the next tick.
    pub fn nmt(&mut self, command: NmtCommand) {
        self.extra
            .push(Frame::standard(0, &[command as u8, 0]).unwrap());
    }

    /// Takes the power away and gives it back; the flash keeps what it holds.
    pub fn power_cycle(&mut self, settings: Settings) {
        let stored = self.store.load();
        self.vertebra = Vertebra::with_stored(settings, &stored, self.now());
    }

    /// Returns the time.
    pub fn now(&self) -> Instant {
        Instant::from_micros(self.millis * 1_000)
    }

    /// Lets one millisecond pass.
    pub fn tick(&mut self) {
        self.millis += 1;
        let mut frames = core::mem::take(&mut self.extra);
        if self.heartbeat && self.millis.is_multiple_of(100) {
            let id = 0x700 + u16::from(HEAD_NODE);
            frames.push(Frame::standard(id, &[5]).unwrap());
        }
        if self.millis.is_multiple_of(self.period) {
            if self.stream {
                frames.push(self.next_target());
            }
            if self.sync {
                frames.push(self.next_sync());
            }
        }
        self.turn(&frames);
    }

    /// Gives the vertebra these frames and a sample at the present time.
    pub fn turn(&mut self, frames: &[Frame]) {
        self.measure();
        let now = self.now();
        let (at, sent) = (self.millis, &mut self.sent);
        self.drives = turn(
            &mut self.vertebra,
            now,
            frames.iter().copied(),
            &self.sample,
            self.room,
            |frame| sent.push(Sent { at, frame }),
        );
        store::serve(&mut self.vertebra, &mut self.store, now);
        if self.follows
            && let Some(reference) = self.vertebra.reference()
        {
            self.pose = reference;
        }
    }

    /// Lets milliseconds pass.
    pub fn run(&mut self, millis: u64) {
        for _ in 0..millis {
            self.tick();
        }
    }

    /// Lets time pass until the state is `state` and returns how many ms that took.
    pub fn until(&mut self, state: State, limit: u64) -> u64 {
        for passed in 0..=limit {
            if self.state() == state {
                return passed;
            }
            self.tick();
        }
        panic!("{:?} instead of {state:?} after {limit} ms", self.state());
    }

    /// Makes the next target frame of the stream.
    pub fn next_target(&mut self) -> Frame {
        if self.counts {
            self.counter = self.counter.next();
        }
        let Pose { yaw, pitch, roll } = self.target;
        let (mode, counter) = (self.mode, self.counter);
        let id = 0x200 + u16::from(NODE);
        let mut bytes = Target {
            yaw,
            pitch,
            roll,
            mode,
            counter,
        }
        .to_bytes(id);
        bytes[7] ^= self.damage;
        Frame::standard(id, &bytes).unwrap()
    }

    /// Makes the next SYNC.
    pub fn next_sync(&mut self) -> Frame {
        self.beat = self.beat % 240 + 1;
        Frame::standard(0x080, &[self.beat]).unwrap()
    }

    /// Returns the state.
    pub fn state(&self) -> State {
        self.vertebra.state()
    }

    /// Tells whether a condition holds.
    pub fn holds(&self, condition: Condition) -> bool {
        self.vertebra.status().contains(condition)
    }

    /// Tells whether a bridge applies a voltage on purpose.
    pub fn is_driven(&self) -> bool {
        self.drives
            .iter()
            .any(|drive| matches!(drive, Drive::Current(_)))
    }

    /// Tells whether all bridges are off.
    pub fn is_off(&self) -> bool {
        self.drives == [Drive::Off; 3]
    }

    /// Returns the numbers of all emergencies sent since `from` ms.
    pub fn emergencies(&self, from: u64) -> Vec<u16> {
        self.reports(from)
            .into_iter()
            .map(|report| report.code)
            .collect()
    }

    /// Returns all emergencies sent since `from` ms.
    pub fn reports(&self, from: u64) -> Vec<EmergencyReport> {
        let id = 0x080 + u16::from(NODE);
        let sent = self.sent.iter().filter(|sent| sent.at >= from);
        sent.filter(|sent| sent.frame.cob_id() == Some(id))
            .map(|sent| EmergencyReport::from_bytes(sent.frame.data().try_into().unwrap()))
            .collect()
    }

    /// Returns the last pose report.
    pub fn report(&self) -> PoseReport {
        let mut reports = self.sent.iter().rev();
        reports
            .find_map(|sent| PoseReport::from_frame(&sent.frame).ok())
            .unwrap()
            .1
    }

    /// Sends "fault reset", then "off", then "run", as the only way back to motion.
    pub fn recover(&mut self) {
        for (mode, state) in [(Mode::FaultReset, None), (Mode::Off, Some(State::Ready))] {
            self.mode = mode;
            // Long enough for encoders that have to be aligned again.
            self.run(300);
            assert!(
                state.is_none_or(|state| state == self.state()),
                "{:?}",
                self.state()
            );
            assert!(self.is_off());
        }
        self.mode = Mode::Run;
        self.run(20);
        assert_eq!(self.state(), State::Run, "{:?}", self.vertebra.status());
    }

    /// Somebody moves the wrist to a pose in so many milliseconds: what jumps there is no motor.
    pub fn move_to(&mut self, at: Pose, millis: u32) {
        let from = self.pose;
        for step in 1..=millis {
            let between = |from: Angle, to: Angle| {
                let (from, to) = (i64::from(from.to_q29()), i64::from(to.to_q29()));
                Angle::from_q29((from + (to - from) * i64::from(step) / i64::from(millis)) as i32)
            };
            self.pose = Pose {
                yaw: between(from.yaw, at.yaw),
                pitch: between(from.pitch, at.pitch),
                roll: between(from.roll, at.roll),
            };
            self.tick();
        }
    }

    /// Lets the encoders tell where the wrist is.
    fn measure(&mut self) {
        if self.measures {
            let joints = Wrist::PAPER
                .inverse(&self.pose)
                .expect("the bench's pose exists")
                .joints;
            let Joints(angles) = joints;
            self.sample.absolute = angles.map(Some);
            self.sample.encoder_counts = angles.map(counts);
        }
    }
}

/// Lets a good stream ask for every mode and checks that nothing moves.
pub fn stays_off(bench: &mut Bench) {
    bench.heartbeat = true;
    (bench.stream, bench.sync) = (true, true);
    (bench.damage, bench.counts) = (0, true);
    for mode in ENABLING.into_iter().chain([Mode::Off, Mode::Run]) {
        bench.mode = mode;
        for _ in 0..60 {
            bench.tick();
            assert!(
                bench.is_off(),
                "{mode:?} moves a stopped vertebra: {:?}",
                bench.drives
            );
            assert!(bench.state().is_latched() && bench.holds(Condition::Latched));
        }
    }
}

/// Runs a vertebra and takes its targets away until it stands in this part of its stop.
pub fn stopping(state: State) -> Bench {
    let mut bench = Bench::running();
    bench.stream = false;
    bench.until(state, 3_000);
    bench.stream = true;
    bench
}

/// Runs a vertebra and lets the bridge of motor 2 report a fault for one tick.
pub fn faulty() -> Bench {
    let mut bench = Bench::running();
    bench.sample.bridge_fault[1] = true;
    bench.tick();
    bench.sample.bridge_fault[1] = false;
    bench
}

/// Returns the counter of a crank: 88 064 counts a turn, from some number at zero.
pub fn counts(angle: Angle) -> i32 {
    12_345 + (radians(angle) / core::f64::consts::TAU * 88_064.0).round() as i32
}

/// Returns what a healthy vertebra at rest measures.
pub fn healthy() -> Sample {
    let Joints(angles) = Joints::HOME;
    Sample {
        encoder_counts: angles.map(counts),
        absolute: angles.map(Some),
        current: [Current::ZERO; 3],
        supply: Voltage::from_millivolts(24_000),
        board_temperature: Temperature::from_decidegrees(300),
        motor_temperature: [Temperature::from_decidegrees(250); 3],
        bridge_fault: [false; 3],
        over_current: [false; 3],
        sync_age: None,
        chain_in: true,
        emergency_stop: false,
    }
}

/// Returns the limit codes of the last effort report.
pub fn limits(bench: &Bench) -> [LimitCode; 3] {
    let id = 0x280 + u16::from(NODE);
    let mut reports = bench.sent.iter().rev();
    let report = reports
        .find(|sent| sent.frame.cob_id() == Some(id))
        .unwrap();
    Effort::from_bytes(report.frame.data().try_into().unwrap())
        .unwrap()
        .limit
}

/// Returns the torque in N·m that a drive asks of the current loop, if it does.
pub fn torque(drive: Drive) -> Option<f64> {
    match drive {
        Drive::Current(setpoint) => {
            let constant = f64::from(Motor::PROTOTYPE.torque_constant) / 1e6;
            Some(constant * f64::from(setpoint.current.to_microamps()) / 1e6)
        }
        Drive::Off | Drive::Brake => None,
    }
}

/// Pseudo-random numbers: the same seed gives the same ones.
pub struct Random(pub u64);

impl Random {
    /// Returns the next 64 bits (xorshift64*).
    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// Returns a number below `end`.
    pub fn below(&mut self, end: u64) -> u64 {
        (self.next() >> 16) % end
    }

    /// Returns a number within the range.
    pub fn within(&mut self, low: i32, high: i32) -> i32 {
        let span = i64::from(high) - i64::from(low) + 1;
        (i64::from(low) + self.below(span as u64) as i64) as i32
    }

    /// Tells true once in `times`.
    pub fn once_in(&mut self, times: u64) -> bool {
        self.below(times) == 0
    }

    /// Picks one of a list.
    pub fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len() as u64) as usize]
    }
}
