//! `eel calibrate` and `eel self-test` against a vertebra that is built in at random.

use eel_protocol::NodeId;
use hil_sim::plant::Mounting;
use serde_json::Value;

use crate::bring_up::{eel, json};
use crate::nodes::Nodes;
use crate::support::interface;

const SEED: u64 = 5;

#[test]
fn a_vertebra_that_nobody_calibrated_is_calibrated_by_hand_and_tested() {
    let Some(interface) = interface() else { return };
    let third = NodeId::new(3).expect("a vertebra");
    let _nodes = Nodes::uncalibrated(&interface, third, SEED);
    let refused = || {
        let (_, out, _) = eel(&interface, &["read", "3", "pose.status"]);
        out.contains("calibration")
    };
    assert!((0..20).any(|_| refused()), "it is there, and refuses");

    let done = json(&interface, &["calibrate", "3", "--json"]);
    let results = done["steps"].as_array().expect("steps");
    assert_eq!(results.len(), 4, "{done}");
    assert!(
        results.iter().all(|step| step["result"] == "done"),
        "{done}"
    );
    assert_eq!(done["stored"], true);

    // What was found is how the simulator has built it.
    let built = Mounting::random(SEED, 2);
    let read = |name: &str| -> Value {
        let all = json(&interface, &["read", "3", name, "--json"]);
        all["values"][0]["raw"].clone()
    };
    let mut reversed = 0;
    for (motor, built) in built.iter().enumerate() {
        let zero = read(&format!("calibration.zero{}", motor + 1));
        let zero = zero.as_f64().expect("a number") / 1e6;
        let home = [0.0, 0.0, std::f64::consts::FRAC_PI_4][motor];
        let apart = (zero - built.read(home)).abs();
        // The encoders have 14 bits, the wrist hangs in the water as it likes.
        let apart = apart.min(std::f64::consts::TAU - apart);
        assert!(apart < 3e-3, "motor {motor}: {zero} of {built:?}");
        let offset = read(&format!("calibration.offset{}", motor + 1));
        let offset = offset.as_f64().expect("a number") / 1e6;
        assert!(
            (offset - built.offset_a).abs() < 2e-3,
            "{offset} of {built:?}"
        );
        for (bit, is_reversed) in [(0, built.leads), (3, built.counter), (6, built.crank)] {
            reversed |= u64::from(is_reversed) << (bit + motor);
        }
    }
    assert_eq!(read("calibration.reversed"), reversed);

    let tested = json(&interface, &["self-test", "3", "--json"]);
    assert_eq!(tested["passed"], true, "{tested}");

    // It outlasts a reset, and the wrist may be driven.
    eel(&interface, &["nmt", "3", "reset"]);
    let pose = ["drive", "3", "pose", "--yaw", "0.1", "--seconds", "2"];
    let (code, out, err) = eel(&interface, &pose);
    assert_eq!(code, 0, "{out} {err}");
}
