//! Layer setting services as a slave (CiA 305): the node id over the bus.
//!
//! Deliberately absent: other bit rates than 1 Mbit/s.

use crate::Identity;

/// The identifier of the master's requests.
pub(crate) const REQUEST: u16 = 0x7E5;
/// The identifier of the slaves' answers.
pub(crate) const ANSWER: u16 = 0x7E4;
/// The node id that stands for none.
pub(crate) const UNCONFIGURED: u8 = 0xFF;

const SWITCH_GLOBAL: u8 = 0x04;
const CONFIGURE_NODE_ID: u8 = 0x11;
const CONFIGURE_BIT_TIMING: u8 = 0x13;
const STORE: u8 = 0x17;
const SELECTED: u8 = 0x44;
const IDENTIFIED: u8 = 0x4F;
const IDENTIFY_UNCONFIGURED: u8 = 0x4C;
const UNCONFIGURED_IDENTIFIED: u8 = 0x50;
const FASTSCAN: u8 = 0x51;
const INQUIRE_NODE_ID: u8 = 0x5E;

/// "Bit checked" of a fastscan that asks whether anybody is there.
const ANYBODY: u8 = 0x80;
/// Error codes of the answers.
const OUT_OF_RANGE: u32 = 1;
const NOT_STORED: u32 = 2;

/// What the node has to do about a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Nothing.
    Silence,
    /// Send this, the command and four bytes, lowest first.
    Answer(u8, u32),
    /// Store the pending node id, then send [`stored`].
    Store,
    /// The configuration has ended: an unconfigured node takes its pending id.
    Left,
}

/// The slave's state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lss {
    configuring: bool,
    /// The node id that the next reset of the communication makes valid.
    pending: u8,
    /// How many of the four numbers of a selective switch have matched in their order.
    selected: u8,
    /// How many of the six numbers of an identification have matched in their order.
    identified: u8,
    /// Which of the four numbers a fastscan looks for.
    scanned: u8,
    /// Whether a search for nodes without an id is for this one, as far as a line beside the bus says.
    is_next: bool,
}

impl Lss {
    pub const fn new(node_id: u8) -> Self {
        Self {
            configuring: false,
            pending: node_id,
            selected: 0,
            identified: 0,
            scanned: 0,
            is_next: true,
        }
    }

    /// Returns the node id that the next reset of the communication makes valid.
    pub const fn pending(&self) -> u8 {
        self.pending
    }

    /// Takes a request; `active` is the node's id and `allowed` the lowest and highest it may get.
    pub fn request(
        &mut self,
        request: [u8; 8],
        identity: &Identity,
        active: u8,
        allowed: (u8, u8),
    ) -> Outcome {
        let [command, first, second, ..] = request;
        let [_, a, b, c, d, rest @ ..] = request;
        let number = u32::from_le_bytes([a, b, c, d]);
        match command {
            SWITCH_GLOBAL => self.switch(first),
            0x40..=0x43 if !self.configuring => self.select(command - 0x40, number, identity),
            0x46..=0x4B => self.identify(command - 0x46, number, identity),
            IDENTIFY_UNCONFIGURED if self.is_unconfigured(active) => {
                Outcome::Answer(UNCONFIGURED_IDENTIFIED, 0)
            }
            FASTSCAN if !self.configuring && self.is_unconfigured(active) => {
                self.scan(number, rest, identity)
            }
            _ if !self.configuring => Outcome::Silence,
            CONFIGURE_NODE_ID => {
                let (lowest, highest) = allowed;
                let is_allowed =
                    first == UNCONFIGURED || (lowest..=highest).contains(&first) && first <= 127;
                if is_allowed {
                    self.pending = first;
                }
                Outcome::Answer(command, if is_allowed { 0 } else { OUT_OF_RANGE })
            }
            CONFIGURE_BIT_TIMING => {
                let is_offered = (first, second) == (0, 0);
                Outcome::Answer(command, if is_offered { 0 } else { OUT_OF_RANGE })
            }
            STORE => Outcome::Store,
            0x5A..=0x5D => Outcome::Answer(command, part(identity, command - 0x5A)),
            INQUIRE_NODE_ID => Outcome::Answer(command, active.into()),
            _ => Outcome::Silence,
        }
    }

    /// Hears whether a search for nodes without an id is for this one.
    pub const fn set_next(&mut self, is_next: bool) {
        self.is_next = is_next;
    }

    const fn is_unconfigured(&self, active: u8) -> bool {
        self.is_next && !matches!(active, 1..=127) && self.pending == UNCONFIGURED
    }

    fn switch(&mut self, mode: u8) -> Outcome {
        self.selected = 0;
        match mode {
            0 => {
                self.configuring = false;
                Outcome::Left
            }
            1 => {
                self.configuring = true;
                Outcome::Silence
            }
            _ => Outcome::Silence,
        }
    }

    fn select(&mut self, place: u8, number: u32, identity: &Identity) -> Outcome {
        let is_next = place == 0 || place == self.selected;
        if !is_next || number != part(identity, place) {
            self.selected = 0;
            return Outcome::Silence;
        }
        self.selected = place + 1;
        if self.selected < 4 {
            return Outcome::Silence;
        }
        self.selected = 0;
        self.configuring = true;
        Outcome::Answer(SELECTED, 0)
    }

    fn identify(&mut self, place: u8, number: u32, identity: &Identity) -> Outcome {
        let matches = match place {
            0 => identity.vendor == number,
            1 => identity.product == number,
            2 => identity.revision >= number,
            3 => identity.revision <= number,
            4 => identity.serial >= number,
            _ => identity.serial <= number,
        };
        let is_next = place == 0 || place == self.identified;
        self.identified = if is_next && matches { place + 1 } else { 0 };
        if self.identified < 6 {
            return Outcome::Silence;
        }
        self.identified = 0;
        Outcome::Answer(IDENTIFIED, 0)
    }

    /// Answers where all bits of a number from bit `bit` up are this node's.
    fn scan(&mut self, number: u32, rest: [u8; 3], identity: &Identity) -> Outcome {
        let [bit, place, next] = rest;
        if bit == ANYBODY {
            self.scanned = 0;
            return Outcome::Answer(IDENTIFIED, 0);
        }
        if bit > 31 || place > 3 || next > 3 || place != self.scanned {
            return Outcome::Silence;
        }
        if (number ^ part(identity, place)) >> bit != 0 {
            return Outcome::Silence;
        }
        if bit == 0 {
            // The last number leads back to the first: this node is the one that was looked for.
            self.configuring = next < place;
            self.scanned = next;
        }
        Outcome::Answer(IDENTIFIED, 0)
    }
}

/// Returns the answer to a request to store.
pub(crate) const fn stored(done: bool) -> Outcome {
    Outcome::Answer(STORE, if done { 0 } else { NOT_STORED })
}

/// Returns a number of the identity in the order of object 0x1018.
#[inline(never)] // One copy in flash.
const fn part(identity: &Identity, place: u8) -> u32 {
    match place {
        0 => identity.vendor,
        1 => identity.product,
        2 => identity.revision,
        _ => identity.serial,
    }
}
