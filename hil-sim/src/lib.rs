//! The robot without its hardware: ten vertebrae, their bus and the eel in water.
//!
//! [`robot`] puts [`bus`] and [`plant`] together with the firmware's own logic; [`swim`] is the
//! main job, [`reactions`] measures how soon vertebrae react to faults, [`checks`] compares the plant
//! with what is known exactly.
#![forbid(unsafe_code)]

pub mod bus;
pub mod checks;
pub mod picture;
pub mod plant;
pub mod reactions;
pub mod realtime;
pub mod robot;
pub mod swim;
