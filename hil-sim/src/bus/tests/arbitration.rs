//! The order on the bus against a wired AND of single bits.

use embedded_can::{ExtendedId, Id, StandardId};

use super::*;

/// The bits of the arbitration field as each controller would drive them, recessive as '1'.
fn driven(frame: &Frame) -> String {
    let rtr = if frame.is_remote() { "1" } else { "0" };
    match frame.id() {
        Id::Standard(id) => format!("{:011b}{rtr}0", id.as_raw()),
        Id::Extended(id) => {
            let whole = format!("{:029b}", id.as_raw());
            format!("{}11{}{rtr}", &whole[..11], &whole[11..])
        }
    }
}

/// Takes one frame after the other out of `frames` as a bus of single bits does: whoever drives
/// recessive and reads dominant falls silent.
fn wired_and_order(mut frames: Vec<Frame>) -> Vec<Frame> {
    let mut order = Vec::new();
    while !frames.is_empty() {
        let mut speaking: Vec<(usize, String)> = frames
            .iter()
            .enumerate()
            .map(|(at, frame)| (at, driven(frame)))
            .collect();
        let mut bit = 0;
        while speaking.len() > 1 {
            let level = |field: &str| field.as_bytes().get(bit).copied();
            assert!(
                speaking.iter().any(|(_, field)| level(field).is_some()),
                "two equal fields"
            );
            let dominant = speaking.iter().any(|(_, field)| level(field) == Some(b'0'));
            if dominant {
                speaking.retain(|(_, field)| level(field) != Some(b'1'));
            }
            bit += 1;
        }
        order.push(frames.remove(speaking[0].0));
    }
    order
}

/// Frames with different arbitration fields that often share a base identifier.
fn random_frames(random: &mut Random, count: usize) -> Vec<Frame> {
    let mut frames: Vec<Frame> = Vec::new();
    while frames.len() < count {
        let base = [
            0x000,
            0x080,
            0x181,
            0x182,
            0x555,
            0x7FF,
            random.below(0x800) as u32,
        ][random.below(7) as usize];
        let length = random.below(9) as usize;
        let data = random.next().to_be_bytes();
        let id: Id = if random.below(2) == 0 {
            StandardId::new(base as u16).unwrap().into()
        } else {
            let low = [0, 1, 0x3_FFFF, random.below(0x4_0000) as u32][random.below(4) as usize];
            ExtendedId::new(base << 18 | low).unwrap().into()
        };
        let frame = if random.below(4) == 0 {
            Frame::remote(id, length as u8)
        } else {
            Frame::new(id, &data[..length])
        }
        .unwrap();
        if frames.iter().all(|other| driven(other) != driven(&frame)) {
            frames.push(frame);
        }
    }
    frames
}

#[test]
fn the_order_is_that_of_a_wired_and_bit_by_bit() {
    let seed = 0x0EE1_0001;
    println!("seed {seed:#x}");
    let mut random = Random(seed);
    for round in 0..2_000 {
        let count = 2 + random.below(20) as usize;
        let frames = random_frames(&mut random, count);
        let (mut bus, ids) = bus(6);
        let listener = bus.attach(ControllerConfig {
            receive_depth: 64,
            ..ControllerConfig::default()
        });
        for frame in &frames {
            bus.enqueue(0, ids[random.below(6) as usize], *frame)
                .unwrap();
        }
        let order: Vec<Frame> = deliveries(&mut bus, 10_000_000)
            .iter()
            .map(|delivery| delivery.frame)
            .collect();
        assert_eq!(
            order,
            wired_and_order(frames),
            "seed {seed:#x}, round {round}"
        );
        assert_eq!(received(&mut bus, listener.unwrap()), order);
    }
}

#[test]
fn a_standard_data_frame_wins_against_all_that_share_its_base_identifier() {
    let standard = StandardId::new(0x123).unwrap();
    let extended = ExtendedId::new(0x123 << 18).unwrap();
    let in_order = [
        Frame::new(standard, &[]).unwrap(),
        Frame::remote(standard, 0).unwrap(),
        Frame::new(extended, &[]).unwrap(),
        Frame::remote(extended, 0).unwrap(),
        Frame::standard(0x124, &[]).unwrap(),
    ];
    assert!(in_order.is_sorted_by(|one, next| arbitration_field(one) < arbitration_field(next)));
    let (mut bus, ids) = bus(5);
    for (frame, id) in in_order.iter().rev().zip(&ids) {
        bus.enqueue(0, *id, *frame).unwrap();
    }
    let order: Vec<Frame> = deliveries(&mut bus, 1_000_000)
        .iter()
        .map(|delivery| delivery.frame)
        .collect();
    assert_eq!(order, in_order);
    assert_eq!(bus.statistics().arbitration_losses, 4 + 3 + 2 + 1);
}

#[test]
fn who_loads_at_the_start_instant_takes_part_and_who_loads_later_waits() {
    for (late_ns, first) in [(0, 0x100), (1, 0x200)] {
        let (mut bus, ids) = bus(3);
        bus.enqueue(5_000, ids[0], frame(0x200, &[])).unwrap();
        assert_eq!(deliveries(&mut bus, 5_000), []);
        bus.enqueue(5_000 + late_ns, ids[1], frame(0x100, &[]))
            .unwrap();
        let order = deliveries(&mut bus, 1_000_000);
        assert_eq!(order[0].frame.raw_id(), first, "{late_ns} ns late");
        assert_eq!(order[0].start_ns, 5_000);
    }
}

#[test]
fn who_loads_when_the_bus_becomes_idle_takes_part() {
    for (late_ns, second) in [(0, 0x100), (1, 0x700)] {
        let (mut bus, ids) = bus(3);
        bus.enqueue(0, ids[0], frame(0x080, &[1])).unwrap();
        bus.enqueue(0, ids[0], frame(0x700, &[5])).unwrap();
        let idle_ns = 59 * BIT_NS;
        bus.advance(idle_ns, &mut |_| {});
        bus.enqueue(idle_ns + late_ns, ids[1], frame(0x100, &[]))
            .unwrap();
        let order = deliveries(&mut bus, 1_000_000);
        assert_eq!(order[0].start_ns, idle_ns);
        assert_eq!(order[0].frame.raw_id(), second, "{late_ns} ns late");
    }
}

#[test]
fn events_bear_the_names_of_the_order_in_which_they_happen() {
    let (mut bus, ids) = bus(2);
    let (high, low) = (frame(0x080, &[1]), frame(0x181, &[2]));
    bus.enqueue(0, ids[0], low).unwrap();
    bus.enqueue(0, ids[1], high).unwrap();
    let seen = events(&mut bus, 58 * BIT_NS);
    let end_ns = 56 * BIT_NS;
    assert_eq!(
        seen,
        [
            Event::ArbitrationLost {
                start_ns: 0,
                loser: ids[0],
                frame: low
            },
            Event::Transmit {
                start_ns: 0,
                sender: ids[1],
                frame: high
            },
            Event::Confirm(Delivery {
                start_ns: 0,
                end_ns,
                sender: ids[1],
                frame: high,
                bits: 59
            }),
        ]
    );
}
