//! One vertebra as the head sees it, and what it is told next.

use eel_kinematics::Pose;
use eel_protocol::{Counter, Mode, Moment, NodeId, PoseReport, State, Target};
use eel_units::{Angle, Duration, Instant};

use crate::report::{Event, EventQueue};

/// Silence after which a vertebra counts as lost: two and a half heartbeats.
const SILENCE: Duration = Duration::from_millis(500);
/// Time between two NMT commands to a node that does not follow.
const NMT_RETRY: Duration = Duration::from_millis(50);
/// Time in which a vertebra is led from where it is to where the gait wants it.
const BLEND: Duration = Duration::from_millis(1_000);
/// "Off" targets before the first "run": one arms the vertebra, the others may get lost.
const OFFS: u8 = 3;
/// "Run" targets without effect, after which the vertebra is told "off" again: one that refused
/// wants that before the next "run".
const RUNS: u8 = 20;
/// One in Q15.
const ONE: i64 = 1 << 15;

/// How far a vertebra is from following the gait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Not heard of, or silent.
    Missing,
    /// On the bus, not yet operational.
    Booted,
    /// Operational, not yet enabled.
    Started,
    /// Being asked to run.
    Enabling,
    /// Running.
    Running,
    /// Stopped or at fault until a reset.
    Latched,
}

/// What is known of a vertebra.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeStatus {
    /// How far it is.
    pub stage: Stage,
    /// The state that it last reported; not ready while it is silent or has not started.
    pub state: State,
    /// The pose that it last reported.
    pub pose: Pose,
    /// Pose frames whose protection did not match.
    pub bad_reports: u32,
    /// Pose frames that the counter shows never to have arrived.
    pub lost_reports: u32,
    /// Times that it booted while being watched.
    pub boots: u32,
}

/// What the head does with all nodes at the moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wish {
    /// Drives off.
    Off,
    /// Those that run go on; no other begins.
    Keep,
    /// Follow the targets.
    Run,
}

/// The head's record of one vertebra.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tracker {
    id: NodeId,
    /// The mode of its task.
    mode: Mode,
    /// What RPDO2 tells it.
    pub moment: Option<Moment>,
    status: NodeStatus,
    heard: Option<Instant>,
    commanded: Option<Instant>,
    counter: Counter,
    report_counter: Option<Counter>,
    offs: u8,
    runs: u8,
    reset_wanted: bool,
    run_since: Instant,
    start_pose: Pose,
}

impl Tracker {
    pub fn new(id: NodeId, mode: Mode) -> Self {
        Self {
            id,
            mode,
            moment: None,
            status: NodeStatus {
                stage: Stage::Missing,
                state: State::NotReady,
                pose: Pose::default(),
                bad_reports: 0,
                lost_reports: 0,
                boots: 0,
            },
            heard: None,
            commanded: None,
            counter: Counter::default(),
            report_counter: None,
            offs: 0,
            runs: 0,
            reset_wanted: false,
            run_since: Instant::ZERO,
            start_pose: Pose::default(),
        }
    }

    pub const fn status(&self) -> NodeStatus {
        self.status
    }

    pub const fn id(&self) -> NodeId {
        self.id
    }

    /// Acknowledges a stop that is latched now with the next target; never one that comes later.
    pub fn reset(&mut self) {
        self.reset_wanted = self.status.stage == Stage::Latched;
    }

    /// Enters a stage. What was counted or asked for in another holds no longer.
    fn enter(&mut self, stage: Stage) {
        self.status.stage = stage;
        self.offs = 0;
        self.runs = 0;
        self.reset_wanted = false;
        if matches!(stage, Stage::Missing | Stage::Booted) {
            self.status.state = State::NotReady;
            self.report_counter = None;
            self.commanded = None;
        }
    }

    /// Takes a heartbeat or the boot-up message. `wanted` tells whether the node is to operate, so
    /// that its leaving operation is news.
    pub fn hear_heartbeat(
        &mut self,
        now: Instant,
        state: u8,
        wanted: bool,
        events: &mut EventQueue,
    ) {
        const BOOT_UP: u8 = 0;
        const OPERATIONAL: u8 = 5;
        self.heard = Some(now);
        let outside = matches!(self.status.stage, Stage::Missing | Stage::Booted);
        if state == OPERATIONAL {
            if outside {
                self.enter(Stage::Started);
            }
            return;
        }
        let boots = state == BOOT_UP;
        if boots {
            self.status.boots = self.status.boots.saturating_add(1);
        }
        if boots || self.status.stage != Stage::Booted {
            self.enter(Stage::Booted);
            if boots || wanted {
                events.push(Event::Booted(self.id));
            }
        }
    }

    /// Takes a pose frame.
    pub fn hear_pose(&mut self, now: Instant, report: &PoseReport, events: &mut EventQueue) {
        self.heard = Some(now);
        if let Some(last) = self.report_counter {
            let skipped = u32::from(report.counter.since(last).saturating_sub(1));
            self.status.lost_reports = self.status.lost_reports.saturating_add(skipped);
        }
        self.report_counter = Some(report.counter);
        if matches!(self.status.stage, Stage::Missing | Stage::Booted) {
            self.enter(Stage::Started);
        }
        self.status.state = report.state;
        self.status.pose = Pose {
            yaw: report.yaw,
            pitch: report.pitch,
            roll: report.roll,
        };
        match (self.status.stage, report.state) {
            (Stage::Latched, state) if state.is_latched() => {}
            (_, state) if state.is_latched() => {
                self.enter(Stage::Latched);
                events.push(Event::Latched(self.id, state));
            }
            (Stage::Enabling, state) if self.mode.state() == Some(state) => {
                self.enter(Stage::Running);
                self.run_since = now;
                events.push(Event::Running(self.id));
            }
            (Stage::Running, state) if self.mode.state() == Some(state) => {}
            (Stage::Enabling, State::Ready) => {}
            (Stage::Latched | Stage::Running | Stage::Enabling, _) => self.enter(Stage::Started),
            _ => {}
        }
    }

    pub fn hear_bad_report(&mut self) {
        self.status.bad_reports = self.status.bad_reports.saturating_add(1);
    }

    /// Notices silence.
    pub fn watch(&mut self, now: Instant, events: &mut EventQueue) {
        let silent = self.heard.is_none_or(|heard| now.since(heard) > SILENCE);
        if silent && self.status.stage != Stage::Missing {
            self.enter(Stage::Missing);
            events.push(Event::Lost(self.id));
        }
    }

    /// Tells whether the node is to be sent NMT start now.
    pub fn wants_start(&mut self, now: Instant) -> bool {
        let due = self
            .commanded
            .is_none_or(|sent| now.since(sent) >= NMT_RETRY);
        let wants = self.status.stage == Stage::Booted && due;
        if wants {
            self.commanded = Some(now);
        }
        wants
    }

    /// Returns the next target, `gait` being the pose that the gait wants.
    pub fn next_target(&mut self, now: Instant, wish: Wish, gait: Pose) -> Target {
        self.counter = self.counter.next();
        let (mode, pose) = match (self.status.stage, wish) {
            (Stage::Latched, _) if self.reset_wanted => {
                self.reset_wanted = false;
                (Mode::FaultReset, self.status.pose)
            }
            (Stage::Running, Wish::Run | Wish::Keep) => (self.mode, self.blend(now, gait)),
            // Where it says it is, until it says that it runs: nothing jumps, whenever it begins.
            (Stage::Enabling, Wish::Run) if self.runs < RUNS => (self.mode, self.hold()),
            (Stage::Started, Wish::Run) if self.may_run() => {
                self.enter(Stage::Enabling);
                (self.mode, self.hold())
            }
            (stage, _) => {
                if matches!(stage, Stage::Enabling | Stage::Running) {
                    self.enter(Stage::Started);
                }
                self.offs = self.offs.saturating_add(1);
                (Mode::Off, self.status.pose)
            }
        };
        let Pose { yaw, pitch, roll } = pose;
        Target {
            yaw,
            pitch,
            roll,
            mode,
            counter: self.counter,
        }
    }

    /// Asks once more to run where the vertebra says it is; from there it is led to the gait.
    const fn hold(&mut self) -> Pose {
        self.runs = self.runs.saturating_add(1);
        self.start_pose = self.status.pose;
        self.start_pose
    }

    /// Tells whether the vertebra has seen "off" and is ready.
    const fn may_run(&self) -> bool {
        self.offs >= OFFS && matches!(self.status.state, State::Ready)
    }

    /// Returns the pose on the way from where the vertebra was to the gait.
    fn blend(&self, now: Instant, gait: Pose) -> Pose {
        let elapsed = now.since(self.run_since).to_micros().min(BLEND.to_micros());
        let share = smooth_step((i64::from(elapsed) << 15) / i64::from(BLEND.to_micros()));
        let mix = |from: Angle, to: Angle| {
            let step = (i64::from(to.to_q29()) - i64::from(from.to_q29())) * share;
            from + Angle::from_q29((step >> 15) as i32)
        };
        let from = self.start_pose;
        Pose {
            yaw: mix(from.yaw, gait.yaw),
            pitch: mix(from.pitch, gait.pitch),
            roll: mix(from.roll, gait.roll),
        }
    }
}

/// Returns 3x² − 2x³ of a share in Q15.
pub(crate) fn smooth_step(share: i64) -> i64 {
    let share = share.clamp(0, ONE);
    let square = (share * share) >> 15;
    (square * (3 * ONE - 2 * share)) >> 15
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smooth_step_starts_and_ends_flat() {
        assert_eq!(smooth_step(0), 0);
        assert_eq!(smooth_step(ONE), ONE);
        assert_eq!(smooth_step(ONE / 2), ONE / 2);
        assert!(smooth_step(ONE / 100) < ONE / 1_000);
        assert!(smooth_step(ONE - ONE / 100) > ONE - ONE / 1_000);
    }
}
