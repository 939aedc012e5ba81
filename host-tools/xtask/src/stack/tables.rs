//! What the code does not tell: who is called by a pointer, and how deep recursion goes.
//!
//! Names are parts of demangled ones. That nothing is missing is checked: each function that calls by a
//! pointer needs an entry, and each whose address is kept needs one that reaches it.

use super::graph::Recursion;

/// Who calls by a pointer, and whom that can reach, among the functions whose address is kept.
pub struct Indirect {
    pub from: &'static str,
    pub to: &'static [&'static str],
}

/// All of that for one image.
pub struct Plan {
    /// The first entry that fits a caller counts.
    pub calls: &'static [Indirect],
    /// What has its address kept, and is called by nobody.
    pub idle: &'static [&'static str],
    pub recursions: &'static [Recursion],
}

impl Indirect {
    /// Tells whether this is about a caller.
    pub fn is_from(&self, name: &str) -> bool {
        name.contains(self.from)
    }
}

/// What a waker does; and what the CAN driver has called when a handle of it is dropped.
const WAKERS: &[&str] = &["embassy_executor::raw::waker::", "FDCAN1_IT0 as "];
/// A vertebra behind `&mut dyn Application`.
const APPLICATION: &[&str] = &["as eel_canopen::application::Application>::"];
/// How `core::fmt` prints something, and where to.
const PRINTING: &[&str] = &[
    " as core::fmt::Display>::",
    " as core::fmt::Debug>::",
    " as core::fmt::Write>::",
];

/// The vertebra's own board.
pub const STM32G474: Plan = Plan {
    calls: &[
        // Each executor runs in its interrupt, and has its own tasks.
        Indirect {
            from: "LPUART1",
            to: &["slow::__run_task", "raw::poll_exited"],
        },
        Indirect {
            from: "UART4",
            to: &[
                "bus::__receive_task",
                "bus::__transmit_task",
                "raw::poll_exited",
            ],
        },
        Indirect {
            from: "UART5",
            to: &["control::__run_task", "raw::poll_exited"],
        },
        Indirect {
            from: "eel_canopen::",
            to: APPLICATION,
        },
        Indirect {
            from: "_defmt_",
            to: &["defmt_rtt::channel::Channel>::"],
        },
        // Nothing is printed, so no printing function has anywhere to print to.
        Indirect {
            from: "core::fmt::",
            to: &[],
        },
        // What remains are queues, channels, timers and interrupts of embassy, which wake tasks.
        Indirect {
            from: "embassy_",
            to: WAKERS,
        },
        Indirect {
            from: "FDCAN1_IT0",
            to: WAKERS,
        },
        Indirect {
            from: "board_stm32g474::bus::drop_waiting",
            to: WAKERS,
        },
        // Its channels and its timer are inlined.
        Indirect {
            from: "board_stm32g474::control::__run_task",
            to: WAKERS,
        },
        Indirect {
            from: "__cortex_m_rt_main",
            to: WAKERS,
        },
    ],
    // They go with the message of a panic, which the handler of this board does not print.
    idle: &[" as core::fmt::Display>::", " as core::fmt::Debug>::"],
    recursions: &[
        // The end of a panic switches the bridges off, where the HAL asserts that a pin's number is below
        // 16: 8, 9 and 10 are.
        Recursion {
            parts: &[
                "board_stm32g474::bridges::force_off",
                "board_stm32g474::failure::stop",
                "core::panicking::panic",
                "rust_begin_unwind",
            ],
            times: 1,
        },
    ],
};

/// QEMU's board.
pub const QEMU: Plan = Plan {
    calls: &[
        Indirect {
            from: "eel_canopen::",
            to: APPLICATION,
        },
        Indirect {
            from: "core::fmt::",
            to: PRINTING,
        },
    ],
    idle: &[],
    // A panic prints where it is and its message, with numbers and texts in them: printing within
    // printing, within the printing of a failure. A panic meanwhile would need a device that fails.
    recursions: &[Recursion {
        parts: &[
            "core::fmt",
            "core::panicking",
            "board_qemu::console::say",
            "rust_begin_unwind",
        ],
        times: 3,
    }],
};
