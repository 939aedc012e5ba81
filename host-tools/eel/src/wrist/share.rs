//! `eel wrist torque`: motor torques for a moment, within bounds.

use std::io::Write;

use anyhow::Result;
use eel_kinematics::design::Matrix3;
use eel_kinematics::{self as kinematics, Bounds, Direct, Side};
use eel_units::Torque;
use serde::Serialize;

use super::args::{self, Architecture, Kernel, Policy};
use super::fixed;
use super::number::{Unit, columns};
use super::place::Place;
use super::refused;

/// By how much a component may pass a bound before it is cut, in N·m: rounding.
const SLACK: f64 = 1e-12;

/// Bounds of a motor, low and high, in N·m.
type Pair = [f64; 2];

/// A moment shared among the motors; all in N·m.
#[derive(Clone)]
struct Shared {
    tau: [f64; 3],
    achieved: [f64; 3],
    unallocated: [f64; 3],
    bound: [Option<&'static str>; 3],
}

#[derive(Serialize)]
struct Answer {
    architecture: Architecture,
    kernel: Kernel,
    policy: Policy,
    tau: [f64; 3],
    achieved: [f64; 3],
    unallocated: [f64; 3],
    bound: [Option<&'static str>; 3],
    tau_f64: [f64; 3],
    tau_fixed: Option<[f64; 3]>,
    fixed_refusal: Option<&'static str>,
}

/// Answers `eel wrist torque`.
pub fn run(out: &mut dyn Write, asked: &args::Torque) -> Result<()> {
    let common = &asked.at.common;
    let Ok(moment) = <[f64; 3]>::try_from(asked.moment.clone()) else {
        return Err(refused(format!(
            "--moment takes three numbers in N·m, as in --moment 1,0,0; {} came",
            asked.moment.len()
        )));
    };
    let limits = limits(&asked.limits)?;
    let place = Place::find(&asked.at, Unit::of(&common.subject))?;
    let Some(map) = place.jacobians.torque_map() else {
        return Err(refused(
            "A is singular at this pose, no torques make a moment; move the pose a little",
        ));
    };
    let exact = share(&map, moment, limits, asked.policy);
    let choice = fixed::choose(common, None, || {
        share_fixed(&fixed::at(place.pose)?, moment, limits, asked.policy)
    })?;
    let shared = match (&choice.fixed, choice.used) {
        (Some(shared), Kernel::Fixed) => shared,
        _ => &exact,
    };
    if common.subject.json {
        let answer = Answer {
            architecture: common.subject.architecture,
            kernel: choice.used,
            policy: asked.policy,
            tau: shared.tau,
            achieved: shared.achieved,
            unallocated: shared.unallocated,
            bound: shared.bound,
            tau_f64: exact.tau,
            tau_fixed: choice.fixed.as_ref().map(|shared| shared.tau),
            fixed_refusal: choice.refusal,
        };
        serde_json::to_writer(&mut *out, &answer)?;
        return Ok(writeln!(out)?);
    }
    writeln!(out, "{}, N·m", common.subject.architecture.name())?;
    writeln!(
        out,
        "               {:>14}{:>14}{:>14}",
        "motor 1", "motor 2", "motor 3"
    )?;
    if let Some(fixed) = &choice.fixed {
        writeln!(out, "  tau, fixed   {}", columns(&fixed.tau, 7))?;
    }
    writeln!(out, "  tau, f64     {}", columns(&exact.tau, 7))?;
    let bound = shared
        .bound
        .map(|side| format!("{:>14}", side.unwrap_or("-")));
    writeln!(out, "  bound        {}", bound.concat())?;
    writeln!(
        out,
        "               {:>14}{:>14}{:>14}",
        "x (yaw)", "y (pitch)", "z (roll)"
    )?;
    writeln!(out, "  achieved     {}", columns(&shared.achieved, 7))?;
    writeln!(out, "  unallocated  {}", columns(&shared.unallocated, 7))?;
    if let Some(reason) = choice.refusal {
        writeln!(out, "  the kernel does not answer: {reason}")?;
    }
    Ok(())
}

/// Returns one pair of bounds for each motor, where any are given.
fn limits(numbers: &[f64]) -> Result<Option<[Pair; 3]>> {
    let pairs = match *numbers {
        [] => return Ok(None),
        [low, high] => [[low, high]; 3],
        [a, b, c, d, e, f] => [[a, b], [c, d], [e, f]],
        _ => {
            return Err(refused(format!(
                "--limits takes LOW,HIGH for all motors or three such pairs (six numbers); {} came",
                numbers.len()
            )));
        }
    };
    if pairs.iter().any(|[low, high]| *low > 0.0 || *high < 0.0) {
        return Err(refused(
            "--limits needs LOW ≤ 0 ≤ HIGH for every motor: zero torque is always allowed",
        ));
    }
    Ok(Some(pairs))
}

/// Shares a moment in double precision, as the kernel does.
fn share(
    map: &Matrix3<f64>,
    moment: [f64; 3],
    limits: Option<[Pair; 3]>,
    policy: Policy,
) -> Shared {
    let limits = limits.unwrap_or([[f64::NEG_INFINITY, f64::INFINITY]; 3]);
    let mut tau = [0.0f64; 3];
    let mut achieved = [0.0; 3];
    let mut bound = [None; 3];
    // What is granted together: one component after the other, or all at once.
    let groups: &[&[usize]] = match policy {
        Policy::YawFirst => &[&[0], &[1], &[2]],
        Policy::KeepDirection => &[&[0, 1, 2]],
    };
    for group in groups {
        let wanted = [0, 1, 2].map(|motor| {
            let parts = group.iter().map(|&axis| map[(motor, axis)] * moment[axis]);
            parts.sum::<f64>()
        });
        let mut fraction = 1.0;
        let mut least = None;
        for motor in 0..3 {
            let [low, high] = limits[motor];
            let (room, side) = if wanted[motor] < 0.0 {
                (tau[motor] - low, "low")
            } else {
                (high - tau[motor], "high")
            };
            let need = wanted[motor].abs();
            if need > room + SLACK && room.max(0.0) / need < fraction {
                fraction = room.max(0.0) / need;
                least = Some((motor, side));
            }
        }
        if let Some((motor, side)) = least {
            bound[motor] = Some(side);
        }
        for motor in 0..3 {
            let [low, high] = limits[motor];
            tau[motor] = (tau[motor] + wanted[motor] * fraction).max(low).min(high);
        }
        for &axis in *group {
            achieved[axis] = moment[axis] * fraction;
        }
    }
    Shared {
        tau,
        achieved,
        unallocated: [0, 1, 2].map(|axis| moment[axis] - achieved[axis]),
        bound,
    }
}

/// Shares a moment as the firmware does.
fn share_fixed(
    found: &Direct,
    moment: [f64; 3],
    limits: Option<[Pair; 3]>,
    policy: Policy,
) -> Result<Shared, &'static str> {
    let [x, y, z] = moment;
    let moment = [fixed::torque(x)?, fixed::torque(y)?, fixed::torque(z)?];
    let mut bounds = [Bounds {
        low: Torque::MIN,
        high: Torque::MAX,
    }; 3];
    for (bound, [low, high]) in bounds.iter_mut().zip(limits.into_iter().flatten()) {
        *bound = Bounds {
            low: fixed::bound(low)?,
            high: fixed::bound(high)?,
        };
    }
    let policy = match policy {
        Policy::YawFirst => kinematics::Policy::YawFirst,
        Policy::KeepDirection => kinematics::Policy::KeepDirection,
    };
    let shared = found.jacobian.share(&moment, &bounds, policy);
    Ok(Shared {
        tau: shared.torque.map(fixed::newton_metres),
        achieved: shared.achieved.map(fixed::newton_metres),
        unallocated: shared.unallocated.map(fixed::newton_metres),
        bound: shared.bound.map(|side| match side? {
            Side::Low => Some("low"),
            Side::High => Some("high"),
        }),
    })
}
