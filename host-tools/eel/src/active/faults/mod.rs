//! `eel faults`: what went wrong last in a vertebra, and what it was doing at that moment.

mod frame;

use std::io::{Write, stdout};
use std::time::Duration;

use anyhow::Result;
use clap::Args;
use eel_client::{Client, ClientError, Method, Multiplexor, PastError};
use eel_protocol::freeze::{FreezeError, FreezeFrame};
use eel_protocol::{VERTEBRAE, emergency, identity};
use eel_transport::Bus;
use serde_json::json;

use super::bus::BusOption;
use super::{NO_DATA, Node};

const ERROR_REGISTER: Multiplexor = Multiplexor::new(0x1001, 0);
/// Object 0x2100:1.
const FREEZE: Multiplexor = Multiplexor::new(0x2100, 1);
/// How long answers and heartbeats are awaited where no node is named.
const LISTEN: Duration = Duration::from_millis(500);

const AFTER: &str = "\
Reads the error register (0x1001), the history of errors (0x1003, newest first) and the freeze frame
(0x2100:1): everything at the moment of the last fault or stop. It outlives a reset of the node, not of the
microcontroller. Nothing is changed. Without a NODE every vertebra that answers is asked.

Angles are in rad, as `eel read` shows them; the date is known once TIME came.

--json: one array of objects: node (number), then error (string) where it can't be read, else error_register
(number), errors (array of objects: code, detail (numbers), name (string or null)), frame (null before the
first fault, or an object: code, motor, limit, detail, uptime_s, count (numbers), name, detail_unit, advice,
state (strings), time (string or null), pose, reference (or null), angles, speeds, currents, torques,
motor_temperatures (arrays of numbers, in rad, rad/s, A, N.m, degC), limits (array of strings), supply,
board_temperature (numbers, in V, degC), status (array of strings), bad_targets, lost_targets,
receive_overruns, transmit_overruns (numbers)).

Exit codes: 0 fine, with or without a fault; 1 a node refuses or is silent, or nobody is there; 2 wrong
usage; 3 the bus failed.

Examples:
  eel faults                                   all vertebrae that answer
  eel faults 3                                 vertebra 3
  eel faults 3 5 --json | jq '.[].frame.name'";

/// Show what went wrong last, and what the vertebra was doing
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Faults {
    /// The nodes: 1 to 127; all vertebrae that answer without one
    #[arg(value_name = "NODE")]
    nodes: Vec<Node>,
    #[command(flatten)]
    bus: BusOption,
    /// Write one JSON array (schema below)
    #[arg(long)]
    json: bool,
}

/// What a node tells of its faults.
struct Record {
    register: u32,
    errors: Vec<PastError>,
    frame: Option<FreezeFrame>,
}

/// Why a node tells nothing.
enum Failure {
    Client(ClientError),
    Frame(FreezeError),
}

impl From<ClientError> for Failure {
    fn from(error: ClientError) -> Self {
        Self::Client(error)
    }
}

impl Failure {
    /// Says what is wrong, with the cure.
    fn words(&self, node: Node) -> String {
        match self {
            Self::Client(error) => error.to_string(),
            Self::Frame(error) => {
                let cause = match error {
                    FreezeError::Version => "is of another version: use the eel of its firmware",
                    FreezeError::Length => "is cut or too long: read it again",
                    FreezeError::Value => "holds a code without a meaning: use a newer eel",
                };
                format!("{node}: its freeze frame {cause}")
            }
        }
    }
}

impl Record {
    fn read<B: Bus>(client: &mut Client<B>, node: Node) -> Result<Self, Failure> {
        let register = client.number(node.0, ERROR_REGISTER)?;
        let errors = client.history(node.0)?;
        let frame = match client.upload(node.0, FREEZE, Method::Automatic, &mut |_| ()) {
            Ok(bytes) => Some(FreezeFrame::from_bytes(&bytes).map_err(Failure::Frame)?),
            Err(ClientError::Aborted { code: NO_DATA, .. }) => None,
            Err(error) => return Err(error.into()),
        };
        Ok(Self {
            register,
            errors,
            frame,
        })
    }

    fn text(&self, node: Node) -> String {
        let mut lines = Vec::new();
        match &self.frame {
            Some(frame) => lines.extend(frame::lines(node, frame)),
            None if self.errors.is_empty() => {
                lines.push(format!("{node}: nothing has gone wrong since power-up"));
            }
            None => lines.push(format!("{node}: nothing has stopped it since power-up")),
        }
        if self.register != 0 {
            let names = register_names(self.register).join(", ");
            lines.push(format!(
                "  register     0x{:02X}  still: {names}",
                self.register
            ));
        }
        if !self.errors.is_empty() {
            let errors = self.errors.iter().map(|error| match error.detail {
                0 => frame::name(error.code),
                detail => format!("{} ({detail})", frame::name(error.code)),
            });
            let errors: Vec<_> = errors.collect();
            lines.push(format!("  history      {}", errors.join(", ")));
        }
        lines.join("\n")
    }

    fn json(&self, node: Node) -> serde_json::Value {
        let errors = self.errors.iter().map(|error| {
            let name = emergency::from_code(error.code).map(|known| known.name);
            json!({"code": error.code, "detail": error.detail, "name": name})
        });
        json!({
            "node": node.0, "error_register": self.register, "errors": errors.collect::<Vec<_>>(),
            "frame": self.frame.as_ref().map(frame::json),
        })
    }
}

/// Returns the names of the bits that are set in an error register (CiA 301, 7.5.2.2).
fn register_names(register: u32) -> Vec<&'static str> {
    let names = [
        "generic",
        "current",
        "voltage",
        "temperature",
        "communication",
        "profile",
        "reserved",
        "manufacturer",
    ];
    let set = names.into_iter().enumerate();
    set.filter(|(bit, _)| register >> bit & 1 == 1)
        .map(|(_, name)| name)
        .collect()
}

/// Returns the vertebrae that answer, and those that are only heard.
fn vertebrae<B: Bus>(client: &mut Client<B>) -> Result<Vec<Node>, ClientError> {
    let mut nodes = Vec::new();
    for found in client.find_nodes(1..=127, LISTEN)? {
        let is_one = if found.device_type.is_some() {
            match client.identify(found.node) {
                Ok(known) => known.address.product == identity::PRODUCT,
                Err(error @ ClientError::Bus(_)) => return Err(error),
                Err(_) => found.node <= VERTEBRAE,
            }
        } else {
            found.node <= VERTEBRAE
        };
        if is_one {
            nodes.push(Node(found.node));
        }
    }
    Ok(nodes)
}

impl Faults {
    /// Shows them, and returns how many nodes could not be read; 1 where nobody is there.
    pub fn run(&self) -> Result<u64> {
        let bus = self.bus.name()?;
        let mut client = Client::new(super::bus::open(&bus)?);
        let nodes = if self.nodes.is_empty() {
            vertebrae(&mut client)?
        } else {
            self.nodes.clone()
        };
        if nodes.is_empty() {
            if self.json {
                writeln!(stdout(), "[]")?;
            }
            eprintln!("eel: no vertebra on {bus}: `eel nodes` lists who is there");
            return Ok(1);
        }
        let mut failures = 0;
        let mut rows = Vec::new();
        for node in nodes {
            match Record::read(&mut client, node) {
                Ok(record) if self.json => rows.push(record.json(node)),
                Ok(record) => writeln!(stdout(), "{}", record.text(node))?,
                Err(Failure::Client(error @ ClientError::Bus(_))) => return Err(error.into()),
                // One that is silent is no reason not to ask the others.
                Err(error) => {
                    failures += 1;
                    let words = error.words(node);
                    if self.json {
                        rows.push(json!({"node": node.0, "error": words}));
                    } else {
                        eprintln!("eel: {words}");
                    }
                }
            }
        }
        if self.json {
            writeln!(stdout(), "{}", serde_json::Value::from(rows))?;
        }
        Ok(failures)
    }
}

#[cfg(test)]
mod tests {
    use eel_protocol::emergency::Emergency;

    use super::*;

    #[test]
    fn a_node_without_a_fault_says_so_and_one_with_warnings_lists_them() {
        let mut record = Record {
            register: 0,
            errors: Vec::new(),
            frame: None,
        };
        let node = Node(3);
        assert_eq!(
            record.text(node),
            "vertebra 3: nothing has gone wrong since power-up"
        );
        assert_eq!(
            record.json(node),
            json!({"node": 3, "error_register": 0, "errors": [], "frame": null})
        );
        record.register = 0x11;
        record.errors.push(PastError {
            code: Emergency::COMMAND_LATE.code,
            detail: 3,
        });
        assert_eq!(
            record.text(node),
            "vertebra 3: nothing has stopped it since power-up\n  \
             register     0x11  still: generic, communication\n  \
             history      command-late (3)"
        );
    }
}
