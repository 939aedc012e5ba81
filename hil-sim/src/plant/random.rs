//! A small seeded generator for sensor noise (SplitMix64, Steele et al. 2014).

/// The generator's state.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Random(u64);

impl Random {
    /// Starts a stream; streams of one seed are independent of each other.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut random = Self(seed ^ stream.wrapping_mul(0xD134_2543_DE82_EF95));
        random.bits();
        random
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Returns an integer within `-reach..=reach`.
    pub fn within(&mut self, reach: i32) -> i32 {
        let span = 2 * u64::from(reach.unsigned_abs()) + 1;
        // The span is tiny beside 2⁶⁴: the bias is below 1e-12.
        (self.bits() % span) as i32 - reach.abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_numbers_are_those_of_the_reference() {
        // SplitMix64 from state 1234567, as published with the xoshiro generators.
        let mut random = Random(1_234_567);
        assert_eq!(random.bits(), 6_457_827_717_110_365_317);
        assert_eq!(random.bits(), 3_203_168_211_198_807_973);
    }

    #[test]
    fn small_integers_reach_both_ends_and_no_further() {
        let mut random = Random::new(3, 1);
        let drawn: Vec<i32> = (0..200).map(|_| random.within(1)).collect();
        assert_eq!(drawn.iter().min(), Some(&-1));
        assert_eq!(drawn.iter().max(), Some(&1));
    }
}
