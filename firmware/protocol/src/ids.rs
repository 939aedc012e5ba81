//! Who is who on the bus: node ids, COB-IDs, periods.

/// Vertebrae of the eel, and the highest node id of one.
pub const VERTEBRAE: u8 = 10;
/// Node id of the head.
pub const HEAD_NODE: u8 = 127;
/// Time between two SYNCs in µs: 100 Hz.
pub const SYNC_PERIOD_US: u32 = 10_000;
/// Highest counter of SYNC, after which it is 1 again; object 0x1019.
pub const SYNC_COUNTER_OVERFLOW: u8 = 240;
/// Time between two heartbeats of the head in ms.
pub const HEAD_HEARTBEAT_MS: u16 = 100;
/// Silence of the head after which a vertebra lets go, in ms.
pub const HEAD_HEARTBEAT_TIMEOUT_MS: u16 = 300;
/// Time between two heartbeats of a vertebra in ms.
pub const VERTEBRA_HEARTBEAT_MS: u16 = 200;
/// Object 0x1029:1: a vertebra stays Operational when communication fails, as it lets go by itself
/// and goes on telling how it is.
pub const ERROR_BEHAVIOUR: u8 = 1;

/// The node id of a vertebra: its position, 1 behind the head to 10 at the tail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(u8);

impl NodeId {
    /// The vertebra behind the head.
    pub const FIRST: Self = Self(1);

    /// Makes a vertebra's node id; `None` outside 1–10.
    pub const fn new(raw: u8) -> Option<Self> {
        if raw >= 1 && raw <= VERTEBRAE {
            Some(Self(raw))
        } else {
            None
        }
    }

    /// Returns the number, 1–10.
    #[inline]
    pub const fn get(self) -> u8 {
        self.0
    }

    /// Returns the position in the chain counted from 0.
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize - 1
    }

    /// Returns all ten in order.
    pub fn all() -> impl DoubleEndedIterator<Item = Self> + Clone {
        (1..=VERTEBRAE).map(Self)
    }
}

/// What a standard identifier means on this bus (CiA 301, 7.3.5, and BUS in docs/bus.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cob {
    /// Network management.
    Nmt,
    /// The beat of the bus.
    Sync,
    /// Emergency of a node.
    Emergency(u8),
    /// The time of day.
    Time,
    /// RPDO1 of a vertebra: target pose.
    Target(u8),
    /// RPDO2 of a vertebra: feed-forward moment and stiffness.
    Moment(u8),
    /// TPDO1 of a vertebra: pose.
    Pose(u8),
    /// TPDO2 of a vertebra: effort.
    Effort(u8),
    /// SDO from a node to its client.
    SdoResponse(u8),
    /// SDO from a client to a node.
    SdoRequest(u8),
    /// Heartbeat or boot-up of a node.
    Heartbeat(u8),
    /// LSS answer.
    LssResponse,
    /// LSS request.
    LssRequest,
    /// Nothing that this bus knows.
    Other(u16),
}

impl Cob {
    /// Classifies an 11-bit identifier.
    pub const fn from_id(id: u16) -> Self {
        let node = (id & 0x7F) as u8;
        match id {
            0x000 => return Self::Nmt,
            0x080 => return Self::Sync,
            0x100 => return Self::Time,
            0x7E4 => return Self::LssResponse,
            0x7E5 => return Self::LssRequest,
            _ => {}
        }
        if node == 0 {
            return Self::Other(id);
        }
        match id & 0x780 {
            0x080 => Self::Emergency(node),
            0x180 => Self::Pose(node),
            0x200 => Self::Target(node),
            0x280 => Self::Effort(node),
            0x300 => Self::Moment(node),
            0x580 => Self::SdoResponse(node),
            0x600 => Self::SdoRequest(node),
            0x700 => Self::Heartbeat(node),
            _ => Self::Other(id),
        }
    }

    /// Returns the 11-bit identifier.
    pub const fn id(self) -> u16 {
        match self {
            Self::Nmt => 0x000,
            Self::Sync => 0x080,
            Self::Time => 0x100,
            Self::Emergency(node) => 0x080 + (node & 0x7F) as u16,
            Self::Pose(node) => 0x180 + (node & 0x7F) as u16,
            Self::Target(node) => 0x200 + (node & 0x7F) as u16,
            Self::Effort(node) => 0x280 + (node & 0x7F) as u16,
            Self::Moment(node) => 0x300 + (node & 0x7F) as u16,
            Self::SdoResponse(node) => 0x580 + (node & 0x7F) as u16,
            Self::SdoRequest(node) => 0x600 + (node & 0x7F) as u16,
            Self::Heartbeat(node) => 0x700 + (node & 0x7F) as u16,
            Self::LssResponse => 0x7E4,
            Self::LssRequest => 0x7E5,
            Self::Other(id) => id & 0x7FF,
        }
    }

    /// Returns the node the identifier belongs to.
    pub const fn node(self) -> Option<u8> {
        match self {
            Self::Emergency(node)
            | Self::Pose(node)
            | Self::Target(node)
            | Self::Effort(node)
            | Self::Moment(node)
            | Self::SdoResponse(node)
            | Self::SdoRequest(node)
            | Self::Heartbeat(node) => Some(node),
            _ => None,
        }
    }
}
