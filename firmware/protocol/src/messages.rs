//! Each message of the bus as a list of named signals: what a decoder and a DBC must know.
//!
//! Signals that lie in the dictionary take their name, unit, scale and bounds from there. SDO and
//! LSS are dialogues, not signals, and are absent.

use crate::dictionary::{self, Scale};
use crate::emergency::CATALOGUE;
use crate::ids::Cob;
use crate::states::{LimitCode, Mode, State};

/// What the numbers of a signal are called, where they are codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choices {
    /// The signal is a quantity or a count.
    None,
    /// [`Mode`].
    Mode,
    /// [`State`].
    State,
    /// [`LimitCode`].
    Limit,
    /// [`CATALOGUE`].
    Emergency,
    /// NMT commands.
    NmtCommand,
    /// NMT states, as a heartbeat tells them.
    NmtState,
}

/// One signal of a message; little-endian, bit 0 is the lowest bit of byte 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signal {
    /// Its name within the message, such as `yaw`.
    pub name: &'static str,
    /// Its lowest bit.
    pub start: u8,
    /// Its length in bits, 1–16.
    pub bits: u8,
    /// Whether it is in two's complement.
    pub signed: bool,
    /// The unit of the scaled number; empty for a count or a code.
    pub unit: &'static str,
    /// The worth of one raw step in that unit.
    pub scale: Scale,
    /// What its codes are called.
    pub choices: Choices,
    /// What it is, in one sentence.
    pub description: &'static str,
}

/// Who sends a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sender {
    /// The head alone; the message has one identifier.
    Head,
    /// The head, with one identifier for each vertebra.
    HeadToEach,
    /// Each vertebra, with an identifier of its own.
    Vertebra,
    /// Each vertebra and the head.
    Every,
}

/// One kind of message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Message {
    /// Its name, such as `pose`.
    pub name: &'static str,
    /// Its identifier; of node 0 where there is one for each node.
    pub cob_id_base: u16,
    /// Who sends it.
    pub sender: Sender,
    /// Its length in bytes.
    pub length: u8,
    /// The time between two of them from one vertebra (or to it), in ms; 0 on event.
    pub period_ms: u16,
    /// What it carries.
    pub signals: &'static [Signal],
    /// What it is, in one sentence.
    pub description: &'static str,
}

/// NMT commands by their code (CiA 301, 7.2.8.3.1).
const NMT_COMMANDS: &[(u16, &str)] = &[
    (1, "start"),
    (2, "stop"),
    (128, "enter-pre-operational"),
    (129, "reset-node"),
    (130, "reset-communication"),
];

/// NMT states by their code (CiA 301, 7.2.8.3.2); 0 is the boot-up message.
const NMT_STATES: &[(u16, &str)] = &[
    (0, "boot-up"),
    (4, "stopped"),
    (5, "operational"),
    (127, "pre-operational"),
];

impl Choices {
    /// Returns the code and the name at `place` of the list.
    pub fn at(self, place: usize) -> Option<(u16, &'static str)> {
        match self {
            Self::None => None,
            Self::Mode => Mode::ALL
                .get(place)
                .map(|mode| (u16::from(mode.code()), mode.name())),
            Self::State => State::ALL
                .get(place)
                .map(|state| (u16::from(state.code()), state.name())),
            Self::Limit => LimitCode::ALL
                .get(place)
                .map(|limit| (u16::from(limit.code()), limit.name())),
            Self::Emergency => CATALOGUE.get(place).map(|entry| (entry.code, entry.name)),
            Self::NmtCommand => NMT_COMMANDS.get(place).copied(),
            Self::NmtState => NMT_STATES.get(place).copied(),
        }
    }

    /// Returns every code with its name.
    pub fn iter(self) -> impl Iterator<Item = (u16, &'static str)> {
        (0..).map_while(move |place| self.at(place))
    }

    /// Returns what `code` is called.
    pub fn name(self, code: i64) -> Option<&'static str> {
        self.iter()
            .find(|(other, _)| i64::from(*other) == code)
            .map(|(_, name)| name)
    }
}

impl Signal {
    /// Reads the raw number from a message's bytes; `None` where they are too few.
    pub fn raw(&self, bytes: &[u8]) -> Option<i64> {
        let last = usize::from(self.start) + usize::from(self.bits) - 1;
        if last / 8 >= bytes.len() {
            return None;
        }
        let mut word = [0; 8];
        let (word_head, bytes_head) = (
            word.get_mut(..bytes.len().min(8))?,
            bytes.get(..bytes.len().min(8))?,
        );
        word_head.copy_from_slice(bytes_head);
        let left = 64_u32.checked_sub(u32::from(self.start) + u32::from(self.bits))?;
        let high = u64::from_le_bytes(word) << left;
        let right = 64 - u32::from(self.bits);
        Some(if self.signed {
            (high as i64) >> right
        } else {
            (high >> right) as i64
        })
    }
}

impl Message {
    /// Returns the message that an identifier stands for; `None` for what is no message with
    /// signals.
    pub const fn of(cob: Cob) -> Option<&'static Self> {
        Some(match cob {
            Cob::Nmt => &NMT,
            Cob::Sync => &SYNC,
            Cob::Emergency(_) => &EMERGENCY,
            Cob::Target(_) => &TARGET,
            Cob::Moment(_) => &MOMENT,
            Cob::Pose(_) => &POSE,
            Cob::Effort(_) => &EFFORT,
            Cob::Heartbeat(_) => &HEARTBEAT,
            _ => return None,
        })
    }
}

/// Makes a signal of a dictionary entry that starts at bit `start`.
const fn entry(index: u16, subindex: u8, start: u8) -> Signal {
    let Some(sub) = dictionary::lookup(index, subindex) else {
        panic!("no such object")
    };
    Signal {
        name: sub.name,
        start,
        bits: sub.data_type.bits(),
        signed: sub.data_type.is_signed(),
        unit: sub.unit,
        scale: sub.scale,
        choices: Choices::None,
        description: sub.description,
    }
}

/// Makes a signal without a unit.
const fn code(
    name: &'static str,
    start: u8,
    bits: u8,
    choices: Choices,
    description: &'static str,
) -> Signal {
    let scale = Scale {
        numerator: 1,
        denominator: 1,
    };
    Signal {
        name,
        start,
        bits,
        signed: false,
        unit: "",
        scale,
        choices,
        description,
    }
}

const NMT: Message = Message {
    name: "nmt",
    cob_id_base: Cob::Nmt.id(),
    sender: Sender::Head,
    length: 2,
    period_ms: 0,
    signals: &[
        code(
            "command",
            0,
            8,
            Choices::NmtCommand,
            "What the node shall do.",
        ),
        code(
            "node",
            8,
            8,
            Choices::None,
            "Which node shall do it; 0 is all.",
        ),
    ],
    description: "Network management.",
};

const SYNC: Message = Message {
    name: "sync",
    cob_id_base: Cob::Sync.id(),
    sender: Sender::Head,
    length: 1,
    period_ms: (crate::SYNC_PERIOD_US / 1_000) as u16,
    signals: &[code(
        "counter",
        0,
        8,
        Choices::None,
        "Counts the beats, 1 to 240.",
    )],
    description: "The beat of the bus: targets take effect, reports are sent.",
};

const EMERGENCY: Message = Message {
    name: "emergency",
    cob_id_base: Cob::Emergency(0).id(),
    sender: Sender::Vertebra,
    length: 8,
    period_ms: 0,
    signals: &[
        code("code", 0, 16, Choices::Emergency, "What happened."),
        code(
            "register",
            16,
            8,
            Choices::None,
            "Error register, object 0x1001.",
        ),
        code(
            "motor",
            24,
            8,
            Choices::None,
            "The motor it concerns; 0 is the whole wrist.",
        ),
        code(
            "limit",
            32,
            8,
            Choices::Limit,
            "The limit that goes with it.",
        ),
        code(
            "detail",
            40,
            16,
            Choices::None,
            "A number whose meaning the catalogue gives.",
        ),
    ],
    description: "Something happened that the head must know.",
};

const TARGET: Message = Message {
    name: "target",
    cob_id_base: Cob::Target(0).id(),
    sender: Sender::HeadToEach,
    length: 8,
    period_ms: SYNC.period_ms,
    signals: &[
        entry(0x2000, 1, 0),
        entry(0x2000, 2, 16),
        entry(0x2000, 3, 32),
        code("mode", 48, 4, Choices::Mode, "What the vertebra shall do."),
        code(
            "counter",
            52,
            4,
            Choices::None,
            "Counts the targets to this vertebra, 0 to 14.",
        ),
        entry(0x2000, 5, 56),
    ],
    description: "The pose that the vertebra shall take at the next SYNC.",
};

const MOMENT: Message = Message {
    name: "moment",
    cob_id_base: Cob::Moment(0).id(),
    sender: Sender::HeadToEach,
    length: 8,
    period_ms: 0,
    signals: &[
        entry(0x2001, 1, 0),
        entry(0x2001, 2, 16),
        entry(0x2001, 3, 32),
        entry(0x2001, 4, 48),
    ],
    description: "A moment to add, and how stiff to be; off by default.",
};

const POSE: Message = Message {
    name: "pose",
    cob_id_base: Cob::Pose(0).id(),
    sender: Sender::Vertebra,
    length: 8,
    period_ms: SYNC.period_ms,
    signals: &[
        entry(0x2010, 1, 0),
        entry(0x2010, 2, 16),
        entry(0x2010, 3, 32),
        code(
            "state",
            48,
            4,
            Choices::State,
            "What the vertebra is doing.",
        ),
        code(
            "counter",
            52,
            4,
            Choices::None,
            "Counts the reports of this vertebra, 0 to 14.",
        ),
        entry(0x2010, 5, 56),
    ],
    description: "The pose that the vertebra has.",
};

const EFFORT: Message = Message {
    name: "effort",
    cob_id_base: Cob::Effort(0).id(),
    sender: Sender::Vertebra,
    length: 8,
    period_ms: 2 * SYNC.period_ms,
    signals: &[
        entry(0x2011, 1, 0),
        entry(0x2011, 2, 16),
        entry(0x2011, 3, 32),
        code("limit1", 48, 4, Choices::Limit, "What bounds motor 1."),
        code("limit2", 52, 4, Choices::Limit, "What bounds motor 2."),
        code("limit3", 56, 4, Choices::Limit, "What bounds motor 3."),
        code(
            "target_limited",
            60,
            1,
            Choices::None,
            "The target was outside the workspace.",
        ),
        code(
            "moment_limited",
            61,
            1,
            Choices::None,
            "Part of the moment could not be produced.",
        ),
        code(
            "command_lost",
            62,
            1,
            Choices::None,
            "Targets stopped coming.",
        ),
        code(
            "warning",
            63,
            1,
            Choices::None,
            "A warning that is no fault is active.",
        ),
    ],
    description: "The torques of the motors and what bounds them.",
};

const HEARTBEAT: Message = Message {
    name: "heartbeat",
    cob_id_base: Cob::Heartbeat(0).id(),
    sender: Sender::Every,
    length: 1,
    period_ms: crate::VERTEBRA_HEARTBEAT_MS,
    signals: &[code(
        "state",
        0,
        8,
        Choices::NmtState,
        "The sender's NMT state.",
    )],
    description: "The sender is alive.",
};

/// Every kind of message, by rising identifier.
pub const MESSAGES: &[Message] = &[
    NMT, SYNC, EMERGENCY, POSE, TARGET, EFFORT, MOMENT, HEARTBEAT,
];

#[cfg(test)]
mod tests;
