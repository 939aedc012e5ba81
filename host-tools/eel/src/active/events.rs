//! The head's events in words and as JSON.

use std::fmt;
use std::time::Duration;

use eel_head::Event;
use eel_protocol::emergency::{self, Severity};
use serde_json::json;

/// Vertebrae as a list, `vertebrae 1-3, 7`; the head for none.
pub struct Who<'a>(pub &'a [u8]);

impl fmt::Display for Who<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            [] => return write!(out, "head"),
            [one] => return write!(out, "vertebra {one}"),
            _ => write!(out, "vertebrae")?,
        }
        let mut rest = self.0;
        let mut lead = ' ';
        while let [first, others @ ..] = rest {
            let follows = (1..)
                .zip(others)
                .take_while(|(step, node)| **node == first + step);
            let run = follows.count();
            write!(out, "{lead}{first}")?;
            if run > 0 {
                write!(out, "-{}", first + run as u8)?;
            }
            lead = ',';
            rest = others.get(run..).unwrap_or(&[]);
        }
        Ok(())
    }
}

/// Tells whether an event is one of a run that went wrong.
pub fn is_trouble(event: &Event) -> bool {
    match event {
        Event::Lost(_) | Event::Latched(..) | Event::NotStopped(_) => true,
        Event::Emergency(_, report) => {
            emergency::from_code(report.code).is_none_or(|known| known.severity == Severity::Fault)
        }
        Event::Booted(_) | Event::Running(_) | Event::GaitStarted | Event::Stopped => false,
    }
}

/// Returns whose event it is, and the event in words.
pub fn words(event: &Event, acknowledged: bool) -> (Option<u8>, String) {
    let (node, text) = match event {
        Event::Booted(node) => (node, "on the bus".to_owned()),
        Event::Running(node) => (node, "runs".to_owned()),
        Event::Lost(node) => (node, "fell silent: check its supply and cable".to_owned()),
        Event::Latched(node, state) if acknowledged => (
            node,
            format!("was latched ({}), acknowledged", state.name()),
        ),
        Event::Latched(node, state) => (
            node,
            format!(
                "latched ({}): find the cause, then start the head with --reset",
                state.name()
            ),
        ),
        Event::Emergency(node, report) => {
            let text = match emergency::from_code(report.code) {
                Some(known) if known.severity == Severity::Cleared => {
                    format!("{}: {}", known.name, known.sentence)
                }
                Some(known) => format!(
                    "{} {}: {}",
                    known.severity.name(),
                    known.name,
                    known.sentence
                ),
                None => format!("emergency 0x{:04X}", report.code),
            };
            (node, text)
        }
        Event::GaitStarted => return (None, "the gait begins".to_owned()),
        Event::Stopped => return (None, "all drives are off".to_owned()),
        Event::NotStopped(node) => (node, "was told to switch off and still drives".to_owned()),
    };
    (Some(node.get()), text)
}

/// Returns an event for programs.
pub fn json_of(event: &Event, elapsed: Duration) -> serde_json::Value {
    let mut all = json!({"time_s": elapsed.as_secs_f64()});
    let (name, node) = match event {
        Event::Booted(node) => ("booted", Some(node)),
        Event::Running(node) => ("running", Some(node)),
        Event::Lost(node) => ("lost", Some(node)),
        Event::Latched(node, state) => {
            all["state"] = json!(state.name());
            ("latched", Some(node))
        }
        Event::Emergency(node, report) => {
            all["code"] = json!(report.code);
            if let Some(known) = emergency::from_code(report.code) {
                all["name"] = json!(known.name);
                all["severity"] = json!(known.severity.name());
                all["sentence"] = json!(known.sentence);
            }
            ("emergency", Some(node))
        }
        Event::GaitStarted => ("gait-started", None),
        Event::Stopped => ("stopped", None),
        Event::NotStopped(node) => ("not-stopped", Some(node)),
    };
    all["event"] = json!(name);
    if let Some(node) = node {
        all["node"] = json!(node.get());
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertebrae_are_listed_in_runs() {
        let who = |nodes: &[u8]| Who(nodes).to_string();
        assert_eq!(who(&[]), "head");
        assert_eq!(who(&[3]), "vertebra 3");
        assert_eq!(who(&[1, 2, 3, 7, 9, 10]), "vertebrae 1-3,7,9-10");
        assert_eq!(who(&[2, 1]), "vertebrae 2,1");
    }
}
