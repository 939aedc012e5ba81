//! PDOs: what SYNC and received frames do with them.

use super::Node;
use crate::emergency::Fault;
use crate::objects::Objects;
use crate::pdo::Received;
use crate::{Application, Event, Mapped, NmtState};

impl Node {
    pub(super) fn synchronise(&mut self, now_us: u64, data: &[u8], app: &mut impl Application) {
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
                self.apply_rpdo(place, app);
            }
        }
        self.events.push(Event::Sync { counter });
        app.synchronised(counter);
        if operational {
            for place in 0..self.communication.tpdos.len() {
                let tpdo = self.communication.tpdos.get_mut(place);
                if tpdo.is_some_and(|tpdo| tpdo.is_due_at_sync(counter)) {
                    self.send_tpdo(place, now_us, app);
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
    pub(super) fn send_tpdo(&mut self, place: usize, now_us: u64, app: &mut impl Application) {
        let Some(parameters) = self
            .communication
            .tpdos
            .get(place)
            .map(|tpdo| tpdo.parameters)
        else {
            return;
        };
        app.tpdo_due(place as u8 + 1, parameters.cob_id());
        let Self {
            config,
            communication,
            storing,
            ..
        } = self;
        let objects = Objects {
            config,
            communication,
            app,
            now_us,
            storing,
        };
        let mut data = [0; 8];
        if read_mapped(&objects, parameters.mapping(), &mut data).is_none() {
            self.tpdos_refused = self.tpdos_refused.saturating_add(1);
            return;
        }
        let data = data.get(..usize::from(parameters.bytes())).unwrap_or(&[]);
        self.transmit.replace(parameters.cob_id(), data);
    }
}

/// Puts the mapped objects one behind the other; `None` when one can't be read at its length.
fn read_mapped<A: Application>(
    objects: &Objects<'_, A>,
    mapping: &[Mapped],
    data: &mut [u8; 8],
) -> Option<()> {
    let mut rest: &mut [u8] = data;
    for mapped in mapping {
        let (slot, others) = rest.split_at_mut_checked(mapped.bytes())?;
        if objects.read(mapped.index, mapped.subindex, slot) != Ok(slot.len()) {
            return None;
        }
        rest = others;
    }
    Some(())
}
