//! A Linux CAN interface.

use std::io::{self, IoSliceMut};
use std::os::fd::AsRawFd;
use std::time::Duration;

use eel_protocol::{Frame, Id};
use embedded_can::{ExtendedId, Frame as _, StandardId};
use nix::sys::socket::{ControlMessageOwned, MsgFlags, recvmsg, setsockopt, sockopt};
use socketcan::{CanFrame, CanSocket, Socket, SocketOptions};

use crate::bus::{Bus, Content, ErrorFrame, Received};
use crate::error::BusError;
use crate::memory::now_ns;

/// `ENODEV` of Linux: no such interface.
const NO_DEVICE: i32 = 19;
/// `ENETDOWN` of Linux: the interface is down.
const NETWORK_DOWN: i32 = 100;
/// `ENOBUFS` of Linux: the interface's transmit queue is full.
const NO_BUFFERS: i32 = 105;

/// Length of Linux's `struct can_frame`.
const CLASSIC_FRAME: usize = 16;
/// Marks a 29-bit identifier.
const EXTENDED_FLAG: u32 = 1 << 31;
/// Marks a remote frame.
const REMOTE_FLAG: u32 = 1 << 30;
/// Marks an error report.
const ERROR_FLAG: u32 = 1 << 29;
/// The bits of a 29-bit identifier, and of an error report's classes.
const EXTENDED_MASK: u32 = 0x1FFF_FFFF;
/// The bits of an 11-bit identifier.
const STANDARD_MASK: u32 = 0x7FF;
/// Bytes that the kernel shall keep for us; it takes as much of it as its own limit allows.
const RECEIVE_BUFFER: usize = 4 << 20;

/// A raw CAN socket on one interface, with the kernel's time of reception and its count of frames
/// that found our queue full.
#[derive(Debug)]
pub struct SocketBus {
    name: String,
    socket: CanSocket,
    timeout: Option<Duration>,
    control: Vec<u8>,
    drops: u32,
    dropped: u64,
}

impl SocketBus {
    /// Opens an interface such as `vcan0` or `can0`.
    ///
    /// # Errors
    /// [`BusError::NoInterface`] or [`BusError::NoSocketCan`], which say what to do.
    pub fn open(name: &str) -> Result<Self, BusError> {
        let socket = CanSocket::open(name).map_err(|source| match source.raw_os_error() {
            Some(NO_DEVICE) => BusError::NoInterface {
                name: name.to_owned(),
            },
            _ => BusError::NoSocketCan {
                name: name.to_owned(),
                source,
            },
        })?;
        socket.set_error_filter_accept_all().map_err(BusError::Io)?;
        let failed = |error: nix::Error| BusError::Io(error.into());
        setsockopt(&socket, sockopt::ReceiveTimestampns, &true).map_err(failed)?;
        setsockopt(&socket, sockopt::RxqOvfl, &1).map_err(failed)?;
        setsockopt(&socket, sockopt::RcvBuf, &RECEIVE_BUFFER).map_err(failed)?;
        Ok(Self {
            name: name.to_owned(),
            socket,
            timeout: None,
            control: nix::cmsg_space!(nix::sys::time::TimeSpec, u32),
            drops: 0,
            dropped: 0,
        })
    }

    fn set_timeout(&mut self, timeout: Duration) -> io::Result<()> {
        if self.timeout == Some(timeout) {
            return Ok(());
        }
        if timeout.is_zero() {
            self.socket.set_nonblocking(true)?;
        } else {
            self.socket.set_nonblocking(false)?;
            // The system counts in microseconds, and takes zero as for ever.
            self.socket
                .set_read_timeout(timeout.max(Duration::from_micros(1)))?;
        }
        self.timeout = Some(timeout);
        Ok(())
    }

    /// Reads one frame with its time, and brings the count of dropped frames up to date.
    fn read(&mut self) -> nix::Result<([u8; CLASSIC_FRAME], u64)> {
        let mut raw = [0; CLASSIC_FRAME];
        let mut slices = [IoSliceMut::new(&mut raw)];
        let (mut stamp, mut drops) = (None, self.drops);
        let message = recvmsg::<()>(
            self.socket.as_raw_fd(),
            &mut slices,
            Some(&mut self.control),
            MsgFlags::empty(),
        )?;
        for control in message.cmsgs()? {
            match control {
                ControlMessageOwned::ScmTimestampns(time) => {
                    let nanoseconds = time.tv_sec() as u64 * 1_000_000_000 + time.tv_nsec() as u64;
                    stamp = Some(nanoseconds);
                }
                ControlMessageOwned::RxqOvfl(count) => drops = count,
                _ => {}
            }
        }
        // The kernel's counter has 32 bits and wraps.
        self.dropped += u64::from(drops.wrapping_sub(self.drops));
        self.drops = drops;
        Ok((raw, stamp.unwrap_or_else(now_ns)))
    }

    fn failure(&self, error: io::Error) -> BusError {
        match error.raw_os_error() {
            Some(NETWORK_DOWN) => BusError::InterfaceDown {
                name: self.name.clone(),
            },
            Some(NO_DEVICE) => BusError::NoInterface {
                name: self.name.clone(),
            },
            Some(NO_BUFFERS) => BusError::Full,
            _ if error.kind() == io::ErrorKind::WouldBlock => BusError::Full,
            _ => BusError::Io(error),
        }
    }
}

impl Bus for SocketBus {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let raw = if frame.is_remote() {
            CanFrame::new_remote(frame.id(), usize::from(frame.length()))
        } else {
            CanFrame::new(frame.id(), frame.data())
        };
        let Some(raw) = raw else {
            return Err(BusError::Io(io::ErrorKind::InvalidInput.into()));
        };
        self.socket
            .write_frame(&raw)
            .map_err(|error| self.failure(error))
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Received>, BusError> {
        self.set_timeout(timeout).map_err(BusError::Io)?;
        let (raw, time_ns) = match self.read() {
            Ok(read) => read,
            Err(nix::Error::EAGAIN | nix::Error::ETIMEDOUT | nix::Error::EINTR) => return Ok(None),
            Err(error) => return Err(self.failure(error.into())),
        };
        let content = content(raw);
        Ok(content.map(|content| Received {
            time_ns,
            content,
            direction: None,
        }))
    }

    fn dropped(&self) -> u64 {
        self.dropped
    }
}

/// Reads Linux's `struct can_frame`: identifier with flags, length, three bytes to skip, data.
fn content([a, b, c, d, length, _, _, _, data @ ..]: [u8; CLASSIC_FRAME]) -> Option<Content> {
    let word = u32::from_ne_bytes([a, b, c, d]);
    if word & ERROR_FLAG != 0 {
        let classes = word & EXTENDED_MASK;
        return Some(Content::Error(ErrorFrame { classes, data }));
    }
    let id: Id = if word & EXTENDED_FLAG != 0 {
        ExtendedId::new(word & EXTENDED_MASK)?.into()
    } else {
        StandardId::new((word & STANDARD_MASK) as u16)?.into()
    };
    let frame = if word & REMOTE_FLAG != 0 {
        Frame::remote(id, length)
    } else {
        Frame::new(id, data.get(..usize::from(length))?)
    };
    frame.map(Content::Frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raw(word: u32, length: u8) -> [u8; CLASSIC_FRAME] {
        let [a, b, c, d] = word.to_ne_bytes();
        [a, b, c, d, length, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8]
    }

    #[test]
    fn reads_the_kernel_s_frames() {
        let frame = Frame::standard(0x7FF, &[1, 2, 3]).unwrap();
        assert_eq!(content(raw(0x7FF, 3)), Some(Content::Frame(frame)));
        let long = ExtendedId::new(0x1234_5678).unwrap();
        let frame = Frame::new(long, &[]).unwrap();
        assert_eq!(content(raw(0x9234_5678, 0)), Some(Content::Frame(frame)));
        let frame = Frame::remote(StandardId::new(1).unwrap(), 8).unwrap();
        assert_eq!(content(raw(0x4000_0001, 8)), Some(Content::Frame(frame)));
        let error = ErrorFrame {
            classes: 0x88,
            data: [1, 2, 3, 4, 5, 6, 7, 8],
        };
        assert_eq!(content(raw(0x2000_0088, 8)), Some(Content::Error(error)));
        assert_eq!(content(raw(0x7FF, 9)), None);
    }
}
