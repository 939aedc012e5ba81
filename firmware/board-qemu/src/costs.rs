//! The frames that are measured, each in the heaviest state that was found for it.

use cortex_m_semihosting::debug;
use eel_canopen::{Abort, STORED_PARAMETERS};

use crate::console::{leave, say};
use crate::cost::{Bench, ID, REQUEST, heaviest, heavy};
use crate::stopwatch::Stopwatch;
use crate::transfers;
use crate::values::vertebra;

/// Says what something cost.
pub fn tell(name: &str, ticks: u32) {
    say(format_args!("cost\t{name}\t{ticks}"));
}

/// Says that something went otherwise than it should.
pub fn check(name: &str, is_so: bool) {
    if !is_so {
        say(format_args!("failed\t{name}"));
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else {
        leave(debug::EXIT_FAILURE)
    };
    let stopwatch = Stopwatch::new(peripherals.SYST);
    let ((), nothing) = stopwatch.time(|| ());
    say(format_args!("nothing\t{nothing}"));
    sync(&stopwatch);
    process_data(&stopwatch);
    management(&stopwatch);
    storing(&stopwatch);
    layer_setting(&stopwatch);
    time(&stopwatch);
    transfers::tell_all(&stopwatch);
    leave(debug::EXIT_SUCCESS)
}

/// SYNC, as a vertebra gets it and with all that there can be.
fn sync(stopwatch: &Stopwatch) {
    let mut bench = Bench::operational(stopwatch, vertebra(ID));
    bench.hear(0x205, &[1, 0, 2, 0, 3, 0, 4, 5]);
    bench.hear(0x080, &[1]);
    bench.drain();
    bench.hear(0x205, &[1, 0, 2, 0, 3, 0, 4, 5]);
    tell("sync_two_tpdos", bench.cost(0x080, &[2]));
    let mut sent = 0;
    while bench.node.poll_transmit().is_some() {
        sent += 1;
    }
    check("two TPDOs", sent == 2);

    let mut bench = Bench::operational(stopwatch, heavy());
    bench.hear(0x77F, &[5]);
    for cob_id in [0x205, 0x305] {
        bench.hear(cob_id, &[1; 8]);
    }
    bench.clutter();
    // SYNC finds an SDO client and a head that fell silent.
    bench.hear(REQUEST, &[0xC6, 0x01, 0x21, 1, 0, 1, 0, 0]);
    bench.neglect();
    tell("sync_eight_objects_each", bench.cost(0x080, &[]));

    let mut bench = Bench::operational(stopwatch, heaviest());
    for cob_id in [0x205, 0x305, 0x405, 0x505] {
        bench.hear(cob_id, &[1; 8]);
    }
    bench.clutter();
    tell("four_pdos_sync", bench.cost(0x080, &[]));

    let mut bench = Bench::operational(stopwatch, heavy());
    bench.clutter();
    tell("sync_length", bench.cost(0x080, &[1]));
}

/// RPDOs, at SYNC and at once, and one that is too short.
fn process_data(stopwatch: &Stopwatch) {
    let mut bench = Bench::operational(stopwatch, heavy());
    tell("rpdo_kept", bench.cost(0x305, &[1; 8]));
    tell("rpdo_short", bench.cost(0x305, &[1; 7]));
    tell("rpdo_long_again", bench.cost(0x305, &[1; 8]));
    tell("other_frame", bench.cost(0x506, &[1; 8]));

    let mut bench = Bench::new(stopwatch, heavy());
    // Both at once on one identifier: the worst that a configuration can ask for.
    for number in 0..2 {
        bench.hear(REQUEST, &[0x23, number, 0x14, 1, 5, 2 + number, 0, 0x80]);
        bench.hear(REQUEST, &[0x2F, number, 0x14, 2, 255, 0, 0, 0]);
        bench.hear(REQUEST, &[0x23, number, 0x14, 1, 0x05, 0x02, 0, 0]);
    }
    bench.hear(0, &[1, ID]);
    bench.drain();
    tell("rpdo_applied_by_two", bench.cost(0x205, &[1; 8]));
}

/// NMT, heartbeats and TIME.
fn management(stopwatch: &Stopwatch) {
    let mut bench = Bench::operational(stopwatch, heavy());
    bench.hear(REQUEST, &[0x23, 0x12, 0x10, 0, 0, 1, 0, 0x80]);
    check("TIME can be consumed", bench.is_answered(0x60));
    bench.clutter();
    tell("time", bench.cost(0x100, &[1; 6]));
    bench.neglect();
    tell("heartbeat_after_loss", bench.cost(0x77F, &[4]));
    tell("heartbeat", bench.cost(0x77F, &[5]));
    tell("nmt_stop", bench.cost(0, &[2, ID]));
    for code in 0..8 {
        bench.node.emergency(bench.now_us, 0x1000 + code, 1, [1; 5]);
    }
    tell("nmt_start", bench.cost(0, &[1, ID]));
    tell("nmt_pre_operational", bench.cost(0, &[128, ID]));
    bench.hear(0, &[1, ID]);
    bench.clutter();
    tell("nmt_reset_node", bench.cost(0, &[129, ID]));
    tell("nmt_reset_communication", bench.cost(0, &[130, ID]));
    tell("nmt_other_node", bench.cost(0, &[1, ID + 1]));
}

/// Storing, and the resets that load what was stored.
fn storing(stopwatch: &Stopwatch) {
    let mut bench = Bench::new(stopwatch, heavy());
    tell(
        "sdo_store",
        bench.cost(REQUEST, &[0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e']),
    );
    bench.store();
    check("stored", bench.is_answered(0x60));
    check("parameters", !bench.node.stored_parameters().is_empty());
    bench.hear(0, &[1, ID]);
    bench.clutter();
    tell("nmt_reset_node_stored", bench.cost(0, &[129, ID]));
    bench.drain();
    tell("nmt_reset_stored", bench.cost(0, &[130, ID]));
    tell(
        "sdo_restore",
        bench.cost(REQUEST, &[0x23, 0x11, 0x10, 1, b'l', b'o', b'a', b'd']),
    );
    let ticks = bench.time(|node, _, now_us| node.finish_store(now_us, Err(Abort::Hardware)));
    tell("call_finish_refused", ticks);
    bench.hear(REQUEST, &[0x23, 0x10, 0x10, 2, b's', b'a', b'v', b'e']);
    let mut bytes = [0; STORED_PARAMETERS];
    let length = bench.node.save_parameters(&mut bytes).unwrap_or_default();
    let saved = bytes.get(..length).unwrap_or_default();
    let ticks = bench.time(|node, _, now_us| node.finish_store(now_us, Ok(saved)));
    tell("call_finish_stored", ticks);
}

/// LSS, with a node that has an id and one that has none.
fn layer_setting(stopwatch: &Stopwatch) {
    let mut bench = Bench::operational(stopwatch, heavy());
    tell("lss_switch", bench.cost(0x7E5, &[4, 1, 0, 0, 0, 0, 0, 0]));
    tell(
        "lss_node_id",
        bench.cost(0x7E5, &[0x11, 9, 0, 0, 0, 0, 0, 0]),
    );
    tell(
        "lss_inquire",
        bench.cost(0x7E5, &[0x5D, 0, 0, 0, 0, 0, 0, 0]),
    );
    tell("lss_store", bench.cost(0x7E5, &[0x17, 0, 0, 0, 0, 0, 0, 0]));
    bench.store();
    bench.hear(0x7E5, &[4, 0, 0, 0, 0, 0, 0, 0]);
    let serial = [1, 0, 0, 0];
    for (command, ticks) in [0x46, 0x47, 0x48, 0x49, 0x4A, 0x4B].map(|command| {
        let [a, b, c, d] = if command == 0x49 { [0xFF; 4] } else { serial };
        (command, bench.cost(0x7E5, &[command, a, b, c, d, 0, 0, 0]))
    }) {
        if command == 0x4B {
            tell("lss_identify", ticks);
        }
    }
    tell("nmt_reset_new_id", bench.cost(0, &[130, ID]));

    let mut config = heavy();
    config.node_id = 0xFF;
    let mut bench = Bench::new(stopwatch, config);
    tell(
        "lss_fastscan",
        bench.cost(0x7E5, &[0x51, 0, 0, 0, 0, 0x80, 0, 0]),
    );
    tell(
        "lss_fastscan_bit",
        bench.cost(0x7E5, &[0x51, 0, 0, 0, 0, 31, 0, 0]),
    );
    bench.hear(0x7E5, &[4, 1, 0, 0, 0, 0, 0, 0]);
    bench.hear(0x7E5, &[0x11, ID, 0, 0, 0, 0, 0, 0]);
    tell("lss_boot", bench.cost(0x7E5, &[4, 0, 0, 0, 0, 0, 0, 0]));
    check("boots with its id", bench.node.node_id() == ID);
}

/// What time alone demands.
fn time(stopwatch: &Stopwatch) {
    let mut bench = Bench::new(stopwatch, heavy());
    for number in 0..2 {
        bench.hear(REQUEST, &[0x2F, number, 0x18, 2, 255, 0, 0, 0]);
        bench.hear(REQUEST, &[0x2B, number, 0x18, 5, 10, 0, 0, 0]);
        bench.drain();
    }
    bench.hear(0x77F, &[5]);
    bench.hear(0, &[1, ID]);
    bench.clutter();
    bench.hear(REQUEST, &[0xA4, 0x01, 0x21, 1, 127, 0, 0, 0]);
    bench.drain();
    bench.hear(REQUEST, &[0xA3, 0, 0, 0, 0, 0, 0, 0]);
    tell("tick_two_tpdos_and_segments", bench.tick(500_000));
    check("segments", bench.is_answered(4));
    tell("tick_nothing", bench.tick(0));
}
