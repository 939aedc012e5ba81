//! The SDO client (CiA 301, 7.2.4).

mod block;
mod channel;
mod crc;
mod segmented;
#[cfg(test)]
mod tests;

use eel_transport::Bus;

use crate::client::Client;
use crate::error::{ClientError, Multiplexor};
use channel::Channel;
use segmented::Begun;

/// The abort code of a server that does not know a kind of transfer.
const UNKNOWN_COMMAND: u32 = 0x0504_0001;
/// The abort code with which a transfer is given up for another kind.
const GIVEN_UP: u32 = 0x0800_0000;

/// How a value is transferred.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// As suits its length: up to four bytes in one frame, from
    /// [`Settings::block_from`](crate::Settings::block_from) bytes on in blocks where the node knows
    /// them, else in segments.
    #[default]
    Automatic,
    /// In segments, short values too. A node may answer a read in one frame nevertheless.
    Segmented,
    /// In blocks and never otherwise. A node may answer a read otherwise nevertheless.
    Block,
}

/// How far a transfer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Bytes transferred and acknowledged.
    pub done: usize,
    /// Bytes of the whole value, where they are known.
    pub total: Option<usize>,
}

impl<B: Bus> Client<B> {
    /// Reads an object's bytes.
    ///
    /// A read that gets no answer is tried again, [`Settings::attempts`](crate::Settings::attempts)
    /// times in all.
    ///
    /// # Errors
    /// [`ClientError::Aborted`], [`ClientError::Timeout`], [`ClientError::Protocol`] and
    /// [`ClientError::Bus`].
    pub fn upload(
        &mut self,
        node: u8,
        object: Multiplexor,
        method: Method,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Vec<u8>, ClientError> {
        let attempts = self.settings().attempts.max(1);
        let mut attempt = 1;
        loop {
            match self.try_upload(node, object, method, progress) {
                Err(ClientError::Timeout { .. }) if attempt < attempts => attempt += 1,
                result => return result,
            }
        }
    }

    /// Writes an object's bytes, once.
    ///
    /// # Errors
    /// As [`upload`](Self::upload). After [`ClientError::Timeout`] the value may have been written.
    pub fn download(
        &mut self,
        node: u8,
        object: Multiplexor,
        data: &[u8],
        method: Method,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<(), ClientError> {
        let in_blocks = match method {
            Method::Automatic => data.len() >= self.settings().block_from && self.may_block(node),
            Method::Segmented => false,
            Method::Block => true,
        };
        let mut channel = Channel::open(self, node, object)?;
        if in_blocks {
            match block::download(&mut channel, data, progress) {
                Err(error) if method == Method::Automatic && is_unknown(&error) => {
                    self.blockless |= bit(node);
                }
                result => return result,
            }
            channel = Channel::open(self, node, object)?;
        }
        if method == Method::Automatic && (1..=4).contains(&data.len()) {
            segmented::download_expedited(&mut channel, data)
        } else {
            segmented::download(&mut channel, data, progress)
        }
    }

    fn try_upload(
        &mut self,
        node: u8,
        object: Multiplexor,
        method: Method,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Vec<u8>, ClientError> {
        let block_from = self.settings().block_from;
        let may_block = method == Method::Automatic && self.may_block(node);
        let mut channel = Channel::open(self, node, object)?;
        if method == Method::Block {
            return block::upload(&mut channel, progress);
        }
        match segmented::begin_upload(&mut channel)? {
            Begun::Whole(data) => return Ok(data),
            Begun::Segments { total } => {
                let is_long = total.is_some_and(|total| total >= block_from);
                if !(may_block && is_long) {
                    return segmented::go_on_upload(&mut channel, total, progress);
                }
            }
        }
        channel.abort(GIVEN_UP)?;
        match block::upload(&mut channel, progress) {
            Err(error) if is_unknown(&error) => self.blockless |= bit(node),
            result => return result,
        }
        let mut channel = Channel::open(self, node, object)?;
        match segmented::begin_upload(&mut channel)? {
            Begun::Whole(data) => Ok(data),
            Begun::Segments { total } => segmented::go_on_upload(&mut channel, total, progress),
        }
    }

    const fn may_block(&self, node: u8) -> bool {
        self.blockless & bit(node) == 0
    }
}

const fn bit(node: u8) -> u128 {
    1 << (node & 0x7F)
}

const fn is_unknown(error: &ClientError) -> bool {
    matches!(error, ClientError::Aborted { code, .. } if *code == UNKNOWN_COMMAND)
}
