//! `hil-sim --can`: vertebrae in real time on a SocketCAN interface.

use std::io::{IsTerminal, Write, stderr};
use std::time::{Duration, Instant};

use eel_protocol::NodeId;
use hil_sim::realtime::Counters;

use crate::interrupt;

/// Time between two lines of the display.
const SHOWN: Duration = Duration::from_secs(1);

/// What to run.
pub struct Live<'a> {
    /// Name of the interface.
    pub interface: &'a str,
    /// Which vertebrae, by place in the chain, have their node id.
    pub nodes: &'a [NodeId],
    /// Which have none, until LSS gives them one.
    pub unconfigured: &'a [NodeId],
    /// Which were never calibrated.
    pub uncalibrated: &'a [NodeId],
    /// The order in which the daisy line goes through the places.
    pub chain: Option<&'a [NodeId]>,
    /// Time until the end, s; until Ctrl-C without one.
    pub seconds: Option<f64>,
    /// Where encoders start, noise of the sensors.
    pub seed: u64,
}

impl Live<'_> {
    /// Returns how many vertebrae there are.
    #[cfg(target_os = "linux")]
    fn count(&self) -> usize {
        let all = NodeId::all();
        all.filter(|id| self.nodes.contains(id) || self.unconfigured.contains(id))
            .count()
    }
}

/// Runs the vertebrae and tells whether the bus took every frame.
///
/// # Errors
/// What the bus fails with, and what to do about it.
#[cfg(target_os = "linux")]
pub fn run(live: &Live<'_>) -> anyhow::Result<bool> {
    use eel_transport::{BusError, SocketBus};
    use hil_sim::plant::Config;
    use hil_sim::realtime::Realtime;

    // The text of a bus error names its cause and the cure.
    let told = |error: BusError| anyhow::anyhow!(error.to_string());
    let bus = SocketBus::open(live.interface).map_err(told)?;
    let plant = Config::default();
    let (nodes, unconfigured) = (live.nodes, live.unconfigured);
    let mut vertebrae = Realtime::with_unconfigured(bus, &plant, live.seed, nodes, unconfigured);
    if let Some(order) = live.chain {
        vertebrae.wire(order);
    }
    for id in live.uncalibrated {
        vertebrae.uncalibrate(*id, live.seed);
    }
    let mut display = Display::new();
    let limit = live.seconds.map(Duration::from_secs_f64);
    let start = Instant::now();
    let counters = vertebrae.run(|counters| {
        let elapsed = start.elapsed();
        display.show(elapsed, counters);
        !interrupt::came() && limit.is_none_or(|limit| elapsed < limit)
    });
    display.end();
    let counters = counters.map_err(told)?;
    let Counters {
        skipped,
        received,
        sent,
        dropped,
        ..
    } = counters;
    crate::write(format_args!(
        "{} on {} for {:.1} s: {received} frames in, {sent} out, {skipped} ticks late, {dropped} \
         frames not taken by the bus\n",
        match live.count() {
            1 => "1 vertebra".to_owned(),
            count => format!("{count} vertebrae"),
        },
        live.interface,
        start.elapsed().as_secs_f64(),
    ))?;
    Ok(dropped == 0)
}

/// Says why there is nothing to run on.
///
/// # Errors
/// Always.
#[cfg(not(target_os = "linux"))]
pub fn run(live: &Live<'_>) -> anyhow::Result<bool> {
    anyhow::bail!(
        "can't open {}: SocketCAN interfaces exist on Linux only; `hil-sim swim` needs none",
        live.interface
    )
}

/// One line that is written over once a second, where somebody looks.
struct Display {
    on: bool,
    due: Duration,
    before: Counters,
}

impl Display {
    fn new() -> Self {
        Self {
            on: stderr().is_terminal(),
            due: SHOWN,
            before: Counters::default(),
        }
    }

    fn show(&mut self, elapsed: Duration, counters: &Counters) {
        if !self.on || elapsed < self.due {
            return;
        }
        let span_s = (elapsed - (self.due - SHOWN)).as_secs_f64();
        let rate = |now: u64, before: u64| (now - before) as f64 / span_s;
        let before = &self.before;
        // What can't be shown is no reason to end.
        let _ = write!(
            stderr(),
            "\r{:6.0} s  {:4.2}x real time  {:5.0} frames/s in  {:5.0} frames/s out  {} ticks late\x1b[K",
            elapsed.as_secs_f64(),
            rate(counters.ticks, before.ticks) / 1e3,
            rate(counters.received, before.received),
            rate(counters.sent, before.sent),
            counters.skipped,
        );
        self.before = *counters;
        self.due = elapsed + SHOWN;
    }

    fn end(&self) {
        if self.on {
            let _ = write!(stderr(), "\r\x1b[K");
        }
    }
}
