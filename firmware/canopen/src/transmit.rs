//! Frames on their way to the bus.

use heapless::Deque;

use crate::Frame;

/// How many frames wait to be sent, without those of the SDO server.
pub(crate) const TRANSMIT_FRAMES: usize = 16;
/// How many messages of the SDO server wait to be sent. A tick of 1 ms brings no more of a block upload,
/// which is half of what the bus carries in that time.
pub(crate) const SDO_FRAMES: usize = 4;

/// Frames in order. When it is full the new frame is dropped, and counted. What is repeated
/// anyway (a PDO, a heartbeat) never waits twice: new data takes the place of the old, so that a
/// stalled bus does not fill the queue with the past. What the SDO server says waits until all else
/// has gone.
#[derive(Clone, Debug, Default)]
pub(crate) struct TransmitQueue {
    frames: Deque<Frame, TRANSMIT_FRAMES>,
    sdo: Deque<[u8; 8], SDO_FRAMES>,
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

    /// Adds a message of the SDO server behind its others.
    #[inline(never)] // One copy in flash.
    pub fn push_sdo(&mut self, message: [u8; 8]) {
        if self.sdo.push_back(message).is_err() {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    /// Tells whether a message of the SDO server would find room.
    pub fn has_sdo_room(&self) -> bool {
        !self.sdo.is_full()
    }

    /// Takes back what the SDO server has said and what has not been sent.
    pub fn clear_sdo(&mut self) {
        self.sdo.clear();
    }

    /// Takes the next frame; the SDO server's have the identifier `sdo_cob_id`.
    pub fn pop(&mut self, sdo_cob_id: u16) -> Option<Frame> {
        self.frames
            .pop_front()
            .or_else(|| Frame::standard(sdo_cob_id, &self.sdo.pop_front()?))
    }

    /// Forgets all but what has one byte and the identifier `cob_id`: a boot-up message and a
    /// heartbeat, at most.
    #[inline(never)] // One copy in flash.
    pub fn keep_only(&mut self, cob_id: u16) {
        let mut kept = [None; 2];
        while let Some(frame) = self.frames.pop_front() {
            if let &[state] = frame.data()
                && frame.cob_id() == Some(cob_id)
            {
                let [_, before] = kept;
                kept = [before, Some(state)];
            }
        }
        self.sdo.clear();
        for state in kept.into_iter().flatten() {
            self.push(cob_id, &[state]);
        }
    }

    pub fn clear(&mut self) {
        self.frames.clear();
        self.sdo.clear();
    }

    pub const fn dropped(&self) -> u32 {
        self.dropped
    }
}
