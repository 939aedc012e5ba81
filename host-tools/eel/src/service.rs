//! A frame of a service in words: SDO, LSS, TIME.

use std::fmt;

use eel_protocol::Cob;

use crate::decode::Decoded;
use crate::lss::{Lss, TimeOfDay};
use crate::sdo::{Sdo, Side};

/// A frame of a service, to be printed.
pub enum Service<'a> {
    /// An SDO frame.
    Sdo(Sdo<'a>),
    /// An LSS frame.
    Lss(Lss<'a>),
    /// TIME.
    Time(TimeOfDay<'a>),
}

impl<'a> Service<'a> {
    /// Returns what a data frame is, where it belongs to a service. `is_segment` tells whether it is a
    /// bare segment of an SDO block transfer.
    pub fn of(decoded: &Decoded<'a>, is_segment: bool) -> Option<Self> {
        let data = decoded.frame.data();
        let sdo = |side| {
            Self::Sdo(Sdo {
                side,
                data,
                is_segment,
            })
        };
        let lss = |side| Self::Lss(Lss { side, data });
        match decoded.cob? {
            _ if decoded.frame.is_remote() => None,
            Cob::SdoRequest(_) => Some(sdo(Side::Request)),
            Cob::SdoResponse(_) => Some(sdo(Side::Response)),
            Cob::LssRequest => Some(lss(Side::Request)),
            Cob::LssResponse => Some(lss(Side::Response)),
            Cob::Time => Some(Self::Time(TimeOfDay(data))),
            _ => None,
        }
    }
}

impl fmt::Display for Service<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sdo(sdo) => sdo.fmt(out),
            Self::Lss(lss) => lss.fmt(out),
            Self::Time(time) => time.fmt(out),
        }
    }
}
