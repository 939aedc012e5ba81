//! The procedures that set a vertebra up and test it, object 0x2060.

/// What a vertebra is told to do by writing 0x2060:1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Step {
    /// Measures what the current sensors read without a current.
    Offsets = 1,
    /// Takes the pose, which is held, for home.
    Home = 2,
    /// Watches hands turn the wrist: to positive yaw, then, straight again, to positive roll.
    Senses = 3,
    /// Turns each motor a little and looks which way its crank goes.
    Leads = 4,
    /// Tests sensors and bridges.
    Test = 5,
}

/// How a procedure goes, 0x2060:2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Progress {
    /// None was begun.
    #[default]
    Idle = 0,
    /// It goes on.
    Running = 1,
    /// It came to its end.
    Done = 2,
    /// It could not; 0x2060:3 says why.
    Failed = 3,
}

/// Defines reasons with their numbers and sentences.
macro_rules! reasons {
    ($($(#[$doc:meta])* $variant:ident = $value:literal $sentence:literal,)*) => {
        /// Why a procedure failed, 0x2060:3.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Reason {
            /// It did not.
            #[default]
            None = 0,
            $($(#[$doc])* $variant = $value,)*
        }

        impl Reason {
            /// Every reason.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Says what was wrong and what to do.
            pub const fn sentence(self) -> &'static str {
                match self {
                    Self::None => "Nothing is wrong.",
                    $(Self::$variant => $sentence,)*
                }
            }

            /// Reads a number; `None` where it means nothing.
            pub const fn from_code(code: u8) -> Option<Self> {
                match code {
                    0 => Some(Self::None),
                    $($value => Some(Self::$variant),)*
                    _ => None,
                }
            }
        }
    };
}

reasons! {
    /// A crank moved that was to be still.
    Moved = 1 "A crank was not at home, or moved that was to be still: hold the wrist firmly, then begin the step again.",
    /// An absolute encoder gave no valid angle.
    Encoder = 2 "A crank's absolute encoder gives no valid angle: check its magnet and its SPI cable.",
    /// A current sensor reads too much without a current.
    Offset = 3 "A current sensor reads more than 160 mA without a current: check the sensor and its supply.",
    /// Nobody moved the wrist.
    Timeout = 4 "The wrist was not turned far enough within 60 s: 22 degrees to positive yaw, back, 3 degrees to positive roll.",
    /// Counter and absolute encoder tell different angles.
    Disagree = 5 "A motor's counter and its crank's encoder part: check both cables and the coupling between.",
    /// The cranks did not move as yaw moves them.
    Motion = 6 "Cranks 1 and 2 did not move alike: turn the wrist in yaw alone, then begin the step again.",
    /// A motor did not move its crank.
    Still = 7 "A motor did not move its crank: check its leads, its bridge, and that nothing holds the wrist.",
    /// A fault or a stop came, or the node was started.
    Stopped = 8 "A fault or a stop ended it: see `eel faults`, clear it, then begin the step again.",
    /// A check of the self test failed.
    Checks = 9 "A check of the self test failed: see which.",
    /// It was ended by the bus.
    Ended = 10 "It was ended by a command.",
}

/// Defines the checks of the self test.
macro_rules! checks {
    ($($variant:ident = $bit:literal $name:literal $sentence:literal,)*) => {
        /// A check of the self test: a bit of 0x2060:5, and of :6 where it failed.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Check {
            $(#[doc = $sentence] $variant = $bit,)*
        }

        impl Check {
            /// Every check, from bit 0.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Returns the mask of its bit.
            pub const fn mask(self) -> u16 {
                1 << self as u16
            }

            /// Returns the name that tools print.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// Says what it looks at.
            pub const fn sentence(self) -> &'static str {
                match self { $(Self::$variant => $sentence,)* }
            }
        }
    };
}

checks! {
    Settings = 0 "settings" "The settings contradict neither themselves nor physics, and none are lost.",
    Calibration = 1 "calibration" "The calibration is this unit's.",
    Absolute = 2 "absolute" "Every absolute encoder gives valid angles for 0.2 s.",
    Noise = 3 "noise" "Absolute encoders and counters agree within 5 mrad while nothing moves.",
    Residual = 4 "residual" "The cranks' angles are those of a pose.",
    Offsets = 5 "offsets" "Every current sensor reads less than 50 mA without a current.",
    Supply = 6 "supply" "The supply is inside its window.",
    Temperatures = 7 "temperatures" "Board and motors read between -20 degC and the start of their ramps.",
    Lines = 8 "lines" "No bridge reports a fault, and the emergency stop line is closed.",
    Bridges = 9 "bridges" "Each motor carries 0.2 A within 20 %, both ways, when its bridge is told to.",
}

impl Step {
    /// Reads a number; `None` where it means nothing.
    pub const fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            1 => Self::Offsets,
            2 => Self::Home,
            3 => Self::Senses,
            4 => Self::Leads,
            5 => Self::Test,
            _ => return None,
        })
    }
}

impl Progress {
    /// Reads a number; `None` where it means nothing.
    pub const fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            0 => Self::Idle,
            1 => Self::Running,
            2 => Self::Done,
            3 => Self::Failed,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_reads_back_and_every_reason_says_what_to_do() {
        for reason in Reason::ALL {
            assert_eq!(Reason::from_code(*reason as u8), Some(*reason));
            assert!(reason.sentence().ends_with('.'));
        }
        assert_eq!(Reason::from_code(200), None);
        for code in 1..=5 {
            assert_eq!(Step::from_code(code).map(|step| step as u8), Some(code));
        }
        assert_eq!((Step::from_code(0), Step::from_code(6)), (None, None));
        for (bit, check) in Check::ALL.iter().enumerate() {
            assert_eq!(check.mask(), 1 << bit);
        }
    }
}
