//! The status word: why enabling is refused, and what else holds at the moment.

/// One bit of the status word, object 0x2010:6.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Condition {
    /// Refuses enabling: the settings are damaged or contradict each other.
    Settings = 0,
    /// Refuses enabling: the encoders have not been valid for long enough.
    Encoders = 1,
    /// Refuses enabling: the pose is outside the limits.
    Pose = 2,
    /// Refuses enabling: the supply is outside its window.
    Voltage = 3,
    /// Refuses enabling: a board or motor is too hot.
    Temperature = 4,
    /// Refuses enabling: a bridge reports a fault.
    Bridge = 5,
    /// Refuses enabling: the emergency stop line is asserted.
    EmergencyStop = 6,
    /// Refuses enabling: the motors' angles belong to no pose.
    Residual = 7,
    /// Refuses enabling: the node is not operational.
    NotOperational = 8,
    /// Refuses enabling: a stop or fault is latched and wants a fault reset.
    Latched = 9,
    /// Refuses enabling: targets stopped coming.
    CommandLost = 10,
    /// Refuses enabling: the head's heartbeat is missing.
    HeadLost = 11,
    /// The last target was outside the workspace and has been limited.
    TargetLimited = 12,
    /// Part of the moment could not be produced.
    MomentLimited = 13,
    /// Targets are late; the wrist is slowing down.
    CommandLate = 14,
    /// The pose is far from the target.
    FollowingError = 15,
    /// Refuses enabling: the calibration is not this unit's.
    Calibration = 16,
    /// Refuses enabling: a current sensor reads a current while the bridges are off.
    CurrentOffset = 17,
    /// The wrist is near a singularity; torque is reduced.
    NearSingularity = 18,
}

impl Condition {
    /// Every condition, from bit 0.
    pub const ALL: [Self; 19] = [
        Self::Settings,
        Self::Encoders,
        Self::Pose,
        Self::Voltage,
        Self::Temperature,
        Self::Bridge,
        Self::EmergencyStop,
        Self::Residual,
        Self::NotOperational,
        Self::Latched,
        Self::CommandLost,
        Self::HeadLost,
        Self::TargetLimited,
        Self::MomentLimited,
        Self::CommandLate,
        Self::FollowingError,
        Self::Calibration,
        Self::CurrentOffset,
        Self::NearSingularity,
    ];

    /// Returns the number of its bit, 0–18.
    pub const fn bit(self) -> u8 {
        self as u8
    }

    /// Tells whether the vertebra refuses to be enabled while it holds.
    pub const fn refuses(self) -> bool {
        !matches!(
            self,
            Self::TargetLimited
                | Self::MomentLimited
                | Self::CommandLate
                | Self::FollowingError
                | Self::NearSingularity
        )
    }

    /// Returns the name that tools print.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Settings => "settings",
            Self::Encoders => "encoders",
            Self::Pose => "pose",
            Self::Voltage => "voltage",
            Self::Temperature => "temperature",
            Self::Bridge => "bridge",
            Self::EmergencyStop => "emergency-stop",
            Self::Residual => "residual",
            Self::NotOperational => "not-operational",
            Self::Latched => "latched",
            Self::CommandLost => "command-lost",
            Self::HeadLost => "head-lost",
            Self::TargetLimited => "target-limited",
            Self::MomentLimited => "moment-limited",
            Self::CommandLate => "command-late",
            Self::FollowingError => "following-error",
            Self::Calibration => "calibration",
            Self::CurrentOffset => "current-offset",
            Self::NearSingularity => "near-singularity",
        }
    }

    /// Says in words what holds while the bit is set.
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::Settings => "The settings are damaged or contradict each other.",
            Self::Encoders => "The encoders have not been valid for long enough.",
            Self::Pose => "The pose is outside the limits.",
            Self::Voltage => "The supply is outside its window.",
            Self::Temperature => "A board or motor is too hot.",
            Self::Bridge => "A bridge reports a fault.",
            Self::EmergencyStop => "The emergency stop line is asserted.",
            Self::Residual => "The motors' angles belong to no pose.",
            Self::NotOperational => "The node is not operational.",
            Self::Latched => "A stop or fault is latched and wants a fault reset.",
            Self::CommandLost => "Targets stopped coming.",
            Self::HeadLost => "The head's heartbeat is missing.",
            Self::TargetLimited => "The last target was outside the workspace and was limited.",
            Self::MomentLimited => "Part of the moment could not be produced.",
            Self::CommandLate => "Targets are late; the wrist is slowing down.",
            Self::FollowingError => "The pose is far from the target.",
            Self::Calibration => "The calibration is not this unit's: `eel calibrate`.",
            Self::CurrentOffset => "A current sensor reads a current while the bridges are off.",
            Self::NearSingularity => "The wrist is near a singularity; torque is reduced.",
        }
    }
}

/// The bits that refuse nothing.
const WARNINGS: u32 = 1 << Condition::TargetLimited.bit()
    | 1 << Condition::MomentLimited.bit()
    | 1 << Condition::CommandLate.bit()
    | 1 << Condition::FollowingError.bit()
    | 1 << Condition::NearSingularity.bit();

/// The status word: a set of conditions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status(u32);

impl Status {
    /// No condition holds.
    pub const NONE: Self = Self(0);

    /// Reads the word; every pattern is a status.
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// Returns the word.
    pub const fn to_bits(self) -> u32 {
        self.0
    }

    /// Tells whether `condition` holds.
    pub const fn contains(self, condition: Condition) -> bool {
        self.0 & (1 << condition.bit()) != 0
    }

    /// Returns the status with `condition` holding or not.
    #[must_use]
    pub const fn with(self, condition: Condition, holds: bool) -> Self {
        let mask = 1 << condition.bit();
        if holds {
            Self(self.0 | mask)
        } else {
            Self(self.0 & !mask)
        }
    }

    /// Returns the part that refuses enabling.
    #[must_use]
    pub const fn refusals(self) -> Self {
        Self(self.0 & !WARNINGS)
    }

    /// Tells whether no condition holds.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Returns the conditions that hold, from bit 0.
    pub fn conditions(self) -> impl Iterator<Item = Condition> {
        Condition::ALL
            .into_iter()
            .filter(move |condition| self.contains(*condition))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_condition_has_a_bit_of_its_own() {
        for (bit, condition) in Condition::ALL.into_iter().enumerate() {
            let status = Status::NONE.with(condition, true);
            assert_eq!(status.to_bits(), 1 << bit);
            assert!(status.contains(condition));
            assert_eq!(status.refusals().is_empty(), !condition.refuses());
            assert!(status.conditions().eq([condition]));
            assert!(status.with(condition, false).is_empty());
        }
    }
}
