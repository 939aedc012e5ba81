//! Frames on their way to the bus.

use heapless::Deque;

use crate::Frame;

/// How many frames wait to be sent, without those of the SDO server.
pub(crate) const TRANSMIT_FRAMES: usize = 16;
/// How many messages of the SDO server wait to be sent. A tick of 1 ms brings no more of a block upload,
/// which is half of what the bus carries in that time.
pub(crate) const SDO_FRAMES: usize = 4;

/// A frame that waits: three words, where a [`Frame`] takes five.
#[derive(Clone, Copy, Debug)]
#[repr(align(4))]
struct Waiting {
    cob_id: u16,
    length: u8,
    data: [u8; 8],
}

impl Waiting {
    /// The boot-up message, which no heartbeat may replace: it does not say what it says.
    fn is_boot_up(&self) -> bool {
        let [first, ..] = self.data;
        self.cob_id >= 0x700 && self.length == 1 && first == 0
    }
}

/// Frames in order. When it is full the new frame is dropped, and counted. What is repeated
/// anyway (a PDO, a heartbeat) never waits twice: new data takes the place of the old, so that a
/// stalled bus does not fill the queue with the past. What the SDO server says waits until all else
/// has gone.
#[derive(Clone, Debug, Default)]
pub(crate) struct TransmitQueue {
    frames: Deque<Waiting, TRANSMIT_FRAMES>,
    sdo: Deque<[u8; 8], SDO_FRAMES>,
    dropped: u32,
}

impl TransmitQueue {
    /// Adds a frame with the first `length` of these bytes behind all others.
    #[inline(never)] // One copy in flash.
    pub fn push(&mut self, cob_id: u16, data: [u8; 8], length: u8) {
        let frame = Waiting {
            cob_id,
            length,
            data,
        };
        if self.frames.push_back(frame).is_err() {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    /// Adds a frame with the first `length` of these bytes, in the place of one that waits with the
    /// same identifier.
    #[inline(never)] // One copy in flash.
    pub fn replace(&mut self, cob_id: u16, data: [u8; 8], length: u8) {
        let is_same = |waiting: &&mut Waiting| waiting.cob_id == cob_id && !waiting.is_boot_up();
        // One after the other, which is twice as fast as the queue's own iterator.
        let (older, newer) = self.frames.as_mut_slices();
        let same = older.iter_mut().find(is_same);
        match same.or_else(|| newer.iter_mut().find(is_same)) {
            Some(waiting) => {
                waiting.length = length;
                waiting.data = data;
            }
            None => self.push(cob_id, data, length),
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
        let next = self.frames.pop_front().or_else(|| {
            Some(Waiting {
                cob_id: sdo_cob_id,
                length: 8,
                data: self.sdo.pop_front()?,
            })
        });
        next.and_then(|frame| Frame::from_bytes(frame.cob_id, frame.data, frame.length))
    }

    /// Forgets the frames with other identifiers than `cob_id`, and the SDO server's.
    pub fn keep_only(&mut self, cob_id: u16) {
        self.sdo.clear();
        for _ in 0..self.frames.len() {
            let Some(frame) = self.frames.pop_front() else {
                return;
            };
            if frame.cob_id == cob_id {
                self.push(cob_id, frame.data, frame.length);
            }
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
