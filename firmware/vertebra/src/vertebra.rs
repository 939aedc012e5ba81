//! The vertebra as its platform sees it.

use eel_canopen::{Config, Frame, Identity, NmtCommand, NmtState, Node};
use eel_kinematics::Pose;
use eel_protocol::emergency::{Emergency, Source};
use eel_protocol::{HEAD_HEARTBEAT_TIMEOUT_MS, HEAD_NODE, NodeId, State, Status, VERTEBRAE};
use eel_protocol::{SYNC_COUNTER_OVERFLOW, VERTEBRA_HEARTBEAT_MS, identity, pdo};
use eel_units::{Angle, Duration, Instant};

use crate::core::Core;
use crate::events::Event;
use crate::io::{Drive, Sample};
use crate::settings::Settings;

/// One vertebra: frames and samples in, drives and frames out.
#[derive(Clone, Debug)]
pub struct Vertebra {
    node: Node,
    core: Core,
    /// What NMT "reset node" goes back to.
    settings: Settings,
}

/// Does one turn: all frames in their order, the sample, then everything that is to be sent.
/// Every platform calls this once per control tick, so that all agree on the order.
pub fn turn(
    vertebra: &mut Vertebra,
    now: Instant,
    frames: impl IntoIterator<Item = Frame>,
    sample: &Sample,
    mut send: impl FnMut(Frame),
) -> [Drive; 3] {
    for frame in frames {
        vertebra.handle_frame(now, &frame);
    }
    let drives = vertebra.handle_sample(now, sample);
    while let Some(frame) = vertebra.poll_transmit() {
        send(frame);
    }
    drives
}

impl Vertebra {
    /// Starts a vertebra at power-up: drives off, boot-up message waiting.
    pub fn new(settings: Settings, now: Instant) -> Self {
        let core = Core::new(settings, now);
        Self {
            node: Node::new(config(&settings), &[], &core, now.to_micros()),
            core,
            settings,
        }
    }

    /// Starts a vertebra whose microcontroller ended by a watchdog, a panic or a fault: as at
    /// power-up, but stopped until a fault reset.
    pub fn after_failure(settings: Settings, now: Instant) -> Self {
        let mut vertebra = Self::new(settings, now);
        vertebra.core.emergency_stop(Emergency::RESTARTED);
        vertebra
    }

    /// Takes a frame from the bus.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.core.now = now;
        self.node
            .handle_frame(now.to_micros(), frame, &mut self.core);
        self.absorb_events(now);
        self.hand_over_emergencies(now);
    }

    /// Takes the measurements of a control tick, once per millisecond, and returns what the
    /// bridges do until the next.
    pub fn handle_sample(&mut self, now: Instant, sample: &Sample) -> [Drive; 3] {
        self.core.now = now;
        self.node.tick(now.to_micros(), &mut self.core);
        self.absorb_events(now);
        let drives = self.core.tick(now, sample);
        self.hand_over_emergencies(now);
        drives
    }

    /// Returns the next frame to send.
    pub fn poll_transmit(&mut self) -> Option<Frame> {
        self.node.poll_transmit()
    }

    /// Returns the next thing that happened.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.core.events.pop()
    }

    /// Returns how many events were forgotten because nobody polled them.
    pub fn events_dropped(&self) -> u32 {
        self.core.events.dropped()
    }

    /// Returns the place in the chain.
    pub fn node_id(&self) -> NodeId {
        self.core.settings.node
    }

    /// Returns the state.
    pub fn state(&self) -> State {
        self.core.machine.state()
    }

    /// Returns the status word: why enabling is refused, and what is limited.
    pub fn status(&self) -> Status {
        self.core.status
    }

    /// Returns the measured pose; home before the encoders are aligned.
    pub fn pose(&self) -> Pose {
        self.core.pose
    }

    /// Returns the pose that the wrist is pulled to, while it is.
    pub fn reference(&self) -> Option<Pose> {
        self.core.reference.map(|reference| reference.pose)
    }

    /// Returns the angle of each motor.
    pub fn motor_angles(&self) -> [Angle; 3] {
        self.core.angles()
    }

    /// Returns how many targets since power-up the counter shows to have been lost on the way: never
    /// arrived, or arrived and not believed.
    pub fn targets_lost(&self) -> u32 {
        self.core.stream.counters().lost
    }

    /// Returns the state of the node on the bus.
    pub fn nmt_state(&self) -> NmtState {
        self.node.nmt_state()
    }

    /// Tells the vertebra how long its last turn took, for object 0x2040.
    pub fn note_loop_time(&mut self, duration: Duration) {
        self.core.timing.note_loop(duration);
    }

    /// Tells the vertebra how many frames its platform has lost on the way in and out.
    pub fn note_overruns(&mut self, received: u32, transmitted: u32) {
        self.core.counters.receive_overruns = received;
        self.core.counters.transmit_overruns = transmitted;
    }

    /// Lets the core hear what happened to the node.
    fn absorb_events(&mut self, now: Instant) {
        while let Some(event) = self.node.poll_event() {
            match event {
                eel_canopen::Event::Nmt { command, state } => self.follow_nmt(now, command, state),
                eel_canopen::Event::Sync { .. } => self.core.synchronise(now),
                eel_canopen::Event::HeartbeatLost(_) => self.core.lose_head(),
                // A consumer that was reset meanwhile only tells that it heard something.
                eel_canopen::Event::HeartbeatBack(_) | eel_canopen::Event::RemoteState { .. } => {
                    self.core.hear_head();
                }
                _ => {}
            }
        }
    }

    fn follow_nmt(&mut self, now: Instant, command: NmtCommand, state: NmtState) {
        if command == NmtCommand::ResetNode {
            let was_latched = self.core.machine.state().is_latched();
            self.core = Core::new(self.settings, now);
            self.core.events.push(Event::Reset);
            if was_latched {
                self.core.emergency_stop(Emergency::RESTARTED);
            }
        }
        self.core.operational = state == NmtState::Operational;
        match command {
            NmtCommand::Stop => self.core.latch_stop(),
            _ if !self.core.operational => self.core.stop(Emergency::STOPPED_BY_NMT, 0),
            _ => {}
        }
    }

    fn hand_over_emergencies(&mut self, now: Instant) {
        while let Some((emergency, source)) = self.core.pending.pop() {
            let Emergency { code, register, .. } = emergency;
            if emergency == Emergency::CLEARED {
                // All bits that came from here; the node keeps those of its own errors.
                self.node.emergency_cleared(now.to_micros(), 0xFF);
                continue;
            }
            self.node
                .emergency(now.to_micros(), code, register, Source::to_bytes(source));
        }
    }
}

/// Returns the node's configuration for these settings.
fn config(settings: &Settings) -> Config {
    Config {
        node_id: settings.node.get(),
        node_ids: (NodeId::FIRST.get(), VERTEBRAE),
        identity: Identity {
            vendor: identity::VENDOR,
            product: identity::PRODUCT,
            revision: identity::REVISION,
            serial: settings.serial,
        },
        device_type: identity::DEVICE_TYPE,
        device_name: identity::DEVICE_NAME,
        hardware_version: settings.hardware,
        software_version: identity::SOFTWARE_VERSION,
        heartbeat_ms: VERTEBRA_HEARTBEAT_MS,
        consumer: Some((HEAD_NODE, HEAD_HEARTBEAT_TIMEOUT_MS)),
        sync_cob_id: 0x080,
        sync_counter_overflow: SYNC_COUNTER_OVERFLOW,
        time_cob_id: 0x100,
        // The vertebra lets go by itself, and goes on telling how it is.
        error_behaviour: 1,
        rpdos: pdo::RPDOS,
        tpdos: pdo::TPDOS,
    }
}
