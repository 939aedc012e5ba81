//! Checks over bytes: the end-to-end protection of target and pose frames, and CRC-32 for records and
//! transfers.

/// The table of CRC-8 with polynomial 0x2F, for four bits at a time.
const NIBBLES: [u8; 16] = nibble_table();

/// Computes the table at compile time.
const fn nibble_table() -> [u8; 16] {
    let mut table = [0; 16];
    let mut index = 0;
    while index < 16 {
        let mut crc = (index as u8) << 4;
        let mut bit = 0;
        while bit < 4 {
            crc = if crc & 0x80 != 0 {
                (crc << 1) ^ 0x2F
            } else {
                crc << 1
            };
            bit += 1;
        }
        table[index] = crc;
        index += 1;
    }
    table
}

/// Computes CRC-8/AUTOSAR over `bytes`: polynomial 0x2F, start 0xFF, inverted at the end.
pub fn crc8(bytes: &[u8]) -> u8 {
    let mut crc = 0xFF_u8;
    for byte in bytes {
        crc ^= byte;
        crc = (crc << 4) ^ NIBBLES[usize::from(crc >> 4)];
        crc = (crc << 4) ^ NIBBLES[usize::from(crc >> 4)];
    }
    !crc
}

/// Computes the protection byte of a frame: over its first seven bytes, then its COB-ID
/// little-endian, so that a frame under a wrong identifier is found too.
pub fn protection(bytes: &[u8; 7], cob_id: u16) -> u8 {
    let [low, high] = cob_id.to_le_bytes();
    let [a, b, c, d, e, f, g] = *bytes;
    crc8(&[a, b, c, d, e, f, g, low, high])
}

/// The table of CRC-32, reflected, for four bits at a time.
const WIDE_NIBBLES: [u32; 16] = wide_nibble_table();

/// Computes the table at compile time.
const fn wide_nibble_table() -> [u32; 16] {
    let mut table = [0; 16];
    let mut index = 0;
    while index < 16 {
        let mut crc = index as u32;
        let mut bit = 0;
        while bit < 4 {
            crc = if crc & 1 != 0 {
                (crc >> 1) ^ 0xEDB8_8320
            } else {
                crc >> 1
            };
            bit += 1;
        }
        table[index] = crc;
        index += 1;
    }
    table
}

/// CRC-32/ISO-HDLC over bytes that come piece by piece; Python's `zlib.crc32`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crc32(u32);

impl Default for Crc32 {
    fn default() -> Self {
        Self(u32::MAX)
    }
}

impl Crc32 {
    /// Computes the check of all the bytes at once.
    pub fn of(bytes: &[u8]) -> u32 {
        let mut crc = Self::default();
        crc.update(bytes);
        crc.value()
    }

    /// Takes the next bytes.
    pub fn update(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 ^= u32::from(*byte);
            for _ in 0..2 {
                self.0 = (self.0 >> 4) ^ WIDE_NIBBLES[(self.0 & 15) as usize];
            }
        }
    }

    /// Returns the check of the bytes that came.
    pub const fn value(self) -> u32 {
        !self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of the catalogue of parametrised CRC algorithms, and those of `zlib.crc32`.
    #[test]
    fn the_wide_check_agrees_with_published_values_however_the_bytes_come() {
        assert_eq!(Crc32::of(b"123456789"), 0xCBF4_3926);
        assert_eq!(Crc32::of(b""), 0);
        assert_eq!(Crc32::of(&[0xFF; 32]), 0xFF6C_AB0B);
        let mut crc = Crc32::default();
        for piece in [&b"12"[..], b"", b"3456", b"789"] {
            crc.update(piece);
        }
        assert_eq!(crc.value(), 0xCBF4_3926);
    }

    #[test]
    fn agrees_with_the_published_check_value() {
        // AUTOSAR SWS CRC, table of CRC8H2F results; "123456789" is the usual check.
        assert_eq!(crc8(b"123456789"), 0xDF);
        assert_eq!(crc8(&[0; 4]), 0x12);
    }

    /// Every pattern of one, two or three wrong bits, against the real check.
    #[test]
    fn every_error_of_up_to_three_bits_is_found() {
        let cob_id = 0x205;
        let body = [0x12, 0xED, 0x00, 0xFF, 0x5A, 0x3C, 0x74];
        let frame = u64::from_le_bytes(frame(&body, cob_id));
        let intact = |word: u64| {
            let [a, b, c, d, e, f, g, crc] = word.to_le_bytes();
            protection(&[a, b, c, d, e, f, g], cob_id) == crc
        };
        assert!(intact(frame));
        let mut patterns = 0;
        for first in 0..64 {
            let error = 1_u64 << first;
            assert!(!intact(frame ^ error), "bit {first}");
            for second in first + 1..64 {
                let error = error | 1 << second;
                assert!(!intact(frame ^ error), "bits {first}, {second}");
                for third in second + 1..64 {
                    assert!(
                        !intact(frame ^ error ^ (1 << third)),
                        "{first}, {second}, {third}"
                    );
                    patterns += 1;
                }
            }
        }
        assert_eq!(patterns, 41_664);
    }

    /// The check is linear, so an error is missed exactly when the syndromes of its bits cancel.
    #[test]
    fn every_error_of_five_bits_is_found() {
        let syndromes = syndromes(protection);
        let mut patterns = 0_u32;
        for a in 0..64 {
            for b in a + 1..64 {
                for c in b + 1..64 {
                    let three = syndromes[a] ^ syndromes[b] ^ syndromes[c];
                    for d in c + 1..64 {
                        let four = three ^ syndromes[d];
                        assert!(
                            syndromes[d + 1..].iter().all(|e| four ^ e != 0),
                            "{a} {b} {c} {d}"
                        );
                        patterns += 63 - d as u32;
                    }
                }
            }
        }
        assert_eq!(patterns, 7_624_512);
    }

    /// The proofs above stand on this: what a bit changes does not depend on the other bits.
    #[test]
    fn the_check_is_linear_for_every_pair_of_bits_and_every_identifier() {
        for cob_id in 0x180..0x400 {
            let reference = syndromes(|body, _| protection(body, cob_id));
            assert_eq!(reference, syndromes(protection), "{cob_id:#x}");
        }
        for (first, second) in (0..56).flat_map(|a| (0..56).map(move |b| (a, b))) {
            let with = |mask: u64| {
                let [a, b, c, d, e, f, g, _] = mask.to_le_bytes();
                protection(&[a, b, c, d, e, f, g], 0x205)
            };
            let both = with(1 << first) ^ with(1 << second) ^ with(0);
            assert_eq!(with((1 << first) ^ (1 << second)), both);
        }
    }

    #[test]
    fn the_other_usual_polynomial_would_miss_errors_of_three_bits() {
        let sae_j1850 = |body: &[u8; 7], cob_id: u16| {
            let mut crc = 0xFF_u8;
            for byte in body.iter().chain(&cob_id.to_le_bytes()) {
                crc ^= byte;
                for _ in 0..8 {
                    crc = if crc & 0x80 != 0 {
                        (crc << 1) ^ 0x1D
                    } else {
                        crc << 1
                    };
                }
            }
            !crc
        };
        let syndromes = syndromes(sae_j1850);
        let mut missed = 0;
        for a in 0..64 {
            for b in a + 1..64 {
                let two = syndromes[a] ^ syndromes[b];
                missed += syndromes[b + 1..].iter().filter(|c| two ^ **c == 0).count();
            }
        }
        assert_eq!(missed, 199);
    }

    #[test]
    fn a_frame_under_the_identifier_of_another_is_found() {
        let body = [1, 2, 3, 4, 5, 6, 7];
        let identifiers = (0x201..=0x20A).chain(0x181..=0x18A).chain(0x281..=0x28A);
        for (sent, heard) in identifiers
            .clone()
            .flat_map(|a| identifiers.clone().map(move |b| (a, b)))
        {
            let same = protection(&body, sent) == protection(&body, heard);
            assert_eq!(same, sent == heard, "{sent:#x} heard as {heard:#x}");
        }
    }

    fn frame(body: &[u8; 7], cob_id: u16) -> [u8; 8] {
        let [a, b, c, d, e, f, g] = *body;
        [a, b, c, d, e, f, g, protection(body, cob_id)]
    }

    /// Returns for each of the 64 bits of a frame what its error leaves in the check.
    fn syndromes(check: impl Fn(&[u8; 7], u16) -> u8) -> [u8; 64] {
        core::array::from_fn(|bit| {
            let [a, b, c, d, e, f, g, crc] = (1_u64 << bit).to_le_bytes();
            check(&[a, b, c, d, e, f, g], 0x205) ^ check(&[0; 7], 0x205) ^ crc
        })
    }
}
