//! When frames are on the bus, how long they wait at most, and how busy it is.

use eel_protocol::{Cob, VERTEBRAE};
use eel_transport::{frame_bits, frame_bits_max};

use super::*;

#[test]
fn a_frame_takes_its_bits_and_the_next_follows_after_the_intermission() {
    let (mut bus, ids) = bus(2);
    // 59 and 127 bits: tests/python/frame_bits.py.
    bus.enqueue(1_234, ids[0], frame(0x080, &[1])).unwrap();
    bus.enqueue(1_234, ids[0], frame(0x555, &[0x55; 8]))
        .unwrap();
    assert_eq!(bus.next_event_ns(), Some(1_234 + 56 * BIT_NS));
    let order = deliveries(&mut bus, 1_000_000);
    assert_eq!(
        (order[0].start_ns, order[0].end_ns, order[0].bits),
        (1_234, 57_234, 59)
    );
    assert_eq!(
        (order[1].start_ns, order[1].end_ns),
        (60_234, 60_234 + 109 * BIT_NS)
    );
    assert_eq!(bus.receive(ids[1]), Some((57_234, order[0].frame)));
    assert_eq!(bus.next_event_ns(), None);
}

#[test]
fn a_slower_bus_takes_longer_by_as_much() {
    let mut bus = Bus::new(BitRate::new(125_000).unwrap());
    let ids: Vec<_> = (0..2)
        .map(|_| bus.attach(ControllerConfig::default()).unwrap())
        .collect();
    bus.enqueue(0, ids[0], frame(0x080, &[1])).unwrap();
    assert_eq!(bus.next_event_ns(), Some(56 * 8_000));
    assert_eq!(BitRate::new(0), None);
    assert_eq!(BitRate::new(83_333), None);
    assert_eq!(BitRate::new(2_000_000), None);
}

/// The frames of one period: SYNC, ten targets and ten poses, in the order of their priority.
fn one_period(random: &mut Random) -> Vec<Frame> {
    let nodes = 1..=VERTEBRAE;
    let mut frames = vec![frame(Cob::Sync.id(), &[1])];
    frames.extend(
        nodes
            .clone()
            .map(|node| frame(Cob::Pose(node).id(), &random.next().to_be_bytes())),
    );
    frames.extend(nodes.map(|node| frame(Cob::Target(node).id(), &random.next().to_be_bytes())));
    frames
}

/// The worst response time of message `at` in bit times, with one queuing of each message
/// (Davis, Burns, Bril, Lukkien 2007, equations 7 and 8; the longest frame blocks).
fn bound(lengths: &[u8], at: usize) -> u64 {
    const PERIOD_BITS: u64 = 10_000;
    let cost = |length: u8| u64::from(frame_bits_max(length));
    let blocking = cost(8);
    let mut waiting = blocking;
    loop {
        let interference: u64 = lengths[..at]
            .iter()
            .map(|length| (waiting + 1).div_ceil(PERIOD_BITS) * cost(*length))
            .sum();
        if blocking + interference == waiting {
            return waiting + cost(lengths[at]);
        }
        waiting = blocking + interference;
    }
}

#[test]
fn twenty_one_frames_at_once_come_in_order_and_within_the_bound() {
    let seed = 0x0EE1_0002;
    println!("seed {seed:#x}");
    let mut random = Random(seed);
    let mut worst_bits = 0;
    for _ in 0..500 {
        let frames = one_period(&mut random);
        let lengths: Vec<u8> = frames.iter().map(Frame::length).collect();
        let (mut bus, ids) = bus(12);
        // The longest frame of lowest priority has just begun when all others are loaded.
        bus.enqueue(0, ids[11], frame(0x7FF, &[0xFF; 8])).unwrap();
        let loaded_ns = 1;
        for (at, frame) in frames.iter().enumerate().rev() {
            bus.enqueue(loaded_ns, ids[at % 11], *frame).unwrap();
        }
        let order = deliveries(&mut bus, 10_000_000);
        assert_eq!(order.len(), 22);
        for (at, (sent, got)) in frames.iter().zip(&order[1..]).enumerate() {
            assert_eq!(got.frame, *sent);
            let latency_ns = got.end_ns - loaded_ns;
            assert!(
                latency_ns <= bound(&lengths, at) * BIT_NS,
                "message {at}: {latency_ns} ns"
            );
            worst_bits = worst_bits.max(latency_ns / BIT_NS);
        }
    }
    let lengths = [[1; 1].as_slice(), &[8; 20]].concat();
    println!(
        "worst latency {worst_bits} bits, bound {} bits",
        bound(&lengths, 20)
    );
    assert!(
        worst_bits > 2_200,
        "the bound would hold for a bus that is far too fast"
    );
}

/// Random traffic of eleven controllers for a simulated 200 ms, and what the bus made of it.
fn traffic(seed: u64, step: impl Fn(&mut Bus, u64) -> u64) -> (Vec<Event>, Bus) {
    const END_NS: u64 = 200_000_000;
    let mut random = Random(seed);
    let (mut bus, ids) = bus_of(11, &ControllerConfig::default());
    let mut loads: Vec<(u64, usize, Frame)> = (0..1_500)
        .map(|_| {
            let sender = random.below(11);
            let id = 0x100 | (random.below(16) << 4 | sender) as u16;
            let data = random.next().to_be_bytes();
            let frame = frame(id, &data[..random.below(9) as usize]);
            (random.below(180_000) * BIT_NS, sender as usize, frame)
        })
        .collect();
    loads.sort_by_key(|(time_ns, ..)| *time_ns);
    let mut seen = Vec::new();
    let mut now_ns = 0;
    let mut loads = loads.into_iter().peekable();
    while now_ns < END_NS {
        let limit_ns = loads.peek().map_or(END_NS, |(time_ns, ..)| *time_ns);
        now_ns = step(&mut bus, now_ns).min(limit_ns).min(END_NS);
        bus.advance(now_ns, &mut |event| seen.push(*event));
        while let Some((time_ns, sender, frame)) = loads.next_if(|(at_ns, ..)| *at_ns <= now_ns) {
            let _ = bus.enqueue(time_ns, ids[sender], frame);
        }
    }
    (seen, bus)
}

#[test]
fn the_load_is_the_sum_of_the_bits_of_the_delivered_frames() {
    let (seen, bus) = traffic(0x0EE1_0003, |_, now_ns| now_ns + 777_777);
    let mut frames = 0;
    let mut bits = 0;
    for event in &seen {
        if let Event::Confirm(delivery) = event {
            assert_eq!(delivery.bits, frame_bits(&delivery.frame));
            frames += 1;
            bits += u64::from(frame_bits(&delivery.frame));
        }
    }
    assert!(frames > 1_000, "{frames}");
    assert_eq!(bus.statistics().frames, frames);
    assert_eq!(bus.statistics().busy_bits(), bits);
    assert!((bus.load() - bits as f64 / 200_000.0).abs() < 1e-12);
}

#[test]
fn frames_never_overlap_and_keep_the_interframe_space() {
    let (seen, _) = traffic(0x0EE1_0004, |_, now_ns| now_ns + 1_000_000);
    let mut idle_ns = 0;
    for event in &seen {
        if let Event::Confirm(delivery) = event {
            assert!(delivery.start_ns >= idle_ns);
            idle_ns = delivery.end_ns + 3 * BIT_NS;
        }
    }
}

#[test]
fn how_time_is_cut_into_steps_makes_no_difference() {
    for seed in [0x0EE1_0005, 0x0EE1_0006] {
        let (whole, bus) = traffic(seed, |_, _| u64::MAX);
        let (fine, fine_bus) = traffic(seed, |_, now_ns| now_ns + 1_000);
        let (odd, _) = traffic(seed, |_, now_ns| now_ns + 12_345);
        let (by_event, _) = traffic(seed, |bus, _| bus.next_event_ns().unwrap_or(u64::MAX));
        assert!(
            whole == fine && whole == odd && whole == by_event,
            "seed {seed:#x}"
        );
        assert_eq!(bus.statistics(), fine_bus.statistics());
    }
}
