//! The control tick: once per millisecond, one turn of the vertebra.

use core::array::from_fn;

use eel_protocol::NodeId;
use eel_units::{Duration as Span, Instant as Moment};
use eel_vertebra::store::{StoreError, Stored};
use eel_vertebra::{Event, Identifiers, Keepsake, Sample, Settings, Vertebra, turn};
use embassy_stm32::Peri;
use embassy_stm32::can::Properties;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::peripherals::{PB3, PB5};
use embassy_time::{Duration, Instant, Ticker, Timer};

use crate::bridges::{self, Bridges};
use crate::currents::{self, Currents};
use crate::failure::Start;
use crate::sensors::{Counters, CrankConnections, Cranks, temperatures};
use crate::{bus, failure, liveness, power, storage};

/// Length of a tick that is not trimmed.
const TICK_NS: u64 = 1_000_000;

/// Everything that the tick measures with and acts on.
pub struct Hardware {
    /// The bridges.
    pub bridges: bridges::Connections,
    /// Current and supply measurement.
    pub currents: currents::Connections,
    /// Motor encoders.
    pub counters: crate::sensors::CounterConnections,
    /// Crank encoders.
    pub cranks: CrankConnections,
    /// The daisy line's IN and OUT.
    pub chain: (Peri<'static, PB5>, Peri<'static, PB3>),
    /// What the CAN controller lets pass.
    pub filters: Properties,
}

/// What the vertebra is made of.
pub struct Birth {
    /// What the board says.
    pub settings: Settings,
    /// What the flash says.
    pub stored: Stored,
    /// What led to the start.
    pub cause: Start,
    /// What was remembered of before.
    pub kept: Keepsake,
}

/// Runs the vertebra; after a failure it stays stopped until the head has sent a fault reset.
#[embassy_executor::task]
pub async fn run(hardware: Hardware, birth: Birth) {
    let (crank_bus, select) = hardware.cranks.start();
    let cranks = Cranks::new(&crank_bus, select);
    let bridges = Bridges::new(hardware.bridges, &birth.settings.motor);
    let (Some(mut cranks), Ok(mut bridges)) = (cranks, bridges) else {
        // Can't happen with these pins; the watchdog starts anew.
        bridges::force_off();
        return;
    };
    let chain_in = Input::new(hardware.chain.0, Pull::Up);
    let mut chain_out = Output::new(hardware.chain.1, Level::Low, Speed::Low);
    let mut currents = Currents::new(hardware.currents);
    let mut counters = Counters::new(hardware.counters);
    let mut ticker = Ticker::every(Duration::from_millis(1));
    // The bridges are off: what is measured now is the zero of the currents.
    while !currents.has_offsets() {
        ticker.next().await;
        currents.take();
        liveness::CONTROL.advance();
    }
    let Birth {
        settings,
        stored,
        cause,
        kept,
    } = birth;
    // In one place: each would have 6 KB of the stack for itself.
    let mut vertebra = Vertebra::with_stored(settings, &stored, now());
    if cause == Start::Failed {
        vertebra.stop_after_failure(&kept);
    }
    let mut heard = Identifiers::new();
    let mut due_ns = Instant::now().as_micros() * 1_000;
    loop {
        // A millisecond of this clock, trimmed so that the tick keeps its time after SYNC.
        due_ns = (due_ns + TICK_NS).saturating_add_signed(vertebra.tick_trim_ns().into());
        Timer::at(Instant::from_micros(due_ns / 1_000)).await;
        let start = Instant::now();
        let sample = Sample {
            chain_in: chain_in.is_high(),
            ..measure(&mut bridges, &mut currents, &mut counters, &mut cranks)
        };
        let frames = core::iter::from_fn(|| bus::RECEIVED.try_receive().ok()).take(bus::QUEUE);
        let drives = turn(
            &mut vertebra,
            now(),
            frames,
            &sample,
            bus::room(),
            bus::send,
        );
        bridges.apply(drives, sample.supply);
        chain_out.set_level(vertebra.chain_out().into());
        // Before anybody can answer what the turn sends: a boot-up under a new node id, say.
        let identifiers = vertebra.identifiers();
        if identifiers != heard {
            bus::hear(&hardware.filters, &identifiers);
            heard = identifiers;
        }
        report(&mut vertebra);
        store(&mut vertebra);
        if let Some(keepsake) = vertebra.poll_keepsake() {
            failure::remember(&keepsake);
        }
        let (received, transmitted) = bus::overruns();
        vertebra.note_overruns(received, transmitted);
        let micros = u32::try_from(start.elapsed().as_micros()).unwrap_or(u32::MAX);
        vertebra.note_loop_time(Span::from_micros(micros));
        let (last, longest) = currents::turn_ns();
        vertebra.note_current_loop(last, longest);
        liveness::CONTROL.advance();
    }
}

/// Returns the time since power-up.
fn now() -> Moment {
    Moment::from_micros(Instant::now().as_micros())
}

/// Measures everything once.
fn measure(
    bridges: &mut Bridges,
    currents: &mut Currents,
    counters: &mut Counters,
    cranks: &mut Cranks<'_>,
) -> Sample {
    let measured = currents.take();
    let (board_temperature, motor_temperature) = temperatures();
    let faults = bridges.faults();
    Sample {
        encoder_counts: counters.read(),
        absolute: cranks.read(),
        current: measured.currents,
        supply: measured.supply,
        board_temperature,
        motor_temperature,
        bridge_fault: from_fn(|motor| faults[motor] || measured.is_faulty[motor]),
        over_current: power::tripped(),
        sync_age: bus::sync_age(),
        chain_in: true,
        emergency_stop: bridges.take_emergency_stop(),
    }
}

/// Brings what is to be stored to the main thread, and the outcome back.
fn store(vertebra: &mut Vertebra) {
    if let Some(outcome) = storage::outcome() {
        vertebra.finish_store(now(), outcome);
    }
    if let Some(record) = vertebra.poll_store()
        && !storage::ask(record.clone())
    {
        vertebra.finish_store(now(), Err(StoreError::Flash));
    }
}

/// Logs what happened.
fn report(vertebra: &mut Vertebra) {
    while let Some(event) = vertebra.poll_event() {
        match event {
            Event::State { from, to } => defmt::info!("{=str} -> {=str}", from.name(), to.name()),
            Event::Emergency { emergency, .. } => {
                defmt::warn!("{=str} ({=u16:#06x})", emergency.name, emergency.code);
            }
            Event::Reset => defmt::info!("reset by the head"),
            Event::NodeId(node) => {
                defmt::info!("node id {=u8} by LSS", node.map_or(0, NodeId::get));
            }
        }
    }
}
