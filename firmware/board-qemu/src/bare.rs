//! An image that does nothing, linked for the target: what is in `kernel` beside the kernel.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod image {
    use core::hint::black_box;
    use core::panic::PanicInfo;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        loop {
            black_box(());
        }
    }

    #[panic_handler]
    fn panic(_: &PanicInfo) -> ! {
        cortex_m::asm::udf();
    }
}

/// Says what this is for: it is only linked.
#[cfg(not(target_os = "none"))]
fn main() {
    println!("cargo xtask cycles");
}
