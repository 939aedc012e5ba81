//! What entries hold, whatever they are called: the part of the table that repeats.

use eel_canopen::Access;

use super::{DataType, Pdo, Scale};

use Access::{Constant as CONST, ReadOnly as RO, ReadWrite as RW};
use Pdo::{No as NO, Receive as RX, Transmit as TX};

/// What an entry holds, whatever its type: the part that the table repeats.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    pub(super) data_type: DataType,
    pub(super) access: Access,
    pub(super) pdo: Pdo,
    pub(super) unit: &'static str,
    pub(super) scale: Scale,
    pub(super) default: i64,
    pub(super) min: i64,
    pub(super) max: i64,
}

/// Makes the shape of a number without a unit that uses its type's whole range.
pub(super) const fn raw(data_type: DataType, access: Access, pdo: Pdo) -> Shape {
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
pub(super) const fn scale(numerator: u32, denominator: u32) -> Scale {
    assert!(denominator != 0);
    Scale {
        numerator,
        denominator,
    }
}

/// Makes the shape of a number in `unit`, one step being a thousandth of it.
pub(super) const fn thousandths(
    data_type: DataType,
    access: Access,
    pdo: Pdo,
    unit: &'static str,
) -> Shape {
    Shape {
        unit,
        scale: scale(1, 1_000),
        ..raw(data_type, access, pdo)
    }
}

pub(super) const fn angle(access: Access, pdo: Pdo) -> Shape {
    Shape {
        unit: "rad",
        scale: scale(1, 10_000),
        ..raw(DataType::I16, access, pdo)
    }
}

pub(super) const fn torque(access: Access, pdo: Pdo) -> Shape {
    thousandths(DataType::I16, access, pdo, "N.m")
}

pub(super) const fn byte(access: Access, pdo: Pdo) -> Shape {
    raw(DataType::U8, access, pdo)
}

pub(super) const fn word(access: Access, pdo: Pdo) -> Shape {
    raw(DataType::U16, access, pdo)
}

pub(super) const fn stiffness(default: i64) -> Shape {
    let shape = thousandths(DataType::U32, RW, NO, "N.m/rad");
    Shape {
        default,
        max: 500_000,
        ..shape
    }
}

pub(super) const fn damping(default: i64) -> Shape {
    let shape = thousandths(DataType::U32, RW, NO, "N.m.s/rad");
    Shape {
        default,
        max: 50_000,
        ..shape
    }
}

/// Half the workspace about one axis: never beyond the range the wrist is built for.
pub(super) const fn half_range(default: i64) -> Shape {
    Shape {
        default,
        min: 1,
        max: default,
        ..angle(RW, NO)
    }
}

pub(super) const STIFFNESS_SCALE: Shape = Shape {
    scale: scale(1, 32_768),
    default: 32_768,
    ..word(RW, RX)
};
pub(super) const PEAK_TORQUE: Shape = Shape {
    default: 3_000,
    min: 1,
    max: 32_000,
    ..thousandths(DataType::U16, RW, NO, "N.m")
};
pub(super) const RATE_LIMIT: Shape = Shape {
    default: 6_000,
    min: 1,
    max: 20_000,
    ..thousandths(DataType::U16, RW, NO, "rad/s")
};
pub(super) const MICRORADIANS: Shape = Shape {
    unit: "rad",
    scale: scale(1, 1_000_000),
    ..raw(DataType::I32, RO, TX)
};
pub(super) const ARCHITECTURE: Shape = Shape {
    default: 3,
    min: 3,
    max: 3,
    ..byte(CONST, NO)
};
pub(super) const SCALE: Shape = Shape {
    unit: "m",
    scale: scale(1, 1_000_000),
    default: 40_000,
    min: 40_000,
    max: 40_000,
    ..raw(DataType::U32, CONST, NO)
};
pub(super) const fn motor(unit: &'static str, digits: u32, value: i64) -> Shape {
    Shape {
        unit,
        scale: scale(1, 10_u32.pow(digits)),
        default: value,
        min: value,
        max: value,
        ..raw(DataType::U32, CONST, NO)
    }
}
pub(super) const SUPPLY: Shape = thousandths(DataType::U16, RO, TX, "V");
pub(super) const TEMPERATURE: Shape = Shape {
    unit: "degC",
    scale: scale(1, 10),
    ..raw(DataType::I16, RO, TX)
};
pub(super) const COUNT: Shape = raw(DataType::U32, RO, TX);
pub(super) const MICROSECONDS: Shape = Shape {
    unit: "s",
    scale: scale(1, 1_000_000),
    ..raw(DataType::U16, RO, TX)
};
pub(super) const NANOSECONDS: Shape = Shape {
    unit: "s",
    scale: scale(1, 1_000_000_000),
    ..raw(DataType::U16, RO, TX)
};
pub(super) const FRICTION: Shape = Shape {
    default: 60,
    max: 1_000,
    ..thousandths(DataType::U16, RW, NO, "N.m")
};
pub(super) const FRICTION_VISCOUS: Shape = Shape {
    default: 20,
    max: 1_000,
    ..thousandths(DataType::U16, RW, NO, "N.m.s/rad")
};
pub(super) const FRICTION_SPEED: Shape = Shape {
    default: 50,
    min: 1,
    max: 5_000,
    ..thousandths(DataType::U16, RW, NO, "rad/s")
};
pub(super) const fn thermal_resistance(default: i64) -> Shape {
    Shape {
        default,
        min: 10,
        max: 1_000_000,
        ..thousandths(DataType::U32, RW, NO, "K/W")
    }
}
pub(super) const fn heat_capacity(default: i64) -> Shape {
    Shape {
        default,
        min: 100,
        max: 10_000_000,
        ..thousandths(DataType::U32, RW, NO, "J/K")
    }
}
pub(super) const fn limit_temperature(default: i64) -> Shape {
    Shape {
        default,
        min: -400,
        max: 2_000,
        access: RW,
        pdo: NO,
        ..TEMPERATURE
    }
}
pub(super) const SYNC_PHASE: Shape = Shape {
    data_type: DataType::I16,
    min: -32_768,
    max: 32_767,
    ..MICROSECONDS
};
pub(super) const DOMAIN: Shape = raw(DataType::Domain, RO, NO);
pub(super) const CHANNEL: Shape = raw(DataType::U32, RW, NO);
pub(super) const DIVIDER: Shape = Shape {
    default: 1,
    min: 1,
    ..word(RW, NO)
};
pub(super) const TRIGGER: Shape = Shape {
    max: 2,
    ..byte(RW, NO)
};
pub(super) const LINK_DATA: Shape = raw(DataType::Domain, RW, NO);
pub(super) const LINK_LENGTH: Shape = Shape {
    default: 889,
    max: 0x00FF_FFFF,
    ..raw(DataType::U32, RW, NO)
};
pub(super) const STATUS: Shape = raw(DataType::U32, RO, TX);
pub(super) const SERIAL: Shape = raw(DataType::U32, RW, NO);
/// An angle of a crank's encoder, within half a turn.
pub(super) const fn reading(default: i64) -> Shape {
    Shape {
        default,
        min: -3_141_593,
        max: 3_141_593,
        access: RW,
        pdo: NO,
        ..MICRORADIANS
    }
}
pub(super) const CURRENT_OFFSET: Shape = Shape {
    unit: "A",
    scale: scale(1, 1_000_000),
    min: -500_000,
    max: 500_000,
    ..raw(DataType::I32, RW, NO)
};
pub(super) const SENSES: Shape = Shape {
    max: 0x1FF,
    ..word(RW, NO)
};
pub(super) const STEP: Shape = Shape {
    max: 5,
    ..byte(RW, NO)
};
/// The trim of a tick, within 5 µs.
pub(super) const TICK_TRIM: Shape = Shape {
    data_type: DataType::I16,
    min: -5_000,
    max: 5_000,
    ..NANOSECONDS
};
pub(super) const CHAIN_OUT: Shape = Shape {
    max: 2,
    ..byte(RW, NO)
};
