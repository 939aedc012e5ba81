//! `eel nmt`: states of nodes.

use std::io::{Write, stdout};
use std::str::FromStr;
use std::time::Duration;

use anyhow::Result;
use clap::{Args, ValueEnum};
use eel_client::{Client, NmtCommand, NmtState};
use eel_protocol::messages::Choices;
use serde_json::json;

use super::Node;
use super::bus::{self, AnyBus, BusOption, Consent};

/// Longest wait for a heartbeat that confirms the command.
const PATIENCE: Duration = Duration::from_millis(1_500);
/// How long the heartbeats of all nodes are awaited.
const ALL: Duration = Duration::from_millis(600);

const AFTER: &str = "\
A node answers no NMT command; its next heartbeat shows the state, which is awaited for 1.5 s (for all:
0.6 s, then everybody who was heard is listed).

start needs --yes except on a virtual interface: what is operational follows targets. A vertebra that
leaves operation while it moves lets go and latches.

--json: one object: command (string), nodes (array of objects: node (number), state (string), confirmed
(bool)).

Exit codes: 0 fine; 1 a node did not report the state, or nobody was heard; 2 wrong usage; 3 the bus failed.

Examples:
  eel nmt 3 pre-operational
  eel nmt all stop
  eel nmt 3 reset                              as after power-on
  eel nmt -b can0 all start --yes";

/// Command the state of a node, or of all
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Nmt {
    /// The node, 1 to 127, or all
    node: Addressee,
    /// What it shall do
    command: Act,
    #[command(flatten)]
    bus: BusOption,
    #[command(flatten)]
    consent: Consent,
    /// Write one JSON object (schema below)
    #[arg(long)]
    json: bool,
}

/// One node, or all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Addressee(Option<Node>);

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Act {
    /// Enter Operational: PDOs work, targets are followed
    Start,
    /// Enter Stopped: deaf but for NMT
    Stop,
    /// Enter Pre-operational: everything but PDOs
    PreOperational,
    /// Start anew as after power-on
    Reset,
    /// Start the communication anew; a new node id holds from then on
    ResetCommunication,
}

impl FromStr for Addressee {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "all" {
            return Ok(Self(None));
        }
        let node = text
            .parse()
            .map_err(|_| format!("{text:?} is no node: write all, head or a number 1 to 127"));
        node.map(|node| Self(Some(node)))
    }
}

impl Act {
    const fn command(self) -> NmtCommand {
        match self {
            Self::Start => NmtCommand::Start,
            Self::Stop => NmtCommand::Stop,
            Self::PreOperational => NmtCommand::EnterPreOperational,
            Self::Reset => NmtCommand::ResetNode,
            Self::ResetCommunication => NmtCommand::ResetCommunication,
        }
    }
}

/// Returns the name of a state.
pub fn state_name(state: NmtState) -> &'static str {
    Choices::NmtState.name(state as i64).unwrap_or("unknown")
}

impl Nmt {
    /// Commands, and returns how many nodes did not obey as far as they were heard.
    pub fn run(&self) -> Result<u64> {
        let bus = self.bus.name()?;
        let command = self.command.command();
        if command == NmtCommand::Start {
            self.consent.check(&bus, "NMT start")?;
        }
        let mut client = Client::new(bus::open(&bus)?);
        let node = self.node.0.map_or(0, |node| node.0);
        client.command(command, node)?;
        let states = match self.node.0 {
            Some(node) => one(&mut client, node, command)?,
            None => everybody(&mut client)?,
        };
        if states.is_empty() {
            eprintln!(
                "eel: nobody was heard on {bus}: nodes are off, at another bit rate, have no id yet (`eel lss \
                 scan`), or send no heartbeat; the command was sent"
            );
        }
        let is_confirmed = |state: NmtState| {
            state == command.target() || command.is_reset() && state == NmtState::Initialising
        };
        let mut refusals = u64::from(states.is_empty());
        let mut rows = Vec::new();
        for (node, state) in states {
            let confirmed = is_confirmed(state);
            refusals += u64::from(!confirmed);
            let name = state_name(state);
            if self.json {
                rows.push(json!({"node": node.0, "state": name, "confirmed": confirmed}));
            } else {
                let still = if confirmed { "" } else { "still " };
                writeln!(stdout(), "{node}: {still}{name}")?;
            }
        }
        if self.json {
            let name = Choices::NmtCommand.name(command as i64);
            writeln!(stdout(), "{}", json!({"command": name, "nodes": rows}))?;
        }
        Ok(refusals)
    }
}

/// Waits until one node shows the commanded state.
fn one(
    client: &mut Client<AnyBus>,
    node: Node,
    command: NmtCommand,
) -> Result<Vec<(Node, NmtState)>> {
    let wanted = command.target();
    let reached = |state| {
        if command.is_reset() {
            state == NmtState::Initialising
        } else {
            state == wanted
        }
    };
    match client.wait_for(node.0, PATIENCE, reached) {
        Ok(state) => Ok(vec![(node, state)]),
        // It is there, and in another state.
        Err(eel_client::ClientError::NoState { .. }) if client.heard(node.0).is_some() => {
            let state = client.heard(node.0).map(|heard| heard.state);
            Ok(state.map(|state| (node, state)).into_iter().collect())
        }
        Err(error) => Err(error.into()),
    }
}

/// Lists the states of all nodes that are heard; the head is no slave.
fn everybody(client: &mut Client<AnyBus>) -> Result<Vec<(Node, NmtState)>> {
    client.listen(ALL)?;
    let nodes = (1..eel_protocol::HEAD_NODE).filter_map(|node| {
        let heard = client.heard(node)?;
        Some((Node(node), heard.state))
    });
    Ok(nodes.collect())
}
