//! How warm a motor is inside, and which current that still allows.
//!
//! Two nodes, winding and housing: the copper loss warms the winding, which warms the housing, which
//! warms the water. The housing is measured too, and the model follows the thermistor while it reads
//! something plausible. The bound is the current whose loss lets the winding approach its limit with a
//! time constant of 4 s: far below it more than the bridge gives, at the limit exactly what flows off,
//! so that a stalled motor settles at its continuous current from below.

use eel_units::{Current, Duration, Instant, Temperature, root_q30};

use crate::settings::{Motor, ThermalData};

/// How far above its limit a winding is a fault: 10 K.
pub const FAULT_MARGIN: Temperature = Temperature::from_decidegrees(100);

/// Temperatures of a housing, in 0.1 °C, that a thermistor in order reads.
const PLAUSIBLE: (i32, i32) = (-400, 1_500);
/// Share of the difference from the thermistor that each step takes over.
const FOLLOWED: i64 = 32;
/// µK in 0.1 K.
const TENTH: i64 = 100_000;
/// Temperature at which the resistance of the settings holds, µ°C.
const REFERENCE: i64 = 25_000_000;
/// Rise of copper's resistance, 10⁻⁶/K.
const COPPER: i64 = 3_930;
/// With which time constant a winding approaches its limit, ms.
const APPROACH_MS: i64 = 4_000;
/// Share of the way from housing to limit at which a winding is taken to be at power-up.
const COLD_START: (i64, i64) = (4, 5);
/// Longest step, µs; after a longer pause the model goes on as if it had been this.
const LONGEST_STEP: u32 = 100_000;
/// Most power that counts, µW.
const MOST_POWER: i64 = 1_000_000_000;
/// Length of the temperatures of a motor as bytes.
pub const HEAT_BYTES: usize = 8;
/// Range of the temperatures, µ°C: −100 °C to 200 °C; hotter, no winding lasts.
const RANGE: (i64, i64) = (-100_000_000, 200_000_000);

/// The model of one motor.
#[derive(Clone, Copy, Debug)]
pub struct Thermal {
    /// µ°C.
    winding: i64,
    housing: i64,
    /// Sum of the squares of currents in 1.024 mA, and how many.
    squares: u64,
    count: u32,
    last: Option<Instant>,
    /// Whether the temperatures are those of before a start.
    is_warm: bool,
}

impl Thermal {
    /// Starts without knowing anything.
    pub const fn new() -> Self {
        Self {
            winding: 0,
            housing: 0,
            squares: 0,
            count: 0,
            last: None,
            is_warm: false,
        }
    }

    /// Returns the temperatures for a start that follows soon.
    pub fn to_bytes(self) -> [u8; HEAT_BYTES] {
        // The range is within 32 bits; before the first step both are 0 and begin anew.
        let [a, b, c, d] = (self.winding as i32).to_le_bytes();
        let [e, f, g, h] = (self.housing as i32).to_le_bytes();
        [a, b, c, d, e, f, g, h]
    }

    /// Goes on from temperatures that were kept; of none at all, it begins as ever.
    pub fn from_bytes([a, b, c, d, e, f, g, h]: [u8; HEAT_BYTES]) -> Self {
        let (least, most) = RANGE;
        let warmth = |bytes| i64::from(i32::from_le_bytes(bytes)).clamp(least, most);
        let (winding, housing) = (warmth([a, b, c, d]), warmth([e, f, g, h]));
        Self {
            winding,
            housing,
            is_warm: (winding, housing) != (0, 0),
            ..Self::new()
        }
    }

    /// Takes the current of a control tick.
    #[inline]
    pub fn take(&mut self, current: Current) {
        let part = u64::from((current.to_microamps() >> 10).unsigned_abs());
        // Below 2⁴², and taken long before there are 2²² of them.
        self.squares = self.squares.wrapping_add(part * part);
        self.count = self.count.wrapping_add(1);
    }

    /// Goes on to `now`, with what the thermistor of the housing reads.
    pub fn advance(&mut self, now: Instant, motor: &Motor, measured: Temperature) {
        let data = &motor.thermal;
        let measured = measured.to_decidegrees();
        let (least, most) = PLAUSIBLE;
        let measured = (least..=most)
            .contains(&measured)
            .then(|| i64::from(measured) * TENTH);
        let Some(last) = self.last.replace(now) else {
            if !self.is_warm {
                self.begin(data, measured);
            }
            return;
        };
        let step = i64::from(
            now.since(last)
                .min(Duration::from_micros(LONGEST_STEP))
                .to_micros(),
        );
        let loss = self.take_loss(motor);
        let inwards = flow(self.winding - self.housing, data.winding_resistance);
        let outwards = flow(self.housing - limit(data.ambient), data.housing_resistance);
        self.winding = warmed(self.winding, loss - inwards, step, data.winding_capacity);
        self.housing = warmed(
            self.housing,
            inwards - outwards,
            step,
            data.housing_capacity,
        );
        if let Some(measured) = measured {
            self.housing += (measured - self.housing) / FOLLOWED;
        }
    }

    /// Begins with the housing as it is measured, and the winding hotter: what warmed it before a loss
    /// of power is not known.
    fn begin(&mut self, data: &ThermalData, measured: Option<i64>) {
        let (part, whole) = COLD_START;
        self.housing = measured.unwrap_or(limit(data.ambient));
        let room = (limit(data.winding_limit) - self.housing).max(0);
        self.winding = self.housing + room * part / whole;
        (self.squares, self.count) = (0, 0);
    }

    /// Returns the mean copper loss since the last call, µW.
    fn take_loss(&mut self, motor: &Motor) -> i64 {
        let mean = self.squares / u64::from(self.count.max(1));
        (self.squares, self.count) = (0, 0);
        // (1.024 mA)² · mΩ is 1.048576 nW.
        let mean = mean.min(1_000_000_000) as i64;
        let loss = mean * self.resistance(motor) / 1_000 * 1_048_576 / 1_000_000;
        loss.min(MOST_POWER)
    }

    /// Returns the resistance of the winding as warm as it is, mΩ.
    fn resistance(&self, motor: &Motor) -> i64 {
        let resistance = i64::from(motor.resistance.min(1_000_000));
        let rise = (self.winding - REFERENCE) / 1_000 * COPPER / 1_000;
        (resistance + resistance * rise / 1_000_000).max(1)
    }

    /// Returns the most current that the winding may carry now.
    pub fn bound(&self, motor: &Motor) -> Current {
        let data = &motor.thermal;
        let limit = limit(data.winding_limit);
        let steady = flow(limit - self.housing, data.winding_resistance);
        let approach =
            (limit - self.winding).saturating_mul(data.winding_capacity.into()) / APPROACH_MS;
        let power = steady.saturating_add(approach).clamp(0, MOST_POWER);
        // (i / 8 A)², Q30: µW over mΩ is mA².
        let square = ((power << 24) / 1_000 / self.resistance(motor)).min(u32::MAX.into());
        let eighths = i64::from(root_q30(square as u32));
        Current::from_microamps(((eighths * 8_000_000) >> 30) as i32)
    }

    /// Returns the temperature of the winding.
    pub fn winding(&self) -> Temperature {
        Temperature::from_decidegrees((self.winding / TENTH) as i32)
    }
}

/// Returns a temperature of the settings in µ°C.
fn limit(temperature: Temperature) -> i64 {
    i64::from(temperature.to_decidegrees()) * TENTH
}

/// Returns the power, µW, that a difference of temperatures, µK, drives through a resistance, mK/W.
fn flow(difference: i64, resistance: u32) -> i64 {
    difference * 1_000 / i64::from(resistance.max(1))
}

/// Returns a temperature after a power, µW, for a step, µs, into a capacity, mJ/K.
fn warmed(temperature: i64, power: i64, step: i64, capacity: u32) -> i64 {
    let change = power.clamp(-MOST_POWER, MOST_POWER) * step / i64::from(capacity.max(1)) / 1_000;
    let (least, most) = RANGE;
    (temperature + change).max(least).min(most)
}

#[cfg(test)]
mod tests;
