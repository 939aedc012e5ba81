//! A vertebra's dictionary without a vertebra: every entry is a number in RAM.

use eel_canopen::{Abort, Application, Config, Entry, Identity, PdoDefault};
use eel_protocol::dictionary;
use eel_protocol::{
    HEAD_HEARTBEAT_TIMEOUT_MS, HEAD_NODE, SYNC_COUNTER_OVERFLOW, VERTEBRA_HEARTBEAT_MS, identity,
};

/// The length of every domain that can be read, in bytes.
const DOMAIN: u32 = 2_000;

/// The numbers, and how much of a domain was written.
pub struct Values {
    raw: [u32; dictionary::ENTRIES],
    written: u32,
}

/// Returns a vertebra's configuration for node `node_id`, with other PDOs where they are given.
pub fn config(
    node_id: u8,
    rpdos: &'static [PdoDefault],
    tpdos: &'static [PdoDefault],
    sync_counter_overflow: u8,
) -> Config {
    Config {
        node_id,
        node_ids: (1, 127),
        identity: Identity {
            vendor: identity::VENDOR,
            product: identity::PRODUCT,
            revision: identity::REVISION,
            serial: 1,
        },
        device_type: identity::DEVICE_TYPE,
        device_name: identity::DEVICE_NAME,
        hardware_version: "qemu",
        software_version: identity::SOFTWARE_VERSION,
        heartbeat_ms: VERTEBRA_HEARTBEAT_MS,
        consumer: Some((HEAD_NODE, HEAD_HEARTBEAT_TIMEOUT_MS)),
        sync_cob_id: 0x080,
        sync_counter_overflow,
        time_cob_id: 0x100,
        error_behaviour: 1,
        rpdos,
        tpdos,
    }
}

/// Returns the configuration that a vertebra has.
pub fn vertebra(node_id: u8) -> Config {
    config(
        node_id,
        eel_protocol::pdo::RPDOS,
        eel_protocol::pdo::TPDOS,
        SYNC_COUNTER_OVERFLOW,
    )
}

impl Values {
    /// Makes a dictionary full of zeros.
    pub const fn new() -> Self {
        Self {
            raw: [0; dictionary::ENTRIES],
            written: 0,
        }
    }
}

impl Application for Values {
    fn entry(&self, index: u16, subindex: u8) -> Result<Entry, Abort> {
        dictionary::entry(index, subindex)
    }

    fn read(&self, index: u16, subindex: u8, out: &mut [u8]) -> Result<usize, Abort> {
        let Ok(sub) = dictionary::served(index, subindex) else {
            return read_highest(index, subindex, out);
        };
        let raw = self.raw.get(sub.field as usize).ok_or(Abort::NoSubindex)?;
        sub.data_type.put(*raw, out)
    }

    fn write(&mut self, index: u16, subindex: u8, data: &[u8]) -> Result<(), Abort> {
        let sub = dictionary::served(index, subindex)?;
        let value = sub.accept(data)?;
        let slot = self.raw.get_mut(sub.field as usize);
        *slot.ok_or(Abort::NoSubindex)? = value as u32;
        Ok(())
    }

    fn rpdo_applied(&mut self, _number: u8, _cob_id: u16) {}

    fn open_domain(&mut self, _index: u16, _subindex: u8) -> Result<u32, Abort> {
        Ok(DOMAIN)
    }

    fn read_domain(
        &mut self,
        _index: u16,
        _subindex: u8,
        offset: u32,
        out: &mut [u8],
    ) -> Result<usize, Abort> {
        // Only how much there is counts here.
        let rest = DOMAIN.saturating_sub(offset) as usize;
        Ok(rest.min(out.len()))
    }

    fn begin_domain(
        &mut self,
        _index: u16,
        _subindex: u8,
        _length: Option<u32>,
    ) -> Result<(), Abort> {
        self.written = 0;
        Ok(())
    }

    fn write_domain(
        &mut self,
        _index: u16,
        _subindex: u8,
        _offset: u32,
        data: &[u8],
    ) -> Result<(), Abort> {
        self.written = self.written.wrapping_add(data.len() as u32);
        Ok(())
    }

    fn end_domain(&mut self, _index: u16, _subindex: u8, length: Option<u32>) -> Result<(), Abort> {
        match length {
            Some(_) => Ok(()),
            None => {
                self.written = 0;
                Ok(())
            }
        }
    }
}

/// Reads what is no entry: subindex 0, the number of entries. Apart, where it keeps no registers from
/// the entries that PDOs carry.
#[cold]
#[inline(never)]
fn read_highest(index: u16, subindex: u8, out: &mut [u8]) -> Result<usize, Abort> {
    if subindex != 0 {
        return Err(dictionary::highest(index).map_or_else(|abort| abort, |_| Abort::NoSubindex));
    }
    *out.first_mut().ok_or(Abort::OutOfMemory)? = dictionary::highest(index)?;
    Ok(1)
}
