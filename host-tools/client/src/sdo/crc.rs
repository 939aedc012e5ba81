//! The CRC of block transfers: polynomial 0x1021, start 0 (CiA 301, 7.2.4.3.16).

/// Returns the CRC-16/XMODEM of the bytes.
pub fn crc(data: &[u8]) -> u16 {
    data.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte) << 8, |crc, _| {
            if crc & 0x8000 == 0 {
                crc << 1
            } else {
                crc << 1 ^ 0x1021
            }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::crc;

    #[test]
    fn agrees_with_the_standard_s_check_value() {
        assert_eq!(crc(b"123456789"), 0x31C3);
        assert_eq!(crc(b""), 0);
    }
}
