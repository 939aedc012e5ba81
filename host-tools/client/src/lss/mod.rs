//! The client as LSS master (CiA 305): finding nodes without an id by their identity, and giving ids.
//!
//! Every node that gets an id by these services must be reached alone first: by
//! [`switch_to`](Lss::switch_to), which needs its identity, or by [`scan`](Lss::scan), which finds it.

mod fastscan;
#[cfg(test)]
mod tests;

use std::fmt;
use std::time::Instant;

use eel_protocol::Cob;
use eel_transport::Bus;

use crate::client::Client;
use crate::error::{ClientError, LssFailure};

/// The services (CiA 305, 5).
const SWITCH_GLOBAL: u8 = 0x04;
const NODE_ID: u8 = 0x11;
const BIT_TIMING: u8 = 0x13;
const STORE: u8 = 0x17;
/// The first of four requests, one for each number of the identity, and the answer to the last.
const SWITCH_SELECTIVE: u8 = 0x40;
const SWITCHED: u8 = 0x44;
const NON_CONFIGURED: u8 = 0x4C;
const IDENTIFIED_NON_CONFIGURED: u8 = 0x50;
/// The first of four requests.
const INQUIRE_IDENTITY: u8 = 0x5A;
const INQUIRE_NODE_ID: u8 = 0x5E;

/// How much longer than usual a node may take to store.
const STORING: u32 = 50;

/// The identity of a node as LSS addresses it: object 0x1018.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LssAddress {
    /// The vendor's number.
    pub vendor: u32,
    /// The product's number.
    pub product: u32,
    /// The revision.
    pub revision: u32,
    /// The serial number.
    pub serial: u32,
}

/// Layer setting services over a client's bus.
#[derive(Debug)]
pub struct Lss<'a, B> {
    client: &'a mut Client<B>,
}

impl LssAddress {
    /// Returns the four numbers in the order of object 0x1018.
    #[must_use]
    pub const fn numbers(self) -> [u32; 4] {
        [self.vendor, self.product, self.revision, self.serial]
    }

    /// Makes an identity from the four numbers of object 0x1018.
    #[must_use]
    pub const fn from_numbers(numbers: [u32; 4]) -> Self {
        let [vendor, product, revision, serial] = numbers;
        Self {
            vendor,
            product,
            revision,
            serial,
        }
    }
}

impl fmt::Display for LssAddress {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            out,
            "vendor 0x{:08X} product 0x{:08X} revision 0x{:08X} serial 0x{:08X}",
            self.vendor, self.product, self.revision, self.serial
        )
    }
}

impl<B: Bus> Client<B> {
    /// Returns the layer setting services.
    pub const fn lss(&mut self) -> Lss<'_, B> {
        Lss { client: self }
    }
}

impl<B: Bus> Lss<'_, B> {
    /// Puts all nodes into the waiting state (`false`) or all into configuration (`true`). Nobody
    /// answers. A node that got an id boots with it once it waits again.
    ///
    /// # Errors
    /// What the bus fails with.
    pub fn switch_all(&mut self, to_configuration: bool) -> Result<(), ClientError> {
        self.send([SWITCH_GLOBAL, u8::from(to_configuration), 0, 0, 0, 0, 0, 0])
    }

    /// Puts the node with this identity into configuration.
    ///
    /// # Errors
    /// [`LssFailure::Silence`] where there is none, and what the bus fails with.
    pub fn switch_to(&mut self, address: LssAddress) -> Result<(), ClientError> {
        self.client.drain()?;
        for (number, command) in address.numbers().into_iter().zip(SWITCH_SELECTIVE..) {
            self.send(with_number(command, number))?;
        }
        self.answer(SWITCHED, 1).map(|_| ())
    }

    /// Returns the identity of the node in configuration.
    ///
    /// # Errors
    /// [`LssFailure::Silence`] where none is, and what the bus fails with.
    pub fn identity(&mut self) -> Result<LssAddress, ClientError> {
        let mut numbers = [0; 4];
        for (slot, command) in numbers.iter_mut().zip(INQUIRE_IDENTITY..) {
            let [_, a, b, c, d, ..] = self.ask([command, 0, 0, 0, 0, 0, 0, 0], 1)?;
            *slot = u32::from_le_bytes([a, b, c, d]);
        }
        Ok(LssAddress::from_numbers(numbers))
    }

    /// Returns the id of the node in configuration; `None` where it has none.
    ///
    /// # Errors
    /// [`LssFailure::Silence`] where none is in configuration, and what the bus fails with.
    pub fn node_id(&mut self) -> Result<Option<u8>, ClientError> {
        let [_, id, ..] = self.ask([INQUIRE_NODE_ID, 0, 0, 0, 0, 0, 0, 0], 1)?;
        Ok((1..=127).contains(&id).then_some(id))
    }

    /// Gives the node in configuration an id, 1–127; 255 takes it away. It holds after the next
    /// reset of communication, or at once where there was none before, and until power is off
    /// unless it is [`store`](Self::store)d.
    ///
    /// # Errors
    /// [`LssFailure::Refused`], [`LssFailure::Silence`], and what the bus fails with.
    pub fn set_node_id(&mut self, id: u8) -> Result<(), ClientError> {
        self.set([NODE_ID, id, 0, 0, 0, 0, 0, 0], 1)
    }

    /// Sets the bit rate of the node in configuration, by its place in a table; table 0 is CiA's,
    /// in which 0 is 1 Mbit/s.
    ///
    /// # Errors
    /// [`LssFailure::Refused`], [`LssFailure::Silence`], and what the bus fails with.
    pub fn set_bit_timing(&mut self, table: u8, place: u8) -> Result<(), ClientError> {
        self.set([BIT_TIMING, table, place, 0, 0, 0, 0, 0], 1)
    }

    /// Stores id and bit rate of the node in configuration.
    ///
    /// # Errors
    /// [`LssFailure::Refused`], [`LssFailure::Silence`], and what the bus fails with.
    pub fn store(&mut self) -> Result<(), ClientError> {
        self.set([STORE, 0, 0, 0, 0, 0, 0, 0], STORING)
    }

    /// Tells whether any node on the bus has no id.
    ///
    /// # Errors
    /// What the bus fails with.
    pub fn any_without_id(&mut self) -> Result<bool, ClientError> {
        match self.ask_for(
            [NON_CONFIGURED, 0, 0, 0, 0, 0, 0, 0],
            IDENTIFIED_NON_CONFIGURED,
            1,
        ) {
            Ok(_) => Ok(true),
            Err(ClientError::Lss(LssFailure::Silence)) => Ok(false),
            Err(error) => Err(error),
        }
    }

    fn set(&mut self, request: [u8; 8], times: u32) -> Result<(), ClientError> {
        let [service, ..] = request;
        match self.ask(request, times)? {
            [_, 0, ..] => Ok(()),
            [_, code, detail, ..] => Err(LssFailure::Refused {
                service,
                code,
                detail,
            }
            .into()),
        }
    }

    /// Sends a request and waits for the answer with the same command.
    fn ask(&mut self, request: [u8; 8], times: u32) -> Result<[u8; 8], ClientError> {
        let [command, ..] = request;
        self.ask_for(request, command, times)
    }

    fn ask_for(
        &mut self,
        request: [u8; 8],
        command: u8,
        times: u32,
    ) -> Result<[u8; 8], ClientError> {
        self.client.drain()?;
        self.send(request)?;
        self.answer(command, times)
    }

    fn send(&mut self, data: [u8; 8]) -> Result<(), ClientError> {
        self.client.send(Cob::LssRequest.id(), &data)
    }

    /// Waits for an answer, at most so many times the usual patience.
    fn answer(&mut self, command: u8, times: u32) -> Result<[u8; 8], ClientError> {
        // One answer is waited for longer than a step of a scan, as silence is not expected.
        const LONGER: u32 = 5;
        let patience = self.client.settings().lss * (times * LONGER);
        let deadline = Instant::now() + patience;
        let id = Cob::LssResponse.id();
        while let Some(data) = self.client.await_frame(id, deadline)? {
            if data.first() == Some(&command) {
                return Ok(data);
            }
        }
        Err(LssFailure::Silence.into())
    }
}

fn with_number(command: u8, number: u32) -> [u8; 8] {
    let [a, b, c, d] = number.to_le_bytes();
    [command, a, b, c, d, 0, 0, 0]
}
