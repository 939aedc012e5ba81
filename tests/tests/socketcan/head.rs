//! The head on the interface, in a thread of its own.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant as HostInstant};

use eel_head::{Config, Event, Gait, Phase};
use eel_protocol::Cob;
use eel_transport::{Bus, BusError, SocketBus};
use eel_units::Instant;

use crate::support::PATIENCE;

/// Longest time between two ticks of the head.
const TICK: Duration = Duration::from_micros(500);

/// A head that swims until it is told to stop.
pub struct Head {
    beats: Arc<AtomicUsize>,
    events: mpsc::Receiver<Event>,
    stop: mpsc::Sender<()>,
    thread: thread::JoinHandle<Vec<Event>>,
}

impl Head {
    /// Starts a head that expects these vertebrae, bit 0 the first.
    pub fn start(interface: &str, expected: u16) -> Self {
        let mut bus = SocketBus::open(interface).unwrap();
        let beats = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&beats);
        let (told, events) = mpsc::channel();
        let (stop, stopped) = mpsc::channel();
        let thread = thread::spawn(move || run(&mut bus, expected, &counted, &told, &stopped));
        Self {
            beats,
            events,
            stop,
            thread,
        }
    }

    /// Waits until the gait has begun.
    pub fn wait_until_it_swims(&self) {
        loop {
            match self.events.recv_timeout(PATIENCE) {
                Ok(Event::GaitStarted) => return,
                Ok(_) => {}
                Err(error) => panic!("the gait does not begin: {error}"),
            }
        }
    }

    /// Waits until it has sent so many SYNCs in all.
    pub fn wait_for_beats(&self, beats: usize) {
        let start = HostInstant::now();
        while self.beats.load(Ordering::Relaxed) < beats {
            assert!(start.elapsed() < 4 * PATIENCE, "the head stands still");
            thread::sleep(Duration::from_millis(50));
        }
    }

    /// Stops in order and returns everything that happened.
    pub fn stop(self) -> Vec<Event> {
        self.stop.send(()).unwrap();
        self.thread.join().unwrap()
    }
}

/// Runs the head until it has stopped.
fn run(
    bus: &mut SocketBus,
    expected: u16,
    beats: &AtomicUsize,
    told: &mpsc::Sender<Event>,
    stopped: &mpsc::Receiver<()>,
) -> Vec<Event> {
    let start = HostInstant::now();
    let now = || Instant::from_micros(start.elapsed().as_micros() as u64);
    let mut config = Config::new(Gait::SWIM);
    config.expected = expected;
    let mut head = eel_head::Head::new(config, now());
    let mut events = Vec::new();
    while head.phase() != Phase::Stopped {
        if let Some(received) = bus.receive(TICK).unwrap()
            && let Some(frame) = received.frame()
        {
            head.handle_frame(now(), frame);
        }
        if stopped.try_recv().is_ok() {
            head.stop(now());
        }
        head.tick(now());
        while let Some(frame) = head.poll_transmit() {
            while matches!(bus.send(&frame), Err(BusError::Full)) {
                thread::yield_now();
            }
            let is_sync = frame.cob_id() == Some(Cob::Sync.id());
            beats.fetch_add(usize::from(is_sync), Ordering::Relaxed);
        }
        while let Some(event) = head.poll_event() {
            events.push(event);
            // Nobody needs to listen.
            let _ = told.send(event);
        }
    }
    assert_eq!(head.dropped(), 0);
    events
}
