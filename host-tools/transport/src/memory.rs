//! Two ends of a bus in memory, for tests.

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use eel_protocol::Frame;

use crate::bus::{Bus, Content, Received};
use crate::error::BusError;

/// Frames that one direction of a pair holds before [`BusError::Full`].
const CAPACITY: usize = 4096;

/// One end of a bus of two; what one end sends the other receives.
#[derive(Debug)]
pub struct MemoryBus {
    outgoing: SyncSender<(u64, Frame)>,
    incoming: Receiver<(u64, Frame)>,
}

/// Makes the two ends of a bus in memory, which holds 4096 frames in each direction.
pub fn pair() -> (MemoryBus, MemoryBus) {
    let (to_right, from_left) = sync_channel(CAPACITY);
    let (to_left, from_right) = sync_channel(CAPACITY);
    (
        MemoryBus {
            outgoing: to_right,
            incoming: from_right,
        },
        MemoryBus {
            outgoing: to_left,
            incoming: from_left,
        },
    )
}

impl Bus for MemoryBus {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.outgoing
            .try_send((now_ns(), *frame))
            .map_err(|error| match error {
                TrySendError::Full(_) => BusError::Full,
                TrySendError::Disconnected(_) => BusError::Ended,
            })
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Received>, BusError> {
        match self.incoming.recv_timeout(timeout) {
            Ok((time_ns, frame)) => Ok(Some(Received {
                time_ns,
                content: Content::Frame(frame),
                direction: None,
            })),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(BusError::Ended),
        }
    }
}

/// Returns nanoseconds since 1970.
pub(crate) fn now_ns() -> u64 {
    to_ns(SystemTime::now())
}

/// Returns nanoseconds since 1970, 0 before and the greatest number after the year 2554.
pub(crate) fn to_ns(time: SystemTime) -> u64 {
    time.duration_since(UNIX_EPOCH)
        .map_or(0, |span| u64::try_from(span.as_nanos()).unwrap_or(u64::MAX))
}
