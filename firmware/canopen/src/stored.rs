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

/// Bytes that are written one behind the other.
struct Writer<'a> {
    out: &'a mut [u8],
    written: usize,
}

impl Writer<'_> {
    fn put<const N: usize>(&mut self, bytes: [u8; N]) -> Option<()> {
        let end = self.written + N;
        self.out.get_mut(self.written..end)?.copy_from_slice(&bytes);
        self.written = end;
        Some(())
    }

    fn put_identifier(&mut self, cob_id: u16, predefined: u16, enabled: bool) -> Option<()> {
        let identifier = if cob_id == predefined {
            PREDEFINED
        } else {
            cob_id
        };
        let disabled = if enabled { 0 } else { DISABLED };
        self.put((identifier | disabled).to_le_bytes())
    }

    fn put_pdo(&mut self, parameters: &Parameters, predefined: u16) -> Option<()> {
        let enabled = parameters.is_enabled();
        self.put_identifier(parameters.cob_id(), predefined, enabled)?;
        self.put([parameters.transmission(), parameters.count()])?;
        parameters
            .entries()
            .iter()
            .try_for_each(|mapped| self.put(mapped.to_raw().to_le_bytes()))
    }
}

/// Bytes that are read one behind the other.
struct Reader<'a> {
    rest: &'a [u8],
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(*bytes)
    }

    fn take_u8(&mut self) -> Option<u8> {
        self.take().map(u8::from_le_bytes)
    }

    fn take_u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn take_u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    /// Returns an identifier, and whether what it belongs to is enabled.
    fn take_identifier(&mut self, predefined: u16) -> Option<(u16, bool)> {
        let raw = self.take_u16()?;
        let cob_id = match raw & !DISABLED {
            PREDEFINED => predefined,
            other => other,
        };
        Some((cob_id, raw & DISABLED == 0))
    }

    fn take_pdo(&mut self, parameters: &mut Parameters, predefined: u16) -> Option<()> {
        let (cob_id, enabled) = self.take_identifier(predefined)?;
        let [transmission, count] = self.take()?;
        for mapped in parameters.entries_mut() {
            *mapped = Mapped::from_raw(self.take_u32()?);
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
    let mut writer = Writer { out, written: 0 };
    let emergency = &communication.emergency;
    writer.put([VERSION])?;
    writer.put(communication.sync.cob_id().to_le_bytes())?;
    writer.put([communication.sync.overflow()])?;
    writer.put(communication.time.to_raw().to_le_bytes())?;
    let own = predefined(0x080, config.node_id);
    writer.put_identifier(emergency.cob_id(), own, emergency.is_enabled())?;
    writer.put(emergency.inhibit_100us().to_le_bytes())?;
    writer.put(communication.consumer.to_raw().to_le_bytes())?;
    writer.put(communication.producer.period_ms().to_le_bytes())?;
    writer.put([communication.error_behaviour])?;
    let (rpdos, tpdos) = (config.rpdos, config.tpdos);
    writer.put([present(rpdos.len()), present(tpdos.len())])?;
    for (rpdo, default) in communication.rpdos.iter().zip(rpdos) {
        let predefined = predefined(default.cob_id_base, config.node_id);
        writer.put_pdo(&rpdo.parameters, predefined)?;
    }
    for (tpdo, default) in communication.tpdos.iter().zip(tpdos) {
        let predefined = predefined(default.cob_id_base, config.node_id);
        writer.put_pdo(&tpdo.parameters, predefined)?;
        writer.put(tpdo.inhibit_100us().to_le_bytes())?;
        writer.put(tpdo.event_ms().to_le_bytes())?;
        writer.put([tpdo.sync_start()])?;
    }
    Some(writer.written)
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
    let mut reader = Reader { rest: stored };
    if reader.take_u8()? != VERSION {
        return None;
    }
    let sync = &mut communication.sync;
    sync.write_cob_id(u32::from(reader.take_u16()?)).ok()?;
    sync.write_overflow(reader.take_u8()?).ok()?;
    communication.time.write(reader.take_u32()?).ok()?;
    let (cob_id, enabled) = reader.take_identifier(predefined(0x080, config.node_id))?;
    communication.emergency.restore(cob_id, enabled)?;
    communication.emergency.set_inhibit(reader.take_u16()?);
    communication.consumer = Consumer::from_raw(reader.take_u32()?).ok()?;
    communication.producer = Producer::new(reader.take_u16()?, now_us);
    communication
        .write_error_behaviour(reader.take_u8()?)
        .ok()?;
    let (rpdos, tpdos) = (config.rpdos, config.tpdos);
    if reader.take()? != [present(rpdos.len()), present(tpdos.len())] {
        return None;
    }
    for (rpdo, default) in communication.rpdos.iter_mut().zip(rpdos) {
        let predefined = predefined(default.cob_id_base, config.node_id);
        reader.take_pdo(&mut rpdo.parameters, predefined)?;
    }
    for (tpdo, default) in communication.tpdos.iter_mut().zip(tpdos) {
        let predefined = predefined(default.cob_id_base, config.node_id);
        reader.take_pdo(&mut tpdo.parameters, predefined)?;
        tpdo.restore(reader.take_u16()?, reader.take_u16()?, reader.take_u8()?)?;
        tpdo.restart(now_us);
    }
    reader.rest.is_empty().then_some(())
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
