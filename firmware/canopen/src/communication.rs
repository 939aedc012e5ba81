//! The parameters and the state that a reset of the communication starts anew.

use crate::config::PDOS;
use crate::emergency::Emergency;
use crate::heartbeat::{Consumer, Producer};
use crate::pdo::{Rpdo, Tpdo};
use crate::sync::Sync;
use crate::{Config, NmtCommand, PdoDefault};

/// What the objects 0x1000–0x1FFF stand for.
#[derive(Clone, Debug)]
pub(crate) struct Communication {
    pub producer: Producer,
    pub consumer: Consumer,
    pub sync: Sync,
    pub rpdos: [Rpdo; PDOS],
    pub tpdos: [Tpdo; PDOS],
    pub emergency: Emergency,
}

impl Communication {
    pub fn new(config: &Config, now_us: u64) -> Self {
        let node_id = config.node_id;
        let rpdo = |number| Rpdo::new(default(config.rpdos, number), node_id);
        let tpdo = |number| Tpdo::new(default(config.tpdos, number), node_id);
        Self {
            producer: Producer::new(config.heartbeat_ms, now_us),
            consumer: Consumer::new(config.consumer),
            sync: Sync::new(config.sync_cob_id, config.sync_counter_overflow),
            rpdos: core::array::from_fn(rpdo),
            tpdos: core::array::from_fn(tpdo),
            emergency: Emergency::new(config),
        }
    }

    /// Returns every parameter to its default. When only the communication is reset, the
    /// application's errors and the history stay.
    pub fn reset(&mut self, command: NmtCommand, config: &Config, now_us: u64) {
        let fresh = Self::new(config, now_us);
        let old = core::mem::replace(self, fresh);
        self.emergency
            .inherit(old.emergency, command == NmtCommand::ResetCommunication);
    }

    /// Returns when the earliest of the timers that always run ends.
    pub fn deadline_us(&self) -> Option<u64> {
        let producer = self.producer.deadline_us();
        producer
            .into_iter()
            .chain(self.consumer.deadline_us())
            .min()
    }
}

fn default(defaults: &'static [PdoDefault], number: usize) -> Option<&'static PdoDefault> {
    defaults.get(number)
}
