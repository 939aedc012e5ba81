//! The CAN frame as a value.

use embedded_can::{ExtendedId, StandardId};

pub use embedded_can::Id;

/// A CAN frame with room for `N` bytes: 8 on the classic bus, 64 for CAN FD.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<const N: usize = 8> {
    id: Id,
    remote: bool,
    length: u8,
    data: [u8; N],
}

impl<const N: usize> Frame<N> {
    /// Makes a data frame; `None` when `data` has more than `N` bytes.
    pub fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        let mut bytes = [0; N];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Self {
            id: id.into(),
            remote: false,
            length: data.len() as u8,
            data: bytes,
        })
    }

    /// Makes a data frame with an 11-bit identifier, of which the higher bits of `cob_id` are cut.
    pub fn standard(cob_id: u16, data: &[u8]) -> Option<Self> {
        Self::new(StandardId::new(cob_id & 0x7FF)?, data)
    }

    /// Makes a data frame of the first `length` bytes; the others must be 0. It is [`standard`](Self::standard)
    /// without a copy of unknown length, which costs more than all the rest.
    pub(crate) fn from_bytes(cob_id: u16, data: [u8; N], length: u8) -> Option<Self> {
        if usize::from(length) > N {
            return None;
        }
        Some(Self {
            id: Id::Standard(StandardId::new(cob_id & 0x7FF)?),
            remote: false,
            length,
            data,
        })
    }

    /// Makes a remote frame that asks for `length` bytes; `None` above `N`.
    pub fn remote(id: impl Into<Id>, length: u8) -> Option<Self> {
        if usize::from(length) > N {
            return None;
        }
        Some(Self {
            id: id.into(),
            remote: true,
            length,
            data: [0; N],
        })
    }

    /// Returns the identifier.
    #[inline]
    pub const fn id(&self) -> Id {
        self.id
    }

    /// Returns the 11-bit identifier of a standard frame.
    #[inline]
    pub fn cob_id(&self) -> Option<u16> {
        match self.id {
            Id::Standard(id) => Some(id.as_raw()),
            Id::Extended(_) => None,
        }
    }

    /// Returns the identifier's number, 11 or 29 bits.
    pub fn raw_id(&self) -> u32 {
        match self.id {
            Id::Standard(id) => u32::from(StandardId::as_raw(&id)),
            Id::Extended(id) => ExtendedId::as_raw(&id),
        }
    }

    /// Tells whether the identifier has 29 bits.
    pub const fn is_extended(&self) -> bool {
        matches!(self.id, Id::Extended(_))
    }

    /// Tells whether the frame asks for data and carries none.
    #[inline]
    pub const fn is_remote(&self) -> bool {
        self.remote
    }

    /// Returns the number of bytes that the frame carries, or asks for.
    #[inline]
    pub const fn length(&self) -> u8 {
        self.length
    }

    /// Returns the bytes; none of a remote frame.
    #[inline]
    pub fn data(&self) -> &[u8] {
        if self.remote {
            &[]
        } else {
            self.data.get(..usize::from(self.length)).unwrap_or(&[])
        }
    }
}

impl embedded_can::Frame for Frame<8> {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        Self::new(id, data)
    }

    fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Self> {
        Self::remote(id, u8::try_from(dlc).ok()?)
    }

    fn is_extended(&self) -> bool {
        self.is_extended()
    }

    fn is_remote_frame(&self) -> bool {
        self.remote
    }

    fn id(&self) -> Id {
        self.id
    }

    fn dlc(&self) -> usize {
        usize::from(self.length)
    }

    fn data(&self) -> &[u8] {
        self.data()
    }
}
