//! A candump recording as a bus that can only be read.

use std::fs::File;
use std::io::{BufRead, BufReader, stdin};
use std::time::Duration;

use eel_protocol::Frame;

use crate::bus::{Bus, Content, Received};
use crate::candump::{self, Line};
use crate::error::BusError;

/// Bytes read at once.
const BUFFER: usize = 1 << 18;

/// A recording, from a file or from standard input.
pub struct FileBus {
    path: String,
    reader: Box<dyn BufRead + Send>,
    text: Vec<u8>,
    line: u64,
    flexible: u64,
}

impl FileBus {
    /// Opens a candump file.
    ///
    /// # Errors
    /// [`BusError::File`] where the system can't open it.
    pub fn open(path: &str) -> Result<Self, BusError> {
        let file = File::open(path).map_err(|source| BusError::File {
            path: path.to_owned(),
            source,
        })?;
        Ok(Self::new(
            path,
            Box::new(BufReader::with_capacity(BUFFER, file)),
        ))
    }

    /// Reads a recording from standard input; [`Bus::receive`] then waits for a whole line.
    pub fn standard_input() -> Self {
        Self::new("-", Box::new(BufReader::with_capacity(BUFFER, stdin())))
    }

    /// Reads a recording from `reader`; `name` stands for it in errors.
    pub fn new(name: &str, reader: Box<dyn BufRead + Send>) -> Self {
        Self {
            path: name.to_owned(),
            reader,
            text: Vec::new(),
            line: 0,
            flexible: 0,
        }
    }

    /// Returns the number of CAN FD frames passed over so far, which a classic bus can't carry.
    pub const fn flexible_frames(&self) -> u64 {
        self.flexible
    }
}

impl Bus for FileBus {
    fn send(&mut self, _frame: &Frame) -> Result<(), BusError> {
        Err(BusError::ReadOnly)
    }

    fn receive(&mut self, _timeout: Duration) -> Result<Option<Received>, BusError> {
        loop {
            self.text.clear();
            let read = self
                .reader
                .read_until(b'\n', &mut self.text)
                .map_err(|source| BusError::File {
                    path: self.path.clone(),
                    source,
                })?;
            if read == 0 {
                return Err(BusError::Ended);
            }
            self.line += 1;
            if self.text.trim_ascii().is_empty() {
                continue;
            }
            let (time_ns, direction, content) = match candump::parse_line(&self.text) {
                Ok(Line::Frame(record)) => (
                    record.time_ns,
                    record.direction,
                    Content::Frame(record.frame),
                ),
                Ok(Line::Error(record)) => (
                    record.time_ns,
                    record.direction,
                    Content::Error(record.frame),
                ),
                Ok(Line::Flexible(_)) => {
                    self.flexible += 1;
                    continue;
                }
                Err(source) => {
                    let (path, line) = (self.path.clone(), self.line);
                    return Err(BusError::Line { path, line, source });
                }
            };
            return Ok(Some(Received {
                time_ns,
                content,
                direction,
            }));
        }
    }
}
