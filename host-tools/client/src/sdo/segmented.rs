//! Transfers in one frame, and in segments of seven bytes.

use eel_transport::Bus;

use super::Progress;
use super::channel::Channel;
use crate::error::{ClientError, Violation};

/// Bytes of a segment.
pub const SEGMENT: usize = 7;

/// What the server answered to a read.
pub enum Begun {
    /// The value.
    Whole(Vec<u8>),
    /// The value comes in segments.
    Segments {
        /// Its length, where the server tells it.
        total: Option<usize>,
    },
}

/// Asks for an object.
pub fn begin_upload<B: Bus>(channel: &mut Channel<'_, B>) -> Result<Begun, ClientError> {
    channel.initiate(0x40, [0; 4])?;
    let answer = channel.initiated()?;
    begun(channel, answer)
}

/// Reads the answer to a read.
pub fn begun<B: Bus>(channel: &mut Channel<'_, B>, answer: [u8; 8]) -> Result<Begun, ClientError> {
    let [command, _, _, _, data @ ..] = answer;
    let number = u32::from_le_bytes(data) as usize;
    match (command & 0xE0, command & 3) {
        (0x40, 0) => Ok(Begun::Segments { total: None }),
        (0x40, 1) if number > channel.longest() => Err(channel.refuse(Violation::TooLong)),
        (0x40, 1) => Ok(Begun::Segments {
            total: Some(number),
        }),
        // Without a size, all four bytes may be meant.
        (0x40, 2) => Ok(Begun::Whole(data.to_vec())),
        (0x40, _) => {
            let length = 4 - usize::from(command >> 2 & 3);
            Ok(Begun::Whole(data.into_iter().take(length).collect()))
        }
        _ => Err(channel.refuse(Violation::Command(command))),
    }
}

/// Fetches the segments of a read that has begun.
pub fn go_on_upload<B: Bus>(
    channel: &mut Channel<'_, B>,
    total: Option<usize>,
    progress: &mut dyn FnMut(Progress),
) -> Result<Vec<u8>, ClientError> {
    let mut value = Vec::new();
    let mut toggle = 0;
    loop {
        channel.send([0x60 | toggle, 0, 0, 0, 0, 0, 0, 0])?;
        let [command, data @ ..] = channel.answer()?;
        if command & 0xE0 != 0 {
            return Err(channel.refuse(Violation::Command(command)));
        }
        if command & 0x10 != toggle {
            return Err(channel.refuse(Violation::Toggle));
        }
        let length = SEGMENT - usize::from(command >> 1 & 7);
        value.extend(data.into_iter().take(length));
        let came = value.len();
        progress(Progress { done: came, total });
        let is_last = command & 1 != 0;
        match total {
            Some(announced) if came > announced || is_last && came < announced => {
                return Err(channel.refuse(Violation::Length { announced, came }));
            }
            _ if came > channel.longest() => return Err(channel.refuse(Violation::TooLong)),
            _ if is_last => return Ok(value),
            _ => toggle ^= 0x10,
        }
    }
}

/// Writes one to four bytes in one frame.
pub fn download_expedited<B: Bus>(
    channel: &mut Channel<'_, B>,
    data: &[u8],
) -> Result<(), ClientError> {
    let mut bytes = [0; 4];
    for (slot, byte) in bytes.iter_mut().zip(data) {
        *slot = *byte;
    }
    let unused = 4_usize.saturating_sub(data.len()) as u8;
    channel.initiate(0x23 | unused << 2, bytes)?;
    written(channel)
}

/// Writes in segments.
pub fn download<B: Bus>(
    channel: &mut Channel<'_, B>,
    data: &[u8],
    progress: &mut dyn FnMut(Progress),
) -> Result<(), ClientError> {
    channel.initiate(0x21, (data.len() as u32).to_le_bytes())?;
    written(channel)?;
    let mut toggle = 0;
    let mut done = 0;
    loop {
        let rest = data.get(done..).unwrap_or(&[]);
        let length = rest.len().min(SEGMENT);
        let is_last = length == rest.len();
        let unused = (SEGMENT - length) as u8;
        let command = toggle | unused << 1 | u8::from(is_last);
        channel.send(frame(command, rest))?;
        let [command, ..] = channel.answer()?;
        if command & 0xE0 != 0x20 {
            return Err(channel.refuse(Violation::Command(command)));
        }
        if command & 0x10 != toggle {
            return Err(channel.refuse(Violation::Toggle));
        }
        done += length;
        let total = Some(data.len());
        progress(Progress { done, total });
        if is_last {
            return Ok(());
        }
        toggle ^= 0x10;
    }
}

/// Waits for the answer to the beginning of a write.
fn written<B: Bus>(channel: &mut Channel<'_, B>) -> Result<(), ClientError> {
    let [command, ..] = channel.initiated()?;
    if command & 0xE0 == 0x60 {
        Ok(())
    } else {
        Err(channel.refuse(Violation::Command(command)))
    }
}

/// Makes a segment of the first bytes of `rest`.
pub fn frame(command: u8, rest: &[u8]) -> [u8; 8] {
    let mut frame = [command, 0, 0, 0, 0, 0, 0, 0];
    for (slot, byte) in frame.iter_mut().skip(1).zip(rest) {
        *slot = *byte;
    }
    frame
}
