//! End-to-end protection of target and pose frames.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_published_check_value() {
        // AUTOSAR SWS CRC, table of CRC8H2F results; "123456789" is the usual check.
        assert_eq!(crc8(b"123456789"), 0xDF);
        assert_eq!(crc8(&[0; 4]), 0x12);
    }
}
