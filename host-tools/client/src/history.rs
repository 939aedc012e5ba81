//! The errors that a node remembers: object 0x1003.

use eel_transport::Bus;

use crate::client::Client;
use crate::error::{ClientError, Multiplexor};
use crate::sdo::Method;

/// Object 0x1003.
const HISTORY: u16 = 0x1003;

/// An error that a node remembers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PastError {
    /// The emergency's number.
    pub code: u16,
    /// What its maker adds.
    pub detail: u16,
}

impl<B: Bus> Client<B> {
    /// Reads a node's history of errors, the newest first.
    ///
    /// # Errors
    /// As [`upload`](Self::upload).
    pub fn history(&mut self, node: u8) -> Result<Vec<PastError>, ClientError> {
        let mut errors = Vec::new();
        let count = self.number(node, Multiplexor::new(HISTORY, 0))?;
        for subindex in 1..=count.min(254) as u8 {
            let raw = self.number(node, Multiplexor::new(HISTORY, subindex))?;
            errors.push(PastError {
                code: raw as u16,
                detail: (raw >> 16) as u16,
            });
        }
        Ok(errors)
    }

    /// Clears a node's history of errors.
    ///
    /// # Errors
    /// As [`download`](Self::download).
    pub fn clear_history(&mut self, node: u8) -> Result<(), ClientError> {
        let count = Multiplexor::new(HISTORY, 0);
        self.download(node, count, &[0], Method::Automatic, &mut |_| ())
    }

    /// Reads an unsigned number of up to four bytes; longer values are cut.
    ///
    /// # Errors
    /// As [`upload`](Self::upload).
    pub fn number(&mut self, node: u8, object: Multiplexor) -> Result<u32, ClientError> {
        let bytes = self.upload(node, object, Method::Automatic, &mut |_| ())?;
        let low = bytes.iter().take(4).rev();
        Ok(low.fold(0, |number, byte| number << 8 | u32::from(*byte)))
    }

    /// Reads a text; what is no UTF-8 is replaced, and zeros at the end are cut.
    ///
    /// # Errors
    /// As [`upload`](Self::upload).
    pub fn text(&mut self, node: u8, object: Multiplexor) -> Result<String, ClientError> {
        let bytes = self.upload(node, object, Method::Automatic, &mut |_| ())?;
        let text = String::from_utf8_lossy(&bytes);
        Ok(text.trim_end_matches('\0').to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::script::{Script, client};

    #[test]
    fn the_history_is_read_newest_first_and_cleared() {
        let mut client = client(Script::new([
            (
                (0x605, &[0x40, 0x03, 0x10, 0, 0, 0, 0, 0][..]),
                &[(0x585, &[0x4F, 0x03, 0x10, 0, 2, 0, 0, 0][..])][..],
            ),
            (
                (0x605, &[0x40, 0x03, 0x10, 1, 0, 0, 0, 0]),
                &[(0x585, &[0x43, 0x03, 0x10, 1, 0x30, 0x81, 0x7F, 0])],
            ),
            (
                (0x605, &[0x40, 0x03, 0x10, 2, 0, 0, 0, 0]),
                &[(0x585, &[0x43, 0x03, 0x10, 2, 0x10, 0x23, 0x34, 0x12])],
            ),
            (
                (0x605, &[0x2F, 0x03, 0x10, 0, 0, 0, 0, 0]),
                &[(0x585, &[0x60, 0x03, 0x10, 0, 0, 0, 0, 0])],
            ),
        ]));
        let expected = [(0x8130, 0x007F), (0x2310, 0x1234)];
        let expected = expected.map(|(code, detail)| PastError { code, detail });
        assert_eq!(client.history(5).unwrap(), expected);
        client.clear_history(5).unwrap();
        client.into_bus().finish();
    }
}
