//! The vertebra behind its node: estimation, states, control, protection.

use eel_canopen::EventQueue;
use eel_kinematics::{Joints, Pose, PoseError};
use eel_protocol::emergency::{Emergency, Severity, Source};
use eel_protocol::{Condition, Counter, Effort, Flags, LimitCode, Mode, State, Status};
use eel_units::{Angle, Instant, Torque};

use crate::command::{BRIDGED_PERIODS, CommandStream, Received, TARGET_TIMEOUT};
use crate::current::{CurrentState, Electrical, Reading};
use crate::encoder::{Encoder, EncoderFault};
use crate::events::{EVENTS, Event};
use crate::impedance::{FeedForward, Impedance, Motion};
use crate::io::{Drive, Sample};
use crate::limits::{MotorBounds, Situation, bounds};
use crate::machine::{Machine, Outcome};
use crate::objects::{Counters, ReceivedTarget, Timing};
use crate::pending::Pending;
use crate::settings::Settings;
use crate::spline::{Reference, Spline};
use crate::workspace::{Limited, admit};

/// Deviation from the reference that is worth a warning: 150 mrad.
const FOLLOWING_LIMIT: Angle = Angle::from_milliradians(150);
/// Deviation below which that warning ends: 100 mrad, so that noise doesn't repeat it.
const FOLLOWING_END: Angle = Angle::from_milliradians(100);
/// Conditions that a fault reset can't clear because the reset itself, or time, does.
const CLEARED_BY_RESET: [Condition; 4] = [
    Condition::Latched,
    Condition::CommandLost,
    Condition::Encoders,
    Condition::NotOperational,
];
/// Conditions that are told as warnings while they hold.
const WARNINGS: [Condition; 3] = [
    Condition::TargetLimited,
    Condition::CommandLate,
    Condition::FollowingError,
];

/// Everything of a vertebra but its node.
#[derive(Clone, Debug)]
pub(crate) struct Core {
    pub settings: Settings,
    pub impedance: Impedance,
    pub electrical: Electrical,
    pub now: Instant,
    pub operational: bool,
    pub encoders: [Encoder; 3],
    currents: [CurrentState; 3],
    pub machine: Machine,
    pub stream: CommandStream,
    spline: Spline,
    hold: Pose,
    pub motion: Option<Motion>,
    pub pose: Pose,
    pub target: ReceivedTarget,
    pub feed_forward: FeedForward,
    pub received_feed: FeedForward,
    pub status: Status,
    limited: Limited,
    warned: bool,
    pub over_current_ticks: [u8; 3],
    pub lost_ticks: u8,
    feed_since: Instant,
    pub effort: Effort,
    pub achieved: [Torque; 3],
    pub unallocated: [Torque; 3],
    pub reference: Option<Reference>,
    pub pose_counter: Counter,
    pub pose_bytes: [u8; 8],
    pub sample: Option<Sample>,
    pub counters: Counters,
    pub timing: Timing,
    pub pending: Pending,
    pub events: EventQueue<Event, EVENTS>,
}

impl Core {
    /// Starts at power-up.
    pub fn new(settings: Settings, now: Instant) -> Self {
        let encoder = Encoder::new(&settings.motor);
        Self {
            impedance: Impedance::new(&settings.gains),
            electrical: Electrical::new(&settings.motor),
            now,
            operational: false,
            encoders: [encoder; 3],
            currents: [CurrentState::default(); 3],
            machine: Machine::new(now),
            stream: CommandStream::new(now),
            spline: Spline::at_rest(Pose::default()),
            hold: Pose::default(),
            motion: None,
            pose: Pose::default(),
            target: ReceivedTarget::default(),
            feed_forward: FeedForward::NEUTRAL,
            received_feed: FeedForward::NEUTRAL,
            status: Status::NONE,
            limited: Limited::default(),
            warned: false,
            over_current_ticks: [0; 3],
            lost_ticks: 0,
            feed_since: now,
            effort: Effort {
                torque: [Torque::ZERO; 3],
                limit: [LimitCode::Off; 3],
                flags: Flags::default(),
            },
            achieved: [Torque::ZERO; 3],
            unallocated: [Torque::ZERO; 3],
            reference: None,
            pose_counter: Counter::default(),
            pose_bytes: [0; 8],
            sample: None,
            counters: Counters::default(),
            timing: Timing::default(),
            pending: Pending::default(),
            events: EventQueue::default(),
            settings,
        }
    }

    /// Does one control tick.
    pub fn tick(&mut self, now: Instant, sample: &Sample) -> [Drive; 3] {
        self.now = now;
        self.sample = Some(*sample);
        self.estimate(sample);
        self.watch(sample);
        self.bridge_missing_targets();
        if now.since(self.feed_since) >= TARGET_TIMEOUT {
            self.forget_feed_forward();
        }
        let before = self.machine.state();
        let aligned = self.encoders.iter().all(Encoder::is_aligned);
        self.machine
            .advance(now, aligned, self.status.refusals().is_empty());
        self.note_state(before);
        let drives = self.drive(sample);
        for (state, drive) in self.currents.iter_mut().zip(&drives) {
            state.note_drive(drive);
        }
        self.forget_warnings();
        self.report();
        self.end_warnings();
        drives
    }

    /// Turns readings into angles, speeds and the pose.
    fn estimate(&mut self, sample: &Sample) {
        let readings = sample.encoder_counts.into_iter().zip(sample.absolute);
        for (motor, (encoder, (count, absolute))) in
            self.encoders.iter_mut().zip(readings).enumerate()
        {
            let was_aligned = encoder.is_aligned();
            let Err(fault) = encoder.update(count, absolute) else {
                continue;
            };
            if !was_aligned {
                continue;
            }
            let emergency = match fault {
                EncoderFault::Invalid => Emergency::ENCODER_INVALID,
                EncoderFault::Implausible => Emergency::ENCODER_IMPLAUSIBLE,
            };
            self.pending.fault(emergency, Some(motor), 0);
        }
        let aligned = self.encoders.iter().all(Encoder::is_aligned);
        self.motion = None;
        if aligned {
            match self.moving() {
                Ok(motion) => {
                    self.motion = Some(motion);
                    self.pose = motion.direct.rotation.to_pose();
                    self.find_residual();
                }
                Err(error) if self.machine.is_live() => {
                    let emergency = match error {
                        PoseError::OutOfReach => Emergency::OUT_OF_REACH,
                        PoseError::Singular => Emergency::SINGULAR,
                    };
                    self.pending.fault(emergency, None, 0);
                }
                Err(_) => {}
            }
        }
        self.take_faults();
    }

    /// Returns where the wrist is and how it moves.
    fn moving(&self) -> Result<Motion, PoseError> {
        let [a, b, c] = &self.encoders;
        let direct = self
            .settings
            .wrist
            .direct(&Joints([a.angle(), b.angle(), c.angle()]))?;
        let omega = direct
            .jacobian
            .angular_velocity([a.speed(), b.speed(), c.speed()]);
        Ok(Motion { direct, omega })
    }

    /// Lets the path go on, or come to rest, while SYNCs or targets are missing.
    fn bridge_missing_targets(&mut self) {
        if self.stream.sync_overdue(self.now) {
            let missed = self.stream.begin_segment(self.now);
            self.continue_path(missed);
        }
    }

    /// Takes what RPDO2 brought; it holds for as long as a target would.
    pub fn receive_feed_forward(&mut self) {
        self.feed_since = self.now;
    }

    /// Returns to no feed-forward and the stiffness that is set.
    pub fn forget_feed_forward(&mut self) {
        self.received_feed = FeedForward::NEUTRAL;
        self.feed_forward = FeedForward::NEUTRAL;
    }

    /// Drops the warnings that only mean something while the wrist follows.
    fn forget_warnings(&mut self) {
        if self.machine.state() != State::Run {
            self.note_limited(Limited::default());
        }
        if self.reference.is_none() {
            self.status = self.status.with(Condition::FollowingError, false);
        }
    }

    /// Tells the bus once that no warning holds any more.
    fn end_warnings(&mut self) {
        let holds = WARNINGS
            .iter()
            .any(|condition| self.status.contains(*condition));
        if self.warned && !holds && !self.machine.state().is_latched() {
            self.emit(Emergency::CLEARED, Source::WHOLE);
        }
    }

    /// Takes a SYNC; targets have been received just before.
    pub fn synchronise(&mut self, now: Instant) {
        self.timing.note_sync(now);
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
            self.emit(
                Emergency::COMMAND_LATE,
                Source {
                    motor: 0,
                    limit: 0,
                    detail: u16::from(missed),
                },
            );
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

    /// Admits a pose and makes it the end of the next segment.
    fn follow(&mut self, wanted: Pose) -> Limited {
        let (_, period) = self.stream.place(self.now);
        let previous = self.spline.newest();
        let Settings { limits, wrist, .. } = &self.settings;
        let (pose, limited) = admit(wanted, previous, period, limits, wrist);
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
    fn note_limited(&mut self, limited: Limited) {
        if limited.any() && !self.limited.any() {
            let detail = u16::from(limited.bits());
            self.emit(
                Emergency::TARGET_LIMITED,
                Source {
                    motor: 0,
                    limit: 0,
                    detail,
                },
            );
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
            self.currents.iter_mut().for_each(CurrentState::restart);
            self.lost_ticks = 0;
            self.forget_feed_forward();
            match after {
                State::Run => self.spline = Spline::at_rest(self.pose),
                State::Hold => self.hold = self.pose,
                _ => {}
            }
        }
        self.note_state(before);
    }

    pub fn emit(&mut self, emergency: Emergency, source: Source) {
        self.warned = emergency.severity == Severity::Warning;
        self.pending.push(emergency, source);
        self.events.push(Event::Emergency { emergency, source });
    }

    pub fn note_state(&mut self, from: State) {
        let to = self.machine.state();
        if from != to {
            self.events.push(Event::State { from, to });
        }
    }

    /// Returns what the bridges do until the next tick.
    fn drive(&mut self, sample: &Sample) -> [Drive; 3] {
        self.reference = None;
        self.achieved = [Torque::ZERO; 3];
        self.unallocated = [Torque::ZERO; 3];
        self.effort.limit = [LimitCode::Off; 3];
        let cap = match self.machine.state() {
            State::Run | State::Hold => None,
            State::Damped => Some(self.settings.limits.damped_torque),
            State::StopDamped => Some(self.stop_cap()),
            State::Brake | State::StopBrake => return [Drive::Brake; 3],
            State::Fault => return self.fault_drives(),
            State::NotReady | State::SwitchedOff | State::Ready | State::StopOff => {
                return [Drive::Off; 3];
            }
        };
        let Some(motion) = self.motion else {
            return [Drive::Brake; 3];
        };
        let moment = match self.machine.state() {
            State::Run => {
                let (elapsed, period) = self.stream.place(self.now);
                self.pull(&motion, self.spline.reference(elapsed, period))
            }
            State::Hold => self.pull(&motion, Reference::at_rest(self.hold)),
            _ => self.impedance.damping(&motion),
        };
        self.share(&motion, moment, cap, sample)
    }

    /// Returns the moment towards a reference, and remembers how far off the wrist is.
    fn pull(&mut self, motion: &Motion, reference: Reference) -> [Torque; 3] {
        let (moment, error) = self
            .impedance
            .moment(motion, &reference, &self.feed_forward);
        let was_far = self.status.contains(Condition::FollowingError);
        let limit = if was_far {
            FOLLOWING_END
        } else {
            FOLLOWING_LIMIT
        };
        let far = error.iter().any(|axis| axis.abs() > limit);
        if far && !was_far {
            let worst = error
                .iter()
                .map(|axis| axis.abs())
                .max()
                .unwrap_or_default();
            let detail = worst.to_tenth_milliradians().unsigned_abs();
            self.emit(
                Emergency::FOLLOWING_ERROR,
                Source {
                    motor: 0,
                    limit: 0,
                    detail,
                },
            );
        }
        self.status = self.status.with(Condition::FollowingError, far);
        let worst = error.iter().map(|axis| axis.abs()).max();
        self.watch_following(worst.unwrap_or_default());
        self.reference = Some(reference);
        moment
    }

    /// Shares a moment among the motors within their bounds and turns torques into duties.
    fn share(
        &mut self,
        motion: &Motion,
        moment: [Torque; 3],
        command_cap: Option<Torque>,
        sample: &Sample,
    ) -> [Drive; 3] {
        let angles = self.angles();
        let speeds = self.encoders.each_ref().map(Encoder::speed);
        let situation = Situation {
            sample,
            angles,
            speeds,
            command_cap,
        };
        let bounds: [MotorBounds; 3] = bounds(&self.settings.limits, &self.electrical, &situation);
        let shared = motion
            .direct
            .jacobian
            .share(moment, &bounds.each_ref().map(|motor| motor.torque));
        self.achieved = shared.achieved;
        self.unallocated = shared.unallocated;
        let mut limit = [LimitCode::None; 3];
        let mut drives = [Drive::Off; 3];
        let motors = drives
            .iter_mut()
            .zip(&mut limit)
            .zip(&mut self.currents)
            .zip(&bounds);
        for (motor, (((drive, limit), state), bounds)) in motors.enumerate() {
            let pick = |values: &[Torque; 3]| values.get(motor).copied().unwrap_or_default();
            let speed = speeds.get(motor).copied().unwrap_or_default();
            let measured = sample.current.get(motor).copied().unwrap_or_default();
            *limit = bounds.reason(shared.bound.get(motor).copied().flatten());
            let reading = Reading {
                speed,
                current: measured,
                supply: sample.supply,
            };
            let torque = pick(&shared.torque);
            *drive = Drive::Duty(
                self.electrical
                    .duty(state, torque, &bounds.torque, &reading),
            );
        }
        self.effort.limit = limit;
        drives
    }

    /// Brings what the head will read up to date.
    fn report(&mut self) {
        let moment_limited = self.unallocated.iter().any(|axis| *axis != Torque::ZERO);
        self.status = self.status.with(Condition::MomentLimited, moment_limited);
        if let Some(sample) = &self.sample {
            self.effort.torque = sample
                .current
                .map(|current| self.electrical.torque(current));
        }
        let holds = |condition| self.status.contains(condition);
        self.effort.flags = Flags {
            target_limited: holds(Condition::TargetLimited),
            moment_limited,
            command_lost: holds(Condition::CommandLost) || holds(Condition::CommandLate),
            warning: holds(Condition::FollowingError),
        };
    }

    /// Returns the angle of each motor.
    pub fn angles(&self) -> [Angle; 3] {
        self.encoders.each_ref().map(Encoder::angle)
    }
}
