//! The measured calls, pose by pose.

use core::fmt::Write;
use core::hint::black_box;

use cortex_m_semihosting::{debug, hio};
use eel_kinematics::{Direct, Inverse, Policy, Reach, Shared, Wrist};
use eel_units::{Current, Torque, Voltage, arctangents, ratio_q30, root_near, sin_cos_near};
use eel_vertebra::{CurrentLoop, Drive, Motor, Setpoint};
use libm::{atanf, sqrtf};

use crate::case::{self, Case, Floats};
use crate::console::{leave, say};
use crate::floating::{self, PAPER};
use crate::numbers::Numbers;
use crate::stopwatch::Stopwatch;

/// How many poses are measured: odd, so that one is in the middle.
const POSES: u32 = 1_001;
/// The seed of the measured poses and moments.
const SEED: u64 = 0x0EE1_0000_0003;
/// How often each call is repeated: a tick is six instructions.
const REPEATS: u32 = 32;
/// What the names of the columns are; the first is the loop alone.
const NAMES: [&str; 15] = [
    "loop",
    "sine_cosine",
    "arctangent",
    "root",
    "divide",
    "inverse",
    "direct",
    "torques",
    "share_free",
    "share_saturated",
    "share_keeping_direction",
    "step_free",
    "step_saturated",
    "nearest",
    "current_loop",
];
/// What the names of the columns in single precision are.
const FLOAT_NAMES: [&str; 9] = [
    "sine_cosine_f32",
    "arctangent_f32",
    "root_f32",
    "divide_f32",
    "inverse_f32",
    "direct_f32",
    "torques_f32",
    "share_free_f32",
    "step_free_f32",
];

/// Why the image gave up.
#[derive(Debug)]
enum Failure {
    /// SysTick is taken.
    Timer,
    /// The calls do not do what they should.
    Case(#[expect(dead_code, reason = "printed")] case::Failure),
    /// QEMU does not take the output.
    Output,
}

#[cortex_m_rt::entry]
fn main() -> ! {
    match run() {
        Ok(()) => leave(debug::EXIT_SUCCESS),
        Err(failure) => {
            say(format_args!("failed\t{failure:?}"));
            leave(debug::EXIT_FAILURE)
        }
    }
}

/// Measures and prints, pose by pose.
fn run() -> Result<(), Failure> {
    let peripherals = cortex_m::Peripherals::take().ok_or(Failure::Timer)?;
    let stopwatch = Stopwatch::new(peripherals.SYST);
    let mut out = hio::hstdout().map_err(|()| Failure::Output)?;
    write!(out, "repeats\t{REPEATS}\nnames").map_err(|_| Failure::Output)?;
    for name in NAMES.iter().chain(&FLOAT_NAMES) {
        write!(out, "\t{name}").map_err(|_| Failure::Output)?;
    }
    let mut numbers = Numbers::new(SEED);
    for _ in 0..POSES {
        let case = Case::draw(&mut numbers).map_err(Failure::Case)?;
        write!(out, "\nticks").map_err(|_| Failure::Output)?;
        let ours = measure(&stopwatch, &case);
        for ticks in ours.iter().chain(&measure_floats(&stopwatch, &case.floats)) {
            write!(out, "\t{ticks}").map_err(|_| Failure::Output)?;
        }
    }
    writeln!(out).map_err(|_| Failure::Output)
}

/// Returns the ticks of each call, repeated, in the order of the names.
fn measure(stopwatch: &Stopwatch, case: &Case) -> [u32; NAMES.len()] {
    let wrist = &Wrist::PAPER;
    let Case { pose, bounds, .. } = case;
    let joints = &case.inverse.joints;
    let jacobian = &case.direct.jacobian;
    [
        repeat(stopwatch, || ()),
        repeat(stopwatch, || sin_cos_near([black_box(pose.yaw)])),
        repeat(stopwatch, || arctangents([black_box(case.tangent)])),
        repeat(stopwatch, || root_near(black_box(case.square))),
        repeat(stopwatch, || {
            ratio_q30(black_box(case.number), black_box(case.divisor))
        }),
        repeat(stopwatch, || black_box(wrist).inverse(black_box(pose))),
        repeat(stopwatch, || black_box(wrist).direct(black_box(joints))),
        repeat(stopwatch, || {
            black_box(jacobian).torques(*black_box(&case.moment))
        }),
        repeat(stopwatch, || {
            black_box(jacobian).share(black_box(&case.moment), black_box(bounds), Policy::YawFirst)
        }),
        repeat(stopwatch, || {
            black_box(jacobian).share(
                black_box(&case.overload),
                black_box(bounds),
                Policy::YawFirst,
            )
        }),
        repeat(stopwatch, || {
            black_box(jacobian).share(
                black_box(&case.overload),
                black_box(bounds),
                Policy::KeepDirection,
            )
        }),
        repeat(stopwatch, || step(case, &case.moment)),
        repeat(stopwatch, || step(case, &case.overload)),
        repeat(stopwatch, || {
            black_box(wrist).nearest(black_box(&case.beyond), black_box(&NEAREST))
        }),
        repeat_current_loop(stopwatch, case),
    ]
}

/// Counts a turn of the current loop, three motors driven, repeated.
fn repeat_current_loop(stopwatch: &Stopwatch, case: &Case) -> u32 {
    // As many mA as the case's moment has mN·m, about.
    let currents = [0, 1, 2].map(|axis| {
        let milli = case
            .moment
            .get(axis)
            .map_or(0, |torque| torque.to_q24() >> 14);
        Current::from_milliamps(milli)
    });
    let mut current_loop = CurrentLoop::new(&Motor::PROTOTYPE);
    let drives = currents.map(|current| {
        Drive::Current(Setpoint {
            current,
            emf: Voltage::from_millivolts(3_000),
        })
    });
    current_loop.set(&drives, Voltage::from_millivolts(24_000));
    repeat(stopwatch, || current_loop.update(black_box(currents)))
}

/// Where the nearest pose is looked for: all that the kernel reaches.
const NEAREST: Reach = Reach::kernel();

/// A step: inverse, direct with Jacobian, sharing.
#[inline(always)]
fn step(case: &Case, moment: &[Torque; 3]) -> Option<Shared> {
    // By reference all the way: copies are not the kernel's.
    let wrist = &Wrist::PAPER;
    let inverse = black_box(wrist).inverse(black_box(&case.pose));
    let Ok(Inverse { joints, .. }) = &inverse else {
        return None;
    };
    let direct = wrist.direct(joints);
    let Ok(Direct { jacobian, .. }) = &direct else {
        return None;
    };
    let shared = jacobian.share(black_box(moment), black_box(&case.bounds), Policy::YawFirst);
    black_box((&inverse, &direct));
    Some(shared)
}

/// Returns the ticks of each call in single precision, repeated, in the order of the names.
fn measure_floats(stopwatch: &Stopwatch, floats: &Floats) -> [u32; FLOAT_NAMES.len()] {
    let Floats {
        pose,
        joints,
        map,
        moment,
        bounds,
        ..
    } = floats;
    [
        repeat(stopwatch, || floating::sine_cosine(black_box(pose[0]))),
        repeat(stopwatch, || atanf(black_box(floats.tangent))),
        repeat(stopwatch, || sqrtf(black_box(floats.square))),
        repeat(stopwatch, || {
            black_box(floats.number) / black_box(floats.divisor)
        }),
        repeat(stopwatch, || {
            floating::inverse(black_box(&PAPER), black_box(pose))
        }),
        repeat(stopwatch, || {
            floating::direct(black_box(&PAPER), black_box(joints))
        }),
        repeat(stopwatch, || {
            floating::torques(black_box(map), black_box(moment))
        }),
        repeat(stopwatch, || {
            floating::share(black_box(map), black_box(moment), black_box(bounds))
        }),
        repeat(stopwatch, || {
            let inverse = floating::inverse(black_box(&PAPER), black_box(pose))?;
            let direct = floating::direct(&PAPER, &inverse.joints)?;
            let torques = floating::share(&direct.torque, black_box(moment), black_box(bounds));
            black_box((&inverse, &direct));
            torques
        }),
    ]
}

/// Counts a call, repeated. The result stays where it is made.
#[inline(never)]
fn repeat<Answer>(stopwatch: &Stopwatch, mut call: impl FnMut() -> Answer) -> u32 {
    let ((), ticks) = stopwatch.time(|| {
        let mut left = REPEATS;
        while left != 0 {
            black_box(&call());
            // Unknown to the compiler, so that every loop is the same loop.
            left = black_box(left - 1);
        }
    });
    ticks
}
