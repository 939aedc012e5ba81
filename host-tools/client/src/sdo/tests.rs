//! The client against a peer whose bytes are those of CiA 301, 7.2.4.3, written out here once more.

use super::{Method, Progress};
use crate::client::Client;
use crate::error::{ClientError, Multiplexor, Violation};
use crate::script::{Raw, Script, client};

mod block;
mod segmented;

/// Lengths at the edges: one frame, one segment, two, one block of 127 segments, more than one.
const LENGTHS: [usize; 9] = [1, 4, 5, 7, 8, 14, 889, 890, 2000];
/// CRC-16/XMODEM of the values of these lengths, from Python's `binascii.crc_hqx(value, 0)`.
const CRCS: [u16; 9] = [
    0x0000, 0xE40B, 0x6517, 0x4094, 0xFAB6, 0x80C0, 0xAFB9, 0x87B2, 0xB8E2,
];

/// Object 2101:1 of node 3: its index, and the identifiers of its server.
const OBJECT: Multiplexor = Multiplexor::new(0x2101, 1);
const NODE: u8 = 3;
const REQUEST: u16 = 0x603;
const RESPONSE: u16 = 0x583;

/// Byte k is 7 k + k / 256.
fn value(length: usize) -> Vec<u8> {
    (0..length).map(|k| (7 * k + k / 256) as u8).collect()
}

/// A frame that names the object: command, 01 21 01, four bytes.
fn named(command: u8, rest: [u8; 4]) -> [u8; 8] {
    let [a, b, c, d] = rest;
    [command, 0x01, 0x21, 0x01, a, b, c, d]
}

fn plain(command: u8, first: u8, second: u8) -> [u8; 8] {
    [command, first, second, 0, 0, 0, 0, 0]
}

/// Adds a step: one request, any number of answers.
fn step(script: &mut Script, request: [u8; 8], answers: &[[u8; 8]]) {
    let answers: Vec<Raw<'_>> = answers.iter().map(|data| (RESPONSE, &data[..])).collect();
    script.add((REQUEST, &request), &answers);
}

fn read(client: &mut Client<Script>, method: Method) -> Result<Vec<u8>, ClientError> {
    client.upload(NODE, OBJECT, method, &mut |_| ())
}

fn write(client: &mut Client<Script>, data: &[u8], method: Method) -> Result<(), ClientError> {
    client.download(NODE, OBJECT, data, method, &mut |_| ())
}

fn violation(error: ClientError) -> Violation {
    match error {
        ClientError::Protocol {
            node: NODE,
            object: OBJECT,
            violation,
        } => violation,
        other => panic!("{other:?}"),
    }
}
