//! `eel store`: parameters that outlast power-off.

use std::io::{Write, stdout};
use std::time::Duration;

use anyhow::Result;
use clap::{Args, ValueEnum};
use eel_client::{Method, Multiplexor};
use serde_json::json;

use super::Node;
use super::bus::BusOption;

/// Objects of CiA 301, 7.5.2.14 and 7.5.2.15.
const SAVE: u16 = 0x1010;
const RESTORE: u16 = 0x1011;
/// How long a node may take to write its memory.
const PATIENCE: Duration = Duration::from_secs(5);

const AFTER: &str = "\
communication is what lies in 0x1000-0x1FFF: PDOs, heartbeat, SYNC, EMCY. application is the rest: gains
and limits. A node stores while it does not move; restored values hold after its reset.

--json: one object: node (number), action (\"save\" or \"restore\"), group (string).

Exit codes: 0 fine; 1 the node refuses or does not answer; 2 wrong usage; 3 the bus failed.

Examples:
  eel store 3                                  save all
  eel store 3 save application
  eel store 3 restore && eel nmt 3 reset       as it left the factory";

/// Let a node store its parameters, or restore those it left the factory with
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Store {
    /// The node: 1 to 127
    node: Node,
    /// What to do
    #[arg(default_value = "save")]
    action: Action,
    /// Which parameters
    #[arg(default_value = "all")]
    group: Group,
    #[command(flatten)]
    bus: BusOption,
    /// Write one JSON object (schema below)
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Action {
    /// Store the parameters as they are now
    Save,
    /// Go back to the defaults at the next reset
    Restore,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Group {
    /// Both groups
    All = 1,
    /// 0x1000-0x1FFF
    Communication = 2,
    /// 0x2000 and above
    Application = 3,
}

impl Group {
    const fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Communication => "communication",
            Self::Application => "application",
        }
    }
}

impl Store {
    /// Stores or restores.
    pub fn run(&self) -> Result<u64> {
        let mut client = self.bus.client()?;
        client.settings_mut().answer = PATIENCE;
        let (index, signature) = match self.action {
            Action::Save => (SAVE, b"save"),
            Action::Restore => (RESTORE, b"load"),
        };
        let object = Multiplexor::new(index, self.group as u8);
        client.download(
            self.node.0,
            object,
            signature,
            Method::Automatic,
            &mut |_| (),
        )?;
        let (node, group) = (self.node, self.group.name());
        let parameters = match self.group {
            Group::All => "all parameters".to_owned(),
            _ => format!("{group} parameters"),
        };
        if self.json {
            let action = match self.action {
                Action::Save => "save",
                Action::Restore => "restore",
            };
            let all = json!({"node": node.0, "action": action, "group": group});
            writeln!(stdout(), "{all}")?;
        } else if self.action == Action::Save {
            writeln!(stdout(), "{node}: {parameters} stored")?;
        } else {
            writeln!(
                stdout(),
                "{node}: {parameters} restored; they hold after `eel nmt {} reset`",
                node.0
            )?;
        }
        Ok(0)
    }
}
