//! One joint's drive train: three motors, transmission, hard stops and sensors.

use eel_units::{Angle, Current, Temperature, Voltage};
use eel_vertebra::{Drive, Sample};

use super::algebra::{Mat3, Vec3};
use super::chain::Load;
use super::config::{Config, Motor};
use super::defect::Defects;
use super::motor::{self, Bridge, Line, MotorState};
use super::mounting::Mounting;
use super::power::{Power, Sensor, Supply};
use super::random::Random;
use super::transmission::{Link, Transmission};

/// Counts a turn of the absolute encoders, 14 bits.
const ABSOLUTE_COUNTS: f64 = 16_384.0;

/// The drive train of one joint.
#[derive(Clone, Debug)]
pub struct Wrist {
    transmission: Transmission,
    link: Link,
    /// Change of the link's matrix a second, times the joint's rates: rad/s².
    turning: Vec3,
    lines: [Line; 3],
    bridges: [Bridge; 3],
    power: Power,
    motors: [MotorState; 3],
    /// Encoder count at a motor angle of zero: where the counter stood at power-up.
    offsets: [i32; 3],
    random: Random,
    defects: Defects,
    mounting: [Mounting; 3],
    started: bool,
}

impl Wrist {
    /// Makes the drive train of joint `joint`, straight and cold.
    pub fn new(config: &Config, seed: u64, joint: usize) -> Self {
        let mut random = Random::new(seed, joint as u64 + 1);
        let transmission = config.transmission;
        let link = transmission.link(&Mat3::IDENTITY).unwrap_or(Link {
            angles: [0.0; 3],
            rates: Mat3::IDENTITY,
        });
        Self {
            transmission,
            link,
            turning: Vec3::ZERO,
            lines: [Line::default(); 3],
            bridges: [Bridge::Open; 3],
            power: Power::new(&config.motor),
            motors: std::array::from_fn(|_| MotorState::new(&config.motor)),
            offsets: std::array::from_fn(|_| random.within(1 << 20)),
            random,
            defects: Defects::default(),
            mounting: [Mounting::default(); 3],
            started: false,
        }
    }

    /// Returns what the motors do to the joint in the coming step.
    pub fn load(
        &mut self,
        config: &Config,
        drives: &[Drive; 3],
        supply_v: f64,
        rotation: &Mat3,
        rate: Vec3,
    ) -> Load {
        let (motor, step) = (&config.motor, config.step_s);
        self.follow(rotation, rate, step);
        let speeds = self.link.rates * rate;
        let (mut torques, mut shares) = ([0.0; 3], [0.0; 3]);
        let (drives, damping) = (self.defects.driven(*drives), self.defects.damping());
        let wrong_a = self.defects.current_error_a();
        let supply = Supply {
            volts: supply_v,
            sensors: std::array::from_fn(|i| Sensor {
                sign: Mounting::sign(self.mounting[i].leads),
                offset_a: self.mounting[i].offset_a + wrong_a[i],
            }),
        };
        self.bridges = self
            .power
            .act(motor, &drives, &supply, &speeds.0, &mut self.motors, step);
        for i in 0..3 {
            let mut line = motor::line(motor, self.bridges[i], speeds.0[i]);
            line.slope += damping[i];
            self.lines[i] = line;
            torques[i] = line.torque - line.slope * speeds.0[i] - motor.inertia * self.turning.0[i];
            shares[i] = motor.inertia + step * line.slope;
        }
        Load {
            moment: self.link.rates.transpose_mul(Vec3(torques)),
            implicit: self.link.rates.gram(Vec3(shares)),
        }
    }

    /// Takes the link to the joint's rotation, and how fast its matrix turns.
    fn follow(&mut self, rotation: &Mat3, rate: Vec3, step: f64) {
        // Out of reach lies beyond the stops; the last link serves there.
        let Some(link) = self.transmission.link(rotation) else {
            return;
        };
        if self.started {
            self.turning = (link.rates - self.link.rates) * rate * (1.0 / step);
        }
        (self.link, self.started) = (link, true);
    }

    /// Ends a step: currents and temperatures at the new rates. Returns the moment that the drive
    /// train passed to the bodies, in the tail-side frame, N·m.
    pub fn settle(&mut self, config: &Config, rate: Vec3, acceleration: Vec3) -> Vec3 {
        let (motor, step) = (&config.motor, config.step_s);
        let speeds = self.link.rates * rate;
        let accelerations = self.link.rates * acceleration + self.turning;
        let torques = std::array::from_fn(|i| {
            let (line, speed) = (self.lines[i], speeds.0[i]);
            self.motors[i].advance(motor, self.bridges[i], speed, step);
            line.torque - line.slope * speed - motor.inertia * accelerations.0[i]
        });
        self.link.rates.transpose_mul(Vec3(torques))
    }

    /// Returns the electrical torques of the motors, N·m.
    pub fn torques(&self, motor: &Motor) -> [f64; 3] {
        std::array::from_fn(|i| motor.constant * self.motors[i].current_a)
    }

    /// Builds its motors and sensors in otherwise than ideally.
    pub fn set_mounting(&mut self, mounting: [Mounting; 3]) {
        self.mounting = mounting;
    }

    /// Returns what is wrong with it.
    pub fn defects_mut(&mut self) -> &mut Defects {
        &mut self.defects
    }

    /// Returns the motors.
    pub fn motors(&self) -> &[MotorState; 3] {
        &self.motors
    }

    /// Returns the motor angles at a joint's rotation, rad.
    pub fn angles(&self, rotation: &Mat3) -> [f64; 3] {
        self.transmission
            .angles(rotation)
            .unwrap_or(self.link.angles)
    }

    /// Returns the mean current drawn from the battery in the last step, A. A shorted or open motor
    /// draws none.
    pub fn supply_current_a(&self) -> f64 {
        self.power.drawn_a()
    }

    /// Measures everything, with the quantisation and the noise of the sensors.
    pub fn sample(&mut self, config: &Config, rotation: &Mat3, supply_v: f64) -> Sample {
        let angles = self.angles(rotation);
        let counts_per_radian = config.motor.counts_per_turn / std::f64::consts::TAU;
        let encoder_counts = std::array::from_fn(|i| {
            let counted = libm::floor(angles[i] * counts_per_radian) as i32;
            let counted = if self.mounting[i].counter {
                -counted
            } else {
                counted
            };
            counted.wrapping_add(self.offsets[i])
        });
        let absolute =
            std::array::from_fn(|i| Some(self.absolute(self.mounting[i].read(angles[i]))));
        let current = std::array::from_fn(|i| {
            let mounting = self.mounting[i];
            let mean = Mounting::sign(mounting.leads) * self.motors[i].take_mean_current();
            let milliamps = libm::round((mean + mounting.offset_a) * 1e3) as i32;
            Current::from_milliamps(milliamps + self.random.within(1))
        });
        self.defects.spoil(Sample {
            encoder_counts,
            absolute,
            current,
            supply: Voltage::from_millivolts(libm::round(supply_v * 1e3) as i32),
            board_temperature: decidegrees(self.board_c(&config.motor)),
            motor_temperature: std::array::from_fn(|i| decidegrees(self.motors[i].housing_c)),
            bridge_fault: [false; 3],
            over_current: self.power.tripped(),
            sync_age: None,
            chain_in: true,
            emergency_stop: false,
        })
    }

    /// Reads a crank's absolute encoder: 14 bits, wrong by up to one more step.
    fn absolute(&mut self, angle: f64) -> Angle {
        let counts = libm::floor(angle * (ABSOLUTE_COUNTS / std::f64::consts::TAU)) as i32;
        let read = counts + self.random.within(1);
        let radians = f64::from(read) * (std::f64::consts::TAU / ABSOLUTE_COUNTS);
        Angle::from_q29(libm::round(radians * f64::from(1 << 29)) as i32)
    }

    /// Returns the temperature of the board: it sits among its motors and warms by itself.
    fn board_c(&self, motor: &Motor) -> f64 {
        let warmth: f64 = self
            .motors
            .iter()
            .map(|m| m.housing_c - motor.ambient_c)
            .sum();
        motor.ambient_c + 5.0 + warmth / 3.0
    }
}

/// Rounds a temperature to tenths of a degree.
fn decidegrees(celsius: f64) -> Temperature {
    Temperature::from_decidegrees(libm::round(celsius * 10.0) as i32)
}
