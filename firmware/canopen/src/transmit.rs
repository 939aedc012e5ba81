//! Frames on their way to the bus.

use heapless::Deque;

use crate::Frame;

/// How many frames wait to be sent.
pub(crate) const TRANSMIT_FRAMES: usize = 16;

/// Frames in order. When it is full the new frame is dropped, and counted. What is repeated
/// anyway (a PDO, a heartbeat) never waits twice: new data takes the place of the old, so that a
/// stalled bus does not fill the queue with the past.
#[derive(Clone, Debug, Default)]
pub(crate) struct TransmitQueue {
    frames: Deque<Frame, TRANSMIT_FRAMES>,
    dropped: u32,
}

impl TransmitQueue {
    /// Adds a frame behind all others.
    #[inline(never)] // One copy in flash.
    pub fn push(&mut self, cob_id: u16, data: &[u8]) {
        let Some(frame) = Frame::standard(cob_id, data) else {
            return;
        };
        if self.frames.push_back(frame).is_err() {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    /// Adds a frame, in the place of one that waits with the same identifier. A boot-up message
    /// keeps its place: a heartbeat does not say what it says.
    #[inline(never)] // One copy in flash.
    pub fn replace(&mut self, cob_id: u16, data: &[u8]) {
        let same = self.frames.iter_mut().find(|waiting| {
            waiting.cob_id() == Some(cob_id) && !(cob_id >= 0x700 && waiting.data() == [0])
        });
        match (same, Frame::standard(cob_id, data)) {
            (Some(waiting), Some(frame)) => *waiting = frame,
            _ => self.push(cob_id, data),
        }
    }

    pub fn pop(&mut self) -> Option<Frame> {
        self.frames.pop_front()
    }

    /// Forgets the frames with other identifiers than `cob_id`.
    pub fn keep_only(&mut self, cob_id: u16) {
        for _ in 0..self.frames.len() {
            if let Some(frame) = self
                .frames
                .pop_front()
                .filter(|f| f.cob_id() == Some(cob_id))
            {
                // One was taken out just before.
                let _ = self.frames.push_back(frame);
            }
        }
    }

    pub fn clear(&mut self) {
        self.frames.clear();
    }

    pub const fn dropped(&self) -> u32 {
        self.dropped
    }
}
