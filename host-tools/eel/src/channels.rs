//! Which SDO frames are bare segments of a block transfer.
//!
//! Such a frame has a number where others have a command (CiA 301, 7.2.4.3.11 and 7.2.4.3.15), so that
//! what came before tells what it is.

use eel_protocol::{Cob, Frame};

use crate::sdo::Side;

/// The SDO channel of one node.
#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    /// Who sends segments at the moment.
    sender: Option<Side>,
    /// The number of the last segment, once it was marked as such.
    last: Option<u8>,
}

/// The SDO channels of a bus.
#[derive(Clone, Debug)]
pub struct Channels([Channel; 128]);

impl Default for Channels {
    fn default() -> Self {
        Self([Channel::default(); 128])
    }
}

impl Channels {
    /// Takes every frame of the bus in its order and tells whether it is a bare segment.
    pub fn is_segment(&mut self, frame: &Frame) -> bool {
        let (node, side) = match frame.cob_id().map(Cob::from_id) {
            Some(Cob::SdoRequest(node)) => (node, Side::Request),
            Some(Cob::SdoResponse(node)) => (node, Side::Response),
            _ => return false,
        };
        let channel = self.0.get_mut(usize::from(node));
        match (channel, frame.data()) {
            (Some(channel), &[command, first, ..]) => channel.take(side, command, first),
            _ => false,
        }
    }
}

impl Channel {
    fn take(&mut self, side: Side, command: u8, first: u8) -> bool {
        const ABORT: u8 = 0x80;
        if command == ABORT {
            *self = Self::default();
            return false;
        }
        if self.sender == Some(side) && self.last.is_none() {
            // Once the last segment is on its way, only an acknowledgement can ask for more.
            if command & 0x80 != 0 {
                self.last = Some(command & 0x7F);
            }
            return true;
        }
        match (side, command) {
            // The server is ready for segments, or the client asks for them.
            (Side::Response, 0xA0 | 0xA4) => *self = Self::sending(Side::Request),
            (Side::Request, 0xA3) => *self = Self::sending(Side::Response),
            (_, 0xA2) if self.last == Some(first) => self.sender = None,
            (_, 0xA2) => self.last = None,
            _ => {}
        }
        if self.sender.is_none() {
            self.last = None;
        }
        false
    }

    const fn sending(side: Side) -> Self {
        Self {
            sender: Some(side),
            last: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segments(frames: &[(u16, [u8; 2])]) -> Vec<bool> {
        let mut channels = Channels::default();
        frames
            .iter()
            .map(|(id, [command, first])| {
                let data = [*command, *first, 0, 0, 0, 0, 0, 0];
                channels.is_segment(&Frame::standard(*id, &data).unwrap())
            })
            .collect()
    }

    #[test]
    fn a_block_download_with_a_lost_segment() {
        let frames = [
            (0x603, [0xC6, 0x01]),
            (0x583, [0xA4, 0x01]),
            (0x603, [0x01, 0xAA]),
            // Segment 2 was lost on the way.
            (0x603, [0x83, 0xAA]),
            (0x583, [0xA2, 1]),
            (0x603, [0x01, 0xAA]),
            (0x603, [0x82, 0xAA]),
            (0x583, [0xA2, 2]),
            (0x603, [0xC5, 0x34]),
            (0x583, [0xA1, 0]),
            (0x603, [0x40, 0x00]),
        ];
        let expected = [
            false, false, true, true, false, true, true, false, false, false, false,
        ];
        assert_eq!(segments(&frames), expected);
    }

    #[test]
    fn a_block_upload_beside_another_node_and_one_that_is_aborted() {
        let frames = [
            (0x603, [0xA4, 0x00]),
            (0x583, [0xC6, 0x00]),
            (0x603, [0xA3, 0]),
            (0x583, [0x01, 0xC1]),
            (0x584, [0x43, 0x00]),
            (0x583, [0x82, 0xC1]),
            (0x603, [0xA2, 2]),
            (0x583, [0xC9, 0x34]),
            (0x603, [0xA1, 0]),
            (0x603, [0xA3, 0]),
            (0x583, [0x01, 0]),
            (0x603, [0x80, 0]),
            (0x583, [0x43, 0]),
        ];
        let expected = [
            false, false, false, true, false, true, false, false, false, false, true, false, false,
        ];
        assert_eq!(segments(&frames), expected);
    }
}
