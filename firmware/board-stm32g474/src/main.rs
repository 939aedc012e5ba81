//! In the making.
#![cfg_attr(target_os = "none", no_std, no_main)]
#[cfg(not(target_os = "none"))]
fn main() {}
#[cfg(target_os = "none")]
mod image {
    use defmt_rtt as _;
    #[cortex_m_rt::entry]
    fn main() -> ! {
        let _p = embassy_stm32::init(Default::default());
        loop { cortex_m::asm::wfi() }
    }
    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo) -> ! { loop { } }
}
