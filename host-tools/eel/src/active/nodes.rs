//! `eel nodes`: who is on the bus, and how they are.

use std::io::{Write, stdout};
use std::time::Duration;

use anyhow::Result;
use clap::Args;
use eel_client::{Client, ClientError, Found, LssAddress, Multiplexor};
use eel_protocol::{HEAD_NODE, State, emergency, identity};
use serde_json::json;

use super::bus::{self, AnyBus, BusOption};
use super::nmt::state_name;

const ERROR_REGISTER: Multiplexor = Multiplexor::new(0x1001, 0);
const DEVICE: Multiplexor = Multiplexor::new(0x1008, 0);
const HARDWARE: Multiplexor = Multiplexor::new(0x1009, 0);
const SOFTWARE: Multiplexor = Multiplexor::new(0x100A, 0);
const HEARTBEAT: Multiplexor = Multiplexor::new(0x1017, 0);
/// Object 0x2010:4: state and counter of a vertebra.
const POSE_CODE: Multiplexor = Multiplexor::new(0x2010, 4);

const AFTER: &str = "\
Asks all 127 ids for their device type and listens for heartbeats, then asks everybody found who and how
he is. It reads only; nothing is changed. A stopped node is deaf: only its state is shown.

Columns: node id, NMT state of the heartbeat, what a vertebra is doing (`eel read NODE pose.status` says
what it waits for), heartbeat period, serial number, device with hardware and software version, and the
newest error, where the error register is not 0.

--json: one array of objects: node (number), and where they are known state (string), device_type,
vendor, product, revision, serial (numbers), device, hardware, software (strings), heartbeat_ms (number),
vertebra (string: its state), error_register (number), errors (array of objects: code, detail (numbers),
name (string), newest first).

Exit codes: 0 fine; 1 a node has an error, or nobody is there; 2 wrong usage; 3 the bus failed.

Examples:
  eel nodes
  eel nodes can0 --listen 2                    for nodes with a slow heartbeat
  eel nodes --json | jq '.[] | select(.error_register > 0)'";

/// List the nodes on the bus: state, identity, versions, errors
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Nodes {
    /// The bus, as --bus
    #[arg(value_name = "BUS", conflicts_with = "bus")]
    positional: Option<String>,
    #[command(flatten)]
    bus: BusOption,
    /// How long to listen for heartbeats, s
    #[arg(long, value_name = "S", default_value_t = 0.5, value_parser = listen)]
    listen: f64,
    /// Write one JSON array (schema below)
    #[arg(long)]
    json: bool,
}

/// What is known of a node.
struct Row {
    found: Found,
    device_type: Option<u32>,
    address: Option<LssAddress>,
    device: Option<String>,
    hardware: Option<String>,
    software: Option<String>,
    heartbeat_ms: Option<u32>,
    vertebra: Option<State>,
    register: Option<u32>,
    errors: Vec<eel_client::PastError>,
}

fn listen(text: &str) -> Result<f64, String> {
    let time = text.parse().ok().filter(|time| (0.0..=60.0).contains(time));
    time.ok_or_else(|| "a time from 0 to 60 s".to_owned())
}

/// Takes a refusal or silence as absence; a bus that fails is an error.
fn known<T>(result: Result<T, ClientError>) -> Result<Option<T>, ClientError> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error @ ClientError::Bus(_)) => Err(error),
        Err(_) => Ok(None),
    }
}

impl Row {
    fn read(client: &mut Client<AnyBus>, found: Found) -> Result<Self, ClientError> {
        let node = found.node;
        let mut row = Self {
            found,
            device_type: found.device_type,
            address: None,
            device: None,
            hardware: None,
            software: None,
            heartbeat_ms: None,
            vertebra: None,
            register: None,
            errors: Vec::new(),
        };
        // Whoever did not answer then will not answer now.
        if found.device_type.is_none() {
            return Ok(row);
        }
        row.address = known(client.identify(node))?.map(|found| found.address);
        row.device = known(client.text(node, DEVICE))?;
        row.hardware = known(client.text(node, HARDWARE))?;
        row.software = known(client.text(node, SOFTWARE))?;
        row.heartbeat_ms = known(client.number(node, HEARTBEAT))?;
        row.register = known(client.number(node, ERROR_REGISTER))?;
        if row.register.is_some_and(|register| register != 0) {
            row.errors = known(client.history(node))?.unwrap_or_default();
        }
        if row
            .address
            .is_some_and(|address| address.product == identity::PRODUCT)
        {
            let code = known(client.number(node, POSE_CODE))?;
            row.vertebra = code.and_then(|code| State::from_code((code & 0xF) as u8));
        }
        Ok(row)
    }

    fn has_error(&self) -> bool {
        self.register.is_some_and(|register| register != 0)
    }

    fn errors_in_words(&self) -> String {
        match (self.register, self.errors.first()) {
            (None | Some(0), _) => String::new(),
            (Some(register), None) => format!("register 0x{register:02X}"),
            (Some(_), Some(error)) => match emergency::from_code(error.code) {
                Some(known) => known.name.to_owned(),
                None => format!("code 0x{:04X}", error.code),
            },
        }
    }

    fn cells(&self) -> [String; 7] {
        let text = |text: Option<&str>| text.unwrap_or("-").to_owned();
        let node = match self.found.node {
            HEAD_NODE => "head".to_owned(),
            node => node.to_string(),
        };
        let heartbeat = match self.heartbeat_ms {
            None => "-".to_owned(),
            Some(0) => "off".to_owned(),
            Some(period) => format!("{period} ms"),
        };
        let serial = self
            .address
            .map(|address| format!("0x{:08X}", address.serial));
        let versions = [&self.device, &self.hardware, &self.software];
        let versions: Vec<_> = versions
            .into_iter()
            .flatten()
            .map(String::as_str)
            .filter(|text| !text.is_empty())
            .collect();
        let device = if versions.is_empty() {
            "-".to_owned()
        } else {
            versions.join(", ")
        };
        [
            node,
            text(self.found.state.map(state_name)),
            text(self.vertebra.map(State::name)),
            heartbeat,
            text(serial.as_deref()),
            device,
            self.errors_in_words(),
        ]
    }

    fn json(&self) -> serde_json::Value {
        let mut all = json!({"node": self.found.node});
        let mut add = |name: &str, value: Option<serde_json::Value>| {
            if let Some(value) = value {
                all[name] = value;
            }
        };
        add(
            "state",
            self.found.state.map(|state| json!(state_name(state))),
        );
        add("device_type", self.device_type.map(|number| json!(number)));
        let address = self.address;
        add("vendor", address.map(|address| json!(address.vendor)));
        add("product", address.map(|address| json!(address.product)));
        add("revision", address.map(|address| json!(address.revision)));
        add("serial", address.map(|address| json!(address.serial)));
        add("device", self.device.as_ref().map(|text| json!(text)));
        add("hardware", self.hardware.as_ref().map(|text| json!(text)));
        add("software", self.software.as_ref().map(|text| json!(text)));
        add(
            "heartbeat_ms",
            self.heartbeat_ms.map(|period| json!(period)),
        );
        add("vertebra", self.vertebra.map(|state| json!(state.name())));
        add(
            "error_register",
            self.register.map(|register| json!(register)),
        );
        let errors = self.errors.iter().map(|error| {
            let name = emergency::from_code(error.code).map(|known| known.name);
            json!({"code": error.code, "detail": error.detail, "name": name})
        });
        add("errors", self.register.map(|_| errors.collect()));
        all
    }
}

impl Nodes {
    /// Lists the nodes, and returns how many have an error; 1 where nobody is there.
    pub fn run(&self) -> Result<u64> {
        let bus = match &self.positional {
            Some(name) => name.clone(),
            None => self.bus.name()?,
        };
        let mut client = Client::new(bus::open(&bus)?);
        let found = client.find_nodes(1..=127, Duration::from_secs_f64(self.listen))?;
        let mut rows = Vec::new();
        for found in found {
            rows.push(Row::read(&mut client, found)?);
        }
        if self.json {
            let all: Vec<_> = rows.iter().map(Row::json).collect();
            writeln!(stdout(), "{}", serde_json::Value::from(all))?;
        } else if rows.is_empty() {
            eprintln!(
                "eel: nobody on {bus}: nodes are off, at another bit rate, or have no id yet (`eel lss \
                 scan`)"
            );
        } else {
            table(&rows)?;
        }
        let faulty = rows.iter().filter(|row| row.has_error()).count() as u64;
        Ok(if rows.is_empty() { 1 } else { faulty })
    }
}

fn table(rows: &[Row]) -> std::io::Result<()> {
    let heads = [
        "node",
        "state",
        "vertebra",
        "heartbeat",
        "serial",
        "device",
        "error",
    ]
    .map(str::to_owned);
    let lines: Vec<_> = std::iter::once(heads)
        .chain(rows.iter().map(Row::cells))
        .collect();
    let mut widths = [0; 7];
    for line in &lines {
        for (width, cell) in widths.iter_mut().zip(line) {
            *width = cell.chars().count().max(*width);
        }
    }
    let mut out = stdout().lock();
    for line in lines {
        let mut text = String::new();
        for (cell, width) in line.iter().zip(widths) {
            text.push_str(&format!("{cell:width$}  "));
        }
        writeln!(out, "{}", text.trim_end())?;
    }
    Ok(())
}
