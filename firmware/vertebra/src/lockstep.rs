//! Packets in which a vertebra's platform and its world take turns: the same bytes on a pipe to
//! QEMU, in a record, or in a test.
//!
//! Every packet is a header of four bytes (kind, version, length of the body) and a body of fixed
//! layout, little-endian. A value has one encoding: what is decoded encodes to the same bytes. Nothing
//! allocates, and no packet is longer than [`MAX_PACKET`].

use eel_canopen::{Frame, Id};
use eel_protocol::NodeId;
use eel_units::{Angle, Current, Duration, Instant, Temperature, Voltage};
use embedded_can::{ExtendedId, StandardId};
use heapless::Vec;

use crate::io::{Drive, Sample, Setpoint};

/// The layout; another one has another number.
pub const VERSION: u8 = 4;
/// The most frames of a packet: more than a node queues.
pub const MAX_FRAMES: usize = 32;
/// Length of a header in bytes.
pub const HEADER: usize = 4;
/// Length of the longest packet in bytes, header included.
pub const MAX_PACKET: usize = HEADER + TIME + SAMPLE + 1 + 1 + MAX_FRAMES * FRAME;

const TIME: usize = 8;
const SAMPLE: usize = 4 * 3 + 1 + 4 * 3 + 4 * 3 + 4 + 4 + 4 * 3 + 1 + 4;
/// Stands for no SYNC.
const NO_SYNC: u32 = u32::MAX;
const FRAME: usize = 4 + 1 + 8;
const DRIVES: usize = 3 * (1 + 4 + 4);

const _: () = assert!(DRIVES + 4 + 1 + 1 + MAX_FRAMES * FRAME + HEADER <= MAX_PACKET);
const _: () = assert!(MAX_PACKET <= u16::MAX as usize);

const EXTENDED: u32 = 1 << 31;
const REMOTE: u32 = 1 << 30;

/// The frames of one packet.
pub type Frames = Vec<Frame, MAX_FRAMES>;

/// What a packet is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Power-up of a vertebra: a [`Start`].
    Start,
    /// What a vertebra is given for a turn: an [`Input`].
    Input,
    /// What a vertebra makes of it: an [`Output`].
    Output,
}

/// Why bytes are no packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PacketError {
    /// The kind is unknown.
    Kind,
    /// The version is another one.
    Version,
    /// The body is shorter or longer than it says or may be.
    Length,
    /// A field has a value that nothing encodes to.
    Value,
}

/// The head of a packet: what follows, and how much of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// What the packet is.
    pub kind: Kind,
    /// Length of the body in bytes, at most [`MAX_PACKET`] − [`HEADER`].
    pub length: usize,
}

/// Power-up: who the vertebra is, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Start {
    /// Its place in the chain.
    pub node: NodeId,
    /// Its serial number.
    pub serial: u32,
    /// The time.
    pub now: Instant,
    /// Whether the microcontroller failed before, so that the vertebra is stopped.
    pub failed: bool,
}

/// What a vertebra is given for a turn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Input {
    /// The time.
    pub now: Instant,
    /// What it measures.
    pub sample: Sample,
    /// What it hears, in this order.
    pub frames: Frames,
    /// How many frames the bus takes, at most [`MAX_FRAMES`].
    pub room: u8,
}

/// What a vertebra makes of a turn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// What the bridges do.
    pub drives: [Drive; 3],
    /// By how much its next tick shall be longer than a millisecond, ns.
    pub trim_ns: i32,
    /// The level of the daisy line's OUT.
    pub chain_out: bool,
    /// What it sends, in this order.
    pub frames: Frames,
}

/// An encoded packet.
#[derive(Clone, Debug)]
pub struct Packet {
    bytes: Vec<u8, MAX_PACKET>,
}

impl Packet {
    /// Returns the bytes, header included.
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Starts a packet.
    fn new(kind: Kind) -> Self {
        let mut packet = Self { bytes: Vec::new() };
        let code = match kind {
            Kind::Start => b'S',
            Kind::Input => b'I',
            Kind::Output => b'O',
        };
        packet.put(&[code, VERSION, 0, 0]);
        packet
    }

    /// Appends bytes, for which there is room in every packet made here.
    fn put(&mut self, bytes: &[u8]) {
        let _ = self.bytes.extend_from_slice(bytes);
    }

    fn put_i32(&mut self, value: i32) {
        self.put(&value.to_le_bytes());
    }

    fn put_frames(&mut self, frames: &Frames) {
        self.put(&[frames.len() as u8]);
        for frame in frames {
            let extended = if frame.is_extended() { EXTENDED } else { 0 };
            let remote = if frame.is_remote() { REMOTE } else { 0 };
            self.put(&(frame.raw_id() | extended | remote).to_le_bytes());
            self.put(&[frame.length()]);
            let mut data = [0; 8];
            for (to, from) in data.iter_mut().zip(frame.data()) {
                *to = *from;
            }
            self.put(&data);
        }
    }

    /// Writes the length into the header.
    fn finish(mut self) -> Self {
        let length = self.bytes.len().saturating_sub(HEADER) as u16;
        for (to, from) in self.bytes.iter_mut().skip(2).zip(length.to_le_bytes()) {
            *to = from;
        }
        self
    }
}

impl Header {
    /// Reads the head of a packet.
    ///
    /// # Errors
    /// Where the kind or the version is unknown, or the body too long.
    pub fn decode(bytes: [u8; HEADER]) -> Result<Self, PacketError> {
        let [code, version, low, high] = bytes;
        let kind = match code {
            b'S' => Kind::Start,
            b'I' => Kind::Input,
            b'O' => Kind::Output,
            _ => return Err(PacketError::Kind),
        };
        if version != VERSION {
            return Err(PacketError::Version);
        }
        let length = usize::from(u16::from_le_bytes([low, high]));
        if length > MAX_PACKET - HEADER {
            return Err(PacketError::Length);
        }
        Ok(Self { kind, length })
    }
}

impl Start {
    /// Makes the packet.
    pub fn encode(&self) -> Packet {
        let mut packet = Packet::new(Kind::Start);
        packet.put(&[self.node.get()]);
        packet.put(&self.serial.to_le_bytes());
        packet.put(&self.now.to_micros().to_le_bytes());
        packet.put(&[u8::from(self.failed)]);
        packet.finish()
    }

    /// Reads a packet's body.
    ///
    /// # Errors
    /// Where the bytes are no such body.
    pub fn decode(body: &[u8]) -> Result<Self, PacketError> {
        let mut reader = Reader { bytes: body };
        let node = NodeId::new(reader.take_u8()?).ok_or(PacketError::Value)?;
        let serial = u32::from_le_bytes(reader.take()?);
        let now = reader.take_instant()?;
        let failed = reader.take_bool()?;
        reader.finish()?;
        Ok(Self {
            node,
            serial,
            now,
            failed,
        })
    }
}

impl Input {
    /// Makes the packet.
    pub fn encode(&self) -> Packet {
        let mut packet = Packet::new(Kind::Input);
        packet.put(&self.now.to_micros().to_le_bytes());
        put_sample(&mut packet, &self.sample);
        packet.put(&[self.room]);
        packet.put_frames(&self.frames);
        packet.finish()
    }

    /// Reads a packet's body.
    ///
    /// # Errors
    /// Where the bytes are no such body.
    pub fn decode(body: &[u8]) -> Result<Self, PacketError> {
        let mut reader = Reader { bytes: body };
        let now = reader.take_instant()?;
        let sample = take_sample(&mut reader)?;
        let room = reader.take_u8()?;
        if usize::from(room) > MAX_FRAMES {
            return Err(PacketError::Value);
        }
        let frames = reader.take_frames()?;
        reader.finish()?;
        Ok(Self {
            now,
            sample,
            frames,
            room,
        })
    }
}

impl Output {
    /// Makes the packet.
    pub fn encode(&self) -> Packet {
        let mut packet = Packet::new(Kind::Output);
        for drive in self.drives {
            let (code, setpoint) = match drive {
                Drive::Off => (0, Setpoint::default()),
                Drive::Brake => (1, Setpoint::default()),
                Drive::Current(setpoint) => (2, setpoint),
            };
            packet.put(&[code]);
            packet.put_i32(setpoint.current.to_microamps());
            packet.put_i32(setpoint.emf.to_millivolts());
        }
        packet.put_i32(self.trim_ns);
        packet.put(&[u8::from(self.chain_out)]);
        packet.put_frames(&self.frames);
        packet.finish()
    }

    /// Reads a packet's body.
    ///
    /// # Errors
    /// Where the bytes are no such body.
    pub fn decode(body: &[u8]) -> Result<Self, PacketError> {
        let mut reader = Reader { bytes: body };
        let mut drives = [Drive::Off; 3];
        for drive in &mut drives {
            *drive = match (reader.take_u8()?, reader.take_i32()?, reader.take_i32()?) {
                (0, 0, 0) => Drive::Off,
                (1, 0, 0) => Drive::Brake,
                (2, current, emf) => Drive::Current(Setpoint {
                    current: Current::from_microamps(current),
                    emf: Voltage::from_millivolts(emf),
                }),
                _ => return Err(PacketError::Value),
            };
        }
        let trim_ns = reader.take_i32()?;
        let chain_out = reader.take_bool()?;
        let frames = reader.take_frames()?;
        reader.finish()?;
        Ok(Self {
            drives,
            trim_ns,
            chain_out,
            frames,
        })
    }
}

fn put_sample(packet: &mut Packet, sample: &Sample) {
    sample
        .encoder_counts
        .into_iter()
        .for_each(|count| packet.put_i32(count));
    packet.put(&[to_bits(sample.absolute.map(|angle| angle.is_some()))]);
    for angle in sample.absolute {
        packet.put_i32(angle.unwrap_or(Angle::ZERO).to_q29());
    }
    sample
        .current
        .into_iter()
        .for_each(|current| packet.put_i32(current.to_microamps()));
    packet.put_i32(sample.supply.to_millivolts());
    packet.put_i32(sample.board_temperature.to_decidegrees());
    for temperature in sample.motor_temperature {
        packet.put_i32(temperature.to_decidegrees());
    }
    let stop = u8::from(sample.emergency_stop) << 3;
    let chain = u8::from(sample.chain_in) << 7;
    packet.put(&[to_bits(sample.bridge_fault) | stop | to_bits(sample.over_current) << 4 | chain]);
    let age = sample.sync_age.map_or(NO_SYNC, Duration::to_micros);
    packet.put(&age.to_le_bytes());
}

fn take_sample(reader: &mut Reader<'_>) -> Result<Sample, PacketError> {
    let encoder_counts = reader.take_three()?;
    let valid = from_bits(reader.take_u8()?)?;
    let angles = reader.take_three()?;
    let mut absolute = [None; 3];
    for ((to, valid), angle) in absolute.iter_mut().zip(valid).zip(angles) {
        if valid {
            *to = Some(Angle::from_q29(angle));
        } else if angle != 0 {
            return Err(PacketError::Value);
        }
    }
    let current = reader.take_three()?.map(Current::from_microamps);
    let supply = Voltage::from_millivolts(reader.take_i32()?);
    let board_temperature = Temperature::from_decidegrees(reader.take_i32()?);
    let motor_temperature = reader.take_three()?.map(Temperature::from_decidegrees);
    let flags = reader.take_u8()?;
    let age = u32::from_le_bytes(reader.take()?);
    Ok(Sample {
        encoder_counts,
        absolute,
        current,
        supply,
        board_temperature,
        motor_temperature,
        bridge_fault: from_bits(flags & 0x07)?,
        over_current: from_bits(flags >> 4 & 0x07)?,
        chain_in: flags & 1 << 7 != 0,
        sync_age: (age != NO_SYNC).then(|| Duration::from_micros(age)),
        emergency_stop: flags & 1 << 3 != 0,
    })
}

/// Makes three bits of three truths, the first one lowest.
const fn to_bits([one, two, three]: [bool; 3]) -> u8 {
    one as u8 | (two as u8) << 1 | (three as u8) << 2
}

/// Takes three bits apart; no other may be set.
const fn from_bits(bits: u8) -> Result<[bool; 3], PacketError> {
    if bits >= 1 << 3 {
        return Err(PacketError::Value);
    }
    Ok([bits & 1 != 0, bits & 2 != 0, bits & 4 != 0])
}

/// What is left of a body.
struct Reader<'body> {
    bytes: &'body [u8],
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], PacketError> {
        let (taken, left) = self.bytes.split_first_chunk().ok_or(PacketError::Length)?;
        self.bytes = left;
        Ok(*taken)
    }

    fn take_u8(&mut self) -> Result<u8, PacketError> {
        self.take().map(|[byte]| byte)
    }

    fn take_bool(&mut self) -> Result<bool, PacketError> {
        match self.take_u8()? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(PacketError::Value),
        }
    }

    fn take_i32(&mut self) -> Result<i32, PacketError> {
        self.take().map(i32::from_le_bytes)
    }

    fn take_three(&mut self) -> Result<[i32; 3], PacketError> {
        Ok([self.take_i32()?, self.take_i32()?, self.take_i32()?])
    }

    fn take_instant(&mut self) -> Result<Instant, PacketError> {
        self.take()
            .map(u64::from_le_bytes)
            .map(Instant::from_micros)
    }

    fn take_frames(&mut self) -> Result<Frames, PacketError> {
        let count = self.take_u8()?;
        if usize::from(count) > MAX_FRAMES {
            return Err(PacketError::Length);
        }
        let mut frames = Frames::new();
        for _ in 0..count {
            let frame = self.take_frame()?;
            frames.push(frame).map_err(|_| PacketError::Length)?;
        }
        Ok(frames)
    }

    fn take_frame(&mut self) -> Result<Frame, PacketError> {
        let word = u32::from_le_bytes(self.take()?);
        let length = self.take_u8()?;
        let data: [u8; 8] = self.take()?;
        let raw = word & !(EXTENDED | REMOTE);
        let id = if word & EXTENDED != 0 {
            ExtendedId::new(raw).map(Id::Extended)
        } else {
            u16::try_from(raw)
                .ok()
                .and_then(StandardId::new)
                .map(Id::Standard)
        };
        let id = id.ok_or(PacketError::Value)?;
        let is_remote = word & REMOTE != 0;
        let carried = if is_remote { 0 } else { usize::from(length) };
        let (used, unused) = data.split_at_checked(carried).ok_or(PacketError::Value)?;
        if unused.iter().any(|byte| *byte != 0) {
            return Err(PacketError::Value);
        }
        let frame = if is_remote {
            Frame::remote(id, length)
        } else {
            Frame::new(id, used)
        };
        frame.ok_or(PacketError::Value)
    }

    /// Checks that nothing is left.
    const fn finish(self) -> Result<(), PacketError> {
        if self.bytes.is_empty() {
            Ok(())
        } else {
            Err(PacketError::Length)
        }
    }
}

#[cfg(test)]
mod tests;
