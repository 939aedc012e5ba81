//! What an SDO frame says, in words.

use std::fmt;

use eel_client::Multiplexor;
use eel_protocol::export::communication_name;

use crate::object;
use crate::value::Value as Decoded;

/// Which way an SDO frame goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// From the client.
    Request,
    /// From the node.
    Response,
}

/// An SDO frame, to be printed.
pub struct Sdo<'a> {
    /// Which way it goes.
    pub side: Side,
    /// Its eight bytes.
    pub data: &'a [u8],
    /// Whether it is a bare segment of a block transfer.
    pub is_segment: bool,
}

impl fmt::Display for Sdo<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let &[command, low, high, subindex, a, b, c, d] = self.data else {
            return write!(out, "an SDO has 8 bytes");
        };
        if self.is_segment {
            return self.block_segment(out, command);
        }
        let object = Object {
            index: u16::from_le_bytes([low, high]),
            subindex,
        };
        if command == 0x80 {
            let code = u32::from_le_bytes([a, b, c, d]);
            return write!(
                out,
                "abort {object}: {} (0x{code:08X})",
                eel_client::abort(code).meaning
            );
        }
        let value = Value {
            object,
            command,
            data: [a, b, c, d],
        };
        match (self.side, command >> 5) {
            (Side::Request, 1) => write!(out, "write {object}{value}"),
            (Side::Request, 2) => write!(out, "read {object}"),
            (Side::Response, 2) => write!(out, "answer {object}{value}"),
            (Side::Response, 3) => write!(out, "written {object}"),
            (Side::Request, 0) | (Side::Response, 0) => self.segment(out, command),
            (Side::Request, 3) | (Side::Response, 1) => write!(out, "segment, please go on"),
            (Side::Request, 5) => read_in_blocks(out, object, command, low, [a, b, c, d]),
            (Side::Request, 6) => {
                send_in_blocks(out, "write", object, command, [low, high], [a, b, c, d])
            }
            (Side::Response, 5) => take_in_blocks(out, object, command, [low, high], a),
            (Side::Response, 6) => {
                send_in_blocks(out, "answer", object, command, [low, high], [a, b, c, d])
            }
            _ => write!(out, "unknown command 0x{command:02X}"),
        }
    }
}

impl Sdo<'_> {
    /// Prints a segment of a block transfer.
    fn block_segment(&self, out: &mut fmt::Formatter<'_>, number: u8) -> fmt::Result {
        let last = if number & 0x80 != 0 {
            "last block"
        } else {
            "block"
        };
        write!(out, "{last} segment {}", number & 0x7F)?;
        let bytes = self.data.iter().skip(1);
        bytes
            .into_iter()
            .try_for_each(|byte| write!(out, " {byte:02X}"))
    }

    /// Prints a segment's bytes.
    fn segment(&self, out: &mut fmt::Formatter<'_>, command: u8) -> fmt::Result {
        let length = 7 - usize::from((command >> 1) & 7);
        let last = if command & 1 != 0 {
            "last segment"
        } else {
            "segment"
        };
        write!(out, "{last}")?;
        self.data
            .iter()
            .skip(1)
            .take(length)
            .try_for_each(|byte| write!(out, " {byte:02X}"))
    }
}

/// A client that uploads in blocks.
fn read_in_blocks(
    out: &mut fmt::Formatter<'_>,
    object: Object,
    command: u8,
    received: u8,
    [size, ..]: [u8; 4],
) -> fmt::Result {
    match command & 3 {
        0 => write!(out, "read {object} in blocks of {size} segments"),
        1 => write!(out, "block transfer ends"),
        2 => write!(
            out,
            "block received up to segment {received}, next of {} segments",
            object.index >> 8
        ),
        _ => write!(out, "blocks, please"),
    }
}

/// A side that sends blocks: a client that writes, or a server that answers.
fn send_in_blocks(
    out: &mut fmt::Formatter<'_>,
    verb: &str,
    object: Object,
    command: u8,
    crc: [u8; 2],
    size: [u8; 4],
) -> fmt::Result {
    if command & 1 != 0 {
        let (unused, crc) = (command >> 2 & 7, u16::from_le_bytes(crc));
        return write!(
            out,
            "blocks end, {unused} bytes of the last segment unused, CRC 0x{crc:04X}"
        );
    }
    write!(out, "{verb} {object} in blocks")?;
    if command & 2 == 0 {
        return Ok(());
    }
    write!(out, ", {} bytes", u32::from_le_bytes(size))
}

/// A server that takes blocks.
fn take_in_blocks(
    out: &mut fmt::Formatter<'_>,
    object: Object,
    command: u8,
    [received, next]: [u8; 2],
    size: u8,
) -> fmt::Result {
    match command & 3 {
        0 => write!(out, "{object} in blocks of {size} segments, please"),
        1 => write!(out, "written in blocks"),
        _ => write!(
            out,
            "block received up to segment {received}, next of {next} segments"
        ),
    }
}

/// An object with its name.
#[derive(Clone, Copy)]
struct Object {
    index: u16,
    subindex: u8,
}

impl Object {
    /// Returns what is known of it.
    fn known(self) -> Option<object::Object> {
        object::Object::at(Multiplexor::new(self.index, self.subindex))
    }
}

impl fmt::Display for Object {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:04X}:{}", self.index, self.subindex)?;
        if let Some(known) = self.known() {
            return write!(out, " {}", known.name);
        }
        communication_name(self.index).map_or(Ok(()), |name| write!(out, " {name}"))
    }
}

/// What an initiate frame carries.
struct Value {
    object: Object,
    command: u8,
    data: [u8; 4],
}

impl fmt::Display for Value {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = u32::from_le_bytes(self.data);
        if self.command & 2 == 0 {
            return write!(out, ", {number} bytes in segments");
        }
        let length = match self.command & 1 {
            1 => 4 - usize::from((self.command >> 2) & 3),
            _ => 4,
        };
        let bytes = self.data.get(..length).unwrap_or(&self.data);
        if let Some(known) = self.object.known() {
            let value = Decoded::of(&known, bytes);
            return write!(out, " = {}", value.text(&known));
        }
        write!(out, " = 0x")?;
        bytes
            .iter()
            .rev()
            .try_for_each(|byte| write!(out, "{byte:02X}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(data: [u8; 8]) -> String {
        Sdo {
            side: Side::Request,
            data: &data,
            is_segment: false,
        }
        .to_string()
    }

    fn response(data: [u8; 8]) -> String {
        Sdo {
            side: Side::Response,
            data: &data,
            is_segment: false,
        }
        .to_string()
    }

    #[test]
    fn says_what_is_read_and_written() {
        assert_eq!(
            request([0x40, 0x10, 0x20, 1, 0, 0, 0, 0]),
            "read 2010:1 pose.yaw"
        );
        assert_eq!(
            response([0x4B, 0x10, 0x20, 1, 0x18, 0xFC, 0, 0]),
            "answer 2010:1 pose.yaw = -0.1000 rad"
        );
        assert_eq!(
            request([0x2B, 0x17, 0x10, 0, 0xC8, 0, 0, 0]),
            "write 1017:0 heartbeat.producer = 0.200 s"
        );
        assert_eq!(
            response([0x60, 0x17, 0x10, 0, 0, 0, 0, 0]),
            "written 1017:0 heartbeat.producer"
        );
        assert_eq!(
            response([0x41, 0x08, 0x10, 0, 17, 0, 0, 0]),
            "answer 1008:0 device.name, 17 bytes in segments"
        );
        assert_eq!(response([0x0D, 0x61, 0, 0, 0, 0, 0, 0]), "last segment 61");
        assert_eq!(
            response([0x80, 0x10, 0x20, 9, 0x11, 0, 9, 6]),
            "abort 2010:9: no such subindex (0x06090011)"
        );
        assert_eq!(request([0xFF; 8]), "unknown command 0xFF");
    }

    #[test]
    fn says_what_a_block_transfer_does() {
        assert_eq!(
            request([0xC6, 0x01, 0x20, 1, 0xD0, 0x07, 0, 0]),
            "write 2001:1 moment.x in blocks, 2000 bytes"
        );
        assert_eq!(
            response([0xA4, 0x01, 0x20, 1, 127, 0, 0, 0]),
            "2001:1 moment.x in blocks of 127 segments, please"
        );
        assert_eq!(
            response([0xA2, 5, 127, 0, 0, 0, 0, 0]),
            "block received up to segment 5, next of 127 segments"
        );
        assert_eq!(
            request([0xA2, 5, 64, 0, 0, 0, 0, 0]),
            "block received up to segment 5, next of 64 segments"
        );
        assert_eq!(
            request([0xCD, 0xC3, 0x31, 0, 0, 0, 0, 0]),
            "blocks end, 3 bytes of the last segment unused, CRC 0x31C3"
        );
        assert_eq!(
            request([0xA4, 0x01, 0x20, 1, 127, 0, 0, 0]),
            "read 2001:1 moment.x in blocks of 127 segments"
        );
        let segment = Sdo {
            side: Side::Response,
            data: &[0x82, 1, 2, 3, 4, 5, 6, 7],
            is_segment: true,
        };
        assert_eq!(
            segment.to_string(),
            "last block segment 2 01 02 03 04 05 06 07"
        );
    }
}
