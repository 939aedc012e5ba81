//! From torque to current, and from current to the share of the supply that drives it.
//!
//! Once per control tick the wrist says which current each motor is to carry and which back-EMF it
//! has. The loop in [`CurrentLoop`] does the rest at 20 kHz, where the platform converts the currents:
//!
//! v = k ω + R i* + Kp (i* − i) + ∫ Ki (i* − i), within the supply.
//!
//! The feed-forward alone would settle with the winding's own L/R; Kp = ωc L makes that faster, the
//! integral takes up what resistance and back-EMF really are. What it would gather of a step of i* while
//! the winding follows is taken from it in advance, so a step doesn't overshoot; what the supply can't
//! give is taken back (back-calculation), so nothing winds up.

use eel_units::{AngularVelocity, Current, Duty, Torque, Voltage, multiply_high, saturate};

use crate::io::{Drive, Setpoint};
use crate::settings::Motor;

/// Times that [`CurrentLoop::update`] is called a second.
pub const CURRENT_LOOP_HZ: u32 = 20_000;

/// Torque constants in µN·m/A that the products below have room for: 1 mN·m/A to 100 N·m/A.
pub const TORQUE_CONSTANTS: (u32, u32) = (1_000, 100_000_000);
/// Resistances in mΩ that they have room for: 10 mΩ to 30 Ω.
pub const RESISTANCES: (u32, u32) = (10, 30_000);
/// Inductances in µH that they have room for: 1 µH to 9 mH.
pub const INDUCTANCES: (u32, u32) = (1, 9_000);
/// Supplies in mV that a duty is computed for: 1 V to 60 V.
const SUPPLIES_MV: (i32, i32) = (1_000, 60_000);

/// The loop counts voltage in sixteenths of a millivolt.
const UNITS: i32 = 16;
/// Units per µA for 1 mΩ, Q32: 16 · 10⁻⁶ · 2³².
const PER_MILLIOHM: u64 = 68_719;
/// ωc in 1/s, times 1000: 2π · 500 Hz.
const BANDWIDTH_MILLI: u64 = 3_141_593;
/// Ki Δt as a share of the resistance, in 10⁻⁶: ωc Δt / 4, slower than the winding by a factor of four.
const INTEGRAL_SHARE: u64 = 39_270;
/// Ki Δt / Kp = Δt R / 4 L, in 10⁻³ for R/L in mΩ/µH: 12.5.
const RETURN_MILLI: u64 = 12_500;

/// Δt R/L in 10⁻³ for R/L in mΩ/µH: 50.
const DECAY_MILLI: u64 = 50;
/// Periods in 10⁻³ that the conversion's delay adds, and half of one for the sum of a sampled decay.
const DELAY_MILLI: u64 = 1_500;

/// A motor's constants, prepared for the control tick.
#[derive(Clone, Copy, Debug)]
pub struct Electrical {
    /// Current per torque: µA per N·m.
    microamps_per_newton_metre: i64,
    /// Torque per current: Q24 N·m per µA, in Q20.
    torque_per_microamp: i64,
    /// Voltage per speed: mV per Q24 rad/s, in Q34.
    millivolts_per_speed: i64,
    /// Torque per voltage: Q24 N·m per mV.
    torque_per_millivolt: i64,
    current_limit: Current,
}

impl Electrical {
    /// Prepares the constants; what is out of range is moved to its end.
    pub const fn new(motor: &Motor) -> Self {
        let constant = within(motor.torque_constant, TORQUE_CONSTANTS) as i64;
        let resistance = within(motor.resistance, RESISTANCES) as i64;
        Self {
            microamps_per_newton_metre: 1_000_000_000_000 / constant,
            // 2⁴⁴ / 10¹² = 17.592186.
            torque_per_microamp: constant * 17_592_186 / 1_000_000,
            millivolts_per_speed: (constant << 10) / 1_000,
            // k/R: µN·m/A over mΩ is 10⁻⁶ N·m per mV, times 2²⁴.
            torque_per_millivolt: (constant << 24) / resistance / 1_000_000,
            current_limit: motor.current_limit,
        }
    }

    /// Returns the torque of a current.
    pub fn torque(&self, current: Current) -> Torque {
        let current = i64::from(current.to_microamps());
        Torque::from_q24(saturate((current * self.torque_per_microamp) >> 20))
    }

    /// Returns the most torque forward and backward that `supply` drives at `speed`, and that the
    /// bridge's current limit allows.
    pub fn reach(&self, supply: Voltage, speed: AngularVelocity) -> (Torque, Torque) {
        let emf = self.back_emf(speed);
        let supply = i64::from(supply.to_millivolts()).max(0);
        let limit = self.torque(self.current_limit);
        let low = Torque::from_q24(saturate((-supply - emf) * self.torque_per_millivolt));
        let high = Torque::from_q24(saturate((supply - emf) * self.torque_per_millivolt));
        (low.bounded(-limit, limit), high.bounded(-limit, limit))
    }

    /// Returns what the current loop is to do for a torque at a speed.
    pub fn setpoint(&self, torque: Torque, speed: AngularVelocity) -> Setpoint {
        let current = (i64::from(torque.to_q24()) * self.microamps_per_newton_metre) >> 24;
        let limit = self.current_limit;
        Setpoint {
            current: Current::from_microamps(saturate(current)).bounded(-limit, limit),
            emf: Voltage::from_millivolts(saturate(self.back_emf(speed))),
        }
    }

    fn back_emf(&self, speed: AngularVelocity) -> i64 {
        (i64::from(speed.to_q24()) * self.millivolts_per_speed) >> 34
    }
}

/// What a bridge does until the next turn of the current loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Switching {
    /// All switches open.
    Off,
    /// Low sides on.
    Brake,
    /// This share of the supply, positive with positive torque.
    Duty(Duty),
}

/// The current loop of three motors.
#[derive(Clone, Debug)]
pub struct CurrentLoop {
    gains: LoopGains,
    channels: [Channel; 3],
    /// The supply, in units.
    supply: i32,
    /// Q15 duty per unit, Q28.
    duty_per_unit: i32,
    /// The current at which a bridge is switched off.
    hard_limit: Current,
}

/// Gains in units per µA, Q32; the last in units per unit.
#[derive(Clone, Copy, Debug)]
struct LoopGains {
    resistance: i32,
    proportional: i32,
    integral: i32,
    /// What the integral gathers of a step of i* until the winding has followed.
    rise: i32,
    back: i32,
}

/// One motor in the loop.
#[derive(Clone, Copy, Debug)]
struct Channel {
    drive: Drive,
    /// k ω + R i* within the supply, units.
    feed: i32,
    /// Units.
    integral: i32,
    /// Whether the current passed its hard limit since the bridge was last told to be off.
    tripped: bool,
}

impl Channel {
    const OFF: Self = Self {
        drive: Drive::Off,
        feed: 0,
        integral: 0,
        tripped: false,
    };
}

impl CurrentLoop {
    /// Makes a loop whose bridges are off.
    pub const fn new(motor: &Motor) -> Self {
        let resistance = within(motor.resistance, RESISTANCES) as u64;
        let inductance = within(motor.inductance, INDUCTANCES) as u64;
        let integral = resistance * INTEGRAL_SHARE * PER_MILLIOHM / 1_000_000;
        // A step's error falls as e^(−t (R/L + ωc)); this is its sum in periods.
        let decay_milli = resistance * DECAY_MILLI / inductance + BANDWIDTH_MILLI / 20_000;
        let periods_milli = 1_000_000 / decay_milli + DELAY_MILLI;
        Self {
            gains: LoopGains {
                resistance: at_most(resistance * PER_MILLIOHM),
                // µH / s is mΩ / 1000; the bandwidth has its own thousand.
                proportional: at_most(inductance * BANDWIDTH_MILLI / 1_000_000 * PER_MILLIOHM),
                integral: at_most(integral),
                rise: at_most(integral * periods_milli / 1_000),
                back: at_most(((resistance * RETURN_MILLI) << 32) / inductance / 1_000_000),
            },
            channels: [Channel::OFF; 3],
            supply: 0,
            duty_per_unit: 0,
            hard_limit: hard_limit(motor.current_limit),
        }
    }

    /// Tells whose current passed the hard limit: that bridge is off until it is told to be.
    pub fn tripped(&self) -> [bool; 3] {
        self.channels.each_ref().map(|channel| channel.tripped)
    }

    /// Takes what a control tick decides and the supply that it measured.
    pub fn set(&mut self, drives: &[Drive; 3], supply: Voltage) {
        let (least, most) = SUPPLIES_MV;
        let supply = supply.to_millivolts().max(least).min(most);
        self.supply = supply * UNITS;
        // 32767 · 2¹⁶ / mV is 32767 · 2²⁰ / units; eight bits more make Q28.
        self.duty_per_unit = ((32_767 << 16) / supply) << 8;
        for (channel, drive) in self.channels.iter_mut().zip(drives) {
            match drive {
                Drive::Current(_) if channel.tripped => {}
                Drive::Current(Setpoint { current, emf }) => {
                    let drop = multiply_high(current.to_microamps(), self.gains.resistance);
                    let feed = emf
                        .to_millivolts()
                        .saturating_mul(UNITS)
                        .saturating_add(drop);
                    let before = match channel.drive {
                        Drive::Current(before) => before.current,
                        Drive::Off | Drive::Brake => Current::ZERO,
                    };
                    // What the integral gathers while the current follows would be overshoot.
                    let step = (*current - before).to_microamps();
                    channel.integral = channel
                        .integral
                        .saturating_sub(multiply_high(step, self.gains.rise));
                    channel.drive = *drive;
                    // What the supply can't give is not for the integral to take back.
                    channel.feed = feed.min(self.supply).max(-self.supply);
                }
                Drive::Off | Drive::Brake => {
                    *channel = Channel {
                        drive: *drive,
                        ..Channel::OFF
                    }
                }
            }
        }
    }

    /// Takes the currents of this moment and returns what the bridges do in the next period.
    #[inline]
    pub fn update(&mut self, measured: [Current; 3]) -> [Switching; 3] {
        let mut all = [Switching::Off; 3];
        let channels = self.channels.iter_mut().zip(measured).zip(&mut all);
        for ((channel, measured), switching) in channels {
            *switching = match channel.drive {
                Drive::Off => Switching::Off,
                Drive::Brake => Switching::Brake,
                Drive::Current(_) if measured.abs() > self.hard_limit => {
                    *channel = Channel {
                        tripped: true,
                        ..Channel::OFF
                    };
                    Switching::Off
                }
                Drive::Current(Setpoint { current, .. }) => {
                    let error = current - measured;
                    let voltage = channel.advance(&self.gains, self.supply, error);
                    // Q28 × 2⁴ units: the high word of the product is the duty.
                    let duty = multiply_high(voltage << 4, self.duty_per_unit);
                    Switching::Duty(Duty::from_q15(duty))
                }
            };
        }
        all
    }
}

impl Channel {
    /// Returns the voltage for the next period, in units, within the supply.
    #[inline]
    fn advance(&mut self, gains: &LoopGains, supply: i32, error: Current) -> i32 {
        let error = error.to_microamps();
        let voltage = self
            .feed
            .saturating_add(self.integral)
            .saturating_add(multiply_high(error, gains.proportional));
        let held = voltage.min(supply).max(-supply);
        let change = multiply_high(error, gains.integral)
            .saturating_add(multiply_high(held.saturating_sub(voltage), gains.back));
        self.integral = self
            .integral
            .saturating_add(change)
            .min(supply)
            .max(-supply);
        held
    }
}

/// Returns the current that is out of hand: half as much again as the bridge is ever told.
pub const fn hard_limit(limit: Current) -> Current {
    let limit = limit.to_microamps();
    Current::from_microamps(limit.saturating_add(limit / 2))
}

const fn within(value: u32, (least, most): (u32, u32)) -> u32 {
    if value < least {
        least
    } else if value > most {
        most
    } else {
        value
    }
}

/// Returns a gain as far as there is room for it.
const fn at_most(gain: u64) -> i32 {
    if gain > i32::MAX as u64 {
        i32::MAX
    } else {
        gain as i32
    }
}

#[cfg(test)]
mod tests;
