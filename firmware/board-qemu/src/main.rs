//! In the making.
#![cfg_attr(target_os = "none", no_std, no_main)]
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod image {
    use core::fmt::Write;
    use cortex_m_rt::entry;
    use cortex_m_semihosting::{debug, hio};
    #[entry]
    fn main() -> ! {
        if let Ok(mut out) = hio::hstdout() {
            let _ = out.write_str("hello\n");
        }
        loop {
            debug::exit(debug::EXIT_SUCCESS);
        }
    }
    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo) -> ! {
        loop {
            debug::exit(debug::EXIT_FAILURE);
        }
    }
}
