//! What the head sends by the clock.

mod common;

use common::{Spine, frame, node_id};
use eel_head::{Config, Gait, Head};
use eel_protocol::{Cob, Counter, Frame, Target};
use eel_units::{Duration, Instant};

fn at(micros: u64) -> Instant {
    Instant::from_micros(micros)
}

fn drain(head: &mut Head) -> Vec<Frame> {
    std::iter::from_fn(|| head.poll_transmit()).collect()
}

fn is(frame: &Frame, cob: Cob) -> bool {
    frame.cob_id() == Some(cob.id())
}

#[test]
fn sync_comes_every_10_ms_for_minutes_and_its_counter_runs_from_1_to_240() {
    let mut spine = Spine::new();
    spine.run(180_000);
    let syncs = spine.sent_as(Cob::Sync);
    assert_eq!(syncs.len(), 18_000);
    for (number, (time, data)) in syncs.iter().enumerate() {
        assert_eq!(*time, number as u64 * 10);
        assert_eq!(data[..], [(number % 240) as u8 + 1], "SYNC {number}");
    }
    assert_eq!(spine.head.running(), 10, "the vertebrae swim all the time");
}

#[test]
fn the_heartbeat_comes_every_100_ms_and_says_operational() {
    let mut spine = Spine::new();
    spine.run(60_000);
    let beats = spine.sent_as(Cob::Heartbeat(127));
    assert_eq!(beats.len(), 600);
    for (number, (time, data)) in beats.iter().enumerate() {
        assert_eq!((*time, &data[..]), (number as u64 * 100, &[5][..]));
    }
}

#[test]
fn late_ticks_do_not_shift_the_grid() {
    let mut head = Head::new(Config::new(Gait::SWIM), Instant::ZERO);
    let (mut syncs, mut beats, mut now) = (0, 0, 0);
    // Ticks 0.7–1.6 ms apart, never on the grid twice in a row.
    for step in 0_u64.. {
        now += 700 + step * 337 % 900;
        if now >= 60_000_000 {
            break;
        }
        head.tick(at(now));
        for frame in drain(&mut head) {
            syncs += u64::from(is(&frame, Cob::Sync));
            beats += u64::from(is(&frame, Cob::Heartbeat(127)));
            if is(&frame, Cob::Sync) {
                assert!(now % 10_000 < 1_700, "SYNC at {now} µs");
            }
        }
    }
    assert_eq!((syncs, beats), (6_000, 600));
}

#[test]
fn after_a_pause_the_beat_starts_anew_without_a_burst() {
    let mut head = Head::new(Config::new(Gait::SWIM), Instant::ZERO);
    let mut syncs = Vec::new();
    for millis in (0..100).chain(1_234..1_300) {
        head.tick(at(millis * 1_000));
        let frames = drain(&mut head);
        syncs.extend(
            frames
                .iter()
                .filter(|frame| is(frame, Cob::Sync))
                .map(|_| millis),
        );
    }
    let expected: Vec<u64> = (0..100)
        .step_by(10)
        .chain((1_234..1_300).step_by(10))
        .collect();
    assert_eq!(syncs, expected);
}

#[test]
fn a_period_that_vertebrae_cannot_follow_is_brought_to_the_nearest_they_can() {
    for (wanted, period) in [(0, 5), (4_999, 5), (8_000, 8), (90_000, 20)] {
        let sync_period = Duration::from_micros(wanted);
        let mut spine = Spine::with(Config {
            sync_period,
            ..Config::new(Gait::SWIM)
        });
        spine.run(period * 50);
        let syncs = spine.sent_as(Cob::Sync);
        assert_eq!(syncs.len(), 50, "{wanted} µs");
        assert_eq!(syncs[49].0, 49 * period);
    }
}

#[test]
fn every_sync_is_followed_by_a_target_for_each_node_and_counters_go_up_by_one() {
    let mut spine = Spine::swimming();
    spine.sent.clear();
    spine.run(2_000);
    for id in 1..=10 {
        let targets = spine.targets(id);
        assert_eq!(targets.len(), 200, "node {id}");
        for pair in targets.windows(2) {
            assert_eq!(pair[1].0 - pair[0].0, 10);
            assert_eq!(pair[1].1.counter, pair[0].1.counter.next(), "node {id}");
        }
    }
    let mut beat = Vec::new();
    for (_, frame) in spine
        .sent
        .iter()
        .filter(|(_, frame)| !is(frame, Cob::Heartbeat(127)))
    {
        if is(frame, Cob::Sync) {
            beat.clear();
        } else {
            let (node, _) = Target::from_frame(frame).expect("nothing else is sent");
            beat.push(node);
            assert!(beat.is_sorted(), "the first vertebra's target comes first");
        }
    }
}

#[test]
fn counters_also_rise_by_one_across_the_stop_and_the_reboot_of_a_node() {
    let mut spine = Spine::swimming();
    let now_ms = spine.now_ms;
    spine.node(5).boot(now_ms);
    spine.run(1_000);
    let now = spine.now();
    spine.head.stop(now);
    spine.run(2_000);
    let targets = spine.targets(5);
    let mut last: Option<Counter> = None;
    for (at, target) in targets {
        if let Some(last) = last {
            assert_eq!(target.counter, last.next(), "{at} ms");
        }
        last = Some(target.counter);
    }
}

#[test]
fn the_fullest_beat_has_room_in_the_queue() {
    let mut spine = Spine::swimming();
    let now = spine.now();
    // All ten reboot in the millisecond of a SYNC and a heartbeat: ten NMT starts come on top.
    for id in 1..=10 {
        spine
            .head
            .handle_frame(now, &frame(Cob::Heartbeat(id), &[0]));
    }
    spine.head.tick(now);
    let frames = drain(&mut spine.head);
    assert_eq!(
        frames.iter().filter(|frame| is(frame, Cob::Nmt)).count(),
        10
    );
    assert_eq!(
        frames.len(),
        1 + 10 + 1 + 10,
        "heartbeat, starts, SYNC, targets"
    );
    assert_eq!(spine.head.dropped(), 0);
}

#[test]
fn frames_that_nobody_takes_are_dropped_and_counted() {
    let mut head = Head::new(Config::new(Gait::SWIM), Instant::ZERO);
    for millis in 0..1_000 {
        head.tick(at(millis * 1_000));
    }
    let waiting = drain(&mut head).len() as u32;
    assert_eq!(waiting, 48);
    assert_eq!(head.dropped(), 100 + 10 - waiting);
    assert!(head.node(node_id(1)).is_some());
}
