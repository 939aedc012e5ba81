//! Objects by the names of the dictionary.

use eel_client::{Access, Multiplexor};
use eel_protocol::communication;
use eel_protocol::dictionary::{self, Scale, Sub};

use crate::usage::Usage;

/// An object that can be read or written, with what is known of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Object {
    /// Its place.
    pub place: Multiplexor,
    /// Its name; the number of one without a name.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
    /// The unit of the scaled number; empty where there is none.
    pub unit: &'static str,
    /// The worth of one raw step in that unit.
    pub scale: Scale,
    /// The least and the greatest raw number.
    pub range: Option<(i64, i64)>,
    /// Whether it can be written.
    pub is_writable: bool,
}

/// What an object holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A number of so many bytes.
    Number {
        /// Its length.
        bytes: u8,
        /// Whether it may be negative.
        is_signed: bool,
    },
    /// A text.
    Text,
    /// Bytes, as many as there are.
    Domain,
    /// Nobody knows.
    Unknown,
}

/// Some scale of 1.
const ONE: Scale = Scale {
    numerator: 1,
    denominator: 1,
};

impl Kind {
    /// Returns what a type of the dictionary holds (CiA 301, 7.4.7).
    const fn of(type_code: u16) -> Self {
        let (bytes, is_signed) = match type_code {
            2 => (1, true),
            3 => (2, true),
            4 => (4, true),
            5 => (1, false),
            6 => (2, false),
            7 => (4, false),
            9 => return Self::Text,
            15 => return Self::Domain,
            _ => return Self::Unknown,
        };
        Self::Number { bytes, is_signed }
    }

    /// Returns the least and the greatest number.
    pub const fn range(self) -> Option<(i64, i64)> {
        match self {
            Self::Number { bytes, is_signed } => {
                let bits = 8 * bytes as u32;
                Some(if is_signed {
                    (-(1 << (bits - 1)), (1 << (bits - 1)) - 1)
                } else {
                    (0, (1 << bits) - 1)
                })
            }
            Self::Text | Self::Domain | Self::Unknown => None,
        }
    }
}

impl Object {
    fn of_sub(object: &dictionary::Object, sub: &Sub) -> Self {
        let kind = Kind::of(sub.data_type.code());
        Self {
            place: Multiplexor::new(object.index, sub.subindex),
            name: object.dotted(sub).to_string(),
            kind,
            unit: sub.unit,
            scale: sub.scale,
            range: kind.range().map(|_| (sub.min, sub.max)),
            is_writable: matches!(sub.access, Access::ReadWrite | Access::WriteOnly),
        }
    }

    fn of_entry(name: communication::Name, entry: communication::Entry) -> Self {
        let kind = Kind::of(entry.type_code);
        Self {
            place: Multiplexor::new(entry.index, entry.subindex),
            name: name.to_string(),
            kind,
            unit: entry.unit,
            scale: entry.scale,
            range: kind.range(),
            is_writable: entry.is_writable,
        }
    }

    /// Returns what is known of the object at a place; `None` where nothing is.
    pub fn at(place: Multiplexor) -> Option<Self> {
        let Multiplexor { index, subindex } = place;
        if let Ok((object, sub)) = dictionary::find(index, subindex) {
            return Some(Self::of_sub(object, sub));
        }
        let (name, entry) = communication::find(index, subindex)?;
        Some(Self::of_entry(name, entry))
    }

    /// Makes an object that only its number is known of.
    fn unknown(place: Multiplexor) -> Self {
        // Entry 0 of an array or record tells its highest subindex.
        let is_count = place.subindex == 0 && dictionary::object(place.index).is_some();
        Self {
            place,
            name: format!("0x{:04X}:{}", place.index, place.subindex),
            kind: if is_count { Kind::of(5) } else { Kind::Unknown },
            unit: "",
            scale: ONE,
            range: None,
            is_writable: true,
        }
    }

    /// Tells whether writing it can move a robot: targets, moments, torques, what an RPDO carries, and what
    /// nobody knows.
    pub const fn moves(&self) -> bool {
        let is_known = !matches!(self.kind, Kind::Unknown);
        match self.place.index {
            0x2000..=0x2002 | 0x1400..=0x17FF => true,
            0x2000.. => !is_known,
            _ => false,
        }
    }
}

/// Returns all objects: those of the communication area, then those of the vertebra.
pub fn all() -> Vec<Object> {
    let communication = communication::entries().map(|(name, entry)| Object::of_entry(name, entry));
    let own = dictionary::entries().map(|(object, sub)| Object::of_sub(object, sub));
    communication.chain(own).collect()
}

/// Returns the objects that a name means: one (`pose.yaw`, `0x1018:4`), a group (`pose`, `0x1018`), or
/// `all` but domains.
///
/// # Errors
/// [`Usage`], which says what is near.
pub fn find(name: &str) -> Result<Vec<Object>, Usage> {
    if name == "all" {
        let all = all().into_iter();
        return Ok(all.filter(|object| object.kind != Kind::Domain).collect());
    }
    if let Some(digits) = name.strip_prefix("0x") {
        return by_number(name, digits);
    }
    let all = all();
    let is_meant = |object: &&Object| {
        object
            .name
            .strip_prefix(name)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    let meant: Vec<_> = all.iter().filter(is_meant).cloned().collect();
    if meant.is_empty() {
        Err(Usage(unknown_name(name, &all)))
    } else {
        Ok(meant)
    }
}

fn by_number(name: &str, digits: &str) -> Result<Vec<Object>, Usage> {
    let wrong = || {
        Usage(format!(
            "{name:?} is no object: write an index such as 0x1017, or with a subindex 0x1018:4"
        ))
    };
    let (index, subindex) = match digits.split_once(':') {
        Some((index, subindex)) => (index, Some(subindex)),
        None => (digits, None),
    };
    let index = u16::from_str_radix(index, 16).map_err(|_| wrong())?;
    let subindex = match subindex {
        Some(text) => Some(text.parse().map_err(|_| wrong())?),
        None => None,
    };
    let known = all().into_iter().filter(|object| {
        object.place.index == index && subindex.is_none_or(|wanted| object.place.subindex == wanted)
    });
    let known: Vec<_> = known.collect();
    if known.is_empty() {
        let place = Multiplexor::new(index, subindex.unwrap_or(0));
        Ok(vec![Object::unknown(place)])
    } else {
        Ok(known)
    }
}

/// Says what there is instead of a name that does not exist.
fn unknown_name(name: &str, all: &[Object]) -> String {
    let group = name.split('.').next().unwrap_or(name);
    let prefix = format!("{group}.");
    let near: Vec<_> = all
        .iter()
        .filter_map(|object| object.name.strip_prefix(&prefix))
        .collect();
    if !near.is_empty() {
        return format!(
            "there is no object {name:?}; {group} has {}",
            near.join(", ")
        );
    }
    let mut groups: Vec<_> = all
        .iter()
        .filter_map(|object| object.name.split('.').next())
        .collect();
    groups.dedup();
    groups.sort_unstable();
    groups.dedup();
    format!(
        "there is no object {name:?}; there are {}, and numbers such as 0x1018:4",
        groups.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(name: &str) -> Vec<String> {
        let found = find(name).unwrap().into_iter();
        found.map(|object| object.name).collect()
    }

    #[test]
    fn a_name_means_an_object_or_a_group() {
        assert_eq!(names("pose.yaw"), ["pose.yaw"]);
        assert_eq!(names("0x2010:1"), ["pose.yaw"]);
        assert_eq!(names("0x1017"), ["heartbeat.producer"]);
        assert_eq!(
            names("identity"),
            [
                "identity.vendor",
                "identity.product",
                "identity.revision",
                "identity.serial"
            ]
        );
        assert_eq!(names("0x1018:4"), ["identity.serial"]);
        assert_eq!(names("0x1018"), names("identity"));
        assert_eq!(names("tpdo1.mapping").len(), 9);
        assert_eq!(names("0x5FFF:3"), ["0x5FFF:3"]);
        assert!(names("all").len() > 100);
        let yaw = find("pose.yaw").unwrap().remove(0);
        assert_eq!((yaw.unit, yaw.range), ("rad", Some((-32_768, 32_767))));
        assert!(!yaw.is_writable);
    }

    #[test]
    fn a_wrong_name_says_what_there_is() {
        let error = find("pose.jaw").unwrap_err();
        assert_eq!(
            error.0,
            "there is no object \"pose.jaw\"; pose has yaw, pitch, roll, code, crc, status"
        );
        assert!(
            find("poze")
                .unwrap_err()
                .0
                .contains("moment, motor, motor_constants, motor_settings, motor_torque, pose")
        );
        assert!(find("0x1G").is_err() && find("0x1018:256").is_err());
    }

    #[test]
    fn what_moves_a_robot_is_known() {
        let moves = |name: &str| find(name).unwrap().iter().all(Object::moves);
        assert!(moves("target") && moves("moment") && moves("rpdo2.cob_id"));
        assert!(moves("0x3000"));
        assert!(!moves("gains.peak_torque") && !moves("heartbeat.producer"));
    }
}
