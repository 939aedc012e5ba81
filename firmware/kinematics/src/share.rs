//! Torque sharing: what becomes of a moment when a motor runs out.
//!
//! Three motors, three freedoms: there is no null space to play with, and clipping each motor by
//! itself turns the moment and can even flip the sign of yaw. So the moment's components are
//! granted in the order yaw, pitch, roll, each as a whole fraction of what was asked.

use eel_units::{Torque, divide_q31, round_shift};

use crate::jacobian::Jacobian;

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

/// By how much a component may pass a motor's bound without being cut for it: 0.5 µN·m in Q24.
const SLACK: i64 = 8;

impl Jacobian {
    /// Shares a moment among the motors within their bounds, yaw before pitch before roll.
    ///
    /// Yaw is scaled to the largest feasible fraction; with that fixed, pitch; then roll. A motor
    /// at its bound may be passed by 0.5 µN·m, which it then does not give: without that, a
    /// coupling of parts in 10⁹ to a motor at its bound would refuse a whole component. So the
    /// achieved moment is what the torques make to 10 µN·m. Where nothing is bounded the torques equal
    /// those of [`Jacobian::torques`] to two steps.
    pub fn share(&self, moment: [Torque; 3], bounds: &[Bounds; 3]) -> Shared {
        let rows = self.torque_rows();
        let limits = bounds.map(|bound| {
            (
                i64::from(bound.low.to_q24().min(0)),
                i64::from(bound.high.to_q24().max(0)),
            )
        });
        let mut torque = [0i64; 3];
        let mut achieved = [Torque::ZERO; 3];
        let mut bound = [None; 3];
        for axis in 0..3 {
            let asked = i64::from(moment[axis].to_q24());
            // Q27 · Q24 to Q24; within 2³¹ · 8.5.
            let wanted = rows.map(|row| (i64::from(row[axis]) * asked + (1 << 26)) >> 27);
            let mut fraction = WHOLE;
            let mut least = None;
            for motor in 0..3 {
                let (low, high) = limits[motor];
                let (room, need, side) = if wanted[motor] < 0 {
                    (torque[motor] - low + SLACK, -wanted[motor], Side::Low)
                } else {
                    (high - torque[motor] + SLACK, wanted[motor], Side::High)
                };
                if need > room {
                    let feasible = fraction_of(room, need);
                    if feasible < fraction {
                        fraction = feasible;
                        least = Some((motor, side));
                    }
                }
            }
            if let Some((motor, side)) = least
                && let Some(entry) = bound.get_mut(motor)
            {
                *entry = Some(side);
            }
            for motor in 0..3 {
                let (low, high) = limits[motor];
                // |wanted · fraction| is at most the room, 2³², in Q30.
                let given = (wanted[motor] * i64::from(fraction) + (1 << 29)) >> 30;
                // The fraction keeps the bounds but for the slack.
                torque[motor] = (torque[motor] + given).max(low).min(high);
            }
            achieved[axis] = Torque::from_q24(round_shift::<30>(asked * i64::from(fraction)));
        }
        let unallocated = [0, 1, 2].map(|axis| moment[axis] - achieved[axis]);
        // Within the limits, which are i32.
        Shared {
            torque: torque.map(|raw| Torque::from_q24(raw as i32)),
            achieved,
            unallocated,
            bound,
        }
    }
}

/// Returns the fraction `room / need` in Q30, never above it, for `room` < `need`.
fn fraction_of(room: i64, need: i64) -> i32 {
    let room = room.max(0);
    // At most 31 bits each; the numerator rounded down, the divisor up.
    let shift = 34u32.saturating_sub(need.leading_zeros());
    let room = room >> shift;
    let need = (need >> shift) + i64::from(shift > 0);
    // Q31, less the quotient's error of 1.3e-9 (2.8 steps), to Q30.
    (divide_q31(room as i32, need as i32) >> 1)
        .saturating_sub(2)
        .max(0)
}
