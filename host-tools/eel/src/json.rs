//! A frame as a JSON object on one line; the schema is part of `eel decode --help`.

use std::fmt::Display;

use eel_transport::candump::Direction;
use eel_transport::{Content, ErrorFrame, frame_bits};
use serde::ser::{Serialize, SerializeMap, Serializer};

use crate::decode::{Decoded, physical};
use crate::filter::Filter;
use crate::service::Service;
use crate::text::{ErrorWords, Seen};

/// The schema, for `--help`.
pub const SCHEMA: &str = "\
JSON lines, one object a frame. Always: time_s (number, s), id (number), extended (bool), remote
(bool), data (string of hexadecimal digits), bits (number: exact length on the wire with stuff bits
and interframe space), message (string: nmt, sync, emergency, pose, target, effort, moment,
heartbeat, sdo-request, sdo-response, lss-request, lss-response, time, unknown). Where they apply:
node (number), signals (object: name to number in SI units, or to the name of a code), text
(string: an SDO, LSS or TIME in words), problem (string), direction (\"received\" or \"transmitted\").
An error report of the interface: time_s, error (string), classes (number), data.";

/// What was received, to be written as JSON.
pub struct Line<'a> {
    /// What was received.
    pub seen: Seen<'a>,
    /// Which signals are written.
    pub filter: &'a Filter,
}

impl Serialize for Line<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("time_s", &(self.seen.received.time_ns as f64 / 1e9))?;
        match &self.seen.received.content {
            Content::Frame(frame) => self.frame(&mut map, &Decoded::of(frame))?,
            Content::Error(error) => report(&mut map, error)?,
        }
        map.end()
    }
}

impl Line<'_> {
    fn frame<M: SerializeMap>(&self, map: &mut M, decoded: &Decoded<'_>) -> Result<(), M::Error> {
        let frame = decoded.frame;
        map.serialize_entry("id", &frame.raw_id())?;
        map.serialize_entry("extended", &frame.is_extended())?;
        map.serialize_entry("remote", &frame.is_remote())?;
        map.serialize_entry("data", &Text(Hex(frame.data())))?;
        map.serialize_entry("bits", &frame_bits(frame))?;
        map.serialize_entry("message", decoded.name())?;
        if let Some(node) = decoded.node() {
            map.serialize_entry("node", &node)?;
        }
        if decoded.message.is_some() {
            map.serialize_entry(
                "signals",
                &Signals {
                    decoded,
                    filter: self.filter,
                },
            )?;
        }
        if let Some(service) = Service::of(decoded, self.seen.is_segment) {
            map.serialize_entry("text", &Text(service))?;
        }
        if let Some(problem) = decoded.problem {
            map.serialize_entry("problem", &Text(problem))?;
        }
        match self.seen.received.direction {
            None => Ok(()),
            Some(Direction::Received) => map.serialize_entry("direction", "received"),
            Some(Direction::Transmitted) => map.serialize_entry("direction", "transmitted"),
        }
    }
}

fn report<M: SerializeMap>(map: &mut M, error: &ErrorFrame) -> Result<(), M::Error> {
    map.serialize_entry("error", &Text(ErrorWords(error.classes)))?;
    map.serialize_entry("classes", &error.classes)?;
    map.serialize_entry("data", &Text(Hex(&error.data)))
}

/// Something printable as a JSON string.
struct Text<T>(T);

impl<T: Display> Serialize for Text<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&self.0)
    }
}

/// Bytes as hexadecimal digits.
struct Hex<'a>(&'a [u8]);

impl Display for Hex<'_> {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.iter().try_for_each(|byte| write!(out, "{byte:02X}"))
    }
}

/// The signals of a frame as an object.
struct Signals<'a> {
    decoded: &'a Decoded<'a>,
    filter: &'a Filter,
}

impl Serialize for Signals<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (signal, raw) in self.decoded.signals() {
            if !self.filter.shows(self.decoded.name(), signal.name) {
                continue;
            }
            match signal.choices.name(raw) {
                Some(name) => map.serialize_entry(signal.name, name)?,
                None if signal.scale.denominator == 1 => map.serialize_entry(signal.name, &raw)?,
                None => map.serialize_entry(signal.name, &physical(signal, raw))?,
            }
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use eel_protocol::Frame;
    use eel_transport::Received;
    use serde_json::json;

    use super::*;

    fn line(frame: Frame) -> serde_json::Value {
        let content = Content::Frame(frame);
        let received = Received {
            time_ns: 1_500_000_000,
            content,
            direction: None,
        };
        serde_json::to_value(Line {
            seen: Seen {
                received: &received,
                is_segment: false,
            },
            filter: &Filter::default(),
        })
        .unwrap()
    }

    #[test]
    fn a_frame_is_an_object_as_the_schema_says() {
        let frame = Frame::standard(0x283, &[0xCC, 0xF7, 0, 0, 0xD0, 7, 1, 0x3F]).unwrap();
        let expected = json!({
            "time_s": 1.5, "id": 643, "extended": false, "remote": false,
            "data": "CCF70000D007013F", "bits": frame_bits(&frame), "message": "effort", "node": 3,
            "signals": {
                "motor1": -2.1, "motor2": 0.0, "motor3": 2.0,
                "limit1": "peak", "limit2": "none", "limit3": "off",
                "target_limited": 1, "moment_limited": 1, "command_lost": 0, "warning": 0,
            },
        });
        assert_eq!(line(frame), expected);
    }

    #[test]
    fn an_sdo_is_told_in_words_and_a_wrong_frame_says_what_is_wrong() {
        let sdo = Frame::standard(0x603, &[0x40, 0x10, 0x20, 1, 0, 0, 0, 0]).unwrap();
        assert_eq!(line(sdo)["text"], "read 2010:1 pose.yaw");
        let short = line(Frame::standard(0x183, &[0; 7]).unwrap());
        assert_eq!(short["problem"], "the message has 8 bytes");
        assert_eq!(short["signals"].get("crc"), None);
    }
}
