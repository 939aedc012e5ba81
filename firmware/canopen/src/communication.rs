//! The parameters and the state that a reset of the communication starts anew.

use crate::config::PDOS;
use crate::emergency::Emergency;
use crate::heartbeat::{Consumer, Producer};
use crate::pdo::{Rpdo, Tpdo};
use crate::sync::Sync;
use crate::time::Time;
use crate::{Abort, Config, NmtCommand};

/// What the objects 0x1000–0x1FFF stand for.
#[derive(Clone, Debug)]
pub(crate) struct Communication {
    pub producer: Producer,
    pub consumer: Consumer,
    pub sync: Sync,
    pub time: Time,
    /// Object 0x1029, subindex 1.
    pub error_behaviour: u8,
    pub rpdos: [Rpdo; PDOS],
    pub tpdos: [Tpdo; PDOS],
    pub emergency: Emergency,
}

impl Communication {
    pub fn new(config: &Config, now_us: u64) -> Self {
        let mut communication = Self {
            producer: Producer::new(0, 0),
            consumer: Consumer::new(None),
            sync: Sync::new(0, 0),
            time: Time::new(0),
            error_behaviour: 0,
            rpdos: [const { Rpdo::absent() }; PDOS],
            tpdos: [const { Tpdo::absent() }; PDOS],
            emergency: Emergency::new(),
        };
        communication.reset(NmtCommand::ResetNode, config, now_us);
        communication
    }

    /// Returns every parameter to its default. When only the communication is reset, the
    /// application's errors and the history stay.
    #[inline(never)] // One copy in flash.
    pub fn reset(&mut self, command: NmtCommand, config: &Config, now_us: u64) {
        // In place, part by part: a whole new one would be copied twice.
        let node_id = config.node_id;
        self.producer = Producer::new(config.heartbeat_ms, now_us);
        self.consumer = Consumer::new(config.consumer);
        self.sync = Sync::new(config.sync_cob_id, config.sync_counter_overflow);
        self.time = Time::new(config.time_cob_id);
        self.error_behaviour = config.error_behaviour;
        for (place, rpdo) in self.rpdos.iter_mut().enumerate() {
            rpdo.reset(config.rpdos.get(place), node_id);
        }
        for (place, tpdo) in self.tpdos.iter_mut().enumerate() {
            tpdo.reset(config.tpdos.get(place), node_id);
        }
        self.emergency.reset(command, node_id);
    }

    /// Writes object 0x1029, subindex 1.
    ///
    /// # Errors
    /// [`Abort::Value`] above 2.
    pub fn write_error_behaviour(&mut self, behaviour: u8) -> Result<(), Abort> {
        if behaviour > 2 {
            return Err(Abort::Value);
        }
        self.error_behaviour = behaviour;
        Ok(())
    }
}
