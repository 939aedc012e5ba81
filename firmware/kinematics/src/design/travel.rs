//! How far the motors and the platform may turn.

use nalgebra::Matrix3;

use super::{Geometry, pose};
use crate::Side;

/// Radians of a degree.
const DEGREE: f64 = core::f64::consts::PI / 180.0;

/// An interval of an angle, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Its low end.
    pub low: f64,
    /// Its high end.
    pub high: f64,
}

/// What the stops of the motors and the purpose of the wrist allow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// The three motors' angles.
    pub motors: [Range; 3],
    /// Yaw, pitch and roll.
    pub pose: [Range; 3],
}

/// A coordinate that has limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinate {
    /// The crank of leg 1.
    Motor1,
    /// The crank of leg 2.
    Motor2,
    /// The first joint of the serial leg.
    Motor3,
    /// Lateral bending.
    Yaw,
    /// Dorsoventral bending.
    Pitch,
    /// Torsion.
    Roll,
}

/// The limit that a configuration is nearest to, or farthest beyond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Whose limit it is.
    pub coordinate: Coordinate,
    /// Which end of its range.
    pub side: Side,
    /// How far the coordinate may still go that way, rad; negative beyond the limit.
    pub room: f64,
}

impl Range {
    /// Returns the interval between two angles in degrees.
    pub const fn from_degrees(low: f64, high: f64) -> Self {
        Self {
            low: low * DEGREE,
            high: high * DEGREE,
        }
    }

    /// Returns whether an angle in rad is in it, ends included.
    pub fn contains(&self, angle: f64) -> bool {
        self.low <= angle && angle <= self.high
    }

    /// Returns the angle at a share of the way from the low end to the high one.
    pub fn at(&self, share: f64) -> f64 {
        self.low + (self.high - self.low) * share
    }
}

impl Travel {
    /// The paper's box: yaw ±30°, pitch ±15°, roll ±4°.
    pub const PAPER: [Range; 3] = [
        Range::from_degrees(-30.0, 30.0),
        Range::from_degrees(-15.0, 15.0),
        Range::from_degrees(-4.0, 4.0),
    ];
    /// The paper's box, and what it asks of the motors with parallel axes, to the next degree.
    pub const PARALLEL_AXES: Self = Self::paper(32.0, 32.0);
    /// The paper's box, and what it asks of the motors with orthogonal axes, to the next degree.
    pub const ORTHOGONAL_AXES: Self = Self::paper(32.0, 32.0);
    /// The paper's box, and what it asks of the prototype's motors, to the next degree.
    pub const PARALLEL_ACTUATORS: Self = Self::paper(48.0, 49.0);

    /// Returns the paper's box with ranges of the cranks in degrees; motor 3 has the same range in
    /// all architectures.
    const fn paper(down: f64, up: f64) -> Self {
        let crank = Range::from_degrees(-down, up);
        Self {
            motors: [crank, crank, Range::from_degrees(32.0, 51.0)],
            pose: Self::PAPER,
        }
    }

    /// Returns the limit with the least room at a configuration; angles as they are given, no turns
    /// are taken off.
    pub fn nearest(&self, rotation: &Matrix3<f64>, theta: &[f64; 3]) -> Limit {
        let [yaw, pitch, roll] = pose(rotation);
        let [a, b, c] = *theta;
        let [motor1, motor2, motor3] = self.motors;
        let [lateral, dorsal, torsion] = self.pose;
        let all = [
            (Coordinate::Motor1, motor1, a),
            (Coordinate::Motor2, motor2, b),
            (Coordinate::Motor3, motor3, c),
            (Coordinate::Yaw, lateral, yaw),
            (Coordinate::Pitch, dorsal, pitch),
            (Coordinate::Roll, torsion, roll),
        ];
        let mut nearest = Limit {
            coordinate: Coordinate::Motor1,
            side: Side::Low,
            room: f64::INFINITY,
        };
        for (coordinate, range, angle) in all {
            for (side, room) in [
                (Side::Low, angle - range.low),
                (Side::High, range.high - angle),
            ] {
                // What is no number is beyond every limit.
                if room.is_nan() || room < nearest.room {
                    let room = if room.is_nan() {
                        f64::NEG_INFINITY
                    } else {
                        room
                    };
                    nearest = Limit {
                        coordinate,
                        side,
                        room,
                    };
                }
            }
        }
        nearest
    }
}

impl Coordinate {
    /// Returns its name in words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Motor1 => "motor 1",
            Self::Motor2 => "motor 2",
            Self::Motor3 => "motor 3",
            Self::Yaw => "yaw",
            Self::Pitch => "pitch",
            Self::Roll => "roll",
        }
    }
}

impl Limit {
    /// Returns whether the configuration is beyond it, and so out of travel.
    pub fn is_passed(&self) -> bool {
        self.room < 0.0
    }
}

impl Geometry {
    /// Returns whether a configuration is within travel: motors and pose, ends included.
    pub fn is_within_travel(&self, rotation: &Matrix3<f64>, theta: &[f64; 3]) -> bool {
        !self.travel.nearest(rotation, theta).is_passed()
    }
}
