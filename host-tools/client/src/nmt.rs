//! The client as NMT master: commands, and waiting for what they lead to.

use std::time::{Duration, Instant};

use eel_canopen::{NmtCommand, NmtState};
use eel_protocol::Cob;
use eel_transport::Bus;

use crate::client::Client;
use crate::error::ClientError;

impl<B: Bus> Client<B> {
    /// Sends an NMT command to a node, or to all of them (node 0). Nobody answers it.
    ///
    /// # Errors
    /// What the bus fails with.
    pub fn command(&mut self, command: NmtCommand, node: u8) -> Result<(), ClientError> {
        self.drain()?;
        self.send(Cob::Nmt.id(), &[command as u8, node])
    }

    /// Waits until a node's heartbeat tells a state for which `is_wanted` holds; `Initialising` is
    /// the boot-up message.
    ///
    /// # Errors
    /// [`ClientError::NoState`] where none comes within `patience`, and what the bus fails with.
    pub fn wait_for(
        &mut self,
        node: u8,
        patience: Duration,
        is_wanted: impl Fn(NmtState) -> bool,
    ) -> Result<NmtState, ClientError> {
        let deadline = Instant::now() + patience;
        while let Some(frame) = self.receive(deadline)? {
            if frame.cob_id() == Some(Cob::Heartbeat(node).id())
                && let Some(heard) = self.heard(node).map(|heard| heard.state)
                && is_wanted(heard)
            {
                return Ok(heard);
            }
        }
        Err(ClientError::NoState { node })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::script::{Script, client};

    #[test]
    fn a_command_is_sent_and_its_effect_is_waited_for_among_other_frames() {
        let mut client = client(Script::new([
            (
                (0x000, &[0x81, 3][..]),
                &[
                    (0x704, &[5][..]),
                    (0x183, &[0; 8]),
                    (0x703, &[0]),
                    (0x703, &[127]),
                ][..],
            ),
            ((0x000, &[2, 0]), &[]),
        ]));
        client.command(NmtCommand::ResetNode, 3).unwrap();
        let patience = Duration::from_millis(20);
        let state = client.wait_for(3, patience, |state| state != NmtState::Initialising);
        assert_eq!(state.unwrap(), NmtState::PreOperational);
        assert_eq!(client.heard(4).unwrap().state, NmtState::Operational);
        assert_eq!(client.heard(3).unwrap().count, 2);
        client.command(NmtCommand::Stop, 0).unwrap();
        let silent = client.wait_for(3, patience, |_| true);
        assert!(matches!(silent, Err(ClientError::NoState { node: 3 })));
        client.into_bus().finish();
    }
}
