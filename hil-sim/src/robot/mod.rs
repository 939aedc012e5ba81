//! Ten vertebrae, their head, the bus between them and the eel around them, in simulated time.
//!
//! One integer clock in nanoseconds orders everything: the frames on the bus, the plant's steps
//! every half millisecond, the head's and each vertebra's tick every millisecond. The ticks of the
//! nodes do not coincide, as those of real boards do not. A vertebra here is `eel-vertebra` itself
//! behind [`Node`]; nothing of its logic is written a second time.

mod clock;
mod fault;
mod link;
mod node;
mod qemu;
mod supervisor;
#[cfg(test)]
mod tests;

use eel_head::{Config as HeadConfig, Event as HeadEvent, Head};
use eel_protocol::{Cob, HEAD_NODE, NodeId, VERTEBRAE};
use eel_units::Instant;
use eel_vertebra::{Drive, Sample};

use crate::bus::{
    BitRate, Bus, ControllerConfig, Event as BusEvent, Fifo, Filter, FilterMatch, Statistics,
    TransmitMode,
};
use crate::plant::random::Random;
use crate::plant::{Config as PlantConfig, Plant};

pub use clock::{PLANT_STEP_NS, TICK_NS};
pub use fault::{Fault, FaultKind};
pub use link::{Link, SENDING};
pub use node::{NativeNode, Node, Reset, Turn, prototype};
pub use qemu::QemuNode;

use clock::{Happening, Schedule};
use fault::Muffle;
use supervisor::Supervisor;

/// Vertebrae of the eel.
pub const NODES: usize = VERTEBRAE as usize;

/// How a robot is put together.
#[derive(Clone, Debug)]
pub struct Config {
    /// What the head does.
    pub head: HeadConfig,
    /// The eel and the water.
    pub plant: PlantConfig,
    /// Where encoders start, noise of the sensors.
    pub seed: u64,
    /// What goes wrong, in the order of time.
    pub faults: Vec<Fault>,
    /// Bits a second on the bus.
    pub bitrate: u32,
    /// How wrong the vertebrae's clocks are at most, ppm; which one is how wrong, the seed says.
    pub clock_ppm: i32,
}

impl Config {
    /// Returns a robot without faults at 1 Mbit/s.
    pub fn new(head: HeadConfig, seed: u64) -> Self {
        let plant = PlantConfig::default();
        Self {
            head,
            plant,
            seed,
            faults: Vec::new(),
            bitrate: 1_000_000,
            clock_ppm: 50,
        }
    }
}

/// What happens while time passes.
pub trait Observer {
    /// Sees a frame or an error on the bus.
    fn bus(&mut self, event: &BusEvent);
    /// Sees the turn of a vertebra that has just ended.
    fn turn(&mut self, id: NodeId, node: &dyn Node, turn: &Turn<'_>, plant: &Plant);
    /// Hears the head.
    fn head(&mut self, now: Instant, event: HeadEvent);
}

/// The whole robot.
pub struct Robot {
    now_ns: u64,
    schedule: Schedule,
    bus: Bus,
    plant: Plant,
    head: Head,
    head_link: Link,
    head_silent: bool,
    muffle: Muffle,
    nodes: Vec<Seat>,
    faults: Vec<Fault>,
}

/// A vertebra's place on the bus and in the body.
struct Seat {
    id: NodeId,
    node: Box<dyn Node>,
    link: Link,
    drives: [Drive; 3],
    supervisor: Supervisor,
}

impl Robot {
    /// Puts a robot of native vertebrae together.
    ///
    /// # Errors
    /// A bit rate that the bus can't have.
    pub fn new(config: &Config) -> anyhow::Result<Self> {
        Self::with_nodes(config, |id| Ok(Box::new(NativeNode::new(id))))
    }

    /// Puts a robot together of the nodes that `make` returns.
    ///
    /// # Errors
    /// A bit rate that the bus can't have, or a node that can't be made.
    pub fn with_nodes(
        config: &Config,
        mut make: impl FnMut(NodeId) -> anyhow::Result<Box<dyn Node>>,
    ) -> anyhow::Result<Self> {
        let rate = BitRate::new(config.bitrate)
            .ok_or_else(|| anyhow::anyhow!("no bus runs at {} bit/s", config.bitrate))?;
        let mut bus = Bus::new(rate);
        let head_link = Link::attach(&mut bus, head_controller())?;
        let mut nodes = Vec::with_capacity(NODES);
        for id in NodeId::all() {
            let link = Link::attach(&mut bus, vertebra_controller(id))?;
            nodes.push(Seat {
                id,
                node: make(id)?,
                link,
                drives: [Drive::Off; 3],
                supervisor: Supervisor::default(),
            });
        }
        let mut faults = config.faults.clone();
        faults.sort_by_key(|fault| fault.at_ns);
        Ok(Self {
            now_ns: 0,
            schedule: Schedule::new(clocks(config)),
            bus,
            plant: Plant::new(&config.plant, config.seed),
            head: Head::new(config.head, Instant::ZERO),
            head_link,
            head_silent: false,
            muffle: Muffle::default(),
            nodes,
            faults,
        })
    }

    /// Lets time pass up to `to_ns`.
    pub fn run(&mut self, to_ns: u64, observer: &mut impl Observer) {
        loop {
            let (at_ns, happening) = self.schedule.next();
            if at_ns > to_ns {
                break;
            }
            self.advance_bus(at_ns, observer);
            self.now_ns = at_ns;
            let mut trim_ns = 0;
            match happening {
                Happening::Plant => self.step_plant(),
                Happening::Head => self.tick_head(observer),
                Happening::Node(index) => {
                    self.tick_node(index, observer);
                    trim_ns = self.nodes[index].node.tick_trim_ns();
                }
            }
            self.schedule.take(happening, trim_ns);
        }
        self.advance_bus(to_ns, observer);
        self.now_ns = to_ns;
    }

    /// Returns the time in ns.
    pub const fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// Returns the plant.
    pub const fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Returns the head.
    pub const fn head(&self) -> &Head {
        &self.head
    }

    /// Tells the head to end the gait and switch off.
    pub fn stop(&mut self) {
        self.head.stop(instant(self.now_ns));
    }

    /// Returns a vertebra.
    pub fn node(&self, id: NodeId) -> &dyn Node {
        self.nodes[id.index()].node.as_ref()
    }

    /// Returns why a vertebra could not go on, once.
    pub fn take_failure(&mut self) -> Option<anyhow::Error> {
        self.nodes
            .iter_mut()
            .find_map(|seat| seat.node.take_failure())
    }

    /// Returns the drives of a vertebra since its last turn.
    pub fn drives(&self, id: NodeId) -> [Drive; 3] {
        self.nodes[id.index()].drives
    }

    /// Returns the counters of the bus.
    pub const fn bus_statistics(&self) -> &Statistics {
        self.bus.statistics()
    }

    /// Returns the share of the time in which the bus was busy, 0–1.
    pub fn bus_load(&self) -> f64 {
        self.bus.load()
    }

    /// Returns how many frames were lost anywhere: in full receive FIFOs and full queues, and those
    /// that a gap in a row of counters shows not to have arrived or not to have been believed.
    pub fn frames_lost(&self) -> u64 {
        let links = self
            .nodes
            .iter()
            .map(|seat| &seat.link)
            .chain([&self.head_link]);
        let queues: u64 = links.map(|link| link.lost(&self.bus)).sum();
        let reports = NodeId::all().filter_map(|id| self.head.node(id));
        let reports: u64 = reports.map(|node| u64::from(node.lost_reports)).sum();
        let targets = self.nodes.iter().filter_map(|seat| seat.node.vertebra());
        let targets: u64 = targets
            .map(|vertebra| u64::from(vertebra.targets_lost()))
            .sum();
        queues + reports + targets + u64::from(self.head.dropped())
    }

    /// Lets frames end up to `to_ns`; after each, the controllers are served as by interrupt.
    fn advance_bus(&mut self, to_ns: u64, observer: &mut impl Observer) {
        while let Some(end_ns) = self.bus.next_event_ns()
            && end_ns <= to_ns
        {
            self.bus.advance(end_ns, &mut |event| observer.bus(event));
            self.head_link.serve(&mut self.bus, end_ns);
            for seat in &mut self.nodes {
                seat.link.serve(&mut self.bus, end_ns);
            }
        }
        self.bus.advance(to_ns, &mut |event| observer.bus(event));
    }

    fn step_plant(&mut self) {
        let mut drives = [[Drive::Off; 3]; NODES];
        for (drives, seat) in drives.iter_mut().zip(&self.nodes) {
            *drives = seat.drives;
        }
        self.plant.step(&drives);
    }

    fn tick_head(&mut self, observer: &mut impl Observer) {
        self.apply_faults();
        if self.head_silent {
            return;
        }
        let now = instant(self.now_ns);
        for frame in self.head_link.received() {
            self.head.handle_frame(now, &frame);
        }
        self.head.tick(now);
        while let Some(frame) = self.head.poll_transmit() {
            if let Some(frame) = self.muffle.pass(frame) {
                self.head_link.send(&mut self.bus, self.now_ns, frame);
            }
        }
        while let Some(event) = self.head.poll_event() {
            observer.head(now, event);
        }
    }

    fn tick_node(&mut self, index: usize, observer: &mut impl Observer) {
        if !self.may_turn(index) {
            return;
        }
        let now = instant(self.now_ns);
        let mut sample: Sample = self.plant.sample(index);
        // The head's own OUT is always high.
        let before = index.checked_sub(1).map(|before| &self.nodes[before]);
        sample.chain_in = before.is_none_or(|seat| seat.node.chain_out());
        let seat = &mut self.nodes[index];
        sample.sync_age = seat.link.sync_age(self.now_ns);
        let frames = seat.link.received();
        let mut sent = Vec::new();
        let room = seat.link.room();
        seat.drives = seat.node.turn(now, &frames, &sample, room, &mut sent);
        for frame in &sent {
            seat.link.send(&mut self.bus, self.now_ns, *frame);
        }
        let turn = Turn {
            now,
            frames: &frames,
            sample: &sample,
            room,
            sent: &sent,
            drives: seat.drives,
        };
        observer.turn(seat.id, seat.node.as_ref(), &turn, &self.plant);
    }
}

/// Returns by how many ppm each vertebra's clock is too slow.
fn clocks(config: &Config) -> [i32; NODES] {
    let mut random = Random::new(config.seed, 500);
    std::array::from_fn(|_| random.within(config.clock_ppm))
}

/// Returns the local clock's reading.
fn instant(now_ns: u64) -> Instant {
    Instant::from_micros(now_ns / 1_000)
}

/// The head listens to what the vertebrae say, not to other clients' SDOs.
fn head_controller() -> ControllerConfig {
    let every = |cob: Cob| Filter {
        extended: false,
        matches: FilterMatch::Range(u32::from(cob.id()) + 1, u32::from(cob.id()) + 0x7F),
        store: Some(Fifo::Zero),
    };
    hearing(vec![
        every(Cob::Emergency(0)),
        every(Cob::Pose(0)),
        every(Cob::Heartbeat(0)),
    ])
}

/// A vertebra listens to what is for it, as the board's acceptance filters do.
fn vertebra_controller(id: NodeId) -> ControllerConfig {
    let one = |cob: Cob| u32::from(cob.id());
    let node = id.get();
    let dual = |a: Cob, b: Cob| Filter {
        extended: false,
        matches: FilterMatch::Dual(one(a), one(b)),
        store: Some(Fifo::Zero),
    };
    hearing(vec![
        dual(Cob::Nmt, Cob::Sync),
        dual(Cob::Target(node), Cob::Moment(node)),
        dual(Cob::SdoRequest(node), Cob::Heartbeat(HEAD_NODE)),
        dual(Cob::Time, Cob::LssRequest),
    ])
}

/// A controller that hears what the filters fit and sends in the order of its program. In queue mode
/// the FDCAN lets frames with one identifier overtake each other, as a new one takes the lowest free
/// buffer: segments of an SDO transfer and emergencies would arrive in a wrong order.
fn hearing(filters: Vec<Filter>) -> ControllerConfig {
    ControllerConfig {
        filters,
        otherwise: None,
        transmit_mode: TransmitMode::Fifo,
        ..ControllerConfig::default()
    }
}
