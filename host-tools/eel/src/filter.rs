//! Which frames are shown.

use std::ops::RangeInclusive;
use std::str::FromStr;

use eel_protocol::messages::MESSAGES;
use eel_protocol::{Frame, HEAD_NODE};

use crate::decode::Decoded;

/// Names that stand for frames without signals.
const SERVICES: [&str; 6] = [
    "sdo-request",
    "sdo-response",
    "lss-request",
    "lss-response",
    "time",
    "unknown",
];

/// An identifier, or a range of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ids(RangeInclusive<u32>);

/// A node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node(u8);

/// A message or service, and perhaps one of its signals.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name {
    message: String,
    signal: Option<String>,
}

/// All conditions; a list without an entry lets everything through.
#[derive(Clone, Debug, Default)]
pub struct Filter {
    /// Identifiers.
    pub ids: Vec<Ids>,
    /// Nodes.
    pub nodes: Vec<Node>,
    /// Names.
    pub names: Vec<Name>,
}

impl FromStr for Ids {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| {
            let (digits, radix) = match text.strip_prefix("0x") {
                Some(digits) => (digits, 16),
                None => (text, 10),
            };
            let number = u32::from_str_radix(digits, radix)
                .ok()
                .filter(|id| *id <= 0x1FFF_FFFF);
            number.ok_or_else(|| {
                format!("{text:?} is no identifier: write 0x203, 515 or a range 0x200-0x20F")
            })
        };
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        Ok(Self(number(first)?..=number(last)?))
    }
}

impl FromStr for Node {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "head" => Ok(Self(HEAD_NODE)),
            _ => text
                .parse()
                .ok()
                .filter(|node| (1..=127).contains(node))
                .map(Self)
                .ok_or_else(|| format!("{text:?} is no node: write head or a number 1 to 127")),
        }
    }
}

impl FromStr for Name {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (message, signal) = match text.split_once('.') {
            Some((message, signal)) => (message, Some(signal)),
            None => (text, None),
        };
        let known = MESSAGES.iter().find(|known| known.name == message);
        if known.is_none() && (signal.is_some() || !SERVICES.contains(&message)) {
            let names = MESSAGES.iter().map(|known| known.name).chain(SERVICES);
            let names: Vec<_> = names.collect();
            return Err(format!(
                "there is no message {message:?}; there are {}",
                names.join(", ")
            ));
        }
        if let (Some(known), Some(signal)) = (known, signal)
            && !known.signals.iter().any(|other| other.name == signal)
        {
            let names: Vec<_> = known.signals.iter().map(|signal| signal.name).collect();
            let names = names.join(", ");
            return Err(format!(
                "{message} has no signal {signal:?}; it has {names}"
            ));
        }
        Ok(Self {
            message: message.to_owned(),
            signal: signal.map(str::to_owned),
        })
    }
}

impl Filter {
    /// Tells whether a frame is shown.
    pub fn passes(&self, decoded: &Decoded<'_>) -> bool {
        self.passes_id(decoded.frame)
            && (self.nodes.is_empty()
                || self.nodes.iter().any(|node| decoded.node() == Some(node.0)))
            && (self.names.is_empty()
                || self.names.iter().any(|name| name.message == decoded.name()))
    }

    fn passes_id(&self, frame: &Frame) -> bool {
        self.ids.is_empty() || self.ids.iter().any(|ids| ids.0.contains(&frame.raw_id()))
    }

    /// Tells whether a signal of a frame that is shown is shown too.
    pub fn shows(&self, message: &str, signal: &str) -> bool {
        self.names.is_empty()
            || self.names.iter().any(|name| {
                name.message == message && name.signal.as_deref().is_none_or(|own| own == signal)
            })
    }

    /// Tells whether nothing is hidden.
    pub const fn is_empty(&self) -> bool {
        self.ids.is_empty() && self.nodes.is_empty() && self.names.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passes(filter: &Filter, id: u16) -> bool {
        filter.passes(&Decoded::of(&Frame::standard(id, &[0; 8]).unwrap()))
    }

    #[test]
    fn conditions_of_one_kind_add_up_and_kinds_narrow() {
        let filter = Filter {
            ids: vec!["0x180-0x2FF".parse().unwrap()],
            nodes: vec!["3".parse().unwrap(), "10".parse().unwrap()],
            names: vec!["pose.yaw".parse().unwrap(), "effort".parse().unwrap()],
        };
        let passing: Vec<_> = (0..0x800).filter(|id| passes(&filter, *id)).collect();
        assert_eq!(passing, [0x183, 0x18A, 0x283, 0x28A]);
        assert!(filter.shows("pose", "yaw") && !filter.shows("pose", "roll"));
        assert!(filter.shows("effort", "motor1"));
        assert!((0..0x800).all(|id| passes(&Filter::default(), id)));
    }

    #[test]
    fn a_wrong_condition_says_what_is_possible() {
        let error = "pose.jaw".parse::<Name>().unwrap_err();
        assert_eq!(
            error,
            "pose has no signal \"jaw\"; it has yaw, pitch, roll, state, counter, crc"
        );
        assert!(
            "poze"
                .parse::<Name>()
                .unwrap_err()
                .contains("emergency, pose, target")
        );
        assert!("0x2G".parse::<Ids>().is_err());
        assert!("0".parse::<Node>().is_err());
        assert_eq!("head".parse(), Ok(Node(127)));
    }
}
