//! The SDO server (CiA 301, 7.2.4): expedited, segmented and block transfers, one at a time.
//!
//! A value is held whole in a buffer: it is read at once, and written only when all of it has come
//! and held. A domain streams through the same buffer, which then keeps the block that is on its way,
//! so that segments that get lost are sent again without asking the application twice.
//!
//! In a block download a segment can't be told from a request, and a client listens only at the end
//! of a block. So what is wrong in the middle of a block is answered at its end: an abort in between
//! would have the rest of the block taken for requests.
//!
//! Deliberately absent: a second channel, the client's side, transfers between nodes.

mod block;
mod crc;
mod download;
mod server;
mod upload;

pub(crate) use server::Server;

/// The longest value that a transfer carries, in bytes: a block of 127 segments. Domains may be longer.
pub const SDO_BUFFER: usize = SEGMENT * BLOCK as usize;

/// What a segment carries, in bytes.
const SEGMENT: usize = 7;
/// The most segments in a block.
const BLOCK: u8 = 127;

type Buffer = [u8; SDO_BUFFER];
type Message = [u8; 8];

/// An object as a transfer names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Multiplexor {
    index: u16,
    subindex: u8,
}

impl Multiplexor {
    /// What an abort names when nothing is being transferred.
    const NONE: Self = Self {
        index: 0,
        subindex: 0,
    };
}

/// Makes a message that names its object.
fn message(command: u8, object: Multiplexor, data: [u8; 4]) -> Message {
    let [low, high] = object.index.to_le_bytes();
    let [a, b, c, d] = data;
    [command, low, high, object.subindex, a, b, c, d]
}
