//! Whatever comes over the bus, the head neither panics nor loses its beat.

mod common;

use common::{Spine, node_id};
use eel_protocol::{Cob, Frame};
use embedded_can::{ExtendedId, Frame as _, StandardId};

/// Xorshift64* (Marsaglia 2003, Vigna 2016).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound
    }

    /// Returns any frame; most carry an identifier that the head listens to.
    fn frame(&mut self) -> Frame {
        let length = self.below(9) as usize;
        let bytes = self.next().to_le_bytes();
        let node = self.below(12) as u8;
        let cob = match self.below(6) {
            0 => Cob::Heartbeat(node).id(),
            1 => Cob::Pose(node).id(),
            2 => Cob::Emergency(node).id(),
            _ => self.below(0x800) as u16,
        };
        let standard = StandardId::new(cob).expect("11 bits");
        let extended = ExtendedId::new(self.below(1 << 29) as u32).expect("29 bits");
        let made = match self.below(16) {
            0 => Frame::new(extended, &bytes[..length]),
            1 => Frame::new_remote(standard, length),
            2 => Frame::new(standard, &bytes[..1]),
            _ => Frame::new(standard, &bytes[..length]),
        };
        made.expect("at most eight bytes")
    }
}

#[test]
fn two_hundred_thousand_frames_of_any_kind_do_no_harm() {
    let seed = std::env::var("ANGUILLA_SEED")
        .ok()
        .and_then(|text| text.parse().ok());
    let seed = seed.unwrap_or_else(|| {
        let clock = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        clock.map_or(1, |since| since.as_nanos() as u64) | 1
    });
    println!("ANGUILLA_SEED={seed}");
    let mut random = Random(seed);
    let mut spine = Spine::new();
    spine.run(1_000);
    for _ in 0..20_000 {
        let now = spine.now();
        for _ in 0..10 {
            let frame = random.frame();
            spine.head.handle_frame(now, &frame);
        }
        match random.below(10_000) {
            0 => spine.head.reset(),
            1 => spine.head.stop(now),
            _ => {}
        }
        spine.run(1);
    }
    assert_eq!(spine.head.dropped(), 0);
    assert_eq!(spine.sent_as(Cob::Sync).len(), 2_100);
    assert_eq!(spine.sent_as(Cob::Heartbeat(127)).len(), 210);
    let bad: u32 = (1..=10)
        .map(|id| spine.head.node(node_id(id)).unwrap().bad_reports)
        .sum();
    assert!(bad > 10_000, "{bad} of about 28 000 reports are bad");
}
