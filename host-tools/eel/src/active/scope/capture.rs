//! What the scope captured, in units, with its times.

use std::fmt::Write as _;

use eel_client::Multiplexor;
use eel_protocol::scope::{SCOPE_CHANNELS, ScopeError, ScopeHeader, ScopeState};
use serde_json::json;

use crate::active::Node;
use crate::decode::decimals;
use crate::object::Object;
use crate::value::{Value, physical};

/// A capture.
#[derive(Debug)]
pub struct Capture {
    /// Whose it is.
    pub node: Node,
    /// Time from one sample to the next in ms.
    pub every_ms: u16,
    /// Time of the first sample in µs since power-up.
    pub first_us: u64,
    /// The first sample after the fault.
    pub fault: Option<u16>,
    /// What the scope was doing when it was read.
    pub state: ScopeState,
    /// At least one signal, all of the same positive length.
    pub signals: Vec<Signal>,
}

/// One captured signal.
#[derive(Debug)]
pub struct Signal {
    object: Object,
    /// Its values in its unit.
    pub values: Vec<f64>,
}

impl Capture {
    /// Reads the bytes of object 0x2100:2, which must be of these channels.
    ///
    /// # Errors
    /// Words that say why there is nothing to show, with the cure.
    pub fn of(
        node: Node,
        channels: &[u32; SCOPE_CHANNELS],
        bytes: &[u8],
    ) -> Result<Self, &'static str> {
        let (header, samples) = ScopeHeader::from_bytes(bytes).map_err(|error| match error {
            ScopeError::Version => "its capture is of another version: use the eel of its firmware",
            ScopeError::Length => "its capture is cut or too long: capture again",
            ScopeError::Value => "its capture holds a code without a meaning: use a newer eel",
        })?;
        // A reset forgets the channels.
        if header.channels != *channels {
            return Err(
                "nothing was captured: it was reset, or another program set the scope; capture again",
            );
        }
        if header.samples == 0 {
            return Err(
                "nothing was captured: it was ended before the first sample, or another program read it; \
                 capture again",
            );
        }
        let objects = channels.iter().filter(|raw| **raw != 0).map(|raw| {
            let place = Multiplexor::new((raw >> 16) as u16, (raw >> 8) as u8);
            Object::at(place).ok_or("it captured what eel does not know: use a newer eel")
        });
        let width = header.width();
        let (words, _) = samples.as_chunks::<4>();
        let mut signals = Vec::new();
        for (column, object) in objects.enumerate() {
            let object = object?;
            let words = words.iter().skip(column).step_by(width);
            let values = words.map(|word| match Value::of(&object, word) {
                Value::Number(raw) => physical(&object, raw),
                _ => 0.0,
            });
            let values = values.collect();
            signals.push(Signal { object, values });
        }
        Ok(Self {
            node,
            every_ms: header.divider,
            first_us: header.first_us,
            fault: header.fault,
            state: header.state,
            signals,
        })
    }

    /// Returns how many samples there are.
    pub fn length(&self) -> usize {
        let first = self.signals.first();
        first.map_or(0, |signal| signal.values.len())
    }

    /// Returns the time of a sample in s, from the first one or the first one after the fault.
    pub fn time_s(&self, sample: usize) -> f64 {
        let from_zero = sample as f64 - f64::from(self.fault.unwrap_or(0));
        from_zero * f64::from(self.every_ms) / 1e3
    }

    /// Says whose it is, how much and since when.
    pub fn title(&self) -> String {
        let Self { node, every_ms, .. } = self;
        let length = self.length();
        let first = self.uptime_s(0);
        let fault = match self.fault {
            Some(sample) => format!(", fault at {:.3} s", self.uptime_s(sample.into())),
            None => String::new(),
        };
        format!(
            "{node}: {length} samples every {every_ms} ms from {first:.3} s after power-up{fault}"
        )
    }

    /// Returns the time of a sample in s since power-up.
    fn uptime_s(&self, sample: usize) -> f64 {
        let since_us = sample as u64 * u64::from(self.every_ms) * 1_000;
        self.first_us.saturating_add(since_us) as f64 / 1e6
    }

    /// Returns the capture as a table with a line for each sample.
    pub fn csv(&self) -> String {
        let mut text = String::from("uptime_s,time_s");
        for signal in &self.signals {
            let _ = match signal.unit() {
                "" => write!(text, ",{}", signal.name()),
                unit => write!(text, ",{} [{unit}]", signal.name()),
            };
        }
        text.push('\n');
        for sample in 0..self.length() {
            let (uptime_s, time_s) = (self.uptime_s(sample), self.time_s(sample));
            let _ = write!(text, "{uptime_s:.6},{time_s:.3}");
            for signal in &self.signals {
                let value = signal.values.get(sample).copied().unwrap_or_default();
                let _ = write!(text, ",{}", signal.number(value));
            }
            text.push('\n');
        }
        text
    }

    /// Returns the capture for programs.
    pub fn json(&self) -> serde_json::Value {
        let signals = self.signals.iter().map(|signal| {
            let (min, max) = signal.extent();
            json!({
                "name": signal.name(), "unit": signal.unit(), "min": min, "max": max,
                "values": signal.values,
            })
        });
        let state = match self.state {
            ScopeState::Full => "full",
            _ => "stopped",
        };
        json!({
            "node": self.node.0, "every_ms": self.every_ms, "first_us": self.first_us,
            "fault": self.fault, "state": state, "signals": signals.collect::<Vec<_>>(),
        })
    }
}

impl Signal {
    /// Returns its name.
    pub fn name(&self) -> &str {
        &self.object.name
    }

    /// Returns its unit; empty where there is none.
    pub fn unit(&self) -> &'static str {
        self.object.unit
    }

    /// Returns its least and its greatest value.
    pub fn extent(&self) -> (f64, f64) {
        let values = self.values.iter().copied();
        (
            values.clone().fold(f64::INFINITY, f64::min),
            values.fold(f64::NEG_INFINITY, f64::max),
        )
    }

    /// Writes a value with the decimals that show every step.
    pub fn number(&self, value: f64) -> String {
        let digits = decimals(self.object.scale.denominator);
        format!("{value:.digits$}")
    }
}
