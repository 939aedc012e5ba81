//! The object dictionary as the bus sees it: the communication area, served here, and the
//! application's objects behind it.

use crate::communication::Communication;
use crate::emergency::Fault;
use crate::{Abort, Access, Application, Config, Entry, Group, Mapped, StoreRequest};

/// The highest subindex of 0x1400 and of 0x1800.
const RPDO_PARAMETERS: u8 = 2;
const TPDO_PARAMETERS: u8 = 6;

/// Both halves of the dictionary at one time.
pub(crate) struct Objects<'a> {
    pub config: &'a Config,
    pub communication: &'a mut Communication,
    pub app: &'a mut dyn Application,
    pub now_us: u64,
    /// What a write asked to be stored; while it is not done, nothing else can be asked for.
    pub storing: &'a mut Option<StoreRequest>,
}

/// What is written to 0x1010 and 0x1011: "save" and "load".
const SAVE: u32 = u32::from_le_bytes(*b"save");
const LOAD: u32 = u32::from_le_bytes(*b"load");
/// What 0x1010 and 0x1011 read as: it is done on command.
const ON_COMMAND: u32 = 1;

/// An object's number and its length in bytes.
#[derive(Clone, Copy, Debug)]
struct Value {
    raw: u32,
    length: u8,
}

/// An object of a PDO that the node has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct PdoObject {
    /// It belongs to a TPDO, not to an RPDO.
    transmits: bool,
    /// It is the mapping, not the communication parameters.
    is_mapping: bool,
    /// The PDO's place.
    place: usize,
}

impl Objects<'_> {
    /// Describes an object.
    ///
    /// # Errors
    /// [`Abort::NoObject`], [`Abort::NoSubindex`].
    pub fn describe(&self, index: u16, subindex: u8) -> Result<Entry, Abort> {
        match index {
            index if is_application(index) => self.app.entry(index, subindex),
            0x1000..=0x1FFF => {
                let length = match self.value(index, subindex) {
                    // A text may have any length.
                    Ok(_) if self.text(index).is_some() => 0,
                    Ok(value) => value.length,
                    // Known, but empty for now.
                    Err(Abort::NoData) => 4,
                    Err(abort) => return Err(abort),
                };
                let tpdo = index == 0x1001;
                Ok(Entry {
                    length,
                    domain: false,
                    access: access(index, subindex),
                    tpdo,
                    rpdo: false,
                })
            }
            _ => Err(Abort::NoObject),
        }
    }

    /// Copies an object's bytes to `out` and returns how many, whether it may be read or not.
    ///
    /// # Errors
    /// The abort code to answer with.
    pub fn read(&self, index: u16, subindex: u8, out: &mut [u8]) -> Result<usize, Abort> {
        match index {
            index if is_application(index) => {
                let length = self.app.read(index, subindex, out)?;
                if length <= out.len() {
                    Ok(length)
                } else {
                    Err(Abort::OutOfMemory)
                }
            }
            0x1000..=0x1FFF => {
                let value = self.value(index, subindex)?;
                let number = value.raw.to_le_bytes();
                let number = number.get(..usize::from(value.length)).unwrap_or(&[]);
                copy(self.text(index).map_or(number, str::as_bytes), out)
            }
            _ => Err(Abort::NoObject),
        }
    }

    /// Writes an object from bytes of its length, whether it may be written or not.
    ///
    /// # Errors
    /// The abort code to answer with.
    pub fn write(&mut self, index: u16, subindex: u8, data: &[u8]) -> Result<(), Abort> {
        match index {
            index if is_application(index) => self.app.write(index, subindex, data),
            0x1000..=0x1FFF => self.write_communication(index, subindex, number(data)),
            _ => Err(Abort::NoObject),
        }
    }

    /// Returns the object that is a text.
    const fn text(&self, index: u16) -> Option<&'static str> {
        match index {
            0x1008 => Some(self.config.device_name),
            0x1009 => Some(self.config.hardware_version),
            0x100A => Some(self.config.software_version),
            _ => None,
        }
    }

    /// Returns an object's number; that of a text is nothing.
    #[inline(never)] // One copy in flash.
    fn value(&self, index: u16, subindex: u8) -> Result<Value, Abort> {
        let communication = &*self.communication;
        let emergency = &communication.emergency;
        let value = match (index, subindex) {
            (0x1000, 0) => u32(self.config.device_type),
            (0x1001, 0) => u8(emergency.register()),
            (0x1003, 0) => u8(emergency.history_length()),
            (0x1003, 1..) => u32(emergency.history(subindex)?),
            (0x1005, 0) => u32(communication.sync.cob_id().into()),
            (0x1008..=0x100A, 0) => u8(0),
            (0x1010 | 0x1011, 0) => u8(3),
            (0x1010 | 0x1011, 1..=3) => u32(ON_COMMAND),
            (0x1012, 0) => u32(communication.time.to_raw()),
            (0x1014, 0) => u32(emergency.raw_cob_id()),
            (0x1015, 0) => u16(emergency.inhibit_100us()),
            (0x1016, 0) => u8(1),
            (0x1016, 1) => u32(communication.consumer.to_raw()),
            (0x1017, 0) => u16(communication.producer.period_ms()),
            (0x1018, 0) => u8(4),
            (0x1018, 1) => u32(self.config.identity.vendor),
            (0x1018, 2) => u32(self.config.identity.product),
            (0x1018, 3) => u32(self.config.identity.revision),
            (0x1018, 4) => u32(self.config.identity.serial),
            (0x1019, 0) => u8(communication.sync.overflow()),
            (0x1029, 0) => u8(1),
            (0x1029, 1) => u8(communication.error_behaviour),
            (0x1200, 0) => u8(2),
            (0x1200, 1) => u32(0x600 + u32::from(self.config.node_id)),
            (0x1200, 2) => u32(0x580 + u32::from(self.config.node_id)),
            (0x1000 | 0x1001 | 0x1005 | 0x1008..=0x100A | 0x1010..=0x1012, _)
            | (0x1014..=0x1019 | 0x1029 | 0x1200, _) => return Err(Abort::NoSubindex),
            _ => return self.pdo_value(index, subindex),
        };
        Ok(value)
    }

    fn pdo_object(&self, index: u16) -> Result<PdoObject, Abort> {
        let (transmits, is_mapping) = match index >> 8 {
            0x14 => (false, false),
            0x16 => (false, true),
            0x18 => (true, false),
            0x1A => (true, true),
            _ => return Err(Abort::NoObject),
        };
        let place = usize::from(index & 0x00FF);
        let listed = if transmits {
            self.config.tpdos
        } else {
            self.config.rpdos
        };
        if place >= listed.len() {
            return Err(Abort::NoObject);
        }
        Ok(PdoObject {
            transmits,
            is_mapping,
            place,
        })
    }

    fn pdo_value(&self, index: u16, subindex: u8) -> Result<Value, Abort> {
        let object = self.pdo_object(index)?;
        let Communication { rpdos, tpdos, .. } = &*self.communication;
        let tpdo = tpdos.get(object.place).ok_or(Abort::NoObject)?;
        let rpdo = rpdos.get(object.place).ok_or(Abort::NoObject)?;
        let (parameters, highest) = if object.transmits {
            (&tpdo.parameters, TPDO_PARAMETERS)
        } else {
            (&rpdo.parameters, RPDO_PARAMETERS)
        };
        Ok(match subindex {
            0 if object.is_mapping => u8(parameters.count()),
            _ if object.is_mapping => u32(parameters.entry(subindex)?),
            0 => u8(highest),
            1 => u32(parameters.raw_cob_id()),
            2 => u8(parameters.transmission()),
            3 if object.transmits => u16(tpdo.inhibit_100us()),
            5 if object.transmits => u16(tpdo.event_ms()),
            6 if object.transmits => u8(tpdo.sync_start()),
            _ => return Err(Abort::NoSubindex),
        })
    }

    fn write_communication(&mut self, index: u16, subindex: u8, raw: u32) -> Result<(), Abort> {
        if index != 0x1003 {
            self.app.may_configure()?;
        }
        let communication = &mut *self.communication;
        match (index, subindex) {
            (0x1003, 0) => {
                if raw != 0 {
                    return Err(Abort::Value);
                }
                communication.emergency.clear_history();
            }
            (0x1005, 0) => communication.sync.write_cob_id(raw)?,
            (0x1010, 1..=3) => {
                return self.ask_to_store(raw == SAVE, subindex, StoreRequest::Save);
            }
            (0x1011, 1..=3) => {
                return self.ask_to_store(raw == LOAD, subindex, StoreRequest::Restore);
            }
            (0x1012, 0) => communication.time.write(raw)?,
            (0x1014, 0) => communication.emergency.write_cob_id(raw)?,
            (0x1015, 0) => communication.emergency.set_inhibit(raw as u16),
            (0x1016, 1) => {
                communication.consumer = crate::heartbeat::Consumer::from_raw(raw)?;
                communication.emergency.clear_fault(Fault::Heartbeat);
            }
            (0x1017, 0) => communication.producer.set_period(raw as u16, self.now_us),
            (0x1019, 0) => communication.sync.write_overflow(raw as u8)?,
            (0x1029, 1) => communication.write_error_behaviour(raw as u8)?,
            _ => return self.write_pdo(index, subindex, raw),
        }
        Ok(())
    }

    fn ask_to_store(
        &mut self,
        signed: bool,
        subindex: u8,
        request: impl Fn(Group) -> StoreRequest,
    ) -> Result<(), Abort> {
        let group = Group::from_subindex(subindex).ok_or(Abort::NoSubindex)?;
        if !signed {
            return Err(Abort::Transfer);
        }
        if self.storing.is_some() {
            return Err(Abort::DeviceState);
        }
        *self.storing = Some(request(group));
        Ok(())
    }

    #[inline(never)] // One copy in flash.
    fn write_pdo(&mut self, index: u16, subindex: u8, raw: u32) -> Result<(), Abort> {
        let object = self.pdo_object(index)?;
        // The dictionary is asked before a PDO of it is borrowed.
        let described = if object.is_mapping && subindex > 0 {
            let mapped = Mapped::from_raw(raw);
            self.describe(mapped.index, mapped.subindex)
        } else {
            Err(Abort::NoObject)
        };
        let Communication {
            rpdos,
            tpdos,
            emergency,
            ..
        } = &mut *self.communication;
        let tpdo = tpdos.get_mut(object.place).ok_or(Abort::NoObject)?;
        let rpdo = rpdos.get_mut(object.place).ok_or(Abort::NoObject)?;
        let parameters = if object.transmits {
            &mut tpdo.parameters
        } else {
            &mut rpdo.parameters
        };
        match subindex {
            0 if object.is_mapping => return parameters.write_count(raw as u8),
            _ if object.is_mapping => return parameters.write_entry(subindex, raw, described),
            1 => parameters.write_cob_id(raw)?,
            2 => parameters.write_transmission(raw as u8)?,
            3 if object.transmits => tpdo.write_inhibit(raw as u16)?,
            5 if object.transmits => tpdo.set_event(raw as u16),
            6 if object.transmits => tpdo.write_sync_start(raw as u8)?,
            _ => return Err(Abort::NoSubindex),
        }
        if object.transmits {
            tpdo.restart(self.now_us);
        } else if subindex == 1 && !rpdo.parameters.is_enabled() {
            rpdo.forget();
            emergency.clear_fault(Fault::RpdoLength(object.place as u8 + 1));
        }
        Ok(())
    }
}

const fn u8(number: u8) -> Value {
    value(number as u32, 1)
}

const fn u16(number: u16) -> Value {
    value(number as u32, 2)
}

const fn u32(number: u32) -> Value {
    value(number, 4)
}

const fn value(raw: u32, length: u8) -> Value {
    Value { raw, length }
}

/// Reads a number of at most four bytes; more do not count.
fn number(data: &[u8]) -> u32 {
    let bytes = data.iter().take(4).rev();
    bytes.fold(0, |number, byte| number << 8 | u32::from(*byte))
}

fn copy(bytes: &[u8], out: &mut [u8]) -> Result<usize, Abort> {
    let slot = out.get_mut(..bytes.len()).ok_or(Abort::OutOfMemory)?;
    slot.copy_from_slice(bytes);
    Ok(bytes.len())
}

/// Tells whether the application serves an object.
const fn is_application(index: u16) -> bool {
    matches!(index, 0x1021 | 0x1022 | 0x1F50..=0x1F5F | 0x2000..)
}

/// Tells who may do what with an object of the communication area that exists.
const fn access(index: u16, subindex: u8) -> Access {
    match (index, subindex) {
        (0x1001, _) | (0x1003, 1..) => Access::ReadOnly,
        (0x1003, 0) | (0x1005 | 0x1012 | 0x1014 | 0x1015 | 0x1017 | 0x1019, _) => Access::ReadWrite,
        (0x1010 | 0x1011 | 0x1016 | 0x1029, 1..) | (0x1400..=0x15FF | 0x1800..=0x19FF, 1..) => {
            Access::ReadWrite
        }
        (0x1600..=0x17FF | 0x1A00..=0x1BFF, _) => Access::ReadWrite,
        _ => Access::Constant,
    }
}
