//! The model against the two-node network in double precision.
#![expect(clippy::float_arithmetic, reason = "the oracle is in f64")]

use proptest::prelude::*;

use super::*;

const MOTOR: Motor = Motor::PROTOTYPE;
/// Time between two steps of the model, µs, as in the wrist.
const STEP_US: u64 = 9_000;

/// Winding and housing in °C, by Euler steps of 1 ms.
struct Oracle {
    winding: f64,
    housing: f64,
}

impl Oracle {
    fn step(&mut self, amps: f64, seconds: f64) {
        let data = MOTOR.thermal;
        let milli = |value: u32| f64::from(value) / 1e3;
        let ambient = f64::from(data.ambient.to_decidegrees()) / 10.0;
        let resistance = 5.8 * (1.0 + 3.93e-3 * (self.winding - 25.0));
        let inwards = (self.winding - self.housing) / milli(data.winding_resistance);
        let outwards = (self.housing - ambient) / milli(data.housing_resistance);
        let heat = amps * amps * resistance;
        self.winding += seconds * (heat - inwards) / milli(data.winding_capacity);
        self.housing += seconds * (inwards - outwards) / milli(data.housing_capacity);
    }
}

fn degrees(temperature: Temperature) -> f64 {
    f64::from(temperature.to_decidegrees()) / 10.0
}

fn tenths(degrees: f64) -> Temperature {
    Temperature::from_decidegrees((degrees * 10.0).round() as i32)
}

/// A bench with model and network; the thermistor reads the network's housing, or is broken.
struct Pair {
    model: Thermal,
    oracle: Oracle,
    now_us: u64,
    reads: bool,
}

impl Pair {
    fn new(start: f64, reads: bool) -> Self {
        let mut model = Thermal::new();
        model.advance(Instant::ZERO, &MOTOR, tenths(start));
        let winding = model.winding as f64 / 1e6;
        Self {
            model,
            oracle: Oracle {
                winding,
                housing: start,
            },
            now_us: 0,
            reads,
        }
    }

    /// Lets a step of nine ticks pass with a current.
    fn step(&mut self, amps: f64) {
        for _ in 0..STEP_US / 1_000 {
            self.model
                .take(Current::from_microamps((amps * 1e6) as i32));
            self.oracle.step(amps, 1e-3);
        }
        self.now_us += STEP_US;
        let read = if self.reads {
            tenths(self.oracle.housing)
        } else {
            // An open thermistor.
            Temperature::from_decidegrees(-2_731)
        };
        self.model
            .advance(Instant::from_micros(self.now_us), &MOTOR, read);
    }
}

#[test]
fn follows_the_network_for_half_an_hour_of_random_currents() {
    for reads in [true, false] {
        let mut pair = Pair::new(15.0, reads);
        let mut state = 0x0EE1_7EA1_u64;
        let mut worst = 0.0f64;
        let mut hottest = 0.0f64;
        for _ in 0..400 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let amps = ((state >> 40) as f64 / f64::from(1 << 24) * 2.0 - 1.0) * 1.4;
            for _ in 0..500 {
                pair.step(amps);
                worst = worst.max((degrees(pair.model.winding()) - pair.oracle.winding).abs());
                hottest = hottest.max(pair.oracle.winding);
            }
        }
        assert!(hottest > 70.0, "{hottest}: the test is too cold");
        assert!(worst < 0.5, "{worst} K, thermistor {reads}");
    }
}

#[test]
fn a_stalled_motor_settles_at_its_continuous_current_from_below() {
    let limit = degrees(MOTOR.thermal.winding_limit);
    let milli = |value: u32| f64::from(value) / 1e3;
    let data = MOTOR.thermal;
    let way = milli(data.winding_resistance) + milli(data.housing_resistance);
    let hot = 5.8 * (1.0 + 3.93e-3 * (limit - 25.0));
    let continuous = ((limit - degrees(data.ambient)) / way / hot).sqrt();
    for start in [15.0, 60.0] {
        let mut pair = Pair::new(start, true);
        let (mut peak, mut last, mut rises) = (0.0f64, f64::INFINITY, 0);
        let mut amps = 0.0;
        for step in 0..400_000 {
            let bound = f64::from(pair.model.bound(&MOTOR).to_microamps()) / 1e6;
            amps = bound.min(2.016);
            pair.step(amps);
            peak = peak.max(pair.oracle.winding);
            // Once it acts, the bound only falls, but for the thermistor's steps of 0.1 K.
            if step > 100_000 && bound > last + 0.01 {
                rises += 1;
            }
            last = bound;
        }
        assert!(peak < limit + 0.5, "{peak} °C of {limit} °C");
        assert!(
            (amps / continuous - 1.0).abs() < 0.03,
            "{amps} A of {continuous} A"
        );
        assert_eq!(rises, 0);
    }
}

#[test]
fn a_motor_that_was_hot_before_a_loss_of_power_is_not_taken_for_cold() {
    let limit = degrees(MOTOR.thermal.winding_limit);
    // The true winding is at its limit, the housing at 60 °C.
    let mut pair = Pair::new(60.0, true);
    pair.oracle.winding = limit;
    let mut peak = limit;
    for _ in 0..10_000 {
        let bound = f64::from(pair.model.bound(&MOTOR).to_microamps()) / 1e6;
        pair.step(bound.min(2.016));
        peak = f64::max(peak, pair.oracle.winding);
    }
    // Within the margin before a fault.
    assert!(peak < limit + 10.0, "{peak} °C");
}

#[test]
fn a_cold_motor_is_not_limited() {
    let pair = Pair::new(15.0, true);
    assert!(pair.model.bound(&MOTOR) > Current::from_milliamps(2_016));
}

proptest! {
    #[test]
    fn any_currents_readings_and_settings_are_survived(
        currents in prop::collection::vec(any::<i32>(), 1..50),
        reading in any::<i32>(),
        numbers in any::<[u32; 4]>(),
        temperatures in any::<[i16; 2]>(),
        times in prop::collection::vec(any::<u64>(), 1..20),
    ) {
        let [winding_resistance, housing_resistance, winding_capacity, housing_capacity] = numbers;
        let [winding_limit, ambient] =
            temperatures.map(|raw| Temperature::from_decidegrees(raw.into()));
        let motor = Motor {
            thermal: ThermalData {
                winding_resistance,
                housing_resistance,
                winding_capacity,
                housing_capacity,
                winding_limit,
                ambient,
            },
            ..MOTOR
        };
        let mut model = Thermal::new();
        for time in times {
            for raw in &currents {
                model.take(Current::from_microamps(*raw));
            }
            model.advance(Instant::from_micros(time), &motor, Temperature::from_decidegrees(reading));
            prop_assert!(model.bound(&motor) >= Current::ZERO);
        }
    }
}
