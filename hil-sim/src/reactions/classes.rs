//! What is injected, and what has to follow within which time.

use eel_protocol::NodeId;

use crate::plant::Defect;
use crate::plant::random::Random;
use crate::robot::FaultKind;

/// A kind of fault.
#[derive(Clone, Copy, Debug)]
pub struct Class {
    /// Its name, such as `bridge-fault`.
    pub name: &'static str,
    /// What happens, in words.
    pub what: &'static str,
    /// Whether it happens to all vertebrae at once.
    pub is_common: bool,
    /// Whether the time begins when the first target that is missing was due, instead of the injection.
    pub is_timed_by_targets: bool,
    /// Makes one of it for a vertebra.
    pub make: fn(&mut Random, NodeId) -> FaultKind,
    /// What has to follow, and how soon, in µs.
    pub expects: &'static [(Reaction, u64)],
}

/// What a vertebra does about a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// The wrist slows down to its last target, or does more than that.
    Slowing,
    /// A stop or fault is latched: at most damping is left.
    Latched,
    /// No bridge drives; the one at fault, where one is, is off.
    Undriven,
    /// Every bridge is off.
    Free,
}

impl Reaction {
    /// Says what it is.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Slowing => "slows down",
            Self::Latched => "latched",
            Self::Undriven => "no bridge drives",
            Self::Free => "all bridges off",
        }
    }
}

/// One control period, and a millisecond more (µs).
const AT_ONCE: u64 = 2_000;
/// As many readings as an angle must be elsewhere in a row, and what follows (µs).
const IMPLAUSIBLE: u64 = 5_000 + AT_ONCE;
/// The same for an absolute encoder without valid angles (µs).
const INVALID: u64 = 50_000 + AT_ONCE;

/// At once after a frame that waits until ten targets are sent (µs).
const BEHIND_TARGETS: u64 = 2_000 + AT_ONCE;

/// The policy's times for a command that is lost (µs).
const LOST: &[(Reaction, u64)] = &[
    (Reaction::Slowing, 30_000),
    (Reaction::Latched, 100_000),
    (Reaction::Undriven, 500_000),
    (Reaction::Free, 2_500_000),
];

/// The same for a vertebra that is cut off: the first missing target is due up to a period after that (µs).
const CUT_OFF: &[(Reaction, u64)] = &[
    (Reaction::Slowing, 40_000),
    (Reaction::Latched, 110_000),
    (Reaction::Undriven, 510_000),
    (Reaction::Free, 2_510_000),
];

/// Picks a motor.
fn motor(random: &mut Random) -> usize {
    (random.bits() % 3) as usize
}

/// Picks a number from `least` on, with either sign.
fn signed(random: &mut Random, least: i32, most: i32) -> i32 {
    let size = least + (random.bits() % (most - least + 1) as u64) as i32;
    if random.bits().is_multiple_of(2) {
        size
    } else {
        -size
    }
}

/// Makes a class of defects of one motor.
macro_rules! broken {
    ($name:literal, $what:literal, |$random:ident| $defect:expr, $bound:expr) => {
        Class {
            name: $name,
            what: $what,
            is_common: false,
            is_timed_by_targets: false,
            make: |$random, node| FaultKind::Broken(node, $defect),
            expects: &[(Reaction::Undriven, $bound)],
        }
    };
}

/// Every class.
pub const CLASSES: &[Class] = &[
    broken!(
        "bridge-fault",
        "a bridge switches itself off and says so",
        |random| Defect::BridgeFault(motor(random)),
        AT_ONCE
    ),
    broken!(
        "over-current",
        "a current sensor reads 6.3 to 6.6 A too much",
        |random| Defect::CurrentOffset(motor(random), signed(random, 6_300, 6_600)),
        AT_ONCE
    ),
    broken!(
        "emergency-stop",
        "the emergency stop line opens",
        |_random| Defect::EmergencyStop,
        AT_ONCE
    ),
    broken!(
        "board-hot",
        "the board's thermistor reads 95 °C",
        |_random| Defect::BoardHot(95),
        AT_ONCE
    ),
    broken!(
        "motor-hot",
        "a motor's thermistor reads 105 °C",
        |random| Defect::MotorHot(motor(random), 105),
        AT_ONCE
    ),
    broken!(
        "counter-jump",
        "a motor's counter jumps by 2 000 to 20 000 counts",
        |random| Defect::CounterJumped(motor(random), signed(random, 2_000, 20_000)),
        AT_ONCE
    ),
    broken!(
        "crank-slip",
        "a crank's encoder slips by 30 to 300 mrad",
        |random| Defect::CrankSlipped(motor(random), signed(random, 30, 300)),
        IMPLAUSIBLE
    ),
    broken!(
        "crank-silent",
        "a crank's encoder has no valid angle",
        |random| Defect::CrankSilent(motor(random)),
        INVALID
    ),
    Class {
        name: "under-voltage",
        what: "the battery falls to 10 to 16 V",
        is_common: true,
        is_timed_by_targets: false,
        make: |random, _| FaultKind::Battery(10_000 + (random.bits() % 6_000) as u32),
        expects: &[(Reaction::Undriven, AT_ONCE)],
    },
    Class {
        name: "over-voltage",
        what: "the supply rises to 32 to 36 V",
        is_common: true,
        is_timed_by_targets: false,
        make: |random, _| FaultKind::Battery(32_000 + (random.bits() % 4_000) as u32),
        expects: &[(Reaction::Undriven, AT_ONCE)],
    },
    Class {
        name: "brown-out",
        what: "the battery falls to 0 to 5 V",
        is_common: true,
        is_timed_by_targets: false,
        make: |random, _| FaultKind::Battery((random.bits() % 5_000) as u32),
        expects: &[(Reaction::Free, AT_ONCE)],
    },
    Class {
        name: "hung",
        what: "the program hangs",
        is_common: false,
        is_timed_by_targets: false,
        make: |_, node| FaultKind::NodeHung(node),
        expects: &[
            (Reaction::Free, 5_000 + AT_ONCE),
            (Reaction::Latched, 50_000 + AT_ONCE),
        ],
    },
    Class {
        name: "reset",
        what: "the microcontroller is reset",
        is_common: false,
        is_timed_by_targets: false,
        make: |_, node| FaultKind::NodeReset(node),
        expects: &[(Reaction::Free, AT_ONCE)],
    },
    Class {
        name: "head-silent",
        what: "the head loses its power",
        is_common: true,
        is_timed_by_targets: true,
        make: |_, _| FaultKind::HeadSilent,
        expects: LOST,
    },
    Class {
        name: "targets-lost",
        what: "the targets are missing",
        is_common: false,
        is_timed_by_targets: true,
        make: |_, node| FaultKind::TargetsLost(node),
        expects: LOST,
    },
    Class {
        name: "bus-off",
        what: "the CAN controller goes bus-off",
        is_common: false,
        is_timed_by_targets: false,
        make: |_, node| FaultKind::BusOff(node),
        expects: CUT_OFF,
    },
    Class {
        name: "targets-bent",
        what: "the targets carry a wrong bit",
        is_common: false,
        is_timed_by_targets: true,
        make: |_, node| FaultKind::TargetsBent(node),
        expects: &[
            (Reaction::Slowing, 30_000),
            (Reaction::Latched, 100_000),
            (Reaction::Free, 2_500_000),
        ],
    },
    Class {
        name: "heartbeat-lost",
        what: "the head's heartbeat is missing",
        is_common: true,
        is_timed_by_targets: false,
        make: |_, _| FaultKind::HeartbeatLost,
        expects: &[
            (Reaction::Latched, 300_000),
            (Reaction::Free, 300_000 + 2_500_000),
        ],
    },
    Class {
        name: "stopped-by-nmt",
        what: "NMT stops all nodes",
        is_common: true,
        is_timed_by_targets: false,
        make: |_, _| FaultKind::StopByNmt,
        expects: &[
            (Reaction::Latched, BEHIND_TARGETS),
            (Reaction::Free, 2_500_000),
        ],
    },
];
