//! The CRC of a block transfer (CiA 301, 7.2.4.3.16): polynomial 0x1021, from 0, not reflected.

/// The CRC of the bytes so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Crc(u16);

impl Crc {
    /// Takes the next bytes.
    #[inline(never)] // One copy in flash.
    pub fn update(&mut self, bytes: &[u8]) {
        for byte in bytes {
            // Eight steps of the division at once, without a table.
            let mut quotient = (self.0 >> 8) ^ u16::from(*byte);
            quotient ^= quotient >> 4;
            self.0 = (self.0 << 8) ^ (quotient << 12) ^ (quotient << 5) ^ quotient;
        }
    }

    pub const fn value(self) -> u16 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn has_the_check_value_of_xmodem_however_it_is_cut() {
        let text = b"123456789";
        for cut in 0..=text.len() {
            let (first, second) = text.split_at(cut);
            let mut crc = Crc::default();
            crc.update(first);
            crc.update(second);
            assert_eq!(crc.value(), 0x31C3);
        }
    }

    #[test]
    fn is_the_remainder_of_the_long_division() {
        let mut crc = Crc::default();
        let mut register = 0u32;
        for at in 0..10_000u32 {
            let byte = (at * 31 + at / 256) as u8;
            crc.update(&[byte]);
            register ^= u32::from(byte) << 8;
            for _ in 0..8 {
                register <<= 1;
                if register & 0x1_0000 != 0 {
                    register ^= 0x1_1021;
                }
            }
            assert_eq!(u32::from(crc.value()), register, "byte {at}");
        }
    }
}
