//! Vertebrae that only answer as the protocol says, and a bus without delay between them and a head.
#![allow(dead_code, reason = "every test target uses another part")]

use eel_head::{Config, Event, Gait, Head, Stage};
use eel_kinematics::Pose;
use eel_protocol::{Cob, Counter, Frame, Mode, NodeId, PoseReport, State, Target};
use eel_units::{Angle, Instant};

/// Milliseconds between two heartbeats of a vertebra.
const HEARTBEAT_MS: u64 = 200;

/// A vertebra as far as the head can tell.
pub struct Fake {
    pub id: NodeId,
    /// Whether it has power.
    pub on: bool,
    /// Whether nothing stands against enabling it.
    pub willing: bool,
    /// Whether it follows a "run", or refuses, stays ready and wants an "off" first.
    pub obeys: bool,
    pub operational: bool,
    pub state: State,
    pub pose: Pose,
    /// Targets that SYNCs released, with the time in ms.
    pub targets: Vec<(u64, Target)>,
    /// Frames that the next tick sends.
    pub outbox: Vec<Frame>,
    armed: bool,
    waiting: Option<Target>,
    counter: Counter,
    boots_at: u64,
}

impl Fake {
    fn new(id: NodeId) -> Self {
        let tilt = i16::from(id.get()) * 50;
        Self {
            id,
            on: true,
            willing: true,
            obeys: true,
            operational: false,
            state: State::NotReady,
            pose: Pose {
                yaw: Angle::from_tenth_milliradians(-tilt),
                pitch: Angle::from_tenth_milliradians(tilt),
                roll: Angle::from_tenth_milliradians(7),
            },
            targets: Vec::new(),
            outbox: Vec::new(),
            armed: false,
            waiting: None,
            counter: Counter::default(),
            boots_at: u64::from(id.get()),
        }
    }

    /// Starts anew at `now_ms`.
    pub fn boot(&mut self, now_ms: u64) {
        let kept = std::mem::take(&mut self.targets);
        let pose = self.pose;
        *self = Self {
            targets: kept,
            pose,
            boots_at: now_ms,
            ..Self::new(self.id)
        };
    }

    fn tick(&mut self, now_ms: u64) -> Vec<Frame> {
        let mut sent = std::mem::take(&mut self.outbox);
        if !self.on || now_ms < self.boots_at {
            return Vec::new();
        }
        let age = now_ms - self.boots_at;
        let state = if self.operational { 5 } else { 0x7F };
        if age == 0 {
            sent.push(frame(Cob::Heartbeat(self.id.get()), &[0]));
        } else if age.is_multiple_of(HEARTBEAT_MS) {
            sent.push(frame(Cob::Heartbeat(self.id.get()), &[state]));
        }
        if age >= 30 && self.state == State::NotReady {
            self.state = State::SwitchedOff;
        }
        if self.state == State::SwitchedOff && self.willing {
            self.state = State::Ready;
        } else if self.state == State::Ready && !self.willing {
            self.state = State::SwitchedOff;
        }
        sent
    }

    fn hear(&mut self, now_ms: u64, heard: &Frame) {
        if !self.on || now_ms < self.boots_at {
            return;
        }
        let for_me = |node: u8| node == 0 || node == self.id.get();
        match (heard.cob_id().map(Cob::from_id), heard.data()) {
            (Some(Cob::Nmt), &[1, node]) if for_me(node) => self.operational = true,
            (Some(Cob::Nmt), &[128, node]) if for_me(node) => self.operational = false,
            (Some(Cob::Target(node)), _) if node == self.id.get() => {
                let (_, target) = Target::from_frame(heard).expect("the head's targets are sound");
                self.waiting = Some(target);
            }
            (Some(Cob::Sync), _) if self.operational => self.synchronise(now_ms),
            _ => {}
        }
    }

    fn synchronise(&mut self, now_ms: u64) {
        let Pose { yaw, pitch, roll } = self.pose;
        self.counter = self.counter.next();
        let report = PoseReport {
            yaw,
            pitch,
            roll,
            state: self.state,
            counter: self.counter,
        };
        let id = Cob::Pose(self.id.get()).id();
        self.outbox
            .push(Frame::standard(id, &report.to_bytes(id)).unwrap());
        let Some(target) = self.waiting.take() else {
            return;
        };
        self.targets.push((now_ms, target));
        let Target {
            yaw,
            pitch,
            roll,
            mode,
            ..
        } = target;
        match mode {
            Mode::FaultReset if self.state.is_latched() => {
                self.state = State::SwitchedOff;
                self.armed = false;
            }
            _ if self.state.is_latched() => {}
            Mode::Off => {
                self.armed = true;
                if self.state.is_driven() {
                    self.state = State::Ready;
                }
            }
            Mode::FaultReset => {}
            mode if self.state.is_driven() || (self.armed && self.ready()) => {
                self.state = match mode {
                    Mode::Hold => State::Hold,
                    Mode::Moment => State::Moment,
                    _ => State::Run,
                };
                if mode == Mode::Run {
                    self.pose = Pose { yaw, pitch, roll };
                }
            }
            _ => self.armed = false,
        }
    }

    fn ready(&self) -> bool {
        self.state == State::Ready && self.obeys
    }
}

/// A head and ten fakes.
pub struct Spine {
    pub head: Head,
    pub nodes: Vec<Fake>,
    pub now_ms: u64,
    /// What the head sent, with the time in ms.
    pub sent: Vec<(u64, Frame)>,
    /// What the head told, with the time in ms.
    pub events: Vec<(u64, Event)>,
    /// Whether vertebrae hear the head.
    pub connected: bool,
}

impl Spine {
    pub fn new() -> Self {
        Self::with(Config::new(Gait::SWIM))
    }

    pub fn with(config: Config) -> Self {
        Self {
            head: Head::new(config, Instant::ZERO),
            nodes: NodeId::all().map(Fake::new).collect(),
            now_ms: 0,
            sent: Vec::new(),
            events: Vec::new(),
            connected: true,
        }
    }

    /// A spine that has been swimming for a second at full amplitude.
    pub fn swimming() -> Self {
        let mut spine = Self::new();
        spine.run(4_000);
        assert_eq!(spine.head.running(), 10, "all ten swim");
        spine
    }

    pub fn now(&self) -> Instant {
        Instant::from_micros(self.now_ms * 1_000)
    }

    /// Lets milliseconds pass.
    pub fn run(&mut self, millis: u64) {
        for _ in 0..millis {
            let now = self.now();
            for node in &mut self.nodes {
                for frame in node.tick(self.now_ms) {
                    self.head.handle_frame(now, &frame);
                }
            }
            self.head.tick(now);
            while let Some(frame) = self.head.poll_transmit() {
                self.sent.push((self.now_ms, frame));
                if self.connected {
                    for node in &mut self.nodes {
                        node.hear(self.now_ms, &frame);
                    }
                }
            }
            while let Some(event) = self.head.poll_event() {
                self.events.push((self.now_ms, event));
            }
            self.now_ms += 1;
        }
    }

    /// Returns a vertebra by its node id.
    pub fn node(&mut self, id: u8) -> &mut Fake {
        &mut self.nodes[usize::from(id) - 1]
    }

    pub fn stage(&self, id: u8) -> Stage {
        self.head.node(node_id(id)).expect("a vertebra").stage
    }

    /// Returns when the head first told an event from `from_ms` on.
    pub fn told(&self, event: Event, from_ms: u64) -> Option<u64> {
        let mut events = self.events.iter();
        events
            .find(|(at, other)| *at >= from_ms && *other == event)
            .map(|(at, _)| *at)
    }

    /// Returns when the head sent a frame, and its data.
    pub fn sent_as(&self, cob: Cob) -> Vec<(u64, Vec<u8>)> {
        let of_it = self
            .sent
            .iter()
            .filter(|(_, frame)| frame.cob_id() == Some(cob.id()));
        of_it
            .map(|(at, frame)| (*at, frame.data().to_vec()))
            .collect()
    }

    /// Returns the targets that the head sent to a vertebra, with the time in ms.
    pub fn targets(&self, id: u8) -> Vec<(u64, Target)> {
        let of_it = self.sent.iter().filter_map(|(at, frame)| {
            let (node, target) = Target::from_frame(frame).ok()?;
            (node.get() == id).then_some((*at, target))
        });
        of_it.collect()
    }
}

pub fn node_id(id: u8) -> NodeId {
    NodeId::new(id).expect("1 to 10")
}

pub fn frame(cob: Cob, data: &[u8]) -> Frame {
    Frame::standard(cob.id(), data).expect("at most eight bytes")
}

/// Returns the largest difference of two poses' angles in 10⁻⁴ rad.
pub fn apart(one: Pose, other: Pose) -> u16 {
    let raw = Angle::to_tenth_milliradians;
    [
        (one.yaw, other.yaw),
        (one.pitch, other.pitch),
        (one.roll, other.roll),
    ]
    .into_iter()
    .map(|(one, other)| raw(one).abs_diff(raw(other)))
    .max()
    .unwrap_or(0)
}

pub fn pose_of(target: &Target) -> Pose {
    Pose {
        yaw: target.yaw,
        pitch: target.pitch,
        roll: target.roll,
    }
}
