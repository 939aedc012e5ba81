//! Emergencies, byte by byte (CiA 301, 7.2.7).

mod common;

use common::Bench;

const OVERCURRENT: u16 = 0x2310;
const CURRENT_BIT: u8 = 1 << 1;

#[test]
fn tells_an_error_with_its_code_register_and_detail() {
    let mut bench = Bench::pre_operational();
    bench
        .node
        .emergency(0, OVERCURRENT, CURRENT_BIT, [1, 2, 3, 4, 5]);
    assert_eq!(
        bench.sent(),
        [(0x085, vec![0x10, 0x23, 0x03, 1, 2, 3, 4, 5])]
    );
    assert_eq!(bench.read(0x1001, 0), Ok(3));
    assert_eq!(bench.node.error_register(), 3);
    assert_eq!(bench.read(0x1003, 0), Ok(1));
    assert_eq!(bench.read(0x1003, 1), Ok(0x0201_2310));
}

#[test]
fn takes_errors_back_one_by_one() {
    let mut bench = Bench::pre_operational();
    bench.node.emergency(0, OVERCURRENT, CURRENT_BIT, [0; 5]);
    bench.node.emergency(0, 0x4210, 1 << 3, [0; 5]);
    bench.sent();
    bench.node.emergency_cleared(0, CURRENT_BIT);
    assert_eq!(bench.sent(), [(0x085, vec![0, 0, 0x09, 0, 0, 0, 0, 0])]);
    bench.node.emergency_cleared(0, 1 << 3);
    assert_eq!(bench.sent(), [(0x085, vec![0; 8])]);
    assert_eq!(
        bench.read(0x1003, 0),
        Ok(2),
        "the history remembers what is gone"
    );
}

#[test]
fn the_history_holds_the_newest_first_and_can_be_cleared() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.read(0x1003, 0), Ok(0));
    assert_eq!(bench.read(0x1003, 1), Err(0x0800_0024));
    for code in 1..=10 {
        bench.node.emergency(0, code, 1, [0; 5]);
    }
    assert_eq!(bench.read(0x1003, 0), Ok(8));
    assert_eq!(bench.read(0x1003, 1), Ok(10));
    assert_eq!(bench.read(0x1003, 8), Ok(3));
    assert_eq!(bench.read(0x1003, 9), Err(0x0609_0011));
    assert_eq!(bench.write(0x1003, 1, 0, 4), Err(0x0601_0002));
    assert_eq!(bench.write(0x1003, 0, 1, 1), Err(0x0609_0030));
    assert_eq!(bench.write(0x1003, 0, 0, 1), Ok(()));
    assert_eq!(bench.read(0x1003, 0), Ok(0));
}

#[test]
fn a_reset_of_the_communication_keeps_the_application_s_errors() {
    let mut bench = Bench::pre_operational();
    bench.node.emergency(0, OVERCURRENT, CURRENT_BIT, [0; 5]);
    bench.hear(0, &[130, 0]);
    bench.sent();
    assert_eq!(bench.read(0x1001, 0), Ok(3));
    assert_eq!(bench.read(0x1003, 0), Ok(1));
    bench.hear(0, &[129, 0]);
    bench.sent();
    assert_eq!(bench.read(0x1001, 0), Ok(0));
    assert_eq!(bench.read(0x1003, 0), Ok(0));
}

#[test]
fn the_inhibit_time_keeps_emergencies_apart() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.write(0x1015, 0, 50, 2), Ok(()), "5 ms");
    for code in 1..=3 {
        bench.node.emergency(bench.now_us, code, 1, [0; 5]);
    }
    assert_eq!(bench.sent().len(), 1);
    let mut times = Vec::new();
    for millisecond in 1..=20 {
        bench.pass_ms(1);
        times.extend(bench.sent().iter().map(|(_, data)| (millisecond, data[0])));
    }
    assert_eq!(times, [(5, 2), (10, 3)]);
}

#[test]
fn emergencies_that_can_not_wait_are_counted() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.write(0x1015, 0, 50, 2), Ok(()));
    for code in 1..=12 {
        bench.node.emergency(bench.now_us, code, 1, [0; 5]);
    }
    // One went, eight wait.
    assert_eq!(bench.node.counters().emergencies_dropped, 3);
}

#[test]
fn its_identifier_can_change_while_it_is_off() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.read(0x1014, 0), Ok(0x85));
    assert_eq!(bench.write(0x1014, 0, 0x0000_00A0, 4), Err(0x0609_0030));
    assert_eq!(bench.write(0x1014, 0, 0x8000_00A0, 4), Ok(()));
    bench.node.emergency(0, OVERCURRENT, CURRENT_BIT, [0; 5]);
    assert_eq!(bench.sent(), []);
    assert_eq!(bench.read(0x1003, 0), Ok(1));
    assert_eq!(bench.write(0x1014, 0, 0x2000_00A0, 4), Err(0x0609_0030));
    assert_eq!(bench.write(0x1014, 0, 0x0000_00A0, 4), Ok(()));
    bench.node.emergency(0, OVERCURRENT, CURRENT_BIT, [0; 5]);
    assert_eq!(bench.sent()[0].0, 0x0A0);
}

#[test]
fn what_finds_the_transmit_queue_full_is_dropped_and_counted() {
    let mut bench = Bench::pre_operational();
    for _ in 0..20 {
        bench
            .node
            .emergency(bench.now_us, OVERCURRENT, CURRENT_BIT, [0; 5]);
    }
    assert_eq!(bench.sent().len(), 16);
    assert_eq!(bench.node.counters().transmit_dropped, 4);
}
