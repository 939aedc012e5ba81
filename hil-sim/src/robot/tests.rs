//! What the robot counts.

use eel_head::Gait;
use eel_protocol::{Frame, State};
use eel_vertebra::{Event, Vertebra};

use super::*;

/// Looks at nothing.
struct Blind;

impl Observer for Blind {
    fn bus(&mut self, _event: &BusEvent) {}
    fn turn(&mut self, _id: NodeId, _node: &dyn Node, _turn: &Turn<'_>, _plant: &Plant) {}
    fn head(&mut self, _now: Instant, _event: HeadEvent) {}
}

/// A vertebra that, once it runs, hears some targets wrongly and some not at all.
struct Deaf {
    node: NativeNode,
    id: NodeId,
    missed: u32,
    garbled: u32,
}

impl Node for Deaf {
    fn turn(
        &mut self,
        now: Instant,
        frames: &[Frame],
        sample: &Sample,
        room: usize,
        sent: &mut Vec<Frame>,
    ) -> [Drive; 3] {
        let runs = self.state() == Some(State::Run);
        let mut heard = frames.to_vec();
        let target = Cob::Target(self.id.get()).id();
        if let Some(place) = heard
            .iter()
            .position(|frame| frame.cob_id() == Some(target))
            && runs
            && now.to_micros() % 50_000 < 10_000
        {
            if self.garbled > 0 {
                self.garbled -= 1;
                let mut data = heard[place].data().to_vec();
                data[2] ^= 0x40;
                heard[place] = Frame::standard(target, &data).expect("eight bytes");
            } else if self.missed > 0 {
                self.missed -= 1;
                heard.remove(place);
            }
        }
        self.node.turn(now, &heard, sample, room, sent)
    }

    fn reset(&mut self, now: Instant, cause: Reset) {
        self.node.reset(now, cause);
    }

    fn vertebra(&self) -> Option<&Vertebra> {
        self.node.vertebra()
    }

    fn poll_event(&mut self) -> Option<Event> {
        self.node.poll_event()
    }
}

/// Returns the losses after three seconds in which the fifth vertebra hears so many targets wrongly
/// or not at all.
fn losses(garbled: u32, missed: u32) -> u64 {
    let config = Config::new(HeadConfig::new(Gait::SWIM), 1);
    let mut robot = Robot::with_nodes(&config, |id| {
        let deaf = id.get() == 5;
        let (missed, garbled) = if deaf { (missed, garbled) } else { (0, 0) };
        Ok(Box::new(Deaf {
            node: NativeNode::new(id),
            id,
            missed,
            garbled,
        }))
    })
    .expect("the usual bit rate");
    robot.run(3_000_000_000, &mut Blind);
    robot.frames_lost()
}

#[test]
fn targets_that_a_vertebra_misses_or_does_not_believe_count_as_lost() {
    assert_eq!(losses(0, 0), 0);
    assert_eq!(losses(0, 7), 7);
    assert_eq!(losses(4, 0), 4);
    assert_eq!(losses(3, 5), 8);
}
