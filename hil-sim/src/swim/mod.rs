//! The main job: ten vertebrae swim, and what came of it.

mod record;
mod summary;
mod tracking;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant as WallClock;

use anyhow::Context;
use eel_head::{Config as HeadConfig, Event as HeadEvent, Gait, Phase};
use eel_protocol::{NodeId, emergency};
use eel_units::Instant;
use eel_vertebra::Drive;
use indicatif::{ProgressBar, ProgressStyle};

use crate::bus::Event as BusEvent;
use crate::picture;
use crate::plant::Plant;
use crate::plant::measures::{Moment, Recording, Stroke, swim_figures};
use crate::robot::{Config, Fault, NODES, NativeNode, Node, Observer, QemuNode, Robot, Turn};

pub use record::Records;
pub use summary::{NodeSummary, Summary};
pub use tracking::Tracking;

/// Time between two rows of the state record.
const ROW_NS: u64 = 10_000_000;
/// Time between two looks at the progress bar.
const SHOWN_NS: u64 = 100_000_000;
/// Longest time that a stop may take before the run ends without it.
const STOP_LIMIT_NS: u64 = 6_000_000_000;
/// Largest angle of a joint that counts as straight after a stop; the water moves a free wrist.
const STRAIGHT_RAD: f64 = 0.1;
/// Pictures of the spine in one stride.
const SNAPSHOTS: usize = 8;

/// What to swim.
#[derive(Clone, Debug)]
pub struct Options {
    /// Simulated time of swimming before the orderly stop, s.
    pub seconds: f64,
    /// How the eel moves.
    pub gait: Gait,
    /// The same as numbers: Hz, body lengths, body lengths.
    pub frequency_hz: f64,
    /// Amplitude of the tail edge, body lengths.
    pub amplitude: f64,
    /// Length of the wave, body lengths.
    pub wavelength: f64,
    /// Where encoders start, noise of the sensors.
    pub seed: u64,
    /// Folder of the records; none are written without it.
    pub out: Option<PathBuf>,
    /// What goes wrong.
    pub faults: Vec<Fault>,
    /// Vertebrae that run in QEMU instead of in this process.
    pub emulated: Option<Emulated>,
    /// Whether a progress bar is drawn on standard error.
    pub progress: bool,
}

/// Which vertebrae run in QEMU, each as a process of its own.
#[derive(Clone, Debug)]
pub struct Emulated {
    /// Their node ids.
    pub nodes: Vec<NodeId>,
    /// The image that they run, `target/firmware/board-qemu.elf`.
    pub image: PathBuf,
}

/// Swims and returns what came of it.
///
/// # Errors
/// Records that can't be written, the text names the file; vertebrae in QEMU that can't start or fail.
pub fn run(options: &Options) -> anyhow::Result<Summary> {
    run_while(options, || true)
}

/// Swims for as long as `keep_going` agrees, which is asked every 10 ms of simulated time; then the
/// stop begins early, and the records hold what happened until then.
///
/// # Errors
/// As [`run`].
pub fn run_while(
    options: &Options,
    mut keep_going: impl FnMut() -> bool,
) -> anyhow::Result<Summary> {
    let started = WallClock::now();
    let config = Config {
        faults: options.faults.clone(),
        ..Config::new(HeadConfig::new(options.gait), options.seed)
    };
    let mut robot = Robot::with_nodes(&config, |id| make_node(options, id))?;
    let mut watcher = Watcher::new(options)?;
    let end_ns = (options.seconds * 1e9) as u64;
    let bar = progress_bar(options);
    while robot.now_ns() < end_ns && keep_going() {
        let to_ns = (robot.now_ns() + ROW_NS).min(end_ns);
        advance(&mut robot, &mut watcher, to_ns, &bar, started)?;
    }
    watcher.swim_end_ns = robot.now_ns();
    let operational = watcher.operational(&robot);
    robot.stop();
    let limit_ns = robot.now_ns() + STOP_LIMIT_NS;
    while robot.head().phase() != Phase::Stopped && robot.now_ns() < limit_ns {
        let to_ns = robot.now_ns() + ROW_NS;
        advance(&mut robot, &mut watcher, to_ns, &bar, started)?;
    }
    bar.finish_and_clear();
    let summary = watcher.finish(options, &robot, operational, started)?;
    Ok(summary)
}

/// Makes a vertebra where the options want it.
fn make_node(options: &Options, id: NodeId) -> anyhow::Result<Box<dyn Node>> {
    let emulated = options.emulated.as_ref();
    Ok(match emulated.filter(|it| it.nodes.contains(&id)) {
        Some(Emulated { image, .. }) => Box::new(QemuNode::new(id, image)?),
        None => Box::new(NativeNode::new(id)),
    })
}

/// Runs up to `to_ns`, at most a row of the state record.
fn advance(
    robot: &mut Robot,
    watcher: &mut Watcher,
    to_ns: u64,
    bar: &ProgressBar,
    started: WallClock,
) -> anyhow::Result<()> {
    robot.run(to_ns, watcher);
    if let Some(failure) = robot.take_failure() {
        return Err(failure);
    }
    watcher.row(robot)?;
    if robot.now_ns().is_multiple_of(SHOWN_NS) {
        let simulated = robot.now_ns() as f64 / 1e9;
        bar.set_position(robot.now_ns() / 1_000_000);
        bar.set_message(format!(
            "{simulated:5.1} s  {:4.0}x real time  bus {:4.1} %",
            simulated / started.elapsed().as_secs_f64().max(1e-9),
            robot.bus_load() * 100.0,
        ));
    }
    Ok(())
}

fn progress_bar(options: &Options) -> ProgressBar {
    if !options.progress {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new((options.seconds * 1e3) as u64);
    let style = ProgressStyle::with_template("{bar:30} {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// Tells whether every vertebra stands near home with its bridges off.
fn is_straight_and_off(robot: &Robot) -> bool {
    NodeId::all().all(|id| {
        let is_off = robot.drives(id) == [Drive::Off; 3];
        let pose = robot.plant().joint_pose(id.index());
        is_off && pose.iter().all(|angle| angle.abs() < STRAIGHT_RAD)
    })
}

/// Sees everything and keeps what the summary and the records need.
struct Watcher {
    records: Records,
    tracking: Tracking,
    recording: Recording,
    snapshots: Vec<picture::Snapshot>,
    swim_end_ns: u64,
    next_row_ns: u64,
    stride_ns: u64,
    boots: u32,
    stopped: bool,
    emergencies: BTreeMap<String, u32>,
}

impl Watcher {
    fn new(options: &Options) -> anyhow::Result<Self> {
        let records = match &options.out {
            Some(folder) => Records::create(folder)
                .with_context(|| format!("can't write to {}", folder.display()))
                .context("no records; --out names another folder")?,
            None => Records::nowhere(),
        };
        Ok(Self {
            records,
            tracking: Tracking::new(),
            recording: Recording {
                interval_s: ROW_NS as f64 / 1e9,
                moments: Vec::new(),
            },
            snapshots: Vec::new(),
            swim_end_ns: (options.seconds * 1e9) as u64,
            next_row_ns: ROW_NS,
            stride_ns: (1e9 / options.frequency_hz) as u64,
            boots: 0,
            stopped: false,
            emergencies: BTreeMap::new(),
        })
    }

    /// Keeps a row of the state record, and the moment for the figures.
    fn row(&mut self, robot: &Robot) -> anyhow::Result<()> {
        if robot.now_ns() < self.next_row_ns {
            return Ok(());
        }
        self.next_row_ns += ROW_NS;
        let plant = robot.plant();
        if robot.now_ns() <= self.swim_end_ns {
            self.recording.moments.push(Moment {
                centre: plant.centre_of_mass(),
                tail: plant.tail_edge(),
                energy_j: plant.joint_energy_j(),
            });
            self.photograph(robot);
        }
        self.records.state(robot)
    }

    /// Takes the pictures of the last stride before the stop.
    fn photograph(&mut self, robot: &Robot) {
        let first_ns = self.swim_end_ns.saturating_sub(self.stride_ns);
        let due_ns = first_ns + self.stride_ns * self.snapshots.len() as u64 / SNAPSHOTS as u64;
        if self.snapshots.len() <= SNAPSHOTS && robot.now_ns() >= due_ns {
            self.snapshots.push(picture::Snapshot {
                time_s: robot.now_ns() as f64 / 1e9,
                spine: robot.plant().spine_points().to_vec(),
            });
        }
    }

    /// Returns how many vertebrae are operational and not stopped.
    fn operational(&self, robot: &Robot) -> usize {
        NodeId::all()
            .filter(|id| {
                let state = robot.node(*id).state();
                state.is_some_and(|state| !state.is_latched())
                    && robot
                        .head()
                        .node(*id)
                        .is_some_and(|status| status.stage == eel_head::Stage::Running)
            })
            .count()
    }

    /// Closes the records and adds everything up.
    fn finish(
        self,
        options: &Options,
        robot: &Robot,
        operational: usize,
        started: WallClock,
    ) -> anyhow::Result<Summary> {
        let length_m = robot.plant().config().shape.length_m;
        let stroke = Stroke {
            frequency_hz: options.frequency_hz,
            wavelength_m: options.wavelength * length_m,
            length_m,
        };
        let figures = swim_figures(&self.recording, &stroke);
        let caption = picture::Caption {
            title: "One stride of the simulated eel".into(),
            subtitle: format!(
                "{} Hz, amplitude {} L, wavelength {} L, seed {}",
                options.frequency_hz, options.amplitude, options.wavelength, options.seed
            ),
        };
        let drawing = picture::stride_svg(&self.snapshots, &robot.plant().config().shape, &caption);
        let interrupted = self.swim_end_ns < (options.seconds * 1e9) as u64;
        // The pictures are of the last stride that was planned.
        let files = self.records.finish((!interrupted).then_some(&drawing))?;
        let nodes: Vec<NodeSummary> = (0..NODES).map(|index| self.tracking.node(index)).collect();
        let statistics = robot.bus_statistics();
        let simulated_s = robot.now_ns() as f64 / 1e9;
        let summary = Summary {
            seconds: self.swim_end_ns as f64 / 1e9,
            interrupted,
            simulated_s,
            frequency_hz: options.frequency_hz,
            amplitude_body_lengths: options.amplitude,
            wavelength_body_lengths: options.wavelength,
            seed: options.seed,
            figures: figures.into(),
            peak_torque_nm: self.tracking.peak_torque(),
            max_tracking_error_rad: self.tracking.worst_error(),
            nodes_operational: operational,
            stopped_in_order: self.stopped && is_straight_and_off(robot),
            emergencies: self.emergencies.values().sum(),
            emergency_names: self.emergencies,
            boots: self.boots,
            frames: statistics.frames,
            frames_lost: robot.frames_lost(),
            bus_load_percent: robot.bus_load() * 100.0,
            real_time_factor: simulated_s / started.elapsed().as_secs_f64().max(1e-9),
            frame_log_sha256: files.frame_log_sha256,
            nodes,
            files: files.paths,
        };
        if let Some(folder) = &options.out {
            let path = folder.join("summary.json");
            std::fs::write(&path, serde_json::to_string_pretty(&summary)?)
                .with_context(|| format!("can't write {}", path.display()))?;
        }
        Ok(summary)
    }
}

impl Observer for Watcher {
    fn bus(&mut self, event: &BusEvent) {
        if let BusEvent::Confirm(delivery) = event {
            self.records.frame(delivery.end_ns, &delivery.frame);
        }
    }

    fn turn(&mut self, id: NodeId, node: &dyn Node, _turn: &Turn<'_>, plant: &Plant) {
        let index = id.index();
        self.tracking.note_torque(index, plant.motor_torque(index));
        let truth = plant.joint_pose(index);
        match node.vertebra() {
            Some(vertebra) => {
                if let Some(reference) = vertebra.reference() {
                    self.tracking.note_pose(index, &reference, truth);
                }
            }
            // Its reference is inside the emulator.
            None => self.tracking.note_yaw(index, truth),
        }
    }

    fn head(&mut self, _now: Instant, event: HeadEvent) {
        match event {
            HeadEvent::Booted(_) => self.boots += 1,
            HeadEvent::Stopped => self.stopped = true,
            HeadEvent::Emergency(_, report) if report.code != 0 => {
                let name = emergency::from_code(report.code).map_or_else(
                    || format!("{:04X}", report.code),
                    |known| known.name.to_owned(),
                );
                *self.emergencies.entry(name).or_default() += 1;
            }
            _ => {}
        }
    }
}
