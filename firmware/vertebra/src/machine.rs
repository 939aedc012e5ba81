//! The states of a vertebra and what leads from one to the next.
//!
//! A stop is latched: a stream of targets that resumes moves nothing, only a fault reset, then an
//! "off", then a new "run" does. Powering up counts as a stop, and so does a "run" that was
//! refused: the next one needs an "off" before it.

use eel_protocol::{Mode, State};
use eel_units::{Duration, Instant};

/// Time of the damped part of a stop.
pub const STOP_DAMPED: Duration = Duration::from_millis(300);
/// Time of the braked part of a stop, and of braking after a fault.
pub const STOP_BRAKE: Duration = Duration::from_millis(2_000);

/// Where a vertebra stands.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    state: State,
    since: Instant,
    armed: bool,
    last_mode: Option<Mode>,
    faulty_motor: Option<usize>,
    free: bool,
}

/// What a change of mode came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The state is the one asked for.
    Done,
    /// Not enabled: a reason stands against it, or no "off" came before.
    Refused,
    /// A latched stop was acknowledged.
    Reset,
}

impl Machine {
    /// Starts at power-up.
    pub const fn new(now: Instant) -> Self {
        Self {
            state: State::NotReady,
            since: now,
            armed: false,
            last_mode: None,
            faulty_motor: None,
            free: false,
        }
    }

    /// Returns the state.
    pub const fn state(&self) -> State {
        self.state
    }

    /// Returns how long the state has lasted.
    pub const fn elapsed(&self, now: Instant) -> Duration {
        now.since(self.since)
    }

    /// Returns the motor (0–2) that is at fault, if it is one motor.
    pub const fn faulty_motor(&self) -> Option<usize> {
        self.faulty_motor
    }

    /// Tells whether a stop is still slowing the wrist down.
    pub const fn is_stopping(&self) -> bool {
        matches!(self.state, State::StopDamped | State::StopBrake)
    }

    /// Tells whether the wrist is controlled: enabled, or stopping.
    pub const fn is_live(&self) -> bool {
        self.is_enabled() || self.is_stopping()
    }

    /// Tells whether motors carry current: controlled, or tried one by one.
    pub fn is_powered(&self) -> bool {
        self.is_live() || self.state == State::Test
    }

    /// Tells whether the motors that are not at fault brake after a fault.
    pub fn brakes_after_fault(&self, now: Instant) -> bool {
        self.state == State::Fault && !self.free && self.elapsed(now) < STOP_BRAKE
    }

    /// Tells whether a motor may carry current.
    pub fn may_carry_current(&self, now: Instant) -> bool {
        self.is_powered() || self.brakes_after_fault(now)
    }

    /// Tells whether the wrist does what the head asks of it.
    pub const fn is_enabled(&self) -> bool {
        matches!(
            self.state,
            State::Run | State::Hold | State::Moment | State::Motor | State::Damped | State::Brake
        )
    }

    /// Begins to try single motors, where nothing is enabled or latched. Tells whether it does.
    pub fn begin_test(&mut self, now: Instant) -> bool {
        let may = matches!(
            self.state,
            State::NotReady | State::SwitchedOff | State::Ready
        );
        if may {
            self.enter(now, State::Test);
        }
        may
    }

    /// Ends that, where nothing else has.
    pub fn end_test(&mut self, now: Instant) {
        if self.state == State::Test {
            self.enter(now, State::NotReady);
        }
    }

    /// Takes the mode of a target frame. A latched state stays while `cleared` is false.
    pub fn command(&mut self, now: Instant, mode: Mode, cleared: bool) -> Outcome {
        let before = self.last_mode.replace(mode);
        if self.state.is_latched() {
            let acknowledged = mode == Mode::FaultReset && before != Some(Mode::FaultReset);
            if !acknowledged {
                return Outcome::Refused;
            }
            if !cleared {
                return Outcome::Refused;
            }
            self.armed = false;
            self.faulty_motor = None;
            self.enter(now, State::SwitchedOff);
            return Outcome::Reset;
        }
        let Some(wanted) = mode.state() else {
            self.armed |= mode == Mode::Off;
            if self.is_enabled() {
                self.enter(now, State::Ready);
            }
            return Outcome::Done;
        };
        if self.is_enabled() || (self.state == State::Ready && self.armed) {
            self.enter(now, wanted);
            Outcome::Done
        } else {
            // Asked too early: the same stream must not enable once the reason is gone.
            self.armed = false;
            Outcome::Refused
        }
    }

    /// Follows the clock and the checks: `aligned` once the angles are known, `may_enable` while
    /// nothing stands against it.
    pub fn advance(&mut self, now: Instant, aligned: bool, may_enable: bool) {
        let elapsed = self.elapsed(now);
        match self.state {
            State::NotReady if aligned => self.enter(now, State::SwitchedOff),
            State::SwitchedOff if !aligned => self.enter(now, State::NotReady),
            State::SwitchedOff if may_enable => self.enter(now, State::Ready),
            State::Ready if !may_enable => self.enter(now, State::SwitchedOff),
            State::StopDamped if elapsed >= STOP_DAMPED => self.enter(now, State::StopBrake),
            State::StopBrake if elapsed >= STOP_BRAKE => self.enter(now, State::StopOff),
            _ => {}
        }
    }

    /// Stops in order when enabled: damped, then braked, then off. Tells whether it had to.
    pub fn stop(&mut self, now: Instant) -> bool {
        let enabled = self.is_enabled();
        if enabled {
            self.enter(now, State::StopDamped);
        }
        enabled
    }

    /// Switches off at once and latches. Tells whether that is new.
    pub fn emergency_stop(&mut self, now: Instant) -> bool {
        self.free = true;
        let new = !matches!(self.state, State::StopOff | State::Fault);
        if new {
            self.enter(now, State::StopOff);
        }
        new
    }

    /// Takes a fault of this vertebra, of one motor where `motor` tells. Tells whether it is new.
    pub fn fault(&mut self, now: Instant, motor: Option<usize>) -> bool {
        let new = self.state != State::Fault;
        if new {
            self.faulty_motor = motor;
            self.free = !self.is_enabled() && !self.is_stopping();
            self.enter(now, State::Fault);
        }
        new
    }

    fn enter(&mut self, now: Instant, state: State) {
        if self.state != state {
            self.state = state;
            self.since = now;
        }
        if state.is_latched() {
            self.armed = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::from_micros(millis * 1_000)
    }

    /// A vertebra that runs since 1 ms.
    fn running() -> Machine {
        let mut machine = Machine::new(at(0));
        machine.advance(at(0), true, true);
        machine.advance(at(0), true, true);
        assert_eq!(machine.state(), State::Ready);
        assert_eq!(machine.command(at(0), Mode::Off, true), Outcome::Done);
        assert_eq!(machine.command(at(1), Mode::Run, true), Outcome::Done);
        assert_eq!(machine.state(), State::Run);
        machine
    }

    #[test]
    fn does_not_run_on_a_stream_that_was_there_before_it() {
        let mut machine = Machine::new(at(0));
        machine.advance(at(0), true, true);
        machine.advance(at(0), true, true);
        assert_eq!(machine.command(at(1), Mode::Run, true), Outcome::Refused);
        assert_eq!(machine.state(), State::Ready);
    }

    #[test]
    fn stops_in_three_steps_and_stays_stopped() {
        let mut machine = running();
        assert!(machine.stop(at(100)));
        for (time, state) in [
            (101, State::StopDamped),
            (400, State::StopBrake),
            (2_399, State::StopBrake),
            (2_400, State::StopOff),
            (9_999, State::StopOff),
        ] {
            machine.advance(at(time), true, true);
            assert_eq!(machine.command(at(time), Mode::Run, true), Outcome::Refused);
            assert_eq!(machine.state(), state, "{time} ms");
        }
    }

    #[test]
    fn needs_reset_then_off_then_run_after_a_stop() {
        let mut machine = running();
        assert!(machine.emergency_stop(at(2)));
        assert_eq!(machine.command(at(3), Mode::Off, true), Outcome::Refused);
        assert_eq!(
            machine.command(at(4), Mode::FaultReset, false),
            Outcome::Refused
        );
        assert_eq!(
            machine.command(at(5), Mode::FaultReset, true),
            Outcome::Refused
        );
        assert_eq!(machine.command(at(6), Mode::Off, true), Outcome::Refused);
        assert_eq!(
            machine.command(at(7), Mode::FaultReset, true),
            Outcome::Reset
        );
        machine.advance(at(7), true, true);
        assert_eq!(machine.command(at(8), Mode::Run, true), Outcome::Refused);
        assert_eq!(machine.command(at(9), Mode::Off, true), Outcome::Done);
        assert_eq!(machine.command(at(10), Mode::Run, true), Outcome::Done);
        assert_eq!(machine.state(), State::Run);
    }

    #[test]
    fn a_fault_outranks_a_stop() {
        let mut machine = running();
        machine.stop(at(2));
        assert!(machine.fault(at(3), Some(1)));
        assert!(!machine.emergency_stop(at(4)));
        assert!(!machine.stop(at(5)));
        assert_eq!(machine.state(), State::Fault);
        assert_eq!(machine.faulty_motor(), Some(1));
    }
}
