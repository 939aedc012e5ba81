//! What a node serves beside its communication area.

use crate::config::Mapped;

/// Why an object can't be read or written: the SDO abort codes of CiA 301, 7.2.4.3.17.
// As wide as a length, so that a result of either fits two registers; the codes themselves would each take two
// instructions more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Abort {
    /// The toggle bit did not alternate.
    ToggleBit,
    /// The other side fell silent.
    Timeout,
    /// The command specifier is unknown.
    Command,
    /// The block size is out of range.
    BlockSize,
    /// The sequence number is out of range.
    SequenceNumber,
    /// The CRC is wrong.
    Crc,
    /// The transfer is larger than the memory for it.
    OutOfMemory,
    /// The object can't be accessed this way.
    UnsupportedAccess,
    /// The object can only be written.
    WriteOnly,
    /// The object can only be read.
    ReadOnly,
    /// There is no such object.
    NoObject,
    /// The object can't be mapped to the PDO.
    NotMappable,
    /// The mapped objects would not fit the PDO.
    PdoLength,
    /// The parameter is incompatible.
    Incompatible,
    /// The hardware failed.
    Hardware,
    /// The length does not match the object's type.
    Length,
    /// The data is longer than the object.
    TooLong,
    /// The data is shorter than the object.
    TooShort,
    /// There is no such subindex.
    NoSubindex,
    /// The value is not allowed.
    Value,
    /// The value is too high.
    ValueTooHigh,
    /// The value is too low.
    ValueTooLow,
    /// A reason that has no code of its own.
    General,
    /// The data can't be stored or transferred.
    Transfer,
    /// The device is under local control.
    LocalControl,
    /// The device's state forbids it.
    DeviceState,
    /// There is no data.
    NoData,
}

impl Abort {
    /// Returns the code that goes over the wire.
    #[inline(never)] // One copy in flash.
    pub const fn code(self) -> u32 {
        match self {
            Self::ToggleBit => 0x0503_0000,
            Self::Timeout => 0x0504_0000,
            Self::Command => 0x0504_0001,
            Self::BlockSize => 0x0504_0002,
            Self::SequenceNumber => 0x0504_0003,
            Self::Crc => 0x0504_0004,
            Self::OutOfMemory => 0x0504_0005,
            Self::UnsupportedAccess => 0x0601_0000,
            Self::WriteOnly => 0x0601_0001,
            Self::ReadOnly => 0x0601_0002,
            Self::NoObject => 0x0602_0000,
            Self::NotMappable => 0x0604_0041,
            Self::PdoLength => 0x0604_0042,
            Self::Incompatible => 0x0604_0043,
            Self::Hardware => 0x0606_0000,
            Self::Length => 0x0607_0010,
            Self::TooLong => 0x0607_0012,
            Self::TooShort => 0x0607_0013,
            Self::NoSubindex => 0x0609_0011,
            Self::Value => 0x0609_0030,
            Self::ValueTooHigh => 0x0609_0031,
            Self::ValueTooLow => 0x0609_0032,
            Self::General => 0x0800_0000,
            Self::Transfer => 0x0800_0020,
            Self::LocalControl => 0x0800_0021,
            Self::DeviceState => 0x0800_0022,
            Self::NoData => 0x0800_0024,
        }
    }
}

/// Who may do what with an object, seen from the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Read and never changed.
    Constant,
    /// Read.
    ReadOnly,
    /// Written.
    WriteOnly,
    /// Read and written.
    ReadWrite,
}

/// What the node must know of an application's object before it touches it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its length in bytes; 0 where the length varies.
    pub length: u8,
    /// Whether it is a domain, which streams and is never held whole in memory; `length` is then 0.
    pub domain: bool,
    /// Who may read and write it.
    pub access: Access,
    /// Whether a TPDO may carry it.
    pub tpdo: bool,
    /// Whether an RPDO may carry it.
    pub rpdo: bool,
}

/// The objects outside 0x1000–0x1FFF, and what happens around a PDO.
///
/// The EDS (0x1021 and 0x1022) and what belongs to programs (0x1F50–0x1F5F) are the application's too.
/// A domain is read or written by one SDO transfer at a time, in order and without gaps.
pub trait Application {
    /// Describes an object.
    ///
    /// # Errors
    /// [`Abort::NoObject`] or [`Abort::NoSubindex`].
    fn entry(&self, index: u16, subindex: u8) -> Result<Entry, Abort>;

    /// Copies an object's bytes, little-endian, to the start of `out` and returns how many.
    ///
    /// # Errors
    /// The abort code to answer with; [`Abort::OutOfMemory`] when `out` is too small.
    fn read(&self, index: u16, subindex: u8, out: &mut [u8]) -> Result<usize, Abort>;

    /// Writes an object from little-endian bytes.
    ///
    /// # Errors
    /// The abort code to answer with; the object is then unchanged.
    fn write(&mut self, index: u16, subindex: u8, data: &[u8]) -> Result<(), Abort>;

    /// Takes the frame of an RPDO with this mapping as a whole, where it knows how, and tells whether it
    /// did; else each object is written.
    fn take_rpdo(&mut self, mapping: &[Mapped], data: &[u8; 8]) -> bool {
        let _ = (mapping, data);
        false
    }

    /// Hears that every object mapped to RPDO `number` (1–4) has just been written from a frame
    /// with identifier `cob_id`.
    fn rpdo_applied(&mut self, number: u8, cob_id: u16);

    /// Hears that SYNC came: after its RPDOs were applied, before its TPDOs are read. `counter` is
    /// what SYNC carried, if anything. Comes in Pre-operational too.
    fn synchronised(&mut self, counter: Option<u8>) {
        let _ = counter;
    }

    /// Hears that TPDO `number` (1–4) is about to be read and sent as `cob_id`, so that its
    /// objects can be brought up to date. May return the frame's bytes where it has those of this
    /// mapping ready; else each object is read.
    fn tpdo_due(&mut self, number: u8, cob_id: u16, mapping: &[Mapped]) -> Option<[u8; 8]> {
        let _ = (number, cob_id, mapping);
        None
    }

    /// Opens a domain to be read from its start and returns its length in bytes. What is then read
    /// does not change until it is opened again.
    ///
    /// # Errors
    /// The abort code to answer with.
    fn open_domain(&mut self, index: u16, subindex: u8) -> Result<u32, Abort> {
        let _ = (index, subindex);
        Err(Abort::NoData)
    }

    /// Copies the open domain's bytes from `offset` on to `out` and returns how many: as many as
    /// fit, and fewer only at the end. Each call goes on where the one before ended.
    ///
    /// # Errors
    /// The abort code that ends the transfer.
    fn read_domain(
        &mut self,
        index: u16,
        subindex: u8,
        offset: u32,
        out: &mut [u8],
    ) -> Result<usize, Abort> {
        let _ = (index, subindex, offset, out);
        Err(Abort::NoData)
    }

    /// Begins to write a domain, of `length` bytes where the client said so.
    ///
    /// # Errors
    /// The abort code to answer with.
    fn begin_domain(&mut self, index: u16, subindex: u8, length: Option<u32>) -> Result<(), Abort> {
        let _ = (index, subindex, length);
        Err(Abort::ReadOnly)
    }

    /// Takes the next bytes of the domain that is being written; `offset` is how many came before.
    ///
    /// # Errors
    /// The abort code that ends the transfer.
    fn write_domain(
        &mut self,
        index: u16,
        subindex: u8,
        offset: u32,
        data: &[u8],
    ) -> Result<(), Abort> {
        let _ = (index, subindex, offset, data);
        Err(Abort::ReadOnly)
    }

    /// Ends the writing of a domain: `length` bytes have come and every check of the transfer held,
    /// or `None`: it was broken off, and what came is void.
    ///
    /// # Errors
    /// The abort code to answer a complete transfer with.
    fn end_domain(&mut self, index: u16, subindex: u8, length: Option<u32>) -> Result<(), Abort> {
        let _ = (index, subindex, length);
        Ok(())
    }

    /// Tells whether parameters of the communication area (0x1000–0x1FFF, but for the history of
    /// errors) may be written now, and parameters and the node id stored or restored.
    ///
    /// # Errors
    /// The abort code to answer with, such as [`Abort::DeviceState`].
    fn may_configure(&self) -> Result<(), Abort> {
        Ok(())
    }
}
