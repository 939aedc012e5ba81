//! The freeze frame: what a vertebra was doing when it last faulted or stopped, object 0x2100:1.

use crate::emergency::Source;
use crate::states::{LimitCode, State};
use crate::status::Status;

/// The layout of a freeze frame; another one has another number.
pub const FREEZE_VERSION: u8 = 1;
/// Length of a freeze frame in bytes.
pub const FREEZE_BYTES: usize = 128;

const HAS_CLOCK: u16 = 1;
const HAS_REFERENCE: u16 = 2;

/// A moment by the calendar, as TIME tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeOfDay {
    /// Days since 1 January 1984.
    pub days: u16,
    /// Milliseconds since midnight.
    pub ms: u32,
}

/// Everything at the moment of a fault or a stop; triples are motors 1–3, or yaw, pitch, roll.
///
/// On the wire, little-endian: version u8, state u8, motor u8, limit u8, code u16, detail u16, time u64,
/// count u32, flags u16 (bit 0: TIME is known, 1: there is a reference), days u16, ms u32; pose,
/// reference, angles, speeds, currents, each three i32; torques three i16, limit codes u16 (four bits
/// each), supply i32, temperatures four i16, status word u32, the four counters u32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FreezeFrame {
    /// State just before.
    pub state: State,
    /// Number of the emergency, of the catalogue.
    pub code: u16,
    /// Where it comes from.
    pub source: Source,
    /// Time in µs since power-up.
    pub at_us: u64,
    /// How many faults and stops there were since power-up, with this one.
    pub count: u32,
    /// The time of day, once TIME came.
    pub clock: Option<TimeOfDay>,
    /// Pose in µrad.
    pub pose: [i32; 3],
    /// Pose that the wrist was pulled to, while it was, in µrad.
    pub reference: Option<[i32; 3]>,
    /// Motor angles in µrad.
    pub angles: [i32; 3],
    /// Motor speeds in mrad/s.
    pub speeds: [i32; 3],
    /// Motor currents in mA.
    pub currents: [i32; 3],
    /// Motor torques in mN·m, from the currents.
    pub torques: [i16; 3],
    /// What bounded each motor in the tick before.
    pub limits: [LimitCode; 3],
    /// Supply in mV.
    pub supply: i32,
    /// Temperatures of the board and the motors in 0.1 °C.
    pub temperatures: [i16; 4],
    /// The status word.
    pub status: Status,
    /// Targets refused, targets missed, frames lost on the way in and on the way out, since power-up.
    pub counters: [u32; 4],
}

/// Why bytes are no freeze frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FreezeError {
    /// They are of another version.
    Version,
    /// There are more or fewer of them.
    Length,
    /// A code means nothing.
    Value,
}

impl TimeOfDay {
    /// Milliseconds of a day.
    const DAY_MS: u64 = 86_400_000;

    /// Returns the moment `span_us` later.
    pub const fn later(self, span_us: u64) -> Self {
        let ms = self.ms as u64 + span_us / 1_000;
        Self {
            days: (self.days as u64 + ms / Self::DAY_MS) as u16,
            ms: (ms % Self::DAY_MS) as u32,
        }
    }
}

impl FreezeFrame {
    /// Packs the frame.
    pub fn to_bytes(&self) -> [u8; FREEZE_BYTES] {
        let Source {
            motor,
            limit,
            detail,
        } = self.source;
        let has_clock = if self.clock.is_some() { HAS_CLOCK } else { 0 };
        let has_reference = match self.reference {
            Some(_) => HAS_REFERENCE,
            None => 0,
        };
        let clock = self.clock.unwrap_or(TimeOfDay { days: 0, ms: 0 });
        let [a, b, c] = self.torques.map(i16::cast_unsigned);
        let [one, two, three] = self.limits.map(|limit| u16::from(limit.code()));
        let [t, u, v, w] = self.temperatures.map(i16::cast_unsigned);
        let pair = |low: u16, high: u16| u32::from(low) | u32::from(high) << 16;
        let head = [
            u32::from_le_bytes([FREEZE_VERSION, self.state.code(), motor, limit]),
            pair(self.code, detail),
            self.at_us as u32,
            (self.at_us >> 32) as u32,
            self.count,
            pair(has_clock | has_reference, clock.days),
            clock.ms,
        ];
        let triples = [
            self.pose,
            self.reference.unwrap_or_default(),
            self.angles,
            self.speeds,
            self.currents,
        ];
        let tail = [
            pair(a, b),
            pair(c, one | two << 4 | three << 8),
            self.supply.cast_unsigned(),
            pair(t, u),
            pair(v, w),
            self.status.to_bits(),
        ];
        let mut bytes = [0; FREEZE_BYTES];
        let triples = triples
            .as_flattened()
            .iter()
            .map(|value| value.cast_unsigned());
        let words = head
            .into_iter()
            .chain(triples)
            .chain(tail)
            .chain(self.counters);
        // As many as there is room for.
        for (to, word) in bytes.as_chunks_mut().0.iter_mut().zip(words) {
            *to = word.to_le_bytes();
        }
        bytes
    }

    /// Unpacks a frame.
    ///
    /// # Errors
    /// Where the bytes are of another version or length, or hold a code that means nothing.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, FreezeError> {
        if bytes.first() != Some(&FREEZE_VERSION) {
            return Err(FreezeError::Version);
        }
        if bytes.len() != FREEZE_BYTES {
            return Err(FreezeError::Length);
        }
        Self::read(&mut Reader { rest: bytes }).ok_or(FreezeError::Value)
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let [_, state, motor, limit] = from.take()?;
        let state = State::from_code(state)?;
        let code = from.take_u16()?;
        let source = Source {
            motor,
            limit,
            detail: from.take_u16()?,
        };
        let at_us = u64::from_le_bytes(from.take()?);
        let count = from.take_u32()?;
        let flags = from.take_u16()?;
        let clock = TimeOfDay {
            days: from.take_u16()?,
            ms: from.take_u32()?,
        };
        let pose = from.take_three()?;
        let reference = from.take_three()?;
        let (angles, speeds, currents) =
            (from.take_three()?, from.take_three()?, from.take_three()?);
        let torques = [from.take_i16()?, from.take_i16()?, from.take_i16()?];
        let codes = from.take_u16()?;
        let limit = |shift: u8| LimitCode::from_code((codes >> shift & 0xF) as u8);
        let limits = [limit(0)?, limit(4)?, limit(8)?];
        let supply = i32::from_le_bytes(from.take()?);
        let (board, one) = (from.take_i16()?, from.take_i16()?);
        let temperatures = [board, one, from.take_i16()?, from.take_i16()?];
        let status = Status::from_bits(from.take_u32()?);
        let (bad, lost) = (from.take_u32()?, from.take_u32()?);
        let counters = [bad, lost, from.take_u32()?, from.take_u32()?];
        Some(Self {
            state,
            code,
            source,
            at_us,
            count,
            clock: (flags & HAS_CLOCK != 0).then_some(clock),
            pose,
            reference: (flags & HAS_REFERENCE != 0).then_some(reference),
            angles,
            speeds,
            currents,
            torques,
            limits,
            supply,
            temperatures,
            status,
            counters,
        })
    }
}

/// The rest of a frame that is being unpacked.
struct Reader<'a> {
    rest: &'a [u8],
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(*taken)
    }

    fn take_u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn take_i16(&mut self) -> Option<i16> {
        self.take().map(i16::from_le_bytes)
    }

    fn take_u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn take_three(&mut self) -> Option<[i32; 3]> {
        let mut next = || self.take().map(i32::from_le_bytes);
        Some([next()?, next()?, next()?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emergency::Emergency;
    use crate::status::Condition;

    fn frame() -> FreezeFrame {
        FreezeFrame {
            state: State::Run,
            code: Emergency::OVER_CURRENT.code,
            source: Source {
                motor: 2,
                limit: 1,
                detail: 4_000,
            },
            at_us: 0x0102_0304_0506_0708,
            count: 9,
            clock: Some(TimeOfDay {
                days: 15_669,
                ms: 86_399_999,
            }),
            pose: [-1, 2, -3],
            reference: Some([4, -5, 6]),
            angles: [i32::MIN, 0, i32::MAX],
            speeds: [7, 8, 9],
            currents: [-10, 11, 12],
            torques: [i16::MIN, 13, i16::MAX],
            limits: [LimitCode::Peak, LimitCode::Off, LimitCode::Speed],
            supply: 24_000,
            temperatures: [-100, 250, 260, 270],
            status: Status::NONE.with(Condition::Latched, true),
            counters: [1, 2, 3, u32::MAX],
        }
    }

    #[test]
    fn a_frame_survives_the_way_to_bytes_and_back() {
        let bare = FreezeFrame {
            clock: None,
            reference: None,
            ..frame()
        };
        for frame in [frame(), bare] {
            assert_eq!(FreezeFrame::from_bytes(&frame.to_bytes()), Ok(frame));
        }
    }

    /// The promise on the wire: where things stand.
    #[test]
    fn a_frame_is_these_bytes() {
        let bytes = frame().to_bytes();
        assert_eq!(bytes[..8], [1, 3, 2, 1, 0x10, 0x23, 0xA0, 0x0F]);
        assert_eq!(bytes[8..16], [8, 7, 6, 5, 4, 3, 2, 1]);
        assert_eq!(bytes[16..22], [9, 0, 0, 0, 3, 0]);
        assert_eq!(bytes[22..28], [0x35, 0x3D, 0xFF, 0x5B, 0x26, 0x05]);
        assert_eq!(bytes[28..32], [0xFF; 4]);
        assert_eq!(bytes[40..44], [4, 0, 0, 0]);
        assert_eq!(bytes[52..56], [0, 0, 0, 0x80]);
        assert_eq!(bytes[64..68], [7, 0, 0, 0]);
        assert_eq!(bytes[76..80], [0xF6, 0xFF, 0xFF, 0xFF]);
        assert_eq!(bytes[88..96], [0, 0x80, 13, 0, 0xFF, 0x7F, 0xF1, 0x08]);
        assert_eq!(bytes[96..102], [0xC0, 0x5D, 0, 0, 0x9C, 0xFF]);
        assert_eq!(bytes[108..116], [0, 2, 0, 0, 1, 0, 0, 0]);
        assert_eq!(bytes[124..], [0xFF; 4]);
    }

    #[test]
    fn what_is_no_frame_says_why() {
        let mut bytes = frame().to_bytes();
        assert_eq!(
            FreezeFrame::from_bytes(&bytes[..127]),
            Err(FreezeError::Length)
        );
        bytes[1] = 11;
        assert_eq!(FreezeFrame::from_bytes(&bytes), Err(FreezeError::Value));
        bytes[0] = 2;
        assert_eq!(FreezeFrame::from_bytes(&bytes), Err(FreezeError::Version));
        assert_eq!(FreezeFrame::from_bytes(&[]), Err(FreezeError::Version));
    }

    #[test]
    fn a_clock_goes_on_over_midnight() {
        let late = TimeOfDay {
            days: 1,
            ms: 86_399_000,
        };
        assert_eq!(
            late.later(999_999),
            TimeOfDay {
                ms: 86_399_999,
                ..late
            }
        );
        assert_eq!(late.later(1_000_000), TimeOfDay { days: 2, ms: 0 });
        assert_eq!(late.later(86_401_000_000), TimeOfDay { days: 3, ms: 0 });
    }
}
