//! What a node may send, by CiA 301 and CiA 305, written down without a look at the node.

use eel_canopen::Frame;

/// The abort codes of CiA 301, 7.2.4.3.17, table 22.
const ABORTS: [u32; 31] = [
    0x0503_0000,
    0x0504_0000,
    0x0504_0001,
    0x0504_0002,
    0x0504_0003,
    0x0504_0004,
    0x0504_0005,
    0x0601_0000,
    0x0601_0001,
    0x0601_0002,
    0x0602_0000,
    0x0604_0041,
    0x0604_0042,
    0x0604_0043,
    0x0604_0047,
    0x0606_0000,
    0x0607_0010,
    0x0607_0012,
    0x0607_0013,
    0x0609_0011,
    0x0609_0030,
    0x0609_0031,
    0x0609_0032,
    0x0609_0036,
    0x060A_0023,
    0x0800_0000,
    0x0800_0020,
    0x0800_0021,
    0x0800_0022,
    0x0800_0023,
    0x0800_0024,
];

/// What the node may send just now.
#[derive(Clone, Debug, Default)]
pub struct Allowed {
    /// Identifiers of TPDOs and emergencies, as objects 0x1014 and 0x1800 onwards have said so far.
    pub cob_ids: Vec<u16>,
    /// Whether segments of a block upload may come, whose first byte is a sequence number.
    pub segments: bool,
}

impl Allowed {
    /// Checks a frame of the node `id`.
    pub fn check(&self, id: u8, frame: &Frame) {
        let data = frame.data();
        assert!(!frame.is_remote() && !frame.is_extended(), "{frame:?}");
        let cob_id = frame.cob_id().expect("a standard frame");
        let id = u16::from(id);
        let legal = if cob_id == 0x7E4 {
            is_lss(data)
        } else if cob_id == 0x700 + id {
            matches!(data, [0 | 4 | 5 | 127])
        } else if cob_id == 0x580 + id {
            self.is_sdo(data)
        } else {
            self.cob_ids.contains(&cob_id) && (1..=8).contains(&data.len())
        };
        assert!(legal, "node {id} sent {frame:02X?}, allowed {self:03X?}");
    }

    /// Tells whether these bytes are an answer of an SDO server.
    fn is_sdo(&self, data: &[u8]) -> bool {
        let &[command, a, b, c, d, e, f, g] = data else {
            return false;
        };
        if command == 0x80 {
            return ABORTS.contains(&u32::from_le_bytes([d, e, f, g]));
        }
        if self.segments && command & 0x7F != 0 {
            return true;
        }
        let zeros = |bytes: &[u8]| bytes.iter().all(|byte| *byte == 0);
        match command {
            // Segment of an upload: toggle, unused bytes, end.
            0x00..=0x1F => command & 1 != 0 || command & 0x0E == 0,
            0x20 | 0x30 => zeros(&[a, b, c, d, e, f, g]),
            0x60 => zeros(&[d, e, f, g]),
            0x41 | 0x43 => true,
            0x47 => zeros(&[g]),
            0x4B => zeros(&[f, g]),
            0x4F => zeros(&[e, f, g]),
            0xA0 | 0xA4 => matches!(d, 1..=127) && zeros(&[e, f, g]),
            0xA2 => a <= 127 && matches!(b, 1..=127) && zeros(&[c, d, e, f, g]),
            0xA1 => zeros(&[a, b, c, d, e, f, g]),
            0xC0 | 0xC2 | 0xC4 | 0xC6 => true,
            0xC1..=0xDD if command & 3 == 1 => zeros(&[c, d, e, f, g]),
            _ => false,
        }
    }
}

/// Tells whether CiA 301, table 41, keeps an identifier for NMT, SDO, heartbeats, LSS or what is to come.
pub const fn is_reserved(cob_id: u16) -> bool {
    matches!(
        cob_id,
        0x000..=0x07F | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..=0x6FF | 0x701..
    )
}

/// Tells whether these bytes are an answer of an LSS slave.
fn is_lss(data: &[u8]) -> bool {
    let &[command, a, b, c, d, e, f, g] = data else {
        return false;
    };
    let zeros = |bytes: &[u8]| bytes.iter().all(|byte| *byte == 0);
    match command {
        0x11 | 0x13 | 0x17 => zeros(&[c, d, e, f, g]) && (a == 0xFF || b == 0),
        0x44 | 0x4F | 0x50 => zeros(&[a, b, c, d, e, f, g]),
        0x5A..=0x5D => zeros(&[e, f, g]),
        0x5E => zeros(&[b, c, d, e, f, g]) && (a == 0xFF || matches!(a, 1..=127)),
        _ => false,
    }
}
