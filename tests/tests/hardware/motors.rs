//! The constants of motors, gear and supply in docs/hardware.md, held to firmware and simulator.

use eel_units::{AngularVelocity, Temperature, Voltage};
use eel_vertebra::{Limits, Motor};
use hil_sim::plant::config::{Config, Motor as Simulated};

use super::{PAGE, expect_none, quoted, table, text};

/// A constant as firmware and simulator have it, in the unit of the page.
type Constant = (&'static str, Option<f64>, Option<f64>);

/// Returns thousandths as a number.
fn milli(value: impl Into<i64>) -> Option<f64> {
    Some(value.into() as f64 / 1e3)
}

fn speed(value: AngularVelocity) -> Option<f64> {
    Some(f64::from(value.to_q24()) / f64::from(1 << 24))
}

fn degrees(value: Temperature) -> Option<f64> {
    Some(f64::from(value.to_decidegrees()) / 10.0)
}

fn volts(value: Voltage) -> Option<f64> {
    milli(value.to_millivolts())
}

/// Returns the constants of motor and gear.
fn motor_constants() -> Vec<Constant> {
    let (known, plant) = (Motor::PROTOTYPE, Simulated::default());
    let friction = known.friction;
    // Quadrature makes four counts of each of 512 lines.
    let shaft = 4.0 * 512.0;
    let counts = f64::from(known.counts_per_turn);
    let constant = f64::from(known.torque_constant) / 1e6;
    let coulomb = milli(friction.coulomb.to_millinewton_metres());
    let limit = f64::from(known.current_limit.to_microamps()) / 1e6;
    vec![
        (
            "torque and back-EMF constant",
            Some(constant),
            Some(plant.constant),
        ),
        (
            "resistance of winding and bridge",
            milli(known.resistance),
            Some(plant.resistance_ohm),
        ),
        (
            "inductance of the winding",
            milli(known.inductance),
            Some(plant.inductance_h * 1e3),
        ),
        (
            "gear ratio, from the counts",
            Some(counts / shaft),
            Some(plant.counts_per_turn / shaft),
        ),
        (
            "counts per turn of the crank",
            Some(counts),
            Some(plant.counts_per_turn),
        ),
        ("inertia of the rotor", None, Some(plant.inertia)),
        ("Coulomb friction", coulomb, Some(plant.coulomb_nm)),
        (
            "speed of the reference for all of it",
            speed(friction.speed),
            None,
        ),
        (
            "speed of the crank for all of it",
            None,
            Some(plant.coulomb_speed),
        ),
        (
            "viscous friction",
            milli(friction.viscous),
            Some(plant.viscous),
        ),
        ("current limit", Some(limit), Some(plant.current_limit_a)),
        ("fastest believable speed", speed(known.speed_limit), None),
    ]
}

/// Returns how a motor warms.
fn thermal_constants() -> Vec<Constant> {
    let (thermal, plant) = (Motor::PROTOTYPE.thermal, Simulated::default());
    let water = degrees(thermal.ambient);
    vec![
        (
            "thermal resistance, winding to housing",
            milli(thermal.winding_resistance),
            Some(plant.winding_k_per_w),
        ),
        (
            "thermal resistance, housing to water",
            milli(thermal.housing_resistance),
            Some(plant.housing_k_per_w),
        ),
        (
            "heat capacity of the winding",
            milli(thermal.winding_capacity),
            Some(plant.winding_j_per_k),
        ),
        (
            "heat capacity of the housing",
            milli(thermal.housing_capacity),
            Some(plant.housing_j_per_k),
        ),
        (
            "temperature at which the winding is held",
            degrees(thermal.winding_limit),
            None,
        ),
        ("temperature of the water", water, Some(plant.ambient_c)),
    ]
}

/// Returns what bounds torque and supply.
fn limits() -> Vec<Constant> {
    let (limits, plant) = (Limits::PROTOTYPE, Config::default());
    let peak = milli(limits.peak_torque.to_millinewton_metres());
    vec![
        ("torque of one motor at most", peak, None),
        ("supply without load", None, Some(plant.supply_v)),
        (
            "resistance of battery and cable",
            None,
            Some(plant.supply_resistance_ohm),
        ),
        (
            "supply, less torque below",
            volts(limits.supply_low.start),
            None,
        ),
        ("supply, a fault at", volts(limits.supply_low.end), None),
        (
            "supply, less torque above",
            volts(limits.supply_high.start),
            None,
        ),
        (
            "supply, a fault at or above",
            volts(limits.supply_high.end),
            None,
        ),
        (
            "board, less torque above",
            degrees(limits.board_hot.start),
            None,
        ),
        ("board, a fault at", degrees(limits.board_hot.end), None),
        (
            "housing, less torque above",
            degrees(limits.motor_hot.start),
            None,
        ),
        ("housing, a fault at", degrees(limits.motor_hot.end), None),
    ]
}

#[test]
fn the_motors_are_those_of_firmware_and_simulator() {
    let page = text(PAGE);
    let sources = [
        ("firmware", text("firmware/vertebra/src/settings.rs")),
        ("simulator", text("hil-sim/src/plant/config.rs")),
    ];
    let rows = table(&page, "| constant | value |");
    let known: Vec<_> = motor_constants()
        .into_iter()
        .chain(thermal_constants())
        .chain(limits())
        .collect();
    let mut found = Vec::new();
    for row in &rows {
        let Some((_, firmware, simulator)) = known.iter().find(|(name, ..)| *name == row[0]) else {
            found.push(format!(
                "nothing holds \"{}\" of {PAGE} to the code: add it to this test",
                row[0]
            ));
            continue;
        };
        let written: f64 = row[1].replace(' ', "").parse().unwrap_or(f64::NAN);
        let values = [firmware, simulator];
        for (((who, source), value), cell) in sources.iter().zip(values).zip(&row[3..]) {
            match (value, quoted(cell)) {
                (Some(value), Some(field)) => {
                    // No number is not near anything.
                    let is_near = (written - value).abs() <= 1e-6 * value.abs();
                    if !is_near {
                        found.push(format!(
                            "\"{}\" is {value} in the {who} and {} in {PAGE}: write {value}",
                            row[0], row[1]
                        ));
                    }
                    if !source.contains(&format!("pub {field}: ")) {
                        found.push(format!(
                            "the {who} has no field {field} any more: name its new one in {PAGE}"
                        ));
                    }
                }
                (None, None) => {}
                _ => found.push(format!(
                    "\"{}\": {PAGE} says {cell} of the {who}: name the field, or – for none",
                    row[0]
                )),
            }
        }
    }
    for (name, ..) in &known {
        if !rows.iter().any(|row| row[0] == *name) {
            found.push(format!(
                "{PAGE} lacks \"{name}\": add its row under Motor and gear"
            ));
        }
    }
    expect_none(&found);
}
