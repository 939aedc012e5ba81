//! A peer for tests that expects certain frames and answers with certain others.

use std::collections::VecDeque;
use std::time::Duration;

use eel_protocol::Frame;
use eel_transport::{Bus, BusError, Content, Received};

use crate::client::{Client, Settings};

/// An identifier and bytes.
pub type Raw<'a> = (u16, &'a [u8]);

/// Frames that must be sent in this order, each with what comes back.
#[derive(Debug, Default)]
pub struct Script {
    steps: VecDeque<(Frame, Vec<Frame>)>,
    coming: VecDeque<Frame>,
}

fn make((id, data): Raw<'_>) -> Frame {
    Frame::standard(id, data).expect("at most eight bytes")
}

impl Script {
    pub fn new<'a>(steps: impl IntoIterator<Item = (Raw<'a>, &'a [Raw<'a>])>) -> Self {
        let mut script = Self::default();
        for (request, answers) in steps {
            script.add(request, answers);
        }
        script
    }

    /// Adds a frame that must be sent next, and what comes back.
    pub fn add(&mut self, request: Raw<'_>, answers: &[Raw<'_>]) {
        let answers = answers.iter().map(|raw| make(*raw)).collect();
        self.steps.push_back((make(request), answers));
    }

    /// Fails unless everything was sent.
    pub fn finish(self) {
        assert!(self.steps.is_empty(), "never sent: {:02X?}", self.steps);
    }
}

impl Bus for Script {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let (expected, answers) = self
            .steps
            .pop_front()
            .unwrap_or_else(|| panic!("sent at the end: {frame:02X?}"));
        assert_eq!(*frame, expected, "sent {frame:02X?}, not {expected:02X?}");
        self.coming.extend(answers);
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Received>, BusError> {
        let Some(frame) = self.coming.pop_front() else {
            std::thread::sleep(timeout);
            return Ok(None);
        };
        Ok(Some(Received {
            time_ns: 0,
            content: Content::Frame(frame),
            direction: None,
        }))
    }
}

/// Makes a client with little patience that tries once.
pub fn client(script: Script) -> Client<Script> {
    let settings = Settings {
        answer: Duration::from_millis(20),
        quiet: Duration::from_millis(10),
        attempts: 1,
        lss: Duration::from_millis(2),
        lss_settle: Duration::ZERO,
        ..Settings::default()
    };
    Client::with_settings(script, settings)
}
