//! What watches over a vertebra's program on its board, and what goes wrong.
//!
//! The board's converter switches the bridges off when the control tick stays away, its watchdog then
//! starts the chip anew, and the brown-out reset holds the chip while its supply is too low; a
//! controller that is bus-off rejoins after the pause of the board's own [`Backoff`]. None of that
//! is the program's own, so a node of the simulator has it here.

use eel_drivers::Backoff;
use eel_protocol::{Cob, Frame};
use eel_vertebra::Drive;

use super::fault::FaultKind;
use super::node::Reset;
use super::{Robot, instant};

/// Time without a control tick after which the converter's interrupt switches the bridges off.
const STALL_NS: u64 = 5_000_000;
/// Time after which a watchdog that is not fed starts the chip anew: it is fed at most 10 ms after
/// the last sign of life, and ends 40 ms later.
const WATCHDOG_NS: u64 = 50_000_000;
/// Voltage of the supply below which the board's converter for 3.3 V ends, and the chip with it, V.
const BROWN_OUT_V: f64 = 6.0;
/// Voltage from which on it starts again, V.
const RECOVERY_V: f64 = 7.0;
/// NMT "stop remote node" (CiA 301, 7.2.8.3.1.1).
const NMT_STOP: u8 = 2;

/// The board around a vertebra's program.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Supervisor {
    /// Since when the program hangs.
    hung_ns: Option<u64>,
    /// Whether the supply is too low for the chip.
    is_dark: bool,
    /// Until when the controller stays off the bus.
    away_ns: Option<u64>,
    backoff: Backoff,
}

impl Robot {
    /// Tells whether a vertebra's program runs now, after what its board did otherwise.
    pub(super) fn may_turn(&mut self, index: usize) -> bool {
        let supply_v = self.plant.supply_v();
        self.rejoin(index);
        let Supervisor {
            hung_ns, is_dark, ..
        } = self.nodes[index].supervisor;
        if is_dark {
            if supply_v < RECOVERY_V {
                return false;
            }
            self.restart(index, Reset::Power);
        } else if supply_v < BROWN_OUT_V {
            let seat = &mut self.nodes[index];
            seat.supervisor.is_dark = true;
            seat.supervisor.away_ns = None;
            seat.drives = [Drive::Off; 3];
            seat.link.power(&mut self.bus, self.now_ns, false);
            return false;
        } else if let Some(since_ns) = hung_ns {
            let silent_ns = self.now_ns - since_ns;
            if silent_ns >= STALL_NS {
                self.nodes[index].drives = [Drive::Off; 3];
            }
            if silent_ns < WATCHDOG_NS {
                return false;
            }
            self.restart(index, Reset::Failure);
        }
        true
    }

    /// Puts a controller that was bus-off on the bus again when its pause is over.
    fn rejoin(&mut self, index: usize) {
        let seat = &mut self.nodes[index];
        if seat
            .supervisor
            .away_ns
            .is_some_and(|until| until <= self.now_ns)
        {
            seat.supervisor.away_ns = None;
            seat.link.power(&mut self.bus, self.now_ns, true);
        }
    }

    /// Starts a vertebra's chip anew.
    fn restart(&mut self, index: usize, cause: Reset) {
        let seat = &mut self.nodes[index];
        seat.supervisor = Supervisor::default();
        seat.link.power(&mut self.bus, self.now_ns, false);
        seat.link.power(&mut self.bus, self.now_ns, true);
        seat.node.reset(instant(self.now_ns), cause);
        seat.drives = [Drive::Off; 3];
    }

    /// Lets happen what is due to go wrong.
    pub(super) fn apply_faults(&mut self) {
        while let Some(fault) = self
            .faults
            .first()
            .copied()
            .filter(|fault| fault.at_ns <= self.now_ns)
        {
            self.faults.remove(0);
            self.fail(fault.kind);
        }
    }

    /// Lets something go wrong now.
    pub fn fail(&mut self, kind: FaultKind) {
        let bit = |node: eel_protocol::NodeId| 1_u16 << node.index();
        match kind {
            FaultKind::HeadSilent => {
                self.head_silent = true;
                self.head_link.power(&mut self.bus, self.now_ns, false);
            }
            FaultKind::HeartbeatLost => self.muffle.heartbeat = true,
            FaultKind::TargetsLost(node) => self.muffle.lost |= bit(node),
            FaultKind::TargetsBent(node) => self.muffle.bent |= bit(node),
            FaultKind::StopByNmt => {
                if let Some(frame) = Frame::standard(Cob::Nmt.id(), &[NMT_STOP, 0]) {
                    self.head_link.send(&mut self.bus, self.now_ns, frame);
                }
            }
            FaultKind::NodeReset(node) => self.restart(node.index(), Reset::Power),
            FaultKind::NodeHung(node) => {
                let supervisor = &mut self.nodes[node.index()].supervisor;
                supervisor.hung_ns = supervisor.hung_ns.or(Some(self.now_ns));
            }
            FaultKind::BusOff(node) => {
                let seat = &mut self.nodes[node.index()];
                if !seat.supervisor.is_dark && seat.supervisor.away_ns.is_none() {
                    let pause = seat.supervisor.backoff.pause(instant(self.now_ns));
                    let pause_ns = u64::from(pause.to_micros()) * 1_000;
                    seat.supervisor.away_ns = Some(self.now_ns + pause_ns);
                    seat.link.power(&mut self.bus, self.now_ns, false);
                }
            }
            FaultKind::Broken(node, defect) => {
                self.plant.defects_mut(node.index()).add(defect);
            }
            FaultKind::Battery(millivolts) => {
                self.plant.set_battery(f64::from(millivolts) / 1e3);
            }
        }
    }
}
