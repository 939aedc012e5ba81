//! The measured calls, pose by pose.

use core::fmt::Write;
use core::hint::black_box;

use cortex_m_semihosting::{debug, hio};
use eel_kinematics::{Bounds, Direct, Inverse, Policy, Pose, Wrist};
use eel_units::{Angle, Torque, arctangents, ratio_q30, root_near, sin_cos_near};

use crate::answers::{self, Numbers};
use crate::console::{leave, say};
use crate::floating;
use crate::stopwatch::Stopwatch;

/// How many poses are measured: odd, so that one is in the middle.
const POSES: u32 = 1_001;
/// The seed of the measured poses and moments.
const SEED: u64 = 0x0EE1_0000_0003;
/// How often each call is repeated: a tick is six instructions.
const REPEATS: u32 = 32;
/// The paper's workspace in radians Q29: yaw ±30°, pitch ±15°, roll ±4°.
const YAW: i32 = 281_104_936;
const PITCH: i32 = 140_552_468;
const ROLL: i32 = 37_480_658;
/// What the names of the columns are; the first is the loop alone.
const NAMES: [&str; 13] = [
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
    "step_free",
    "step_saturated",
    "inverse_f32",
];
/// How far the two inverses may lie apart: 4 µrad in Q29, 2 parts in 10⁶ in Q30. That is some tens of
/// roundings in single precision.
const APART: u32 = 2_147;

/// Why the image gave up.
#[derive(Debug)]
enum Failure {
    /// SysTick is taken.
    Timer,
    /// A pose of the workspace has no answer.
    Refused,
    /// A moment was bounded that should be free, or the other way round.
    Bounds,
    /// The inverse in single precision gives another answer.
    Apart,
    /// QEMU does not take the output.
    Output,
}

/// One pose and everything that the calls take.
struct Case {
    pose: Pose,
    radians: [f32; 3],
    tangent: i32,
    square: i32,
    number: i32,
    divisor: i32,
    moment: [Torque; 3],
    overload: [Torque; 3],
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

/// Measures, then hashes.
fn run() -> Result<(), Failure> {
    let peripherals = cortex_m::Peripherals::take().ok_or(Failure::Timer)?;
    let stopwatch = Stopwatch::new(peripherals.SYST);
    let mut out = hio::hstdout().map_err(|()| Failure::Output)?;
    write!(out, "repeats\t{REPEATS}\nnames").map_err(|_| Failure::Output)?;
    for name in NAMES {
        write!(out, "\t{name}").map_err(|_| Failure::Output)?;
    }
    let mut numbers = Numbers::new(SEED);
    for _ in 0..POSES {
        write!(out, "\nticks").map_err(|_| Failure::Output)?;
        for ticks in measure(&stopwatch, &Case::draw(&mut numbers))? {
            write!(out, "\t{ticks}").map_err(|_| Failure::Output)?;
        }
    }
    writeln!(out, "\nhash\t{:016x}", answers::hash()).map_err(|_| Failure::Output)
}

impl Case {
    fn draw(numbers: &mut Numbers) -> Self {
        // A random part of `range`, with its sign.
        let mut part = |range: i32| ((i64::from(numbers.bits()) * i64::from(range)) >> 31) as i32;
        let angles = [part(YAW), part(PITCH), part(ROLL)];
        let [yaw, pitch, roll] = angles.map(Angle::from_q29);
        let divisor = (3 << 28) + part(1 << 28);
        Self {
            pose: Pose { yaw, pitch, roll },
            radians: angles.map(|angle| angle as f32 / (1 << 29) as f32),
            tangent: part(1 << 30),
            square: (5 << 27) + part(7 << 26),
            number: part(divisor >> 1),
            divisor,
            // 0.3 N·m at most, against bounds of 3 N·m.
            moment: [0; 3].map(|_| Torque::from_q24(part(5_033_165))),
            // 8 to 12 N·m in yaw.
            overload: [
                Torque::from_q24((10 << 24) + part(2 << 24)),
                Torque::from_q24(part(4 << 24)),
                Torque::from_q24(part(4 << 24)),
            ],
        }
    }
}

/// Returns the ticks of each call, repeated, in the order of the names.
fn measure(stopwatch: &Stopwatch, case: &Case) -> Result<[u32; NAMES.len()], Failure> {
    let wrist = &Wrist::PAPER;
    let bounds = &[Bounds {
        low: Torque::from_millinewton_metres(-3_000),
        high: Torque::from_millinewton_metres(3_000),
    }; 3];
    let pose = &case.pose;
    let inverse = wrist.inverse(pose).map_err(|_| Failure::Refused)?;
    let joints = &inverse.joints;
    let direct = wrist.direct(joints).map_err(|_| Failure::Refused)?;
    let jacobian = &direct.jacobian;
    check(case, &inverse, &direct, bounds)?;
    let step = |moment: &[Torque; 3]| {
        // By reference all the way: copies are not the kernel's.
        let inverse = black_box(wrist).inverse(black_box(pose));
        let Ok(Inverse { joints, .. }) = &inverse else {
            return None;
        };
        let direct = wrist.direct(joints);
        let Ok(Direct { jacobian, .. }) = &direct else {
            return None;
        };
        let shared = jacobian.share(black_box(moment), black_box(bounds), Policy::YawFirst);
        black_box((&inverse, &direct));
        Some(shared)
    };
    Ok([
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
        repeat(stopwatch, || step(&case.moment)),
        repeat(stopwatch, || step(&case.overload)),
        repeat(stopwatch, || {
            floating::inverse(black_box(&floating::PAPER), black_box(&case.radians))
        }),
    ])
}

/// Counts a call, repeated. The result stays where it is made.
#[inline(never)]
fn repeat<Answer>(stopwatch: &Stopwatch, call: impl Fn() -> Answer) -> u32 {
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

/// Checks that the calls do what their names say.
fn check(
    case: &Case,
    inverse: &Inverse,
    direct: &Direct,
    bounds: &[Bounds; 3],
) -> Result<(), Failure> {
    let bound = |moment: &[Torque; 3]| {
        let shared = direct.jacobian.share(moment, bounds, Policy::YawFirst);
        shared.bound.iter().any(Option::is_some)
    };
    if bound(&case.moment) || !bound(&case.overload) {
        return Err(Failure::Bounds);
    }
    let floating = floating::inverse(&floating::PAPER, &case.radians).ok_or(Failure::Refused)?;
    let joints = inverse.joints.0.iter().zip(floating.joints);
    let mut apart = joints.map(|(exact, float)| {
        let float = (float * (1 << 29) as f32) as i32;
        exact.to_q29().abs_diff(float)
    });
    let margin = inverse
        .margin()
        .abs_diff((floating.margin * (1 << 30) as f32) as i32);
    if apart.any(|it| it > APART) || margin > 2 * APART {
        return Err(Failure::Apart);
    }
    Ok(())
}
