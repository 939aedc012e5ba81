//! The loop: a packet in, a turn, a packet out.

use cortex_m_semihosting::debug;
use eel_vertebra::lockstep::{self, Frames, HEADER, Header, Kind, MAX_PACKET};
use eel_vertebra::store::{RamFlash, Store};
use eel_vertebra::{Drive, Keepsake, Settings, Vertebra, turn};

use crate::console::{leave, say};
use crate::meter::Meter;
use crate::pipe::{Broken, Pipe};

/// Why the image gave up.
#[derive(Debug)]
enum Failure {
    /// A pipe broke.
    Pipe,
    /// The input is no packet.
    Packet,
    /// The packet has no place here.
    Order,
}

impl From<Broken> for Failure {
    fn from(_: Broken) -> Self {
        Self::Pipe
    }
}

impl From<lockstep::PacketError> for Failure {
    fn from(_: lockstep::PacketError) -> Self {
        Self::Packet
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let status = match run() {
        Ok(()) => debug::EXIT_SUCCESS,
        Err(failure) => {
            say(format_args!("{failure:?}"));
            debug::EXIT_FAILURE
        }
    };
    leave(status)
}

/// Takes turns until the input ends.
fn run() -> Result<(), Failure> {
    let peripherals = cortex_m::Peripherals::take().ok_or(Failure::Order)?;
    let mut meter = Meter::new(peripherals.SYST);
    let mut input = Pipe::open(c"lockstep.in")?;
    let mut output = Pipe::create(c"lockstep.out")?;
    let mut vertebra = None;
    let mut store = Store::new(RamFlash::new());
    let mut kept = Keepsake::EMPTY;
    let mut body = [0; MAX_PACKET - HEADER];
    loop {
        let mut header = [0; HEADER];
        if !input.fill(&mut header)? {
            break;
        }
        let Header { kind, length } = Header::decode(header)?;
        let body = body.get_mut(..length).ok_or(Failure::Packet)?;
        if !body.is_empty() && !input.fill(body)? {
            return Err(Failure::Pipe);
        }
        match (kind, &mut vertebra) {
            (Kind::Start, _) => {
                let start = lockstep::Start::decode(body)?;
                let settings = Settings::prototype(start.node, start.serial);
                let (stored, now) = (store.load(), start.now);
                let made = vertebra.insert(Vertebra::with_stored(settings, &stored, now));
                if start.failed {
                    made.stop_after_failure(&kept);
                }
            }
            (Kind::Input, Some(vertebra)) => {
                let given = lockstep::Input::decode(body)?;
                let mut frames = Frames::new();
                let mut asked = None;
                // All that a board does in its tick, but for its drivers and its flash.
                let work = || {
                    let drives = answer(vertebra, &given, &mut frames);
                    if let Some(record) = vertebra.poll_store() {
                        asked = Some(record.clone());
                    }
                    if let Some(keepsake) = vertebra.poll_keepsake() {
                        kept = keepsake;
                    }
                    drives
                };
                let drives = meter.count(work, is_driven);
                if let Some(record) = &asked {
                    let outcome = store.save(record);
                    vertebra.finish_store(given.now, outcome);
                }
                let made = lockstep::Output {
                    drives,
                    trim_ns: vertebra.tick_trim_ns(),
                    chain_out: vertebra.chain_out(),
                    frames,
                };
                output.write_all(made.encode().as_bytes())?;
            }
            (Kind::Input, None) | (Kind::Output, _) => return Err(Failure::Order),
        }
    }
    let taken = meter.read();
    say(format_args!(
        "{} turns, instructions a turn: {} median and {} longest where driven, {} mean, {} worst",
        taken.turns, taken.median, taken.worst_driven, taken.mean, taken.worst
    ));
    Ok(())
}

/// Tells whether a turn ends with a motor driven.
fn is_driven(drives: &[Drive; 3]) -> bool {
    let mut drives = drives.iter();
    drives.any(|drive| matches!(drive, Drive::Current(_)))
}

/// Does one turn, whose frames are appended.
fn answer(vertebra: &mut Vertebra, given: &lockstep::Input, frames: &mut Frames) -> [Drive; 3] {
    let lockstep::Input {
        now,
        sample,
        frames: heard,
        room,
    } = given;
    let heard = heard.iter().copied();
    turn(vertebra, *now, heard, sample, (*room).into(), |frame| {
        // A packet has room for as many as may be asked for.
        let _ = frames.push(frame);
    })
}
