//! The way of a target: released by SYNC, its mode taken, admitted, followed along the path.

use eel_kinematics::Pose;
use eel_protocol::emergency::{Emergency, Source};
use eel_protocol::{Condition, Mode, State};
use eel_units::{Instant, Torque};

use crate::command::{BRIDGED_PERIODS, Received};
use crate::core::Core;
use crate::machine::Outcome;
use crate::settings::Settings;
use crate::spare::Spare;
use crate::spline::Spline;
use crate::workspace::{Guide, Limited};

/// Conditions that a fault reset can't clear because the reset itself, or time, does.
const CLEARED_BY_RESET: [Condition; 4] = [
    Condition::Latched,
    Condition::CommandLost,
    Condition::Encoders,
    Condition::NotOperational,
];

impl Core {
    /// Lets the path go on, or come to rest, while SYNCs or targets are missing.
    pub fn bridge_missing_targets(&mut self) {
        if self.stream.sync_overdue(self.now) {
            let missed = self.stream.begin_segment(self.now);
            self.continue_path(missed);
        }
    }

    /// Takes a SYNC; targets have been received just before.
    pub fn synchronise(&mut self, now: Instant) {
        self.feed_forward = self.received_feed;
        if !self.stream.is_fresh() {
            self.mend_path();
        }
        if let Some(missed) = self.stream.synchronise(now) {
            self.continue_path(missed);
        }
    }

    /// Begins the next segment of the path after `missed` periods without a target.
    fn continue_path(&mut self, missed: u8) {
        let late = missed > BRIDGED_PERIODS && self.machine.state() == State::Run;
        if late && !self.status.contains(Condition::CommandLate) {
            self.emit(Emergency::COMMAND_LATE, Source::whole(u16::from(missed)));
        }
        self.status = self.status.with(Condition::CommandLate, late);
        if missed == 0 {
            return;
        }
        let wanted = if missed <= BRIDGED_PERIODS {
            self.spline.continued()
        } else {
            self.spline.newest()
        };
        self.follow(wanted);
    }

    /// Lets the path begin again where it is, so that a SYNC out of its rhythm makes no jump.
    fn mend_path(&mut self) {
        if self.stream.breaks_path(self.now) {
            let (elapsed, period) = self.stream.place(self.now);
            self.spline = Spline::at_rest(self.spline.reference(elapsed, period).pose);
        }
    }

    /// Searches on for the poses that are nearest to targets out of reach, in the ticks that have time.
    pub fn search_on(&mut self) {
        if self.spare() == Spare::Search {
            self.guide.advance(&self.settings.wrist);
        }
    }

    /// Admits a pose and makes it the end of the next segment.
    fn follow(&mut self, wanted: Pose) -> Limited {
        let (_, period) = self.stream.place(self.now);
        let previous = self.spline.newest();
        let Settings { limits, wrist, .. } = &self.settings;
        let (pose, limited) = self.guide.admit(wanted, previous, period, limits, wrist);
        self.is_busy = true;
        self.spline.push(pose);
        limited
    }

    /// Takes a target frame that SYNC has released.
    pub fn receive_target(&mut self, bytes: &[u8; 8], cob_id: u16) {
        let target = match self.stream.receive(self.now, bytes, cob_id) {
            Received::Target(target) => target,
            Received::Ignored => return,
            Received::TooManyBad => {
                self.lose_command(Emergency::COMMAND_BAD, self.stream.counters().bad);
                return;
            }
        };
        self.command(target.mode);
        if self.machine.state() != State::Run {
            self.note_limited(Limited::default());
            return;
        }
        if self.stream.is_early(self.now) {
            return;
        }
        self.mend_path();
        let wanted = Pose {
            yaw: target.yaw,
            pitch: target.pitch,
            roll: target.roll,
        };
        let limited = self.follow(wanted);
        self.note_limited(limited);
    }

    /// Remembers whether the target was limited and warns when that begins.
    pub fn note_limited(&mut self, limited: Limited) {
        if limited.any() && !self.limited.any() {
            let detail = u16::from(limited.bits());
            self.emit(Emergency::TARGET_LIMITED, Source::whole(detail));
        }
        self.limited = limited;
        self.status = self.status.with(Condition::TargetLimited, limited.any());
    }

    /// Takes the mode of a target.
    fn command(&mut self, mode: Mode) {
        let before = self.machine.state();
        let standing = CLEARED_BY_RESET
            .iter()
            .fold(self.status, |status, condition| {
                status.with(*condition, false)
            });
        let outcome = self
            .machine
            .command(self.now, mode, standing.refusals().is_empty());
        if outcome == Outcome::Reset {
            self.reset_faults();
        }
        let after = self.machine.state();
        if after != before {
            self.lost_ticks = 0;
            self.forget_feed_forward();
            self.motor_torque = [Torque::ZERO; 3];
            match after {
                State::Run => {
                    self.spline = Spline::at_rest(self.pose);
                    self.guide = Guide::default();
                }
                State::Hold => self.hold = self.pose,
                _ => {}
            }
        }
        self.note_state(before);
    }
}
