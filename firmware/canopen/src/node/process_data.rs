//! PDOs: what SYNC and received frames do with them.

use super::Node;
use crate::emergency::{Emergency, Fault};
use crate::pdo::{Received, Rpdo};
use crate::{Application, Event, Mapped, NmtState};

impl Node {
    pub(super) fn synchronise(&mut self, data: &[u8], app: &mut impl Application) {
        let Some(counter) = self.communication.sync.counter(data) else {
            self.events.push(Event::SyncLength);
            let length = data.len() as u8;
            self.communication
                .emergency
                .raise_fault(Fault::SyncLength, length);
            return;
        };
        self.communication.emergency.clear_fault(Fault::SyncLength);
        let operational = self.state == NmtState::Operational;
        if operational {
            for place in 0..self.communication.rpdos.len() {
                let rpdo = self.communication.rpdos.get(place);
                if rpdo.is_some_and(Rpdo::is_pending) {
                    self.apply_rpdo(place, app);
                }
            }
        }
        self.events.push(Event::Sync { counter });
        app.synchronised(counter);
        if operational {
            for place in 0..self.communication.tpdos.len() {
                let tpdo = self.communication.tpdos.get_mut(place);
                if tpdo.is_some_and(|tpdo| tpdo.is_due_at_sync(counter)) {
                    self.send_tpdo(place, app);
                }
            }
        }
    }

    pub(super) fn receive(&mut self, cob_id: u16, data: &[u8], app: &mut impl Application) {
        for place in 0..self.communication.rpdos.len() {
            let Some(rpdo) = self.communication.rpdos.get_mut(place) else {
                return;
            };
            let number = place as u8 + 1;
            let received = rpdo.receive(cob_id, data);
            match received {
                Received::Other => {}
                Received::Short => {
                    self.rpdos_short = self.rpdos_short.saturating_add(1);
                    self.events.push(Event::RpdoLength { number });
                    let fault = Fault::RpdoLength(number);
                    self.communication.emergency.raise_fault(fault, number);
                }
                Received::Kept | Received::Due => {
                    self.communication
                        .emergency
                        .clear_fault(Fault::RpdoLength(number));
                    if received == Received::Due {
                        self.apply_rpdo(place, app);
                    }
                }
            }
        }
    }

    #[inline(never)] // One copy in flash.
    fn apply_rpdo(&mut self, place: usize, app: &mut impl Application) {
        let Some(rpdo) = self.communication.rpdos.get_mut(place) else {
            return;
        };
        let number = place as u8 + 1;
        if rpdo.apply(number, app) == Some(false) {
            self.rpdos_refused = self.rpdos_refused.saturating_add(1);
            self.events.push(Event::RpdoRefused { number });
        }
    }

    #[inline(never)] // One copy in flash.
    pub(super) fn send_tpdo(&mut self, place: usize, app: &mut impl Application) {
        let Self {
            communication,
            transmit,
            ..
        } = self;
        let Some(tpdo) = communication.tpdos.get(place) else {
            return;
        };
        let parameters = &tpdo.parameters;
        let mapping = parameters.mapping();
        let ready = app.tpdo_due(place as u8 + 1, parameters.cob_id(), mapping);
        match ready.or_else(|| read_mapped(mapping, &communication.emergency, app)) {
            Some(data) => transmit.replace(parameters.cob_id(), data, parameters.bytes()),
            None => self.tpdos_refused = self.tpdos_refused.saturating_add(1),
        }
    }
}

/// Puts the mapped objects one behind the other; `None` when one can't be read at its length.
fn read_mapped(
    mapping: &[Mapped],
    emergency: &Emergency,
    app: &impl Application,
) -> Option<[u8; 8]> {
    let mut data = [0; 8];
    let mut rest: &mut [u8] = &mut data;
    for mapped in mapping {
        let (slot, others) = rest.split_at_mut_checked(mapped.bytes())?;
        let length = match mapped.index {
            0x2000.. => app.read(mapped.index, mapped.subindex, slot).ok()?,
            // The only one of the communication area that can be mapped.
            _ => {
                *slot.first_mut()? = emergency.register();
                1
            }
        };
        if length != slot.len() {
            return None;
        }
        rest = others;
    }
    Some(data)
}
