//! Network management: the states of a node and the commands that change them (CiA 301, 7.2.8).

/// The state of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum NmtState {
    /// Not on the bus yet; its value is that of the boot-up message.
    Initialising = 0,
    /// Deaf and silent but for NMT and heartbeat.
    Stopped = 4,
    /// Everything works.
    Operational = 5,
    /// Everything but PDOs works.
    PreOperational = 127,
}

impl NmtState {
    /// Reads the byte of a heartbeat.
    pub const fn from_heartbeat(byte: u8) -> Option<Self> {
        match byte {
            0 => Some(Self::Initialising),
            4 => Some(Self::Stopped),
            5 => Some(Self::Operational),
            127 => Some(Self::PreOperational),
            _ => None,
        }
    }
}

/// What the NMT master asks of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum NmtCommand {
    /// Enter Operational.
    Start = 1,
    /// Enter Stopped.
    Stop = 2,
    /// Enter Pre-operational.
    EnterPreOperational = 128,
    /// Start anew as after power-on.
    ResetNode = 129,
    /// Start the communication anew; the application stays as it is.
    ResetCommunication = 130,
}

impl NmtCommand {
    /// Reads an NMT frame's data for the node `node_id`; `None` when it is not for this node or
    /// not a command.
    pub fn for_node(node_id: u8, data: &[u8]) -> Option<Self> {
        let &[command, addressee] = data else {
            return None;
        };
        if addressee != 0 && addressee != node_id {
            return None;
        }
        match command {
            1 => Some(Self::Start),
            2 => Some(Self::Stop),
            128 => Some(Self::EnterPreOperational),
            129 => Some(Self::ResetNode),
            130 => Some(Self::ResetCommunication),
            _ => None,
        }
    }

    /// Returns the state that the command leads to.
    pub const fn target(self) -> NmtState {
        match self {
            Self::Start => NmtState::Operational,
            Self::Stop => NmtState::Stopped,
            Self::EnterPreOperational | Self::ResetNode | Self::ResetCommunication => {
                NmtState::PreOperational
            }
        }
    }

    /// Tells whether the command resets.
    pub const fn is_reset(self) -> bool {
        matches!(self, Self::ResetNode | Self::ResetCommunication)
    }
}
