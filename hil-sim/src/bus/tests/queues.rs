//! The transmit buffers, filters and receive FIFOs of the STM32G474.

use super::*;

#[test]
fn the_fourth_frame_finds_no_buffer_until_one_is_confirmed() {
    let (mut bus, ids) = bus_of(2, &ControllerConfig::default());
    for id in [0x301, 0x302, 0x303] {
        bus.enqueue(0, ids[0], frame(id, &[])).unwrap();
    }
    assert_eq!(bus.free_buffers(ids[0]), 0);
    assert_eq!(
        bus.enqueue(0, ids[0], frame(0x001, &[])),
        Err(EnqueueError::Full)
    );
    assert_eq!(bus.controller(ids[0]).unwrap().refused, 1);
    let end_ns = bus.next_event_ns().unwrap();
    bus.advance(end_ns - 1, &mut |_| {});
    assert_eq!(bus.free_buffers(ids[0]), 0);
    bus.advance(end_ns, &mut |_| {});
    assert_eq!(bus.enqueue(end_ns, ids[0], frame(0x001, &[])), Ok(()));
    let order: Vec<u32> = deliveries(&mut bus, 1_000_000)
        .iter()
        .map(|delivery| delivery.frame.raw_id())
        .collect();
    assert_eq!(order, [0x001, 0x302, 0x303]);
}

#[test]
fn a_queue_sends_by_priority_and_a_fifo_by_age() {
    for (mode, expected) in [
        (TransmitMode::Queue, [0x100, 0x200, 0x300]),
        (TransmitMode::Fifo, [0x300, 0x100, 0x200]),
    ] {
        let config = ControllerConfig {
            transmit_mode: mode,
            ..ControllerConfig::default()
        };
        let (mut bus, ids) = bus_of(2, &config);
        for id in [0x300, 0x100, 0x200] {
            bus.enqueue(0, ids[0], frame(id, &[])).unwrap();
        }
        let order: Vec<u32> = deliveries(&mut bus, 1_000_000)
            .iter()
            .map(|delivery| delivery.frame.raw_id())
            .collect();
        assert_eq!(order, expected, "{mode:?}");
    }
}

#[test]
fn frames_of_one_identifier_may_overtake_each_other_in_a_queue_only() {
    // The third frame takes the buffer that the first left, which is below that of the second.
    for (mode, expected) in [
        (TransmitMode::Queue, [1, 3, 2]),
        (TransmitMode::Fifo, [1, 2, 3]),
    ] {
        let config = ControllerConfig {
            transmit_mode: mode,
            ..ControllerConfig::default()
        };
        let (mut bus, ids) = bus_of(2, &config);
        bus.enqueue(0, ids[0], frame(0x581, &[1])).unwrap();
        bus.enqueue(0, ids[0], frame(0x581, &[2])).unwrap();
        let end_ns = bus.next_event_ns().unwrap();
        bus.advance(end_ns, &mut |_| {});
        bus.enqueue(end_ns, ids[0], frame(0x581, &[3])).unwrap();
        bus.advance(1_000_000, &mut |_| {});
        let order: Vec<u8> = received(&mut bus, ids[1])
            .iter()
            .map(|frame| frame.data()[0])
            .collect();
        assert_eq!(order, expected, "{mode:?}");
    }
}

#[test]
fn a_frame_in_a_fifo_that_becomes_ready_later_holds_those_behind_it() {
    let config = ControllerConfig {
        transmit_mode: TransmitMode::Fifo,
        ..ControllerConfig::default()
    };
    let (mut bus, ids) = bus_of(2, &config);
    bus.enqueue(50_000, ids[0], frame(0x581, &[1])).unwrap();
    bus.enqueue(10_000, ids[0], frame(0x081, &[2])).unwrap();
    let order = deliveries(&mut bus, 1_000_000);
    assert_eq!(order[0].start_ns, 50_000);
    assert_eq!(order[0].frame.raw_id(), 0x581);
    assert_eq!(order.len(), 2);
}

#[test]
fn a_receive_fifo_overruns_after_three_frames_in_less_than_half_a_millisecond() {
    for (overflow, kept) in [
        (Overflow::Discard, [0, 1, 2]),
        (Overflow::Overwrite, [2, 3, 4]),
    ] {
        let config = ControllerConfig {
            overflow,
            ..ControllerConfig::default()
        };
        let (mut bus, ids) = bus(1);
        let listener = bus.attach(config).unwrap();
        for number in 0..5 {
            bus.enqueue(0, ids[0], frame(0x100 + number, &[number as u8; 8]))
                .unwrap();
        }
        bus.advance(400_000, &mut |_| {});
        assert_eq!(bus.controller(listener).unwrap().overruns, [0, 0]);
        bus.advance(500_000, &mut |_| {});
        assert_eq!(bus.controller(listener).unwrap().overruns, [1, 0]);
        bus.advance(1_000_000, &mut |_| {});
        assert_eq!(bus.controller(listener).unwrap().overruns, [2, 0]);
        let found: Vec<u8> = received(&mut bus, listener)
            .iter()
            .map(|frame| frame.data()[0])
            .collect();
        assert_eq!(found, kept, "{overflow:?}");
    }
}

#[test]
fn filters_sort_frames_into_the_two_fifos() {
    let filter = |matches, store| Filter {
        extended: false,
        matches,
        store,
    };
    let config = ControllerConfig {
        filters: vec![
            filter(FilterMatch::Dual(0x000, 0x080), Some(Fifo::One)),
            filter(FilterMatch::Mask(0x205, 0x7FF), Some(Fifo::Zero)),
            filter(FilterMatch::Range(0x600, 0x67F), Some(Fifo::Zero)),
        ],
        otherwise: None,
        ..ControllerConfig::default()
    };
    let (mut bus, ids) = bus(1);
    let listener = bus.attach(config).unwrap();
    for id in [
        0x000, 0x080, 0x204, 0x205, 0x206, 0x5FF, 0x600, 0x67F, 0x680,
    ] {
        bus.enqueue(0, ids[0], frame(id, &[])).unwrap();
    }
    let long = embedded_can::ExtendedId::new(0x080).unwrap();
    bus.enqueue(0, ids[0], Frame::new(long, &[]).unwrap())
        .unwrap();
    bus.advance(2_000_000, &mut |_| {});
    let mut of = |fifo| -> Vec<u32> {
        std::iter::from_fn(|| bus.receive_from(listener, fifo))
            .map(|(_, frame)| frame.raw_id())
            .collect()
    };
    assert_eq!(of(Fifo::One), [0x000, 0x080]);
    assert_eq!(of(Fifo::Zero), [0x205, 0x600, 0x67F]);
    assert_eq!(bus.controller(listener).unwrap().filtered, 5);
}

#[test]
fn more_filters_than_the_hardware_has_are_refused() {
    let filter = |extended| Filter {
        extended,
        matches: FilterMatch::Dual(1, 2),
        store: Some(Fifo::Zero),
    };
    let mut bus = Bus::new(BitRate::ONE_MEGABIT);
    let mut attach = |standard: usize, extended: usize| {
        let mut filters = vec![filter(false); standard];
        filters.extend(vec![filter(true); extended]);
        bus.attach(ControllerConfig {
            filters,
            ..ControllerConfig::default()
        })
        .err()
    };
    assert_eq!(attach(28, 8), None);
    assert_eq!(attach(29, 0), Some(AttachError::TooManyFilters));
    assert_eq!(attach(0, 9), Some(AttachError::TooManyFilters));
    for _ in 1..64 {
        assert_eq!(attach(0, 0), None);
    }
    assert_eq!(attach(0, 0), Some(AttachError::BusFull));
}
