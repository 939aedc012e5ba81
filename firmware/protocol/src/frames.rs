//! The four process data frames as values, packed and unpacked.

use eel_canopen::Frame;
use eel_units::{Angle, Torque};

use crate::crc::protection;
use crate::ids::{Cob, NodeId};
use crate::states::{LimitCode, Mode, State};

/// A sequence counter of four bits: 0–14, then 0 again; 15 never occurs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counter(u8);

impl Counter {
    /// Makes a counter; `None` above 14.
    pub const fn new(raw: u8) -> Option<Self> {
        if raw <= 14 { Some(Self(raw)) } else { None }
    }

    /// Returns the number, 0–14.
    pub const fn get(self) -> u8 {
        self.0
    }

    /// Returns the counter of the following frame.
    #[must_use]
    pub const fn next(self) -> Self {
        if self.0 >= 14 {
            Self(0)
        } else {
            Self(self.0 + 1)
        }
    }

    /// Returns how many steps lead from `earlier` to this counter, 0–14.
    pub const fn since(self, earlier: Self) -> u8 {
        if self.0 >= earlier.0 {
            self.0 - earlier.0
        } else {
            self.0 + 15 - earlier.0
        }
    }
}

/// Why a frame is not the one it should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The identifier belongs to another kind of frame.
    Identifier,
    /// The frame has another number of bytes.
    Length,
    /// The protection byte does not match.
    Crc,
    /// A code or a counter means nothing.
    Value,
}

/// RPDO1: the pose that a vertebra shall take, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// About x, swimming; 10⁻⁴ rad on the wire.
    pub yaw: Angle,
    /// About y, diving; 10⁻⁴ rad on the wire.
    pub pitch: Angle,
    /// About z, torsion; 10⁻⁴ rad on the wire.
    pub roll: Angle,
    /// What to do.
    pub mode: Mode,
    /// Goes up by one with every frame to this vertebra.
    pub counter: Counter,
}

/// TPDO1: the pose that a vertebra has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoseReport {
    /// About x; 10⁻⁴ rad on the wire.
    pub yaw: Angle,
    /// About y; 10⁻⁴ rad on the wire.
    pub pitch: Angle,
    /// About z; 10⁻⁴ rad on the wire.
    pub roll: Angle,
    /// What the vertebra is doing.
    pub state: State,
    /// Goes up by one with every frame from this vertebra.
    pub counter: Counter,
}

/// RPDO2: a moment to add, and how stiff to be; off by default.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Moment {
    /// Feed-forward moment about x, y, z of the base; mN·m on the wire.
    pub moment: [Torque; 3],
    /// Scale of the configured stiffness in 2⁻¹⁵: 0x8000 is 1, at most 2.
    pub stiffness: u16,
}

/// Four flags beside the limit codes of TPDO2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags {
    /// The target was outside the workspace and has been limited.
    pub target_limited: bool,
    /// Part of the moment could not be produced.
    pub moment_limited: bool,
    /// Targets stopped coming; the vertebra is slowing down or has let go.
    pub command_lost: bool,
    /// A warning that is no fault is active.
    pub warning: bool,
}

/// TPDO2: the torques of the motors and what bounds them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Torque of each motor; mN·m on the wire.
    pub torque: [Torque; 3],
    /// What bounds each motor.
    pub limit: [LimitCode; 3],
    /// Conditions of the whole wrist.
    pub flags: Flags,
}

/// Packs three angles and a byte under protection.
fn pack_protected(angles: [Angle; 3], code: u8, cob_id: u16) -> [u8; 8] {
    let [y, p, r] = angles.map(|angle| angle.to_tenth_milliradians().to_le_bytes());
    let body = [y[0], y[1], p[0], p[1], r[0], r[1], code];
    [
        y[0],
        y[1],
        p[0],
        p[1],
        r[0],
        r[1],
        code,
        protection(&body, cob_id),
    ]
}

/// Unpacks three angles, a code and a counter, and checks the protection.
fn unpack_protected(bytes: &[u8; 8], cob_id: u16) -> Result<([Angle; 3], u8, Counter), FrameError> {
    let [y0, y1, p0, p1, r0, r1, code, crc] = *bytes;
    if protection(&[y0, y1, p0, p1, r0, r1, code], cob_id) != crc {
        return Err(FrameError::Crc);
    }
    let angles = [[y0, y1], [p0, p1], [r0, r1]]
        .map(|bytes| Angle::from_tenth_milliradians(i16::from_le_bytes(bytes)));
    let counter = Counter::new(code >> 4).ok_or(FrameError::Value)?;
    Ok((angles, code & 0x0F, counter))
}

/// Returns the eight bytes of a data frame.
fn payload(frame: &Frame) -> Result<[u8; 8], FrameError> {
    frame.data().try_into().map_err(|_| FrameError::Length)
}

impl Target {
    /// Packs the target as RPDO1's eight bytes under `cob_id`.
    pub fn to_bytes(&self, cob_id: u16) -> [u8; 8] {
        let code = self.mode.code() | (self.counter.get() << 4);
        pack_protected([self.yaw, self.pitch, self.roll], code, cob_id)
    }

    /// Unpacks RPDO1's eight bytes received under `cob_id`.
    ///
    /// # Errors
    /// [`FrameError::Crc`], or [`FrameError::Value`] for a mode or counter that does not exist.
    pub fn from_bytes(bytes: &[u8; 8], cob_id: u16) -> Result<Self, FrameError> {
        let ([yaw, pitch, roll], code, counter) = unpack_protected(bytes, cob_id)?;
        let mode = Mode::from_code(code).ok_or(FrameError::Value)?;
        Ok(Self {
            yaw,
            pitch,
            roll,
            mode,
            counter,
        })
    }

    /// Unpacks a target frame with the vertebra it is for.
    ///
    /// # Errors
    /// Any [`FrameError`].
    pub fn from_frame(frame: &Frame) -> Result<(NodeId, Self), FrameError> {
        let id = frame.cob_id().ok_or(FrameError::Identifier)?;
        let Cob::Target(node) = Cob::from_id(id) else {
            return Err(FrameError::Identifier);
        };
        let node = NodeId::new(node).ok_or(FrameError::Identifier)?;
        Ok((node, Self::from_bytes(&payload(frame)?, id)?))
    }

    /// Returns the frame that carries the target to `node`.
    pub fn to_frame(&self, node: NodeId) -> Option<Frame> {
        let id = Cob::Target(node.get()).id();
        Frame::standard(id, &self.to_bytes(id))
    }
}

impl PoseReport {
    /// Packs the report as TPDO1's eight bytes under `cob_id`.
    pub fn to_bytes(&self, cob_id: u16) -> [u8; 8] {
        let code = self.state.code() | (self.counter.get() << 4);
        pack_protected([self.yaw, self.pitch, self.roll], code, cob_id)
    }

    /// Unpacks TPDO1's eight bytes received under `cob_id`.
    ///
    /// # Errors
    /// [`FrameError::Crc`], or [`FrameError::Value`] for a state or counter that does not exist.
    pub fn from_bytes(bytes: &[u8; 8], cob_id: u16) -> Result<Self, FrameError> {
        let ([yaw, pitch, roll], code, counter) = unpack_protected(bytes, cob_id)?;
        let state = State::from_code(code).ok_or(FrameError::Value)?;
        Ok(Self {
            yaw,
            pitch,
            roll,
            state,
            counter,
        })
    }

    /// Unpacks a pose frame with its sender.
    ///
    /// # Errors
    /// Any [`FrameError`].
    pub fn from_frame(frame: &Frame) -> Result<(NodeId, Self), FrameError> {
        let id = frame.cob_id().ok_or(FrameError::Identifier)?;
        let Cob::Pose(node) = Cob::from_id(id) else {
            return Err(FrameError::Identifier);
        };
        let node = NodeId::new(node).ok_or(FrameError::Identifier)?;
        Ok((node, Self::from_bytes(&payload(frame)?, id)?))
    }
}

impl Moment {
    /// Packs the moment as RPDO2's eight bytes.
    pub fn to_bytes(&self) -> [u8; 8] {
        let [x, y, z] = self
            .moment
            .map(|torque| torque.to_millinewton_metres().to_le_bytes());
        let s = self.stiffness.to_le_bytes();
        [x[0], x[1], y[0], y[1], z[0], z[1], s[0], s[1]]
    }

    /// Unpacks RPDO2's eight bytes; every pattern is a moment.
    pub fn from_bytes(bytes: &[u8; 8]) -> Self {
        let [x0, x1, y0, y1, z0, z1, s0, s1] = *bytes;
        let moment = [[x0, x1], [y0, y1], [z0, z1]]
            .map(|pair| Torque::from_millinewton_metres(i32::from(i16::from_le_bytes(pair))));
        Self {
            moment,
            stiffness: u16::from_le_bytes([s0, s1]),
        }
    }
}

impl Flags {
    /// Returns the four bits: target, moment, command, warning from bit 0.
    pub const fn to_bits(self) -> u8 {
        self.target_limited as u8
            | (self.moment_limited as u8) << 1
            | (self.command_lost as u8) << 2
            | (self.warning as u8) << 3
    }

    /// Reads the four low bits.
    pub const fn from_bits(bits: u8) -> Self {
        Self {
            target_limited: bits & 1 != 0,
            moment_limited: bits & 2 != 0,
            command_lost: bits & 4 != 0,
            warning: bits & 8 != 0,
        }
    }
}

impl Effort {
    /// Packs the effort as TPDO2's eight bytes.
    pub fn to_bytes(&self) -> [u8; 8] {
        let [a, b, c] = self
            .torque
            .map(|torque| torque.to_millinewton_metres().to_le_bytes());
        let [la, lb, lc] = self.limit.map(LimitCode::code);
        [
            a[0],
            a[1],
            b[0],
            b[1],
            c[0],
            c[1],
            la | (lb << 4),
            lc | (self.flags.to_bits() << 4),
        ]
    }

    /// Returns the last two bytes as a number: object 0x2011:4.
    pub fn limits(&self) -> u16 {
        let [_, _, _, _, _, _, low, high] = self.to_bytes();
        u16::from_le_bytes([low, high])
    }

    /// Unpacks TPDO2's eight bytes.
    ///
    /// # Errors
    /// [`FrameError::Value`] for a limit code that does not exist.
    pub fn from_bytes(bytes: &[u8; 8]) -> Result<Self, FrameError> {
        let [a0, a1, b0, b1, c0, c1, low, high] = *bytes;
        let torque = [[a0, a1], [b0, b1], [c0, c1]]
            .map(|pair| Torque::from_millinewton_metres(i32::from(i16::from_le_bytes(pair))));
        let code = |code| LimitCode::from_code(code).ok_or(FrameError::Value);
        let limit = [code(low & 0x0F)?, code(low >> 4)?, code(high & 0x0F)?];
        Ok(Self {
            torque,
            limit,
            flags: Flags::from_bits(high >> 4),
        })
    }
}
