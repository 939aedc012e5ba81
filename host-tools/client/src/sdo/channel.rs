//! The two identifiers of a node's SDO server during one transfer.

use std::time::{Duration, Instant};

use eel_protocol::Cob;
use eel_transport::Bus;

use crate::client::Client;
use crate::error::{ClientError, Multiplexor, Violation};

/// The abort code of silence.
const TIMED_OUT: u32 = 0x0504_0000;
/// The command of an abort.
const ABORT: u8 = 0x80;

/// One transfer with one node.
pub struct Channel<'a, B> {
    client: &'a mut Client<B>,
    node: u8,
    object: Multiplexor,
}

impl<'a, B: Bus> Channel<'a, B> {
    /// Begins a transfer; answers to earlier ones are forgotten.
    pub fn open(
        client: &'a mut Client<B>,
        node: u8,
        object: Multiplexor,
    ) -> Result<Self, ClientError> {
        client.drain()?;
        Ok(Self {
            client,
            node,
            object,
        })
    }

    /// Returns the most bytes of a value that is read.
    pub const fn longest(&self) -> usize {
        self.client.settings().longest
    }

    /// Returns the longest wait for an answer.
    pub const fn patience(&self) -> Duration {
        self.client.settings().answer
    }

    /// Returns the silence after which missing segments are asked for.
    pub const fn quiet(&self) -> Duration {
        self.client.settings().quiet
    }

    /// Sends eight bytes to the server.
    pub fn send(&mut self, data: [u8; 8]) -> Result<(), ClientError> {
        self.client.send(Cob::SdoRequest(self.node).id(), &data)
    }

    /// Sends a frame that names the object.
    pub fn initiate(&mut self, command: u8, rest: [u8; 4]) -> Result<(), ClientError> {
        let [low, high, subindex] = self.object.bytes();
        let [a, b, c, d] = rest;
        self.send([command, low, high, subindex, a, b, c, d])
    }

    /// Tells the server that the transfer has ended.
    pub fn abort(&mut self, code: u32) -> Result<(), ClientError> {
        self.initiate(ABORT, code.to_le_bytes())
    }

    /// Waits for a frame of the server; `None` where none came within `wait`.
    pub fn receive(&mut self, wait: Duration) -> Result<Option<[u8; 8]>, ClientError> {
        let deadline = Instant::now() + wait;
        self.receive_until(deadline)
    }

    fn receive_until(&mut self, deadline: Instant) -> Result<Option<[u8; 8]>, ClientError> {
        let id = Cob::SdoResponse(self.node).id();
        while let Some(data) = self.client.await_frame(id, deadline)? {
            let [command, low, high, subindex, code @ ..] = data;
            if command != ABORT {
                return Ok(Some(data));
            }
            // Servers that no longer know the object name 0; what names another is not for us.
            let named = [low, high, subindex];
            if named == self.object.bytes() || named == [0; 3] {
                return Err(ClientError::Aborted {
                    node: self.node,
                    object: self.object,
                    code: u32::from_le_bytes(code),
                });
            }
        }
        Ok(None)
    }

    /// Waits for the answer to a frame that names no object; silence ends the transfer.
    pub fn answer(&mut self) -> Result<[u8; 8], ClientError> {
        match self.receive(self.patience())? {
            Some(data) => Ok(data),
            None => Err(self.silence()),
        }
    }

    /// Waits for the answer to an initiation; those that name another object are another client's.
    pub fn initiated(&mut self) -> Result<[u8; 8], ClientError> {
        let deadline = Instant::now() + self.patience();
        while let Some(data) = self.receive_until(deadline)? {
            let [_, low, high, subindex, ..] = data;
            if [low, high, subindex] == self.object.bytes() {
                return Ok(data);
            }
        }
        Err(self.silence())
    }

    /// Ends the transfer because the server is silent.
    pub fn silence(&mut self) -> ClientError {
        match self.abort(TIMED_OUT) {
            Ok(()) => ClientError::Timeout {
                node: self.node,
                object: self.object,
            },
            Err(error) => error,
        }
    }

    /// Ends the transfer because the server broke the rules.
    pub fn refuse(&mut self, violation: Violation) -> ClientError {
        match self.abort(violation.code()) {
            Ok(()) => ClientError::Protocol {
                node: self.node,
                object: self.object,
                violation,
            },
            Err(error) => error,
        }
    }
}
