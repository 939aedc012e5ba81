//! The chain of limits: which torques each motor may produce now, and what says so.

use eel_kinematics::{Bounds, Side};
use eel_protocol::LimitCode;
use eel_units::{Angle, AngularVelocity, Temperature, Torque, Voltage};

use crate::current::Electrical;
use crate::io::Sample;
use crate::settings::{Limits, Ramp, Travel};

/// Length of the ramp at the end of a motor's travel: 50 mrad, as a shift from Q29.
const TRAVEL_RAMP: Angle = Angle::from_milliradians(50);
/// det A below which torque ramps down, and at which it is a fault: 0.60 and 0.45 of home's, Q30. In the
/// workspace of the paper it is 0.67 and more.
pub const SINGULARITY: Ramp<i32> = Ramp {
    start: 644_245_094,
    end: 483_183_821,
};
/// One in Q15.
const ONE: i64 = 1 << 15;
/// Share of the peak torque that what is hot still may brake with, Q15: a quarter.
const BRAKING_FLOOR: i64 = ONE / 4;

/// The bounds of one motor, each with its reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MotorBounds {
    /// What the torque may be.
    pub torque: Bounds,
    low_code: LimitCode,
    high_code: LimitCode,
}

impl MotorBounds {
    /// Starts from a symmetric bound.
    fn symmetric(bound: Torque, code: LimitCode) -> Self {
        let bound = bound.abs();
        Self {
            torque: Bounds {
                low: -bound,
                high: bound,
            },
            low_code: code,
            high_code: code,
        }
    }

    /// Lowers the upper bound, but not below nothing.
    fn cap_high(&mut self, high: Torque, code: LimitCode) {
        let high = high.bounded(Torque::ZERO, Torque::MAX);
        if high < self.torque.high {
            self.torque.high = high;
            self.high_code = code;
        }
    }

    /// Raises the lower bound, but not above nothing.
    fn cap_low(&mut self, low: Torque, code: LimitCode) {
        let low = low.bounded(Torque::MIN, Torque::ZERO);
        if low > self.torque.low {
            self.torque.low = low;
            self.low_code = code;
        }
    }

    /// Lowers the bound of what drives: torque along the speed, and both ways at rest.
    fn cap_driving(&mut self, cap: Torque, speed: AngularVelocity, code: LimitCode) {
        let Bounds { low, high } = self.torque;
        self.cap_high(eased(cap, high, backward(speed)), code);
        self.cap_low(-eased(cap, -low, backward(-speed)), code);
    }

    /// Lowers the bound of what brakes: torque against the speed, not at rest.
    fn cap_braking(&mut self, cap: Torque, speed: AngularVelocity, code: LimitCode) {
        let Bounds { low, high } = self.torque;
        self.cap_high(eased(cap, high, ONE - backward(speed)), code);
        self.cap_low(-eased(cap, -low, ONE - backward(-speed)), code);
    }

    fn cap_both(&mut self, bound: Torque, code: LimitCode) {
        self.cap_high(bound, code);
        self.cap_low(-bound, code);
    }

    /// Returns the reason why the torque could not pass a side.
    pub fn reason(&self, side: Option<Side>) -> LimitCode {
        match side {
            None => LimitCode::None,
            Some(Side::Low) => self.low_code,
            Some(Side::High) => self.high_code,
        }
    }
}

/// What bounds a motor and changes slowly: the peak, and the temperatures of board, housing and winding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Standing {
    driving: Torque,
    /// What brakes is never taken away whole.
    braking: Torque,
    code: LimitCode,
}

impl Standing {
    /// Nothing, until it is known.
    pub const NONE: Self = Self {
        driving: Torque::ZERO,
        braking: Torque::ZERO,
        code: LimitCode::Off,
    };

    /// Returns the bounds of a motor whose housing is so warm and whose winding allows a torque.
    pub fn new(limits: &Limits, board: Temperature, housing: Temperature, winding: Torque) -> Self {
        let peak = limits.peak_torque.abs();
        let derate = |ramp, value| scaled(peak, ONE - share(ramp, value));
        let mut least = (peak, LimitCode::Peak);
        for (bound, code) in [
            (derate(limits.board_hot, board), LimitCode::Board),
            (derate(limits.motor_hot, housing), LimitCode::Thermal),
            (winding, LimitCode::Thermal),
        ] {
            if bound < least.0 {
                least = (bound, code);
            }
        }
        let (driving, code) = least;
        Self {
            driving,
            braking: driving.max(scaled(peak, BRAKING_FLOOR)),
            code,
        }
    }
}

/// What the bounds of all motors follow from.
#[derive(Clone, Copy, Debug)]
pub struct Situation<'a> {
    /// What was measured.
    pub sample: &'a Sample,
    /// What changes slowly.
    pub standing: &'a [Standing; 3],
    /// Angle of each motor.
    pub angles: [Angle; 3],
    /// Speed of each motor.
    pub speeds: [AngularVelocity; 3],
    /// What the mode or the stop ramp allows; `None` for no cap.
    pub command_cap: Option<Torque>,
    /// det A, Q30.
    pub det_a: i32,
}

/// Returns what each motor may produce.
pub fn bounds(limits: &Limits, motor: &Electrical, now: &Situation<'_>) -> [MotorBounds; 3] {
    let supply = now.sample.supply;
    let low = falling(limits.supply_low.end, limits.supply_low.start, supply);
    let high = ONE - falling(limits.supply_high.start, limits.supply_high.end, supply);
    let mut all = core::array::from_fn(|index| {
        let standing = now.standing.get(index).unwrap_or(&Standing::NONE);
        let speed = now.speeds.get(index).copied().unwrap_or_default();
        let mut bounds = MotorBounds::symmetric(standing.braking, standing.code);
        if standing.driving < standing.braking {
            bounds.cap_driving(standing.driving, speed, standing.code);
        }
        if let Some(cap) = now.command_cap {
            bounds.cap_both(cap.abs(), LimitCode::Command);
        }
        // A supply that is too low is drawn from by what drives; one too high is fed by what brakes.
        if low < ONE {
            let cap = scaled(limits.peak_torque, low);
            bounds.cap_driving(cap, speed, LimitCode::Undervoltage);
        }
        if high < ONE {
            let cap = scaled(limits.peak_torque, high);
            bounds.cap_braking(cap, speed, LimitCode::Overvoltage);
        }
        let (reach_low, reach_high) = motor.reach(supply, speed);
        bounds.cap_low(reach_low, LimitCode::Speed);
        bounds.cap_high(reach_high, LimitCode::Speed);
        let angle = now.angles.get(index).copied().unwrap_or_default();
        if let Some(travel) = limits.travel.get(index) {
            cap_travel(&mut bounds, travel, angle, limits.peak_torque);
        }
        bounds
    });
    if now.det_a < SINGULARITY.start {
        let left = fraction(SINGULARITY.end, SINGULARITY.start, now.det_a);
        for bounds in &mut all {
            bounds.cap_both(scaled(limits.peak_torque, left), LimitCode::Singularity);
        }
    }
    all
}

/// Returns how far a motor that turns at `speed` brakes with positive torque, Q15: whole from 0.25 rad/s
/// backward, not at all at rest and forward, so that no bound jumps.
fn backward(speed: AngularVelocity) -> i64 {
    i64::from(speed.to_q24().saturating_neg() >> 7).clamp(0, ONE)
}

/// Returns the cap that is `cap` at a share of nothing and `whole` at a whole one, Q15.
fn eased(cap: Torque, whole: Torque, share: i64) -> Torque {
    cap + scaled(whole - cap, share)
}

/// Takes away the torque that leads out of the travel, within a ramp before its end.
fn cap_travel(bounds: &mut MotorBounds, travel: &Travel, angle: Angle, peak: Torque) {
    let room_above = travel.high - angle;
    let room_below = angle - travel.low;
    if room_above < TRAVEL_RAMP {
        bounds.cap_high(scaled(peak, ramp_share(room_above)), LimitCode::Travel);
    }
    if room_below < TRAVEL_RAMP {
        bounds.cap_low(-scaled(peak, ramp_share(room_below)), LimitCode::Travel);
    }
}

/// Returns the share of the travel ramp that is left, Q15.
fn ramp_share(room: Angle) -> i64 {
    let room = i64::from(room.to_q29()).max(0);
    ((room << 15) / i64::from(TRAVEL_RAMP.to_q29())).min(ONE)
}

/// Returns how far `value` is from `from` (0) to `to` (1), Q15.
fn falling(from: Voltage, to: Voltage, value: Voltage) -> i64 {
    fraction(
        from.to_millivolts(),
        to.to_millivolts(),
        value.to_millivolts(),
    )
}

/// Returns how far a temperature is from the start of a ramp (0) to its end (1), Q15.
fn share(ramp: Ramp<Temperature>, value: Temperature) -> i64 {
    fraction(
        ramp.start.to_decidegrees(),
        ramp.end.to_decidegrees(),
        value.to_decidegrees(),
    )
}

fn fraction(from: i32, to: i32, value: i32) -> i64 {
    let span = (i64::from(to) - i64::from(from)).max(1);
    let part = (i64::from(value) - i64::from(from)).clamp(0, span);
    // Nearly always it is at an end, where nothing has to be divided.
    if part == 0 {
        return 0;
    }
    if part == span {
        return ONE;
    }
    // The machine divides 32 bits itself, and no ramp is longer.
    match u16::try_from(span) {
        Ok(span) => i64::from(((part as u32) << 15) / u32::from(span).max(1)),
        Err(_) => (part << 15) / span,
    }
}

/// Multiplies by a share in Q15.
fn scaled(torque: Torque, share: i64) -> Torque {
    Torque::from_q24(((i64::from(torque.to_q24()) * share.clamp(0, ONE)) >> 15) as i32)
}
