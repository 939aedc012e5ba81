//! Which bus is meant, and whether what moves a robot may go there.

use anyhow::Result;
use clap::Args;
use eel_client::Client;
use eel_transport::{Bus, Interface, interfaces};

use super::NoBus;
use crate::usage::Usage;

/// The variable that names the bus.
const VARIABLE: &str = "EEL_BUS";

/// Any bus.
pub type AnyBus = Box<dyn Bus + Send>;

/// Which bus is meant.
#[derive(Debug, Args)]
pub struct BusOption {
    /// The bus, such as can0; without it what EEL_BUS names, else the only CAN interface that is up
    #[arg(short, long, value_name = "BUS", global = true)]
    pub bus: Option<String>,
}

/// The agreement to what may move a robot.
#[derive(Debug, Args)]
pub struct Consent {
    /// Agree to what may move the robot; not needed on a virtual interface
    #[arg(long)]
    pub yes: bool,
}

impl BusOption {
    /// Returns the name of the bus.
    ///
    /// # Errors
    /// [`Usage`] where several come into question, [`NoBus`] where none does.
    pub fn name(&self) -> Result<String> {
        choose(
            self.bus.as_deref(),
            std::env::var(VARIABLE).ok().as_deref(),
            &interfaces(),
        )
    }

    /// Opens the bus.
    ///
    /// # Errors
    /// As [`name`](Self::name), and what the transport says.
    pub fn open(&self) -> Result<AnyBus> {
        open(&self.name()?)
    }

    /// Opens the bus and makes a client on it.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn client(&self) -> Result<Client<AnyBus>> {
        Ok(Client::new(self.open()?))
    }
}

/// Opens a bus that can be sent to.
///
/// # Errors
/// [`Usage`] for a recording, and what the transport says.
pub fn open(name: &str) -> Result<AnyBus> {
    if name == "-" || name.contains(['.', '/', '\\']) {
        return Err(Usage(format!(
            "{name} is a recording and can't be sent to: name an interface such as vcan0"
        ))
        .into());
    }
    crate::source::open(name)
}

impl Consent {
    /// Lets an act that may move a robot pass on a virtual interface, or with consent.
    ///
    /// # Errors
    /// [`Usage`], which says what is missing.
    pub fn check(&self, bus: &str, act: &str) -> Result<()> {
        if self.yes || Interface::named(bus).is_virtual {
            return Ok(());
        }
        Err(Usage(format!(
            "{act} can move the robot on {bus}, which is no virtual interface: make sure that nobody \
             is within its reach, then say --yes"
        ))
        .into())
    }
}

fn choose(option: Option<&str>, variable: Option<&str>, all: &[Interface]) -> Result<String> {
    if let Some(name) = option.or(variable.filter(|name| !name.is_empty())) {
        return Ok(name.to_owned());
    }
    let names = |up: bool| {
        let names = all.iter().filter(|known| known.is_up == up);
        let names: Vec<_> = names.map(|known| known.name.as_str()).collect();
        names
    };
    match (&names(true)[..], &names(false)[..]) {
        ([one], _) => Ok((*one).to_owned()),
        ([], []) => Err(NoBus(
            "there is no CAN interface: plug an adapter in and say `ip link set can0 up type can \
             bitrate 1000000`, or run the command beside a virtual one: `cargo xtask vcan -- COMMAND`"
                .to_owned(),
        )
        .into()),
        ([], [down, ..]) => {
            let how = if down.starts_with("vcan") {
                ""
            } else {
                " type can bitrate 1000000"
            };
            Err(NoBus(format!(
                "no CAN interface is up: `ip link set {down} up{how}` as root"
            ))
            .into())
        }
        (several, _) => Err(Usage(format!(
            "several CAN interfaces are up ({}): choose one with --bus or the variable {VARIABLE}",
            several.join(", ")
        ))
        .into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interface(name: &str, is_up: bool) -> Interface {
        Interface {
            name: name.to_owned(),
            is_up,
            is_virtual: false,
        }
    }

    #[test]
    fn the_bus_is_the_one_named_or_the_only_one_that_is_up() {
        let both = [interface("can0", true), interface("vcan0", true)];
        let one = [interface("can0", false), interface("vcan0", true)];
        assert_eq!(choose(Some("can1"), Some("vcan0"), &both).unwrap(), "can1");
        assert_eq!(choose(None, Some("vcan0"), &both).unwrap(), "vcan0");
        assert_eq!(choose(None, Some(""), &one).unwrap(), "vcan0");
        let error = choose(None, None, &both).unwrap_err();
        assert!(error.is::<Usage>() && error.to_string().contains("can0, vcan0"));
        let error = choose(None, None, &one[..1]).unwrap_err();
        assert!(error.is::<NoBus>() && error.to_string().contains("ip link set can0 up"));
        let error = choose(None, None, &[]).unwrap_err();
        assert!(error.to_string().contains("there is no CAN interface"));
    }

    #[test]
    fn what_moves_a_robot_needs_consent_where_there_is_a_cable() {
        let (with, without) = (Consent { yes: true }, Consent { yes: false });
        assert!(with.check("can7", "it").is_ok());
        assert!(without.check("vcan77", "it").is_ok());
        let error = without.check("can7", "NMT start").unwrap_err();
        assert!(error.is::<Usage>());
        assert!(
            error
                .to_string()
                .starts_with("NMT start can move the robot on can7")
        );
        assert!(error.to_string().ends_with("say --yes"));
    }

    #[test]
    fn a_recording_is_no_bus_to_send_to() {
        assert!(
            open("dive.log")
                .err()
                .is_some_and(|error| error.is::<Usage>())
        );
    }
}
