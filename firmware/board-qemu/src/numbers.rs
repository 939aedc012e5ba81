//! Numbers that are the same in every run and on every machine.

use eel_units::Angle;

/// The paper's workspace in radians Q29: yaw ±30°, pitch ±15°, roll ±4°.
const WORKSPACE: [i32; 3] = [281_104_936, 140_552_468, 37_480_658];

/// Vigna's xorshift64*.
pub struct Numbers(u64);

impl Numbers {
    /// Starts with a seed other than zero.
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Returns the next 32 bits.
    pub fn bits(&mut self) -> i32 {
        let Self(state) = self;
        *state ^= *state >> 12;
        *state ^= *state << 25;
        *state ^= *state >> 27;
        (state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32) as i32
    }

    /// Returns a part of `range`, with its sign.
    pub fn part(&mut self, range: i32) -> i32 {
        ((i64::from(self.bits()) * i64::from(range)) >> 31) as i32
    }

    /// Returns yaw, pitch and roll of a pose of the workspace.
    ///
    /// They have 24 digits, which single precision holds exactly.
    pub fn pose(&mut self) -> [Angle; 3] {
        WORKSPACE.map(|range| Angle::from_q29(self.part(range) & !31))
    }
}

/// Returns a fixed-point number in single precision.
pub fn float<const BITS: u32>(raw: i32) -> f32 {
    raw as f32 / (1u64 << BITS) as f32
}
