//! The communication area that the CANopen node serves, as the EDS describes it.
//!
//! A test of the whole (`tests/tests/wire.rs`) holds it against the objects of a running node.

use core::fmt;

use crate::identity;
use crate::ids::{Cob, SYNC_COUNTER_OVERFLOW};
use crate::ids::{ERROR_BEHAVIOUR, HEAD_HEARTBEAT_TIMEOUT_MS, HEAD_NODE, VERTEBRA_HEARTBEAT_MS};

/// Bit of object 0x1012: the node consumes TIME.
const CONSUMES_TIME: u32 = 1 << 31;

/// The default of an entry, as the EDS prints it.
#[derive(Clone, Copy)]
pub enum Default {
    /// There is none: the device alone knows.
    Unknown,
    /// A number, in hexadecimal.
    Hex(u32),
    /// A number to which the node id is added.
    PlusNodeId(u32),
    /// A text.
    Text(&'static str),
}

/// Data types that occur in the communication area.
#[derive(Clone, Copy)]
pub enum Type {
    /// UNSIGNED8.
    U8 = 5,
    /// UNSIGNED16.
    U16 = 6,
    /// UNSIGNED32.
    U32 = 7,
    /// VISIBLE_STRING.
    Text = 9,
    /// DOMAIN.
    Domain = 15,
}

/// How an object is built of entries.
#[derive(Clone, Copy)]
pub enum Shape {
    /// One entry, subindex 0.
    Variable,
    /// Entries of one type.
    Array,
    /// Entries of several types.
    Record,
    /// One entry, subindex 0, which is a domain.
    Domain,
}

/// One entry.
#[derive(Clone, Copy)]
pub struct Item {
    pub subindex: u8,
    pub name: &'static str,
    pub data_type: Type,
    pub access: &'static str,
    pub default: Default,
    /// Whether a TPDO may carry it.
    pub mappable: bool,
}

/// One object.
pub struct Area {
    pub index: u16,
    pub name: &'static str,
    pub shape: Shape,
    pub items: &'static [Item],
}

impl fmt::Display for Default {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => Ok(()),
            Self::Hex(number) => write!(out, "0x{number:X}"),
            Self::PlusNodeId(number) => write!(out, "$NODEID+0x{number:X}"),
            Self::Text(text) => out.write_str(text),
        }
    }
}

impl Shape {
    /// Returns the object code of CiA 301, 7.4.3.
    pub const fn code(self) -> u8 {
        match self {
            Self::Variable => 7,
            Self::Array => 8,
            Self::Record => 9,
            Self::Domain => 2,
        }
    }
}

const fn item(
    subindex: u8,
    name: &'static str,
    data_type: Type,
    access: &'static str,
    default: Default,
) -> Item {
    Item {
        subindex,
        name,
        data_type,
        access,
        default,
        mappable: false,
    }
}

/// Makes the entry 0 of an array or record.
pub const fn highest(number: u32, access: &'static str) -> Item {
    item(
        0,
        "Highest subindex",
        Type::U8,
        access,
        Default::Hex(number),
    )
}

/// Makes an object of one entry.
macro_rules! variable {
    ($index:literal, $name:literal, $type:ident, $access:literal, $default:expr) => {
        Area {
            index: $index,
            name: $name,
            shape: Shape::Variable,
            items: &[item(0, $name, Type::$type, $access, $default)],
        }
    };
}

/// The whole area but the PDOs, which [`crate::pdo`] holds.
pub const AREA: &[Area] = &[
    variable!(
        0x1000,
        "Device type",
        U32,
        "const",
        Default::Hex(identity::DEVICE_TYPE)
    ),
    Area {
        index: 0x1001,
        name: "Error register",
        shape: Shape::Variable,
        items: &[Item {
            mappable: true,
            ..item(0, "Error register", Type::U8, "ro", Default::Unknown)
        }],
    },
    Area {
        index: 0x1003,
        name: "Pre-defined error field",
        shape: Shape::Array,
        items: &[
            item(0, "Number of errors", Type::U8, "rw", Default::Hex(0)),
            item(1, "Newest error", Type::U32, "ro", Default::Unknown),
            item(2, "Error 2", Type::U32, "ro", Default::Unknown),
            item(3, "Error 3", Type::U32, "ro", Default::Unknown),
            item(4, "Error 4", Type::U32, "ro", Default::Unknown),
            item(5, "Error 5", Type::U32, "ro", Default::Unknown),
            item(6, "Error 6", Type::U32, "ro", Default::Unknown),
            item(7, "Error 7", Type::U32, "ro", Default::Unknown),
            item(8, "Error 8", Type::U32, "ro", Default::Unknown),
        ],
    },
    variable!(
        0x1005,
        "COB-ID SYNC",
        U32,
        "rw",
        Default::Hex(Cob::Sync.id() as u32)
    ),
    variable!(
        0x1008,
        "Manufacturer device name",
        Text,
        "const",
        Default::Text(identity::DEVICE_NAME)
    ),
    variable!(
        0x1009,
        "Manufacturer hardware version",
        Text,
        "const",
        Default::Unknown
    ),
    variable!(
        0x100A,
        "Manufacturer software version",
        Text,
        "const",
        Default::Text(identity::SOFTWARE_VERSION)
    ),
    Area {
        index: 0x1010,
        name: "Store parameters",
        shape: Shape::Array,
        items: &[
            highest(3, "const"),
            item(1, "All", Type::U32, "rw", Default::Hex(1)),
            item(2, "Communication", Type::U32, "rw", Default::Hex(1)),
            item(3, "Application", Type::U32, "rw", Default::Hex(1)),
        ],
    },
    Area {
        index: 0x1011,
        name: "Restore default parameters",
        shape: Shape::Array,
        items: &[
            highest(3, "const"),
            item(1, "All", Type::U32, "rw", Default::Hex(1)),
            item(2, "Communication", Type::U32, "rw", Default::Hex(1)),
            item(3, "Application", Type::U32, "rw", Default::Hex(1)),
        ],
    },
    variable!(
        0x1012,
        "COB-ID TIME",
        U32,
        "rw",
        Default::Hex(CONSUMES_TIME | Cob::Time.id() as u32)
    ),
    variable!(
        0x1014,
        "COB-ID EMCY",
        U32,
        "rw",
        Default::PlusNodeId(Cob::Emergency(0).id() as u32)
    ),
    variable!(0x1015, "Inhibit time EMCY", U16, "rw", Default::Hex(0)),
    Area {
        index: 0x1016,
        name: "Consumer heartbeat time",
        shape: Shape::Array,
        items: &[
            highest(1, "const"),
            item(
                1,
                "Head",
                Type::U32,
                "rw",
                Default::Hex((HEAD_NODE as u32) << 16 | HEAD_HEARTBEAT_TIMEOUT_MS as u32),
            ),
        ],
    },
    variable!(
        0x1017,
        "Producer heartbeat time",
        U16,
        "rw",
        Default::Hex(VERTEBRA_HEARTBEAT_MS as u32)
    ),
    Area {
        index: 0x1018,
        name: "Identity object",
        shape: Shape::Record,
        items: &[
            highest(4, "const"),
            item(
                1,
                "Vendor-ID",
                Type::U32,
                "const",
                Default::Hex(identity::VENDOR),
            ),
            item(
                2,
                "Product code",
                Type::U32,
                "const",
                Default::Hex(identity::PRODUCT),
            ),
            item(
                3,
                "Revision number",
                Type::U32,
                "const",
                Default::Hex(identity::REVISION),
            ),
            item(4, "Serial number", Type::U32, "const", Default::Unknown),
        ],
    },
    variable!(
        0x1019,
        "Synchronous counter overflow value",
        U8,
        "rw",
        Default::Hex(SYNC_COUNTER_OVERFLOW as u32)
    ),
    Area {
        index: 0x1021,
        name: "Store EDS",
        shape: Shape::Domain,
        items: &[item(0, "Store EDS", Type::Domain, "ro", Default::Unknown)],
    },
    variable!(0x1022, "Store format", U8, "ro", Default::Hex(0)),
    Area {
        index: 0x1029,
        name: "Error behaviour",
        shape: Shape::Array,
        items: &[
            highest(1, "const"),
            item(
                1,
                "Communication error",
                Type::U8,
                "rw",
                Default::Hex(ERROR_BEHAVIOUR as u32),
            ),
        ],
    },
    Area {
        index: 0x1200,
        name: "SDO server parameter",
        shape: Shape::Record,
        items: &[
            highest(2, "const"),
            item(
                1,
                "COB-ID client to server",
                Type::U32,
                "const",
                Default::PlusNodeId(Cob::SdoRequest(0).id() as u32),
            ),
            item(
                2,
                "COB-ID server to client",
                Type::U32,
                "const",
                Default::PlusNodeId(Cob::SdoResponse(0).id() as u32),
            ),
        ],
    },
];

/// Makes an entry of a PDO record, whose default the PDO tells.
const fn parameter(subindex: u8, name: &'static str, data_type: Type) -> Item {
    item(subindex, name, data_type, "rw", Default::Hex(0))
}

/// The parameters of a TPDO; an RPDO has the first two.
pub const PARAMETERS: [Item; 5] = [
    parameter(1, "COB-ID", Type::U32),
    parameter(2, "Transmission type", Type::U8),
    parameter(3, "Inhibit time", Type::U16),
    parameter(5, "Event timer", Type::U16),
    parameter(6, "SYNC start value", Type::U8),
];

/// The count of a mapping, and the first of its entries.
pub const MAPPED: [Item; 2] = [
    parameter(0, "Number of mapped objects", Type::U8),
    parameter(1, "Mapped object", Type::U32),
];

/// Returns the name of an object of the communication area, such as `Device type`.
pub fn communication_name(index: u16) -> Option<&'static str> {
    let exact = AREA
        .iter()
        .find(|area| area.index == index)
        .map(|area| area.name);
    exact.or(match index {
        0x1400..=0x15FF => Some("RPDO communication parameter"),
        0x1600..=0x17FF => Some("RPDO mapping parameter"),
        0x1800..=0x19FF => Some("TPDO communication parameter"),
        0x1A00..=0x1BFF => Some("TPDO mapping parameter"),
        _ => None,
    })
}
