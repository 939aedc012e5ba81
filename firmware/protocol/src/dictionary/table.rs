//! The table itself.

use eel_canopen::Access;

use super::{DataType, Object, Pdo, Scale, Sub};

use Access::{Constant as CONST, ReadOnly as RO, ReadWrite as RW};
use Pdo::{No as NO, Receive as RX, Transmit as TX};

/// What an entry holds, whatever its type: the part that the table repeats.
#[derive(Clone, Copy)]
struct Shape {
    data_type: DataType,
    access: Access,
    pdo: Pdo,
    unit: &'static str,
    scale: Scale,
    default: i64,
    min: i64,
    max: i64,
}

/// Makes the shape of a number without a unit that uses its type's whole range.
const fn raw(data_type: DataType, access: Access, pdo: Pdo) -> Shape {
    let (min, max) = data_type.range();
    Shape {
        data_type,
        access,
        pdo,
        unit: "",
        scale: scale(1, 1),
        default: 0,
        min,
        max,
    }
}

/// Makes a scale.
const fn scale(numerator: u32, denominator: u32) -> Scale {
    assert!(denominator != 0);
    Scale {
        numerator,
        denominator,
    }
}

/// Makes the shape of a number in `unit`, one step being a thousandth of it.
const fn thousandths(data_type: DataType, access: Access, pdo: Pdo, unit: &'static str) -> Shape {
    Shape {
        unit,
        scale: scale(1, 1_000),
        ..raw(data_type, access, pdo)
    }
}

const fn angle(access: Access, pdo: Pdo) -> Shape {
    Shape {
        unit: "rad",
        scale: scale(1, 10_000),
        ..raw(DataType::I16, access, pdo)
    }
}

const fn torque(access: Access, pdo: Pdo) -> Shape {
    thousandths(DataType::I16, access, pdo, "N.m")
}

const fn byte(access: Access, pdo: Pdo) -> Shape {
    raw(DataType::U8, access, pdo)
}

const fn word(access: Access, pdo: Pdo) -> Shape {
    raw(DataType::U16, access, pdo)
}

const fn stiffness(default: i64) -> Shape {
    let shape = thousandths(DataType::U32, RW, NO, "N.m/rad");
    Shape {
        default,
        max: 500_000,
        ..shape
    }
}

const fn damping(default: i64) -> Shape {
    let shape = thousandths(DataType::U32, RW, NO, "N.m.s/rad");
    Shape {
        default,
        max: 50_000,
        ..shape
    }
}

/// Half the workspace about one axis: never beyond the range the wrist is built for.
const fn half_range(default: i64) -> Shape {
    Shape {
        default,
        min: 0,
        max: default,
        ..angle(RW, NO)
    }
}

const STIFFNESS_SCALE: Shape = Shape {
    scale: scale(1, 32_768),
    default: 32_768,
    ..word(RW, RX)
};
const PEAK_TORQUE: Shape = Shape {
    default: 3_000,
    max: 32_000,
    ..thousandths(DataType::U16, RW, NO, "N.m")
};
const RATE_LIMIT: Shape = Shape {
    default: 6_000,
    min: 1,
    max: 20_000,
    ..thousandths(DataType::U16, RW, NO, "rad/s")
};
const MICRORADIANS: Shape = Shape {
    unit: "rad",
    scale: scale(1, 1_000_000),
    ..raw(DataType::I32, RO, TX)
};
const ARCHITECTURE: Shape = Shape {
    default: 3,
    min: 3,
    max: 3,
    ..byte(CONST, NO)
};
const SCALE: Shape = Shape {
    unit: "m",
    scale: scale(1, 1_000_000),
    default: 40_000,
    min: 40_000,
    max: 40_000,
    ..raw(DataType::U32, CONST, NO)
};
const SUPPLY: Shape = thousandths(DataType::U16, RO, TX, "V");
const TEMPERATURE: Shape = Shape {
    unit: "degC",
    scale: scale(1, 10),
    ..raw(DataType::I16, RO, TX)
};
const COUNT: Shape = raw(DataType::U32, RO, TX);
const MICROSECONDS: Shape = Shape {
    unit: "s",
    scale: scale(1, 1_000_000),
    ..raw(DataType::U16, RO, TX)
};
const SYNC_PHASE: Shape = Shape {
    data_type: DataType::I16,
    min: -32_768,
    max: 32_767,
    ..MICROSECONDS
};

/// Makes an entry from its shape.
const fn sub(
    field: Field,
    subindex: u8,
    name: &'static str,
    shape: Shape,
    description: &'static str,
) -> Sub {
    let Shape {
        data_type,
        access,
        pdo,
        unit,
        scale,
        default,
        min,
        max,
    } = shape;
    Sub {
        field,
        subindex,
        name,
        data_type,
        access,
        pdo,
        unit,
        scale,
        default,
        min,
        max,
        description,
    }
}

/// Each entry of the dictionary, as the thing that a vertebra serves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Field {
    /// Angle about x, swimming, that the vertebra shall take.
    TargetYaw,
    /// Angle about y, diving, that the vertebra shall take.
    TargetPitch,
    /// Angle about z, torsion, that the vertebra shall take.
    TargetRoll,
    /// Mode in the low four bits, counter 0-14 in the high four.
    TargetCode,
    /// Protection byte over the seven bytes before it and the COB-ID.
    TargetCrc,
    /// Moment about x of the base, that is added to the controller's.
    MomentX,
    /// Moment about y of the base, that is added to the controller's.
    MomentY,
    /// Moment about z of the base, that is added to the controller's.
    MomentZ,
    /// Scale of the configured stiffness: 1 at power-up, 2 at most.
    MomentStiffness,
    /// Measured angle about x, swimming.
    PoseYaw,
    /// Measured angle about y, diving.
    PosePitch,
    /// Measured angle about z, torsion.
    PoseRoll,
    /// State in the low four bits, counter 0-14 in the high four.
    PoseCode,
    /// Protection byte over the seven bytes before it and the COB-ID.
    PoseCrc,
    /// Status word: why enabling is refused, and what is limited.
    PoseStatus,
    /// Torque of motor 1, from its current.
    EffortMotor1,
    /// Torque of motor 2, from its current.
    EffortMotor2,
    /// Torque of motor 3, from its current.
    EffortMotor3,
    /// Limit codes of motors 1-3, four bits each, and four flags above.
    EffortLimits,
    /// Angle of motor 1's crank.
    MotorAngle1,
    /// Angle of motor 2's crank.
    MotorAngle2,
    /// Angle of motor 3, the serial leg; 45 degrees at home.
    MotorAngle3,
    /// Moment about x that the motors produce.
    AchievedX,
    /// Moment about y that the motors produce.
    AchievedY,
    /// Moment about z that the motors produce.
    AchievedZ,
    /// Moment about x that was asked for and is not produced.
    UnallocatedX,
    /// Moment about y that was asked for and is not produced.
    UnallocatedY,
    /// Moment about z that was asked for and is not produced.
    UnallocatedZ,
    /// Stiffness about x, swimming.
    StiffnessX,
    /// Stiffness about y, diving.
    StiffnessY,
    /// Stiffness about z, torsion.
    StiffnessZ,
    /// Damping about x, swimming.
    DampingX,
    /// Damping about y, diving.
    DampingY,
    /// Damping about z, torsion.
    DampingZ,
    /// Largest torque of each motor.
    PeakTorque,
    /// Workspace: largest yaw to either side, 30 degrees.
    RangeYaw,
    /// Workspace: largest pitch to either side, 15 degrees.
    RangePitch,
    /// Workspace: largest roll to either side, 4 degrees.
    RangeRoll,
    /// Fastest change of a target's angle that is followed.
    RateLimit,
    /// Kind of wrist: 1 parallel axes, 2 orthogonal axes, 3 parallel actuators.
    Architecture,
    /// Length of the unit mechanism's 1, the rods.
    GeometryScale,
    /// Supply voltage of the bridges.
    Supply,
    /// Temperature of the board.
    BoardTemperature,
    /// Housing temperature of motor 1.
    MotorTemperature1,
    /// Housing temperature of motor 2.
    MotorTemperature2,
    /// Housing temperature of motor 3.
    MotorTemperature3,
    /// Targets refused since power-up: wrong protection byte, mode or counter.
    BadTargets,
    /// Targets missed since power-up, by gaps in their counter.
    LostTargets,
    /// Frames lost since power-up because a receive queue was full.
    ReceiveOverruns,
    /// Frames dropped since power-up because a transmit queue was full.
    TransmitOverruns,
    /// Time that the last control tick took.
    LoopLast,
    /// Longest time that a control tick took since power-up.
    LoopMax,
    /// Arrival of the last SYNC against the control tick's own grid.
    SyncPhase,
}

const TARGET: &[Sub] = &[
    sub(
        Field::TargetYaw,
        1,
        "yaw",
        angle(RW, RX),
        "Angle about x, swimming, that the vertebra shall take.",
    ),
    sub(
        Field::TargetPitch,
        2,
        "pitch",
        angle(RW, RX),
        "Angle about y, diving, that the vertebra shall take.",
    ),
    sub(
        Field::TargetRoll,
        3,
        "roll",
        angle(RW, RX),
        "Angle about z, torsion, that the vertebra shall take.",
    ),
    sub(
        Field::TargetCode,
        4,
        "code",
        byte(RW, RX),
        "Mode in the low four bits, counter 0-14 in the high four.",
    ),
    sub(
        Field::TargetCrc,
        5,
        "crc",
        byte(RW, RX),
        "Protection byte over the seven bytes before it and the COB-ID.",
    ),
];

const MOMENT: &[Sub] = &[
    sub(
        Field::MomentX,
        1,
        "x",
        torque(RW, RX),
        "Moment about x of the base, that is added to the controller's.",
    ),
    sub(
        Field::MomentY,
        2,
        "y",
        torque(RW, RX),
        "Moment about y of the base, that is added to the controller's.",
    ),
    sub(
        Field::MomentZ,
        3,
        "z",
        torque(RW, RX),
        "Moment about z of the base, that is added to the controller's.",
    ),
    sub(
        Field::MomentStiffness,
        4,
        "stiffness",
        STIFFNESS_SCALE,
        "Scale of the configured stiffness: 1 at power-up, 2 at most.",
    ),
];

const POSE: &[Sub] = &[
    sub(
        Field::PoseYaw,
        1,
        "yaw",
        angle(RO, TX),
        "Measured angle about x, swimming.",
    ),
    sub(
        Field::PosePitch,
        2,
        "pitch",
        angle(RO, TX),
        "Measured angle about y, diving.",
    ),
    sub(
        Field::PoseRoll,
        3,
        "roll",
        angle(RO, TX),
        "Measured angle about z, torsion.",
    ),
    sub(
        Field::PoseCode,
        4,
        "code",
        byte(RO, TX),
        "State in the low four bits, counter 0-14 in the high four.",
    ),
    sub(
        Field::PoseCrc,
        5,
        "crc",
        byte(RO, TX),
        "Protection byte over the seven bytes before it and the COB-ID.",
    ),
    sub(
        Field::PoseStatus,
        6,
        "status",
        word(RO, TX),
        "Status word: why enabling is refused, and what is limited.",
    ),
];

const EFFORT: &[Sub] = &[
    sub(
        Field::EffortMotor1,
        1,
        "motor1",
        torque(RO, TX),
        "Torque of motor 1, from its current.",
    ),
    sub(
        Field::EffortMotor2,
        2,
        "motor2",
        torque(RO, TX),
        "Torque of motor 2, from its current.",
    ),
    sub(
        Field::EffortMotor3,
        3,
        "motor3",
        torque(RO, TX),
        "Torque of motor 3, from its current.",
    ),
    sub(
        Field::EffortLimits,
        4,
        "limits",
        word(RO, TX),
        "Limit codes of motors 1-3, four bits each, and four flags above.",
    ),
];

const MOTOR: &[Sub] = &[
    sub(
        Field::MotorAngle1,
        1,
        "angle1",
        MICRORADIANS,
        "Angle of motor 1's crank.",
    ),
    sub(
        Field::MotorAngle2,
        2,
        "angle2",
        MICRORADIANS,
        "Angle of motor 2's crank.",
    ),
    sub(
        Field::MotorAngle3,
        3,
        "angle3",
        MICRORADIANS,
        "Angle of motor 3, the serial leg; 45 degrees at home.",
    ),
];

const ALLOCATION: &[Sub] = &[
    sub(
        Field::AchievedX,
        1,
        "achieved_x",
        torque(RO, TX),
        "Moment about x that the motors produce.",
    ),
    sub(
        Field::AchievedY,
        2,
        "achieved_y",
        torque(RO, TX),
        "Moment about y that the motors produce.",
    ),
    sub(
        Field::AchievedZ,
        3,
        "achieved_z",
        torque(RO, TX),
        "Moment about z that the motors produce.",
    ),
    sub(
        Field::UnallocatedX,
        4,
        "unallocated_x",
        torque(RO, TX),
        "Moment about x that was asked for and is not produced.",
    ),
    sub(
        Field::UnallocatedY,
        5,
        "unallocated_y",
        torque(RO, TX),
        "Moment about y that was asked for and is not produced.",
    ),
    sub(
        Field::UnallocatedZ,
        6,
        "unallocated_z",
        torque(RO, TX),
        "Moment about z that was asked for and is not produced.",
    ),
];

const GAINS: &[Sub] = &[
    sub(
        Field::StiffnessX,
        1,
        "stiffness_x",
        stiffness(120_000),
        "Stiffness about x, swimming.",
    ),
    sub(
        Field::StiffnessY,
        2,
        "stiffness_y",
        stiffness(120_000),
        "Stiffness about y, diving.",
    ),
    sub(
        Field::StiffnessZ,
        3,
        "stiffness_z",
        stiffness(80_000),
        "Stiffness about z, torsion.",
    ),
    sub(
        Field::DampingX,
        4,
        "damping_x",
        damping(4_000),
        "Damping about x, swimming.",
    ),
    sub(
        Field::DampingY,
        5,
        "damping_y",
        damping(4_000),
        "Damping about y, diving.",
    ),
    sub(
        Field::DampingZ,
        6,
        "damping_z",
        damping(2_000),
        "Damping about z, torsion.",
    ),
    sub(
        Field::PeakTorque,
        7,
        "peak_torque",
        PEAK_TORQUE,
        "Largest torque of each motor.",
    ),
    sub(
        Field::RangeYaw,
        8,
        "range_yaw",
        half_range(5_236),
        "Workspace: largest yaw to either side, 30 degrees.",
    ),
    sub(
        Field::RangePitch,
        9,
        "range_pitch",
        half_range(2_618),
        "Workspace: largest pitch to either side, 15 degrees.",
    ),
    sub(
        Field::RangeRoll,
        10,
        "range_roll",
        half_range(698),
        "Workspace: largest roll to either side, 4 degrees.",
    ),
    sub(
        Field::RateLimit,
        11,
        "rate_limit",
        RATE_LIMIT,
        "Fastest change of a target's angle that is followed.",
    ),
];

const GEOMETRY: &[Sub] = &[
    sub(
        Field::Architecture,
        1,
        "architecture",
        ARCHITECTURE,
        "Kind of wrist: 1 parallel axes, 2 orthogonal axes, 3 parallel actuators.",
    ),
    sub(
        Field::GeometryScale,
        2,
        "scale",
        SCALE,
        "Length of the unit mechanism's 1, the rods.",
    ),
];

const HEALTH: &[Sub] = &[
    sub(
        Field::Supply,
        1,
        "supply",
        SUPPLY,
        "Supply voltage of the bridges.",
    ),
    sub(
        Field::BoardTemperature,
        2,
        "board_temperature",
        TEMPERATURE,
        "Temperature of the board.",
    ),
    sub(
        Field::MotorTemperature1,
        3,
        "motor1_temperature",
        TEMPERATURE,
        "Housing temperature of motor 1.",
    ),
    sub(
        Field::MotorTemperature2,
        4,
        "motor2_temperature",
        TEMPERATURE,
        "Housing temperature of motor 2.",
    ),
    sub(
        Field::MotorTemperature3,
        5,
        "motor3_temperature",
        TEMPERATURE,
        "Housing temperature of motor 3.",
    ),
    sub(
        Field::BadTargets,
        6,
        "bad_targets",
        COUNT,
        "Targets refused since power-up: wrong protection byte, mode or counter.",
    ),
    sub(
        Field::LostTargets,
        7,
        "lost_targets",
        COUNT,
        "Targets missed since power-up, by gaps in their counter.",
    ),
    sub(
        Field::ReceiveOverruns,
        8,
        "receive_overruns",
        COUNT,
        "Frames lost since power-up because a receive queue was full.",
    ),
    sub(
        Field::TransmitOverruns,
        9,
        "transmit_overruns",
        COUNT,
        "Frames dropped since power-up because a transmit queue was full.",
    ),
];

const TIMING: &[Sub] = &[
    sub(
        Field::LoopLast,
        1,
        "loop_last",
        MICROSECONDS,
        "Time that the last control tick took.",
    ),
    sub(
        Field::LoopMax,
        2,
        "loop_max",
        MICROSECONDS,
        "Longest time that a control tick took since power-up.",
    ),
    sub(
        Field::SyncPhase,
        3,
        "sync_phase",
        SYNC_PHASE,
        "Arrival of the last SYNC against the control tick's own grid.",
    ),
];

/// Every record of a vertebra's dictionary, by rising index.
pub const OBJECTS: &[Object] = &[
    Object {
        index: 0x2000,
        name: "target",
        description: "What the head asks of the vertebra; RPDO1.",
        subs: TARGET,
    },
    Object {
        index: 0x2001,
        name: "moment",
        description: "Feed-forward moment and stiffness scale; RPDO2.",
        subs: MOMENT,
    },
    Object {
        index: 0x2010,
        name: "pose",
        description: "What the vertebra does; TPDO1.",
        subs: POSE,
    },
    Object {
        index: 0x2011,
        name: "effort",
        description: "Torques of the motors and what bounds them; TPDO2.",
        subs: EFFORT,
    },
    Object {
        index: 0x2012,
        name: "motor",
        description: "Angles of the motors.",
        subs: MOTOR,
    },
    Object {
        index: 0x2013,
        name: "allocation",
        description: "What torque sharing could produce of the moment asked for.",
        subs: ALLOCATION,
    },
    Object {
        index: 0x2020,
        name: "gains",
        description: "Gains and limits of the controller; may be changed while the wrist is off.",
        subs: GAINS,
    },
    Object {
        index: 0x2021,
        name: "geometry",
        description: "The wrist that the kinematics are made for.",
        subs: GEOMETRY,
    },
    Object {
        index: 0x2030,
        name: "health",
        description: "Supply, temperatures and counters.",
        subs: HEALTH,
    },
    Object {
        index: 0x2040,
        name: "timing",
        description: "The control loop's time and the beat of the bus.",
        subs: TIMING,
    },
];

impl Field {
    /// Returns the entry that the field serves, for its default, bounds and scale.
    pub const fn sub(self) -> &'static Sub {
        let mut place = self as usize;
        let mut objects = OBJECTS;
        while let [object, rest @ ..] = objects {
            if place < object.subs.len() {
                return &object.subs[place];
            }
            place -= object.subs.len();
            objects = rest;
        }
        // Never reached: the check below holds that fields and entries correspond one to one.
        &TARGET[0]
    }
}

/// Returns where in [`OBJECTS`] an index stands, without a search.
pub(super) const fn position(index: u16) -> Option<usize> {
    Some(match index {
        0x2000 => 0,
        0x2001 => 1,
        0x2010 => 2,
        0x2011 => 3,
        0x2012 => 4,
        0x2013 => 5,
        0x2020 => 6,
        0x2021 => 7,
        0x2030 => 8,
        0x2040 => 9,
        _ => return None,
    })
}

/// Checks at compile time what the rest of the crate relies on: rising indices that
/// [`position`] knows, subindices without a gap, fields in the order of the table, and bounds that
/// hold the default and lie within the type.
const _: () = {
    let mut fields = 0;
    let mut o = 0;
    while o < OBJECTS.len() {
        let object = &OBJECTS[o];
        assert!(o == 0 || OBJECTS[o - 1].index < object.index);
        assert!(matches!(position(object.index), Some(place) if place == o));
        assert!(!object.subs.is_empty() && object.subs.len() < 0xFF);
        let mut s = 0;
        while s < object.subs.len() {
            let sub = &object.subs[s];
            let (low, high) = sub.data_type.range();
            assert!(sub.subindex as usize == s + 1);
            assert!(sub.field as usize == fields);
            assert!(low <= sub.min && sub.min <= sub.default);
            assert!(sub.default <= sub.max && sub.max <= high);
            fields += 1;
            s += 1;
        }
        o += 1;
    }
};
