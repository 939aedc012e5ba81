//! Process data: when it is applied, when it is sent, and how it is mapped (CiA 301, 7.2.2).

mod common;

use common::{Bench, CONFIG, Call};
use eel_canopen::{Config, Event, Mapped, PdoDefault};

const TARGET: [u8; 8] = [0x01, 0x00, 0xFE, 0xFF, 0x03, 0x00, 0x21, 0xAB];
const POSE: (u16, [u8; 7]) = (0x185, [0x22, 0x11, 0x66, 0x55, 0x44, 0x33, 0x00]);
const EFFORT: (u16, [u8; 2]) = (0x285, [0x22, 0x11]);

fn writes(calls: &[Call]) -> usize {
    calls
        .iter()
        .filter(|call| matches!(call, Call::Write(..)))
        .count()
}

#[test]
fn a_synchronous_rpdo_waits_for_sync_and_only_the_latest_counts() {
    let mut bench = Bench::operational();
    bench.hear(0x205, &[0x55; 8]);
    bench.hear(0x205, &TARGET);
    assert_eq!(bench.calls(), []);
    assert_eq!(bench.app.target, [0; 3]);
    bench.hear(0x080, &[]);
    assert_eq!(bench.app.target, [1, -2, 3]);
    assert_eq!(bench.app.mode, [0x21, 0xAB]);
    assert_eq!(writes(&bench.calls()), 5);
    bench.hear(0x080, &[]);
    assert_eq!(writes(&bench.calls()), 0, "data is applied once");
}

#[test]
fn at_sync_rpdos_come_first_then_the_application_then_tpdos() {
    let mut bench = Bench::operational();
    bench.hear(0x205, &TARGET);
    bench.hear(0x080, &[]);
    let calls: Vec<Call> = bench.calls().into_iter().skip(5).collect();
    let expected = [
        Call::Applied(1, 0x205),
        Call::Synchronised(None),
        Call::Due(1, 0x185),
    ];
    assert_eq!(calls, expected);
    assert_eq!(bench.sent(), [(POSE.0, POSE.1.to_vec())]);
    assert_eq!(bench.events(), [Event::Sync { counter: None }]);
}

#[test]
fn an_event_driven_rpdo_is_applied_at_once() {
    let mut bench = Bench::operational();
    bench.hear(0x305, &[1, 0, 2, 0]);
    assert_eq!(bench.app.moment, [1, 2]);
    assert_eq!(bench.calls().last(), Some(&Call::Applied(2, 0x305)));
}

#[test]
fn a_short_rpdo_is_reported_and_not_applied() {
    let mut bench = Bench::operational();
    let emergency = (0x085, vec![0x10, 0x82, 0x11, 1, 0, 0, 0, 0]);
    assert_eq!(bench.ask(0x205, &TARGET[..7]), [emergency]);
    assert_eq!(bench.ask(0x205, &[]), [], "told once");
    assert_eq!(bench.events(), [Event::RpdoLength { number: 1 }; 2]);
    assert_eq!(bench.node.counters().rpdos_short, 2);
    bench.hear(0x080, &[]);
    assert_eq!(bench.app.target, [0; 3]);
    bench.sent();
    assert_eq!(
        bench.ask(0x205, &TARGET),
        [(0x085, vec![0; 8])],
        "gone with the next whole one"
    );
}

#[test]
fn of_a_long_rpdo_the_mapped_part_is_applied() {
    let mut bench = Bench::operational();
    assert_eq!(bench.ask(0x305, &[1, 0, 2, 0, 9, 9, 9, 9]), []);
    assert_eq!(bench.app.moment, [1, 2]);
}

#[test]
fn a_refused_object_ends_the_rpdo() {
    let mut bench = Bench::operational();
    bench.app.refuse = true;
    bench.hear(0x305, &[1, 0, 2, 0]);
    assert_eq!(bench.events(), [Event::RpdoRefused { number: 2 }]);
    assert_eq!(bench.calls(), []);
    assert_eq!(bench.node.counters().rpdos_refused, 1);
}

#[test]
fn a_tpdo_that_can_not_be_read_is_not_sent_but_counted() {
    let mut bench = Bench::operational();
    bench.app.refuse = true;
    assert_eq!(bench.ask(0x080, &[]), []);
    assert_eq!(bench.node.counters().tpdos_refused, 1);
}

#[test]
fn there_are_no_pdos_outside_operational_and_none_left_over() {
    let mut bench = Bench::operational();
    bench.hear(0x205, &TARGET);
    bench.hear(0, &[128, 0]);
    bench.hear(0x205, &TARGET);
    bench.hear(0x305, &[1, 0, 2, 0]);
    bench.hear(0x080, &[]);
    bench.hear(0, &[1, 0]);
    bench.hear(0x080, &[]);
    assert_eq!(bench.app.target, [0; 3]);
    assert_eq!(bench.app.moment, [0; 2]);
}

#[test]
fn a_tpdo_of_type_n_comes_with_every_nth_sync() {
    let mut bench = Bench::operational();
    for round in 1..=6 {
        let sent = bench.ask(0x080, &[]);
        let mut expected = vec![(POSE.0, POSE.1.to_vec())];
        if round % 2 == 0 {
            expected.push((EFFORT.0, EFFORT.1.to_vec()));
        }
        assert_eq!(sent, expected, "SYNC {round}");
    }
}

#[test]
fn a_tpdo_can_begin_with_a_given_sync_counter() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.write(0x1019, 0, 10, 1), Ok(()));
    assert_eq!(bench.write(0x1801, 1, 0xC000_0285, 4), Ok(()));
    assert_eq!(bench.write(0x1801, 6, 3, 1), Ok(()));
    assert_eq!(bench.write(0x1801, 1, 0x4000_0285, 4), Ok(()));
    assert_eq!(
        bench.write(0x1801, 6, 4, 1),
        Err(0x0609_0030),
        "not while it exists"
    );
    bench.hear(0, &[1, 0]);
    let mut seen = Vec::new();
    for counter in [1, 2, 3, 4, 5, 6, 7] {
        if bench
            .ask(0x080, &[counter])
            .iter()
            .any(|(id, _)| *id == 0x285)
        {
            seen.push(counter);
        }
    }
    assert_eq!(seen, [3, 5, 7]);
}

#[test]
fn an_acyclic_tpdo_waits_for_a_request_and_for_sync() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.write(0x1800, 2, 0, 1), Ok(()));
    bench.hear(0, &[1, 0]);
    assert_eq!(bench.ask(0x080, &[]), []);
    bench.node.request_tpdo(1);
    bench.pass_ms(5);
    assert_eq!(bench.sent(), []);
    assert_eq!(bench.ask(0x080, &[])[0].0, 0x185);
    assert_eq!(
        bench
            .ask(0x080, &[])
            .iter()
            .filter(|(id, _)| *id == 0x185)
            .count(),
        0
    );
}

#[test]
fn an_event_driven_tpdo_minds_its_inhibit_and_event_times() {
    let mut bench = Bench::pre_operational();
    assert_eq!(
        bench.write(0x1802, 3, 50, 2),
        Err(0x0609_0030),
        "not while it exists"
    );
    assert_eq!(bench.write(0x1802, 1, 0xC000_0385, 4), Ok(()));
    assert_eq!(bench.write(0x1802, 3, 50, 2), Ok(()));
    assert_eq!(bench.write(0x1802, 5, 20, 2), Ok(()));
    assert_eq!(bench.write(0x1802, 1, 0x4000_0385, 4), Ok(()));
    bench.hear(0, &[1, 0]);
    let mut times = Vec::new();
    for millisecond in 1..=50 {
        bench
            .node
            .request_tpdo(if millisecond <= 8 { 3 } else { 4 });
        bench.pass_ms(1);
        times.extend(
            bench
                .sent()
                .iter()
                .filter(|(id, _)| *id == 0x385)
                .map(|_| millisecond),
        );
    }
    // Requested from 1 to 8 ms: at once, then 5 ms later, then once for the last request; then
    // every 20 ms of its own accord.
    assert_eq!(times, [1, 6, 11, 31]);
}

#[test]
fn a_stalled_bus_keeps_only_the_newest_pdo() {
    let mut bench = Bench::operational();
    for pose in 0..100 {
        bench.app.pose = pose;
        bench.hear(0x080, &[]);
    }
    let sent = bench.sent();
    assert_eq!(sent.len(), 2);
    assert_eq!(sent[0].1[..2], [99, 0]);
    assert_eq!(bench.node.counters().transmit_dropped, 0);
}

#[test]
fn tells_its_pdo_parameters_as_cia_301_numbers_them() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.read(0x1400, 0), Ok(2));
    assert_eq!(bench.read(0x1400, 1), Ok(0x205));
    assert_eq!(bench.read(0x1402, 1), Ok(0x8000_0405));
    assert_eq!(bench.read(0x1403, 1), Err(0x0602_0000));
    assert_eq!(bench.read(0x1400, 3), Err(0x0609_0011));
    assert_eq!(bench.read(0x1600, 0), Ok(5));
    assert_eq!(bench.read(0x1600, 4), Ok(0x2000_0408));
    assert_eq!(bench.read(0x1600, 9), Err(0x0609_0011));
    assert_eq!(bench.read(0x1800, 0), Ok(6));
    assert_eq!(bench.read(0x1800, 1), Ok(0x4000_0185));
    assert_eq!(bench.read(0x1800, 4), Err(0x0609_0011));
    assert_eq!(bench.read(0x1A00, 3), Ok(0x1001_0008));
}

#[test]
fn identifiers_change_only_while_a_pdo_is_off() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.write(0x1400, 1, 0x215, 4), Err(0x0609_0030));
    assert_eq!(bench.write(0x1400, 1, 0x8000_0215, 4), Ok(()));
    for raw in [
        0x2000_0215,
        0x0000_0605,
        0x0000_0085 + 0x700,
        0x0000_0000,
        0x0000_0815,
    ] {
        assert_eq!(bench.write(0x1400, 1, raw, 4), Err(0x0609_0030), "{raw:X}");
    }
    assert_eq!(bench.write(0x1400, 1, 0x0000_0215, 4), Ok(()));
    assert_eq!(
        bench.write(0x1402, 1, 0x0000_0405, 4),
        Err(0x0609_0030),
        "it is empty"
    );
    assert_eq!(
        bench.write(0x1800, 1, 0x0000_0185, 4),
        Err(0x0609_0030),
        "no remote frames"
    );
    for transmission in [241, 252, 253] {
        assert_eq!(bench.write(0x1800, 2, transmission, 1), Err(0x0609_0030));
    }
    bench.hear(0, &[1, 0]);
    bench.hear(0x205, &[0x55; 8]);
    bench.hear(0x215, &TARGET);
    bench.hear(0x080, &[]);
    assert_eq!(bench.app.target, [1, -2, 3]);
}

#[test]
fn a_mapping_is_rewritten_in_the_order_of_cia_301() {
    let mut bench = Bench::pre_operational();
    assert_eq!(bench.write(0x1600, 0, 0, 1), Err(0x0601_0000), "active");
    assert_eq!(
        bench.write(0x1600, 1, 0x2001_0110, 4),
        Err(0x0601_0000),
        "active"
    );
    assert_eq!(bench.write(0x1400, 1, 0x8000_0205, 4), Ok(()));
    assert_eq!(
        bench.write(0x1600, 1, 0x2001_0110, 4),
        Err(0x0601_0000),
        "still counted"
    );
    assert_eq!(bench.write(0x1600, 0, 0, 1), Ok(()));
    assert_eq!(
        bench.write(0x1600, 1, 0x0005_0008, 4),
        Ok(()),
        "a dummy byte"
    );
    assert_eq!(bench.write(0x1600, 2, 0x2001_0210, 4), Ok(()));
    assert_eq!(bench.write(0x1600, 0, 2, 1), Ok(()));
    assert_eq!(bench.write(0x1400, 2, 255, 1), Ok(()));
    assert_eq!(bench.write(0x1400, 1, 0x0000_0205, 4), Ok(()));
    bench.hear(0, &[1, 0]);
    bench.calls();
    bench.hear(0x205, &[0xEE, 0x34, 0x12]);
    assert_eq!(
        bench.calls(),
        [
            Call::Write(0x2001, 2, vec![0x34, 0x12]),
            Call::Applied(1, 0x205)
        ]
    );
}

#[test]
fn a_mapping_that_can_not_be_is_refused_with_its_reason() {
    let mut bench = Bench::pre_operational();
    for (receive, raw, abort) in [
        (true, 0x3000_0008, 0x0602_0000),
        (true, 0x2000_0608, 0x0609_0011),
        (true, 0x2010_0110, 0x0604_0041),  // only sent
        (false, 0x2000_0110, 0x0604_0041), // only received
        (true, 0x2000_0108, 0x0604_0041),  // half of it
        (true, 0x2020_0008, 0x0604_0041),  // of any length
        (true, 0x1017_0010, 0x0604_0041),  // a parameter
        (true, 0x0005_0010, 0x0604_0041),  // a dummy of another length
        (true, 0x0001_0001, 0x0604_0041),  // a single bit
        (false, 0x0005_0008, 0x0604_0041), // nothing to send
        (true, 0x0000_0008, 0x0602_0000),
    ] {
        let (parameters, mapping) = if receive {
            (0x1402, 0x1602)
        } else {
            (0x1802, 0x1A02)
        };
        let _ = bench.write(parameters, 1, 0xC000_0385, 4);
        assert_eq!(bench.write(mapping, 0, 0, 1), Ok(()));
        assert_eq!(bench.write(mapping, 1, raw, 4), Err(abort), "{raw:08X}");
    }
    assert_eq!(bench.write(0x1602, 1, 0x2022_0040, 4), Ok(()));
    assert_eq!(bench.write(0x1602, 2, 0x2000_0408, 4), Ok(()));
    assert_eq!(bench.write(0x1602, 0, 2, 1), Err(0x0604_0042), "nine bytes");
    assert_eq!(
        bench.write(0x1602, 0, 9, 1),
        Err(0x0604_0042),
        "nine objects"
    );
    assert_eq!(
        bench.write(0x1602, 0, 3, 1),
        Err(0x0604_0043),
        "an empty entry"
    );
    assert_eq!(bench.write(0x1602, 2, 0, 4), Ok(()));
    assert_eq!(bench.write(0x1602, 0, 1, 1), Ok(()));
}

#[test]
fn a_default_that_can_not_be_stays_off() {
    const NINE_BYTES: &[Mapped] = &[Mapped::new(0x2022, 0, 64), Mapped::new(0x2000, 4, 8)];
    const NINE_OBJECTS: &[Mapped] = &[Mapped::new(0x2000, 4, 8); 9];
    const HALF_A_BYTE: &[Mapped] = &[Mapped::new(0x2000, 4, 4)];
    let default = |mapping, transmission| PdoDefault {
        cob_id_base: 0x200,
        transmission,
        enabled: true,
        mapping,
    };
    for bad in [
        default(NINE_BYTES, 1),
        default(HALF_A_BYTE, 1),
        default(&[], 1),
        default(&NINE_BYTES[1..], 250),
        default(NINE_OBJECTS, 1),
    ] {
        assert!(!bad.is_valid());
        let rpdos = Box::leak(Box::new([bad]));
        let mut bench = Bench::with(Config { rpdos, ..CONFIG });
        bench.hear(0, &[1, 0]);
        bench.hear(0x205, &[0; 8]);
        bench.hear(0x080, &[]);
        assert_eq!(writes(&bench.calls()), 0);
    }
    for good in CONFIG.rpdos.iter().chain(CONFIG.tpdos) {
        assert!(good.is_valid());
    }
}
