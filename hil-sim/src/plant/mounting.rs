//! How a motor and its encoders are built in, which no two are alike in.

use super::random::Random;

/// How one motor and its sensors are built in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mounting {
    /// Whether the motor's leads are exchanged, and with them the sense of its current.
    pub leads: bool,
    /// Whether its counter counts down as the crank turns up.
    pub counter: bool,
    /// Whether the crank's absolute encoder counts down as the crank turns up.
    pub crank: bool,
    /// What the absolute encoder reads at a crank angle of zero, rad, within half a turn.
    pub zero_rad: f64,
    /// What the current sensor reads without a current, A.
    pub offset_a: f64,
}

impl Mounting {
    /// Returns how the three motors of a vertebra happen to be built in; offsets are up to 100 mA.
    pub fn random(seed: u64, joint: usize) -> [Self; 3] {
        let mut random = Random::new(seed, 1_000 + joint as u64);
        std::array::from_fn(|_| Self {
            leads: random.bits() & 1 != 0,
            counter: random.bits() & 1 != 0,
            crank: random.bits() & 1 != 0,
            zero_rad: f64::from(random.within(3_141)) / 1e3,
            offset_a: f64::from(random.within(100)) / 1e3,
        })
    }

    /// Returns the sign of a sense.
    pub const fn sign(reversed: bool) -> f64 {
        if reversed { -1.0 } else { 1.0 }
    }

    /// Returns what the absolute encoder reads, rad, within half a turn.
    pub fn read(&self, angle: f64) -> f64 {
        let turn = std::f64::consts::TAU;
        let read = self.zero_rad + Self::sign(self.crank) * angle;
        read - turn * libm::round(read / turn)
    }
}
