//! An observer that keeps what the tests ask about.

use eel_head::Event as HeadEvent;
use eel_protocol::emergency::EmergencyReport;
use eel_protocol::{NodeId, State};
use eel_units::Instant;
use eel_vertebra::{Drive, Vertebra};
use hil_sim::bus::Event as BusEvent;
use hil_sim::plant::Plant;
use hil_sim::robot::{NODES, Node, Observer, Turn};

/// Everything worth asking about afterwards; times in µs of simulated time.
pub struct Watch {
    /// Changes of state: time, node, state.
    pub states: Vec<(u64, NodeId, State)>,
    /// What the drives of each vertebra last did, and since when.
    pub drives: [(u64, [Kind; 3]); NODES],
    /// Emergencies that the head heard: time, node, report.
    pub emergencies: Vec<(u64, NodeId, EmergencyReport)>,
    /// What the head told otherwise.
    pub head: Vec<(u64, HeadEvent)>,
    /// Largest yaw, pitch, roll of each vertebra in truth, rad.
    pub truth: [[f64; 3]; NODES],
    /// Largest yaw, pitch, roll that each vertebra pursued, rad.
    pub pursued: [[f64; 3]; NODES],
    last: [Option<State>; NODES],
}

/// A drive without its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Off,
    Brake,
    Current,
}

impl Watch {
    pub fn new() -> Self {
        Self {
            states: Vec::new(),
            drives: [(0, [Kind::Off; 3]); NODES],
            emergencies: Vec::new(),
            head: Vec::new(),
            truth: [[0.0; 3]; NODES],
            pursued: [[0.0; 3]; NODES],
            last: [None; NODES],
        }
    }

    /// Returns when a node first entered a state at or after `from_us`.
    pub fn entered(&self, id: NodeId, state: State, from_us: u64) -> Option<u64> {
        let mut states = self.states.iter();
        states
            .find(|(time, node, other)| *time >= from_us && *node == id && *other == state)
            .map(|(time, ..)| *time)
    }
}

impl Observer for Watch {
    fn bus(&mut self, _event: &BusEvent) {}

    fn turn(&mut self, id: NodeId, node: &dyn Node, turn: &Turn<'_>, plant: &Plant) {
        let (index, now) = (id.index(), turn.now.to_micros());
        let state = node.state();
        if state != self.last[index] {
            self.last[index] = state;
            if let Some(state) = state {
                self.states.push((now, id, state));
            }
        }
        let kinds = turn.drives.map(|drive| match drive {
            Drive::Off => Kind::Off,
            Drive::Brake => Kind::Brake,
            Drive::Current(_) => Kind::Current,
        });
        if kinds != self.drives[index].1 {
            self.drives[index] = (now, kinds);
        }
        let largest = |kept: &mut [f64; 3], new: [f64; 3]| {
            for (kept, new) in kept.iter_mut().zip(new) {
                *kept = kept.max(new.abs());
            }
        };
        largest(&mut self.truth[index], plant.joint_pose(index));
        if let Some(pose) = node.vertebra().and_then(Vertebra::reference) {
            let radians = [pose.yaw, pose.pitch, pose.roll]
                .map(|angle| f64::from(angle.to_q29()) / f64::from(1 << 29));
            largest(&mut self.pursued[index], radians);
        }
    }

    fn head(&mut self, now: Instant, event: HeadEvent) {
        let now = now.to_micros();
        match event {
            HeadEvent::Emergency(id, report) => self.emergencies.push((now, id, report)),
            other => self.head.push((now, other)),
        }
    }
}
