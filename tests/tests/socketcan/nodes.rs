//! Simulated vertebrae on the interface.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use eel_protocol::NodeId;
use eel_transport::SocketBus;
use hil_sim::plant::Config;
use hil_sim::realtime::{Counters, Realtime};

/// Vertebrae in a thread of their own until they are told to stop.
pub struct Nodes {
    stop: Arc<AtomicBool>,
    thread: Option<thread::JoinHandle<Counters>>,
}

impl Nodes {
    /// Powers some up that have their ids.
    pub fn start(interface: &str, chosen: Vec<NodeId>) -> Self {
        Self::power(interface, chosen, Vec::new(), |_| ())
    }

    /// Powers some up that have no ids yet.
    pub fn unconfigured(interface: &str, places: Vec<NodeId>) -> Self {
        Self::power(interface, Vec::new(), places, |_| ())
    }

    /// Powers some up that have no ids yet and are connected in this order.
    pub fn connected(interface: &str, order: Vec<NodeId>) -> Self {
        let places = order.clone();
        Self::power(interface, Vec::new(), places, move |nodes| {
            nodes.wire(&order);
        })
    }

    /// Powers one up that was never calibrated.
    pub fn uncalibrated(interface: &str, id: NodeId, seed: u64) -> Self {
        Self::power(interface, vec![id], Vec::new(), move |nodes| {
            nodes.uncalibrate(id, seed);
        })
    }

    fn power(
        interface: &str,
        chosen: Vec<NodeId>,
        unconfigured: Vec<NodeId>,
        prepare: impl FnOnce(&mut Realtime<SocketBus>) + Send + 'static,
    ) -> Self {
        let bus = SocketBus::open(interface).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&stop);
        let thread = thread::spawn(move || {
            let plant = Config::default();
            let mut nodes = Realtime::with_unconfigured(bus, &plant, 1, &chosen, &unconfigured);
            prepare(&mut nodes);
            nodes.run(|_| !told.load(Ordering::Relaxed)).unwrap()
        });
        Self {
            stop,
            thread: Some(thread),
        }
    }

    pub fn end(mut self) -> Counters {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap()
    }
}

impl Drop for Nodes {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}
