//! `eel sniff` and `eel decode`: what comes, line by line.

use std::fs::File;
use std::io::{BufWriter, Result, Write};

use eel_transport::candump::{self, Record};
use eel_transport::{Content, Received};

use crate::channels::Channels;
use crate::decode::Decoded;
use crate::filter::Filter;
use crate::json;
use crate::source::Sink;
use crate::stats::Statistics;
use crate::text::{Look, Seen};

/// The form of the lines.
#[derive(Clone, Copy, Debug)]
pub enum Form {
    /// For people.
    Text {
        /// Whether colours are used.
        colour: bool,
        /// Whether identifier and bytes are shown.
        raw: bool,
        /// Whether times are as recorded, not counted from the first frame.
        absolute: bool,
    },
    /// For programs.
    Json,
}

/// Writes lines, a recording, and statistics.
pub struct Listener<W: Write> {
    out: W,
    form: Form,
    filter: Filter,
    channels: Channels,
    origin_ns: Option<u64>,
    recording: Option<Recording>,
    statistics: Option<Statistics>,
    problems: u64,
}

/// A candump file that is being written.
pub struct Recording {
    file: BufWriter<File>,
    interface: String,
    line: Vec<u8>,
}

impl Recording {
    /// Creates the file; `url` names the bus, whose last part becomes the interface's name.
    ///
    /// # Errors
    /// When the file can't be created.
    pub fn create(path: &str, url: &str) -> Result<Self> {
        let name = url.rsplit(['/', '\\']).next().unwrap_or(url);
        let name: String = name
            .chars()
            .filter(char::is_ascii_graphic)
            .take(32)
            .collect();
        let interface = if name.is_empty() || name == "-" {
            "can0".to_owned()
        } else {
            name
        };
        Ok(Self {
            file: BufWriter::new(File::create(path)?),
            interface,
            line: Vec::new(),
        })
    }

    fn write(&mut self, received: &Received) -> Result<()> {
        self.line.clear();
        let Received {
            time_ns, direction, ..
        } = *received;
        match received.content {
            Content::Frame(frame) => {
                let interface = &self.interface;
                let record = Record {
                    time_ns,
                    interface,
                    frame,
                    direction,
                };
                candump::write_line(&mut self.line, &record);
            }
            Content::Error(error) => {
                let (seconds, micros) = (time_ns / 1_000_000_000, time_ns / 1_000 % 1_000_000);
                let id = 0x2000_0000 | error.classes;
                write!(
                    self.line,
                    "({seconds:010}.{micros:06}) {} {id:08X}#",
                    self.interface
                )?;
                error
                    .data
                    .iter()
                    .try_for_each(|byte| write!(self.line, "{byte:02X}"))?;
                self.line.push(b'\n');
            }
        }
        self.file.write_all(&self.line)
    }
}

impl<W: Write> Listener<W> {
    /// Makes a listener that writes to `out`.
    pub fn new(out: W, form: Form, filter: Filter) -> Self {
        Self {
            out,
            form,
            filter,
            channels: Channels::default(),
            origin_ns: None,
            recording: None,
            statistics: None,
            problems: 0,
        }
    }

    /// Records everything, whatever the filter.
    pub fn record(&mut self, recording: Recording) {
        self.recording = Some(recording);
    }

    /// Gathers statistics of everything, whatever the filter.
    pub fn gather(&mut self, statistics: Statistics) {
        self.statistics = Some(statistics);
    }

    /// Returns how many frames were wrong.
    pub const fn problems(&self) -> u64 {
        self.problems
    }

    /// Gives back the statistics.
    pub fn into_statistics(self) -> Option<Statistics> {
        self.statistics
    }

    fn show(&mut self, seen: Seen<'_>) -> Result<()> {
        let origin_ns = *self.origin_ns.get_or_insert(seen.received.time_ns);
        match self.form {
            Form::Text {
                colour,
                raw,
                absolute,
            } => {
                let origin_ns = if absolute { 0 } else { origin_ns };
                let look = Look {
                    colour,
                    raw,
                    origin_ns,
                };
                look.line(&mut self.out, &seen, &self.filter)
            }
            Form::Json => {
                let line = json::Line {
                    seen,
                    filter: &self.filter,
                };
                serde_json::to_writer(&mut self.out, &line)?;
                self.out.write_all(b"\n")
            }
        }
    }
}

impl<W: Write> Sink for Listener<W> {
    fn take(&mut self, received: &Received) -> Result<()> {
        if let Some(recording) = &mut self.recording {
            recording.write(received)?;
        }
        if let Some(statistics) = &mut self.statistics {
            statistics.add(received);
        }
        self.origin_ns.get_or_insert(received.time_ns);
        let mut is_segment = false;
        let is_shown = match &received.content {
            Content::Frame(frame) => {
                is_segment = self.channels.is_segment(frame);
                let decoded = Decoded::of(frame);
                self.problems += u64::from(decoded.problem.is_some());
                self.filter.passes(&decoded)
            }
            Content::Error(_) => {
                self.problems += 1;
                self.filter.is_empty()
            }
        };
        if is_shown {
            self.show(Seen {
                received,
                is_segment,
            })
        } else {
            Ok(())
        }
    }

    fn idle(&mut self) -> Result<()> {
        self.out.flush()?;
        self.recording
            .as_mut()
            .map_or(Ok(()), |recording| recording.file.flush())
    }
}
