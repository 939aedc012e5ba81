//! What an LSS frame, and TIME, say in words (CiA 305; CiA 301, 7.2.6).

use std::fmt;

use crate::sdo::Side;

/// An LSS frame, to be printed.
pub struct Lss<'a> {
    /// Which way it goes.
    pub side: Side,
    /// Its bytes.
    pub data: &'a [u8],
}

impl fmt::Display for Lss<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let &[command, a, b, c, d, e, f, g] = self.data else {
            return write!(out, "an LSS frame has 8 bytes");
        };
        let number = u32::from_le_bytes([a, b, c, d]);
        match self.side {
            Side::Request => request(out, command, number, [e, f, g]),
            Side::Response => response(out, command, number),
        }
    }
}

fn request(
    out: &mut fmt::Formatter<'_>,
    command: u8,
    number: u32,
    [bit, place, next]: [u8; 3],
) -> fmt::Result {
    let [first, second, ..] = number.to_le_bytes();
    match command {
        0x04 if first == 0 => write!(out, "all: wait"),
        0x04 => write!(out, "all: be configured"),
        0x40..=0x43 => write!(out, "select {} 0x{number:08X}", part(command - 0x40)),
        0x46 | 0x47 => write!(out, "identify {} 0x{number:08X}", part(command - 0x46)),
        0x48 | 0x4A => write!(
            out,
            "identify {} from 0x{number:08X}",
            part((command - 0x48) / 2 + 2)
        ),
        0x49 | 0x4B => write!(
            out,
            "identify {} to 0x{number:08X}",
            part((command - 0x49) / 2 + 2)
        ),
        0x4C => write!(out, "is there a node without an id?"),
        0x51 if bit == 0x80 => write!(out, "fastscan: is there a node without an id?"),
        0x51 if bit == 0 && next != place => write!(
            out,
            "fastscan: {} 0x{number:08X}, next {}",
            part(place),
            part(next)
        ),
        0x51 => write!(
            out,
            "fastscan: {} 0x{number:08X} from bit {bit} up?",
            part(place)
        ),
        0x11 => write!(out, "node id {first}"),
        0x13 => write!(out, "bit timing: table {first}, entry {second}"),
        0x15 => write!(
            out,
            "activate the bit timing in {} ms",
            u16::from_le_bytes([first, second])
        ),
        0x17 => write!(out, "store"),
        0x5A..=0x5D => write!(out, "which {}?", part(command - 0x5A)),
        0x5E => write!(out, "which node id?"),
        _ => write!(out, "unknown command 0x{command:02X}"),
    }
}

fn response(out: &mut fmt::Formatter<'_>, command: u8, number: u32) -> fmt::Result {
    let [first, ..] = number.to_le_bytes();
    match (command, first) {
        (0x44, _) => write!(out, "selected"),
        (0x4F, _) => write!(out, "yes"),
        (0x50, _) => write!(out, "yes, without an id"),
        (0x11, 0) => write!(out, "node id taken"),
        (0x11, _) => write!(out, "node id refused, error {first}"),
        (0x13, 0) => write!(out, "bit timing taken"),
        (0x13, _) => write!(out, "bit timing refused, error {first}"),
        (0x17, 0) => write!(out, "stored"),
        (0x17, _) => write!(out, "not stored, error {first}"),
        (0x5A..=0x5D, _) => write!(out, "{} 0x{number:08X}", part(command - 0x5A)),
        (0x5E, _) => write!(out, "node id {first}"),
        _ => write!(out, "unknown command 0x{command:02X}"),
    }
}

/// Names a number of the identity.
const fn part(place: u8) -> &'static str {
    match place {
        0 => "vendor",
        1 => "product",
        2 => "revision",
        3 => "serial",
        _ => "number that is none",
    }
}

/// TIME, to be printed.
pub struct TimeOfDay<'a>(pub &'a [u8]);

impl fmt::Display for TimeOfDay<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let &[a, b, c, d, low, high] = self.0 else {
            return write!(out, "TIME has 6 bytes");
        };
        let ms = u32::from_le_bytes([a, b, c, d]) & 0x0FFF_FFFF;
        let days = u16::from_le_bytes([low, high]);
        let (seconds, ms) = (ms / 1_000, ms % 1_000);
        let (minutes, seconds) = (seconds / 60, seconds % 60);
        let (hours, minutes) = (minutes / 60, minutes % 60);
        write!(
            out,
            "{days} days after 1984-01-01, {hours:02}:{minutes:02}:{seconds:02}.{ms:03}"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn say(side: Side, data: [u8; 8]) -> String {
        Lss { side, data: &data }.to_string()
    }

    #[test]
    fn says_what_is_asked_and_answered() {
        let request = |data| say(Side::Request, data);
        let response = |data| say(Side::Response, data);
        assert_eq!(request([0x04, 1, 0, 0, 0, 0, 0, 0]), "all: be configured");
        assert_eq!(
            request([0x43, 0x0D, 0xF0, 0xFE, 0xCA, 0, 0, 0]),
            "select serial 0xCAFEF00D"
        );
        assert_eq!(
            request([0x51, 0, 0, 0, 0x80, 31, 3, 3]),
            "fastscan: serial 0x80000000 from bit 31 up?"
        );
        assert_eq!(
            request([0x4B, 1, 0, 0, 0, 0, 0, 0]),
            "identify serial to 0x00000001"
        );
        assert_eq!(
            response([0x11, 1, 0, 0, 0, 0, 0, 0]),
            "node id refused, error 1"
        );
        assert_eq!(response([0x5E, 3, 0, 0, 0, 0, 0, 0]), "node id 3");
    }

    #[test]
    fn says_the_time_of_day() {
        let noon = TimeOfDay(&[0x00, 0x2E, 0x93, 0x02, 0x10, 0x3D]);
        assert_eq!(
            noon.to_string(),
            "15632 days after 1984-01-01, 12:00:00.000"
        );
        assert_eq!(TimeOfDay(&[0; 5]).to_string(), "TIME has 6 bytes");
    }
}
