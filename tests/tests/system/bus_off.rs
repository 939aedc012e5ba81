//! A vertebra whose controller is thrown off the bus.

use eel_head::{Config as HeadConfig, Event as HeadEvent, Gait};
use eel_protocol::{Cob, Condition, NodeId, State};
use eel_units::Instant;
use hil_sim::bus::Event as BusEvent;
use hil_sim::plant::Plant;
use hil_sim::robot::{Config, Fault, FaultKind, Node, Observer, Robot, Turn};

const MS: u64 = 1_000_000;
/// Which one.
const NODE: u8 = 5;
/// When it is thrown off, and for how long it then stays away: twice as long within 10 s of the last.
const OFFS: [(u64, u64); 3] = [(4_000, 100), (5_000, 200), (6_000, 400)];

/// When the vertebra's heartbeats and poses ended on the bus, ns.
#[derive(Default)]
struct Heard(Vec<u64>);

impl Observer for Heard {
    fn bus(&mut self, event: &BusEvent) {
        if let BusEvent::Confirm(delivery) = event
            && let Some(Cob::Pose(NODE) | Cob::Heartbeat(NODE)) =
                delivery.frame.cob_id().map(Cob::from_id)
        {
            self.0.push(delivery.end_ns);
        }
    }

    fn turn(&mut self, _: NodeId, _: &dyn Node, _: &Turn<'_>, _: &Plant) {}
    fn head(&mut self, _: Instant, _: HeadEvent) {}
}

#[test]
fn a_vertebra_that_is_bus_off_lets_go_and_rejoins_after_a_pause_that_doubles() {
    let node = NodeId::new(NODE).expect("a vertebra");
    let faults = OFFS.map(|(at_ms, _)| Fault {
        at_ns: at_ms * MS,
        kind: FaultKind::BusOff(node),
    });
    let config = Config {
        faults: faults.to_vec(),
        ..Config::new(HeadConfig::new(Gait::SWIM), 7)
    };
    let mut robot = Robot::new(&config).expect("a robot");
    let mut heard = Heard::default();
    // Before it is back, it has let go by itself.
    robot.run((OFFS[0].0 + OFFS[0].1) * MS, &mut heard);
    assert_eq!(robot.node(node).state(), Some(State::StopDamped));
    robot.run(8_000 * MS, &mut heard);

    for (at_ms, pause_ms) in OFFS {
        // Faults happen in the head's next tick, and poses come with each SYNC, every 10 ms.
        let from = at_ms * MS + 2 * MS;
        let back = heard.0.iter().find(|end| **end > from);
        let away = back.expect("it is heard again") / MS - at_ms;
        println!("off at {at_ms} ms: away for {away} ms");
        assert!((pause_ms..=pause_ms + 15).contains(&away), "{away} ms");
    }
    // It stays stopped until somebody acknowledges that, and the others swim on.
    for id in NodeId::all() {
        let state = robot.node(id).state();
        let is_stopped = state.is_some_and(State::is_latched);
        assert_eq!(is_stopped, id == node, "{id:?}: {state:?}");
    }
    let vertebra = robot.node(node).vertebra().expect("a native one");
    assert!(vertebra.status().contains(Condition::CommandLost));
}
