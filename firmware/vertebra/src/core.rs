//! The vertebra behind its node: estimation, states, control, protection.

use eel_canopen::EventQueue;
use eel_kinematics::{Joints, Pose, PoseError};
use eel_protocol::emergency::{Emergency, Severity, Source};
use eel_protocol::freeze::FreezeFrame;
use eel_protocol::{Condition, Counter, Effort, Flags, LimitCode, State, Status};
use eel_units::{Angle, AngularVelocity, Current, Instant, Torque, saturate};

use crate::calibration::Correction;
use crate::command::{CommandStream, TARGET_TIMEOUT};
use crate::current::Electrical;
use crate::discipline::Discipline;
use crate::encoder::{Encoder, EncoderFault};
use crate::events::{EVENTS, Event};
use crate::freezing::Clock;
use crate::friction::Compensation;
use crate::impedance::{FeedForward, Impedance, Motion};
use crate::io::{Drive, Sample};
use crate::limits::Standing;
use crate::machine::Machine;
use crate::objects::{ChainOut, Counters, ReceivedTarget, Timing};
use crate::pending::Pending;
use crate::procedure::Procedure;
use crate::settings::Settings;
use crate::spare::Spare;
use crate::spline::{Reference, Spline};
use crate::thermal::Thermal;
use crate::workspace::{Guide, Limited};

/// Conditions that are told as warnings while they hold.
const WARNINGS: [Condition; 4] = [
    Condition::TargetLimited,
    Condition::CommandLate,
    Condition::FollowingError,
    Condition::NearSingularity,
];

/// Frames in a tick that leave no time for anything else in it.
const MANY_FRAMES: u8 = 4;

/// Everything of a vertebra but its node.
#[derive(Clone, Debug)]
pub(crate) struct Core {
    pub settings: Settings,
    pub impedance: Impedance,
    pub electrical: Electrical,
    pub friction: Compensation,
    pub correction: Correction,
    /// What it takes of each motor now.
    pub friction_torques: [Torque; 3],
    /// Where the reference had the motors, and when.
    pub led: Option<(Joints, Instant)>,
    /// How warm each motor is inside; outlives a reset of the node.
    pub thermal: [Thermal; 3],
    pub standing: [Standing; 3],
    /// Which windings are hotter than their currents should let them become.
    pub is_too_hot: [bool; 3],
    /// Which bridges were off since the last tick.
    pub is_open: [bool; 3],
    /// Whose turn it is to be done besides: see [`Core::spare`].
    pub turn: u8,
    pub now: Instant,
    pub operational: bool,
    pub encoders: [Encoder; 3],
    pub machine: Machine,
    pub stream: CommandStream,
    pub spline: Spline,
    pub hold: Pose,
    /// Whether the motors' angles are those of a pose, which is measured then.
    pub has_pose: bool,
    pub pose: Pose,
    /// det A there, 1 at home and 0 at a parallel singularity, Q30.
    pub det_a: i32,
    pub target: ReceivedTarget,
    /// The identifier of a target that waits for SYNC.
    pub arrived: Option<u16>,
    pub feed_forward: FeedForward,
    pub received_feed: FeedForward,
    /// What each motor is to produce in the mode for it.
    pub motor_torque: [Torque; 3],
    pub status: Status,
    pub limited: Limited,
    pub guide: Guide,
    /// Frames that were heard since the last tick.
    pub heard: u8,
    /// Whether there is much to do besides: a pose was admitted since the last tick or in this one, or many
    /// frames were heard, though not for a second tick in a row.
    pub is_busy: bool,
    /// Whether the last tick was busy.
    pub was_long: bool,
    pub warned: bool,
    pub lost_ticks: u8,
    pub feed_since: Instant,
    pub effort: Effort,
    pub achieved: [Torque; 3],
    pub unallocated: [Torque; 3],
    pub reference: Option<Reference>,
    pub pose_counter: Counter,
    pub pose_bytes: [u8; 8],
    /// What was measured for this tick, in the senses of the cranks; nothing before the first.
    pub sample: Sample,
    pub counters: Counters,
    pub timing: Timing,
    /// What the daisy line's OUT does.
    pub chain_out: ChainOut,
    pub discipline: Discipline,
    pub pending: Pending,
    pub events: EventQueue<Event, EVENTS>,
    /// What was kept of the last fault or stop; outlives a reset of the node.
    pub freeze: Option<FreezeFrame>,
    /// What is to be remembered over a failure; made in one tick and packed in the next.
    pub snapshot: Option<FreezeFrame>,
    /// Whether there was one since the scope looked last.
    pub raised: bool,
    /// The time of day, once TIME came; outlives a reset of the node.
    pub clock: Option<Clock>,
    /// The step of a calibration, or the self test.
    pub procedure: Procedure,
    /// What each current sensor reads while the bridges are off, low-passed, in 1/64 µA.
    pub idle: [i64; 3],
    /// Whether the settings contradict neither themselves nor physics.
    pub is_sound: bool,
    /// Whether the calibration is this unit's.
    pub is_calibrated: bool,
    /// Whether settings were stored and are lost, so that these are not the ones meant.
    pub settings_lost: bool,
}

impl Core {
    /// Starts at power-up.
    #[inline(never)] // One copy in flash.
    pub fn new(settings: Settings, now: Instant) -> Self {
        let encoder = Encoder::new(&settings.motor);
        Self {
            impedance: Impedance::new(&settings.gains),
            electrical: Electrical::new(&settings.motor),
            friction: Compensation::new(&settings.motor.friction),
            correction: Correction::new(&settings.calibration),
            friction_torques: [Torque::ZERO; 3],
            led: None,
            thermal: [Thermal::new(); 3],
            standing: [Standing::NONE; 3],
            is_too_hot: [false; 3],
            is_open: [true; 3],
            turn: 0,
            now,
            operational: false,
            encoders: [encoder; 3],
            machine: Machine::new(now),
            stream: CommandStream::new(now),
            spline: Spline::at_rest(Pose::default()),
            hold: Pose::default(),
            has_pose: false,
            pose: Pose::default(),
            det_a: 1 << 30,
            target: ReceivedTarget::default(),
            arrived: None,
            feed_forward: FeedForward::NEUTRAL,
            received_feed: FeedForward::NEUTRAL,
            motor_torque: [Torque::ZERO; 3],
            status: Status::NONE,
            limited: Limited::default(),
            guide: Guide::default(),
            heard: 0,
            is_busy: false,
            was_long: false,
            warned: false,
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
            sample: Sample::default(),
            counters: Counters::default(),
            timing: Timing::default(),
            chain_out: ChainOut::Auto,
            discipline: Discipline::default(),
            pending: Pending::default(),
            events: EventQueue::default(),
            freeze: None,
            snapshot: None,
            raised: false,
            clock: None,
            procedure: Procedure::default(),
            idle: [0; 3],
            is_sound: settings.are_sound(),
            is_calibrated: settings.calibration.serial == settings.serial,
            settings_lost: false,
            settings,
        }
    }

    /// Puts other settings in the place of those it was made with, before the first tick.
    pub fn take_settings(&mut self, settings: Settings) {
        self.settings = settings;
        self.prepare();
    }

    /// Brings what the tick uses to the settings.
    pub fn prepare(&mut self) {
        self.impedance = Impedance::new(&self.settings.gains);
        self.friction = Compensation::new(&self.settings.motor.friction);
        self.correction = Correction::new(&self.settings.calibration);
        self.is_sound = self.settings.are_sound();
        self.is_calibrated = self.settings.calibration.serial == self.settings.serial;
    }

    /// Does one control tick, with what the sensors read and the bridges are told in their own senses.
    pub fn tick(&mut self, now: Instant, raw: &Sample) -> [Drive; 3] {
        self.now = now;
        self.discipline.tick(raw.sync_age);
        self.sample = *raw;
        self.correction.apply(&mut self.sample);
        let motors = self.thermal.iter_mut().zip(self.sample.current);
        for ((thermal, current), is_open) in motors.zip(self.is_open) {
            // What the sensor of an open bridge reads is no current.
            thermal.take(if is_open { Current::ZERO } else { current });
        }
        self.is_busy |= self.heard >= MANY_FRAMES && !self.was_long;
        self.heard = 0;
        self.take_turn();
        let motion = self.estimate();
        self.watch();
        self.bridge_missing_targets();
        self.search_on();
        if now.since(self.feed_since) >= TARGET_TIMEOUT {
            self.forget_feed_forward();
        }
        let before = self.machine.state();
        let aligned = self.encoders.iter().all(Encoder::is_aligned);
        self.machine
            .advance(now, aligned, self.status.refusals().is_empty());
        self.note_state(before);
        let mut drives = self.drive(motion.as_ref());
        self.correction.turn(&mut drives);
        if self.procedure.is_running() {
            self.proceed(raw, &mut drives);
        }
        self.is_open = drives.map(|drive| matches!(drive, Drive::Off));
        self.forget_warnings();
        self.report();
        self.end_warnings();
        self.was_long = self.is_busy;
        self.is_busy = false;
        drives
    }

    /// Turns readings into angles, speeds and the pose, and returns what the wrist does.
    fn estimate(&mut self) -> Option<Motion> {
        if self.is_being_calibrated() {
            // What counts and angles mean is not known.
            self.encoders = [Encoder::new(&self.settings.motor); 3];
        }
        let Sample {
            encoder_counts,
            absolute,
            ..
        } = self.sample;
        let readings = encoder_counts.into_iter().zip(absolute);
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
        let mut found = None;
        if aligned {
            match self.moving() {
                Ok(motion) => {
                    let motion = found.insert(motion);
                    self.pose = motion.direct.rotation.to_pose();
                    self.det_a = motion.direct.jacobian.det_a();
                    self.watch_singularity();
                    if self.spare() != Spare::Nothing {
                        self.find_residual();
                    }
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
        self.has_pose = found.is_some();
        self.take_faults();
        found
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
        let holds = |core: &Self| {
            let mut warnings = WARNINGS.iter();
            warnings.any(|condition| core.status.contains(*condition))
        };
        if self.warned && !holds(self) && !self.machine.state().is_latched() {
            self.emit(Emergency::CLEARED, Source::WHOLE);
        }
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
    fn drive(&mut self, motion: Option<&Motion>) -> [Drive; 3] {
        self.reference = None;
        self.achieved = [Torque::ZERO; 3];
        self.unallocated = [Torque::ZERO; 3];
        self.effort.limit = [LimitCode::Off; 3];
        let cap = match self.machine.state() {
            State::Run | State::Hold | State::Moment => None,
            State::Motor | State::Damped => Some(self.settings.limits.damped_torque),
            State::StopDamped => Some(self.stop_cap()),
            State::Brake | State::StopBrake => return [Drive::Brake; 3],
            State::Fault => return self.fault_drives(),
            State::NotReady | State::SwitchedOff | State::Ready | State::StopOff | State::Test => {
                return [Drive::Off; 3];
            }
        };
        let Some(motion) = motion else {
            return [Drive::Brake; 3];
        };
        if self.machine.state() != State::Run {
            self.friction_torques = [Torque::ZERO; 3];
            self.led = None;
        }
        let moment = match self.machine.state() {
            State::Run => {
                let (elapsed, period) = self.stream.place(self.now);
                let reference = self.spline.reference(elapsed, period);
                self.compensate(&reference.pose);
                self.pull(motion, reference)
            }
            State::Hold => self.pull(motion, Reference::at_rest(self.hold)),
            State::Moment => self.push(motion),
            State::Motor => return self.drive_motors(motion, cap),
            _ => self.impedance.damping(motion),
        };
        let bounds = self.bounds(cap);
        self.share(motion, moment, &bounds)
    }

    /// Takes the friction of the motors as the reference turns them, where the tick has time. Their speed is that of the motors' angles since the last time.
    fn compensate(&mut self, reference: &Pose) {
        if self.spare() != Spare::Friction {
            return;
        }
        let found = self.settings.wrist.inverse(reference).ok();
        let before = self.led;
        self.led = found.map(|inverse| (inverse.joints, self.now));
        let (Some((Joints(now), _)), Some((Joints(before), then))) = (self.led, before) else {
            return;
        };
        // Q29 rad in µs; Q24 rad/s.
        let passed = self.now.since(then).to_micros().max(1);
        let factor = i64::from(1_000_000 / passed);
        let [a, b, c] = now;
        let [x, y, z] = before;
        self.friction_torques = [a - x, b - y, c - z].map(|turned| {
            let speed = saturate((i64::from(turned.to_q29()) * factor) >> 5);
            self.friction.torque(AngularVelocity::from_q24(speed))
        });
    }

    /// Returns the moment towards a reference, and remembers how far off the wrist is.
    fn pull(&mut self, motion: &Motion, reference: Reference) -> [Torque; 3] {
        let Reference { pose, rates } = reference;
        let (omega, feed) = (pose.angular_velocity(rates), &self.feed_forward);
        let (moment, error) = self.impedance.moment(motion, &pose, omega, feed);
        let worst = error.iter().map(|axis| axis.abs()).max();
        self.watch_following(worst.unwrap_or_default());
        self.reference = Some(reference);
        moment
    }

    /// Returns the speed of each motor.
    pub fn speeds(&self) -> [AngularVelocity; 3] {
        self.encoders.each_ref().map(Encoder::speed)
    }

    /// Brings what the head will read up to date.
    fn report(&mut self) {
        let moment_limited = self.unallocated.iter().any(|axis| *axis != Torque::ZERO);
        self.status = self.status.with(Condition::MomentLimited, moment_limited);
        self.effort.torque = self
            .sample
            .current
            .map(|current| self.electrical.torque(current));
        let holds = |condition| self.status.contains(condition);
        self.effort.flags = Flags {
            target_limited: holds(Condition::TargetLimited),
            moment_limited,
            command_lost: holds(Condition::CommandLost) || holds(Condition::CommandLate),
            warning: holds(Condition::FollowingError) || holds(Condition::NearSingularity),
        };
    }

    /// Returns the angle of each motor.
    pub fn angles(&self) -> [Angle; 3] {
        self.encoders.each_ref().map(Encoder::angle)
    }
}
