//! `eel lss`: node ids for nodes that have none, or another.

use std::collections::BTreeSet;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::time::Duration;

use anyhow::Result;
use clap::{Args, Subcommand};
use eel_client::{Client, ClientError, LssAddress, LssFailure, NmtState};
use eel_protocol::identity;
use serde_json::json;

use super::Node;
use super::bus::{AnyBus, BusOption};
use crate::usage::Usage;

/// How long a node that got its id may take to boot.
const BOOT: Duration = Duration::from_secs(2);
/// How long heartbeats are awaited, to know which ids are taken.
const TAKEN: Duration = Duration::from_millis(600);

const AFTER: &str = "\
A new vertebra has no node id and is silent. scan lists such nodes by their identity (about 5 s each,
as every bit of it is asked for); assign gives them ids, one after another in the order found, or by
serial number. Where the line beside the bus is connected, only the first vertebra without an id answers,
and the order found is that from head to tail (`eel map`); else it is that of rising identity. An id lasts
until power is off unless it is stored (--store, or later `eel lss store`).

--json: scan, inquire: an array of objects: vendor, product, revision, serial, and node where there is
one (numbers). assign: the same, with node, stored and booted (bool).

Exit codes: 0 fine; 1 nobody was found, or a node refuses; 2 wrong usage; 3 the bus failed.

Examples:
  eel lss scan
  eel lss assign 3 5 --store                   the first found becomes 3, the next 5
  eel lss assign 3 --serial 0x1A2B3C4D --store
  eel lss assign 7 --from 3 --store            3 becomes 7 with its next power-up or reset
  eel lss inquire 3";

/// Find nodes without an id and give them one
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Lss {
    #[command(subcommand)]
    act: Act,
    #[command(flatten)]
    bus: BusOption,
    /// Write JSON (schema below)
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Act {
    /// List the nodes without an id by their identity; nothing is changed
    #[command(visible_alias = "list-unconfigured")]
    Scan,
    /// Give ids to nodes without one, or another id to one that has one
    Assign(Assign),
    /// Let a node store its id
    Store(Chosen),
    /// Show identity and id of a node
    Inquire(Chosen),
}

#[derive(Debug, Args)]
struct Assign {
    /// The ids, 1 to 126, in the order in which nodes are found
    #[arg(required = true, value_name = "ID", value_parser = clap::value_parser!(u8).range(1..=126))]
    ids: Vec<u8>,
    /// Only the node with this serial number; takes one id
    #[arg(long, value_name = "SERIAL", value_parser = number)]
    serial: Option<u32>,
    /// The node that has this id now; its new id holds after `eel nmt NODE reset-communication`
    #[arg(long, value_name = "NODE", conflicts_with = "serial")]
    from: Option<Node>,
    /// Let each node store its id, so that it outlasts power-off
    #[arg(long)]
    store: bool,
}

#[derive(Debug, Args)]
struct Chosen {
    /// The node, by the id it has
    #[arg(required_unless_present = "serial", conflicts_with = "serial")]
    node: Option<Node>,
    /// The node, by its serial number, where it is a vertebra of this revision
    #[arg(long, value_name = "SERIAL", value_parser = number)]
    serial: Option<u32>,
}

fn number(text: &str) -> Result<u32, String> {
    let number = match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => text.parse(),
    };
    number.map_err(|_| format!("{text:?} is no serial number: write 0x1A2B3C4D or 439041101"))
}

/// Returns the identity of a vertebra with this serial number.
const fn vertebra(serial: u32) -> LssAddress {
    LssAddress {
        vendor: identity::VENDOR,
        product: identity::PRODUCT,
        revision: identity::REVISION,
        serial,
    }
}

fn row(address: LssAddress, node: Option<u8>) -> serde_json::Value {
    let LssAddress {
        vendor,
        product,
        revision,
        serial,
    } = address;
    let mut all = json!({
        "vendor": vendor, "product": product, "revision": revision, "serial": serial,
    });
    if let Some(node) = node {
        all["node"] = json!(node);
    }
    all
}

impl Lss {
    /// Acts, and returns 1 where nobody was found.
    pub fn run(&self) -> Result<u64> {
        let mut client = self.bus.client()?;
        // Whatever a master before left in configuration waits again.
        client.lss().switch_all(false)?;
        let (rows, faults) = match &self.act {
            Act::Scan => self.scan(&mut client)?,
            Act::Assign(assign) => self.assign(&mut client, assign)?,
            Act::Store(chosen) => self.store(&mut client, chosen)?,
            Act::Inquire(chosen) => self.inquire(&mut client, chosen)?,
        };
        if self.json {
            writeln!(stdout(), "{}", serde_json::Value::from(rows))?;
        }
        Ok(faults)
    }

    fn say(&self, text: std::fmt::Arguments<'_>) -> std::io::Result<()> {
        if self.json {
            Ok(())
        } else {
            writeln!(stdout(), "{text}")
        }
    }

    fn scan(&self, client: &mut Client<AnyBus>) -> Result<(Vec<serde_json::Value>, u64)> {
        if stderr().is_terminal() {
            eprintln!("eel: searching; each node takes about 5 s");
        }
        let found = client.lss().list()?;
        for address in &found {
            self.say(format_args!("{address}"))?;
        }
        if found.is_empty() && !self.json {
            eprintln!("eel: no node without an id: those that have one are listed by `eel nodes`");
        }
        let rows = found.iter().map(|address| row(*address, None)).collect();
        Ok((rows, u64::from(found.is_empty())))
    }

    fn assign(
        &self,
        client: &mut Client<AnyBus>,
        assign: &Assign,
    ) -> Result<(Vec<serde_json::Value>, u64)> {
        assign.check(client)?;
        let mut rows = Vec::new();
        let mut silent = 0;
        for id in &assign.ids {
            let Some(address) = assign.select(client)? else {
                let rest = assign.ids.len() - rows.len();
                let ids = if rest == 1 { "id is" } else { "ids are" };
                eprintln!("eel: no more nodes without an id; {rest} {ids} left over");
                return Ok((rows, silent + 1));
            };
            let mut lss = client.lss();
            let given = lss
                .set_node_id(*id)
                .and_then(|()| if assign.store { lss.store() } else { Ok(()) });
            // Also where it refused, it must not stay in configuration.
            lss.switch_all(false)?;
            given?;
            let booted = assign.from.is_none() && boots(client, *id)?;
            let kept = if assign.store {
                "stored"
            } else {
                "until power is off"
            };
            match (assign.from, booted) {
                (Some(from), _) => self.say(format_args!(
                    "{address}: id {id} ({kept}); it holds after `eel nmt {} reset-communication`",
                    from.0
                ))?,
                (None, true) => self.say(format_args!("{address}: id {id} ({kept}), booted"))?,
                (None, false) => {
                    silent += 1;
                    eprintln!("eel: {address}: took id {id} and does not boot");
                }
            }
            let mut row = row(address, Some(*id));
            row["stored"] = json!(assign.store);
            row["booted"] = json!(booted);
            rows.push(row);
        }
        Ok((rows, silent))
    }

    fn store(
        &self,
        client: &mut Client<AnyBus>,
        chosen: &Chosen,
    ) -> Result<(Vec<serde_json::Value>, u64)> {
        let address = chosen.select(client)?;
        let mut lss = client.lss();
        let id = lss.node_id()?;
        let stored = lss.store();
        lss.switch_all(false)?;
        stored?;
        self.say(format_args!("{address}: id {} stored", shown(id)))?;
        Ok((vec![row(address, id)], 0))
    }

    fn inquire(
        &self,
        client: &mut Client<AnyBus>,
        chosen: &Chosen,
    ) -> Result<(Vec<serde_json::Value>, u64)> {
        chosen.select(client)?;
        let mut lss = client.lss();
        let (address, id) = (lss.identity()?, lss.node_id()?);
        lss.switch_all(false)?;
        self.say(format_args!("{address}: id {}", shown(id)))?;
        Ok((vec![row(address, id)], 0))
    }
}

fn shown(id: Option<u8>) -> String {
    id.map_or("none".to_owned(), |id| id.to_string())
}

/// Waits for the boot-up message of a node that just got its id.
fn boots(client: &mut Client<AnyBus>, id: u8) -> Result<bool> {
    match client.wait_for(id, BOOT, |state| state == NmtState::Initialising) {
        Ok(_) => Ok(true),
        Err(ClientError::NoState { .. }) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

impl Assign {
    /// Refuses ids that are given twice or taken.
    fn check(&self, client: &mut Client<AnyBus>) -> Result<()> {
        let different: BTreeSet<_> = self.ids.iter().collect();
        if different.len() != self.ids.len() {
            return Err(Usage("the same id is given twice".to_owned()).into());
        }
        let option = if self.serial.is_some() {
            "--serial"
        } else {
            "--from"
        };
        if (self.serial.is_some() || self.from.is_some()) && self.ids.len() != 1 {
            return Err(Usage(format!("{option} takes one id")).into());
        }
        let found = client.find_nodes(self.ids.iter().copied(), TAKEN)?;
        if let Some(taken) = found.iter().find(|found| self.ids.contains(&found.node)) {
            return Err(Usage(format!(
                "id {} is taken: `eel nodes` shows by whom",
                taken.node
            ))
            .into());
        }
        Ok(())
    }

    /// Puts the next node into configuration; `None` where there is none.
    fn select(&self, client: &mut Client<AnyBus>) -> Result<Option<LssAddress>> {
        let chosen = match (self.serial, self.from) {
            (None, None) => return Ok(client.lss().scan(Some(vertebra(0)))?),
            (serial, node) => Chosen { node, serial },
        };
        chosen.select(client).map(Some)
    }
}

impl Chosen {
    /// Puts the node into configuration and returns its identity.
    fn select(&self, client: &mut Client<AnyBus>) -> Result<LssAddress> {
        let address = match (self.node, self.serial) {
            (Some(node), _) => client.identify(node.0)?.address,
            (None, Some(serial)) => vertebra(serial),
            (None, None) => return Err(Usage("name a node".to_owned()).into()),
        };
        match client.lss().switch_to(address) {
            Ok(()) => Ok(address),
            Err(ClientError::Lss(LssFailure::Silence)) if self.node.is_some() => Err(Usage(
                "the node does not answer to LSS; it does not support it".to_owned(),
            )
            .into()),
            Err(error) => Err(error.into()),
        }
    }
}
