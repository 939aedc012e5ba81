//! The flashable image of a vertebra for the STM32G474RE, LQFP64.
//!
//! It gives [`eel_vertebra::Vertebra`] a clock, a bus, sensors and bridges, and decides nothing
//! itself. Three executors run in interrupts: the bus's above the control tick's, so that no frame
//! waits for a turn, and that of everything slow below both. The main thread stores
//! settings, and sleeps.
//!
//! | function | pins | parts assumed on the board |
//! |---|---|---|
//! | CAN | PA11 FDCAN1_RX, PA12 FDCAN1_TX | 5 V transceiver, 3.3 V logic |
//! | bridge PWM, motors 1–3 | PA8, PA9, PA10: TIM1_CH1–3 | DRV8874, PMODE low; pull-down |
//! | bridge direction | PB0, PB1, PB10 | PHASE |
//! | bridge current, no pin | VREF on 3.3 V, IPROPI over 2.94 kΩ to ground, IMODE to ground | chops at 2.5 A |
//! | bridge wake | PC8, PC9, PC10 | nSLEEP, pulled down in the DRV8874 |
//! | bridge fault | PC11, PC12, PD2, low when faulty | nFAULT, open drain |
//! | emergency stop | PB12 TIM1_BKIN, high when stopped | loop to ground; a broken loop stops |
//! | motor encoders | PA0/PA1 TIM2, PC6/PC7 TIM3, PB6/PB7 TIM4 | quadrature, 512 lines |
//! | crank encoders | PA5 SCK, PA6 MISO, PA7 MOSI: SPI1; PB13, PB14, PB15 select | AS5047P, zero in ZPOS |
//! | motor currents | PC0, PC1, PC2: ADC1_IN6–8 | 5 mΩ in line, INA240A2, half of VDDA at 0 A |
//! | supply | PC3: ADC1_IN9 | 100 kΩ over 10 kΩ |
//! | temperatures | PA4 board, PC4, PC5, PB2 motors: ADC2 | thermistors, see eel-drivers |
//! | node number | PA2, PA3, PB9, PB11: 1, 2, 4, 8 | switches to ground; 1–10, all open: LSS gives it |
//! | daisy line | PB5 in, PB3 out | OUT of the vertebra before to IN; an open IN is high |
//! | crystal | PF0, PF1 | 24 MHz |
//! | debugging | PA13, PA14 | SWD, RTT |
//!
//! The rest of what a schematic needs is in docs/hardware.md, which `tests/tests/hardware.rs` holds to this
//! table: what bounds the current and what switches off, clocks, interrupts, memory, parts, and what only a
//! board can show.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod bridges;
#[cfg(target_os = "none")]
mod bus;
#[cfg(target_os = "none")]
mod clocks;
#[cfg(target_os = "none")]
mod control;
#[cfg(target_os = "none")]
mod currents;
#[cfg(target_os = "none")]
mod failure;
#[cfg(target_os = "none")]
mod image;
#[cfg(target_os = "none")]
mod liveness;
#[cfg(target_os = "none")]
mod power;
#[cfg(target_os = "none")]
mod sensors;
#[cfg(target_os = "none")]
mod slow;
#[cfg(target_os = "none")]
mod storage;

/// Says what to do: the image only runs on the board.
#[cfg(not(target_os = "none"))]
fn main() {
    println!("cargo xtask flash stm32g474");
}
