//! Torque sharing: what becomes of a moment when a motor runs out.
//!
//! Three motors, three freedoms: there is no null space to play with, and clipping each motor by
//! itself turns the moment and can even flip the sign of yaw. So the moment's components are
//! granted in the order yaw, pitch, roll, each as a whole fraction of what was asked, or all three by
//! one fraction.

use eel_units::{Torque, quotient_q30};

use crate::jacobian::Jacobian;
use crate::vector::{Vector, dot, wide};

/// The torques a motor may give at this moment.
///
/// `low` ≤ 0 ≤ `high` is expected. Zero torque is always allowed: a bound on the wrong side of zero
/// counts as zero, so that crossed bounds leave no more than the one on its own side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// The most negative torque.
    pub low: Torque,
    /// The most positive torque.
    pub high: Torque,
}

/// The side of its bounds on which a motor ran out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// At [`Bounds::low`].
    Low,
    /// At [`Bounds::high`].
    High,
}

/// What gives way when a motor runs out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Policy {
    /// Roll before pitch before yaw: yaw gets the largest feasible fraction, then pitch, then roll.
    #[default]
    YawFirst,
    /// All by one fraction: the moment keeps its direction.
    KeepDirection,
}

/// How a moment was shared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shared {
    /// The motors' torques, each within its bounds.
    pub torque: [Torque; 3],
    /// The moment those torques make, about x (yaw), y (pitch), z (roll).
    ///
    /// Each component has the sign of what was asked, and is at most as large.
    pub achieved: [Torque; 3],
    /// What was asked and is not achieved.
    pub unallocated: [Torque; 3],
    /// For each motor, the side on which it kept a component from being granted whole.
    pub bound: [Option<Side>; 3],
}

/// All of it, as a fraction in Q30.
const WHOLE: i32 = 1 << 30;

/// What each component of a moment must be below to be shared as it is: 8 N·m in Q24, a power of two.
pub(crate) const MOMENT_LIMIT: i32 = 1 << 27;

/// By how much a component may pass a motor's bound without being cut for it: 0.5 µN·m in Q24.
const SLACK: u32 = 8;

impl Jacobian {
    /// Shares a moment among the motors within their bounds.
    ///
    /// A motor at its bound may be passed by 0.5 µN·m, which it then does not give: without that, a
    /// coupling of parts in 10⁹ to a motor at its bound would refuse a whole component. So the
    /// achieved moment is what the torques make to 10 µN·m, or to a part in 10⁷ of a moment beyond
    /// 8 N·m. Where nothing is bounded the torques are those of [`Jacobian::torques`] to one step.
    #[inline]
    pub fn share(&self, moment: &[Torque; 3], bounds: &[Bounds; 3], policy: Policy) -> Shared {
        match self.share_whole(moment, bounds) {
            Some(torque) => Shared {
                torque,
                achieved: *moment,
                unallocated: [Torque::ZERO; 3],
                bound: [None; 3],
            },
            None => self.share_part(moment, bounds, policy),
        }
    }

    /// Returns the torques of a moment where all of them are within their bounds.
    #[inline(always)]
    fn share_whole(&self, moment: &[Torque; 3], bounds: &[Bounds; 3]) -> Option<[Torque; 3]> {
        let asked = moment.map(Torque::to_q24);
        // Below 8 N·m, so that no motor's part of it passes 120.
        let [x, y, z] = asked.map(|component| component.wrapping_add(MOMENT_LIMIT) as u32);
        if (x | y | z) >= 2 * MOMENT_LIMIT as u32 {
            return None;
        }
        let [first, second, third] = self.torque_rows();
        Some([
            bounds[0].admit(dot(first, &asked))?,
            bounds[1].admit(dot(second, &asked))?,
            bounds[2].admit(dot(third, &asked))?,
        ])
    }

    /// Shares a moment that is too much for a motor.
    #[inline(never)]
    fn share_part(&self, moment: &[Torque; 3], bounds: &[Bounds; 3], policy: Policy) -> Shared {
        // Below 8 N·m, so that no motor's part of it passes 120.
        let asked = moment.map(Torque::to_q24);
        let size = asked.map(i32::unsigned_abs);
        let shift = 5u32.saturating_sub((size[0] | size[1] | size[2]).leading_zeros());
        let asked = asked.map(|component| component >> shift);
        let mut motors = bounds.each_ref().map(|bound| Motor::new(bound, shift));
        let mut granted = asked;
        match policy {
            Policy::YawFirst => self.grant_in_turn(&mut motors, &mut granted),
            Policy::KeepDirection => self.grant_alike(&mut motors, &mut granted),
        }
        let achieved = [0, 1, 2].map(|axis| {
            if granted[axis] == asked[axis] {
                moment[axis]
            } else {
                Torque::from_q24(granted[axis] << shift)
            }
        });
        Shared {
            torque: motors.each_ref().map(|motor| motor.give(shift)),
            achieved,
            unallocated: [0, 1, 2].map(|axis| moment[axis] - achieved[axis]),
            bound: motors.map(|motor| motor.bound),
        }
    }

    /// Grants yaw, then pitch, then roll, each as far as the motors still can.
    #[inline(always)]
    fn grant_in_turn(&self, motors: &mut [Motor; 3], moment: &mut [i32; 3]) {
        let rows = self.torque_rows();
        for (axis, component) in moment.iter_mut().enumerate() {
            let entry = |motor: usize| rows.get(motor).map_or(0, |row: &Vector| row[axis % 3]);
            let fraction = feasible(motors, |motor| part(entry(motor), *component));
            if fraction < WHOLE {
                *component = fraction_of(*component, fraction);
            }
            for (index, motor) in motors.iter_mut().enumerate() {
                motor.torque += part(entry(index), *component);
            }
        }
    }

    /// Grants the same fraction of all three.
    fn grant_alike(&self, motors: &mut [Motor; 3], moment: &mut [i32; 3]) {
        let rows = self.torque_rows();
        let torque = |motor: usize, moment: &Vector| {
            rows.get(motor)
                .map_or(0, |row| (dot(row, moment) >> 26) as i32)
        };
        let fraction = feasible(motors, |motor| torque(motor, moment));
        *moment = moment.map(|component| fraction_of(component, fraction));
        for (index, motor) in motors.iter_mut().enumerate() {
            motor.torque = torque(index, moment);
        }
    }
}

impl Bounds {
    /// Returns a torque of Q50 where it is within the bounds.
    #[inline(always)]
    fn admit(&self, wanted: i64) -> Option<Torque> {
        let torque = Torque::from_q24((wanted >> 26) as i32);
        if torque < self.low || torque > self.high {
            return None;
        }
        Some(torque)
    }
}

/// A motor while a moment is shared; torques in Q24 over 2^shift.
struct Motor {
    low: i32,
    high: i32,
    /// What it gives so far, within the bounds but for the slack.
    torque: i32,
    bound: Option<Side>,
}

impl Motor {
    /// Makes a motor that gives nothing yet; its bounds are rounded towards zero.
    #[inline(always)]
    fn new(bounds: &Bounds, shift: u32) -> Self {
        Self {
            low: (bounds.low.to_q24().min(0) + ((1 << shift) - 1)) >> shift,
            high: bounds.high.to_q24().max(0) >> shift,
            torque: 0,
            bound: None,
        }
    }

    /// Returns what it gives.
    #[inline(always)]
    fn give(&self, shift: u32) -> Torque {
        Torque::from_q24(self.torque.max(self.low).min(self.high) << shift)
    }
}

/// Returns the largest fraction of `wanted` that the motors can add, Q30, and notes who bounds it.
#[inline(always)]
fn feasible(motors: &mut [Motor; 3], wanted: impl Fn(usize) -> i32) -> i32 {
    let mut fraction = WHOLE;
    let mut tightest = None;
    for (index, motor) in motors.iter_mut().enumerate() {
        let wanted = wanted(index);
        let (room, side) = if wanted < 0 {
            (motor.torque.wrapping_sub(motor.low) as u32, Side::Low)
        } else {
            (motor.high.wrapping_sub(motor.torque) as u32, Side::High)
        };
        // A motor that passed its bound within the slack has no room: none, not 2³².
        let room = if room > u32::MAX - 8 * SLACK { 0 } else { room };
        let need = wanted.unsigned_abs();
        if need > room && need - room > SLACK {
            // Less the quotient's error away from zero, two steps at most.
            let feasible = quotient_q30((room + SLACK) as i32, need as i32) - 3;
            if feasible < fraction {
                fraction = feasible;
                tightest = Some((motor, side));
            }
        }
    }
    if let Some((motor, side)) = tightest {
        motor.bound = Some(side);
    }
    fraction.max(0)
}

/// Returns what a component asks of a motor: Q26 · Q24 to Q24.
#[inline(always)]
fn part(entry: i32, component: i32) -> i32 {
    (wide(entry, component) >> 26) as i32
}

/// Returns a fraction (Q30) of a component, rounded down.
#[inline(always)]
fn fraction_of(component: i32, fraction: i32) -> i32 {
    (wide(component, fraction) >> 30) as i32
}
