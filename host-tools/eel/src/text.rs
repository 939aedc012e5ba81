//! A frame as a line for people.

use std::io::{Result, Write};

use eel_protocol::messages::{Choices, Signal};
use eel_protocol::{Cob, HEAD_NODE, VERTEBRAE, emergency};
use eel_transport::{Content, ErrorFrame, Received};

use crate::decode::{Decoded, decimals, physical};
use crate::filter::Filter;
use crate::service::Service;

/// How lines look.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Whether colours are used.
    pub colour: bool,
    /// Whether identifier and bytes are shown.
    pub raw: bool,
    /// The time that is shown as 0, in nanoseconds.
    pub origin_ns: u64,
}

const DIM: &str = "\x1b[2m";
const BOLD: &str = "\x1b[1m";
const RED: &str = "\x1b[31m";
const CYAN: &str = "\x1b[36m";
const PLAIN: &str = "\x1b[0m";

impl Look {
    /// Writes `text` in a colour, or as it is.
    fn paint(self, out: &mut dyn Write, colour: &str, text: std::fmt::Arguments<'_>) -> Result<()> {
        if self.colour {
            write!(out, "{colour}{text}{PLAIN}")
        } else {
            out.write_fmt(text)
        }
    }

    /// Writes a time in seconds.
    fn time(self, out: &mut dyn Write, time_ns: u64) -> Result<()> {
        let sign = if time_ns < self.origin_ns { "-" } else { "" };
        let micros = time_ns.abs_diff(self.origin_ns) / 1_000;
        let (seconds, micros) = (micros / 1_000_000, micros % 1_000_000);
        self.paint(out, DIM, format_args!("{sign}{seconds:>5}.{micros:06}"))
    }

    /// Writes what was received as one line.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn line(self, out: &mut dyn Write, seen: &Seen<'_>, filter: &Filter) -> Result<()> {
        let received = seen.received;
        self.time(out, received.time_ns)?;
        write!(out, "  ")?;
        match &received.content {
            Content::Frame(frame) => self.frame(out, &Decoded::of(frame), seen, filter)?,
            Content::Error(error) => self.error(out, error)?,
        }
        writeln!(out)
    }

    fn error(self, out: &mut dyn Write, error: &ErrorFrame) -> Result<()> {
        self.paint(
            out,
            RED,
            format_args!("bus error   {}", ErrorWords(error.classes)),
        )
    }

    fn frame(
        self,
        out: &mut dyn Write,
        decoded: &Decoded<'_>,
        seen: &Seen<'_>,
        filter: &Filter,
    ) -> Result<()> {
        if self.raw {
            self.bytes(out, decoded)?;
        }
        match decoded.node() {
            Some(HEAD_NODE) => write!(out, "head         ")?,
            Some(node) if node <= VERTEBRAE => write!(out, "vertebra {node:<2}  ")?,
            Some(node) => write!(out, "node {node:<8}")?,
            None => write!(out, "             ")?,
        }
        self.paint(out, BOLD, format_args!("{:<12}", decoded.name()))?;
        for (signal, raw) in decoded.signals() {
            // A flag is told when it is set.
            let is_told = signal.bits > 1 || raw != 0;
            if is_told && filter.shows(decoded.name(), signal.name) {
                self.signal(out, signal, raw)?;
            }
        }
        self.service(out, decoded, seen)?;
        if let (Some(Cob::Emergency(_)), Some(code)) = (decoded.cob, decoded.raw("code"))
            && let Some(known) = u16::try_from(code).ok().and_then(emergency::from_code)
        {
            write!(out, "  {}: {}", known.severity.name(), known.sentence)?;
        }
        if let Some(problem) = decoded.problem {
            write!(out, "  ")?;
            self.paint(out, RED, format_args!("! {problem}"))?;
        }
        Ok(())
    }

    /// Writes identifier and bytes in columns.
    fn bytes(self, out: &mut dyn Write, decoded: &Decoded<'_>) -> Result<()> {
        let width = if decoded.frame.is_extended() { 8 } else { 3 };
        write!(out, "{:0width$X}", decoded.frame.raw_id())?;
        if decoded.frame.is_remote() {
            return write!(out, " {:<25}", "remote");
        }
        for place in 0..8 {
            match decoded.frame.data().get(place) {
                Some(byte) => write!(out, " {byte:02X}")?,
                None => write!(out, "   ")?,
            }
        }
        write!(out, "  ")
    }

    fn signal(self, out: &mut dyn Write, signal: &Signal, raw: i64) -> Result<()> {
        write!(out, "  ")?;
        self.paint(out, CYAN, format_args!("{}", signal.name))?;
        if signal.bits == 1 {
            return Ok(());
        }
        write!(out, " ")?;
        match (signal.choices, signal.choices.name(raw)) {
            (_, Some(name)) => write!(out, "{name}"),
            (Choices::Emergency, None) => write!(out, "0x{raw:04X}"),
            _ if signal.name == "crc" || signal.name == "register" => write!(out, "0x{raw:02X}"),
            _ if signal.scale.denominator == 1 => write!(out, "{raw}"),
            _ => {
                let digits = decimals(signal.scale.denominator);
                write!(out, "{:.digits$}", physical(signal, raw))
            }
        }?;
        if signal.unit.is_empty() {
            Ok(())
        } else {
            write!(out, " {}", signal.unit)
        }
    }

    /// Writes what has no signals.
    fn service(self, out: &mut dyn Write, decoded: &Decoded<'_>, seen: &Seen<'_>) -> Result<()> {
        let data = decoded.frame.data();
        if decoded.message.is_some() {
            return Ok(());
        }
        if decoded.frame.is_remote() {
            let (id, length) = (decoded.frame.raw_id(), decoded.frame.length());
            return write!(out, "  id 0x{id:X} remote frame, asks for {length} bytes");
        }
        match Service::of(decoded, seen.is_segment) {
            Some(service) => write!(out, "  {service}"),
            _ if self.raw => Ok(()),
            _ => {
                write!(out, "  id 0x{:X}", decoded.frame.raw_id())?;
                data.iter().try_for_each(|byte| write!(out, " {byte:02X}"))
            }
        }
    }
}

/// What was received, and what is known of it from what came before.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// What was received.
    pub received: &'a Received,
    /// Whether it is a bare segment of an SDO block transfer.
    pub is_segment: bool,
}

/// The classes of an error report in words (`linux/can/error.h`).
pub struct ErrorWords(pub u32);

const ERROR_CLASSES: [&str; 10] = [
    "transmit timeout",
    "lost arbitration",
    "controller",
    "protocol violation",
    "transceiver",
    "no acknowledge",
    "bus off",
    "bus error",
    "controller restarted",
    "error counters",
];

impl std::fmt::Display for ErrorWords {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut first = true;
        for (bit, name) in ERROR_CLASSES.iter().enumerate() {
            if self.0 & (1 << bit) != 0 {
                write!(out, "{}{name}", if first { "" } else { ", " })?;
                first = false;
            }
        }
        if first {
            write!(out, "classes 0x{:X}", self.0)
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use eel_protocol::{Counter, Frame, Mode, NodeId, Target};
    use eel_units::Angle;

    use super::*;

    fn line(look: Look, frame: Frame) -> String {
        let content = Content::Frame(frame);
        let received = Received {
            time_ns: 12_345_678_000,
            content,
            direction: None,
        };
        let mut out = Vec::new();
        let seen = Seen {
            received: &received,
            is_segment: false,
        };
        look.line(&mut out, &seen, &Filter::default()).unwrap();
        String::from_utf8(out).unwrap()
    }

    const LOOK: Look = Look {
        colour: false,
        raw: false,
        origin_ns: 12_000_000_000,
    };

    #[test]
    fn a_target_is_a_line_with_names_and_units() {
        let target = Target {
            yaw: Angle::from_tenth_milliradians(-1_234),
            pitch: Angle::ZERO,
            roll: Angle::from_tenth_milliradians(5),
            mode: Mode::Run,
            counter: Counter::new(9).unwrap(),
        };
        let frame = target.to_frame(NodeId::new(3).unwrap()).unwrap();
        let text = line(LOOK, frame);
        let crc = frame.data()[7];
        let expected = format!(
            "    0.345678  vertebra 3   target        yaw -0.1234 rad  pitch 0.0000 rad  \
             roll 0.0005 rad  mode run  counter 9  crc 0x{crc:02X}\n"
        );
        assert_eq!(text, expected);
        assert!(line(Look { raw: true, ..LOOK }, frame).contains("203 2E FB 00 00 05 00 94 "));
    }

    #[test]
    fn an_emergency_is_told_in_a_sentence() {
        let frame = Frame::standard(0x087, &[0x10, 0x23, 3, 2, 1, 0x39, 0x30, 0]).unwrap();
        let text = line(LOOK, frame);
        assert!(
            text.contains("code over-current  register 0x03  motor 2  limit peak  detail 12345")
        );
        assert!(text.contains("fault: A motor's current passed its hard limit"));
    }

    #[test]
    fn colours_are_there_only_when_asked_for() {
        let frame = Frame::standard(0x70A, &[5]).unwrap();
        assert!(!line(LOOK, frame).contains('\x1b'));
        assert!(
            line(
                Look {
                    colour: true,
                    ..LOOK
                },
                frame
            )
            .contains('\x1b')
        );
    }

    #[test]
    fn what_nobody_knows_is_shown_as_it_is() {
        let frame = Frame::standard(0x400, &[1, 0xAB]).unwrap();
        assert!(line(LOOK, frame).contains("unknown       id 0x400 01 AB"));
    }
}
