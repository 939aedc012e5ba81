//! Frames that are not delivered: nobody acknowledges, two send the same identifier, power fails.

use super::super::arbitration::{Difference, first_difference};
use super::*;

fn errors(events: &[Event]) -> Vec<(u64, u64, ControllerId, BusErrorKind)> {
    events
        .iter()
        .filter_map(|event| match event {
            Event::BusError {
                start_ns,
                end_ns,
                sender,
                kind,
                ..
            } => Some((*start_ns, *end_ns, *sender, *kind)),
            _ => None,
        })
        .collect()
}

#[test]
fn a_lone_node_is_not_acknowledged_and_tries_until_another_joins() {
    let (mut bus, ids) = bus(1);
    bus.enqueue(0, ids[0], frame(0x080, &[1])).unwrap();
    // 59 bits less interframe space, end of frame and acknowledge delimiter are 48; then an error
    // flag of 6 bits, a delimiter of 8 and the interframe space of 3 before the next attempt.
    let seen = errors(&events(&mut bus, 16 * 65 * BIT_NS));
    let expected: Vec<_> = (0..16)
        .map(|attempt| {
            let start_ns = attempt * 65 * BIT_NS;
            (
                start_ns,
                start_ns + 62 * BIT_NS,
                ids[0],
                BusErrorKind::Acknowledge,
            )
        })
        .collect();
    assert_eq!(seen, expected);
    assert_eq!(bus.controller(ids[0]).unwrap().transmit_error_counter, 128);
    bus.advance(10_000_000, &mut |_| {});
    assert_eq!(bus.controller(ids[0]).unwrap().transmit_error_counter, 128);
    assert_eq!(bus.statistics().frames, 0);
    assert_eq!(bus.free_buffers(ids[0]), 63);

    let other = bus.attach(ControllerConfig::default()).unwrap();
    let found = deliveries(&mut bus, 10_200_000);
    assert_eq!(found.len(), 1);
    assert_eq!(received(&mut bus, other), [frame(0x080, &[1])]);
    assert_eq!(bus.controller(ids[0]).unwrap().transmit_error_counter, 127);
}

#[test]
fn a_mere_listener_does_not_acknowledge() {
    let (mut bus, ids) = bus(1);
    let config = ControllerConfig {
        acknowledges: false,
        ..ControllerConfig::default()
    };
    let listener = bus.attach(config).unwrap();
    bus.enqueue(0, ids[0], frame(0x080, &[1])).unwrap();
    assert_eq!(deliveries(&mut bus, 1_000_000), []);
    assert_eq!(bus.receive(listener), None);
}

#[test]
fn equal_frames_of_two_senders_are_one_frame() {
    let (mut bus, ids) = bus(3);
    bus.enqueue(0, ids[0], frame(0x701, &[5])).unwrap();
    bus.enqueue(0, ids[1], frame(0x701, &[5])).unwrap();
    assert_eq!(deliveries(&mut bus, 1_000_000).len(), 1);
    assert_eq!(bus.statistics().identical, 1);
    assert_eq!(bus.controller(ids[0]).unwrap().sent, 1);
    assert_eq!(bus.controller(ids[1]).unwrap().sent, 1);
    assert_eq!(received(&mut bus, ids[2]).len(), 1);
    assert_eq!(received(&mut bus, ids[0]), []);
}

#[test]
fn one_identifier_with_different_data_is_a_bit_error_where_it_differs() {
    // Start of frame and header are 0 10101010101 0 0 0 0001, of which five dominant bits in a row
    // (RTR, IDE, r0 and two of the length code) take one stuff bit. Then 0101 0101 against
    // 0101 0111: bit 19 + 1 + 7 is the first to differ, one dominant bit after a recessive one. The
    // other nodes' flags end 12 - 1 bits later.
    let (mut bus, ids) = bus(3);
    bus.enqueue(0, ids[0], frame(0x555, &[0b0101_0111]))
        .unwrap();
    bus.enqueue(0, ids[1], frame(0x555, &[0b0101_0101]))
        .unwrap();
    let seen = errors(&events(&mut bus, 100 * BIT_NS));
    let end_ns = (27 + 11 + 8) * BIT_NS;
    assert_eq!(seen[0], (0, end_ns, ids[0], BusErrorKind::Collision));
    assert_eq!(seen[1].0, end_ns + 3 * BIT_NS, "both try again");
    assert_eq!(bus.receive(ids[2]), None);
}

#[test]
fn colliding_nodes_become_passive_and_the_dominant_frame_goes_first() {
    let (mut bus, ids) = bus(3);
    let (recessive, dominant) = (frame(0x201, &[0xFF, 1]), frame(0x201, &[0xFF, 0]));
    bus.enqueue(0, ids[0], recessive).unwrap();
    bus.enqueue(0, ids[1], dominant).unwrap();
    bus.advance(5_000_000, &mut |_| {});
    assert_eq!(bus.statistics().collisions, 16);
    assert_eq!(received(&mut bus, ids[2]), [dominant, recessive]);
    // 16 × 8, and 8 for the frame that dropped out, less 1 for the success.
    assert_eq!(bus.controller(ids[0]).unwrap().transmit_error_counter, 135);
    assert_eq!(bus.controller(ids[1]).unwrap().transmit_error_counter, 127);
    assert_eq!(received(&mut bus, ids[1]), [recessive]);
}

#[test]
fn three_senders_of_one_identifier_all_get_through_in_the_end() {
    // Start of frame and header are 0 00100100011 0 0 0 0001 with one stuff bit in the six dominant
    // ones from RTR on; the second data bit is the first to differ, the second dominant one in a
    // row, so that the flags end 12 - 2 bits later.
    let first_error_ns = (19 + 1 + 2 + 10 + 8) * BIT_NS;
    let orders = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    for order in orders {
        let bytes = order.map(|at: usize| [0b0111_0000, 0b0010_1111, 0b0011_0000][at]);
        let (mut bus, ids) = bus(4);
        for (id, byte) in ids.iter().zip(bytes) {
            bus.enqueue(0, *id, frame(0x123, &[byte])).unwrap();
        }
        let seen = events(&mut bus, 20_000_000);
        assert_eq!(errors(&seen)[0].1, first_error_ns, "{bytes:02X?}");
        let order: Vec<u8> = received(&mut bus, ids[3])
            .iter()
            .map(|frame| frame.data()[0])
            .collect();
        assert_eq!(
            order,
            [0b0010_1111, 0b0011_0000, 0b0111_0000],
            "{bytes:02X?}"
        );
    }
}

#[test]
fn the_first_difference_counts_stuff_bits() {
    // 0 00000000000 0 0 0 0001: five dominant bits and a stuff bit three times over before the
    // length code's 1, then 1111 0000 against 1111 0001.
    let (one, other) = (frame(0, &[0xF0]), frame(0, &[0xF1]));
    let difference = first_difference(&one, &other).unwrap();
    // 19 header bits with 3 stuff bits; 1 1111 is a run of five and stuffed; 0000, of which the
    // first joins the stuff bit's run: 0 000 0 is stuffed before the last bit.
    assert_eq!(difference.bits, 19 + 3 + 4 + 1 + 3 + 1);
    assert!(difference.second_is_recessive);
    assert_eq!(difference.dominant_run, 5);
    assert_eq!(first_difference(&one, &one), None);
    let back = first_difference(&other, &one).unwrap();
    assert_eq!(
        back,
        Difference {
            second_is_recessive: false,
            ..difference
        }
    );
}

#[test]
fn a_node_that_loses_power_in_the_middle_takes_its_frame_with_it() {
    let (mut bus, ids) = bus(3);
    bus.enqueue(0, ids[0], frame(0x181, &[0x55; 8])).unwrap();
    bus.enqueue(0, ids[1], frame(0x701, &[5])).unwrap();
    bus.advance(40_000, &mut |_| {});
    bus.set_powered(40_000, ids[0], false);
    assert_eq!(
        bus.enqueue(40_000, ids[0], frame(1, &[])),
        Err(EnqueueError::Off)
    );
    let seen = events(&mut bus, 1_000_000);
    assert_eq!(errors(&seen), [(0, 60_000, ids[0], BusErrorKind::Cut)]);
    assert_eq!(received(&mut bus, ids[2]), [frame(0x701, &[5])]);
    assert_eq!(received(&mut bus, ids[0]), []);
}

#[test]
fn a_frame_whose_sender_dies_in_its_recessive_tail_arrives() {
    let (mut bus, ids) = bus(2);
    bus.enqueue(0, ids[0], frame(0x080, &[1])).unwrap();
    bus.advance(49_000, &mut |_| {});
    bus.set_powered(49_000, ids[0], false);
    assert_eq!(deliveries(&mut bus, 100_000).len(), 1);
}

#[test]
fn a_node_that_comes_on_hears_the_next_frame_not_the_running_one() {
    let (mut bus, ids) = bus(3);
    bus.set_powered(0, ids[2], false);
    bus.enqueue(0, ids[0], frame(0x080, &[1])).unwrap();
    bus.enqueue(0, ids[0], frame(0x181, &[])).unwrap();
    bus.advance(20_000, &mut |_| {});
    bus.set_powered(20_000, ids[2], true);
    bus.enqueue(20_000, ids[2], frame(0x001, &[])).unwrap();
    let order: Vec<u32> = deliveries(&mut bus, 1_000_000)
        .iter()
        .map(|delivery| delivery.frame.raw_id())
        .collect();
    assert_eq!(order, [0x080, 0x001, 0x181]);
    assert_eq!(received(&mut bus, ids[2]), [frame(0x181, &[])]);
}
