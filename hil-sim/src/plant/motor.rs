//! One brushed motor with gear, bridge, encoder and temperatures, seen at the gear's output.

use super::config::Motor;

/// A motor's torque as a line over its speed at the end of the step: `torque − slope · speed`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Line {
    /// Torque that does not depend on the speed, N·m.
    pub torque: f64,
    /// Damping, N·m·s/rad.
    pub slope: f64,
}

/// What a bridge does to the winding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bridge {
    /// All switches open: no current.
    Open,
    /// A voltage, V; zero shorts the winding. The current settles within the step.
    Voltage(f64),
    /// The current loop holds a current: its mean over the step, A.
    Current(f64),
}

/// What a motor carries from step to step.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorState {
    /// Current now, A.
    pub current_a: f64,
    /// Temperature of the winding, °C.
    pub winding_c: f64,
    /// Temperature of the housing, °C.
    pub housing_c: f64,
    current_sum: f64,
    current_count: f64,
}

/// How a winding's current follows its voltage within one period of the current loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Winding {
    /// e^(−R Δt / L): what is left of a current.
    decay: f64,
}

impl Winding {
    /// Takes a motor whose loop has a period, s.
    pub fn new(motor: &Motor, period_s: f64) -> Self {
        let exponent = motor.resistance_ohm * period_s / motor.inductance_h;
        Self {
            decay: libm::exp(-exponent),
        }
    }

    /// Returns the current after a period at a voltage and a speed, within the bridge's limit, A.
    pub fn advance(&self, motor: &Motor, current_a: f64, voltage_v: f64, speed: f64) -> f64 {
        let settled = (voltage_v - motor.constant * speed) / motor.resistance_ohm;
        let current = settled + (current_a - settled) * self.decay;
        current.clamp(-motor.current_limit_a, motor.current_limit_a)
    }
}

impl MotorState {
    /// Starts cold and without current.
    pub fn new(motor: &Motor) -> Self {
        Self {
            current_a: 0.0,
            winding_c: motor.ambient_c,
            housing_c: motor.ambient_c,
            current_sum: 0.0,
            current_count: 0.0,
        }
    }

    /// Ends a step at a speed, with what the bridge did in it, and warms up.
    pub fn advance(&mut self, motor: &Motor, bridge: Bridge, speed: f64, step: f64) {
        let mean = match bridge {
            Bridge::Open => 0.0,
            Bridge::Voltage(volts) => settled(motor, volts, speed),
            Bridge::Current(mean) => mean,
        };
        if !matches!(bridge, Bridge::Current(_)) {
            self.current_a = mean;
        }
        self.current_sum += mean;
        self.current_count += 1.0;
        let heat = mean * mean * motor.resistance_ohm;
        let inwards = (self.winding_c - self.housing_c) / motor.winding_k_per_w;
        let outwards = (self.housing_c - motor.ambient_c) / motor.housing_k_per_w;
        self.winding_c += step * (heat - inwards) / motor.winding_j_per_k;
        self.housing_c += step * (inwards - outwards) / motor.housing_j_per_k;
    }

    /// Returns the mean current since it was last asked, A; that of now when no step passed.
    pub fn take_mean_current(&mut self) -> f64 {
        if self.current_count == 0.0 {
            return self.current_a;
        }
        let mean = self.current_sum / self.current_count;
        (self.current_sum, self.current_count) = (0.0, 0.0);
        mean
    }
}

/// Returns the torque line of a motor that turns at `speed`: electrical torque less friction.
///
/// Coulomb friction is a damping of τ/max(|ω|, ω₀): whole above ω₀, nothing at rest, and never
/// able to turn a motor back.
pub fn line(motor: &Motor, bridge: Bridge, speed: f64) -> Line {
    let coulomb = motor.coulomb_nm / speed.abs().max(motor.coulomb_speed);
    let mut line = Line {
        torque: 0.0,
        slope: motor.viscous + coulomb,
    };
    match bridge {
        Bridge::Open => {}
        Bridge::Current(mean) => line.torque = motor.constant * mean,
        Bridge::Voltage(volts) => {
            let free = (volts - motor.constant * speed) / motor.resistance_ohm;
            if free.abs() > motor.current_limit_a {
                line.torque = motor.constant * motor.current_limit_a.copysign(free);
            } else {
                line.torque = motor.constant * volts / motor.resistance_ohm;
                line.slope += motor.constant * motor.constant / motor.resistance_ohm;
            }
        }
    }
    line
}

/// Returns the current to which a winding settles at a speed, within the bridge's limit, A.
fn settled(motor: &Motor, volts: f64, speed: f64) -> f64 {
    let free = (volts - motor.constant * speed) / motor.resistance_ohm;
    free.clamp(-motor.current_limit_a, motor.current_limit_a)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Spins a lone motor for a time and returns its speed, rad/s.
    fn spin(bridge: Bridge, mut speed: f64, load_nm: f64, seconds: f64) -> (f64, MotorState) {
        let motor = Motor::default();
        let mut state = MotorState::new(&motor);
        let step = 0.5e-3;
        for _ in 0..(seconds / step) as usize {
            let line = line(&motor, bridge, speed);
            let push = line.torque + load_nm - line.slope * speed;
            speed += step * push / (motor.inertia + step * line.slope);
            state.advance(&motor, bridge, speed, step);
        }
        (speed, state)
    }

    #[test]
    fn runs_at_the_speed_where_torque_meets_friction() {
        let (speed, state) = spin(Bridge::Voltage(24.0), 0.0, 0.0, 1.0);
        // k (V − k ω)/R = τc + b ω.
        let expected = (1.488 * 24.0 / 5.8 - 0.06) / (1.488 * 1.488 / 5.8 + 0.02);
        assert!((speed - expected).abs() < 1e-9, "{speed} {expected}");
        let current = (0.06 + 0.02 * expected) / 1.488;
        assert!((state.current_a - current).abs() < 1e-9);
    }

    #[test]
    fn a_stalled_bridge_gives_its_limit_and_no_more() {
        let motor = Motor::default();
        let line = line(&motor, Bridge::Voltage(24.0), 0.0);
        assert!((line.torque - 1.488 * 2.5).abs() < 1e-12);
        assert!((settled(&motor, -24.0, 0.0) + 2.5).abs() < 1e-12);
    }

    #[test]
    fn a_brake_stops_sooner_than_friction() {
        let (braked, _) = spin(Bridge::Voltage(0.0), 5.0, 0.0, 0.05);
        let (free, state) = spin(Bridge::Open, 5.0, 0.0, 0.05);
        assert!(braked < 0.01 && free > 1.0, "{braked} {free}");
        assert_eq!(state.current_a, 0.0);
    }

    #[test]
    fn coulomb_friction_holds_a_load_below_it() {
        let (speed, _) = spin(Bridge::Open, 0.0, 0.05, 1.0);
        assert!(speed.abs() < 0.005, "{speed} rad/s");
        let (speed, _) = spin(Bridge::Open, 0.0, 0.10, 3.0);
        assert!((speed - 2.0).abs() < 1e-6, "{speed} rad/s");
    }

    #[test]
    fn a_stalled_motor_warms_towards_its_steady_temperature() {
        let (_, state) = spin(Bridge::Voltage(7.3), 0.0, -50.0, 0.0);
        assert_eq!(state.housing_c, 15.0);
        let motor = Motor::default();
        let mut state = MotorState::new(&motor);
        for _ in 0..100_000 {
            state.advance(&motor, Bridge::Voltage(5.8), 0.0, 0.1);
        }
        // 1 A through 5.8 Ω heats by 5.8 W.
        assert!((state.housing_c - (15.0 + 5.8 * 13.0)).abs() < 1e-3);
        assert!((state.winding_c - state.housing_c - 5.8 * 3.1).abs() < 1e-3);
    }

    #[test]
    fn a_winding_takes_its_voltage_as_an_exponential() {
        let motor = Motor::default();
        let period = 50e-6;
        let winding = Winding::new(&motor, period);
        let (volts, speed, mut current, mut exact) = (12.0, 3.0, -1.0, -1.0_f64);
        for _ in 0..10 {
            current = winding.advance(&motor, current, volts, speed);
            // A thousand Euler steps.
            for _ in 0..1_000 {
                let push = volts - motor.constant * speed - motor.resistance_ohm * exact;
                exact += period / 1_000.0 * push / motor.inductance_h;
            }
            assert!((current - exact).abs() < 1e-3, "{current} {exact}");
        }
        let limited = winding.advance(&motor, 2.5, 60.0, 0.0);
        assert_eq!(limited, motor.current_limit_a);
    }

    #[test]
    fn the_firmware_knows_the_motor_that_is_simulated() {
        let (motor, known) = (Motor::default(), eel_vertebra::Motor::PROTOTYPE);
        let milli = |value: f64| (value * 1e3).round() as u32;
        let micro = |value: f64| (value * 1e6).round() as u32;
        assert_eq!(micro(motor.constant), known.torque_constant);
        assert_eq!(milli(motor.resistance_ohm), known.resistance);
        assert_eq!(micro(motor.inductance_h), known.inductance);
        assert_eq!(
            milli(motor.winding_k_per_w),
            known.thermal.winding_resistance
        );
        assert_eq!(
            milli(motor.housing_k_per_w),
            known.thermal.housing_resistance
        );
        assert_eq!(milli(motor.winding_j_per_k), known.thermal.winding_capacity);
        assert_eq!(milli(motor.housing_j_per_k), known.thermal.housing_capacity);
        assert_eq!(milli(motor.viscous), known.friction.viscous);
        let coulomb = known.friction.coulomb.to_millinewton_metres();
        assert_eq!(milli(motor.coulomb_nm) as i32, i32::from(coulomb));
    }
}
