//! The client against a peer that says anything: it ends, within bounds, and does not panic.

use std::collections::VecDeque;
use std::time::Duration;

use eel_protocol::Frame;
use eel_transport::{Bus, BusError, Content, Received};

use crate::client::{Client, Settings};
use crate::error::Multiplexor;
use crate::sdo::Method;

/// A peer that answers each frame with up to three others, mostly such as may come.
struct Noise {
    random: u64,
    coming: VecDeque<Frame>,
    sent: u64,
}

/// Command bytes that mean something somewhere.
const COMMANDS: [u8; 24] = [
    0x40, 0x41, 0x42, 0x43, 0x4F, 0x60, 0x20, 0x30, 0x00, 0x10, 0x01, 0x11, 0x1D, 0xC6, 0xC2, 0xC4,
    0xA4, 0xA0, 0xA2, 0xA1, 0xC1, 0xDD, 0x80, 0x81,
];

impl Noise {
    /// A number below `limit` (xorshift64*).
    fn below(&mut self, limit: u64) -> u64 {
        self.random ^= self.random >> 12;
        self.random ^= self.random << 25;
        self.random ^= self.random >> 27;
        (self.random.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) % limit
    }

    fn answer(&mut self) -> Frame {
        let command = match self.below(4) {
            0 => self.below(256) as u8,
            _ => COMMANDS[self.below(24) as usize],
        };
        let mut data = [command, 0x01, 0x21, 0x01, 0, 0, 0, 0];
        for byte in data.iter_mut().skip(if self.below(3) == 0 { 1 } else { 4 }) {
            *byte = match self.below(3) {
                0 => self.below(256) as u8,
                _ => self.below(4) as u8,
            };
        }
        let id = match self.below(8) {
            0 => self.below(0x800) as u16,
            1 => 0x7E4,
            _ => 0x583,
        };
        let length = if self.below(16) == 0 {
            self.below(9)
        } else {
            8
        };
        Frame::standard(id, &data[..length as usize]).unwrap()
    }
}

impl Bus for Noise {
    fn send(&mut self, _: &Frame) -> Result<(), BusError> {
        self.sent += 1;
        for _ in 0..self.below(4) {
            let frame = self.answer();
            self.coming.push_back(frame);
        }
        Ok(())
    }

    fn receive(&mut self, _: Duration) -> Result<Option<Received>, BusError> {
        Ok(self.coming.pop_front().map(|frame| Received {
            time_ns: 0,
            content: Content::Frame(frame),
            direction: None,
        }))
    }
}

#[test]
fn whatever_comes_the_client_ends() {
    const SEED: u64 = 0x00AC_CE55;
    println!("seed {SEED:#X}");
    let settings = Settings {
        answer: Duration::ZERO,
        quiet: Duration::ZERO,
        lss: Duration::ZERO,
        lss_settle: Duration::ZERO,
        longest: 4_096,
        ..Settings::default()
    };
    let noise = Noise {
        random: SEED,
        coming: VecDeque::new(),
        sent: 0,
    };
    let mut client = Client::with_settings(noise, settings);
    let object = Multiplexor::new(0x2101, 1);
    let mut succeeded = [0_u32; 4];
    for round in 0..20_000_usize {
        let method = [Method::Automatic, Method::Segmented, Method::Block][round % 3];
        let read = client.upload(3, object, method, &mut |_| ());
        succeeded[0] += u32::from(read.is_ok());
        let data = vec![0; round % 40];
        let written = client.download(3, object, &data, method, &mut |_| ());
        succeeded[1] += u32::from(written.is_ok());
        // What one node does not know another may.
        client.blockless = 0;
        if round % 100 == 0 {
            succeeded[2] += u32::from(client.lss().scan(None).is_ok());
            succeeded[3] += u32::from(client.lss().list().is_ok());
        }
    }
    let noise = client.into_bus();
    println!("{succeeded:?} of noise went through, {} frames", noise.sent);
    assert!(
        succeeded[0] > 0 && succeeded[1] > 0,
        "the noise is too far from the standard"
    );
    assert!(noise.sent < 20_000_000);
}
