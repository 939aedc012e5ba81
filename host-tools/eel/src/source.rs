//! Frames from any bus, with what to do about lines that can't be read.

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use eel_transport::{Bus, BusError, Received};

/// Lines that can't be read and are told one by one; the rest is only counted.
const TOLD: u64 = 10;
/// Longest wait before the caller may flush and look at the time.
const PATIENCE: Duration = Duration::from_millis(100);

/// How often Ctrl-C came, or another wish that the program end.
static INTERRUPTS: AtomicU32 = AtomicU32::new(0);
/// How often Ctrl-C is left to the program before it ends it, whatever it does.
const PATIENT: u32 = 3;
/// Exit code of a program that Ctrl-C ended, as shells count it.
const INTERRUPT_CODE: i32 = 130;

/// When to stop, and how strict to be.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits {
    /// Whether a line that can't be read ends it all.
    pub strict: bool,
    /// After how many frames to stop.
    pub count: Option<u64>,
    /// After how long to stop.
    pub seconds: Option<f64>,
}

/// What a pass over a bus has seen.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// Frames and error reports.
    pub frames: u64,
    /// Lines that could not be read.
    pub malformed: u64,
    /// Frames that the system dropped because we were too slow.
    pub dropped: u64,
}

/// Something that takes what comes from a bus.
pub trait Sink {
    /// Takes one frame or error report.
    ///
    /// # Errors
    /// Those of its output; they end the pass.
    fn take(&mut self, received: &Received) -> std::io::Result<()>;

    /// Brings to light what was held back, as nothing comes at the moment.
    ///
    /// # Errors
    /// Those of its output; they end the pass.
    fn idle(&mut self) -> std::io::Result<()>;
}

/// Makes Ctrl-C, a system that ends the program (SIGTERM) and a terminal that goes away (SIGHUP, but not
/// under nohup) end the pass in good order; Ctrl-C that is pressed again and again ends the program.
///
/// # Errors
/// When the system refuses.
pub fn catch_interrupt() -> Result<()> {
    ctrlc::set_handler(interrupt).context("can't listen for Ctrl-C")?;
    #[cfg(unix)]
    catch_end().context("can't listen for SIGTERM")?;
    Ok(())
}

fn interrupt() {
    if INTERRUPTS.fetch_add(1, Ordering::Relaxed) >= PATIENT {
        std::process::exit(INTERRUPT_CODE);
    }
}

#[cfg(unix)]
fn catch_end() -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGTERM};

    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mut signals = vec![SIGTERM];
    if !ignores(&status, SIGHUP) {
        signals.push(SIGHUP);
    }
    let mut signals = signal_hook::iterator::Signals::new(signals)?;
    std::thread::spawn(move || {
        for _ in signals.forever() {
            interrupt();
        }
    });
    Ok(())
}

/// Tells by `/proc/self/status` whether whoever started the program, such as nohup, has a signal ignored.
#[cfg(unix)]
fn ignores(status: &str, signal: i32) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|digits| u64::from_str_radix(digits.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Returns how often the program was asked to end since [`catch_interrupt`].
pub fn interrupts() -> u32 {
    INTERRUPTS.load(Ordering::Relaxed)
}

/// Opens a bus or a file.
///
/// # Errors
/// What the transport says, with the cure.
pub fn open(url: &str) -> Result<Box<dyn Bus + Send>> {
    // The message of a bus error holds its cause already.
    eel_transport::open(url).map_err(|error| anyhow!(error.to_string()))
}

/// Hands everything that comes from `bus` to `sink` until the end, a limit or Ctrl-C.
///
/// # Errors
/// Those of the bus and of the sink; a malformed line only with [`Limits::strict`].
pub fn run(bus: &mut dyn Bus, limits: Limits, sink: &mut dyn Sink) -> Result<Seen> {
    let begin = Instant::now();
    let mut seen = Seen::default();
    let is_over =
        |seen: &Seen| interrupts() > 0 || limits.count.is_some_and(|count| seen.frames >= count);
    while !is_over(&seen) {
        if limits
            .seconds
            .is_some_and(|limit| begin.elapsed().as_secs_f64() >= limit)
        {
            break;
        }
        match bus.receive(PATIENCE) {
            Ok(Some(received)) => {
                seen.frames += 1;
                sink.take(&received)?;
            }
            Ok(None) => sink.idle()?,
            Err(BusError::Ended) => break,
            Err(error @ BusError::Line { .. }) if !limits.strict => {
                seen.malformed += 1;
                if seen.malformed <= TOLD {
                    eprintln!("eel: {error}; line skipped");
                }
            }
            Err(error) => bail!(error.to_string()),
        }
    }
    sink.idle()?;
    seen.dropped = bus.dropped();
    if seen.dropped > 0 {
        eprintln!(
            "eel: {} frames dropped by the system: eel was too slow",
            seen.dropped
        );
    }
    if seen.malformed > TOLD {
        eprintln!(
            "eel: {} malformed lines in all; --strict stops at the first",
            seen.malformed
        );
    }
    Ok(seen)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_signal_that_nohup_ignores_is_left_alone() {
        let status = "Name:\teel\nSigBlk:\t0000000000000000\nSigIgn:\t0000000000001001\n";
        assert!(ignores(status, 1));
        assert!(!ignores(status, 15) && !ignores("", 1));
    }
}
