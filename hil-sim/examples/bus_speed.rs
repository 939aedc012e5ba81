//! How many frames a second the bus model carries between eleven busy controllers:
//! `cargo run --release -p hil-sim --example bus_speed`.

use std::time::Instant;

use eel_protocol::Frame;
use hil_sim::bus::{BitRate, Bus, ControllerConfig, EnqueueError, Event};

const FRAMES: u64 = 3_000_000;

fn main() {
    let mut bus = Bus::new(BitRate::ONE_MEGABIT);
    let ids: Vec<_> = (0..11)
        .filter_map(|_| bus.attach(ControllerConfig::default()).ok())
        .collect();
    let start = Instant::now();
    let (mut confirmed, mut read, mut number, mut now_ns) = (0u64, 0u64, 0u64, 0);
    while confirmed < FRAMES {
        for (at, id) in ids.iter().enumerate() {
            while bus.free_buffers(*id) > 0 {
                let data = number.wrapping_mul(0x9E37_79B9_7F4A_7C15).to_be_bytes();
                let cob_id = (number as u16 & 0x3F) << 4 | at as u16;
                let frame = Frame::standard(cob_id, &data);
                match frame.map_or(Err(EnqueueError::Off), |frame| {
                    bus.enqueue(now_ns, *id, frame)
                }) {
                    Ok(()) => number += 1,
                    Err(_) => break,
                }
            }
        }
        now_ns = bus.next_event_ns().unwrap_or(now_ns + 1_000);
        bus.advance(now_ns, &mut |event| {
            confirmed += u64::from(matches!(event, Event::Confirm(_)));
        });
        for id in &ids {
            while bus.receive(*id).is_some() {
                read += 1;
            }
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    let simulated = now_ns as f64 / 1e9;
    println!(
        "{confirmed} frames, {read} receptions in {seconds:.2} s: {:.2} M frames/s, {:.0} times real \
         time at a load of {:.1} %",
        confirmed as f64 / seconds / 1e6,
        simulated / seconds,
        100.0 * bus.load()
    );
}
