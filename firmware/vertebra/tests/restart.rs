//! What a vertebra remembers across a start, and what it must forget.

mod support;

use eel_canopen::NmtCommand;
use eel_kinematics::Pose;
use eel_protocol::emergency::Emergency;
use eel_protocol::{Frame, Mode, Moment, State};
use eel_units::{Angle, Current, Torque};
use eel_vertebra::{Keepsake, Vertebra};

use support::{Bench, node, pose, stays_off};

#[test]
fn a_failure_of_its_processor_needs_a_fault_reset() {
    let mut bench = Bench::new();
    let settings = eel_vertebra::Settings::prototype(node(), 7);
    bench.vertebra = Vertebra::new(settings, bench.now());
    bench.vertebra.stop_after_failure(&Keepsake::EMPTY);
    bench.nmt(NmtCommand::Start);
    bench.run(400);
    assert_eq!(bench.state(), State::StopOff);
    assert!(bench.emergencies(0).contains(&Emergency::RESTARTED.code));
    stays_off(&mut bench);
    bench.recover();
}

#[test]
fn a_reset_by_nmt_does_not_acknowledge_a_stop() {
    let mut bench = Bench::running();
    bench.stream = false;
    bench.until(State::StopOff, 2_500);
    bench.stream = true;
    bench.mode = Mode::Off;
    bench.nmt(NmtCommand::ResetNode);
    bench.nmt(NmtCommand::Start);
    bench.run(500);
    assert_eq!(bench.state(), State::StopOff);
    stays_off(&mut bench);
    bench.recover();
}

#[test]
fn a_current_out_of_hand_ends_a_damped_stop() {
    let mut bench = Bench::running();
    bench.stream = false;
    bench.until(State::StopDamped, 120);
    bench.sample.current[1] = Current::from_milliamps(-4_000);
    bench.run(4);
    assert_eq!(bench.state(), State::Fault);
    assert!(bench.emergencies(0).contains(&Emergency::OVER_CURRENT.code));
}

#[test]
fn a_wrist_that_can_not_follow_is_a_fault() {
    let mut bench = Bench::running();
    bench.follows = false;
    bench.target = pose(450, 0, 0);
    let from = bench.now().to_micros() / 1_000;
    bench.run(500);
    assert_eq!(bench.state(), State::Fault);
    assert!(
        bench
            .emergencies(from)
            .contains(&Emergency::NOT_FOLLOWING.code)
    );
}

/// Enables RPDO2, sends a moment about x in mN·m and lets it be released.
fn push(bench: &mut Bench, moment: i32) {
    let id = 0x300 + u16::from(node().get());
    let moment = Moment {
        moment: [
            Torque::from_millinewton_metres(moment),
            Torque::ZERO,
            Torque::ZERO,
        ],
        stiffness: 1 << 15,
    };
    bench
        .extra
        .push(Frame::standard(id, &moment.to_bytes()).unwrap());
    bench.run(10);
}

/// Reads object 0x2013:1, mN·m.
fn achieved_about_x(bench: &mut Bench) -> i16 {
    let node = u16::from(node().get());
    bench
        .extra
        .push(Frame::standard(0x600 + node, &[0x40, 0x13, 0x20, 1, 0, 0, 0, 0]).unwrap());
    bench.tick();
    let mut answers = bench
        .sent
        .iter()
        .filter(|sent| sent.frame.cob_id() == Some(0x580 + node));
    let answer = answers.next_back().unwrap().frame;
    let &[0x4B, 0x13, 0x20, 1, low, high, 0, 0] = answer.data() else {
        panic!("{answer:?}")
    };
    i16::from_le_bytes([low, high])
}

/// Lets RPDO2 exist: its COB-ID without the bit that disables it.
fn enable_feed_forward(bench: &mut Bench) {
    let id = 0x600 + u16::from(node().get());
    let cob_id = 0x300 + u32::from(node().get());
    let [a, b, c, d] = cob_id.to_le_bytes();
    let request = [0x23, 0x01, 0x14, 1, a, b, c, d];
    bench.extra.push(Frame::standard(id, &request).unwrap());
    bench.run(20);
}

#[test]
fn a_feed_forward_moment_acts_and_is_forgotten_with_its_stream() {
    let mut bench = Bench::ready();
    enable_feed_forward(&mut bench);
    bench.mode = Mode::Run;
    bench.run(50);
    assert!(achieved_about_x(&mut bench).abs() < 50);
    for _ in 0..20 {
        push(&mut bench, 1_000);
    }
    let pushed = achieved_about_x(&mut bench);
    assert!((900..=1_100).contains(&pushed), "{pushed} mN.m");
    bench.run(110);
    let left = achieved_about_x(&mut bench);
    assert!(left.abs() < 50, "{left} mN.m");
}

#[test]
fn a_stop_forgets_the_feed_forward_moment() {
    let mut bench = Bench::ready();
    enable_feed_forward(&mut bench);
    bench.mode = Mode::Run;
    bench.run(50);
    push(&mut bench, 1_000);
    bench.mode = Mode::Off;
    bench.run(20);
    bench.mode = Mode::Run;
    bench.run(15);
    assert_eq!(bench.state(), State::Run);
    let left = achieved_about_x(&mut bench);
    assert!(left.abs() < 50, "{left} mN.m");
}

#[test]
fn a_target_older_than_the_last_one_is_not_followed() {
    let mut bench = Bench::running();
    bench.target = pose(50, 0, 0);
    let old = bench.next_target();
    bench.target = Pose::HOME;
    bench.run(30);
    let before = bench.vertebra.reference().unwrap();
    bench.stream = false;
    bench.extra.push(old);
    bench.run(10);
    let after = bench.vertebra.reference().unwrap();
    assert!((after.yaw - before.yaw).abs() < Angle::from_milliradians(1));
}
