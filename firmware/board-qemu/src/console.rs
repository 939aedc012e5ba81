//! QEMU's output and its end, over semihosting.

use core::fmt::{Arguments, Write};
use core::panic::PanicInfo;

use cortex_m_semihosting::{debug, hio};

/// Writes a line to QEMU's output.
pub fn say(words: Arguments<'_>) {
    if let Ok(mut out) = hio::hstdout() {
        // Nobody is left to tell where this fails.
        let _ = writeln!(out, "{words}");
    }
}

/// Ends QEMU.
pub fn leave(status: debug::ExitStatus) -> ! {
    loop {
        debug::exit(status);
    }
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    say(format_args!("{info}"));
    leave(debug::EXIT_FAILURE)
}
