//! Process data: what both directions have in common (CiA 301, 7.2.2, objects 0x1400–0x1BFF).

mod parameters;
mod rpdo;
mod tpdo;

pub(crate) use parameters::{Direction, Parameters};
pub(crate) use rpdo::{Received, Rpdo};
pub(crate) use tpdo::Tpdo;

/// The most objects in a PDO.
pub(crate) const MAPPED_OBJECTS: usize = 8;
