//! Vertebrae in real time on a bus of the host, so that other programs can talk to them.
//!
//! The firmware's own logic and the plant run as in [`crate::robot`], but the bus is one that
//! others share: a SocketCAN interface, or any [`Bus`]. All nodes use one socket; what one of them
//! sends the others hear in their next tick. The head is not in here: it is whoever is on the
//! bus. There is no arbitration, no frame time and no receive FIFO: those of the host's bus hold.
//!
//! Time for the nodes is the number of ticks, so what they do depends on what they receive and in
//! which tick, never on how late the host was. A host that falls behind first catches up, and each of
//! the ticks made up for takes the frames that came in its own millisecond; what is beyond
//! [`CATCH_UP_TICKS`] is left out and counted.

mod pace;

use std::collections::VecDeque;
use std::time::{Duration, Instant as HostInstant, SystemTime, UNIX_EPOCH};

use eel_protocol::{Frame, NodeId};
use eel_transport::{Bus, BusError, Received};
use eel_units::Instant;
use eel_vertebra::{Drive, Hands, Sample, Vertebra};

use crate::plant::joint::Target;
use crate::plant::{Config as PlantConfig, Mounting, Plant};
use crate::robot::{NODES, NativeNode, Node, PLANT_STEP_NS, SENDING, TICK_NS};

pub use pace::{CATCH_UP_TICKS, Pace};

/// Frames that are taken from the bus in one tick at most; the rest waits in the bus.
const RECEIVED_PER_TICK: usize = 256;
/// A frame that seems to come from farther ahead than this was there when the host's clock was set
/// back: 1 s.
const CLOCK_SET_NS: u64 = 1_000_000_000;
/// How far hands turn a wrist in a tick, rad: half a radian a second.
const HAND_STEP: f64 = 0.5e-3;
/// Frames that wait for the bus at which the nodes send no more.
const BEHIND: usize = 64;

/// What happened so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Control ticks of all nodes.
    pub ticks: u64,
    /// Ticks left out because the host was too late.
    pub skipped: u64,
    /// Frames that came from the bus.
    pub received: u64,
    /// Frames sent.
    pub sent: u64,
    /// Frames that found no room in their node because the bus took none for too long.
    pub dropped: u64,
}

/// Vertebrae and their plant on one bus.
pub struct Realtime<B> {
    bus: B,
    plant: Plant,
    nodes: Vec<(NodeId, NativeNode)>,
    drives: [[Drive; 3]; NODES],
    /// What the nodes sent in their last tick, and which of them.
    local: Vec<(usize, Frame)>,
    /// Those that were never calibrated, and where hands hold each: yaw, pitch, roll, rad.
    handled: Vec<(NodeId, [f64; 3])>,
    /// The order in which the daisy line goes through the places.
    chain: Vec<NodeId>,
    incoming: Vec<Frame>,
    /// What came after the millisecond that the last tick stood for.
    held: Option<Received>,
    outgoing: VecDeque<Frame>,
    counters: Counters,
}

impl<B: Bus> Realtime<B> {
    /// Powers ten prototypes up in still water; the seed sets encoder positions and sensor noise.
    pub fn new(bus: B, plant: &PlantConfig, seed: u64) -> Self {
        let all: Vec<NodeId> = NodeId::all().collect();
        Self::with_nodes(bus, plant, seed, &all)
    }

    /// Powers some of the prototypes up. The whole eel is in the water; motors of vertebrae that are
    /// not here, but perhaps elsewhere on the bus, are off.
    pub fn with_nodes(bus: B, plant: &PlantConfig, seed: u64, nodes: &[NodeId]) -> Self {
        Self::with_unconfigured(bus, plant, seed, nodes, &[])
    }

    /// Powers some of the prototypes up, and at the places `unconfigured` such as have no node id yet.
    /// A place in both lists is unconfigured.
    pub fn with_unconfigured(
        bus: B,
        plant: &PlantConfig,
        seed: u64,
        nodes: &[NodeId],
        unconfigured: &[NodeId],
    ) -> Self {
        let power = |id: NodeId| match (unconfigured.contains(&id), nodes.contains(&id)) {
            (true, _) => Some((id, NativeNode::unconfigured(id))),
            (false, true) => Some((id, NativeNode::new(id))),
            (false, false) => None,
        };
        Self {
            bus,
            plant: Plant::new(plant, seed),
            nodes: NodeId::all().filter_map(power).collect(),
            drives: [[Drive::Off; 3]; NODES],
            local: Vec::new(),
            handled: Vec::new(),
            chain: NodeId::all().collect(),
            incoming: Vec::new(),
            held: None,
            outgoing: VecDeque::new(),
            counters: Counters::default(),
        }
    }

    /// Lets the daisy line go through the places in this order, as if somebody had put the vertebrae together
    /// so. A place that is not named has nothing at its IN, which is high then.
    pub fn wire(&mut self, order: &[NodeId]) {
        self.chain = order.to_vec();
    }

    /// Returns the level at a place's IN: the OUT of the one before it, where that is here.
    fn chain_in(&self, id: NodeId) -> bool {
        let place = self.chain.iter().position(|other| *other == id);
        let before = place.and_then(|place| place.checked_sub(1));
        let before = before.and_then(|before| self.node(self.chain[before]));
        before.is_none_or(Node::chain_out)
    }

    /// Builds a vertebra's motors and sensors in at random, by the seed of the sensors, and lets it know
    /// nothing of that: it has to be calibrated. Hands turn its wrist when a procedure asks for it.
    pub fn uncalibrate(&mut self, id: NodeId, seed: u64) {
        let Some((_, node)) = self.nodes.iter_mut().find(|(other, _)| *other == id) else {
            return;
        };
        *node = node.uncalibrated();
        self.plant
            .set_mounting(id.index(), Mounting::random(seed, id.index()));
        self.handled.push((id, [0.0; 3]));
    }

    /// Lets hands turn the wrists that wait for it.
    fn handle(&mut self) {
        for (id, hold) in &mut self.handled {
            let mut nodes = self.nodes.iter().filter(|(other, _)| other == id);
            let waits_for = nodes
                .find_map(|(_, node)| node.vertebra())
                .and_then(Vertebra::waits_for);
            let wanted = match waits_for {
                Some(Hands::Yaw) => [0.42, 0.0, 0.0],
                Some(Hands::Roll) => [0.0, 0.0, 0.06],
                None => {
                    *hold = [0.0; 3];
                    self.plant.set_hands(id.index(), None);
                    continue;
                }
            };
            for (now, wanted) in hold.iter_mut().zip(wanted) {
                *now += f64::clamp(wanted - *now, -HAND_STEP, HAND_STEP);
            }
            let target = Target {
                pose: *hold,
                rates: [0.0; 3],
            };
            self.plant.set_hands(id.index(), Some(target));
        }
    }

    /// Runs a tick a millisecond of the host's clock for as long as `keep_going` agrees, which sees
    /// the counters about every millisecond.
    ///
    /// # Errors
    /// What the bus fails with.
    pub fn run(
        &mut self,
        mut keep_going: impl FnMut(&Counters) -> bool,
    ) -> Result<Counters, BusError> {
        let start = HostInstant::now();
        let mut pace = Pace::default();
        while keep_going(&self.counters) {
            let (due, now_ns) = (pace.due(start.elapsed()), host_ns());
            for behind in (0..due).rev() {
                self.tick_until(now_ns.saturating_sub(behind * TICK_NS))?;
            }
            self.counters.skipped = pace.skipped();
            let wait = pace.until_next(start.elapsed());
            if !wait.is_zero() {
                std::thread::sleep(wait);
            }
        }
        Ok(self.counters)
    }

    /// Does one tick of every node, and a millisecond of the plant, with all frames that have come.
    ///
    /// # Errors
    /// What the bus fails with.
    pub fn tick(&mut self) -> Result<(), BusError> {
        self.tick_until(u64::MAX)
    }

    /// Does one tick with the frames that came until a time of the host, in nanoseconds since 1970.
    fn tick_until(&mut self, until_ns: u64) -> Result<(), BusError> {
        self.receive(until_ns)?;
        let now = Instant::from_micros(self.counters.ticks * TICK_NS / 1_000);
        // A bus that takes none soon gets none: what the nodes say is not to be old when it goes out.
        let room = if self.outgoing.len() < BEHIND {
            SENDING
        } else {
            0
        };
        let (heard, mut frames, mut sent) = (std::mem::take(&mut self.local), vec![], vec![]);
        let levels: Vec<bool> = self
            .nodes
            .iter()
            .map(|(id, _)| self.chain_in(*id))
            .collect();
        for ((id, node), chain_in) in self.nodes.iter_mut().zip(levels) {
            let index = id.index();
            frames.clear();
            let others = heard.iter().filter(|(sender, _)| *sender != index);
            frames.extend(others.map(|(_, frame)| *frame));
            frames.extend_from_slice(&self.incoming);
            let sample = Sample {
                chain_in,
                ..self.plant.sample(index)
            };
            self.drives[index] = node.turn(now, &frames, &sample, room, &mut sent);
            self.local
                .extend(sent.drain(..).map(|frame| (index, frame)));
        }
        self.handle();
        for _ in 0..TICK_NS / PLANT_STEP_NS {
            self.plant.step(&self.drives);
        }
        self.counters.ticks += 1;
        let vertebrae = self.nodes.iter().filter_map(|(_, node)| node.vertebra());
        self.counters.dropped = vertebrae.map(|v| u64::from(v.frames_dropped())).sum();
        self.send()
    }

    /// Returns the plant.
    pub const fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Returns the vertebra at a place in the chain, where it is one of these.
    pub fn node(&self, id: NodeId) -> Option<&NativeNode> {
        self.nodes
            .iter()
            .find(|(other, _)| *other == id)
            .map(|(_, node)| node)
    }

    /// Returns what happened so far.
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    fn receive(&mut self, until_ns: u64) -> Result<(), BusError> {
        self.incoming.clear();
        while self.incoming.len() < RECEIVED_PER_TICK {
            let next = match self.held.take() {
                Some(held) => Some(held),
                None => self.bus.receive(Duration::ZERO)?,
            };
            let Some(received) = next else { break };
            let ahead_ns = received.time_ns.saturating_sub(until_ns);
            if (1..CLOCK_SET_NS).contains(&ahead_ns) {
                self.held = Some(received);
                break;
            }
            // The host's reports of bus errors are for whoever watches the bus.
            self.incoming.extend(Received::frame(&received));
        }
        self.counters.received += self.incoming.len() as u64;
        Ok(())
    }

    /// Sends what waits, as far as the bus takes it.
    fn send(&mut self) -> Result<(), BusError> {
        for (_, frame) in &self.local {
            self.outgoing.push_back(*frame);
        }
        while let Some(frame) = self.outgoing.front() {
            match self.bus.send(frame) {
                Ok(()) => self.counters.sent += 1,
                Err(BusError::Full) => break,
                Err(error) => return Err(error),
            }
            self.outgoing.pop_front();
        }
        Ok(())
    }
}

/// Returns the host's time in nanoseconds since 1970, as buses stamp frames with.
fn host_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |time| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX))
}

#[cfg(test)]
mod tests;
