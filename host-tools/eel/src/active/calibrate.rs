//! `eel calibrate` and `eel self-test`: the procedures of object 0x2060.

use std::io::{IsTerminal, Write, stdin, stdout};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::{Args, ValueEnum};
use eel_client::{Client, ClientError, Method, Multiplexor, NmtCommand, NmtState};
use eel_protocol::procedure::{Check, Progress, Reason, Step};
use serde_json::json;

use super::Node;
use super::bus::{AnyBus, BusOption, Consent};

const STEP: Multiplexor = Multiplexor::new(0x2060, 1);
const PROGRESS: Multiplexor = Multiplexor::new(0x2060, 2);
const REASON: Multiplexor = Multiplexor::new(0x2060, 3);
const MOTOR: Multiplexor = Multiplexor::new(0x2060, 4);
const CHECKS: Multiplexor = Multiplexor::new(0x2060, 5);
const FAILED: Multiplexor = Multiplexor::new(0x2060, 6);
/// The application's parameters of CiA 301, 7.5.2.14.
const SAVE: Multiplexor = Multiplexor::new(0x1010, 3);
/// How often progress is asked for.
const LOOK: Duration = Duration::from_millis(100);
/// How long a step may take; the node itself ends the longest after 60 s.
const LONGEST: Duration = Duration::from_secs(65);
/// How long a node may take to change its state or to write its memory.
const PATIENCE: Duration = Duration::from_secs(5);

const AFTER: &str = "\
The vertebra must be on the bus and stopped by nothing; it is brought to pre-operational and stays there.
Without --step it goes through all four, and stores what they found for this unit:

  offsets  what the current sensors read without a current; keep the motors still
  home     put the wrist into the jig, yaw, pitch and roll 0, and hold it still
  senses   turn the wrist by hand to positive yaw, 22 degrees or more, back, and then to positive roll, 3
           degrees or more; for 60 s it watches which way encoders count
  leads    let go: each motor turns its crank by 10 mrad, with at most the damped torque (1 N.m)

Where standard input is a terminal it waits for Enter before a step that needs hands.

--json: one object: node (number), steps (array of {step (string), motor (number or null), result
(\"done\" or a sentence)}), stored (boolean).

Exit codes: 0 calibrated; 1 a step failed, or the node refuses or is silent; 2 wrong usage; 3 the bus failed.

Examples:
  eel calibrate 3 --yes
  eel calibrate 3 --step home                  the jig once more, after a crank slipped
  eel read 3 calibration                       what is set";

const AFTER_TEST: &str = "\
The vertebra is brought to pre-operational and stays there. Sensors are looked at for 0.2 s; where all is
well, each motor carries 0.2 A for 40 ms both ways (0.3 N.m), so the wrist must be free to twitch.

--json: one object: node (number), passed (boolean), checks (array of {name (string), passed (boolean or
null: not made)}), motor (number or null), reason (string or null).

Exit codes: 0 all passed; 1 a check failed, or the node refuses or is silent; 2 wrong usage; 3 the bus failed.

Examples:
  eel self-test 3 --yes";

/// Find out how a vertebra's motors and encoders are built in, and store it
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Calibrate {
    /// The node: 1 to 127
    node: Node,
    /// Only this step; nothing is stored
    #[arg(long)]
    step: Option<Part>,
    #[command(flatten)]
    bus: BusOption,
    #[command(flatten)]
    consent: Consent,
    /// Write one JSON object (schema below)
    #[arg(long)]
    json: bool,
}

/// Let a vertebra test its sensors and bridges
#[derive(Debug, Args)]
#[command(after_help = AFTER_TEST)]
pub struct SelfTest {
    /// The node: 1 to 127
    node: Node,
    #[command(flatten)]
    bus: BusOption,
    #[command(flatten)]
    consent: Consent,
    /// Write one JSON object (schema below)
    #[arg(long)]
    json: bool,
}

/// A step of a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// What current sensors read without a current
    Offsets,
    /// The pose of the jig is home
    Home,
    /// Which way encoders count
    Senses,
    /// Which way motors turn
    Leads,
}

impl Part {
    const ALL: [Self; 4] = [Self::Offsets, Self::Home, Self::Senses, Self::Leads];

    const fn step(self) -> Step {
        match self {
            Self::Offsets => Step::Offsets,
            Self::Home => Step::Home,
            Self::Senses => Step::Senses,
            Self::Leads => Step::Leads,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Offsets => "offsets",
            Self::Home => "home",
            Self::Senses => "senses",
            Self::Leads => "leads",
        }
    }

    /// Says what hands have to do before it, or during it.
    const fn request(self) -> Option<&'static str> {
        match self {
            Self::Offsets => None,
            Self::Home => Some("put the wrist into the jig, at home, and hold it still"),
            Self::Senses => Some(
                "then turn the wrist to positive yaw (22 degrees) and positive roll (3 degrees)",
            ),
            Self::Leads => Some("let go of the wrist: each motor turns it a little"),
        }
    }
}

/// How a step ended.
struct Ended {
    progress: Progress,
    reason: Reason,
    motor: Option<u8>,
}

impl Calibrate {
    /// Calibrates and returns how many steps failed.
    pub fn run(&self) -> Result<u64> {
        self.consent.check(&self.bus.name()?, "a calibration")?;
        let mut client = prepared(&self.bus, self.node)?;
        let parts = self.step.map_or(Part::ALL.to_vec(), |part| vec![part]);
        let (mut steps, mut failed) = (Vec::new(), 0);
        for part in parts {
            if let Some(request) = part.request().filter(|_| !self.json) {
                ask(part, request)?;
            }
            let Ended {
                progress,
                reason,
                motor,
            } = perform(&mut client, self.node, part.step())?;
            let is_done = progress == Progress::Done;
            let result = if is_done { "done" } else { reason.sentence() };
            steps.push(json!({"step": part.name(), "motor": motor, "result": result}));
            if !self.json {
                let motor = motor.map_or(String::new(), |motor| format!("motor {motor}: "));
                writeln!(stdout(), "{:<8} {motor}{result}", part.name())?;
            }
            if !is_done {
                failed += 1;
                break;
            }
        }
        let stored = self.step.is_none() && failed == 0;
        if stored {
            client.download(self.node.0, SAVE, b"save", Method::Automatic, &mut |_| ())?;
        }
        if self.json {
            let all = json!({"node": self.node.0, "steps": steps, "stored": stored});
            writeln!(stdout(), "{all}")?;
        } else if stored {
            writeln!(
                stdout(),
                "{}: calibrated and stored; `eel self-test {}` tries it",
                self.node,
                self.node.0
            )?;
        } else if failed == 0 {
            let node = self.node;
            writeln!(
                stdout(),
                "{node}: set; `eel store {} save application` keeps it",
                node.0
            )?;
        }
        Ok(failed)
    }
}

impl SelfTest {
    /// Tests and returns how many checks failed.
    pub fn run(&self) -> Result<u64> {
        self.consent.check(&self.bus.name()?, "a self test")?;
        let mut client = prepared(&self.bus, self.node)?;
        let Ended {
            progress,
            reason,
            motor,
        } = perform(&mut client, self.node, Step::Test)?;
        let made = number(&mut client, self.node, CHECKS)? as u16;
        let failed = number(&mut client, self.node, FAILED)? as u16;
        let passed = progress == Progress::Done;
        let outcome = |check: &Check| {
            let is_made = made & check.mask() != 0;
            is_made.then_some(failed & check.mask() == 0)
        };
        if self.json {
            let checks: Vec<_> = Check::ALL
                .iter()
                .map(|check| json!({"name": check.name(), "passed": outcome(check)}))
                .collect();
            let reason = (!passed).then(|| reason.sentence());
            let all = json!({"node": self.node.0, "passed": passed, "checks": checks,
                "motor": motor, "reason": reason});
            writeln!(stdout(), "{all}")?;
        } else {
            let mut out = stdout().lock();
            for check in Check::ALL {
                let verdict = match outcome(check) {
                    Some(true) => "pass",
                    Some(false) => "FAIL",
                    None => "-",
                };
                writeln!(
                    out,
                    "{verdict:<5} {:<13} {}",
                    check.name(),
                    check.sentence()
                )?;
            }
            match (passed, motor) {
                (true, _) => writeln!(out, "{}: all is well", self.node)?,
                (false, Some(motor)) => {
                    writeln!(out, "{}: motor {motor}: {}", self.node, reason.sentence())?;
                }
                (false, None) => writeln!(out, "{}: {}", self.node, reason.sentence())?,
            }
        }
        Ok(u64::from(!passed))
    }
}

/// Opens the bus and brings the node to where procedures run.
fn prepared(bus: &BusOption, node: Node) -> Result<Client<AnyBus>> {
    let mut client = bus.client()?;
    client.settings_mut().answer = PATIENCE;
    client.command(NmtCommand::EnterPreOperational, node.0)?;
    client.wait_for(node.0, PATIENCE, |state| state == NmtState::PreOperational)?;
    Ok(client)
}

/// Orders a step and waits for its end.
fn perform(client: &mut Client<AnyBus>, node: Node, step: Step) -> Result<Ended> {
    client.download(node.0, STEP, &[step as u8], Method::Automatic, &mut |_| ())?;
    let start = Instant::now();
    loop {
        let code = number(client, node, PROGRESS)? as u8;
        let progress = Progress::from_code(code).unwrap_or_default();
        if progress != Progress::Running || start.elapsed() > LONGEST {
            let reason = Reason::from_code(number(client, node, REASON)? as u8);
            let motor = number(client, node, MOTOR)? as u8;
            return Ok(Ended {
                progress,
                reason: reason.unwrap_or_default(),
                motor: (motor != 0).then_some(motor),
            });
        }
        sleep(LOOK);
    }
}

/// Reads a number of at most four bytes.
fn number(
    client: &mut Client<AnyBus>,
    node: Node,
    object: Multiplexor,
) -> Result<u32, ClientError> {
    let bytes = client.upload(node.0, object, Method::Automatic, &mut |_| ())?;
    let mut all = [0; 4];
    for (to, from) in all.iter_mut().zip(bytes) {
        *to = from;
    }
    Ok(u32::from_le_bytes(all))
}

/// Says what hands have to do, and waits where somebody is there to do it.
fn ask(part: Part, request: &str) -> Result<()> {
    let mut out = stdout();
    if !stdin().is_terminal() {
        return Ok(());
    }
    write!(out, "{:<8} press Enter, {request} ", part.name())?;
    out.flush()?;
    let mut line = String::new();
    stdin().read_line(&mut line)?;
    Ok(())
}
