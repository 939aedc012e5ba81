//! The state of a transfer and what each request does to it.

use super::SDO_BUFFER;
use crate::objects::Objects;
use crate::{Abort, Access, Application};

/// Silence of the client after which a transfer is aborted.
const TIMEOUT_US: u64 = 1_000_000;
/// What a segment carries.
const SEGMENT: usize = 7;

/// An object as a transfer names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Multiplexor {
    index: u16,
    subindex: u8,
}

impl Multiplexor {
    /// What an abort names when nothing is being transferred.
    const NONE: Self = Self {
        index: 0,
        subindex: 0,
    };
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Transfer {
    Idle,
    Upload {
        object: Multiplexor,
        length: usize,
        sent: usize,
        toggle: bool,
    },
    Download {
        object: Multiplexor,
        expected: Option<usize>,
        received: usize,
        toggle: bool,
    },
}

/// The server side of one SDO channel.
#[derive(Clone, Debug)]
pub(crate) struct Server {
    transfer: Transfer,
    deadline_us: u64,
    buffer: [u8; SDO_BUFFER],
}

impl Server {
    pub const fn new() -> Self {
        Self {
            transfer: Transfer::Idle,
            deadline_us: 0,
            buffer: [0; SDO_BUFFER],
        }
    }

    /// Forgets a running transfer without a word.
    pub fn reset(&mut self) {
        self.transfer = Transfer::Idle;
    }

    /// Returns when a running transfer times out.
    pub fn deadline_us(&self) -> Option<u64> {
        (self.transfer != Transfer::Idle).then_some(self.deadline_us)
    }

    /// Ends a transfer whose client fell silent, with the message to send about it.
    pub fn expire(&mut self, now_us: u64) -> Option<[u8; 8]> {
        if self
            .deadline_us()
            .is_none_or(|deadline_us| now_us < deadline_us)
        {
            return None;
        }
        Some(self.abort(Abort::Timeout))
    }

    /// Answers a request; `None` when it needs no answer.
    pub fn request<A: Application>(
        &mut self,
        request: [u8; 8],
        objects: &mut Objects<'_, A>,
    ) -> Option<[u8; 8]> {
        let [command, low, high, subindex, data @ ..] = request;
        let object = Multiplexor {
            index: u16::from_le_bytes([low, high]),
            subindex,
        };
        self.deadline_us = objects.now_us.saturating_add(TIMEOUT_US);
        let answer = match command >> 5 {
            0 => self.download_segment(request, objects),
            1 => self.start_download(command, object, data, objects),
            2 => self.start_upload(object, objects),
            3 => self.upload_segment(command),
            4 => {
                self.transfer = Transfer::Idle;
                return None;
            }
            // What the client wants to transfer in blocks names its object like other transfers.
            5 if command & 3 == 0 => self.refuse(object, Abort::Command),
            6 if command & 1 == 0 => self.refuse(object, Abort::Command),
            _ => Err(Abort::Command),
        };
        Some(answer.unwrap_or_else(|abort| self.abort(abort)))
    }

    /// Ends the transfer and makes the message that says why.
    fn abort(&mut self, abort: Abort) -> [u8; 8] {
        let object = match self.transfer {
            Transfer::Idle => Multiplexor::NONE,
            Transfer::Upload { object, .. } | Transfer::Download { object, .. } => object,
        };
        self.transfer = Transfer::Idle;
        message(0x80, object, (abort as u32).to_le_bytes())
    }

    /// Answers a request that starts a transfer with an abort that names its object.
    fn refuse(&mut self, object: Multiplexor, abort: Abort) -> Result<[u8; 8], Abort> {
        self.transfer = Transfer::Idle;
        Ok(message(0x80, object, (abort as u32).to_le_bytes()))
    }

    fn start_upload<A: Application>(
        &mut self,
        object: Multiplexor,
        objects: &Objects<'_, A>,
    ) -> Result<[u8; 8], Abort> {
        let length = match self.fetch(object, objects) {
            Ok(length) => length,
            Err(abort) => return self.refuse(object, abort),
        };
        if let (1..=4, Some(value)) = (length, self.buffer.first_chunk::<4>()) {
            self.transfer = Transfer::Idle;
            let mut data = [0; 4];
            for (slot, byte) in data.iter_mut().zip(value).take(length) {
                *slot = *byte;
            }
            return Ok(message(0x43 | ((4 - length) << 2) as u8, object, data));
        }
        self.transfer = Transfer::Upload {
            object,
            length,
            sent: 0,
            toggle: false,
        };
        Ok(message(0x41, object, (length as u32).to_le_bytes()))
    }

    /// Reads the object into the buffer and returns its length.
    fn fetch<A: Application>(
        &mut self,
        object: Multiplexor,
        objects: &Objects<'_, A>,
    ) -> Result<usize, Abort> {
        let entry = objects.describe(object.index, object.subindex)?;
        if entry.access == Access::WriteOnly {
            return Err(Abort::WriteOnly);
        }
        objects.read(object.index, object.subindex, &mut self.buffer)
    }

    fn upload_segment(&mut self, command: u8) -> Result<[u8; 8], Abort> {
        let Transfer::Upload {
            object,
            length,
            sent,
            toggle,
        } = self.transfer
        else {
            return Err(Abort::Command);
        };
        if (command & 0x10 != 0) != toggle {
            return Err(Abort::ToggleBit);
        }
        let rest = self.buffer.get(sent..length).unwrap_or(&[]);
        let carried = rest.len().min(SEGMENT);
        let last = rest.len() <= SEGMENT;
        let flags = u8::from(toggle) << 4 | ((SEGMENT - carried) << 1) as u8 | u8::from(last);
        let mut answer = [flags, 0, 0, 0, 0, 0, 0, 0];
        for (slot, byte) in answer.iter_mut().skip(1).zip(rest) {
            *slot = *byte;
        }
        self.transfer = if last {
            Transfer::Idle
        } else {
            Transfer::Upload {
                object,
                length,
                sent: sent + carried,
                toggle: !toggle,
            }
        };
        Ok(answer)
    }

    fn start_download<A: Application>(
        &mut self,
        command: u8,
        object: Multiplexor,
        data: [u8; 4],
        objects: &mut Objects<'_, A>,
    ) -> Result<[u8; 8], Abort> {
        self.transfer = Transfer::Idle;
        let expedited = command & 2 != 0;
        let sized = command & 1 != 0;
        let done = if expedited {
            let given = sized.then_some(4 - usize::from(command >> 2 & 3));
            write_expedited(object, data, given, objects)
        } else {
            self.open_download(object, sized.then_some(u32::from_le_bytes(data)), objects)
        };
        match done {
            Ok(()) => Ok(message(0x60, object, [0; 4])),
            Err(abort) => self.refuse(object, abort),
        }
    }

    fn open_download<A: Application>(
        &mut self,
        object: Multiplexor,
        size: Option<u32>,
        objects: &Objects<'_, A>,
    ) -> Result<(), Abort> {
        let fixed = writable_length(object, objects)?;
        let expected = size.map(|size| usize::try_from(size).unwrap_or(usize::MAX));
        if let Some(expected) = expected {
            check_length(expected, fixed)?;
            if expected > SDO_BUFFER {
                return Err(Abort::OutOfMemory);
            }
        }
        let expected = expected.or(fixed);
        self.transfer = Transfer::Download {
            object,
            expected,
            received: 0,
            toggle: false,
        };
        Ok(())
    }

    fn download_segment<A: Application>(
        &mut self,
        request: [u8; 8],
        objects: &mut Objects<'_, A>,
    ) -> Result<[u8; 8], Abort> {
        let Transfer::Download {
            object,
            expected,
            received,
            toggle,
        } = self.transfer
        else {
            return Err(Abort::Command);
        };
        let [command, data @ ..] = request;
        if (command & 0x10 != 0) != toggle {
            return Err(Abort::ToggleBit);
        }
        let carried = SEGMENT - usize::from(command >> 1 & 7);
        let total = received + carried;
        if expected.is_some_and(|expected| total > expected) {
            return Err(Abort::TooLong);
        }
        let slot = self
            .buffer
            .get_mut(received..total)
            .ok_or(Abort::OutOfMemory)?;
        for (slot, byte) in slot.iter_mut().zip(data) {
            *slot = byte;
        }
        if command & 1 == 0 {
            self.transfer = Transfer::Download {
                object,
                expected,
                received: total,
                toggle: !toggle,
            };
        } else {
            if expected.is_some_and(|expected| total < expected) {
                return Err(Abort::TooShort);
            }
            let value = self.buffer.get(..total).unwrap_or(&[]);
            objects.write(object.index, object.subindex, value)?;
            self.transfer = Transfer::Idle;
        }
        Ok([0x20 | u8::from(toggle) << 4, 0, 0, 0, 0, 0, 0, 0])
    }
}

/// Returns the object's length, where it has a fixed one.
fn writable_length<A: Application>(
    object: Multiplexor,
    objects: &Objects<'_, A>,
) -> Result<Option<usize>, Abort> {
    let entry = objects.describe(object.index, object.subindex)?;
    if matches!(entry.access, Access::Constant | Access::ReadOnly) {
        return Err(Abort::ReadOnly);
    }
    Ok((entry.length > 0).then_some(usize::from(entry.length)))
}

fn check_length(given: usize, fixed: Option<usize>) -> Result<(), Abort> {
    match fixed {
        Some(fixed) if given > fixed => Err(Abort::TooLong),
        Some(fixed) if given < fixed => Err(Abort::TooShort),
        _ => Ok(()),
    }
}

fn write_expedited<A: Application>(
    object: Multiplexor,
    data: [u8; 4],
    given: Option<usize>,
    objects: &mut Objects<'_, A>,
) -> Result<(), Abort> {
    let fixed = writable_length(object, objects)?;
    // Without a size, the object's own length says how much of the four bytes is meant.
    let length = given.or(fixed).unwrap_or(4);
    check_length(length, fixed)?;
    let value = data.get(..length).ok_or(Abort::TooShort)?;
    objects.write(object.index, object.subindex, value)
}

fn message(command: u8, object: Multiplexor, data: [u8; 4]) -> [u8; 8] {
    let [low, high] = object.index.to_le_bytes();
    let [a, b, c, d] = data;
    [command, low, high, object.subindex, a, b, c, d]
}
