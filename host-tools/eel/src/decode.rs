//! From a frame to named signals, without an allocation.

use std::fmt;

use eel_protocol::messages::{Choices, Message, Signal};
use eel_protocol::{Cob, Frame, protection};

/// What a frame means.
pub struct Decoded<'a> {
    /// The frame.
    pub frame: &'a Frame,
    /// What its identifier stands for; `None` for 29 bits.
    pub cob: Option<Cob>,
    /// The message it carries.
    pub message: Option<&'static Message>,
    /// What is wrong with it.
    pub problem: Option<Problem>,
}

/// What is wrong with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Problem {
    /// It has another length than its message.
    Length {
        /// The length of the message.
        expected: u8,
    },
    /// Its protection byte does not match.
    Protection {
        /// The byte that would match.
        expected: u8,
    },
    /// A signal has a code that means nothing.
    Code {
        /// The name of the signal.
        signal: &'static str,
    },
}

impl fmt::Display for Problem {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { expected } => write!(out, "the message has {expected} bytes"),
            Self::Protection { expected } => {
                write!(out, "wrong protection byte, 0x{expected:02X} would match")
            }
            Self::Code { signal } => write!(out, "{signal} has a code that means nothing"),
        }
    }
}

impl<'a> Decoded<'a> {
    /// Reads a frame.
    pub fn of(frame: &'a Frame) -> Self {
        let cob = frame.cob_id().map(Cob::from_id);
        let message = cob.and_then(Message::of).filter(|_| !frame.is_remote());
        let problem = message.and_then(|message| find_problem(frame, message));
        Self {
            frame,
            cob,
            message,
            problem,
        }
    }

    /// Returns the node whose identifier the frame has.
    pub fn node(&self) -> Option<u8> {
        self.cob.and_then(Cob::node)
    }

    /// Returns the name of the message, or of the service.
    pub fn name(&self) -> &'static str {
        match (self.message, self.cob) {
            (Some(message), _) => message.name,
            (None, Some(Cob::SdoRequest(_))) => "sdo-request",
            (None, Some(Cob::SdoResponse(_))) => "sdo-response",
            (None, Some(Cob::LssRequest)) => "lss-request",
            (None, Some(Cob::LssResponse)) => "lss-response",
            (None, Some(Cob::Time)) => "time",
            _ => "unknown",
        }
    }

    /// Returns the signals that the frame has bytes for, with their raw numbers.
    pub fn signals(&self) -> impl Iterator<Item = (&'static Signal, i64)> {
        let signals = self.message.map_or(&[][..], |message| message.signals);
        let data = self.frame.data();
        signals
            .iter()
            .filter_map(move |signal| Some((signal, signal.raw(data)?)))
    }

    /// Returns the raw number of the signal `name`.
    pub fn raw(&self, name: &str) -> Option<i64> {
        self.signals()
            .find(|(signal, _)| signal.name == name)
            .map(|(_, raw)| raw)
    }
}

/// Holds a frame against its message: length, protection, codes.
fn find_problem(frame: &Frame, message: &'static Message) -> Option<Problem> {
    let data = frame.data();
    if data.len() != usize::from(message.length) {
        return Some(Problem::Length {
            expected: message.length,
        });
    }
    let is_protected = message
        .signals
        .last()
        .is_some_and(|signal| signal.name == "crc");
    if let (true, [body @ .., crc], Some(id)) = (is_protected, data, frame.cob_id()) {
        let expected = protection(body.try_into().ok()?, id);
        if expected != *crc {
            return Some(Problem::Protection { expected });
        }
        let counter = message
            .signals
            .iter()
            .find(|signal| signal.name == "counter")?;
        if counter.raw(data)? > 14 {
            return Some(Problem::Code {
                signal: counter.name,
            });
        }
    }
    let coded = message
        .signals
        .iter()
        .filter(|signal| is_closed(signal.choices));
    for signal in coded {
        if signal.choices.name(signal.raw(data)?).is_none() {
            return Some(Problem::Code {
                signal: signal.name,
            });
        }
    }
    None
}

/// Tells whether a number without a name is an error: emergencies may be another maker's.
const fn is_closed(choices: Choices) -> bool {
    !matches!(choices, Choices::None | Choices::Emergency)
}

/// Returns a raw number in the signal's unit, correctly rounded.
pub fn physical(signal: &Signal, raw: i64) -> f64 {
    (raw * i64::from(signal.scale.numerator)) as f64 / f64::from(signal.scale.denominator)
}

/// Returns how many decimals show every step of a scale, at most 6.
pub fn decimals(denominator: u32) -> usize {
    (0..6)
        .find(|digits| 10_u32.pow(*digits).is_multiple_of(denominator))
        .unwrap_or(6) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(id: u16, data: &[u8]) -> Option<Problem> {
        Decoded::of(&Frame::standard(id, data).unwrap()).problem
    }

    #[test]
    fn finds_what_is_wrong_with_a_frame() {
        assert_eq!(problem(0x703, &[5]), None);
        assert_eq!(
            problem(0x703, &[6]),
            Some(Problem::Code { signal: "state" })
        );
        assert_eq!(
            problem(0x703, &[5, 0]),
            Some(Problem::Length { expected: 1 })
        );
        let body = [1, 0, 2, 0, 3, 0, 0x14];
        let crc = protection(&body, 0x203);
        let with = |crc| [1, 0, 2, 0, 3, 0, 0x14, crc];
        assert_eq!(problem(0x203, &with(crc)), None);
        assert_eq!(
            problem(0x203, &with(crc ^ 1)),
            Some(Problem::Protection { expected: crc })
        );
        assert_eq!(problem(0x081, &[0x34, 0x12, 1, 0, 0, 0, 0, 0]), None);
    }

    #[test]
    fn numbers_come_out_in_their_unit() {
        let frame = Frame::standard(0x283, &[0xCC, 0xF7, 0, 0, 0xD0, 7, 0, 0]).unwrap();
        let decoded = Decoded::of(&frame);
        let values: Vec<_> = decoded
            .signals()
            .take(3)
            .map(|(signal, raw)| (signal.name, physical(signal, raw), signal.unit))
            .collect();
        let expected = [
            ("motor1", -2.1, "N.m"),
            ("motor2", 0.0, "N.m"),
            ("motor3", 2.0, "N.m"),
        ];
        assert_eq!(values, expected);
    }

    #[test]
    fn decimals_show_every_step() {
        assert_eq!(
            [1, 10, 1_000, 10_000, 1_000_000, 32_768].map(decimals),
            [0, 1, 3, 4, 6, 6]
        );
    }
}
