//! How soon vertebrae react to what goes wrong: seeded injections into a swimming eel, measured in
//! simulated time.
//!
//! Every injection comes at a random moment of a swim with its full gait. A fault of one vertebra is
//! injected into each of the ten at a moment of its own; a fault of all is injected once and measured in
//! each of the ten. Torques, angles and rates are watched all the time, before and after.

mod classes;
mod report;

use eel_head::{Config as HeadConfig, Event as HeadEvent, Gait};
use eel_protocol::{Cob, Condition, NodeId, State, Target};
use eel_units::Instant;
use eel_vertebra::{Drive, Settings};

use crate::bus::Event as BusEvent;
use crate::plant::Plant;
use crate::plant::config::Motor;
use crate::plant::random::Random;
use crate::robot::{Config, FaultKind, NODES, Node, Observer, Robot, Turn, prototype};

pub use classes::{CLASSES, Class, Reaction};
pub use report::{Extreme, Report, Row};

/// Time between two looks: the resolution of every figure.
const LOOK_NS: u64 = 250_000;
/// When the gait is whole and injections begin.
const BEGIN_NS: u64 = 3_000_000_000;
/// Time in which injections come: one cycle of the gait.
const SPREAD_NS: u64 = 1_000_000_000;
/// Time between two targets.
const PERIOD_NS: u64 = 10_000_000;
/// How long after the last bound a run ends.
const AFTER_NS: u64 = 50_000_000;

/// What to do.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// How often each class is measured, at least; a run measures ten.
    pub cases: u32,
    /// Where moments, motors and sizes come from.
    pub seed: u64,
}

/// One injection and what followed.
struct Case {
    node: NodeId,
    at_ns: u64,
    kind: FaultKind,
    /// The motor that is at fault.
    motor: Option<usize>,
    injected: bool,
    /// From when on reactions are timed: the injection; for a lost command, when the first target that
    /// is missing was due.
    from_ns: u64,
    /// When each reaction that is expected was seen, after the injection.
    seen_ns: Vec<Option<u64>>,
}

/// Injects every class and returns what followed; `progress` hears how many classes are done.
///
/// # Errors
/// A robot that can't be put together.
pub fn run(options: &Options, mut progress: impl FnMut(usize)) -> anyhow::Result<Report> {
    let mut rows = Vec::new();
    let mut extremes = Extreme::all(&prototype(NodeId::FIRST), &Motor::default());
    for (number, class) in CLASSES.iter().enumerate() {
        let mut cases = Vec::new();
        for run in 0..options.cases.div_ceil(NODES as u32) {
            let seed = options.seed ^ (u64::from(run) << 8 | number as u64) << 16;
            cases.extend(swim(class, seed, &mut extremes)?);
        }
        for (place, (reaction, bound_us)) in class.expects.iter().enumerate() {
            let times = cases.iter().map(|case| case.seen_ns[place]);
            rows.push(Row::new(class, *reaction, *bound_us, times));
        }
        progress(number + 1);
    }
    Ok(Report::new(rows, extremes))
}

/// Swims once with ten injections, or one into all, of a class.
fn swim(class: &Class, seed: u64, extremes: &mut [Extreme]) -> anyhow::Result<Vec<Case>> {
    let mut random = Random::new(seed, 99);
    let mut robot = Robot::new(&Config::new(HeadConfig::new(Gait::SWIM), seed))?;
    let mut cases = cases(class, &mut random);
    let mut heard = Heard::default();
    for extreme in extremes.iter_mut() {
        extreme.begin();
    }
    robot.run(BEGIN_NS, &mut heard);
    let swimming = NodeId::all().all(|id| robot.node(id).state() == Some(State::Run));
    anyhow::ensure!(swimming, "the eel does not swim, seed {seed}");
    let last_us = class.expects.iter().map(|(_, bound)| *bound).max();
    let end_ns = BEGIN_NS + SPREAD_NS + last_us.unwrap_or_default() * 1_000 + AFTER_NS;
    while robot.now_ns() < end_ns {
        let mut is_common_done = false;
        for case in cases.iter_mut().filter(|case| !case.injected) {
            if case.at_ns > robot.now_ns() {
                continue;
            }
            case.injected = true;
            if !(class.is_common && is_common_done) {
                robot.fail(case.kind);
                is_common_done = true;
            }
        }
        let to_ns = robot.now_ns() + LOOK_NS;
        robot.run(to_ns, &mut heard);
        for case in cases.iter_mut().filter(|case| case.injected) {
            if class.is_timed_by_targets {
                case.from_ns = heard.acted_ns[case.node.index()] + PERIOD_NS;
            }
            case.look(class, &robot);
        }
        for extreme in extremes.iter_mut() {
            extreme.look(class, &robot);
        }
    }
    Ok(cases)
}

/// Makes the ten injections of a run; one of all is in each.
fn cases(class: &Class, random: &mut Random) -> Vec<Case> {
    let common_ns = moment(random);
    let common = (class.make)(random, NodeId::FIRST);
    NodeId::all()
        .map(|node| {
            let (at_ns, kind) = if class.is_common {
                (common_ns, common)
            } else {
                (moment(random), (class.make)(random, node))
            };
            let motor = match kind {
                FaultKind::Broken(_, defect) => defect.motor(),
                _ => None,
            };
            Case {
                node,
                at_ns,
                kind,
                motor,
                injected: false,
                from_ns: at_ns,
                seen_ns: vec![None; class.expects.len()],
            }
        })
        .collect()
}

/// Picks a moment of the cycle.
fn moment(random: &mut Random) -> u64 {
    BEGIN_NS + random.bits() % (SPREAD_NS / LOOK_NS) * LOOK_NS
}

impl Case {
    /// Notes what the vertebra does by now.
    fn look(&mut self, class: &Class, robot: &Robot) {
        let drives = robot.drives(self.node);
        let node = robot.node(self.node);
        let state = node.state();
        let is_latched = state.is_some_and(State::is_latched);
        let is_late = node
            .vertebra()
            .is_some_and(|vertebra| vertebra.status().contains(Condition::CommandLate));
        let is_driven = drives.iter().any(|it| matches!(it, Drive::Current(_)));
        let is_off = self.motor.is_none_or(|motor| drives[motor] == Drive::Off);
        for ((reaction, _), seen) in class.expects.iter().zip(&mut self.seen_ns) {
            let is_there = match reaction {
                Reaction::Slowing => is_late || is_latched,
                Reaction::Latched => is_latched,
                Reaction::Undriven => !is_driven && is_off,
                Reaction::Free => drives == [Drive::Off; 3],
            };
            if is_there && seen.is_none() {
                *seen = Some(robot.now_ns().saturating_sub(self.from_ns));
            }
        }
    }
}

/// Hears when each vertebra's last target began to act: at the SYNC after it.
#[derive(Default)]
struct Heard {
    is_waiting: [bool; NODES],
    acted_ns: [u64; NODES],
}

impl Observer for Heard {
    fn bus(&mut self, event: &BusEvent) {
        let BusEvent::Confirm(delivery) = event else {
            return;
        };
        match delivery.frame.cob_id().map(Cob::from_id) {
            Some(Cob::Target(_)) => {
                if let Ok((node, _)) = Target::from_frame(&delivery.frame) {
                    self.is_waiting[node.index()] = true;
                }
            }
            Some(Cob::Sync) => {
                for (is_waiting, acted_ns) in self.is_waiting.iter_mut().zip(&mut self.acted_ns) {
                    if std::mem::take(is_waiting) {
                        *acted_ns = delivery.end_ns;
                    }
                }
            }
            _ => {}
        }
    }

    fn turn(&mut self, _: NodeId, _: &dyn Node, _: &Turn<'_>, _: &Plant) {}
    fn head(&mut self, _: Instant, _: HeadEvent) {}
}

/// Returns the limits of a vertebra: torque of a motor in N·m, yaw, pitch and roll in rad, rate in rad/s.
fn limits(settings: &Settings) -> [f64; 5] {
    let q = |raw: i32, bits: u32| f64::from(raw) / f64::from(1_u32 << bits);
    let limits = &settings.limits;
    let angle = |angle: eel_units::Angle| q(angle.to_q29(), 29);
    [
        q(limits.peak_torque.to_q24(), 24),
        angle(limits.workspace.yaw),
        angle(limits.workspace.pitch),
        angle(limits.workspace.roll),
        q(limits.rate.to_q24(), 24),
    ]
}
