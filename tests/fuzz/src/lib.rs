//! What the fuzz targets do with their bytes, and what must be true afterwards.
//!
//! A target is a function of bytes that panics when a promise is broken. libFuzzer looks for such bytes
//! (`cargo xtask fuzz`); `tests/replay.rs` runs the committed corpora with a plain `cargo test`, and
//! this crate's program runs one input: `cargo run -p eel-fuzz -- node FILE`.
//!
//! Only `no_std` crates of ours are tested here, through their public functions; nothing of the
//! targets is in the firmware.
#![forbid(unsafe_code)]

mod application;
mod bench;
mod client;
pub mod corpus;
mod draw;
mod flash;
mod input;
pub mod lss;
pub mod node;
mod oracle;
pub mod sdo;
pub mod stored;
pub mod vertebra;

/// A fuzz target.
#[derive(Clone, Copy)]
pub struct Target {
    /// Its name, which is also its corpus's folder.
    pub name: &'static str,
    /// What it does with the bytes.
    ///
    /// It panics when a promise is broken.
    pub run: fn(&[u8]),
}

/// Every target.
pub const TARGETS: [Target; 5] = [
    Target {
        name: "node",
        run: node::run,
    },
    Target {
        name: "sdo",
        run: sdo::run,
    },
    Target {
        name: "lss",
        run: lss::run,
    },
    Target {
        name: "stored",
        run: stored::run,
    },
    Target {
        name: "vertebra",
        run: vertebra::run,
    },
];
