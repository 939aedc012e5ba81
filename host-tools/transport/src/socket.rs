//! A Linux CAN interface.

use std::io;
use std::time::Duration;

use eel_protocol::Frame;
use embedded_can::Frame as _;
use socketcan::{CanFrame, CanSocket, Socket, SocketOptions};

use crate::bus::{Bus, Content, ErrorFrame, Received};
use crate::error::BusError;
use crate::memory::{now_ns, to_ns};

/// `ENODEV` of Linux: no such interface.
const NO_DEVICE: i32 = 19;
/// `ENETDOWN` of Linux: the interface is down.
const NETWORK_DOWN: i32 = 100;
/// `ENOBUFS` of Linux: the interface's transmit queue is full.
const NO_BUFFERS: i32 = 105;

/// A raw CAN socket on one interface, with the kernel's time of reception.
#[derive(Debug)]
pub struct SocketBus {
    name: String,
    socket: CanSocket,
    timeout: Option<Duration>,
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
        socket.set_recv_timestamp(true).map_err(BusError::Io)?;
        socket.set_error_filter_accept_all().map_err(BusError::Io)?;
        Ok(Self {
            name: name.to_owned(),
            socket,
            timeout: None,
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
        let (raw, stamps) = match self.socket.read_frame_with_timestamps() {
            Ok(read) => read,
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::WouldBlock
                        | io::ErrorKind::TimedOut
                        | io::ErrorKind::Interrupted
                ) =>
            {
                return Ok(None);
            }
            Err(error) => return Err(self.failure(error)),
        };
        let time_ns = stamps.socket.map_or_else(now_ns, to_ns);
        let content = match raw {
            CanFrame::Data(data) => Frame::new(data.id(), data.data()).map(Content::Frame),
            CanFrame::Remote(remote) => {
                Frame::remote(remote.id(), remote.dlc() as u8).map(Content::Frame)
            }
            CanFrame::Error(error) => {
                let mut data = [0; 8];
                data.iter_mut()
                    .zip(error.data())
                    .for_each(|(to, from)| *to = *from);
                Some(Content::Error(ErrorFrame {
                    classes: error.error_bits(),
                    data,
                }))
            }
        };
        Ok(content.map(|content| Received {
            time_ns,
            content,
            direction: None,
        }))
    }
}
