//! Temperature by a thermistor: 10 kΩ at 25 °C, B = 3435 K, below a 10 kΩ resistor to the reference.

use eel_units::Temperature;

/// The reading, in parts of 4096 of the reference, at −40 °C and every 10 °C from there to 150 °C.
const READINGS: [i32; 20] = [
    3937, 3814, 3628, 3368, 3038, 2654, 2249, 1854, 1497, 1191, 941, 741, 584, 462, 368, 295, 238,
    194, 159, 132,
];
/// Temperature of the first reading, and between two readings, in tenths of a degree.
const FIRST: i32 = -400;
const STEP: i32 = 100;
/// What a broken sensor reads as: hotter than anything allowed, so that it is noticed.
const BROKEN: Temperature = Temperature::from_decidegrees(1_500);

/// Returns the temperature for a 12-bit reading: within 1 °C of the thermistor's formula from
/// −40 °C to 150 °C. An open or shorted thermistor, beyond either end, reads as 150 °C.
pub fn thermistor(reading: u16) -> Temperature {
    let reading = i32::from(reading);
    let segments = READINGS.iter().zip(READINGS.iter().skip(1)).zip(0..);
    for ((&cold, &hot), index) in segments {
        if reading <= cold && reading >= hot {
            let into = STEP * (cold - reading) / (cold - hot).max(1);
            return Temperature::from_decidegrees(FIRST + STEP * index + into);
        }
    }
    BROKEN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_the_formula_within_a_degree() {
        for decidegrees in (-400_i32..=1_500).step_by(7) {
            let kelvin = f64::from(decidegrees) / 10.0 + 273.15;
            let ratio = (3_435.0 * (1.0 / kelvin - 1.0 / 298.15)).exp();
            let reading = (4_096.0 * ratio / (ratio + 1.0)).round() as u16;
            let found = thermistor(reading).to_decidegrees();
            assert!((found - decidegrees).abs() <= 10, "{decidegrees}: {found}");
        }
    }

    #[test]
    fn takes_a_broken_sensor_for_hot() {
        for reading in [0, 131, 3_938, 4_095] {
            assert_eq!(thermistor(reading), BROKEN);
        }
    }
}
