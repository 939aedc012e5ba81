//! Targets: which count, how far and how fast they lead, and what happens between and without them.

use eel_canopen::Frame;
use eel_kinematics::Pose;
use eel_protocol::emergency::Emergency;
use eel_protocol::{Condition, Mode, State};
use eel_units::Angle;
use eel_vertebra::{Limits, Settings};

use support::{Bench, NODE, Random, node, pose, radians};

mod support;

/// The prototype's rate limit in rad/s.
const RATE: f64 = 6.0;

/// Returns the reference's yaw, pitch and roll in radians.
fn reference(bench: &Bench) -> [f64; 3] {
    let Pose { yaw, pitch, roll } = bench.vertebra.reference().expect("the wrist follows");
    [yaw, pitch, roll].map(radians)
}

/// Tells whether a reference lies within the workspace, whose last digit is the wire's.
fn is_inside(reference: [f64; 3]) -> bool {
    let Pose { yaw, pitch, roll } = Limits::PROTOTYPE.workspace;
    let range = [yaw, pitch, roll].map(radians);
    reference
        .iter()
        .zip(range)
        .all(|(value, range)| value.abs() <= range + 4e-9)
}

/// Tells whether the reference is at a pose, to the step of the wire.
fn is_at(bench: &Bench, pose: Pose) -> bool {
    let wanted = [pose.yaw, pose.pitch, pose.roll].map(radians);
    reference(bench)
        .iter()
        .zip(wanted)
        .all(|(value, wanted)| (value - wanted).abs() <= 5.1e-5)
}

/// Runs and returns the largest speed in rad/s that the reference had from one tick to the next,
/// the largest change of that speed, and the farthest that it went within `window` ms.
fn watch(bench: &mut Bench, millis: u64, window: usize) -> (f64, f64, f64) {
    let mut path = vec![reference(bench)];
    for _ in 0..millis {
        bench.tick();
        path.push(reference(bench));
        assert!(is_inside(reference(bench)), "{:?}", reference(bench));
    }
    let apart = |a: [f64; 3], b: [f64; 3]| {
        (0..3)
            .map(|axis| (a[axis] - b[axis]).abs())
            .fold(0.0, f64::max)
    };
    let speed = path
        .windows(2)
        .map(|pair| apart(pair[0], pair[1]) * 1e3)
        .fold(0.0, f64::max);
    let change = path.windows(3).map(|three| {
        let [a, b, c] = [three[0], three[1], three[2]];
        (0..3)
            .map(|axis| (a[axis] + c[axis] - 2.0 * b[axis]).abs() * 1e3)
            .fold(0.0, f64::max)
    });
    let change = change.fold(0.0, f64::max);
    let far = path
        .windows(window + 1)
        .map(|part| apart(part[0], part[window]));
    (speed, change, far.fold(0.0, f64::max))
}

/// Lets the targets follow a swim: 1 Hz, 0.3 rad, one step for each SYNC.
fn swim(bench: &mut Bench) {
    let phase = bench.millis as f64 / 1e3 * core::f64::consts::TAU;
    let at = |amplitude: f64, shift: f64| (amplitude * (phase + shift).sin() * 1e3) as i32;
    bench.target = pose(at(0.3, 0.0), at(0.1, 1.0), at(0.03, 2.0));
}

#[test]
fn a_target_is_reached_and_reported() {
    let mut bench = Bench::running();
    bench.target = pose(300, -150, 40);
    bench.run(500);
    assert!(is_at(&bench, bench.target));
    let report = bench.report();
    assert_eq!(report.state, State::Run);
    let error = (radians(report.yaw) - 0.3).abs() + (radians(report.pitch) + 0.15).abs();
    assert!(error < 5e-4, "{report:?}");
}

#[test]
fn no_target_leads_faster_than_the_rate_limit() {
    let mut bench = Bench::running();
    let mut random = Random(0x5EED);
    for _ in 0..200 {
        bench.target = pose(
            random.pick(&[-3_000, -500, 0, 500, 3_000]),
            random.pick(&[-3_000, -250, 0, 250, 3_000]),
            random.pick(&[-3_000, -60, 0, 60, 3_000]),
        );
        let (speed, _, _) = watch(&mut bench, 30 + random.below(60), 10);
        assert!(speed <= RATE * 1.001, "{speed} rad/s");
    }
}

/// A head may set RPDO1 to be event-driven (0x1400:2), and even store that.
#[test]
fn targets_wait_for_sync_whatever_the_type_of_their_rpdo() {
    for transmission in [0, 240, 254, 255] {
        let mut bench = Bench::ready();
        bench.maintain();
        bench.download(0x1400, 2, &[transmission]).unwrap();
        bench.operate();
        bench.run(200);
        bench.mode = Mode::Off;
        bench.stream = true;
        bench.run(100);
        bench.mode = Mode::Run;
        bench.until(State::Run, 100);
        let mut random = Random(0x5EED);
        for _ in 0..300 {
            bench.target = pose(random.pick(&[-500, 500]), random.pick(&[-250, 250]), 0);
            for _ in 0..random.below(3) {
                let another = bench.next_target();
                bench.extra.push(another);
            }
            let (speed, change, _) = watch(&mut bench, 1 + random.below(15), 1);
            assert!(speed <= RATE * 1.001, "type {transmission}: {speed} rad/s");
            assert!(
                change <= 3.0,
                "type {transmission}: {change} rad/s in a tick"
            );
        }
        assert_eq!(bench.state(), State::Run);
    }
}

#[test]
fn a_target_outside_is_limited_told_once_and_never_followed() {
    let mut bench = Bench::running();
    let from = bench.millis;
    bench.target = pose(600, 0, 0);
    watch(&mut bench, 1_000, 10);
    assert!(bench.holds(Condition::TargetLimited));
    let reports = bench.reports(from);
    assert_eq!(reports.len(), 1);
    assert_eq!(reports[0].code, Emergency::TARGET_LIMITED.code);
    assert_eq!(reports[0].source.detail, 1, "yaw alone");
    let limit = Angle::from_tenth_milliradians(5_236);
    assert_eq!(bench.vertebra.reference().unwrap().yaw, limit);
    bench.target = pose(500, 0, 0);
    bench.run(200);
    assert!(!bench.holds(Condition::TargetLimited));
    assert_eq!(bench.emergencies(from), [Emergency::TARGET_LIMITED.code, 0]);
}

#[test]
fn damaged_targets_are_counted_and_not_followed() {
    let mut bench = Bench::running();
    let before = bench.vertebra.reference();
    bench.target = pose(300, 0, 0);
    bench.damage = 0x80;
    bench.run(20);
    assert_eq!(bench.vertebra.reference(), before);
    assert_eq!(bench.state(), State::Run);
}

#[test]
fn a_target_moved_to_another_identifier_is_damaged() {
    let mut bench = Bench::running();
    bench.target = pose(300, 0, 0);
    // A frame for vertebra 4 that arrives under the identifier of vertebra 3.
    let (yaw, pitch, roll) = (bench.target.yaw, bench.target.pitch, bench.target.roll);
    let counter = eel_protocol::Counter::new(9).unwrap();
    let other = eel_protocol::Target {
        yaw,
        pitch,
        roll,
        mode: Mode::Run,
        counter,
    }
    .to_bytes(0x204);
    bench.stream = false;
    for _ in 0..3 {
        bench
            .extra
            .push(Frame::standard(0x200 + u16::from(NODE), &other).unwrap());
        bench.run(10);
    }
    assert_eq!(bench.state(), State::StopDamped);
    assert!(bench.emergencies(0).contains(&Emergency::COMMAND_BAD.code));
}

#[test]
fn a_repeated_frame_is_no_sign_of_life() {
    let mut bench = Bench::running();
    let last = bench.millis;
    bench.counts = false;
    bench.target = pose(400, 0, 0);
    bench.until(State::StopDamped, 110);
    assert!(bench.millis - last <= 100);
    let yaw = radians(bench.vertebra.pose().yaw).abs();
    assert!(yaw < 1e-3, "a repeated frame was followed to {yaw}");
}

#[test]
fn short_remote_and_extended_frames_are_no_targets() {
    let mut bench = Bench::running();
    let last = bench.millis - bench.millis % 10;
    bench.stream = false;
    for _ in 0..10 {
        let id = 0x200 + u16::from(NODE);
        let standard = embedded_can::StandardId::new(id).unwrap();
        bench.extra.push(Frame::standard(id, &[1, 2, 3]).unwrap());
        bench.extra.push(Frame::remote(standard, 8).unwrap());
        let extended = embedded_can::ExtendedId::new(u32::from(id)).unwrap();
        let data = *bench.next_target().data().first_chunk::<8>().unwrap();
        bench.extra.push(Frame::new(extended, &data).unwrap());
        bench.run(10);
    }
    assert_eq!(bench.state(), State::StopDamped);
    assert!(bench.millis - last <= 110);
}

#[test]
fn two_missed_targets_are_bridged_by_the_motion_going_on() {
    let mut bench = Bench::running();
    // 2 rad/s, a step of 20 mrad each SYNC.
    let mut yaw = -300;
    for _ in 0..20 {
        yaw += 20;
        bench.target = pose(yaw, 0, 0);
        bench.run(10);
    }
    bench.stream = false;
    let from = bench.millis;
    for missed in 1..=2 {
        let before = reference(&bench)[0];
        bench.run(10);
        let moved = reference(&bench)[0] - before;
        assert!((moved - 0.02).abs() < 1e-3, "missed {missed}: {moved}");
        assert!(!bench.holds(Condition::CommandLate));
    }
    // The third comes to rest within a SYNC period, without a jump, and says so.
    bench.run(10);
    assert!(bench.holds(Condition::CommandLate));
    assert_eq!(bench.emergencies(from), [Emergency::COMMAND_LATE.code]);
    bench.run(10);
    let rest = reference(&bench);
    bench.run(20);
    assert_eq!(reference(&bench), rest, "the wrist stands");
    assert_eq!(bench.state(), State::Run);
    // A target in time is followed again, and the warning ends.
    bench.stream = true;
    let (speed, _, _) = watch(&mut bench, 100, 10);
    assert!(speed <= RATE * 1.001, "{speed}");
    assert!(!bench.holds(Condition::CommandLate));
    assert_eq!(bench.emergencies(from), [Emergency::COMMAND_LATE.code, 0]);
}

#[test]
fn without_any_sync_the_path_goes_on_comes_to_rest_and_the_vertebra_lets_go() {
    let mut bench = Bench::running();
    let mut yaw = -300;
    for _ in 0..20 {
        yaw += 20;
        bench.target = pose(yaw, 0, 0);
        bench.run(10);
    }
    let last = bench.millis;
    bench.sync = false;
    let (speed, change, _) = watch(&mut bench, 80, 10);
    assert!(speed <= 4.0 && change <= 2.1, "{speed} rad/s, by {change}");
    assert!(bench.holds(Condition::CommandLate));
    bench.until(State::StopDamped, 30);
    assert!(
        bench.millis - last <= 100,
        "targets that no SYNC releases are none"
    );
}

#[test]
fn a_sync_that_jitters_by_a_tick_leaves_the_reference_smooth() {
    let mut bench = Bench::running();
    bench.run(100);
    let mut steady = bench_copy(&bench);
    let mut random = Random(7);
    let mut path = Vec::new();
    let mut due = bench.millis + 10;
    bench.sync = false;
    bench.stream = false;
    while bench.millis < 4_000 {
        swim(&mut bench);
        if bench.millis + 1 == due {
            let frames = [bench.next_target(), bench.next_sync()];
            bench.extra.extend(frames);
            let grid = (due + 5) / 10 * 10 + 10;
            due = grid + random.below(3) - 1;
        }
        bench.tick();
        assert_eq!(bench.state(), State::Run);
        path.push(reference(&bench));
    }
    let worst = |path: &[[f64; 3]]| {
        let steps = path.windows(3).map(|three| {
            (0..3)
                .map(|axis| (three[0][axis] + three[2][axis] - 2.0 * three[1][axis]).abs() * 1e3)
                .fold(0.0, f64::max)
        });
        steps.fold(0.0, f64::max)
    };
    let mut smooth = Vec::new();
    while steady.millis < 4_000 {
        swim(&mut steady);
        steady.tick();
        smooth.push(reference(&steady));
    }
    // The fastest target moves at 1.9 rad/s; the rhythm of the SYNCs is smoothed, not obeyed.
    let [with, without] = [worst(&path[500..]), worst(&smooth[500..])];
    assert!(
        without < 0.05,
        "{without} rad/s from tick to tick without jitter"
    );
    println!("from tick to tick {with} rad/s with jitter, {without} without");
    assert!(with < 1.0, "{with} rad/s from tick to tick with jitter");
    assert!(!bench.holds(Condition::CommandLate));
}

/// Makes a second bench that has come as far as `bench`.
fn bench_copy(bench: &Bench) -> Bench {
    let mut copy = Bench::running();
    copy.run(bench.millis - copy.millis);
    copy
}

#[test]
fn syncs_from_50_to_200_hz_are_followed_without_a_warning() {
    for period in [5, 8, 10, 15, 20] {
        let mut bench = Bench::ready();
        bench.period = period;
        bench.run(1_000);
        bench.mode = Mode::Run;
        bench.run(50);
        let from = bench.millis;
        let mut worst = 0.0_f64;
        let mut last = reference(&bench);
        while bench.millis < from + 3_000 {
            swim(&mut bench);
            bench.tick();
            let now = reference(&bench);
            // At first the path leads to where the swimming is.
            if bench.millis > from + 500 {
                worst = worst.max((now[0] - last[0]).abs() * 1e3);
            }
            last = now;
        }
        assert_eq!(bench.emergencies(from), [], "{period} ms");
        assert!(
            worst < 2.2,
            "{period} ms: {worst} rad/s, where the targets move at 1.9"
        );
    }
}

#[test]
fn syncs_that_come_too_fast_lead_no_faster_than_the_rate_limit() {
    for period in [1, 2, 3] {
        let mut bench = Bench::running();
        bench.period = period;
        for yaw in [-500, 500, -500] {
            bench.target = pose(yaw, 0, 0);
            let (_, _, far) = watch(&mut bench, 100, 100);
            assert!(far <= 0.1 * RATE * 1.05, "{period} ms: {far} rad in 0.1 s");
        }
    }
}

#[test]
fn many_targets_and_syncs_in_one_tick_lead_no_faster_than_the_rate_limit() {
    let mut bench = Bench::running();
    for yaw in [-500, 500, -500] {
        bench.target = pose(yaw, 0, 0);
        for _ in 0..100 {
            for _ in 0..8 {
                let frames = [bench.next_target(), bench.next_sync()];
                bench.extra.extend(frames);
            }
            let before = reference(&bench)[0];
            bench.tick();
            let speed = (reference(&bench)[0] - before).abs() * 1e3;
            assert!(speed <= RATE * 1.001, "{speed} rad/s");
        }
        assert_eq!(bench.state(), State::Run);
    }
}

#[test]
fn hold_stays_where_it_began_whatever_the_target() {
    let mut bench = Bench::running();
    bench.target = pose(200, 50, 0);
    bench.run(300);
    bench.mode = Mode::Hold;
    bench.run(10);
    let held = bench.vertebra.reference().unwrap();
    bench.target = pose(-400, 0, 0);
    bench.run(300);
    assert_eq!(bench.vertebra.reference(), Some(held));
    assert!((radians(held.yaw) - 0.2).abs() < 1e-3);
}

#[test]
fn run_begins_where_the_wrist_is() {
    let mut bench = Bench::ready();
    bench.pose = pose(-400, 100, 20);
    bench.vertebra = eel_vertebra::Vertebra::new(Settings::prototype(node(), 5), bench.now());
    bench.nmt(eel_canopen::NmtCommand::Start);
    bench.run(400);
    bench.target = pose(400, -100, -20);
    bench.mode = Mode::Run;
    while bench.vertebra.reference().is_none() {
        bench.tick();
    }
    assert!((reference(&bench)[0] + 0.4).abs() < 1e-3);
    let (speed, _, _) = watch(&mut bench, 500, 10);
    assert!(speed <= RATE * 1.001, "{speed}");
    assert!(is_at(&bench, bench.target));
}
