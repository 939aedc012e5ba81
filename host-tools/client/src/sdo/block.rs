//! Transfers in blocks of up to 127 segments with one acknowledgement and a CRC.

use eel_transport::Bus;

use super::Progress;
use super::channel::Channel;
use super::crc::crc;
use super::segmented::{self, Begun, SEGMENT};
use crate::error::{ClientError, Violation};

/// Segments of a block that is read.
const BLOCK: u8 = 127;
/// Marks the last segment.
const LAST: u8 = 0x80;
/// How often in a row a block may come without its first segment, or be acknowledged without it.
const STALLS: u8 = 5;

/// Reads in blocks; a server may answer short values in one frame or in segments instead.
pub fn upload<B: Bus>(
    channel: &mut Channel<'_, B>,
    progress: &mut dyn FnMut(Progress),
) -> Result<Vec<u8>, ClientError> {
    // Bit 2: we know the CRC. The second number is the length up to which the server is asked to
    // switch to another kind of transfer; some do so without being asked.
    channel.initiate(0xA4, [BLOCK, 0, 0, 0])?;
    let answer = channel.initiated()?;
    let [command, _, _, _, size @ ..] = answer;
    if command & 0xE0 == 0x40 {
        return match segmented::begun(channel, answer)? {
            Begun::Whole(value) => Ok(value),
            Begun::Segments { total } => segmented::go_on_upload(channel, total, progress),
        };
    }
    if command & 0xE1 != 0xC0 {
        return Err(channel.refuse(Violation::Command(command)));
    }
    let total = (command & 2 != 0).then_some(u32::from_le_bytes(size) as usize);
    if total.is_some_and(|total| total > channel.longest()) {
        return Err(channel.refuse(Violation::TooLong));
    }
    channel.send([0xA3, 0, 0, 0, 0, 0, 0, 0])?;
    let mut value = receive_blocks(channel, total, progress)?;
    let [end, low, high, ..] = channel.answer()?;
    if end & 0xE3 != 0xC1 {
        return Err(channel.refuse(Violation::Command(end)));
    }
    let unused = usize::from(end >> 2 & 7);
    value.truncate(value.len().saturating_sub(unused));
    let came = value.len();
    if let Some(announced) = total.filter(|announced| *announced != came) {
        return Err(channel.refuse(Violation::Length { announced, came }));
    }
    if command & 4 != 0 && crc(&value) != u16::from_le_bytes([low, high]) {
        return Err(channel.refuse(Violation::Crc));
    }
    channel.send([0xA1, 0, 0, 0, 0, 0, 0, 0])?;
    Ok(value)
}

/// Receives blocks until the last segment is there.
fn receive_blocks<B: Bus>(
    channel: &mut Channel<'_, B>,
    total: Option<usize>,
    progress: &mut dyn FnMut(Progress),
) -> Result<Vec<u8>, ClientError> {
    let mut value = Vec::new();
    let mut stalls = 0;
    loop {
        let (good, is_last) = receive_block(channel, &mut value)?;
        channel.send([0xA2, good, BLOCK, 0, 0, 0, 0, 0])?;
        let done = total.map_or(value.len(), |total| total.min(value.len()));
        progress(Progress { done, total });
        if is_last {
            return Ok(value);
        }
        if value.len() > channel.longest() {
            return Err(channel.refuse(Violation::TooLong));
        }
        stalls = if good == 0 { stalls + 1 } else { 0 };
        if stalls >= STALLS {
            return Err(channel.refuse(Violation::Losses));
        }
    }
}

/// Receives one block: adds what comes without a gap to `value`, and returns the number of the last
/// such segment and whether it ends the value.
fn receive_block<B: Bus>(
    channel: &mut Channel<'_, B>,
    value: &mut Vec<u8>,
) -> Result<(u8, bool), ClientError> {
    let mut good = 0;
    let mut wait = channel.patience();
    let mut heard = false;
    loop {
        let Some([command, data @ ..]) = channel.receive(wait)? else {
            // What is missing at the end of a block is asked for; a server that says nothing is lost.
            return if heard {
                Ok((good, false))
            } else {
                Err(channel.silence())
            };
        };
        heard = true;
        wait = channel.quiet();
        let (number, is_last) = (command & !LAST, command & LAST != 0);
        if number == good + 1 {
            value.extend(data);
            good = number;
            if is_last {
                return Ok((good, true));
            }
        }
        if is_last || number == BLOCK {
            return Ok((good, false));
        }
    }
}

/// Writes in blocks.
pub fn download<B: Bus>(
    channel: &mut Channel<'_, B>,
    data: &[u8],
    progress: &mut dyn FnMut(Progress),
) -> Result<(), ClientError> {
    // Bit 2: we know the CRC. Bit 1: the length is told.
    channel.initiate(0xC6, (data.len() as u32).to_le_bytes())?;
    let [command, _, _, _, size, ..] = channel.initiated()?;
    if command & 0xE3 != 0xA0 {
        return Err(channel.refuse(Violation::Command(command)));
    }
    send_blocks(channel, data, size, progress)?;
    let in_last = match data.len() % SEGMENT {
        0 if !data.is_empty() => SEGMENT,
        rest => rest,
    };
    let unused = (SEGMENT - in_last) as u8;
    let sum = if command & 4 == 0 { 0 } else { crc(data) };
    let [low, high] = sum.to_le_bytes();
    channel.send([0xC1 | unused << 2, low, high, 0, 0, 0, 0, 0])?;
    let [command, ..] = channel.answer()?;
    if command & 0xE3 == 0xA1 {
        Ok(())
    } else {
        Err(channel.refuse(Violation::Command(command)))
    }
}

/// Sends all segments, those that got lost again, in blocks of the size that the server asks for.
fn send_blocks<B: Bus>(
    channel: &mut Channel<'_, B>,
    data: &[u8],
    mut size: u8,
    progress: &mut dyn FnMut(Progress),
) -> Result<(), ClientError> {
    let segments = data.len().div_ceil(SEGMENT).max(1);
    let mut sent = 0;
    let mut stalls = 0;
    while sent < segments {
        if size == 0 || size > BLOCK {
            return Err(channel.refuse(Violation::BlockSize(size)));
        }
        let count = (segments - sent).min(usize::from(size));
        for number in 1..=count {
            let place = sent + number - 1;
            let last = if place + 1 == segments { LAST } else { 0 };
            let rest = data.get(place * SEGMENT..).unwrap_or(&[]);
            channel.send(segmented::frame(number as u8 | last, rest))?;
        }
        let [command, good, next, ..] = channel.answer()?;
        if command & 0xE3 != 0xA2 {
            return Err(channel.refuse(Violation::Command(command)));
        }
        if usize::from(good) > count {
            return Err(channel.refuse(Violation::Sequence(good)));
        }
        sent += usize::from(good);
        size = next;
        let (done, total) = ((sent * SEGMENT).min(data.len()), Some(data.len()));
        progress(Progress { done, total });
        stalls = if good == 0 { stalls + 1 } else { 0 };
        if stalls >= STALLS {
            return Err(channel.refuse(Violation::Losses));
        }
    }
    Ok(())
}
