//! The head: one beat after another.

use eel_kinematics::Pose;
use eel_protocol::emergency::EmergencyReport;
use eel_protocol::{
    Cob, Frame, FrameError, HEAD_HEARTBEAT_MS, HEAD_NODE, Mode, Moment, NodeId, PoseReport,
    SYNC_COUNTER_OVERFLOW, SYNC_PERIOD_US, VERTEBRAE,
};
use eel_units::{Duration, Instant};
use heapless::Deque;

use crate::gait::Gait;
use crate::node::{NodeStatus, Stage, Tracker, Wish, smooth_step};
use crate::report::{Event, EventQueue};

/// Frames that wait to be sent: two beats' worth.
const WAITING: usize = 48;
/// How long the gait waits for all vertebrae before it goes on with those that are there.
const PATIENCE: Duration = Duration::from_millis(3_000);
/// Longest time in which the gait fades out, in µs.
const LONGEST_FADE_US: u32 = 2_000_000;
/// One in Q15.
const ONE: i64 = 1 << 15;
/// How long the straight eel is held before its drives are switched off.
const STRAIGHTENED: Duration = Duration::from_millis(500);
/// Shortest and longest time between two SYNCs that vertebrae follow.
const SYNC_PERIODS: (Duration, Duration) = (Duration::from_millis(5), Duration::from_millis(20));
const HEARTBEAT_PERIOD: Duration = Duration::from_millis(HEAD_HEARTBEAT_MS as u32);
/// How long "off" is sent before the nodes leave operation.
const SWITCHED_OFF: Duration = Duration::from_millis(50);
/// How long vertebrae may take to report that they are off.
const LAST_WORD: Duration = Duration::from_millis(1_000);
/// NMT commands (CiA 301, 7.2.8.3.1.1).
const NMT_START: u8 = 1;
const NMT_PRE_OPERATIONAL: u8 = 128;
/// The head's own state in its heartbeat: operational.
const OPERATIONAL: u8 = 5;

/// How the head is set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    /// What vertebrae are brought to do.
    pub task: Task,
    /// Time between two SYNCs, 5–20 ms; [`Head::new`] takes the nearest of these.
    pub sync_period: Duration,
    /// Which vertebrae are expected, bit 0 the first.
    pub expected: u16,
    /// Which vertebrae are led at all; the others are neither started nor told anything.
    pub led: u16,
}

/// What vertebrae are brought to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Swim: each follows its pose of a gait.
    Swim(Gait),
    /// Take this pose and keep it.
    Pose(Pose),
    /// Be in a mode in which the pose of a target means nothing: hold, moment, motor, damped or brake.
    Mode(Mode),
}

impl Task {
    /// Returns the mode that targets ask for.
    const fn mode(&self) -> Mode {
        match self {
            Self::Swim(_) | Self::Pose(_) => Mode::Run,
            Self::Mode(mode) => *mode,
        }
    }
}

impl Config {
    /// Lets all ten vertebrae swim at the usual beat.
    pub const fn new(gait: Gait) -> Self {
        const ALL: u16 = (1 << VERTEBRAE) - 1;
        Self {
            task: Task::Swim(gait),
            sync_period: Duration::from_micros(SYNC_PERIOD_US),
            expected: ALL,
            led: ALL,
        }
    }

    /// Brings only these vertebrae, bit 0 the first, to do something.
    pub const fn only(led: u16, task: Task) -> Self {
        Self {
            task,
            sync_period: Duration::from_micros(SYNC_PERIOD_US),
            expected: led,
            led,
        }
    }

    /// Tells whether a vertebra is led.
    const fn leads(&self, id: NodeId) -> bool {
        self.led & (1 << id.index()) != 0
    }
}

/// What the head is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Bringing vertebrae up; they hold still.
    Starting,
    /// The gait runs.
    Swimming,
    /// The gait fades out and the eel straightens.
    Straightening,
    /// Drives are being switched off.
    SwitchingOff,
    /// Everything is off.
    Stopped,
}

/// The head of the eel.
#[derive(Clone, Debug)]
pub struct Head {
    config: Config,
    phase: Phase,
    since: Instant,
    gait_start: Option<Instant>,
    trackers: [Tracker; VERTEBRAE as usize],
    next_sync: Instant,
    next_heartbeat: Instant,
    sync_counter: u8,
    waiting: Deque<Frame, WAITING>,
    dropped: u32,
    events: EventQueue,
}

impl Head {
    /// Starts a head that sends its first SYNC and heartbeat at once.
    pub fn new(mut config: Config, now: Instant) -> Self {
        let (shortest, longest) = SYNC_PERIODS;
        config.sync_period = config.sync_period.clamp(shortest, longest);
        let mut ids = NodeId::all();
        let first = NodeId::FIRST;
        let mode = config.task.mode();
        Self {
            config,
            phase: Phase::Starting,
            since: now,
            gait_start: None,
            trackers: core::array::from_fn(|_| Tracker::new(ids.next().unwrap_or(first), mode)),
            next_sync: now,
            next_heartbeat: now,
            sync_counter: 0,
            waiting: Deque::new(),
            dropped: 0,
            events: EventQueue::default(),
        }
    }

    /// Takes a frame from the bus.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        let Some(id) = frame.cob_id() else { return };
        let cob = Cob::from_id(id);
        let Some(node) = cob.node().and_then(NodeId::new) else {
            return;
        };
        let is_led = self.config.leads(node);
        let Some(tracker) = self.trackers.get_mut(node.index()).filter(|_| is_led) else {
            return;
        };
        match (cob, frame.data()) {
            (Cob::Heartbeat(_), &[state]) => {
                let wanted = matches!(self.phase, Phase::Starting | Phase::Swimming);
                tracker.hear_heartbeat(now, state & 0x7F, wanted, &mut self.events);
            }
            (Cob::Pose(_), _) => match PoseReport::from_frame(frame) {
                Ok((_, report)) => tracker.hear_pose(now, &report, &mut self.events),
                Err(FrameError::Identifier) => {}
                Err(_) => tracker.hear_bad_report(),
            },
            (Cob::Emergency(_), data) => {
                if let Ok(bytes) = data.try_into() {
                    let report = EmergencyReport::from_bytes(bytes);
                    self.events.push(Event::Emergency(node, report));
                }
            }
            _ => {}
        }
    }

    /// Lets time pass: call it at least once a millisecond.
    pub fn tick(&mut self, now: Instant) {
        for tracker in &mut self.trackers {
            tracker.watch(now, &mut self.events);
        }
        self.advance(now);
        if now >= self.next_heartbeat {
            self.next_heartbeat = following(self.next_heartbeat, HEARTBEAT_PERIOD, now);
            self.send(Cob::Heartbeat(HEAD_NODE), &[OPERATIONAL]);
        }
        if matches!(self.phase, Phase::Starting | Phase::Swimming) {
            self.start_nodes(now);
        }
        if now >= self.next_sync {
            self.next_sync = following(self.next_sync, self.config.sync_period, now);
            self.beat(now);
        }
    }

    /// Returns the next frame to send.
    pub fn poll_transmit(&mut self) -> Option<Frame> {
        self.waiting.pop_front()
    }

    /// Returns the next thing that happened.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop()
    }

    /// Returns how many events were forgotten because nobody polled them.
    pub const fn events_dropped(&self) -> u32 {
        self.events.dropped()
    }

    /// Lets the gait fade out, straightens the eel and switches it off; where there is no gait, switches
    /// off.
    pub fn stop(&mut self, now: Instant) {
        if matches!(self.phase, Phase::Starting | Phase::Swimming) {
            self.enter(now, self.stopping());
        }
    }

    /// Returns the phase with which a stop begins.
    const fn stopping(&self) -> Phase {
        match self.config.task {
            Task::Swim(_) => Phase::Straightening,
            Task::Pose(_) | Task::Mode(_) => Phase::SwitchingOff,
        }
    }

    /// Sets what RPDO2 tells a vertebra with every target while it does its task; nothing at first. The
    /// vertebra must have been told to listen to it.
    pub fn set_moment(&mut self, id: NodeId, moment: Option<Moment>) {
        if let Some(tracker) = self.trackers.get_mut(id.index()) {
            tracker.moment = moment;
        }
    }

    /// Acknowledges the stops that are latched now. Whoever calls it knows that moving is safe.
    pub fn reset(&mut self) {
        for tracker in &mut self.trackers {
            tracker.reset();
        }
    }

    /// Returns what the head is doing.
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// Returns what is known of a vertebra.
    pub fn node(&self, id: NodeId) -> Option<NodeStatus> {
        self.trackers.get(id.index()).map(Tracker::status)
    }

    /// Returns how many vertebrae do their task.
    pub fn running(&self) -> usize {
        self.trackers
            .iter()
            .filter(|tracker| tracker.status().stage == Stage::Running)
            .count()
    }

    /// Returns how many frames found no room to wait.
    pub const fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Moves from one phase to the next.
    fn advance(&mut self, now: Instant) {
        let elapsed = now.since(self.since);
        match self.phase {
            Phase::Starting if self.running() > 0 && (self.all_run() || elapsed >= PATIENCE) => {
                self.gait_start = Some(now);
                if matches!(self.config.task, Task::Swim(_)) {
                    self.events.push(Event::GaitStarted);
                }
                self.enter(now, Phase::Swimming);
            }
            Phase::Straightening
                if elapsed.to_micros() >= self.fade() + STRAIGHTENED.to_micros() =>
            {
                self.enter(now, Phase::SwitchingOff);
            }
            Phase::SwitchingOff
                if elapsed >= LAST_WORD || elapsed >= SWITCHED_OFF && self.none_is_driven() =>
            {
                self.end(now);
            }
            _ => {}
        }
    }

    /// Ends the nodes' operation, and tells which of them never reported to be off.
    fn end(&mut self, now: Instant) {
        for tracker in self.trackers.iter().filter(|tracker| is_driven(tracker)) {
            self.events.push(Event::NotStopped(tracker.id()));
        }
        if self.none_is_driven() {
            self.events.push(Event::Stopped);
        }
        let config = self.config;
        if NodeId::all().all(|id| config.leads(id)) {
            self.send(Cob::Nmt, &[NMT_PRE_OPERATIONAL, 0]);
        } else {
            for id in NodeId::all().filter(|id| config.leads(*id)) {
                self.send(Cob::Nmt, &[NMT_PRE_OPERATIONAL, id.get()]);
            }
        }
        self.enter(now, Phase::Stopped);
    }

    fn none_is_driven(&self) -> bool {
        !self.trackers.iter().any(is_driven)
    }

    fn enter(&mut self, now: Instant, phase: Phase) {
        self.phase = phase;
        self.since = now;
    }

    fn all_run(&self) -> bool {
        let expects = |id: NodeId| self.config.expected & (1 << id.index()) != 0;
        self.trackers
            .iter()
            .filter(|tracker| expects(tracker.id()))
            .all(|tracker| tracker.status().stage == Stage::Running)
    }

    fn start_nodes(&mut self, now: Instant) {
        for index in 0..self.trackers.len() {
            let Some(tracker) = self.trackers.get_mut(index) else {
                break;
            };
            if tracker.wants_start(now) {
                let id = tracker.id().get();
                self.send(Cob::Nmt, &[NMT_START, id]);
            }
        }
    }

    /// Sends SYNC, then the targets that the next SYNC will release.
    fn beat(&mut self, now: Instant) {
        self.sync_counter = if self.sync_counter >= SYNC_COUNTER_OVERFLOW {
            1
        } else {
            self.sync_counter + 1
        };
        self.send(Cob::Sync, &[self.sync_counter]);
        if self.phase == Phase::Stopped {
            return;
        }
        let wish = match self.phase {
            Phase::Starting | Phase::Swimming => Wish::Run,
            Phase::Straightening => Wish::Keep,
            Phase::SwitchingOff | Phase::Stopped => Wish::Off,
        };
        let poses = self.gait_poses(now);
        for (index, pose) in poses.into_iter().enumerate() {
            let Some(tracker) = self.trackers.get_mut(index) else {
                break;
            };
            if tracker.status().stage == Stage::Missing {
                continue;
            }
            let target = tracker.next_target(now, wish, pose);
            let id = tracker.id();
            let is_running = tracker.status().stage == Stage::Running;
            let moment = tracker.moment.filter(|_| is_running);
            if let Some(frame) = target.to_frame(id) {
                self.queue(frame);
            }
            if let Some(moment) = moment {
                self.send(Cob::Moment(id.get()), &moment.to_bytes());
            }
        }
    }

    /// Returns the gait's poses at `now`, scaled by the start and the stop.
    fn gait_poses(&self, now: Instant) -> [Pose; VERTEBRAE as usize] {
        let gait = match self.config.task {
            Task::Swim(gait) => gait,
            Task::Pose(pose) => return [pose; VERTEBRAE as usize],
            Task::Mode(_) => return [Pose::default(); VERTEBRAE as usize],
        };
        let Some(start) = self.gait_start else {
            return [Pose::default(); VERTEBRAE as usize];
        };
        let fade = self.fade();
        let grown = share(self.gait_start, now, 2 * fade);
        let scale = match self.phase {
            Phase::Swimming => grown,
            Phase::Straightening => {
                let reached = share(self.gait_start, self.since, 2 * fade);
                (reached * (ONE - share(Some(self.since), now, fade))) >> 15
            }
            _ => 0,
        };
        gait.poses(now.to_micros().saturating_sub(start.to_micros()), scale)
    }

    /// Returns how long the gait takes to fade out in µs: one cycle, at most two seconds.
    fn fade(&self) -> u32 {
        match self.config.task {
            Task::Swim(gait) => gait.period_us().min(LONGEST_FADE_US),
            Task::Pose(_) | Task::Mode(_) => 0,
        }
    }

    fn send(&mut self, cob: Cob, data: &[u8]) {
        if let Some(frame) = Frame::standard(cob.id(), data) {
            self.queue(frame);
        }
    }

    fn queue(&mut self, frame: Frame) {
        if self.waiting.push_back(frame).is_err() {
            self.dropped = self.dropped.saturating_add(1);
        }
    }
}

/// Returns when something periodic that was due at `due` is due again. The beat keeps its grid; only
/// a pause of a whole period starts it anew, so that nothing is sent in a burst.
fn following(due: Instant, period: Duration, now: Instant) -> Instant {
    let next = due + period;
    if next > now { next } else { now + period }
}

/// Tells whether a vertebra that is there last reported a state in which its motors are driven.
fn is_driven(tracker: &Tracker) -> bool {
    let status = tracker.status();
    status.stage != Stage::Missing && status.state.is_driven()
}

/// Returns how far `now` is on a smooth step of `length_us` that began at `since`, in Q15.
fn share(since: Option<Instant>, now: Instant, length_us: u32) -> i64 {
    let Some(since) = since else { return 0 };
    smooth_step((i64::from(now.since(since).to_micros()) << 15) / i64::from(length_us.max(1)))
}
