//! The order of everything that is periodic.

use super::NODES;

/// Time between two ticks of the head and of each vertebra.
pub const TICK_NS: u64 = 1_000_000;
/// Time between two steps of the plant.
pub const PLANT_STEP_NS: u64 = 500_000;
/// The first vertebra's tick after the head's, and each following one's after its neighbour's:
/// boards are switched on together but their clocks never agree.
const NODE_OFFSET_NS: u64 = 91_000;

/// What is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Happening {
    Plant,
    Head,
    Node(usize),
}

/// A period of happenings, repeated.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    period: Vec<(u64, Happening)>,
    at: usize,
    start_ns: u64,
}

impl Schedule {
    pub fn new() -> Self {
        let mut period = vec![(0, Happening::Plant), (0, Happening::Head)];
        period.push((PLANT_STEP_NS, Happening::Plant));
        for index in 0..NODES {
            period.push(((index as u64 + 1) * NODE_OFFSET_NS, Happening::Node(index)));
        }
        // The sort is stable: at one instant the plant comes before the head.
        period.sort_by_key(|(at_ns, _)| *at_ns);
        Self {
            period,
            at: 0,
            start_ns: 0,
        }
    }

    /// Returns when the next happening is due.
    pub fn next_ns(&self) -> u64 {
        self.start_ns + self.period[self.at].0
    }

    /// Takes the next happening and its time.
    pub fn take(&mut self) -> (u64, Happening) {
        let at_ns = self.next_ns();
        let (_, happening) = self.period[self.at];
        self.at += 1;
        if self.at == self.period.len() {
            self.at = 0;
            self.start_ns += TICK_NS;
        }
        (at_ns, happening)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_millisecond_has_two_plant_steps_and_a_tick_of_everyone() {
        let mut schedule = Schedule::new();
        let mut last_ns = 0;
        let mut counts = [0; 3];
        while schedule.next_ns() < 10 * TICK_NS {
            let (at_ns, happening) = schedule.take();
            assert!(at_ns >= last_ns);
            last_ns = at_ns;
            counts[match happening {
                Happening::Plant => 0,
                Happening::Head => 1,
                Happening::Node(_) => 2,
            }] += 1;
        }
        assert_eq!(counts, [20, 10, 100]);
    }
}
