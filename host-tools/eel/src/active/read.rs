//! `eel read`: objects of a node, in units.

use std::io::{IsTerminal, Write, stderr, stdout};
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use eel_client::{Client, ClientError, Method, Progress};
use serde_json::json;

use super::bus::{AnyBus, BusOption};
use super::{NO_DATA, Node};
use crate::object::{self, Kind, Object};
use crate::usage::Usage;
use crate::value::Value;

/// Bytes from which on a transfer shows how far it is.
const LONG: usize = 2_000;

const AFTER: &str = "\
Names are those of `eel export md`: pose.yaw; a whole group: pose, identity, tpdo1, tpdo1.mapping;
numbers: 0x1017, 0x1018:4; or all. Numbers come in their units, codes with their meaning.

--json: one object: node (number), values (array of objects: name, index, subindex, and where they
apply value (number in the unit, or string), raw (number), unit, words (string: a code's meaning),
bytes (string of hexadecimal digits), file (string), error (string), code (number: SDO abort code)).

Exit codes: 0 fine; 1 the node refuses or does not answer; 2 wrong usage; 3 the bus or
a file failed.

Examples:
  eel read 3 pose.yaw
  eel read 3 pose gains.peak_torque heartbeat.producer
  eel read 3 all --json
  eel read 3 eds.data --out vertebra3.eds      what the node says of itself, for other tools
  eel read -b can0 head device.name";

/// Read objects of a node, in units
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Read {
    /// The node: 1 to 127, or head
    node: Node,
    /// What to read: a name, a group, a number, or all
    #[arg(required = true, value_name = "NAME")]
    names: Vec<String>,
    #[command(flatten)]
    bus: BusOption,
    /// Write the bytes of the one object, such as a domain, to a file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write one JSON object (schema below)
    #[arg(long)]
    json: bool,
}

impl Read {
    /// Reads, and returns how many objects could not be read.
    pub fn run(&self) -> Result<u64> {
        let mut objects = Vec::new();
        for name in &self.names {
            objects.extend(object::find(name)?);
        }
        if self.out.is_some() && objects.len() != 1 {
            let count = objects.len();
            let error = format!("--out takes the bytes of one object, not of {count}: name one");
            return Err(Usage(error).into());
        }
        let mut client = self.bus.client()?;
        let width = objects.iter().map(|object| object.name.len()).max();
        let mut rows = Vec::new();
        let mut failures = 0;
        for object in &objects {
            let (row, is_failure) = self.one(&mut client, object, width.unwrap_or_default())?;
            failures += u64::from(is_failure);
            rows.extend(row);
        }
        if self.json {
            let all = json!({"node": self.node.0, "values": rows});
            writeln!(stdout(), "{all}")?;
        }
        Ok(failures)
    }

    /// Reads one object and shows it, or returns its row; tells whether it failed.
    fn one(
        &self,
        client: &mut Client<AnyBus>,
        object: &Object,
        width: usize,
    ) -> Result<(Option<serde_json::Value>, bool)> {
        let result = fetch(client, self.node, object);
        let name = &object.name;
        match result {
            Ok(bytes) => {
                if let Some(path) = &self.out {
                    std::fs::write(path, &bytes)
                        .with_context(|| format!("can't write {}", path.display()))?;
                    let (count, file) = (bytes.len(), path.display().to_string());
                    if self.json {
                        return Ok((Some(json!({"name": name, "file": file})), false));
                    }
                    writeln!(stdout(), "{name:width$}  {count} bytes in {file}")?;
                    return Ok((None, false));
                }
                let value = Value::of(object, &bytes);
                if self.json {
                    return Ok((Some(value.json(object)), false));
                }
                writeln!(stdout(), "{name:width$}  {}", value.text(object))?;
                Ok((None, false))
            }
            // One that is refused is no reason not to read the others; silence is.
            Err(error @ ClientError::Aborted { code, .. }) => {
                // That there is nothing is an answer too.
                let is_empty = code == NO_DATA;
                let place = object.place;
                if self.json {
                    let row = json!({
                        "name": name, "index": place.index, "subindex": place.subindex,
                        "error": eel_client::abort(code).meaning, "code": code,
                    });
                    return Ok((Some(row), !is_empty));
                }
                if is_empty {
                    writeln!(stdout(), "{name:width$}  nothing")?;
                } else if object.kind == Kind::Unknown {
                    eprintln!("eel: {error}");
                } else {
                    eprintln!("eel: {name}: {error}");
                }
                Ok((None, !is_empty))
            }
            Err(error) => Err(error.into()),
        }
    }
}

/// Reads one object's bytes; long transfers show how far they are on a terminal.
pub fn fetch(
    client: &mut Client<AnyBus>,
    node: Node,
    object: &Object,
) -> Result<Vec<u8>, ClientError> {
    let mut bar = Bar::new(&object.name);
    let bytes = client.upload(node.0, object.place, Method::Automatic, &mut |step| {
        bar.show(step);
    });
    bar.end();
    bytes
}

/// How far a long transfer is, where somebody looks.
pub struct Bar<'a> {
    name: &'a str,
    is_on: bool,
    is_shown: bool,
    shown: usize,
}

impl<'a> Bar<'a> {
    /// Makes one for a transfer.
    pub fn new(name: &'a str) -> Self {
        Self {
            name,
            is_on: stderr().is_terminal(),
            is_shown: false,
            shown: 0,
        }
    }

    /// Shows a step.
    pub fn show(&mut self, step: Progress) {
        let total = step.total.unwrap_or(step.done);
        if !self.is_on || total < LONG || step.done < self.shown + total / 100 {
            return;
        }
        self.shown = step.done;
        self.is_shown = true;
        let (done, percent) = (step.done, step.done * 100 / total);
        // What can't be shown is no reason to end.
        let _ = match step.total {
            Some(total) => write!(
                stderr(),
                "\r{}  {done} of {total} bytes  {percent} %\x1b[K",
                self.name
            ),
            None => write!(stderr(), "\r{}  {done} bytes\x1b[K", self.name),
        };
    }

    /// Clears the line.
    pub fn end(&self) {
        if self.is_shown {
            let _ = write!(stderr(), "\r\x1b[K");
        }
    }
}
