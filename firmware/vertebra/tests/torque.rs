//! Torque: what is asked of the current loop never passes its bounds, whatever target, supply and speed;
//! and the limit code tells which bound acted.

use eel_kinematics::{Joints, Wrist};
use eel_protocol::emergency::Emergency;
use eel_protocol::{Condition, LimitCode, Mode, State};
use eel_units::{Current, Temperature, Voltage};
use eel_vertebra::{Drive, Limits, Motor};

use support::{Bench, Random, limits, pose, radians, torque};

mod support;

/// Torque constant in N·m/A and resistance in Ω of the prototype's motors.
const CONSTANT: f64 = Motor::PROTOTYPE.torque_constant as f64 / 1e6;
const RESISTANCE: f64 = Motor::PROTOTYPE.resistance as f64 / 1e3;

/// A bench whose motors carry the current that they are asked for.
struct Windings {
    bench: Bench,
    last: [f64; 3],
    /// Speed of each motor in the last tick, rad/s.
    speeds: [f64; 3],
}

impl Windings {
    fn new(bench: Bench) -> Self {
        let last = angles(&bench);
        Self {
            bench,
            last,
            speeds: [0.0; 3],
        }
    }

    /// Lets a tick pass; returns the torque that is asked of each motor, in N·m.
    fn tick(&mut self) -> [f64; 3] {
        self.bench.tick();
        let now = angles(&self.bench);
        let torques = self
            .bench
            .drives
            .map(|drive| torque(drive).unwrap_or_default());
        self.speeds = std::array::from_fn(|motor| (now[motor] - self.last[motor]) * 1e3);
        self.bench.sample.current =
            torques.map(|torque| Current::from_microamps((torque / CONSTANT * 1e6) as i32));
        self.last = now;
        torques
    }
}

fn angles(bench: &Bench) -> [f64; 3] {
    let Joints(angles) = Wrist::PAPER.inverse(&bench.pose).unwrap().joints;
    angles.map(radians)
}

/// Returns a wrist that stands 0.2 rad of yaw from where it is asked to be.
fn pulled() -> Windings {
    let mut bench = Bench::running();
    bench.follows = false;
    bench.target = pose(200, 0, 0);
    Windings::new(bench)
}

#[test]
fn torque_never_passes_the_peak_nor_the_current_limit_for_any_target_and_supply() {
    let mut random = Random(0xB0B);
    let peak = f64::from(Limits::PROTOTYPE.peak_torque.to_millinewton_metres()) / 1e3;
    let limit = CONSTANT * f64::from(Motor::PROTOTYPE.current_limit.to_microamps()) / 1e6;
    let bound = peak.min(limit) * 1.01 + 0.005;
    let (mut saturated, mut largest) = (0, 0.0_f64);
    for _ in 0..20 {
        let mut bench = Bench::running();
        bench.follows = false;
        let mut windings = Windings::new(bench);
        for _ in 0..100 {
            let bench = &mut windings.bench;
            bench.sample.supply = Voltage::from_millivolts(random.within(17_500, 30_500));
            bench.target = pose(
                random.within(-600, 600),
                random.within(-300, 300),
                random.within(-80, 80),
            );
            for _ in 0..30 {
                for torque in windings.tick() {
                    assert!(torque.abs() <= bound, "{torque} N.m of {bound}");
                    largest = largest.max(torque.abs());
                    saturated += u32::from(torque.abs() > 0.9 * peak);
                }
            }
            assert_eq!(windings.bench.state(), State::Run);
        }
    }
    assert!(
        saturated > 1_000,
        "the test asks for too little: {saturated}"
    );
    assert!(largest > 0.95 * peak, "{largest}");
}

#[test]
fn a_moving_wrist_keeps_its_bounds_too() {
    let mut random = Random(0xEE1);
    let mut windings = Windings::new(Bench::running());
    let bound = f64::from(Limits::PROTOTYPE.peak_torque.to_millinewton_metres()) / 1e3;
    let mut worst = 0.0_f64;
    for _ in 0..200 {
        windings.bench.target = pose(
            random.within(-500, 500),
            random.within(-250, 250),
            random.within(-60, 60),
        );
        for _ in 0..50 {
            for torque in windings.tick() {
                worst = worst.max(torque.abs());
            }
        }
        assert_eq!(windings.bench.state(), State::Run);
    }
    assert!(worst <= bound + 1e-3, "{worst} N.m");
}

#[test]
fn a_fast_wrist_is_asked_for_no_more_than_the_supply_drives() {
    let mut windings = Windings::new(Bench::running());
    windings.bench.follows = false;
    // Somebody yaws the wrist at 12 rad/s towards a target that lies beyond.
    windings.bench.target = pose(500, 0, 0);
    windings.bench.move_to(pose(-500, 0, 0), 60);
    let mut least = f64::INFINITY;
    for step in 1..60 {
        windings.bench.pose = pose(-500 + step * 12, 0, 0);
        let torques = windings.tick();
        for (torque, speed) in torques.into_iter().zip(windings.speeds).take(2) {
            // The observer of 600 rad/s has followed after 20 ms.
            if step > 20 && torque * speed > 0.0 {
                let most = CONSTANT * (24.0 - CONSTANT * speed.abs()) / RESISTANCE;
                assert!(
                    torque.abs() <= most + 0.05,
                    "{torque} of {most} N.m at {speed} rad/s"
                );
                least = least.min(most);
            }
        }
    }
    assert!(least < 2.0, "{least}");
}

#[test]
fn the_limit_code_names_the_bound_that_acts() {
    type Set = fn(&mut Bench);
    let cases: [(LimitCode, Set); 5] = [
        (LimitCode::Peak, |_| {}),
        (LimitCode::Undervoltage, |bench| {
            bench.sample.supply = Voltage::from_millivolts(18_000);
        }),
        (LimitCode::Board, |bench| {
            bench.sample.board_temperature = Temperature::from_decidegrees(850);
        }),
        (LimitCode::Thermal, |bench| {
            bench.sample.motor_temperature = [Temperature::from_decidegrees(950); 3];
        }),
        (LimitCode::None, |bench| bench.target = pose(2, 0, 0)),
    ];
    for (code, set) in cases {
        let mut windings = pulled();
        set(&mut windings.bench);
        let mut torque = [0.0; 3];
        for _ in 0..100 {
            torque = windings.tick();
        }
        let named = limits(&windings.bench);
        // Yaw is the sum of motors 1 and 2; one of them runs out first and is named.
        assert!(
            named[..2].contains(&code),
            "{code:?}: {named:?} at {torque:?}"
        );
        let share = match code {
            LimitCode::Peak => 1.0,
            LimitCode::None => 0.8 / 6.0,
            LimitCode::Thermal => 0.25,
            _ => 1.0 / 3.0,
        };
        let sum = torque[0] + torque[1];
        assert!((sum - 6.0 * share).abs() < 0.1, "{code:?}: {sum} N.m");
    }
}

#[test]
fn what_drives_and_what_brakes_have_limits_of_their_own() {
    // Somebody yaws the wrist at 1 rad/s; the target lies far ahead of it, or far behind.
    let sum = |ahead: bool, set: fn(&mut Bench)| {
        let mut windings = Windings::new(Bench::running());
        windings.bench.follows = false;
        windings.bench.target = pose(if ahead { 520 } else { -520 }, 0, 0);
        set(&mut windings.bench);
        windings.bench.move_to(pose(-100, 0, 0), 20);
        let mut torque = [0.0; 3];
        for step in -100..100 {
            windings.bench.pose = pose(step, 0, 0);
            torque = windings.tick();
        }
        (torque[0] + torque[1], limits(&windings.bench))
    };
    type Case = (fn(&mut Bench), LimitCode, f64, f64);
    let cases: [Case; 4] = [
        // 18 V leave a third to what drives, 30 V a third to what brakes.
        (
            |bench| bench.sample.supply = Voltage::from_millivolts(18_000),
            LimitCode::Undervoltage,
            2.0,
            -6.0,
        ),
        (
            |bench| bench.sample.supply = Voltage::from_millivolts(30_000),
            LimitCode::Overvoltage,
            6.0,
            -2.0,
        ),
        // A hot board leaves a tenth to what drives, and a quarter to what brakes.
        (
            |bench| bench.sample.board_temperature = Temperature::from_decidegrees(885),
            LimitCode::Board,
            0.6,
            -1.5,
        ),
        (|_| {}, LimitCode::Peak, 6.0, -6.0),
    ];
    for (set, code, driving, braking) in cases {
        let (drives, drive_codes) = sum(true, set);
        let (brakes, brake_codes) = sum(false, set);
        assert!(
            (drives - driving).abs() < 0.1,
            "{code:?}: {drives} N.m drive"
        );
        assert!(
            (brakes - braking).abs() < 0.1,
            "{code:?}: {brakes} N.m brake"
        );
        let is_named = |codes: [LimitCode; 3]| codes[..2].contains(&code);
        assert!(
            is_named(drive_codes) || driving == 6.0,
            "{code:?}: {drive_codes:?}"
        );
        assert!(
            is_named(brake_codes) || braking == -6.0,
            "{code:?}: {brake_codes:?}"
        );
    }
}

#[test]
fn the_end_of_travel_takes_the_torque_that_leads_out_and_names_itself() {
    let mut settings = eel_vertebra::Settings::prototype(support::node(), 1);
    // Motor 1 stands at 0; its travel ends here.
    settings.limits.travel[0].high = eel_units::Angle::from_milliradians(1);
    settings.limits.travel[1].high = eel_units::Angle::from_milliradians(1);
    let mut bench = Bench::with(settings);
    bench.nmt(eel_canopen::NmtCommand::Start);
    bench.run(400);
    bench.mode = Mode::Run;
    bench.run(50);
    bench.follows = false;
    let mut windings = Windings::new(bench);
    let mut pull = |yaw| {
        windings.bench.target = pose(yaw, 0, 0);
        let mut torque = [0.0; 3];
        for _ in 0..200 {
            torque = windings.tick();
        }
        (torque[0], limits(&windings.bench))
    };
    let [one, other] = [pull(200), pull(-200)];
    let (out, back) = if one.0.abs() < other.0.abs() {
        (one, other)
    } else {
        (other, one)
    };
    assert!(
        out.0.abs() < 0.1 && out.1[..2].contains(&LimitCode::Travel),
        "{out:?}"
    );
    assert!(
        back.0.abs() > 2.9 && back.1[..2].contains(&LimitCode::Peak),
        "{back:?}"
    );
}

#[test]
fn near_a_singularity_torque_falls_with_a_warning_and_nearer_it_is_a_fault() {
    let mut settings = eel_vertebra::Settings::prototype(support::node(), 1);
    for travel in &mut settings.limits.travel {
        travel.low = eel_units::Angle::from_milliradians(-1_500);
        travel.high = eel_units::Angle::from_milliradians(1_500);
    }
    let mut bench = Bench::with(settings);
    bench.nmt(eel_canopen::NmtCommand::Start);
    bench.run(400);
    bench.mode = Mode::Moment;
    bench.run(50);
    assert_eq!(bench.state(), State::Moment);
    bench.follows = false;
    // On this way det A falls from 1 to 0.36; the kernel answers all along it.
    let way = |share: i32| pose(-646 * share / 100, 454 * share / 100, 471 * share / 100);
    let det_a = |bench: &Bench| {
        let Joints(angles) = Wrist::PAPER.inverse(&bench.pose).unwrap().joints;
        let direct = Wrist::PAPER.direct(&Joints(angles)).unwrap();
        f64::from(direct.jacobian.det_a()) / f64::from(1 << 30)
    };
    let from = bench.millis;
    let (mut share, mut limited) = (30, 0);
    bench.move_to(way(share), 300);
    while det_a(&bench) >= 0.47 {
        let left = ((det_a(&bench) - 0.45) / 0.15).min(1.0);
        for motor in bench.drives.map(|drive| torque(drive).unwrap()) {
            assert!(motor.abs() <= 3.0 * left + 0.01, "{motor} N·m of {left}");
        }
        let near = det_a(&bench) < 0.60;
        assert_eq!(bench.holds(Condition::NearSingularity), near, "{left}");
        limited += usize::from(limits(&bench).contains(&LimitCode::Singularity));
        share += 1;
        bench.move_to(way(share), 20);
    }
    assert!(limited > 3, "torque was limited in {limited} places");
    bench.move_to(way(60), 200);
    assert!(!bench.holds(Condition::NearSingularity));
    let [near, cleared] = [Emergency::NEAR_SINGULARITY, Emergency::CLEARED].map(|it| it.code);
    assert_eq!(bench.emergencies(from), [near, cleared]);
    let from = bench.millis;
    bench.move_to(way(99), 600);
    assert_eq!(bench.emergencies(from), [near, Emergency::SINGULAR.code]);
    assert_eq!(bench.state(), State::Fault);
}

#[test]
fn a_drive_that_is_off_says_so() {
    let mut bench = Bench::ready();
    bench.run(30);
    assert_eq!(limits(&bench), [LimitCode::Off; 3]);
    bench.mode = Mode::Brake;
    bench.run(30);
    assert_eq!(bench.drives, [Drive::Brake; 3]);
    assert_eq!(limits(&bench), [LimitCode::Off; 3]);
}

#[test]
fn damping_on_request_keeps_its_cap() {
    let mut windings = Windings::new(Bench::enabled(Mode::Damped));
    windings.bench.follows = false;
    // Somebody turns the wrist at 3 rad/s.
    let mut worst = 0.0_f64;
    for step in 0..100 {
        windings.bench.pose = pose(step * 3, 0, 0);
        let torque = windings.tick();
        if step > 20 {
            worst = worst.max(torque[0].abs()).max(torque[1].abs());
        }
    }
    assert_eq!(windings.bench.state(), State::Damped);
    assert!((0.9..=1.05).contains(&worst), "{worst} N.m of 1 N.m");
}
