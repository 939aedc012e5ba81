//! Every committed input of every fuzz target keeps every promise: what fuzzing once found stays found.

use std::panic;

use eel_fuzz::{TARGETS, corpus};

/// The fewest inputs of a target that are worth a replay.
const LEAST: usize = 100;

#[test]
fn committed_inputs_break_no_promise() {
    let mut broken = Vec::new();
    for target in TARGETS {
        let name = target.name;
        let inputs = corpus::load(name).expect("committed inputs");
        let count = inputs.len();
        assert!(count >= LEAST, "{name}: {count} inputs");
        for input in &inputs {
            if panic::catch_unwind(|| (target.run)(input)).is_err() {
                let input = corpus::encode(input);
                broken.push(format!("cargo run -p eel-fuzz -- {name} --base64 {input}"));
            }
        }
        println!("{name}: {count} inputs");
    }
    let broken = broken.join("\n");
    assert!(broken.is_empty(), "to see one alone:\n{broken}");
}

#[test]
fn nothing_and_random_bytes_break_no_promise() {
    let mut state = 0x0EE1_u64;
    let mut random = || {
        state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(1);
        (state >> 56) as u8
    };
    for target in TARGETS {
        (target.run)(&[]);
        for length in 0..64_usize {
            let data: Vec<u8> = (0..length * 4).map(|_| random()).collect();
            (target.run)(&data);
        }
    }
}
