//! Values from bytes and to bytes, in the units of the dictionary.

use std::fmt::Write as _;

use eel_protocol::procedure::{Check, Progress, Reason};
use eel_protocol::{LimitCode, Mode, State, Status, dictionary, emergency};
use serde_json::json;

use crate::decode::decimals;
use crate::object::{Kind, Object};
use crate::usage::Usage;

/// Bytes that are shown of a domain.
const SHOWN: usize = 32;

/// What an object holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A raw number.
    Number(i64),
    /// A text.
    Text(String),
    /// Bytes of a domain, of an unknown object, or of another length than the object's.
    Bytes(Vec<u8>),
}

impl Value {
    /// Reads an object's bytes.
    pub fn of(object: &Object, bytes: &[u8]) -> Self {
        match object.kind {
            // A node that tells no length pads to four bytes.
            Kind::Number {
                bytes: length,
                is_signed,
            } if bytes.len() == usize::from(length) || bytes.len() == 4 => {
                let mut word = [0; 8];
                for (slot, byte) in word.iter_mut().zip(bytes).take(length.into()) {
                    *slot = *byte;
                }
                let left = 64 - 8 * u32::from(length);
                let high = u64::from_le_bytes(word) << left;
                Self::Number(if is_signed {
                    (high as i64) >> left
                } else {
                    (high >> left) as i64
                })
            }
            Kind::Text => {
                let text = String::from_utf8_lossy(bytes);
                Self::Text(text.trim_end_matches('\0').to_owned())
            }
            _ => Self::Bytes(bytes.to_vec()),
        }
    }

    /// Returns the value for people.
    pub fn text(&self, object: &Object) -> String {
        match self {
            Self::Number(raw) => number(object, *raw),
            // A terminal must not obey what a node says.
            Self::Text(text) => text.replace(char::is_control, "\u{FFFD}"),
            Self::Bytes(bytes) => {
                let shown = bytes.iter().take(SHOWN);
                let mut text = format!("{} bytes", bytes.len());
                for byte in shown {
                    // Writing to a string can't fail.
                    let _ = write!(text, " {byte:02X}");
                }
                if bytes.len() > SHOWN {
                    text.push_str(" ...; --out FILE keeps all");
                }
                text
            }
        }
    }

    /// Returns the value for programs.
    pub fn json(&self, object: &Object) -> serde_json::Value {
        let place = object.place;
        let mut all = json!({
            "name": object.name, "index": place.index, "subindex": place.subindex,
        });
        match self {
            Self::Number(raw) => {
                let scale = object.scale;
                all["raw"] = json!(raw);
                all["value"] = if scale.numerator == scale.denominator {
                    json!(raw)
                } else {
                    json!(physical(object, *raw))
                };
                if !object.unit.is_empty() {
                    all["unit"] = json!(object.unit);
                }
                if let Some(words) = words(object, *raw) {
                    all["words"] = json!(words);
                }
            }
            Self::Text(text) => all["value"] = json!(text),
            Self::Bytes(bytes) => {
                let hexadecimal: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
                all["bytes"] = json!(hexadecimal);
            }
        }
        all
    }
}

/// Returns a raw number in the object's unit.
pub fn physical(object: &Object, raw: i64) -> f64 {
    let scale = object.scale;
    (raw * i64::from(scale.numerator)) as f64 / f64::from(scale.denominator)
}

/// Returns a number in its unit, codes with their meaning, and identifiers in hexadecimal.
fn number(object: &Object, raw: i64) -> String {
    if !object.unit.is_empty() || object.scale.denominator != 1 {
        let digits = decimals(object.scale.denominator);
        let value = physical(object, raw);
        let unit = object.unit;
        return format!("{value:.digits$} {unit}").trim_end().to_owned();
    }
    let is_pattern = matches!(object.place.index, 0x1000..=0x1FFF)
        && matches!(object.kind, Kind::Number { bytes: 4, .. })
        || object.name.ends_with("crc")
        || object.name.ends_with("register");
    let plain = match object.kind {
        Kind::Number { bytes, .. } if is_pattern => {
            format!("0x{raw:0width$X}", width = 2 * usize::from(bytes))
        }
        _ => raw.to_string(),
    };
    match words(object, raw) {
        Some(words) => format!("{plain}  {words}"),
        None => plain,
    }
}

/// Returns what a code means.
fn words(object: &Object, raw: i64) -> Option<String> {
    let long = u32::try_from(raw).ok()?;
    let word = long as u16;
    let (low, high) = ((word & 0xF) as u8, word >> 4 & 0xF);
    match (object.place.index, object.place.subindex) {
        (0x1003, 1..) => {
            let name = emergency::from_code(word).map(|known| known.name);
            Some(name.unwrap_or("another maker's").to_owned())
        }
        (0x1016, 1..) if long != 0 => Some(format!("node {}, {word} ms", long >> 16 & 0x7F)),
        (0x1400..=0x15FF | 0x1800..=0x19FF, 1) => {
            Some(if long >> 31 == 0 { "on" } else { "off" }.to_owned())
        }
        (0x1600..=0x17FF | 0x1A00..=0x1BFF, 1..) => Some(mapped(long)),
        (0x2000, 4) => Some(format!("{}, counter {high}", Mode::from_code(low)?.name())),
        (0x2010, 4) => Some(format!("{}, counter {high}", State::from_code(low)?.name())),
        (0x2010, 6) => {
            let conditions = Status::from_bits(long).conditions();
            let names: Vec<_> = conditions.map(eel_protocol::Condition::name).collect();
            Some(if names.is_empty() {
                "nothing in the way".to_owned()
            } else {
                names.join(", ")
            })
        }
        (0x2011, 4) => {
            let codes = [low, high as u8, (word >> 8 & 0xF) as u8];
            let names = codes.map(|code| LimitCode::from_code(code).map_or("?", LimitCode::name));
            Some(names.join(", "))
        }
        (0x2060, 2) => Some(format!("{:?}", Progress::from_code(low)?).to_lowercase()),
        (0x2060, 3) => Some(Reason::from_code(word as u8)?.sentence().to_owned()),
        (0x2060, 5 | 6) => {
            let checks = Check::ALL.iter().filter(|check| word & check.mask() != 0);
            let names: Vec<_> = checks.map(|check| check.name()).collect();
            Some(if names.is_empty() {
                "none".to_owned()
            } else {
                names.join(", ")
            })
        }
        _ => None,
    }
}

/// Returns what a mapping entry means.
fn mapped(raw: u32) -> String {
    let (index, subindex, bits) = ((raw >> 16) as u16, (raw >> 8) as u8, raw as u8);
    match (index, dictionary::find(index, subindex)) {
        (0, _) => "nothing".to_owned(),
        (1..=7, _) => format!("{bits} bits that are skipped"),
        (_, Ok((object, sub))) => format!("{}, {bits} bits", object.dotted(sub)),
        (_, Err(_)) => format!("{index:04X}:{subindex}, {bits} bits"),
    }
}

/// Returns the bytes of a value as it was typed: a number in the object's unit (`is_raw`: in raw steps),
/// a text, `@FILE` for a file's content, `hex:` for bytes.
///
/// # Errors
/// [`Usage`], which names the range or the form.
pub fn parse(object: &Object, text: &str, is_raw: bool) -> Result<Vec<u8>, Usage> {
    if let Some(digits) = text.strip_prefix("hex:") {
        return hexadecimal(digits);
    }
    if let Some(path) = text.strip_prefix('@') {
        return std::fs::read(path).map_err(|error| Usage(format!("can't read {path}: {error}")));
    }
    let Kind::Number { bytes, .. } = object.kind else {
        return match object.kind {
            Kind::Text => Ok(text.as_bytes().to_vec()),
            Kind::Domain => Err(Usage(format!(
                "{} takes bytes: write {}=@FILE or {}=hex:DEADBEEF",
                object.name, object.name, object.name
            ))),
            _ => Err(Usage(format!(
                "the type of {} is not known: give its bytes, lowest first, as {}=hex:C800",
                object.name, object.name
            ))),
        };
    };
    let raw = steps(object, text, is_raw)?;
    let range = object.range.or(object.kind.range());
    if let Some((least, greatest)) = range.filter(|(low, high)| raw < *low || raw > *high) {
        let end = |raw: i64| {
            if is_raw {
                raw.to_string()
            } else {
                number(object, raw)
            }
        };
        return Err(Usage(format!(
            "{} takes {} to {}; {text} is outside",
            object.name,
            end(least),
            end(greatest)
        )));
    }
    let all = raw.to_le_bytes();
    Ok(all.into_iter().take(bytes.into()).collect())
}

/// Returns a number in raw steps.
fn steps(object: &Object, text: &str, is_raw: bool) -> Result<i64, Usage> {
    let unit = object.unit;
    let wrong = || {
        let kind = if is_raw || unit.is_empty() {
            "a whole number such as 35 or 0x23".to_owned()
        } else {
            format!("a number in {unit}")
        };
        Usage(format!("{} takes {kind}; {text:?} is none", object.name))
    };
    let is_integer = is_raw || object.scale.numerator == object.scale.denominator;
    if is_integer {
        let number = match text.strip_prefix("0x") {
            Some(digits) => i64::from_str_radix(digits, 16),
            None => text.parse(),
        };
        return number.map_err(|_| wrong());
    }
    let bare = text.strip_suffix(unit).unwrap_or(text).trim_end();
    let value: f64 = bare.parse().map_err(|_| wrong())?;
    let scaled = value * f64::from(object.scale.denominator) / f64::from(object.scale.numerator);
    if scaled.is_finite() {
        // Beyond the type's range it saturates, and is refused for its range.
        Ok(scaled.round() as i64)
    } else {
        Err(wrong())
    }
}

fn hexadecimal(digits: &str) -> Result<Vec<u8>, Usage> {
    let wrong = || {
        Usage(format!(
            "{digits:?} is not an even number of hexadecimal digits"
        ))
    };
    if digits.is_empty() || !digits.len().is_multiple_of(2) || !digits.is_ascii() {
        return Err(wrong());
    }
    let pairs = (0..digits.len()).step_by(2);
    pairs
        .map(|place| u8::from_str_radix(&digits[place..place + 2], 16).map_err(|_| wrong()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::find;

    fn one(name: &str) -> Object {
        find(name).unwrap().remove(0)
    }

    fn shown(name: &str, bytes: &[u8]) -> String {
        let object = one(name);
        Value::of(&object, bytes).text(&object)
    }

    #[test]
    fn values_are_shown_in_their_units_and_codes_in_words() {
        assert_eq!(shown("pose.yaw", &[0xF3, 0xFE]), "-0.0269 rad");
        assert_eq!(shown("heartbeat.producer", &[200, 0]), "0.200 s");
        assert_eq!(
            shown("device.name", b"Anguilla vertebra\0"),
            "Anguilla vertebra"
        );
        assert_eq!(shown("device.name", b"a\x1b[2J"), "a\u{FFFD}[2J");
        assert_eq!(shown("identity.serial", &[4, 3, 2, 1]), "0x01020304");
        assert_eq!(shown("pose.code", &[0x53]), "83  run, counter 5");
        assert_eq!(shown("pose.status", &[0, 0, 0, 0]), "0  nothing in the way");
        assert_eq!(
            shown("pose.status", &[0, 9, 1, 0]),
            "67840  not-operational, head-lost, calibration"
        );
        assert_eq!(shown("procedure.progress", &[2]), "2  done");
        assert_eq!(shown("procedure.failed", &[8, 2]), "520  noise, bridges");
        assert!(shown("procedure.reason", &[7]).contains("did not move its crank"));
        assert_eq!(
            shown("error.newest", &[0x30, 0x81, 0x7F, 0]),
            "0x007F8130  head-lost"
        );
        assert_eq!(
            shown("heartbeat.consumer", &[0x2C, 1, 0x7F, 0]),
            "0x007F012C  node 127, 300 ms"
        );
        assert_eq!(
            shown("tpdo1.mapping.1", &[0x10, 1, 0x10, 0x20]),
            "0x20100110  pose.yaw, 16 bits"
        );
        assert_eq!(shown("rpdo2.cob_id", &[3, 3, 0, 0x80]), "0x80000303  off");
        assert_eq!(
            shown("effort.limits", &[0x10, 0x0F]),
            "3856  none, peak, off"
        );
        assert_eq!(shown("moment.stiffness", &[0, 0x80]), "1.000000");
        assert_eq!(shown("0x5000", &[1, 0xAB]), "2 bytes 01 AB");
        assert_eq!(shown("pose.yaw", &[1, 2, 3]), "3 bytes 01 02 03");
    }

    #[test]
    fn json_has_the_value_the_unit_and_the_raw_number() {
        let object = one("gains.peak_torque");
        let json = Value::of(&object, &[0xC4, 9]).json(&object);
        assert_eq!(
            json,
            json!({"name": "gains.peak_torque", "index": 0x2020, "subindex": 7,
                   "raw": 2500, "value": 2.5, "unit": "N.m"})
        );
    }

    #[test]
    fn what_is_typed_becomes_bytes_in_the_object_s_type() {
        let bytes = |name, text, raw| parse(&one(name), text, raw).map_err(|error| error.0);
        assert_eq!(bytes("target.yaw", "-0.35", false), Ok(vec![0x54, 0xF2]));
        assert_eq!(bytes("target.yaw", "0.35rad", false), Ok(vec![0xAC, 0x0D]));
        assert_eq!(bytes("target.yaw", "3500", true), Ok(vec![0xAC, 0x0D]));
        assert_eq!(bytes("heartbeat.producer", "0.5", false), Ok(vec![0xF4, 1]));
        assert_eq!(bytes("sync.overflow", "0xF0", false), Ok(vec![240]));
        assert_eq!(bytes("0x5000", "hex:00ff", false), Ok(vec![0, 255]));
        assert!(bytes("0x5000", "hex:0", false).is_err());
        assert!(
            bytes("0x5000", "7", false)
                .unwrap_err()
                .contains("hex:C800")
        );
        assert_eq!(
            bytes("gains.peak_torque", "40", false).unwrap_err(),
            "gains.peak_torque takes 0.001 N.m to 32.000 N.m; 40 is outside"
        );
        assert_eq!(
            bytes("gains.peak_torque", "40000", true).unwrap_err(),
            "gains.peak_torque takes 1 to 32000; 40000 is outside"
        );
        assert_eq!(
            bytes("gains.peak_torque", "much", false).unwrap_err(),
            "gains.peak_torque takes a number in N.m; \"much\" is none"
        );
        assert!(bytes("target.yaw", "inf", false).is_err());
        assert!(
            bytes("target.yaw", "1e30", false)
                .unwrap_err()
                .contains("outside")
        );
    }
}
