//! The order of everything that is periodic.

use super::NODES;

/// Time between two ticks of the head, and of a vertebra whose clock is right and not trimmed.
pub const TICK_NS: u64 = 1_000_000;
/// Time between two steps of the plant.
pub const PLANT_STEP_NS: u64 = 500_000;
/// The first vertebra's first tick after the head's, and each following one's after its neighbour's:
/// boards are switched on together but their clocks never agree.
const NODE_OFFSET_NS: u64 = 91_000;

/// What is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Happening {
    Plant,
    Head,
    Node(usize),
}

/// When everything is next due, in ns.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    plant_ns: u64,
    head_ns: u64,
    nodes: [Clock; NODES],
}

/// A vertebra's clock.
#[derive(Clone, Copy, Debug)]
struct Clock {
    /// When its next tick is due, in ns and in 1/1024 of it.
    next: u64,
    /// By how much it is too slow, ppm.
    slow_ppm: i32,
}

impl Schedule {
    /// Begins with clocks that are too slow by so many ppm.
    pub fn new(slow_ppm: [i32; NODES]) -> Self {
        let mut nodes = slow_ppm.map(|slow_ppm| Clock { next: 0, slow_ppm });
        for (index, clock) in nodes.iter_mut().enumerate() {
            clock.next = ((index as u64 + 1) * NODE_OFFSET_NS) << 10;
        }
        Self {
            plant_ns: 0,
            head_ns: 0,
            nodes,
        }
    }

    /// Returns what is next and when: at one instant the plant before the head, and both before nodes.
    pub fn next(&self) -> (u64, Happening) {
        let mut first = (self.plant_ns, Happening::Plant);
        if self.head_ns < first.0 {
            first = (self.head_ns, Happening::Head);
        }
        for (index, clock) in self.nodes.iter().enumerate() {
            if clock.next >> 10 < first.0 {
                first = (clock.next >> 10, Happening::Node(index));
            }
        }
        first
    }

    /// Takes it; a vertebra's next tick comes after its millisecond, trimmed by so many ns.
    pub fn take(&mut self, happening: Happening, trim_ns: i32) {
        match happening {
            Happening::Plant => self.plant_ns += PLANT_STEP_NS,
            Happening::Head => self.head_ns += TICK_NS,
            Happening::Node(index) => {
                let clock = &mut self.nodes[index];
                let length = TICK_NS.saturating_add_signed(i64::from(trim_ns));
                let slow = ((length as i64 * i64::from(clock.slow_ppm)) << 10) / 1_000_000;
                clock.next = ((length << 10) + clock.next).saturating_add_signed(slow);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts what happens in so many ms, trimmed by so many ns each.
    fn counts(schedule: &mut Schedule, millis: u64, trim_ns: i32) -> [u64; 3] {
        let mut last_ns = 0;
        let mut counts = [0; 3];
        loop {
            let (at_ns, happening) = schedule.next();
            if at_ns >= millis * TICK_NS {
                return counts;
            }
            schedule.take(happening, trim_ns);
            assert!(at_ns >= last_ns);
            last_ns = at_ns;
            counts[match happening {
                Happening::Plant => 0,
                Happening::Head => 1,
                Happening::Node(_) => 2,
            }] += 1;
        }
    }

    #[test]
    fn a_millisecond_has_two_plant_steps_and_a_tick_of_everyone() {
        let mut schedule = Schedule::new([0; NODES]);
        assert_eq!(counts(&mut schedule, 10, 0), [20, 10, 100]);
    }

    #[test]
    fn slow_clocks_and_long_ticks_are_fewer() {
        let mut schedule = Schedule::new([1_000; NODES]);
        let [_, head, nodes] = counts(&mut schedule, 2_000, 0);
        assert_eq!((head, nodes), (2_000, 19_980));
        let mut schedule = Schedule::new([0; NODES]);
        let [_, _, nodes] = counts(&mut schedule, 2_000, -1_000);
        assert_eq!(nodes, 20_020);
        // Both together are none.
        let mut schedule = Schedule::new([1_000; NODES]);
        let [_, _, nodes] = counts(&mut schedule, 2_000, -999);
        assert_eq!(nodes, 20_000);
    }
}
