//! A wide count out of a narrow one.

/// Extends a 16-bit quadrature counter to 32 bits by the differences between readings.
///
/// Right as long as the counter moves by less than 32 768 between two readings; the fastest crank
/// of the prototype moves it by 561 in a millisecond. The wide count wraps at its ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WideCounter {
    last: u16,
    count: i32,
}

impl WideCounter {
    /// Starts at 0 where the narrow counter stands at `reading`.
    pub const fn new(reading: u16) -> Self {
        Self {
            last: reading,
            count: 0,
        }
    }

    /// Takes a reading of the narrow counter and returns the wide count.
    pub const fn update(&mut self, reading: u16) -> i32 {
        let difference = reading.wrapping_sub(self.last) as i16;
        self.last = reading;
        self.count = self.count.wrapping_add(difference as i32);
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_on_where_the_narrow_counter_wraps() {
        for start in [0, 1, 32_767, 32_768, 65_535] {
            for step in [561, -561, 32_767, -32_768] {
                let mut counter = WideCounter::new(start);
                let mut truth = i64::from(start);
                for _ in 0..1_000 {
                    truth += step;
                    let narrow = u16::try_from(truth.rem_euclid(65_536)).unwrap();
                    let wide = counter.update(narrow);
                    assert_eq!(i64::from(wide), truth - i64::from(start));
                }
            }
        }
    }
}
