//! The SDO server (CiA 301, 7.2.4): expedited and segmented transfers, one at a time.
//!
//! Block transfers are answered with [`Abort::Command`].

mod server;

pub(crate) use server::Server;

/// The longest value that a segmented transfer carries, in bytes.
pub const SDO_BUFFER: usize = 128;
