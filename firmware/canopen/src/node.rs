//! The node: frames and time in, frames and events out.

mod identifiers;
mod process_data;
mod setup;

use heapless::Vec;

pub use identifiers::Identifiers;

use crate::communication::Communication;
use crate::emergency::Fault;
use crate::lss::{self, Lss};
use crate::objects::Objects;
use crate::sdo::Server;
use crate::stored;
use crate::time;
use crate::transmit::TransmitQueue;
use crate::{
    Application, Config, Event, EventQueue, Frame, NmtCommand, NmtState, STORED_PARAMETERS,
    StoreRequest,
};

/// How many events wait to be polled.
const EVENTS: usize = 16;

/// What a node had to give up, counted since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Frames that found the transmit queue full and were dropped.
    pub transmit_dropped: u32,
    /// Events that nobody polled and that newer ones displaced.
    pub events_dropped: u32,
    /// Emergency messages that found their queue full; object 0x1003 has them still.
    pub emergencies_dropped: u32,
    /// RPDOs that were shorter than their mapping.
    pub rpdos_short: u32,
    /// RPDOs of which the application refused an object.
    pub rpdos_refused: u32,
    /// TPDOs that were due and not sent because the application refused an object.
    pub tpdos_refused: u32,
}

/// A CANopen slave: one node id on one bus.
///
/// Its owner gives it every frame of the bus and calls [`tick`](Self::tick) once per millisecond or
/// so; then it drains [`poll_transmit`](Self::poll_transmit) and [`poll_event`](Self::poll_event).
/// Time is in microseconds from any start and never goes back.
#[derive(Clone, Debug)]
pub struct Node {
    config: Config,
    state: NmtState,
    communication: Communication,
    sdo: Server,
    lss: Lss,
    /// The node id after a reset of the node.
    stored_id: u8,
    /// The parameters after a reset; empty for the defaults.
    stored: Vec<u8, STORED_PARAMETERS>,
    stored_refused: bool,
    /// What is being stored, and who waits for it.
    storing: Option<StoreRequest>,
    waiting: Option<Waiting>,
    /// When an SDO client has waited for too long.
    waiting_until_us: u64,
    transmit: TransmitQueue,
    events: EventQueue<Event, EVENTS>,
    rpdos_short: u32,
    rpdos_refused: u32,
    tpdos_refused: u32,
}

/// Who waits for something to be stored.
#[derive(Clone, Copy, Debug)]
enum Waiting {
    /// The SDO client, which gets this answer once it is done.
    Sdo([u8; 8]),
    /// The LSS master.
    Lss,
}

/// What process data a frame is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ProcessData {
    None,
    Sync,
    /// An RPDO, if it is one of this node's.
    Other,
}

impl Node {
    /// Makes a node that is Pre-operational and whose boot-up message waits to be sent.
    ///
    /// `stored` is what [`save_parameters`](Self::save_parameters) once wrote, or nothing. Parameters that
    /// this node can't have are left out, all of them: see [`has_refused_stored`](Self::has_refused_stored).
    /// With a node id outside 1–127 the node is unconfigured: it stays `Initialising` and only
    /// listens to LSS.
    #[inline(never)] // One copy in flash, and a small one.
    pub fn new(config: Config, stored: &[u8], app: &dyn Application, now_us: u64) -> Self {
        let mut node = Self {
            config,
            state: NmtState::Initialising,
            communication: Communication::new(&config, now_us),
            sdo: Server::new(),
            lss: Lss::new(config.node_id),
            stored_id: config.node_id,
            stored: Vec::new(),
            stored_refused: false,
            storing: None,
            waiting: None,
            waiting_until_us: 0,
            transmit: TransmitQueue::default(),
            events: EventQueue::default(),
            rpdos_short: 0,
            rpdos_refused: 0,
            tpdos_refused: 0,
        };
        // None of them where they are too many.
        let _ = node.stored.extend_from_slice(stored);
        node.load(now_us);
        if node.stored.len() != stored.len() || !stored::is_served(&node.communication, app) {
            node.stored.clear();
            node.communication
                .reset(NmtCommand::ResetNode, &node.config, now_us);
        }
        node.stored_refused = node.stored.len() != stored.len();
        node.boot();
        node
    }

    /// Takes a frame from the bus.
    ///
    /// Remote and extended frames are ignored. The work is bounded whatever the frame is: at most
    /// four RPDOs are written, four TPDOs read, or one SDO request answered.
    pub fn handle_frame(&mut self, now_us: u64, frame: &Frame, app: &mut impl Application) {
        let Some(cob_id) = frame.cob_id() else { return };
        if frame.is_remote() {
            return;
        }
        let data = frame.data();
        match self.manage(now_us, cob_id, data, app) {
            ProcessData::None => {}
            ProcessData::Sync => self.synchronise(data, app),
            ProcessData::Other => self.receive(cob_id, data, app),
        }
        if self.sdo.has_begun() || self.communication.emergency.is_waiting() {
            self.settle(now_us, app);
        }
    }

    /// Does what the time demands: heartbeats, time-outs, event-driven TPDOs, and at most four
    /// segments of an SDO block upload.
    pub fn tick(&mut self, now_us: u64, app: &mut impl Application) {
        if self.state == NmtState::Initialising {
            return;
        }
        self.expire(now_us);
        self.beat(now_us);
        if self.state == NmtState::Operational {
            for place in 0..self.communication.tpdos.len() {
                let tpdo = self.communication.tpdos.get_mut(place);
                if tpdo.is_some_and(|tpdo| tpdo.is_due_at(now_us)) {
                    self.send_tpdo(place, app);
                }
            }
        }
        self.stream(now_us, app);
        self.settle(now_us, app);
    }

    /// Takes the next frame to send.
    ///
    /// At most 16 wait. One that finds the queue full is dropped and counted
    /// ([`Counters::transmit_dropped`]); a PDO or heartbeat that waits already is replaced. Four
    /// more of the SDO server wait until there is no other.
    #[inline(never)] // One copy in flash, and a small one.
    pub fn poll_transmit(&mut self) -> Option<Frame> {
        self.transmit.pop(sdo_cob_id(self.config.node_id))
    }

    /// Takes the next event. At most 16 wait; the oldest are displaced and counted.
    #[inline(never)] // One copy in flash, and a small one.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop()
    }

    /// Returns the state.
    pub const fn nmt_state(&self) -> NmtState {
        self.state
    }

    /// Returns the node id.
    pub const fn node_id(&self) -> u8 {
        self.config.node_id
    }

    /// Returns object 0x1001, the error register.
    pub const fn error_register(&self) -> u8 {
        self.communication.emergency.register()
    }

    /// Returns what the node had to give up.
    pub const fn counters(&self) -> Counters {
        Counters {
            transmit_dropped: self.transmit.dropped(),
            events_dropped: self.events.dropped(),
            emergencies_dropped: self.communication.emergency.dropped(),
            rpdos_short: self.rpdos_short,
            rpdos_refused: self.rpdos_refused,
            tpdos_refused: self.tpdos_refused,
        }
    }

    /// Tells the bus of an error of the application: sets `register_bits` in the error register
    /// (0x1001), remembers the error (0x1003) and sends the emergency, at once or as soon as the
    /// inhibit time (0x1015) and the state allow. At most eight wait; more are counted only.
    #[inline(never)] // One copy in flash, and a small one.
    pub fn emergency(&mut self, now_us: u64, code: u16, register_bits: u8, detail: [u8; 5]) {
        self.communication
            .emergency
            .raise(code, register_bits, detail);
        self.send_emergencies(now_us);
    }

    /// Tells the bus that an error of the application is gone: clears `register_bits` in the error
    /// register and sends an emergency with code 0 and what is left of the register.
    #[inline(never)] // One copy in flash, and a small one.
    pub fn emergency_cleared(&mut self, now_us: u64, register_bits: u8) {
        self.communication.emergency.clear(register_bits);
        self.send_emergencies(now_us);
    }

    /// Asks for one transmission of TPDO `number` (1–4): type 0 sends it at the next SYNC, types
    /// 254 and 255 at the next [`tick`](Self::tick) that the inhibit time allows. Has no effect
    /// unless the node is Operational.
    pub fn request_tpdo(&mut self, number: u8) {
        let place = usize::from(number).wrapping_sub(1);
        if self.state == NmtState::Operational
            && let Some(tpdo) = self.communication.tpdos.get_mut(place)
        {
            tpdo.request();
        }
    }

    /// Does with a frame all but process data, and tells what process data it is.
    #[inline(never)] // One copy in flash.
    fn manage(
        &mut self,
        now_us: u64,
        cob_id: u16,
        data: &[u8],
        app: &mut dyn Application,
    ) -> ProcessData {
        if cob_id == lss::REQUEST {
            self.set_layer(now_us, data, app);
        }
        if self.state == NmtState::Initialising {
            return ProcessData::None;
        }
        self.expire(now_us);
        if cob_id == 0 {
            self.command(now_us, data);
        } else if self.communication.consumer.node().map(heartbeat_cob_id) == Some(cob_id) {
            self.hear(now_us, data);
        } else if self.state != NmtState::Stopped {
            if cob_id == self.communication.sync.cob_id() {
                return ProcessData::Sync;
            } else if cob_id == 0x600 + u16::from(self.config.node_id) {
                self.serve(now_us, data, app);
            } else if self.communication.time.cob_id() == Some(cob_id) {
                if let Some((days, ms)) = time::of_day(data) {
                    self.events.push(Event::Time { days, ms });
                }
            } else if self.state == NmtState::Operational {
                return ProcessData::Other;
            }
        }
        ProcessData::None
    }

    /// Ends a frame or a tick: what was broken off, and what has to be told.
    #[inline(never)] // One copy in flash.
    fn settle(&mut self, now_us: u64, app: &mut dyn Application) {
        if self.state != NmtState::Initialising {
            self.sdo.settle(app);
            self.send_emergencies(now_us);
        }
    }

    /// Sends a heartbeat if one is due.
    #[inline(never)] // One copy in flash, and a small one.
    fn beat(&mut self, now_us: u64) {
        if self.communication.producer.is_due(now_us) {
            let data = [self.state as u8, 0, 0, 0, 0, 0, 0, 0];
            self.transmit
                .replace(heartbeat_cob_id(self.config.node_id), data, 1);
        }
    }

    fn boot(&mut self) {
        if matches!(self.config.node_id, 1..=127) {
            self.state = NmtState::PreOperational;
            self.transmit
                .push(heartbeat_cob_id(self.config.node_id), [0; 8], 1);
        }
    }

    #[inline(never)] // One copy in flash.
    fn command(&mut self, now_us: u64, data: &[u8]) {
        let Some(command) = NmtCommand::for_node(self.config.node_id, data) else {
            return;
        };
        if command.is_reset() {
            self.reset(command, now_us);
        } else if command.target() == self.state {
            return;
        } else {
            self.enter(command.target(), now_us);
        }
        self.events.push(Event::Nmt {
            command,
            state: self.state,
        });
    }

    #[inline(never)] // One copy in flash.
    fn enter(&mut self, state: NmtState, now_us: u64) {
        self.state = state;
        for rpdo in &mut self.communication.rpdos {
            rpdo.forget();
        }
        for tpdo in &mut self.communication.tpdos {
            tpdo.restart(now_us);
        }
        if state == NmtState::Stopped {
            self.sdo.reset();
            self.leave_unanswered();
            self.transmit
                .keep_only(heartbeat_cob_id(self.config.node_id));
        }
    }

    /// Ends what has waited too long.
    fn expire(&mut self, now_us: u64) {
        if let Some(node) = self.communication.consumer.expire(now_us) {
            self.events.push(Event::HeartbeatLost(node));
            self.communication
                .emergency
                .raise_fault(Fault::Heartbeat, node);
            self.behave_after_error(now_us);
        }
        if !self.sdo.is_idle() {
            let streaming = self.sdo.is_streaming();
            if let Some(message) = self.sdo.expire(now_us) {
                self.withdraw(streaming);
                self.answer(message);
            }
        }
        if self.waiting.is_some() {
            self.expire_store(now_us);
        }
    }

    fn hear(&mut self, now_us: u64, data: &[u8]) {
        let &[byte] = data else { return };
        let Some(node) = self.communication.consumer.node() else {
            return;
        };
        let heard = self.communication.consumer.hear(byte, now_us);
        if heard.back {
            self.events.push(Event::HeartbeatBack(node));
            self.communication.emergency.clear_fault(Fault::Heartbeat);
        }
        if let Some(state) = heard.changed {
            self.events.push(Event::RemoteState { node, state });
        }
    }

    #[inline(never)] // One copy in flash.
    fn serve(&mut self, now_us: u64, data: &[u8], app: &mut dyn Application) {
        let Ok(request) = data.try_into() else { return };
        // Whoever says something else no longer waits, and would take the answer for another one.
        self.leave_unanswered();
        let Self {
            config,
            communication,
            sdo,
            storing,
            ..
        } = self;
        let mut objects = Objects {
            config,
            communication,
            app,
            now_us,
            storing,
        };
        let was_asked = objects.storing.is_some();
        let streaming = sdo.is_streaming();
        let answer = sdo.request(request, &mut objects);
        let is_asked = objects.storing.is_some() && !was_asked;
        self.withdraw(streaming);
        match answer {
            Some(answer) if is_asked => self.wait_for_store(now_us, answer),
            Some(answer) => self.answer(answer),
            None => {}
        }
    }

    fn answer(&mut self, message: [u8; 8]) {
        self.transmit.push_sdo(message);
    }

    /// Takes back segments of an upload that have not been sent: after what just came the client
    /// would take them for something else.
    fn withdraw(&mut self, streaming: bool) {
        if streaming {
            self.transmit.clear_sdo();
        }
    }

    /// Makes segments of an SDO block upload while there is room for them.
    #[inline(never)] // One copy in flash, and a small one.
    fn stream(&mut self, now_us: u64, app: &mut dyn Application) {
        let Self {
            config,
            communication,
            sdo,
            storing,
            transmit,
            ..
        } = self;
        let mut objects = Objects {
            config,
            communication,
            app,
            now_us,
            storing,
        };
        while transmit.has_sdo_room()
            && let Some(message) = sdo.segment(&mut objects)
        {
            transmit.push_sdo(message);
        }
    }

    fn send_emergencies(&mut self, now_us: u64) {
        if matches!(self.state, NmtState::Initialising | NmtState::Stopped) {
            return;
        }
        while let Some(message) = self.communication.emergency.next(now_us) {
            self.transmit
                .push(self.communication.emergency.cob_id(), message, 8);
        }
    }
}

fn sdo_cob_id(node_id: u8) -> u16 {
    0x580 + u16::from(node_id)
}

fn heartbeat_cob_id(node_id: u8) -> u16 {
    0x700 + u16::from(node_id)
}
