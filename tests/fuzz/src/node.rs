//! A node and whatever comes from the bus, from time and from its application, in any order.

use eel_canopen::Abort;

use crate::bench::{Bench, ID, NO_ID};
use crate::draw;
use crate::input::Input;

/// Steps of time in µs: nothing, a little, inhibit times, heartbeats, time-outs, and long.
const STEPS_US: [u64; 12] = [
    0,
    1,
    100,
    999,
    1_000,
    10_000,
    99_900,
    200_000,
    300_000,
    1_000_000,
    65_535_000,
    1 << 40,
];

/// Does with a node what the bytes say, and checks that it lives.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let id = if input.byte() & 7 == 7 { NO_ID } else { ID };
    let mut bench = Bench::new(id, &[]);
    while !input.is_empty() {
        step(&mut bench, &mut input);
    }
    bench.check_alive();
}

fn step(bench: &mut Bench, input: &mut Input<'_>) {
    match input.below(32) {
        0..=17 => {
            let frame = draw::frame(input, bench.node.node_id());
            bench.hear(&frame);
        }
        18..=21 => bench.tick(input.pick(&STEPS_US)),
        22 | 23 => drop(bench.sent()),
        24 => drop(bench.poll()),
        25 => {
            bench.sent();
            bench.check_rest();
        }
        26 => {
            let [register, a, b, c, d, e] = input.array();
            let code = input.word();
            bench
                .node
                .emergency(bench.now_us, code, register, [a, b, c, d, e]);
        }
        27 => bench.node.emergency_cleared(bench.now_us, input.byte()),
        28 => bench.node.request_tpdo(input.byte() & 7),
        29 => bench.app.refuse = !bench.app.refuse,
        30 => {
            let outcome = input.pick(&[Ok(()), Err(Abort::Hardware)]);
            bench.finish_store(outcome);
        }
        _ => drop(bench.events()),
    }
}
