//! The modes that produce a moment or the torque of single motors instead of following a pose.

use eel_canopen::Frame;
use eel_kinematics::{Pose, Wrist};
use eel_protocol::{LimitCode, Mode, Moment, State};
use eel_units::{Angle, Torque};
use eel_vertebra::Limits;

use support::{Bench, NODE, limits, pose, radians, torque};

mod support;

/// The abort code "data can't be transferred because of the present device state" (CiA 301).
const DEVICE_STATE: u32 = 0x0800_0022;
fn torques(bench: &Bench) -> [f64; 3] {
    bench.drives.map(|drive| torque(drive).unwrap_or_default())
}

fn cranks(at: Pose) -> [f64; 3] {
    Wrist::PAPER.inverse(&at).unwrap().joints.0.map(radians)
}

/// Returns the power that torques put into a unit rate of yaw, pitch and roll at a pose: τ · ∂θ/∂q, by
/// differences of the inverse kinematics over ±5 mrad.
fn work(torques: [f64; 3], at: Pose) -> [f64; 3] {
    let solve = |axis: usize, step: i32| {
        let mut angles = at.angles();
        angles[axis] += Angle::from_milliradians(step);
        let found = Wrist::PAPER.inverse(&Pose::from_angles(angles)).unwrap();
        found.joints.0.map(radians)
    };
    [0, 1, 2].map(|axis| {
        let (more, less) = (solve(axis, 5), solve(axis, -5));
        (0..3)
            .map(|motor| torques[motor] * (more[motor] - less[motor]) / 0.010)
            .sum()
    })
}

/// Returns the power of a moment at a unit rate of yaw, pitch and roll: M · ω with ω from
/// R = Rx(yaw) Ry(pitch) Rz(roll).
fn power([x, y, z]: [f64; 3], at: Pose) -> [f64; 3] {
    let [yaw, pitch, _] = at.angles().map(radians);
    let (sy, cy, sp, cp) = (yaw.sin(), yaw.cos(), pitch.sin(), pitch.cos());
    [x, y * cy + z * sy, x * sp - y * sy * cp + z * cy * cp]
}

/// Returns a vertebra that listens to RPDO2 and stands still where it is put, in a mode.
fn still(mode: Mode, at: Pose) -> Bench {
    let mut bench = Bench::ready();
    bench.maintain();
    let id = 0x300 + u32::from(NODE);
    bench.download(0x1401, 1, &id.to_le_bytes()).unwrap();
    bench.operate();
    bench.follows = false;
    bench.move_to(at, 100);
    // The observer comes to rest.
    bench.run(100);
    bench.mode = mode;
    bench.run(30);
    bench
}

/// Lets time pass with RPDO2 before each SYNC.
fn ask(bench: &mut Bench, moment: [i32; 3], millis: u64) {
    let moment = Moment {
        moment: moment.map(Torque::from_millinewton_metres),
        stiffness: 1 << 15,
    };
    for _ in 0..millis {
        if (bench.millis + 1).is_multiple_of(bench.period) {
            let frame = Frame::standard(0x300 + u16::from(NODE), &moment.to_bytes());
            bench.extra.push(frame.unwrap());
        }
        bench.tick();
    }
}

#[test]
fn the_moment_mode_produces_the_moment_and_nothing_else() {
    for at in [
        pose(0, 0, 0),
        pose(300, 0, 0),
        pose(-250, 150, 30),
        pose(100, -200, -40),
    ] {
        for asked in [
            [0, 0, 0],
            [1_000, 0, 0],
            [0, -800, 0],
            [0, 0, 600],
            [-900, 500, 300],
        ] {
            let mut bench = still(Mode::Moment, at);
            assert_eq!(bench.state(), State::Moment);
            ask(&mut bench, asked, 60);
            let asked = asked.map(|milli| f64::from(milli) / 1e3);
            let (made, wanted) = (work(torques(&bench), at), power(asked, at));
            for (made, wanted) in made.into_iter().zip(wanted) {
                assert!(
                    (made - wanted).abs() < 0.006,
                    "{made} W of {wanted} W at {at:?}"
                );
            }
        }
    }
}

#[test]
fn the_moment_ends_with_the_frames_that_ask_for_it() {
    let mut bench = still(Mode::Moment, Pose::HOME);
    ask(&mut bench, [1_000, 0, 0], 60);
    assert!(torques(&bench)[0] > 0.3);
    bench.run(100);
    assert_eq!(bench.state(), State::Moment);
    assert!(torques(&bench).iter().all(|torque| torque.abs() < 0.005));
    // Nor does a moment of before act when the mode begins again.
    ask(&mut bench, [1_000, 0, 0], 20);
    bench.mode = Mode::Off;
    ask(&mut bench, [1_000, 0, 0], 20);
    bench.mode = Mode::Moment;
    bench.run(10);
    assert!(bench.is_off() || torques(&bench).iter().all(|torque| torque.abs() < 0.005));
}

#[test]
fn the_moment_mode_does_not_lead_out_of_the_workspace() {
    // 20 mrad beyond the end of yaw the spring pulls back with 400 N·m/rad.
    let at = pose(544, 0, 0);
    let mut bench = still(Mode::Moment, at);
    ask(&mut bench, [1_000, 0, 0], 60);
    let [yaw, _, _] = work(torques(&bench), at);
    assert!(yaw < -5.0, "{yaw} N.m of yaw");
    // Inside, it does not act.
    let at = pose(520, 0, 0);
    let mut bench = still(Mode::Moment, at);
    ask(&mut bench, [500, 0, 0], 60);
    let [yaw, _, _] = work(torques(&bench), at);
    assert!((yaw - 0.5).abs() < 0.01, "{yaw} N.m of yaw");
}

#[test]
fn a_motor_produces_its_torque_in_its_mode_only() {
    let mut bench = still(Mode::Off, Pose::HOME);
    let torque = |milli: i16| milli.to_le_bytes();
    assert_eq!(bench.download(0x2002, 1, &torque(300)), Err(DEVICE_STATE));
    bench.mode = Mode::Motor;
    bench.run(20);
    assert_eq!(bench.state(), State::Motor);
    bench.download(0x2002, 1, &torque(300)).unwrap();
    bench.download(0x2002, 3, &torque(-200)).unwrap();
    bench.run(200);
    let [one, two, three] = torques(&bench);
    let is_told = (one - 0.3).abs() < 6e-3 && two.abs() < 6e-3 && (three + 0.2).abs() < 6e-3;
    assert!(is_told, "{one} {two} {three} N.m");
    // It ends with the mode, and does not come back with it.
    for mode in [Mode::Hold, Mode::Motor] {
        bench.mode = mode;
        bench.run(200);
    }
    assert_eq!(bench.upload(0x2002, 1), Ok(vec![0, 0]));
    bench.run(200);
    assert!(torques(&bench).iter().all(|torque| torque.abs() < 6e-3));
    bench.download(0x2002, 2, &torque(300)).unwrap();
    bench.stream = false;
    bench.until(State::StopDamped, 100);
}

#[test]
fn a_motor_is_held_to_the_damped_torque_and_says_so() {
    let mut bench = still(Mode::Motor, Pose::HOME);
    bench.download(0x2002, 2, &2_000_i16.to_le_bytes()).unwrap();
    bench.run(30);
    let cap = f64::from(Limits::PROTOTYPE.damped_torque.to_millinewton_metres()) / 1e3;
    let [_, two, _] = torques(&bench);
    assert!((two - cap).abs() < 0.01, "{two} N.m of {cap}");
    assert_eq!(limits(&bench)[1], LimitCode::Command);
}

#[test]
fn a_commissioned_motor_that_runs_away_is_braked() {
    // The wrist yaws at 3 rad/s: cranks 1 and 2 turn with it, the motor drives it on.
    let mut bench = still(Mode::Motor, pose(-300, 0, 0));
    bench.download(0x2002, 1, &500_i16.to_le_bytes()).unwrap();
    for _ in 0..80 {
        bench.pose.yaw += Angle::from_milliradians(3);
        bench.tick();
    }
    let angle = |pose: Pose| cranks(pose)[0];
    let mut before = bench.pose;
    before.yaw -= Angle::from_milliradians(3);
    let speed = (angle(bench.pose) - angle(before)) * 1e3;
    let [torque, _, _] = torques(&bench);
    let wanted = 0.5 - (speed - speed.clamp(-1.0, 1.0));
    let wanted = wanted.clamp(-1.0, 1.0);
    assert!(
        speed.abs() > 2.0 && (torque - wanted).abs() < 0.1,
        "{torque} of {wanted} at {speed}"
    );
}
