//! Clocks: 170 MHz for the core, 85 MHz for CAN, 42.5 MHz for the ADCs.

use embassy_stm32::Config;
use embassy_stm32::pac;
use embassy_stm32::rcc::{Hse, HseMode, Pll, PllMul, PllPreDiv, PllQDiv, PllRDiv, PllSource};
use embassy_stm32::rcc::{Sysclk, mux};
use embassy_stm32::time::Hertz;

/// Returns the clock tree: 24 MHz / 6 · 85 = 340 MHz, of which the core has a half and CAN a
/// quarter.
pub fn configuration() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(Hse {
        freq: Hertz::mhz(24),
        mode: HseMode::Oscillator,
    });
    config.rcc.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV6,
        mul: PllMul::MUL85,
        divp: None,
        divq: Some(PllQDiv::DIV4),
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    config.rcc.boost = true;
    config.rcc.mux.fdcansel = mux::Fdcansel::PLL1_Q;
    config.rcc.mux.adc12sel = mux::Adcsel::SYS;
    config
}

/// Makes a crystal that stops a failure: the clock goes on inside the chip, the PWM goes low without
/// the CPU, and the interrupt that nobody expects resets. A debugger that halts the core, too, stops
/// the timer of the PWM and so its outputs.
pub fn guard() {
    pac::RCC.cr().modify(|clock| clock.set_csson(true));
    pac::DBGMCU.apb2fzr().modify(|freeze| freeze.set_tim1(true));
}
