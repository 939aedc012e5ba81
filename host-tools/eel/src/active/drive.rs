//! `eel drive`: some vertebrae in one mode, for commissioning and for a look by hand.

use std::io::{Write, stdout};
use std::time::Duration;

use anyhow::Result;
use clap::{Args, Subcommand};
use eel_client::{Client, Method, Multiplexor, NmtCommand, NmtState};
use eel_head::{Config, Task};
use eel_kinematics::Pose;
use eel_protocol::{Cob, Frame, Mode, Moment, NodeId};
use eel_units::{Angle, Torque};

use super::bus::{self, AnyBus, BusOption, Consent};
use super::head::{alone, expected, seconds};
use super::live::{Live, Outcome};
use crate::source;
use crate::usage::Usage;

/// The COB-ID of RPDO2; the highest bit switches it off.
const RPDO2: Multiplexor = Multiplexor::new(0x1401, 1);
const INVALID: u32 = 1 << 31;
/// Torques of single motors.
const MOTOR_TORQUE: u16 = 0x2002;
/// Largest moment and torque of a frame, N·m.
const LARGEST_NM: f64 = 32.767;
/// How long a node may take to leave operation.
const PATIENCE: Duration = Duration::from_secs(1);

const AFTER: &str = "\
Starts the vertebrae named, and no others, brings them into a mode, and switches them off in order: after
--seconds, at Ctrl-C or SIGTERM. Where the command itself dies, they let go within 0.1 s. Watch them with
`eel sniff --node 3` or `eel scope 3 pose.yaw` in another terminal.

pose leads to a pose in 1 s and keeps it. hold keeps the pose in which it begins. moment produces a moment
about x (yaw), y (pitch), z (roll) of the base; inside the workspace nothing else acts, at its end the
controller's spring does. motor produces a torque of single motors, up to the damped torque (1 N.m), and
brakes a crank above 1 rad/s: to find a stiff bearing, a wrong sign, a dead bridge. damped resists motion
with little torque, brake shorts the motors.

Needs --yes except on a virtual interface. Only one head may be on a bus.

--json: JSON lines, as `eel head --json`.

Exit codes: 0 done and switched off in order; 1 a vertebra fell silent, latched or did not come into the
mode, or it was ended at once; 2 wrong usage; 3 the bus failed.

Examples:
  eel drive 3 pose --yaw 10 --degrees --seconds 5
  eel drive 3 moment --x 0.5                   0.5 N.m of yaw, until Ctrl-C
  eel drive 3 motor 1=0.3 3=-0.2               motors 1 and 3, N.m
  eel drive 1-10 damped";

/// Bring single vertebrae into a mode: a pose, a moment, a motor's torque, hold, damped, brake
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Drive {
    /// The vertebrae: 3,5 or 1-4
    #[arg(value_name = "NODES", value_parser = expected)]
    nodes: u16,
    #[command(subcommand)]
    what: What,
    #[command(flatten)]
    bus: BusOption,
    /// Switch off in order after so many seconds
    #[arg(long, value_name = "S", value_parser = seconds, global = true)]
    seconds: Option<f64>,
    /// Acknowledge stops that were latched before
    #[arg(long, global = true)]
    reset: bool,
    /// Agree to what may move the robot; not needed on a virtual interface
    #[arg(long, global = true)]
    yes: bool,
    /// Write JSON lines (schema below)
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Clone, Debug, Subcommand)]
enum What {
    /// Take a pose and keep it
    Pose {
        /// Yaw, rad
        #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
        yaw: f64,
        /// Pitch, rad
        #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
        pitch: f64,
        /// Roll, rad
        #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
        roll: f64,
        /// Angles are degrees
        #[arg(long)]
        degrees: bool,
    },
    /// Keep the pose of this moment
    Hold,
    /// Produce a moment about the axes of the base
    Moment {
        /// About x (yaw), N.m
        #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
        x: f64,
        /// About y (pitch), N.m
        #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
        y: f64,
        /// About z (roll), N.m
        #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
        z: f64,
    },
    /// Produce torques of single motors
    Motor {
        /// Motor 1 to 3 and its torque in N.m: 1=0.3
        #[arg(required = true, value_name = "MOTOR=N.M", value_parser = motor)]
        torques: Vec<(u8, f64)>,
    },
    /// Resist motion with little torque
    Damped,
    /// Short the motors
    Brake,
}

/// Reads `1=0.3`.
fn motor(text: &str) -> Result<(u8, f64), String> {
    let wrong = || format!("{text:?} is no torque of a motor: write 1=0.3, motor 1 to 3, N.m");
    let (number, torque) = text.split_once('=').ok_or_else(wrong)?;
    let number = number
        .parse()
        .ok()
        .filter(|number| (1..=3).contains(number));
    let torque = torque.parse().ok();
    number.zip(torque).ok_or_else(wrong)
}

impl Drive {
    /// Drives until the end, and returns 0 where all went well.
    pub fn run(&self) -> Result<u64> {
        let task = self.what.task()?;
        let moment = self.what.moment()?;
        let greetings = self.greetings()?;
        let name = self.bus.name()?;
        let consent = Consent { yes: self.yes };
        consent.check(&name, "driving a vertebra")?;
        let mut bus = alone(bus::open(&name)?, &name)?;
        if moment.is_some() {
            bus = self.listen_to_moments(bus, true)?;
        }
        let mut live = Live::new(bus, Config::only(self.nodes, task), self.json);
        live.resets_first = self.reset;
        live.greetings = greetings;
        for id in self.ids() {
            live.set_moment(id, moment);
        }
        source::catch_interrupt()?;
        let outcome = live.run(self.seconds.map(Duration::from_secs_f64))?;
        if moment.is_some() && !outcome.at_once {
            self.listen_to_moments(live.into_bus(), false)?;
        }
        let is_fine = outcome.is_fine() && outcome.most_running == self.ids().count();
        self.tell(&outcome)?;
        Ok(u64::from(!is_fine))
    }

    fn ids(&self) -> impl Iterator<Item = NodeId> {
        let nodes = self.nodes;
        NodeId::all().filter(move |id| nodes & (1 << id.index()) != 0)
    }

    /// Switches RPDO2 of the vertebrae on or off, which they allow outside operation.
    fn listen_to_moments(&self, bus: AnyBus, is_on: bool) -> Result<AnyBus> {
        let mut client = Client::new(bus);
        for id in self.ids() {
            let node = id.get();
            client.command(NmtCommand::EnterPreOperational, node)?;
            client.wait_for(node, PATIENCE, |state| state == NmtState::PreOperational)?;
            let off = if is_on { 0 } else { INVALID };
            let cob_id = u32::from(Cob::Moment(node).id()) | off;
            client.download(
                node,
                RPDO2,
                &cob_id.to_le_bytes(),
                Method::Automatic,
                &mut |_| (),
            )?;
        }
        Ok(client.into_bus())
    }

    /// Returns what is sent to each vertebra once it is in its mode: the torques of its motors.
    fn greetings(&self) -> Result<Vec<(NodeId, Frame)>> {
        let What::Motor { torques } = &self.what else {
            return Ok(Vec::new());
        };
        let mut all = Vec::new();
        for id in self.ids() {
            for (motor, torque) in torques {
                let [index_low, index_high] = MOTOR_TORQUE.to_le_bytes();
                let [low, high] = millinewton_metres(*torque)?.to_le_bytes();
                // An expedited download of two bytes (CiA 301, 7.2.4.3.3).
                let request = [0x2B, index_low, index_high, *motor, low, high, 0, 0];
                let cob = Cob::SdoRequest(id.get());
                all.extend(Frame::standard(cob.id(), &request).map(|frame| (id, frame)));
            }
        }
        Ok(all)
    }

    fn tell(&self, outcome: &Outcome) -> std::io::Result<()> {
        if self.json {
            return writeln!(stdout(), "{}", outcome.json());
        }
        let elapsed = outcome.elapsed.as_secs_f64();
        let (there, asked) = (outcome.most_running, self.ids().count());
        writeln!(
            stdout(),
            "{} after {elapsed:.1} s: {there} of {asked} vertebrae were in the mode",
            if outcome.at_once {
                "ended at once"
            } else {
                "switched off in order"
            }
        )
    }
}

impl What {
    fn task(&self) -> Result<Task> {
        Ok(match self {
            Self::Pose {
                yaw,
                pitch,
                roll,
                degrees,
            } => {
                let angle = |value: f64| {
                    let radians = if *degrees { value.to_radians() } else { value };
                    if radians.abs() <= std::f64::consts::FRAC_PI_2 {
                        Ok(Angle::from_tenth_milliradians(
                            (radians * 1e4).round() as i16
                        ))
                    } else {
                        Err(Usage(format!(
                            "{value} is no angle of a wrist: at most 90 degrees (--degrees) or 1.57 rad"
                        )))
                    }
                };
                Task::Pose(Pose {
                    yaw: angle(*yaw)?,
                    pitch: angle(*pitch)?,
                    roll: angle(*roll)?,
                })
            }
            Self::Hold => Task::Mode(Mode::Hold),
            Self::Moment { .. } => Task::Mode(Mode::Moment),
            Self::Motor { .. } => Task::Mode(Mode::Motor),
            Self::Damped => Task::Mode(Mode::Damped),
            Self::Brake => Task::Mode(Mode::Brake),
        })
    }

    /// Returns what RPDO2 says, where the mode needs it.
    fn moment(&self) -> Result<Option<Moment>> {
        let Self::Moment { x, y, z } = self else {
            return Ok(None);
        };
        let torque = |value: f64| {
            millinewton_metres(value).map(|milli| Torque::from_millinewton_metres(milli.into()))
        };
        Ok(Some(Moment {
            moment: [torque(*x)?, torque(*y)?, torque(*z)?],
            stiffness: 1 << 15,
        }))
    }
}

fn millinewton_metres(value: f64) -> Result<i16> {
    if value.abs() > LARGEST_NM || value.is_nan() {
        return Err(Usage(format!(
            "{value} N.m is more than a frame holds: at most {LARGEST_NM} N.m either way"
        ))
        .into());
    }
    Ok((value * 1e3).round() as i16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_and_its_torque_are_read_or_refused() {
        assert_eq!(motor("1=0.3"), Ok((1, 0.3)));
        assert_eq!(motor("3=-2"), Ok((3, -2.0)));
        for wrong in ["4=1", "0=1", "1", "1=", "=2", "one=2"] {
            assert!(motor(wrong).unwrap_err().contains("write 1=0.3"), "{wrong}");
        }
    }

    #[test]
    fn a_torque_beyond_the_wire_is_refused() {
        assert_eq!(millinewton_metres(-0.25).unwrap(), -250);
        let error = millinewton_metres(40.0).unwrap_err();
        assert!(error.is::<Usage>() && error.to_string().contains("32.767"));
        assert!(millinewton_metres(f64::NAN).is_err());
    }
}
