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

/// By how much a component may pass a motor's bound without being cut for it, in Q20: 1 µN·m.
const SLACK: i32 = 1;

impl Jacobian {
    /// Shares a moment among the motors within their bounds.
    ///
    /// A motor at its bound may be passed by 1 µN·m, which it then does not give: without that, a
    /// coupling of parts in 10⁹ to a motor at its bound would refuse a whole component. So the
    /// achieved moment is what the torques make to 10 µN·m in the paper's workspace, whatever its size,
    /// and to 40 µN·m at the least margins. A component of a few steps may count as granted whole while a
    /// motor is named. Where nothing is bounded the torques are those of [`Jacobian::torques`] to one step.
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
        let asked = moment.map(Torque::to_q24);
        let mut motors = Motors::new(bounds);
        let mut granted = asked;
        match policy {
            Policy::YawFirst => {
                for axis in 0..3 {
                    let mut alone = [0; 3];
                    alone[axis] = asked[axis];
                    self.grant(&mut motors, &mut alone);
                    granted[axis] = alone[axis];
                }
            }
            Policy::KeepDirection => self.grant(&mut motors, &mut granted),
        }
        let achieved = granted.map(Torque::from_q24);
        Shared {
            torque: [0, 1, 2].map(|motor| motors.give(motor)),
            achieved,
            unallocated: [0, 1, 2].map(|axis| moment[axis] - achieved[axis]),
            bound: motors.bound,
        }
    }

    /// Cuts a moment (Q24) to the fraction of it that the motors still can, and lets them give that.
    ///
    /// One place for both policies, out of line: yaw first calls it for each axis alone.
    #[inline(never)]
    fn grant(&self, motors: &mut Motors, moment: &mut Vector) {
        // Q50 to Q20: within 1920 N·m.
        let parts = self
            .torque_rows()
            .map(|row| (dot(&row, moment) >> 30) as i32);
        let (mut fraction, mut tightest) = (WHOLE, 0);
        for (index, &wanted) in parts.iter().enumerate() {
            let feasible = motors.feasible(index, wanted);
            if feasible < fraction {
                (fraction, tightest) = (feasible, index);
            }
        }
        for index in 0..3 {
            moment[index] = fraction_of(moment[index], fraction);
            motors.torque[index] += fraction_of(parts[index], fraction);
        }
        if fraction < WHOLE {
            motors.bound[tightest] = Some(if parts[tightest] < 0 {
                Side::Low
            } else {
                Side::High
            });
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

/// The motors while a moment is shared; torques in Q20, which holds what any moment asks.
struct Motors {
    low: Vector,
    high: Vector,
    /// What they give so far, within the bounds but for the slack.
    torque: Vector,
    bound: [Option<Side>; 3],
}

impl Motors {
    /// Makes motors that give nothing yet; their bounds are rounded towards zero.
    #[inline(always)]
    fn new(bounds: &[Bounds; 3]) -> Self {
        Self {
            low: [0, 1, 2].map(|k| (bounds[k].low.to_q24().min(0) + 15) >> 4),
            high: [0, 1, 2].map(|k| bounds[k].high.to_q24().max(0) >> 4),
            torque: [0; 3],
            bound: [None; 3],
        }
    }

    /// Returns what a motor gives.
    #[inline(always)]
    fn give(&self, index: usize) -> Torque {
        let held = self.torque[index]
            .max(self.low[index])
            .min(self.high[index]);
        Torque::from_q24(held << 4)
    }

    /// Returns the largest fraction of `wanted` that a motor can add, Q30.
    ///
    /// Out of line: three calls are smaller than three copies.
    #[inline(never)]
    fn feasible(&self, index: usize, wanted: i32) -> i32 {
        let torque = self.torque[index];
        let room = if wanted < 0 {
            torque - self.low[index]
        } else {
            self.high[index] - torque
        };
        // A motor may have passed its bound within the slack.
        let room = room.max(0) + SLACK;
        let need = wanted.abs();
        if need <= room {
            return WHOLE;
        }
        // Less the quotient's error away from zero, two steps at most.
        (quotient_q30(room, need) - 2).max(0)
    }
}

/// Returns a fraction (Q30) of a number, rounded down: never of the other sign, never larger.
#[inline(always)]
fn fraction_of(number: i32, fraction: i32) -> i32 {
    (wide(number, fraction) >> 30) as i32
}
