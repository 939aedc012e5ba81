//! What a vertebra measures and what it does to its motors.

use eel_units::{Angle, Current, Duration, Temperature, Voltage};

/// Everything measured for one control tick; motors in the order 1, 2, 3. A platform gives what the
/// sensors read, in their own senses; the vertebra's calibration makes it what is said here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sample {
    /// Quadrature counts of each motor since power-up, positive with the motor's angle; wraps.
    pub encoder_counts: [i32; 3],
    /// Angle of each crank by its absolute encoder; `None` where the reading is not valid.
    pub absolute: [Option<Angle>; 3],
    /// Current of each motor, mean over the tick, positive with positive torque.
    pub current: [Current; 3],
    /// Supply voltage of the bridges.
    pub supply: Voltage,
    /// Temperature of the board.
    pub board_temperature: Temperature,
    /// Housing temperature of each motor.
    pub motor_temperature: [Temperature; 3],
    /// Whether a bridge reports a fault.
    pub bridge_fault: [bool; 3],
    /// Whether the current loop has switched a bridge off, [`CurrentLoop::tripped`](crate::CurrentLoop::tripped).
    pub over_current: [bool; 3],
    /// How long before this tick the newest SYNC arrived, where one has since the tick before and the
    /// platform can tell.
    pub sync_age: Option<Duration>,
    /// The daisy line's level at this vertebra's IN; high where nothing is connected.
    pub chain_in: bool,
    /// Whether the emergency stop line is asserted.
    pub emergency_stop: bool,
}

/// What a bridge does until the next tick; a platform is told it in the sense of the motor's leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// All switches open: the motor is free.
    Off,
    /// Low sides on: the motor is shorted and brakes itself.
    Brake,
    /// The current loop holds a current.
    Current(Setpoint),
}

/// What the current loop of a motor is to hold until the next tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Setpoint {
    /// The current, positive with positive torque.
    pub current: Current,
    /// The back-EMF at the motor's speed, as feed-forward.
    pub emf: Voltage,
}
