//! From motors to a joint: motor angles and the exact matrix of their rates.

use super::algebra::{Mat3, pose_of, pose_rate_matrix};

/// How three motors move a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transmission {
    /// Each motor turns one angle of the pose: yaw, pitch, roll. For tests of the plant alone.
    Direct,
}

/// A transmission at one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Motor angles, rad.
    pub angles: [f64; 3],
    /// Motor rates for the joint's rates in the tail-side frame; moments go by its transpose.
    pub rates: Mat3,
}

impl Transmission {
    /// Returns the link at a joint's rotation; `None` where the motors cannot reach it.
    pub fn link(&self, rotation: &Mat3) -> Option<Link> {
        match self {
            Self::Direct => Some(Link {
                angles: pose_of(rotation),
                rates: pose_rate_matrix(rotation),
            }),
        }
    }

    /// Returns the motor angles at a joint's rotation; `None` where they cannot reach it.
    pub fn angles(&self, rotation: &Mat3) -> Option<[f64; 3]> {
        match self {
            Self::Direct => Some(pose_of(rotation)),
        }
    }
}
