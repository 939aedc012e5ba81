//! Ten simulated vertebrae, their bus and the eel in water.

pub mod bus;
pub mod plant;
