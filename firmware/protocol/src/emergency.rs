//! The catalogue of emergencies: stable numbers, and for each what it means and what to check.
//!
//! A number is never given a second meaning. Standard codes are those of CiA 301, 7.2.7.1, and of
//! CiA 402-2, 5.3; what the standards have no word for is 0xFFxx. The error register is 0x1001's.

/// The generic bit of the error register: set with every error.
pub const REGISTER_GENERIC: u8 = 1 << 0;
/// The current bit of the error register.
pub const REGISTER_CURRENT: u8 = 1 << 1;
/// The voltage bit of the error register.
pub const REGISTER_VOLTAGE: u8 = 1 << 2;
/// The temperature bit of the error register.
pub const REGISTER_TEMPERATURE: u8 = 1 << 3;
/// The communication bit of the error register.
pub const REGISTER_COMMUNICATION: u8 = 1 << 4;
/// The manufacturer's bit of the error register.
pub const REGISTER_MANUFACTURER: u8 = 1 << 7;

/// What an emergency does to the vertebra.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// It tells that the errors before it have ended.
    Cleared,
    /// The vertebra goes on, perhaps with less.
    Warning,
    /// The wrist stops and latches; only a fault reset leads out.
    Fault,
}

impl Severity {
    /// Returns the name that tools print.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cleared => "cleared",
            Self::Warning => "warning",
            Self::Fault => "fault",
        }
    }
}

/// One emergency of the catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emergency {
    /// Its number on the wire.
    pub code: u16,
    /// Its name, such as `command-lost`.
    pub name: &'static str,
    /// What it does to the vertebra.
    pub severity: Severity,
    /// The bits of the error register that it sets.
    pub register: u8,
    /// What the report's detail counts; empty where it is 0.
    pub detail: &'static str,
    /// What it means and what to check.
    pub sentence: &'static str,
}

/// Defines the catalogue and one constant for each of its emergencies.
macro_rules! catalogue {
    ($($constant:ident = $code:literal $name:literal $severity:ident $register:expr,
        $detail:literal, $sentence:literal;)*) => {
        impl Emergency {
            $(
                #[doc = concat!("`", $name, "`: ", $sentence)]
                pub const $constant: Self = Self {
                    code: $code,
                    name: $name,
                    severity: Severity::$severity,
                    register: $register,
                    detail: $detail,
                    sentence: $sentence,
                };
            )*
        }

        /// Every emergency, by rising number.
        pub const CATALOGUE: &[Emergency] = &[$(Emergency::$constant,)*];
    };
}

catalogue! {
    CLEARED = 0x0000 "cleared" Cleared 0, "",
        "Every error before has ended; nothing to do.";
    OVER_CURRENT = 0x2310 "over-current" Fault REGISTER_GENERIC | REGISTER_CURRENT,
        "current in mA",
        "A motor's current passed its hard limit: look for a blocked crank or a shorted winding.";
    BRIDGE_FAULT = 0x2340 "bridge-fault" Fault REGISTER_GENERIC | REGISTER_CURRENT, "",
        "A motor bridge reports a fault: check its wiring and supply, then reset it by power.";
    OVER_VOLTAGE = 0x3210 "over-voltage" Fault REGISTER_GENERIC | REGISTER_VOLTAGE,
        "supply in 10 mV",
        "The supply is above its window: braking feeds energy back, check the supply and its clamp.";
    UNDER_VOLTAGE = 0x3220 "under-voltage" Fault REGISTER_GENERIC | REGISTER_VOLTAGE,
        "supply in 10 mV",
        "The supply is below its window: check the battery and the voltage drop along the spine.";
    BOARD_OVER_TEMPERATURE = 0x4210 "board-over-temperature" Fault
        REGISTER_GENERIC | REGISTER_TEMPERATURE, "temperature in 0.1 degC",
        "The board is hotter than it may be: let it cool, and check its contact with the hull.";
    MOTOR_OVER_TEMPERATURE = 0x4310 "motor-over-temperature" Fault
        REGISTER_GENERIC | REGISTER_TEMPERATURE, "temperature in 0.1 degC",
        "A motor's housing is hotter than it may be: let it cool, and check its load and its sensor.";
    WINDING_OVER_TEMPERATURE = 0x4320 "winding-over-temperature" Fault
        REGISTER_GENERIC | REGISTER_TEMPERATURE, "temperature in 0.1 degC",
        "A motor's winding is hotter than its current limit can explain: check its load, water and current sensor.";
    SETTINGS_INVALID = 0x6320 "settings-invalid" Fault REGISTER_GENERIC | REGISTER_MANUFACTURER, "",
        "The stored settings are damaged or contradict each other: write them again and store them.";
    ENCODER_IMPLAUSIBLE = 0x7300 "encoder-implausible" Fault
        REGISTER_GENERIC | REGISTER_MANUFACTURER, "step in 0.1 mrad",
        "An encoder jumped farther than the motor can turn: check its cable, shield and magnet.";
    ENCODER_INVALID = 0x7320 "encoder-invalid" Fault REGISTER_GENERIC | REGISTER_MANUFACTURER, "",
        "A crank's absolute encoder gives no valid angle: check its magnet and its SPI cable.";
    HEAD_LOST = 0x8130 "head-lost" Fault REGISTER_GENERIC | REGISTER_COMMUNICATION,
        "node id of the silent node",
        "The head's heartbeat stopped, and the wrist lets go: check the head and the cable to it.";
    RPDO_LENGTH = 0x8210 "rpdo-length" Warning REGISTER_GENERIC | REGISTER_COMMUNICATION, "",
        "A PDO was shorter than its mapping and was not used: check who sends it, and the mapping.";
    SYNC_LENGTH = 0x8240 "sync-length" Warning REGISTER_GENERIC | REGISTER_COMMUNICATION, "",
        "SYNC came without its counter, or with more than it: check who sends it, and object 0x1019.";
    COMMAND_LOST = 0x8250 "command-lost" Fault REGISTER_GENERIC | REGISTER_COMMUNICATION,
        "silence in ms",
        "Targets stopped coming, and the wrist lets go: check the head's program and the bus load.";
    FOLLOWING_ERROR = 0x8611 "following-error" Warning REGISTER_GENERIC | REGISTER_MANUFACTURER,
        "error in 0.1 mrad",
        "The wrist is far from its target: look for an obstacle, a weak motor or too fast a gait.";
    EMERGENCY_STOP = 0x9000 "emergency-stop" Fault REGISTER_GENERIC, "",
        "The emergency stop line is asserted: make sure that all is safe, release it, then reset.";
    COMMAND_LATE = 0xFF10 "command-late" Warning REGISTER_GENERIC | REGISTER_COMMUNICATION,
        "missed SYNC periods",
        "No target for three SYNC periods; the wrist slows down: check the head's timing and the bus.";
    COMMAND_BAD = 0xFF11 "command-bad" Fault REGISTER_GENERIC | REGISTER_COMMUNICATION,
        "bad targets since power-up",
        "Three targets in a row failed their protection, and the wrist lets go: check who sends them.";
    STOPPED_BY_NMT = 0xFF12 "stopped-by-nmt" Fault REGISTER_GENERIC | REGISTER_COMMUNICATION, "",
        "An NMT command took the node out of operation while the wrist was moving: check who sent it.";
    TARGET_LIMITED = 0xFF20 "target-limited" Warning REGISTER_GENERIC | REGISTER_MANUFACTURER,
        "limited axes: bit 0 yaw, 1 pitch, 2 roll",
        "A target lay outside the workspace and was limited: reduce the gait's amplitude.";
    OUT_OF_REACH = 0xFF21 "out-of-reach" Fault REGISTER_GENERIC | REGISTER_MANUFACTURER, "",
        "The wrist's geometry has no solution for this pose: check calibration and mechanics.";
    SINGULAR = 0xFF22 "singular" Fault REGISTER_GENERIC | REGISTER_MANUFACTURER, "",
        "The wrist is too near a singularity to be controlled: check calibration and mechanics.";
    NOT_FOLLOWING = 0xFF23 "not-following" Fault REGISTER_GENERIC | REGISTER_MANUFACTURER,
        "error in 0.1 mrad",
        "The wrist was far from its target for long: it is stuck, miswired, or the gait is too fast.";
    NEAR_SINGULARITY = 0xFF24 "near-singularity" Warning REGISTER_GENERIC | REGISTER_MANUFACTURER,
        "det A in 0.001",
        "The wrist is near a singularity and its torque is reduced: reduce the gait or the ranges.";
    RESIDUAL = 0xFF30 "residual" Fault REGISTER_GENERIC | REGISTER_MANUFACTURER,
        "residual in 0.1 mrad",
        "The motors' angles belong to no pose of the home branch: check couplings and calibration.";
    RESTARTED = 0xFF40 "restarted" Fault REGISTER_GENERIC | REGISTER_MANUFACTURER, "",
        "It started anew after a failure or in a latched stop: find the cause, then reset the fault.";
}

/// Returns the catalogue's emergency with this number.
pub fn from_code(code: u16) -> Option<&'static Emergency> {
    let place = CATALOGUE
        .binary_search_by_key(&code, |emergency| emergency.code)
        .ok()?;
    CATALOGUE.get(place)
}

/// Where an emergency comes from: the five bytes of the frame that are the manufacturer's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// 0 for the whole wrist, or the motor 1–3.
    pub motor: u8,
    /// Code of the limit that goes with it, [`LimitCode`](crate::LimitCode) where it is one.
    pub limit: u8,
    /// The number that [`Emergency::detail`] describes.
    pub detail: u16,
}

impl Source {
    /// The whole wrist, without a detail.
    pub const WHOLE: Self = Self::whole(0);

    /// Names the whole wrist and a number.
    pub const fn whole(detail: u16) -> Self {
        Self {
            motor: 0,
            limit: 0,
            detail,
        }
    }

    /// Returns the five bytes; the last is reserved and 0.
    pub const fn to_bytes(self) -> [u8; 5] {
        let [low, high] = self.detail.to_le_bytes();
        [self.motor, self.limit, low, high, 0]
    }

    /// Reads the five bytes; every pattern is a source.
    pub const fn from_bytes(bytes: [u8; 5]) -> Self {
        let [motor, limit, low, high, _] = bytes;
        Self {
            motor,
            limit,
            detail: u16::from_le_bytes([low, high]),
        }
    }
}

/// An emergency frame's eight bytes as a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmergencyReport {
    /// The emergency's number, of the catalogue or not.
    pub code: u16,
    /// The error register of the sender.
    pub register: u8,
    /// Where it comes from.
    pub source: Source,
}

impl EmergencyReport {
    /// Packs the report.
    pub const fn to_bytes(self) -> [u8; 8] {
        let [low, high] = self.code.to_le_bytes();
        let [a, b, c, d, e] = self.source.to_bytes();
        [low, high, self.register, a, b, c, d, e]
    }

    /// Unpacks a report; every pattern is one.
    pub const fn from_bytes(bytes: [u8; 8]) -> Self {
        let [low, high, register, a, b, c, d, e] = bytes;
        let source = Source::from_bytes([a, b, c, d, e]);
        Self {
            code: u16::from_le_bytes([low, high]),
            register,
            source,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_rise_and_names_are_unique() {
        assert!(CATALOGUE.is_sorted_by(|a, b| a.code < b.code));
        for (place, emergency) in CATALOGUE.iter().enumerate() {
            assert!(
                CATALOGUE[..place]
                    .iter()
                    .all(|other| other.name != emergency.name)
            );
            assert_eq!(from_code(emergency.code), Some(emergency));
        }
        assert_eq!(from_code(0x1234), None);
    }

    #[test]
    fn every_error_sets_the_generic_bit_and_ends_in_a_full_stop() {
        for emergency in CATALOGUE {
            let cleared = emergency.severity == Severity::Cleared;
            assert_eq!(
                emergency.register & REGISTER_GENERIC == 0,
                cleared,
                "{}",
                emergency.name
            );
            assert!(emergency.sentence.ends_with('.'), "{}", emergency.name);
        }
    }

    /// The promise of the catalogue: this list only ever grows.
    #[test]
    fn numbers_never_change_their_meaning() {
        let pinned = [
            (0x0000, "cleared"),
            (0x2310, "over-current"),
            (0x2340, "bridge-fault"),
            (0x3210, "over-voltage"),
            (0x3220, "under-voltage"),
            (0x4210, "board-over-temperature"),
            (0x4310, "motor-over-temperature"),
            (0x4320, "winding-over-temperature"),
            (0x6320, "settings-invalid"),
            (0x7300, "encoder-implausible"),
            (0x7320, "encoder-invalid"),
            (0x8130, "head-lost"),
            (0x8210, "rpdo-length"),
            (0x8240, "sync-length"),
            (0x8250, "command-lost"),
            (0x8611, "following-error"),
            (0x9000, "emergency-stop"),
            (0xFF10, "command-late"),
            (0xFF11, "command-bad"),
            (0xFF12, "stopped-by-nmt"),
            (0xFF20, "target-limited"),
            (0xFF21, "out-of-reach"),
            (0xFF22, "singular"),
            (0xFF23, "not-following"),
            (0xFF24, "near-singularity"),
            (0xFF30, "residual"),
            (0xFF40, "restarted"),
        ];
        for (code, name) in pinned {
            assert_eq!(from_code(code).map(|emergency| emergency.name), Some(name));
        }
        assert_eq!(CATALOGUE.len(), pinned.len());
    }

    #[test]
    fn a_report_survives_the_way_to_bytes_and_back() {
        let source = Source {
            motor: 2,
            limit: 7,
            detail: 0x1234,
        };
        let report = EmergencyReport {
            code: 0x2310,
            register: 3,
            source,
        };
        assert_eq!(report.to_bytes(), [0x10, 0x23, 3, 2, 7, 0x34, 0x12, 0]);
        assert_eq!(EmergencyReport::from_bytes(report.to_bytes()), report);
    }
}
