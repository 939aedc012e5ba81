//! What the SDO server says waits its turn: it delays no PDO and no emergency, and nothing that is
//! over is said.

mod streams;

use streams::blocks::{START, acknowledge};
use streams::{DOMAIN, GENERAL, Line, TIMEOUT, VALUE, abort, about, pattern};

/// An Operational node in the middle of a block upload, with four segments in its queue.
fn streaming() -> Line {
    let mut line = Line::new();
    line.app.domain = pattern(2_000);
    line.hear(0, &[1, 5]);
    line.sdo(about(0xA4, DOMAIN, 1, 127));
    line.tell(START);
    line.node.tick(line.now_us, &mut line.app);
    line
}

fn cob_ids(line: &mut Line) -> Vec<u16> {
    line.frames().iter().map(|(cob_id, _)| *cob_id).collect()
}

#[test]
fn pdos_and_emergencies_overtake_a_block_upload() {
    let mut line = streaming();
    line.hear(0x080, &[]);
    line.node.emergency(line.now_us, 0x1000, 1, [0; 5]);
    let order = cob_ids(&mut line);
    assert_eq!(order[..2], [0x185, 0x085]);
    assert_eq!(order[2..], [0x585; 4]);
    // The segments themselves keep their order.
    line.node.tick(line.now_us, &mut line.app);
    assert_eq!(line.node.poll_transmit().unwrap().data()[0], 5);
    line.hear(0x080, &[]);
    assert_eq!(line.node.poll_transmit().unwrap().cob_id(), Some(0x185));
    let rest = line.messages();
    let numbers: Vec<u8> = rest.iter().map(|segment| segment[0]).collect();
    assert_eq!(numbers, [6, 7, 8]);
}

#[test]
fn a_tick_makes_four_segments_at_most() {
    let mut line = streaming();
    for number in [1, 5, 9] {
        let made = line.messages();
        assert_eq!(made.len(), 4);
        assert_eq!(made[0][0], number);
        line.node.tick(line.now_us, &mut line.app);
    }
    // What is not fetched does not pile up, nor is it lost.
    for _ in 0..5 {
        line.node.tick(line.now_us, &mut line.app);
    }
    assert_eq!(line.app.read, 4 * 4 * 7);
    assert_eq!(line.messages().len(), 4);
    assert_eq!(line.node.counters().transmit_dropped, 0);
}

#[test]
fn a_stalled_bus_ends_an_upload_with_one_message() {
    let mut line = streaming();
    for _ in 0..1_000 {
        line.now_us += 1_000;
        line.node.tick(line.now_us, &mut line.app);
    }
    assert_eq!(line.messages(), [abort(DOMAIN, 1, TIMEOUT)]);
}

#[test]
fn what_waits_of_an_upload_that_is_over_is_not_said() {
    let mut line = streaming();
    line.tell(abort(DOMAIN, 1, GENERAL));
    let mut line = streaming();
    assert_eq!(line.sdo(about(0x40, VALUE, 0, 0)), about(0x41, VALUE, 0, 0));
    let mut line = streaming();
    line.tell(acknowledge(2, 127));
    assert_eq!(line.stream()[0][1..], pattern(2_000)[14..21]);
    for command in [2, 129, 130] {
        let mut line = streaming();
        line.hear(0, &[command, 5]);
        line.node.tick(line.now_us, &mut line.app);
        let said = line.frames();
        assert!(said.iter().all(|(cob_id, _)| *cob_id == 0x705), "{said:?}");
    }
}

#[test]
fn answers_that_find_no_room_are_counted() {
    let mut line = Line::new();
    for subindex in 0..10 {
        line.hear(0x605, &about(0x40, 0x3000, subindex, 0));
    }
    let said = line.messages();
    assert_eq!(said.len(), 4);
    assert_eq!(said[3][3], 3, "the newer ones were dropped");
    assert_eq!(line.node.counters().transmit_dropped, 6);
}
