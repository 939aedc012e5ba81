//! A bus that frames go into and come out of, whatever it is made of.

use std::path::Path;
use std::time::Duration;

use eel_protocol::Frame;

use crate::candump::Direction;
use crate::error::BusError;
use crate::file::FileBus;

/// Something that carries classic CAN frames.
pub trait Bus {
    /// Sends a frame, or hands it to the system to be sent.
    ///
    /// # Errors
    /// [`BusError::Full`] where the frame was not taken and may be sent again, [`BusError::ReadOnly`]
    /// on a recording, [`BusError::Ended`] when nobody is left, and what the system says.
    fn send(&mut self, frame: &Frame) -> Result<(), BusError>;

    /// Waits for the next frame, at most `timeout`; `None` where none came in time.
    ///
    /// A zero `timeout` asks without waiting. A file answers at once whatever the timeout.
    ///
    /// # Errors
    /// [`BusError::Ended`] once no frame can come any more, [`BusError::Line`] for a line of a file
    /// that can't be read (the next call goes on with the next line), and what the system says.
    fn receive(&mut self, timeout: Duration) -> Result<Option<Received>, BusError>;

    /// Returns how many frames the system has dropped because they were not received in time; it
    /// is brought up to date by the next frame that arrives.
    fn dropped(&self) -> u64 {
        0
    }
}

impl<B: Bus + ?Sized> Bus for Box<B> {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        (**self).send(frame)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Received>, BusError> {
        (**self).receive(timeout)
    }

    fn dropped(&self) -> u64 {
        (**self).dropped()
    }
}

/// What came from a bus, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// Nanoseconds since 1970 of a live interface, or whatever the recording counts from.
    pub time_ns: u64,
    /// What came.
    pub content: Content,
    /// Whether the recording machine received or sent it, where a recording says so.
    pub direction: Option<Direction>,
}

impl Received {
    /// Returns the frame, unless it was a report of an error.
    pub const fn frame(&self) -> Option<&Frame> {
        match &self.content {
            Content::Frame(frame) => Some(frame),
            Content::Error(_) => None,
        }
    }
}

/// A frame, or the controller's report of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A data or remote frame.
    Frame(Frame),
    /// A report of Linux about the bus, which is no frame on the wire.
    Error(ErrorFrame),
}

/// An error report as Linux gives it (`linux/can/error.h`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorFrame {
    /// The classes of error, one bit each, 29 bits.
    pub classes: u32,
    /// The details.
    pub data: [u8; 8],
}

/// Opens the bus that `url` names: `vcan0` or `can0` (SocketCAN, Linux only), a candump file
/// (what has a dot or a slash in it, or is a file), or `-` for a recording on standard input.
///
/// # Errors
/// An error that says what to do: no such interface, no such file, or a kind of bus that is not
/// there (`tcp://`).
pub fn open(url: &str) -> Result<Box<dyn Bus + Send>, BusError> {
    if url == "-" {
        return Ok(Box::new(FileBus::standard_input()));
    }
    if url.contains("://") {
        return Err(BusError::Unsupported {
            url: url.to_owned(),
            reason: "buses over TCP are not built in yet; name an interface (vcan0, can0), a \
                     candump file or - for standard input",
        });
    }
    if url.contains(['.', '/', '\\']) || Path::new(url).is_file() {
        return Ok(Box::new(FileBus::open(url)?));
    }
    open_interface(url)
}

#[cfg(target_os = "linux")]
fn open_interface(name: &str) -> Result<Box<dyn Bus + Send>, BusError> {
    Ok(Box::new(crate::socket::SocketBus::open(name)?))
}

#[cfg(not(target_os = "linux"))]
fn open_interface(name: &str) -> Result<Box<dyn Bus + Send>, BusError> {
    Err(BusError::Unsupported {
        url: name.to_owned(),
        reason: "CAN interfaces need Linux; name a candump file or - for standard input",
    })
}
