//! The whole robot in simulated time: it swims, and it lets go when it must.

#[path = "system/bus_off.rs"]
mod bus_off;
#[path = "system/client.rs"]
mod client;
#[path = "system/defects.rs"]
mod defects;
#[path = "system/discipline.rs"]
mod discipline;
#[path = "system/faults.rs"]
mod faults;
#[path = "system/friction.rs"]
mod friction;
#[path = "system/reactions.rs"]
mod reactions;
#[path = "system/stops.rs"]
mod stops;
#[path = "system/swim.rs"]
mod swim;
#[path = "system/watch.rs"]
mod watch;
