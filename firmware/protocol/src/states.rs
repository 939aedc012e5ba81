//! What the head may ask of a vertebra, and what a vertebra may answer.

/// Defines a closed set of four-bit codes.
macro_rules! nibble {
    ($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident = $value:literal $text:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum $name { $($(#[$vdoc])* $variant = $value,)* }

        impl $name {
            /// Every value, in the order of its code.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Reads a code; `None` where it means nothing.
            #[inline]
            pub const fn from_code(code: u8) -> Option<Self> {
                match code { $($value => Some(Self::$variant),)* _ => None }
            }

            /// Returns the four-bit code.
            #[inline]
            pub const fn code(self) -> u8 {
                self as u8
            }

            /// Returns the name that tools print.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text,)* }
            }
        }
    };
}

nibble! {
    /// What the head asks of a vertebra, in every target frame.
    Mode {
        /// Bridges off; the wrist is free.
        Off = 0 "off",
        /// Low sides on: the wrist resists motion passively.
        Brake = 1 "brake",
        /// Zero velocity with little torque.
        Damped = 2 "damped",
        /// Hold the pose in which the mode began; the target is ignored.
        Hold = 3 "hold",
        /// Follow the target.
        Run = 4 "run",
        /// Produce the moment of object 0x2001 and no other inside the workspace; the target is ignored.
        Moment = 5 "moment",
        /// Commissioning: each motor produces its torque of object 0x2002; the target is ignored.
        Motor = 6 "motor",
        /// Acknowledge a latched stop; acts once, when the mode before was another.
        FaultReset = 15 "fault-reset",
    }
}

nibble! {
    /// What a vertebra is doing, in every pose frame.
    State {
        /// Power-up checks are running.
        NotReady = 0 "not-ready",
        /// Bridges off; enabling is refused for a reason that object 0x2010:6 names.
        SwitchedOff = 1 "switched-off",
        /// Bridges off; may be enabled.
        Ready = 2 "ready",
        /// Following the target.
        Run = 3 "run",
        /// Holding a pose.
        Hold = 4 "hold",
        /// Damped on request.
        Damped = 5 "damped",
        /// Braking on request.
        Brake = 6 "brake",
        /// Stopping, first part: zero velocity, torque ramping down. Latched.
        StopDamped = 7 "stop-damped",
        /// Stopping, second part: low sides on. Latched.
        StopBrake = 8 "stop-brake",
        /// Stopped: bridges off until a fault reset. Latched.
        StopOff = 9 "stop-off",
        /// A fault of this vertebra: off until a fault reset. Latched.
        Fault = 10 "fault",
        /// Producing a moment.
        Moment = 12 "moment",
        /// Producing a torque of each motor, for commissioning.
        Motor = 13 "motor",
        /// A procedure of object 0x2060 tries single motors.
        Test = 14 "test",
    }
}

impl Mode {
    /// Returns the state of a vertebra that is enabled and in the mode; `None` for those that switch off.
    pub const fn state(self) -> Option<State> {
        Some(match self {
            Self::Off | Self::FaultReset => return None,
            Self::Brake => State::Brake,
            Self::Damped => State::Damped,
            Self::Hold => State::Hold,
            Self::Run => State::Run,
            Self::Moment => State::Moment,
            Self::Motor => State::Motor,
        })
    }
}

impl State {
    /// Tells whether a motor may carry current.
    pub const fn is_driven(self) -> bool {
        matches!(
            self,
            Self::Run
                | Self::Hold
                | Self::Moment
                | Self::Motor
                | Self::Damped
                | Self::Brake
                | Self::StopDamped
                | Self::StopBrake
                | Self::Test
        )
    }

    /// Tells whether only a fault reset leads out of the state.
    pub const fn is_latched(self) -> bool {
        matches!(
            self,
            Self::StopDamped | Self::StopBrake | Self::StopOff | Self::Fault
        )
    }
}

nibble! {
    /// What bounds a motor's torque at the moment.
    LimitCode {
        /// Nothing: the torque is what was asked for.
        None = 0 "none",
        /// The configured peak torque.
        Peak = 1 "peak",
        /// The cap that the commanded mode or the stop ramp sets.
        Command = 2 "command",
        /// The thermal bound of the motor.
        Thermal = 3 "thermal",
        /// The temperature of the board.
        Board = 4 "board",
        /// The supply is too low.
        Undervoltage = 5 "undervoltage",
        /// The supply is too high.
        Overvoltage = 6 "overvoltage",
        /// The end of the motor's or the wrist's travel.
        Travel = 7 "travel",
        /// What the voltage can drive at this speed.
        Speed = 8 "speed",
        /// The wrist is near a singularity.
        Singularity = 9 "singularity",
        /// The drive is off.
        Off = 15 "off",
    }
}
