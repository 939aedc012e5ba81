//! What is kept and streamed beside the control: the scope, the freeze frame while it is read, the test
//! of transfers, the data sheet. It outlives a reset of the node.

mod link;
mod scope;

use eel_canopen::Abort;
use eel_protocol::eds::{self, Grammar};
use eel_protocol::freeze::FREEZE_BYTES;

pub(crate) use link::Link;
pub(crate) use scope::Scope;

/// Everything of it.
#[derive(Clone, Debug)]
pub(crate) struct Records {
    pub scope: Scope,
    pub link: Link,
    /// The freeze frame that is being read, which may no longer be the last.
    pub frozen: [u8; FREEZE_BYTES],
    sheet: eds::Reader,
}

impl Records {
    pub fn new() -> Self {
        Self {
            scope: Scope::default(),
            link: Link::default(),
            frozen: [0; FREEZE_BYTES],
            sheet: eds::Reader::default(),
        }
    }

    /// Opens the data sheet and returns its length.
    pub fn open_sheet(&mut self) -> Result<u32, Abort> {
        self.sheet = eds::Reader::default();
        sheet().map(|grammar| grammar.length())
    }

    /// Copies the data sheet from `offset` on.
    pub fn read_sheet(&mut self, offset: u32, out: &mut [u8]) -> Result<usize, Abort> {
        Ok(self.sheet.read(&sheet()?, offset, out))
    }

    /// Copies the opened freeze frame from `offset` on.
    pub fn read_frozen(&self, offset: u32, out: &mut [u8]) -> usize {
        let rest = self.frozen.get(offset as usize..).unwrap_or_default();
        let mut count = 0;
        for (to, from) in out.iter_mut().zip(rest) {
            *to = *from;
            count += 1;
        }
        count
    }
}

/// Returns the data sheet, which is whole: a test of eel-protocol reads all of it.
fn sheet() -> Result<Grammar<'static>, Abort> {
    Grammar::new(eds::COMPRESSED).ok_or(Abort::NoData)
}
