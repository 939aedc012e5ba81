//! What holds on a real SocketCAN interface: `cargo xtask vcan -- …` or a vcan0 of the host.
//!
//! The interface's name comes in `ANGUILLA_VCAN`. Inside User-mode Linux there is one slow
//! processor, so nothing here asserts a wall-clock time.

#[cfg(target_os = "linux")]
#[path = "socketcan/bring_up.rs"]
mod bring_up;
#[cfg(target_os = "linux")]
#[path = "socketcan/calibrating.rs"]
mod calibrating;
#[cfg(target_os = "linux")]
#[path = "socketcan/can_utils.rs"]
mod can_utils;
#[cfg(target_os = "linux")]
#[path = "socketcan/chain.rs"]
mod chain;
#[cfg(target_os = "linux")]
#[path = "socketcan/chosen_nodes.rs"]
mod chosen_nodes;
#[cfg(target_os = "linux")]
#[path = "socketcan/dissect.rs"]
mod dissect;
#[cfg(target_os = "linux")]
#[path = "socketcan/driving.rs"]
mod driving;
#[cfg(target_os = "linux")]
#[path = "socketcan/nodes.rs"]
mod nodes;
#[cfg(target_os = "linux")]
#[path = "socketcan/peers.rs"]
mod peers;
#[cfg(target_os = "linux")]
#[path = "socketcan/python_canopen.rs"]
mod python_canopen;
#[cfg(target_os = "linux")]
#[path = "socketcan/slave.rs"]
mod slave;
#[cfg(target_os = "linux")]
#[path = "socketcan/support.rs"]
mod support;
#[cfg(target_os = "linux")]
#[path = "socketcan/swim.rs"]
mod swim;
#[cfg(target_os = "linux")]
#[path = "socketcan/ten_nodes.rs"]
mod ten_nodes;
