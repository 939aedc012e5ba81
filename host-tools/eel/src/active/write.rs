//! `eel write`: objects of a node, checked before they are sent.

use std::io::{Write as _, stdout};

use anyhow::Result;
use clap::Args;
use eel_client::{Client, Method};
use serde_json::json;

use super::Node;
use super::bus::{AnyBus, BusOption, Consent};
use super::read::Bar;
use crate::object::{self, Object};
use crate::usage::Usage;
use crate::value::{Value, parse};

const AFTER: &str = "\
Names are those of `eel export md`. A number is given in the object's unit, with --raw in raw steps;
0x.. is hexadecimal. NAME=@FILE writes a file's bytes, NAME=hex:C800 bytes as they lie on the wire.
Every value is held against the object's range before anything is sent; they are then written in the
order given, until one is refused. What is written lasts until the node is reset: `eel store`.

--yes is needed, except on a virtual interface, for what can move a robot: target, moment, motor_torque,
RPDOs, and objects that nobody knows.

--json: one object: node (number), written (array of objects as those of `eel read --json`;
where one is refused, those before it).

Exit codes: 0 fine; 1 the node refuses or does not answer; 2 wrong usage; 3 the bus failed.

Examples:
  eel write 3 gains.peak_torque=2.5
  eel write 3 gains.stiffness_x=300 gains.stiffness_y=300
  eel write 3 heartbeat.producer=0.1           0.1 s; or --raw heartbeat.producer=100
  eel write 3 link.data=@file                  any number of bytes, in blocks";

/// Write objects of a node, in units, range-checked before anything is sent
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Write {
    /// The node: 1 to 127, or head
    node: Node,
    /// What to write, such as gains.peak_torque=2.5
    #[arg(required = true, value_name = "NAME=VALUE")]
    settings: Vec<String>,
    #[command(flatten)]
    bus: BusOption,
    /// Take numbers in raw steps instead of units
    #[arg(long)]
    raw: bool,
    #[command(flatten)]
    consent: Consent,
    /// Write one JSON object (schema below)
    #[arg(long)]
    json: bool,
}

impl Write {
    /// Writes everything, or nothing where one value is wrong.
    pub fn run(&self) -> Result<u64> {
        let mut pairs = Vec::new();
        for setting in &self.settings {
            pairs.push(pair(setting, self.raw)?);
        }
        let bus = self.bus.name()?;
        if let Some((object, _)) = pairs.iter().find(|(object, _)| object.moves()) {
            self.consent
                .check(&bus, &format!("writing {}", object.name))?;
        }
        let mut client = Client::new(super::bus::open(&bus)?);
        let mut rows = Vec::new();
        let result = self.all(&mut client, &pairs, &mut rows);
        if self.json {
            let all = json!({"node": self.node.0, "written": rows});
            writeln!(stdout(), "{all}")?;
        }
        result.map(|()| 0)
    }

    /// Writes one after the other until one is refused; `rows` gets those that were written.
    fn all(
        &self,
        client: &mut Client<AnyBus>,
        pairs: &[(Object, Vec<u8>)],
        rows: &mut Vec<serde_json::Value>,
    ) -> Result<()> {
        let width = pairs.iter().map(|(object, _)| object.name.len()).max();
        let width = width.unwrap_or_default();
        for (object, bytes) in pairs {
            let mut bar = Bar::new(&object.name);
            let written = client.download(
                self.node.0,
                object.place,
                bytes,
                Method::Automatic,
                &mut |step| bar.show(step),
            );
            bar.end();
            written.map_err(|error| anyhow::Error::new(error).context(object.name.clone()))?;
            let value = Value::of(object, bytes);
            if self.json {
                rows.push(value.json(object));
            } else {
                let name = &object.name;
                let text = match &value {
                    Value::Bytes(bytes) => format!("{} bytes", bytes.len()),
                    _ => value.text(object),
                };
                writeln!(stdout(), "{name:width$}  {text}  written")?;
            }
        }
        Ok(())
    }
}

/// Reads `NAME=VALUE`.
fn pair(setting: &str, is_raw: bool) -> Result<(Object, Vec<u8>), Usage> {
    let Some((name, text)) = setting.split_once('=') else {
        return Err(Usage(format!(
            "{setting:?} is no setting: write NAME=VALUE, such as gains.peak_torque=2.5"
        )));
    };
    let mut found = object::find(name)?;
    if found.len() > 1 {
        let names: Vec<_> = found.iter().map(|object| object.name.as_str()).collect();
        return Err(Usage(format!(
            "{name} is a group: name one of {}",
            names.join(", ")
        )));
    }
    let object = found.remove(0);
    if !object.is_writable {
        return Err(Usage(format!("{name} can only be read")));
    }
    let bytes = parse(&object, text, is_raw)?;
    Ok((object, bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_setting_is_told_before_anything_is_sent() {
        let told = |setting| pair(setting, false).unwrap_err().0;
        assert!(told("gains.peak_torque").contains("write NAME=VALUE"));
        assert!(told("pose.yaw=1").contains("can only be read"));
        assert!(told("gains=1").contains("is a group: name one of gains.stiffness_x"));
        assert!(told("gaims.x=1").contains("there is no object"));
        let (object, bytes) = pair("gains.peak_torque=2.5", false).unwrap();
        assert_eq!((object.place.index, bytes), (0x2020, vec![0xC4, 9]));
    }
}
