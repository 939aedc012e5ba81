//! What the friction compensation is worth.

use eel_head::{Config as HeadConfig, Event as HeadEvent, Gait, Plane};
use eel_protocol::NodeId;
use eel_units::{Instant, Torque};
use eel_vertebra::Settings;
use hil_sim::bus::Event as BusEvent;
use hil_sim::plant::Plant;
use hil_sim::robot::{Config, NativeNode, Node, Observer, Robot, Turn, prototype};

/// Adds up how far vertebrae 1 to 9 are from their references in yaw.
#[derive(Default)]
struct Errors {
    squares: f64,
    count: f64,
}

impl Observer for Errors {
    fn bus(&mut self, _: &BusEvent) {}

    fn turn(&mut self, id: NodeId, node: &dyn Node, turn: &Turn<'_>, plant: &Plant) {
        let vertebra = node.vertebra().expect("a native one");
        // The gait is whole after 5 s.
        if turn.now < Instant::from_micros(6_000_000) {
            return;
        }
        if let Some(reference) = vertebra.reference() {
            let wanted = f64::from(reference.yaw.to_q29()) / f64::from(1 << 29);
            let error = wanted - plant.joint_pose(id.index())[0];
            self.squares += error * error;
            self.count += 1.0;
        }
    }

    fn head(&mut self, _: Instant, _: HeadEvent) {}
}

/// Returns the root mean square of the yaw errors in rad over two cycles of a slow small wave.
fn error(coulomb: Torque, viscous: u32) -> f64 {
    let gait = Gait::new(400, 200, 8_000, Plane::Lateral).expect("a gait");
    let config = Config::new(HeadConfig::new(gait), 1);
    let mut robot = Robot::with_nodes(&config, |id| {
        let mut settings: Settings = prototype(id);
        settings.motor.friction.coulomb = coulomb;
        settings.motor.friction.viscous = viscous;
        Ok(Box::new(NativeNode::with_settings(settings)))
    })
    .expect("a robot");
    let mut errors = Errors::default();
    robot.run(11_000_000_000, &mut errors);
    assert!(errors.count > 10_000.0, "{} turns", errors.count);
    (errors.squares / errors.count).sqrt()
}

#[test]
fn a_slow_motion_is_followed_better_with_the_friction_that_the_motors_have() {
    let without = error(Torque::ZERO, 0);
    let with = error(Torque::from_millinewton_metres(60), 20);
    println!(
        "rms yaw error {:.0} µrad without, {:.0} µrad with",
        without * 1e6,
        with * 1e6
    );
    assert!(with < 0.85 * without, "{with} rad, {without} rad without");
}
