//! The bus against independent models of what a real one does.

mod arbitration;
mod faults;
mod queues;
mod timing;

use eel_protocol::Frame;

use super::*;

const BIT_NS: u64 = 1_000;

fn bus(controllers: usize) -> (Bus, Vec<ControllerId>) {
    let config = ControllerConfig {
        transmit_buffers: 64,
        receive_depth: 4096,
        ..ControllerConfig::default()
    };
    bus_of(controllers, &config)
}

fn bus_of(controllers: usize, config: &ControllerConfig) -> (Bus, Vec<ControllerId>) {
    let mut bus = Bus::new(BitRate::ONE_MEGABIT);
    let ids = (0..controllers)
        .map(|_| bus.attach(config.clone()).unwrap())
        .collect();
    (bus, ids)
}

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::standard(id, data).unwrap()
}

/// Lets time pass and returns the frames that were delivered.
fn deliveries(bus: &mut Bus, to_ns: u64) -> Vec<Delivery> {
    let mut found = Vec::new();
    bus.advance(to_ns, &mut |event| {
        if let Event::Confirm(delivery) = event {
            found.push(*delivery);
        }
    });
    found
}

fn events(bus: &mut Bus, to_ns: u64) -> Vec<Event> {
    let mut found = Vec::new();
    bus.advance(to_ns, &mut |event| found.push(*event));
    found
}

fn received(bus: &mut Bus, id: ControllerId) -> Vec<Frame> {
    std::iter::from_fn(|| bus.receive(id))
        .map(|(_, frame)| frame)
        .collect()
}

/// Xorshift64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, limit: u64) -> u64 {
        self.next() % limit
    }
}
