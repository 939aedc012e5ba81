//! Who may send, and where frames that no arbitration can separate destroy each other.

use eel_protocol::Frame;

/// Returns the arbitration field as a number: of frames that start together the lowest wins.
///
/// From the highest bit: 11 bits of base identifier, RTR (of a 29-bit frame SRR, which is 1), IDE,
/// the other 18 bits of identifier, RTR of a 29-bit frame. Frames with equal fields can't be told
/// apart by arbitration.
#[inline]
pub fn arbitration_field(frame: &Frame) -> u32 {
    let id = frame.raw_id();
    let remote = u32::from(frame.is_remote());
    if frame.is_extended() {
        let (base, extension) = (id >> 18, id & 0x3_FFFF);
        base << 21 | 1 << 20 | 1 << 19 | extension << 1 | remote
    } else {
        id << 21 | remote << 20
    }
}

/// Where two frames with one arbitration field first differ on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Difference {
    /// Bits from the start of frame up to and with the differing one, stuff bits counted.
    pub bits: u32,
    /// Dominant bits in a row on the wire up to and with that bit, 1–5.
    pub dominant_run: u32,
    /// Whether the second frame has the recessive bit.
    pub second_is_recessive: bool,
}

/// Compares two frames with equal arbitration fields bit by bit; `None` when they are equal.
pub(super) fn first_difference(first: &Frame, second: &Frame) -> Option<Difference> {
    let (mut bits, mut run, mut last) = (0, 0, true);
    for (one, other) in content(first).zip(content(second)) {
        let wire = one && other;
        run = if wire == last { run + 1 } else { 1 };
        last = wire;
        bits += 1;
        if one != other {
            return Some(Difference {
                bits,
                dominant_run: run,
                second_is_recessive: other,
            });
        }
        if run == 5 {
            bits += 1;
            run = 1;
            last = !wire;
        }
    }
    None
}

/// Returns the unstuffed bits from the start of frame to the end of the data, recessive as true.
///
/// The CRC is not needed: frames that differ do so before it.
fn content(frame: &Frame) -> impl Iterator<Item = bool> + '_ {
    let id = u64::from(frame.raw_id());
    let remote = u64::from(frame.is_remote());
    let length = u64::from(frame.length());
    let (header, count) = if frame.is_extended() {
        let (base, extension) = (id >> 18, id & 0x3_FFFF);
        (
            base << 27 | 0b11 << 25 | extension << 7 | remote << 6 | length,
            39,
        )
    } else {
        (id << 7 | remote << 6 | length, 19)
    };
    let bit = |value: u64, place: u32| value >> place & 1 == 1;
    let head = (0..count).rev().map(move |place| bit(header, place));
    let data = frame.data().iter();
    head.chain(data.flat_map(move |byte| (0..8).rev().map(move |place| bit((*byte).into(), place))))
}
