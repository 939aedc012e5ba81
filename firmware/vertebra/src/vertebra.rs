//! The vertebra as its platform sees it.

use eel_canopen::{Config, Frame, Identifiers, Identity, NmtCommand, NmtState, Node};
use eel_kinematics::Pose;
use eel_protocol::emergency::{Emergency, Source};
use eel_protocol::freeze::{FreezeFrame, TimeOfDay};
use eel_protocol::{
    Cob, ERROR_BEHAVIOUR, HEAD_HEARTBEAT_TIMEOUT_MS, HEAD_NODE, NodeId, State, Status,
};
use eel_protocol::{SYNC_COUNTER_OVERFLOW, VERTEBRA_HEARTBEAT_MS, VERTEBRAE, identity, pdo};
use eel_units::{Angle, Duration, Instant, Temperature};

use crate::core::Core;
use crate::events::Event;
use crate::freezing::Clock;
use crate::io::{Drive, Sample};
use crate::keepsake::Keepsake;
use crate::objects::ChainOut;
use crate::procedure::Hands;
use crate::records::Records;
use crate::served::Served;
use crate::settings::Settings;
use crate::store::{Record, Stored};
use crate::storing::Stage;
use crate::thermal::Thermal;

/// One vertebra: frames and samples in, drives and frames out.
#[derive(Clone, Debug)]
pub struct Vertebra {
    pub(crate) node: Node,
    pub(crate) core: Core,
    pub(crate) records: Records,
    /// What the platform made it with, before what is stored.
    settings: Settings,
    pub(crate) storing: Storing,
}

/// What NMT "reset node" goes back to, and what is to become it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Storing {
    /// What is stored.
    pub stored: Record,
    /// What the bus has asked for, until it is stored.
    pub coming: Option<Record>,
    /// How far that is.
    pub stage: Stage,
}

/// Does one turn: all frames in their order, the sample, then what is to be sent, at most `room`
/// frames. What finds no room stays with the node, where a newer report takes the place of an older
/// one and an SDO transfer waits until all else is gone.
/// Every platform calls this once per control tick, so that all agree on the order.
pub fn turn(
    vertebra: &mut Vertebra,
    now: Instant,
    frames: impl IntoIterator<Item = Frame>,
    sample: &Sample,
    room: usize,
    mut send: impl FnMut(Frame),
) -> [Drive; 3] {
    for frame in frames {
        vertebra.handle_frame(now, &frame);
    }
    let drives = vertebra.handle_sample(now, sample);
    for _ in 0..room {
        let Some(frame) = vertebra.poll_transmit() else {
            break;
        };
        send(frame);
    }
    drives
}

impl Vertebra {
    /// Starts a vertebra at power-up that has nothing stored: drives off, boot-up message waiting.
    pub fn new(settings: Settings, now: Instant) -> Self {
        Self::with_stored(settings, &Stored::Nothing, now)
    }

    /// Starts a vertebra at power-up with what its flash holds. What is stored outranks the settings;
    /// what was stored and is lost is a fault until it is stored again or restored.
    pub fn with_stored(settings: Settings, stored: &Stored, now: Instant) -> Self {
        let (record, is_damaged) = match stored {
            Stored::Nothing => (Record::default(), false),
            Stored::Record(record) => (record.clone(), record.lost),
            Stored::Damaged => (Record::default(), true),
        };
        let mut core = Core::new(settings, now);
        let mut records = Records::new();
        let served = Served {
            core: &mut core,
            records: &mut records,
        };
        let config = config(&settings, record.node);
        let node = Node::new(config, &record.communication, &served, now.to_micros());
        let is_refused = node.has_refused_stored();
        let mut vertebra = Self {
            node,
            core,
            records,
            settings,
            storing: Storing {
                stored: record,
                ..Storing::default()
            },
        };
        vertebra.core.settings_lost = is_damaged || is_refused;
        vertebra.take_settings();
        vertebra
    }

    /// Stops a vertebra whose microcontroller ended by a watchdog, a panic or a fault, just after it was
    /// made, until a fault reset; it remembers what was kept of before.
    pub fn stop_after_failure(&mut self, kept: &Keepsake) {
        self.core.restart(kept);
    }

    /// Takes a frame from the bus.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.core.now = now;
        self.core.heard = self.core.heard.saturating_add(1);
        if frame.cob_id() == Some(Cob::Nmt.id()) {
            self.hasten_store();
        }
        let mut served = Served {
            core: &mut self.core,
            records: &mut self.records,
        };
        self.node.handle_frame(now.to_micros(), frame, &mut served);
        self.absorb_events(now);
        self.hand_over_emergencies(now);
    }

    /// Takes the measurements of a control tick, once per millisecond, and returns what the
    /// bridges do until the next.
    pub fn handle_sample(&mut self, now: Instant, sample: &Sample) -> [Drive; 3] {
        self.core.now = now;
        let mut served = Served {
            core: &mut self.core,
            records: &mut self.records,
        };
        self.node.tick(now.to_micros(), &mut served);
        self.node.take_part_in_search(sample.chain_in);
        self.absorb_events(now);
        let drives = self.core.tick(now, sample);
        let mut served = Served {
            core: &mut self.core,
            records: &mut self.records,
        };
        served.capture();
        self.hand_over_emergencies(now);
        drives
    }

    /// Returns by how much the platform shall make the next tick longer than a millisecond, ns.
    pub fn tick_trim_ns(&self) -> i32 {
        self.core.discipline.trim_ns()
    }

    /// Returns the level of the daisy line's OUT, which leads to the next vertebra's IN.
    pub fn chain_out(&self) -> bool {
        match self.core.chain_out {
            ChainOut::Auto => self.node_id().is_some(),
            ChainOut::Low => false,
            ChainOut::High => true,
        }
    }

    /// Tells whether ticks keep their time after SYNC.
    pub fn tick_is_locked(&self) -> bool {
        self.core.discipline.is_locked()
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

    /// Returns the place in the chain; `None` before LSS gives one.
    pub fn node_id(&self) -> Option<NodeId> {
        NodeId::new(self.node.node_id())
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

    /// Returns what was kept of the last fault or stop.
    pub fn freeze_frame(&self) -> Option<FreezeFrame> {
        self.core.freeze
    }

    /// Returns what a procedure waits for somebody's hands to do.
    pub fn waits_for(&self) -> Option<Hands> {
        self.core.procedure.waits_for()
    }

    /// Returns how warm each motor's winding is by the model.
    pub fn winding_temperatures(&self) -> [Temperature; 3] {
        self.core.thermal.each_ref().map(Thermal::winding)
    }

    /// Returns how many targets since power-up the counter shows to have been lost on the way: never
    /// arrived, or arrived and not believed.
    pub fn targets_lost(&self) -> u32 {
        self.core.stream.counters().lost
    }

    /// Returns how many frames found no room to wait in, because the bus took none for too long.
    pub fn frames_dropped(&self) -> u32 {
        self.node.counters().transmit_dropped
    }

    /// Returns the identifiers that the vertebra listens to at present, for its controller's filters.
    pub fn identifiers(&self) -> Identifiers {
        self.node.identifiers()
    }

    /// Returns the state of the node on the bus.
    pub fn nmt_state(&self) -> NmtState {
        self.node.nmt_state()
    }

    /// Tells the vertebra how long its last turn took, for object 0x2040.
    pub fn note_loop_time(&mut self, duration: Duration) {
        self.core.timing.note_loop(duration);
    }

    /// Tells the vertebra how long the last turn of the current loop took, and the longest since
    /// power-up, in ns.
    pub fn note_current_loop(&mut self, last_ns: u32, longest_ns: u32) {
        self.core.timing.current_loop_ns = (last_ns, longest_ns);
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
                eel_canopen::Event::HeartbeatLost(node) => self.core.lose_head(node),
                eel_canopen::Event::Time { days, ms } => {
                    self.core.clock = Some(Clock {
                        time: TimeOfDay { days, ms },
                        told: now,
                    });
                }
                eel_canopen::Event::Store(request) => self.prepare_store(request),
                eel_canopen::Event::NodeId(id) => {
                    self.core.events.push(Event::NodeId(NodeId::new(id)));
                }
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
            let Core {
                freeze,
                clock,
                thermal,
                settings_lost,
                ..
            } = self.core;
            self.core = Core::new(self.settings, now);
            self.core.freeze = freeze;
            self.core.thermal = thermal;
            self.core.clock = clock;
            self.core.settings_lost = settings_lost;
            self.take_settings();
            self.core.events.push(Event::Reset);
            if was_latched {
                self.core.emergency_stop(Emergency::RESTARTED);
            }
        }
        self.core.operational = state == NmtState::Operational;
        self.core.arrived = None;
        match command {
            NmtCommand::Stop => self.core.latch_stop(),
            _ if !self.core.operational => self.core.stop(Emergency::STOPPED_BY_NMT, 0),
            _ => {}
        }
    }

    /// Takes the stored settings over.
    fn take_settings(&mut self) {
        let mut settings = self.settings;
        if self.storing.stored.apply_settings(&mut settings) {
            self.core.take_settings(settings);
        } else {
            self.core.settings_lost = true;
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

/// Stands for no node id.
const UNCONFIGURED: u8 = 0xFF;

/// Returns the node's configuration for these settings; the place that is stored outranks theirs.
fn config(settings: &Settings, stored: Option<NodeId>) -> Config {
    let node = stored.or(settings.node);
    Config {
        node_id: node.map_or(UNCONFIGURED, NodeId::get),
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
        sync_cob_id: Cob::Sync.id(),
        sync_counter_overflow: SYNC_COUNTER_OVERFLOW,
        time_cob_id: Cob::Time.id(),
        error_behaviour: ERROR_BEHAVIOUR,
        rpdos: pdo::RPDOS,
        tpdos: pdo::TPDOS,
    }
}
