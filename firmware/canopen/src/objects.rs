//! The object dictionary as the bus sees it: the communication area, served here, and the
//! application's objects behind it.

use crate::communication::Communication;
use crate::emergency::Fault;
use crate::pdo::{Parameters, Rpdo, Tpdo};
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

/// An object's value with its type.
#[derive(Clone, Copy, Debug)]
enum Value {
    U8(u8),
    U16(u16),
    U32(u32),
    Text(&'static str),
}

/// The four groups of PDO objects, with the PDO's place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PdoObject {
    RpdoParameters(usize),
    RpdoMapping(usize),
    TpdoParameters(usize),
    TpdoMapping(usize),
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
                    Ok(value) => value.length(),
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
            0x1000..=0x1FFF => self.value(index, subindex)?.copy_to(out),
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
            0x1000..=0x1FFF => self.write_communication(index, subindex, data),
            _ => Err(Abort::NoObject),
        }
    }

    fn value(&self, index: u16, subindex: u8) -> Result<Value, Abort> {
        let communication = &*self.communication;
        let emergency = &communication.emergency;
        let value = match (index, subindex) {
            (0x1000, 0) => Value::U32(self.config.device_type),
            (0x1001, 0) => Value::U8(emergency.register()),
            (0x1003, 0) => Value::U8(emergency.history_length()),
            (0x1003, 1..) => Value::U32(emergency.history(subindex)?),
            (0x1005, 0) => Value::U32(u32::from(communication.sync.cob_id())),
            (0x1008, 0) => Value::Text(self.config.device_name),
            (0x1009, 0) => Value::Text(self.config.hardware_version),
            (0x100A, 0) => Value::Text(self.config.software_version),
            (0x1010 | 0x1011, 0) => Value::U8(3),
            (0x1010 | 0x1011, 1..=3) => Value::U32(ON_COMMAND),
            (0x1012, 0) => Value::U32(communication.time.to_raw()),
            (0x1014, 0) => Value::U32(emergency.raw_cob_id()),
            (0x1015, 0) => Value::U16(emergency.inhibit_100us()),
            (0x1016, 0) => Value::U8(1),
            (0x1016, 1) => Value::U32(communication.consumer.to_raw()),
            (0x1017, 0) => Value::U16(communication.producer.period_ms()),
            (0x1018, 0) => Value::U8(4),
            (0x1018, 1) => Value::U32(self.config.identity.vendor),
            (0x1018, 2) => Value::U32(self.config.identity.product),
            (0x1018, 3) => Value::U32(self.config.identity.revision),
            (0x1018, 4) => Value::U32(self.config.identity.serial),
            (0x1019, 0) => Value::U8(communication.sync.overflow()),
            (0x1029, 0) => Value::U8(1),
            (0x1029, 1) => Value::U8(communication.error_behaviour),
            (0x1200, 0) => Value::U8(2),
            (0x1200, 1) => Value::U32(0x600 + u32::from(self.config.node_id)),
            (0x1200, 2) => Value::U32(0x580 + u32::from(self.config.node_id)),
            (0x1000 | 0x1001 | 0x1005 | 0x1008..=0x100A | 0x1010..=0x1012, _)
            | (0x1014..=0x1019 | 0x1029 | 0x1200, _) => return Err(Abort::NoSubindex),
            _ => return self.pdo_value(index, subindex),
        };
        Ok(value)
    }

    fn pdo_object(&self, index: u16) -> Option<PdoObject> {
        let place = usize::from(index & 0x00FF);
        let (object, present) = match index & 0xFF00 {
            0x1400 => (PdoObject::RpdoParameters(place), self.config.rpdos.len()),
            0x1600 => (PdoObject::RpdoMapping(place), self.config.rpdos.len()),
            0x1800 => (PdoObject::TpdoParameters(place), self.config.tpdos.len()),
            0x1A00 => (PdoObject::TpdoMapping(place), self.config.tpdos.len()),
            _ => return None,
        };
        (place < present).then_some(object)
    }

    fn pdo_value(&self, index: u16, subindex: u8) -> Result<Value, Abort> {
        let rpdo = |place: usize| self.communication.rpdos.get(place).ok_or(Abort::NoObject);
        let tpdo = |place: usize| self.communication.tpdos.get(place).ok_or(Abort::NoObject);
        match self.pdo_object(index).ok_or(Abort::NoObject)? {
            PdoObject::RpdoParameters(place) => rpdo_value(rpdo(place)?, subindex),
            PdoObject::TpdoParameters(place) => tpdo_value(tpdo(place)?, subindex),
            PdoObject::RpdoMapping(place) => mapping_value(&rpdo(place)?.parameters, subindex),
            PdoObject::TpdoMapping(place) => mapping_value(&tpdo(place)?.parameters, subindex),
        }
    }

    fn write_communication(&mut self, index: u16, subindex: u8, data: &[u8]) -> Result<(), Abort> {
        if index != 0x1003 {
            self.app.may_configure()?;
        }
        let communication = &mut *self.communication;
        match (index, subindex) {
            (0x1003, 0) => match u8_from(data)? {
                0 => communication.emergency.clear_history(),
                _ => return Err(Abort::Value),
            },
            (0x1005, 0) => communication.sync.write_cob_id(u32_from(data)?)?,
            (0x1010, 1..=3) => {
                return self.ask_to_store(u32_from(data)? == SAVE, subindex, StoreRequest::Save);
            }
            (0x1011, 1..=3) => {
                return self.ask_to_store(u32_from(data)? == LOAD, subindex, StoreRequest::Restore);
            }
            (0x1012, 0) => communication.time.write(u32_from(data)?)?,
            (0x1014, 0) => communication.emergency.write_cob_id(u32_from(data)?)?,
            (0x1015, 0) => communication.emergency.set_inhibit(u16_from(data)?),
            (0x1016, 1) => {
                communication.consumer = crate::heartbeat::Consumer::from_raw(u32_from(data)?)?;
                communication.emergency.clear_fault(Fault::Heartbeat);
            }
            (0x1017, 0) => communication
                .producer
                .set_period(u16_from(data)?, self.now_us),
            (0x1019, 0) => communication.sync.write_overflow(u8_from(data)?)?,
            (0x1029, 1) => communication.write_error_behaviour(u8_from(data)?)?,
            _ => return self.write_pdo(index, subindex, data),
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

    fn write_pdo(&mut self, index: u16, subindex: u8, data: &[u8]) -> Result<(), Abort> {
        let object = self.pdo_object(index).ok_or(Abort::NoObject)?;
        let now_us = self.now_us;
        // The dictionary is asked before a PDO of it is borrowed.
        let described = match u32_from(data) {
            Ok(raw) if subindex > 0 => {
                let mapped = Mapped::from_raw(raw);
                self.describe(mapped.index, mapped.subindex)
            }
            _ => Err(Abort::NoObject),
        };
        let communication = &mut *self.communication;
        match object {
            PdoObject::RpdoParameters(place) => {
                let rpdo = communication.rpdos.get_mut(place).ok_or(Abort::NoObject)?;
                write_rpdo(rpdo, subindex, data)?;
                if subindex == 1 && !rpdo.parameters.is_enabled() {
                    let number = place as u8 + 1;
                    communication
                        .emergency
                        .clear_fault(Fault::RpdoLength(number));
                }
                Ok(())
            }
            PdoObject::TpdoParameters(place) => {
                let tpdo = communication.tpdos.get_mut(place).ok_or(Abort::NoObject)?;
                write_tpdo(tpdo, subindex, data, now_us)
            }
            PdoObject::RpdoMapping(place) => {
                let rpdo = communication.rpdos.get_mut(place).ok_or(Abort::NoObject)?;
                write_mapping(&mut rpdo.parameters, subindex, data, described)
            }
            PdoObject::TpdoMapping(place) => {
                let tpdo = communication.tpdos.get_mut(place).ok_or(Abort::NoObject)?;
                write_mapping(&mut tpdo.parameters, subindex, data, described)
            }
        }
    }
}

impl Value {
    /// Returns the length in bytes; 0 for a text, which may have any.
    const fn length(self) -> u8 {
        match self {
            Self::U8(_) => 1,
            Self::U16(_) => 2,
            Self::U32(_) => 4,
            Self::Text(_) => 0,
        }
    }

    fn copy_to(self, out: &mut [u8]) -> Result<usize, Abort> {
        match self {
            Self::U8(value) => copy(&[value], out),
            Self::U16(value) => copy(&value.to_le_bytes(), out),
            Self::U32(value) => copy(&value.to_le_bytes(), out),
            Self::Text(text) => copy(text.as_bytes(), out),
        }
    }
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

fn rpdo_value(rpdo: &Rpdo, subindex: u8) -> Result<Value, Abort> {
    match subindex {
        0 => Ok(Value::U8(RPDO_PARAMETERS)),
        1 => Ok(Value::U32(rpdo.parameters.raw_cob_id())),
        2 => Ok(Value::U8(rpdo.parameters.transmission())),
        _ => Err(Abort::NoSubindex),
    }
}

fn tpdo_value(tpdo: &Tpdo, subindex: u8) -> Result<Value, Abort> {
    match subindex {
        0 => Ok(Value::U8(TPDO_PARAMETERS)),
        1 => Ok(Value::U32(tpdo.parameters.raw_cob_id())),
        2 => Ok(Value::U8(tpdo.parameters.transmission())),
        3 => Ok(Value::U16(tpdo.inhibit_100us())),
        5 => Ok(Value::U16(tpdo.event_ms())),
        6 => Ok(Value::U8(tpdo.sync_start())),
        _ => Err(Abort::NoSubindex),
    }
}

fn mapping_value(parameters: &Parameters, subindex: u8) -> Result<Value, Abort> {
    match subindex {
        0 => Ok(Value::U8(parameters.count())),
        _ => parameters.entry(subindex).map(Value::U32),
    }
}

fn write_rpdo(rpdo: &mut Rpdo, subindex: u8, data: &[u8]) -> Result<(), Abort> {
    match subindex {
        1 => {
            rpdo.parameters.write_cob_id(u32_from(data)?)?;
            if !rpdo.parameters.is_enabled() {
                rpdo.forget();
            }
            Ok(())
        }
        2 => rpdo.parameters.write_transmission(u8_from(data)?),
        _ => Err(Abort::NoSubindex),
    }
}

fn write_tpdo(tpdo: &mut Tpdo, subindex: u8, data: &[u8], now_us: u64) -> Result<(), Abort> {
    match subindex {
        1 => tpdo.parameters.write_cob_id(u32_from(data)?)?,
        2 => tpdo.parameters.write_transmission(u8_from(data)?)?,
        3 => tpdo.write_inhibit(u16_from(data)?)?,
        5 => tpdo.set_event(u16_from(data)?),
        6 => tpdo.write_sync_start(u8_from(data)?)?,
        _ => return Err(Abort::NoSubindex),
    }
    tpdo.restart(now_us);
    Ok(())
}

fn write_mapping(
    parameters: &mut Parameters,
    subindex: u8,
    data: &[u8],
    described: Result<Entry, Abort>,
) -> Result<(), Abort> {
    match subindex {
        0 => parameters.write_count(u8_from(data)?),
        _ => parameters.write_entry(subindex, u32_from(data)?, described),
    }
}

fn u8_from(data: &[u8]) -> Result<u8, Abort> {
    let &[byte] = data else {
        return Err(Abort::Length);
    };
    Ok(byte)
}

fn u16_from(data: &[u8]) -> Result<u16, Abort> {
    Ok(u16::from_le_bytes(
        data.try_into().map_err(|_| Abort::Length)?,
    ))
}

fn u32_from(data: &[u8]) -> Result<u32, Abort> {
    Ok(u32::from_le_bytes(
        data.try_into().map_err(|_| Abort::Length)?,
    ))
}
