//! The object dictionary as the node serves it: the core's fields, the scope's, and what streams.

use eel_canopen::{Abort, Access, Application, Entry, Mapped};
use eel_protocol::dictionary::{self, Field};
use eel_protocol::scope::captured;
use eel_protocol::{PoseReport, pdo};

use crate::core::Core;
use crate::objects::ReceivedTarget;
use crate::records::Records;

/// The electronic data sheet, and its format: plain text.
const STORE_EDS: u16 = 0x1021;
const STORE_FORMAT: u16 = 0x1022;
const PLAIN: u8 = 0;

/// The core, and what is recorded beside it.
pub(crate) struct Served<'a> {
    pub core: &'a mut Core,
    pub records: &'a mut Records,
}

/// Something that streams.
#[derive(Clone, Copy)]
enum Stream {
    Sheet,
    Freeze,
    Scope,
    Link,
}

impl Stream {
    /// Returns what an object streams.
    fn find(index: u16, subindex: u8) -> Result<Self, Abort> {
        if (index, subindex) == (STORE_EDS, 0) {
            return Ok(Self::Sheet);
        }
        match dictionary::served(index, subindex)?.field {
            Field::RecordFreeze => Ok(Self::Freeze),
            Field::RecordScope => Ok(Self::Scope),
            Field::LinkData => Ok(Self::Link),
            _ => Err(Abort::UnsupportedAccess),
        }
    }

    /// Returns what may be written to an object.
    fn find_writable(index: u16, subindex: u8) -> Result<(), Abort> {
        match Self::find(index, subindex)? {
            Self::Link => Ok(()),
            Self::Sheet | Self::Freeze | Self::Scope => Err(Abort::ReadOnly),
        }
    }
}

impl Served<'_> {
    /// Returns the raw number of a field.
    fn value(&self, field: Field) -> i64 {
        match field {
            Field::ScopeChannel1
            | Field::ScopeChannel2
            | Field::ScopeChannel3
            | Field::ScopeChannel4
            | Field::ScopeDivider
            | Field::ScopeTrigger
            | Field::ScopeState
            | Field::ScopeSamples => self.records.scope.value(field),
            Field::LinkLength => i64::from(self.records.link.length),
            Field::LinkCrc => i64::from(self.records.link.crc),
            _ => self.core.value(field),
        }
    }

    fn set(&mut self, field: Field, value: i64) -> Result<(), Abort> {
        match field {
            Field::ScopeChannel1
            | Field::ScopeChannel2
            | Field::ScopeChannel3
            | Field::ScopeChannel4
            | Field::ScopeDivider
            | Field::ScopeTrigger => self.records.scope.set(field, value),
            Field::LinkLength => {
                self.records.link.length = value as u32;
                Ok(())
            }
            _ => self.core.set(field, value),
        }
    }

    /// Lets the scope take its sample of this tick.
    pub fn capture(&mut self) {
        let is_fault = core::mem::take(&mut self.core.raised);
        if let Some(channels) = self.records.scope.due(is_fault) {
            let values = channels.map(|channel| self.sampled(channel));
            self.records.scope.take(self.core.now, values);
        }
    }

    /// Returns the number that a channel of the scope has in this tick. The pose is the present one: the
    /// entries of TPDO1 keep what was sent last.
    fn sampled(&self, channel: u32) -> i32 {
        let Some(entry) = captured(channel) else {
            return 0;
        };
        let pose = &self.core.pose;
        match entry.field {
            Field::PoseYaw => i32::from(pose.yaw.to_tenth_milliradians()),
            Field::PosePitch => i32::from(pose.pitch.to_tenth_milliradians()),
            Field::PoseRoll => i32::from(pose.roll.to_tenth_milliradians()),
            field => self.value(field) as i32,
        }
    }
}

impl Application for Served<'_> {
    fn entry(&self, index: u16, subindex: u8) -> Result<Entry, Abort> {
        let (length, domain, access) = match (index, subindex) {
            (STORE_EDS, 0) => (0, true, Access::ReadOnly),
            (STORE_FORMAT, 0) => (1, false, Access::ReadOnly),
            (STORE_EDS | STORE_FORMAT, _) => return Err(Abort::NoSubindex),
            _ => return dictionary::entry(index, subindex),
        };
        Ok(Entry {
            length,
            domain,
            access,
            tpdo: false,
            rpdo: false,
        })
    }

    fn read(&self, index: u16, subindex: u8, out: &mut [u8]) -> Result<usize, Abort> {
        let byte = match (index, subindex) {
            (STORE_FORMAT, 0) => PLAIN,
            (_, 0) => dictionary::highest(index)?,
            _ => {
                let entry = dictionary::served(index, subindex)?;
                return entry.data_type.encode(self.value(entry.field), out);
            }
        };
        *out.first_mut().ok_or(Abort::OutOfMemory)? = byte;
        Ok(1)
    }

    fn write(&mut self, index: u16, subindex: u8, data: &[u8]) -> Result<(), Abort> {
        let entry = dictionary::served(index, subindex)?;
        self.set(entry.field, entry.accept(data)?)
    }

    fn take_rpdo(&mut self, mapping: &[Mapped], data: &[u8; 8]) -> bool {
        // Any bytes are a target.
        let is_target = mapping == pdo::TARGET;
        if is_target {
            self.core.target = ReceivedTarget::from_bytes(*data);
        }
        is_target
    }

    fn rpdo_applied(&mut self, number: u8, cob_id: u16) {
        match number {
            // It waits for SYNC even where RPDO1 is event-driven: the path is made of one target for each.
            1 => self.core.arrived = Some(cob_id),
            2 => self.core.receive_feed_forward(),
            _ => {}
        }
    }

    fn synchronised(&mut self, _: Option<u8>) {
        if let Some(cob_id) = self.core.arrived.take() {
            let bytes = self.core.target.to_bytes();
            self.core.receive_target(&bytes, cob_id);
        }
    }

    fn tpdo_due(&mut self, number: u8, cob_id: u16, mapping: &[Mapped]) -> Option<[u8; 8]> {
        let core = &mut *self.core;
        if number == 1 {
            let report = PoseReport {
                yaw: core.pose.yaw,
                pitch: core.pose.pitch,
                roll: core.pose.roll,
                state: core.machine.state(),
                counter: core.pose_counter,
            };
            core.pose_counter = core.pose_counter.next();
            core.pose_bytes = report.to_bytes(cob_id);
        }
        if mapping == pdo::POSE {
            Some(core.pose_bytes)
        } else if mapping == pdo::EFFORT {
            Some(core.effort.to_bytes())
        } else {
            None
        }
    }

    fn open_domain(&mut self, index: u16, subindex: u8) -> Result<u32, Abort> {
        let records = &mut *self.records;
        match Stream::find(index, subindex)? {
            Stream::Sheet => records.open_sheet(),
            Stream::Freeze => {
                let frame = self.core.freeze.ok_or(Abort::NoData)?;
                records.frozen = frame.to_bytes();
                Ok(records.frozen.len() as u32)
            }
            Stream::Scope => Ok(records.scope.open()),
            Stream::Link => Ok(records.link.open()),
        }
    }

    fn read_domain(
        &mut self,
        index: u16,
        subindex: u8,
        offset: u32,
        out: &mut [u8],
    ) -> Result<usize, Abort> {
        let records = &mut *self.records;
        match Stream::find(index, subindex)? {
            Stream::Sheet => records.read_sheet(offset, out),
            Stream::Freeze => Ok(records.read_frozen(offset, out)),
            Stream::Scope => Ok(records.scope.read(offset, out)),
            Stream::Link => Ok(records.link.read(offset, out)),
        }
    }

    fn begin_domain(&mut self, index: u16, subindex: u8, _: Option<u32>) -> Result<(), Abort> {
        Stream::find_writable(index, subindex)?;
        self.records.link.begin();
        Ok(())
    }

    fn write_domain(&mut self, index: u16, subindex: u8, _: u32, data: &[u8]) -> Result<(), Abort> {
        Stream::find_writable(index, subindex)?;
        self.records.link.write(data);
        Ok(())
    }

    fn end_domain(&mut self, index: u16, subindex: u8, length: Option<u32>) -> Result<(), Abort> {
        Stream::find_writable(index, subindex)?;
        self.records.link.end(length.is_some());
        Ok(())
    }

    fn may_configure(&self) -> Result<(), Abort> {
        if self.core.machine.may_carry_current(self.core.now) {
            return Err(Abort::DeviceState);
        }
        Ok(())
    }
}
