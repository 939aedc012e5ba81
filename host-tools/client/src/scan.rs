//! Finding the nodes on a bus.

use std::time::{Duration, Instant};

use eel_canopen::NmtState;
use eel_protocol::Cob;
use eel_transport::Bus;

use crate::client::Client;
use crate::error::{ClientError, Multiplexor};
use crate::lss::LssAddress;

/// Object 0x1000, which every node must have.
const DEVICE_TYPE: Multiplexor = Multiplexor::new(0x1000, 0);
/// Object 0x1018.
const IDENTITY: u16 = 0x1018;

/// A node that was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Found {
    /// Its id.
    pub node: u8,
    /// What its heartbeat says, where it sent one.
    pub state: Option<NmtState>,
    /// Its device type; a stopped node does not tell.
    pub device_type: Option<u32>,
}

/// Which device a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identification {
    /// Object 0x1000.
    pub device_type: u32,
    /// Object 0x1018; what a node does not tell is 0.
    pub address: LssAddress,
}

impl<B: Bus> Client<B> {
    /// Finds nodes: asks `ids` for their device type at once and listens for `time`, which should be
    /// longer than the nodes' heartbeat periods, so that stopped nodes are heard too. Who sends a
    /// heartbeat is found whatever its id.
    ///
    /// # Errors
    /// What the bus fails with.
    pub fn find_nodes(
        &mut self,
        ids: impl IntoIterator<Item = u8>,
        time: Duration,
    ) -> Result<Vec<Found>, ClientError> {
        self.drain()?;
        let [low, high, subindex] = DEVICE_TYPE.bytes();
        for node in ids {
            let request = [0x40, low, high, subindex, 0, 0, 0, 0];
            self.send(Cob::SdoRequest(node).id(), &request)?;
        }
        let mut types = [None; 128];
        let mut heard = [false; 128];
        let deadline = Instant::now() + time;
        while let Some(frame) = self.receive(deadline)? {
            let cob = frame.cob_id().map(Cob::from_id);
            match (cob, frame.data()) {
                (Some(Cob::SdoResponse(node)), &[command, l, h, s, a, b, c, d])
                    if [l, h, s] == DEVICE_TYPE.bytes() =>
                {
                    if let Some(slot) = heard.get_mut(usize::from(node)) {
                        *slot = true;
                    }
                    if command >> 5 == 2
                        && let Some(slot) = types.get_mut(usize::from(node))
                    {
                        *slot = Some(u32::from_le_bytes([a, b, c, d]));
                    }
                }
                (Some(Cob::Heartbeat(node)), [_]) => {
                    if let Some(slot) = heard.get_mut(usize::from(node)) {
                        *slot = true;
                    }
                }
                _ => {}
            }
        }
        let found = (0..).zip(heard.into_iter().zip(types));
        Ok(found
            .filter(|(_, (heard, _))| *heard)
            .map(|(node, (_, device_type))| Found {
                node,
                state: self.heard(node).map(|heard| heard.state),
                device_type,
            })
            .collect())
    }

    /// Reads which device a node is.
    ///
    /// # Errors
    /// As [`upload`](Self::upload); entries of the identity beyond the vendor's number are optional
    /// and may be refused.
    pub fn identify(&mut self, node: u8) -> Result<Identification, ClientError> {
        let device_type = self.number(node, DEVICE_TYPE)?;
        let mut numbers = [0; 4];
        for (slot, subindex) in numbers.iter_mut().zip(1..) {
            *slot = match self.number(node, Multiplexor::new(IDENTITY, subindex)) {
                Err(ClientError::Aborted { .. }) => 0,
                number => number?,
            };
        }
        Ok(Identification {
            device_type,
            address: LssAddress::from_numbers(numbers),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::script::{Script, client};

    #[test]
    fn nodes_are_found_by_their_answer_or_by_their_heartbeat() {
        let mut script = Script::default();
        for node in 1..=127_u16 {
            let answers: &[(u16, &[u8])] = match node {
                3 => &[(0x583, &[0x43, 0, 0x10, 0, 0x92, 1, 2, 0])],
                9 => &[(0x789, &[1, 2]), (0x709, &[4]), (0x183, &[0; 8])],
                40 => &[(0x5A8, &[0x80, 0, 0x10, 0, 0, 0, 4, 5])],
                50 => &[(0x5B2, &[0x43, 1, 0x10, 0, 1, 0, 0, 0])],
                _ => &[],
            };
            script.add((0x600 + node, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]), answers);
        }
        let mut client = client(script);
        let found = client
            .find_nodes(1..=127, Duration::from_millis(5))
            .unwrap();
        let expected = [
            (3, None, Some(0x0002_0192)),
            (9, Some(NmtState::Stopped), None),
            (40, None, None),
        ]
        .map(|(node, state, device_type)| Found {
            node,
            state,
            device_type,
        });
        assert_eq!(found, expected);
        client.into_bus().finish();
    }

    #[test]
    fn what_a_node_does_not_tell_of_its_identity_is_0() {
        let read = |object: [u8; 3]| [0x40, object[0], object[1], object[2], 0, 0, 0, 0];
        let mut script = Script::default();
        let answers: [([u8; 3], [u8; 8]); 5] = [
            ([0, 0x10, 0], [0x43, 0, 0x10, 0, 1, 0, 0, 0]),
            ([0x18, 0x10, 1], [0x43, 0x18, 0x10, 1, 2, 0, 0, 0]),
            ([0x18, 0x10, 2], [0x43, 0x18, 0x10, 2, 3, 0, 0, 0]),
            ([0x18, 0x10, 3], [0x80, 0x18, 0x10, 3, 0x11, 0, 9, 6]),
            ([0x18, 0x10, 4], [0x43, 0x18, 0x10, 4, 4, 3, 2, 1]),
        ];
        for (object, answer) in &answers {
            script.add((0x607, &read(*object)), &[(0x587, answer)]);
        }
        let mut client = client(script);
        let identification = client.identify(7).unwrap();
        assert_eq!(identification.device_type, 1);
        assert_eq!(identification.address.numbers(), [2, 3, 0, 0x0102_0304]);
    }
}
