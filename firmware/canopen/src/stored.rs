//! The communication area's parameters as bytes, to be stored and found again.
//!
//! The layout is this crate's own and starts with its version. Whoever stores the bytes protects them;
//! what is loaded is held against every rule that a write by SDO is held against.

use crate::cob_id;
use crate::communication::Communication;
use crate::config::PDOS;
use crate::heartbeat::{Consumer, Producer};
use crate::pdo::{MAPPED_OBJECTS, Parameters};
use crate::{Abort, Access, Application, Config, Entry, Mapped};

/// The version of the layout.
const VERSION: u8 = 1;
/// Bytes before the PDOs, of an RPDO, and of a TPDO.
const HEAD: usize = 21;
const RPDO: usize = 4 + 4 * MAPPED_OBJECTS;
const TPDO: usize = RPDO + 5;

/// The most bytes that the stored parameters of a communication area take.
pub const STORED_PARAMETERS: usize = HEAD + PDOS * (RPDO + TPDO);

/// Set in an identifier that follows the node id, as the predefined connection set has it.
const PREDEFINED: u16 = 1 << 14;
/// Set in the identifier of what is disabled.
const DISABLED: u16 = 1 << 15;

/// Numbers that are written one behind the other; whether they found room is asked at the end.
struct Writer<'a> {
    out: &'a mut [u8],
    written: usize,
    failed: bool,
}

impl Writer<'_> {
    /// Writes the lowest `length` bytes of a number, at most four.
    #[inline(never)] // One copy in flash.
    fn put(&mut self, length: usize, number: u32) {
        let slot = self
            .out
            .get_mut(self.written..self.written.saturating_add(length));
        self.failed |= slot.is_none();
        for (to, from) in slot
            .unwrap_or_default()
            .iter_mut()
            .zip(number.to_le_bytes())
        {
            *to = from;
        }
        self.written = self.written.saturating_add(length);
    }

    fn put_identifier(&mut self, cob_id: u16, predefined: u16, enabled: bool) {
        let identifier = if cob_id == predefined {
            PREDEFINED
        } else {
            cob_id
        };
        let disabled = if enabled { 0 } else { DISABLED };
        self.put(2, u32::from(identifier | disabled));
    }

    fn put_pdo(&mut self, parameters: &Parameters, predefined: u16) {
        let enabled = parameters.is_enabled();
        self.put_identifier(parameters.cob_id(), predefined, enabled);
        self.put(1, parameters.transmission().into());
        self.put(1, parameters.count().into());
        for mapped in parameters.entries() {
            self.put(4, mapped.to_raw());
        }
    }
}

/// Numbers that are read one behind the other; whether there were so many is asked at the end.
struct Reader<'a> {
    rest: &'a [u8],
    failed: bool,
}

impl Reader<'_> {
    /// Reads bytes; zeros behind the end.
    #[inline(never)] // One copy of each length in flash.
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let Some((bytes, rest)) = self.rest.split_first_chunk() else {
            self.failed = true;
            return [0; N];
        };
        self.rest = rest;
        *bytes
    }

    fn take_u8(&mut self) -> u8 {
        u8::from_le_bytes(self.take())
    }

    fn take_u16(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }

    fn take_u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    /// Returns an identifier, and whether what it belongs to is enabled.
    fn take_identifier(&mut self, predefined: u16) -> (u16, bool) {
        let raw = self.take_u16();
        let cob_id = match raw & !DISABLED {
            PREDEFINED => predefined,
            other => other,
        };
        (cob_id, raw & DISABLED == 0)
    }

    #[inline(never)] // One copy in flash.
    fn take_pdo(&mut self, parameters: &mut Parameters, predefined: u16) -> Option<()> {
        let (cob_id, enabled) = self.take_identifier(predefined);
        let (transmission, count) = (self.take_u8(), self.take_u8());
        for mapped in parameters.entries_mut() {
            *mapped = Mapped::from_raw(self.take_u32());
        }
        parameters.restore(cob_id, enabled, transmission, count)
    }
}

/// Returns the identifier of a PDO by its default.
fn predefined(base: u16, node_id: u8) -> u16 {
    base.wrapping_add(u16::from(node_id)) & cob_id::MASK
}

/// Writes the parameters to the start of `out` and returns how many bytes they take; `None` when they
/// don't fit.
pub(crate) fn save(
    communication: &Communication,
    config: &Config,
    out: &mut [u8],
) -> Option<usize> {
    let mut writer = Writer {
        out,
        written: 0,
        failed: false,
    };
    let emergency = &communication.emergency;
    writer.put(1, VERSION.into());
    writer.put(2, communication.sync.cob_id().into());
    writer.put(1, communication.sync.overflow().into());
    writer.put(4, communication.time.to_raw());
    let own = predefined(0x080, config.node_id);
    writer.put_identifier(emergency.cob_id(), own, emergency.is_enabled());
    writer.put(2, emergency.inhibit_100us().into());
    writer.put(4, communication.consumer.to_raw());
    writer.put(2, communication.producer.period_ms().into());
    writer.put(1, communication.error_behaviour.into());
    let (rpdos, tpdos) = (config.rpdos, config.tpdos);
    writer.put(1, present(rpdos.len()).into());
    writer.put(1, present(tpdos.len()).into());
    for (rpdo, default) in communication.rpdos.iter().zip(rpdos) {
        let predefined = predefined(default.cob_id_base, config.node_id);
        writer.put_pdo(&rpdo.parameters, predefined);
    }
    for (tpdo, default) in communication.tpdos.iter().zip(tpdos) {
        let predefined = predefined(default.cob_id_base, config.node_id);
        writer.put_pdo(&tpdo.parameters, predefined);
        writer.put(2, tpdo.inhibit_100us().into());
        writer.put(2, tpdo.event_ms().into());
        writer.put(1, tpdo.sync_start().into());
    }
    (!writer.failed).then_some(writer.written)
}

/// Takes stored parameters over into fresh ones. Where they are wrong it returns `None`, and has
/// taken over a part.
#[inline(never)] // One copy in flash.
pub(crate) fn load(
    communication: &mut Communication,
    config: &Config,
    stored: &[u8],
    now_us: u64,
) -> Option<()> {
    let mut reader = Reader {
        rest: stored,
        failed: false,
    };
    if reader.take_u8() != VERSION {
        return None;
    }
    let sync = &mut communication.sync;
    sync.write_cob_id(u32::from(reader.take_u16())).ok()?;
    sync.write_overflow(reader.take_u8()).ok()?;
    communication.time.write(reader.take_u32()).ok()?;
    let (cob_id, enabled) = reader.take_identifier(predefined(0x080, config.node_id));
    communication.emergency.restore(cob_id, enabled)?;
    communication.emergency.set_inhibit(reader.take_u16());
    communication.consumer = Consumer::from_raw(reader.take_u32()).ok()?;
    communication.producer = Producer::new(reader.take_u16(), now_us);
    communication.write_error_behaviour(reader.take_u8()).ok()?;
    let (rpdos, tpdos) = (config.rpdos, config.tpdos);
    let listed = (present(rpdos.len()), present(tpdos.len()));
    if (reader.take_u8(), reader.take_u8()) != listed {
        return None;
    }
    for (rpdo, default) in communication.rpdos.iter_mut().zip(rpdos) {
        let predefined = predefined(default.cob_id_base, config.node_id);
        reader.take_pdo(&mut rpdo.parameters, predefined)?;
    }
    for (tpdo, default) in communication.tpdos.iter_mut().zip(tpdos) {
        let predefined = predefined(default.cob_id_base, config.node_id);
        reader.take_pdo(&mut tpdo.parameters, predefined)?;
        tpdo.restore(reader.take_u16(), reader.take_u16(), reader.take_u8())?;
        tpdo.restart(now_us);
    }
    (reader.rest.is_empty() && !reader.failed).then_some(())
}

/// Tells whether every mapped object exists and may go where it is mapped to.
pub(crate) fn is_served(communication: &Communication, app: &dyn Application) -> bool {
    let mut rpdos = communication.rpdos.iter();
    let mut tpdos = communication.tpdos.iter();
    rpdos.all(|rpdo| is_mapping_served(&rpdo.parameters, app))
        && tpdos.all(|tpdo| is_mapping_served(&tpdo.parameters, app))
}

#[inline(never)] // One copy in flash.
fn is_mapping_served(parameters: &Parameters, app: &dyn Application) -> bool {
    let mut entries = parameters.entries().iter();
    entries.all(|mapped| {
        let described = describe(*mapped, app);
        parameters.check_entry(*mapped, described).is_ok()
    })
}

/// Describes an object as far as PDOs are concerned.
fn describe(mapped: Mapped, app: &dyn Application) -> Result<Entry, Abort> {
    match (mapped.index, mapped.subindex) {
        (0x1001, 0) => Ok(Entry {
            length: 1,
            domain: false,
            access: Access::ReadOnly,
            tpdo: true,
            rpdo: false,
        }),
        (0x2000.., subindex) => app.entry(mapped.index, subindex),
        _ => Err(Abort::NoObject),
    }
}

/// Returns how many PDOs of a list a node has.
const fn present(listed: usize) -> u8 {
    if listed > PDOS {
        PDOS as u8
    } else {
        listed as u8
    }
}
