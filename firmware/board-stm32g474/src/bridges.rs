//! Three H-bridges on TIM1, which the emergency stop line switches off without the CPU.
//!
//! What has forced the PWM low, be it the line or [`force_off`], stays until the vertebra has been told
//! and has kept the bridges from driving for two ticks: by then no old duty is left in the timer.

use eel_drivers::{Bridge, BridgeError};
use eel_units::Voltage;
use eel_vertebra::{CurrentLoop, Drive, Motor};
use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, Input, Level, Output as Pin, OutputType, Pull, Speed};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::{Bkp, Mms2, Ossi, Ossr};
use embassy_stm32::peripherals::*;
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_stm32::timer::{BkIn1, BreakInputPin};

use crate::power;

const PWM_FREQUENCY: Hertz = Hertz::khz(20);

/// What the bridges are connected to.
pub struct Connections {
    /// The timer of the PWM.
    pub timer: Peri<'static, TIM1>,
    /// PWM of the motors.
    pub pwm: (Peri<'static, PA8>, Peri<'static, PA9>, Peri<'static, PA10>),
    /// Direction of the motors.
    pub direction: (Peri<'static, PB0>, Peri<'static, PB1>, Peri<'static, PB10>),
    /// Wake inputs.
    pub wake: (Peri<'static, PC8>, Peri<'static, PC9>, Peri<'static, PC10>),
    /// Fault outputs.
    pub fault: (Peri<'static, PC11>, Peri<'static, PC12>, Peri<'static, PD2>),
    /// The emergency stop line.
    pub stop: Peri<'static, PB12>,
}

/// The bridges of the three motors, and the lines that report on them.
pub struct Bridges {
    faults: [Input<'static>; 3],
    stop: Flex<'static>,
    /// Whether the vertebra was told of a stop in this tick.
    is_stop_told: bool,
    /// Whether no bridge drove in the tick before.
    was_idle: bool,
}

impl Bridges {
    /// Takes the connections; the bridges are off.
    ///
    /// # Errors
    /// None that these connections can have.
    pub fn new(connections: Connections, motor: &Motor) -> Result<Self, BridgeError> {
        let Connections {
            timer,
            pwm,
            direction,
            wake,
            fault,
            stop,
        } = connections;
        let channels = SimplePwm::new(
            timer,
            Some(PwmPin::new(pwm.0, OutputType::PushPull)),
            Some(PwmPin::new(pwm.1, OutputType::PushPull)),
            Some(PwmPin::new(pwm.2, OutputType::PushPull)),
            None,
            PWM_FREQUENCY,
            CountingMode::CenterAlignedBothInterrupts,
        )
        .split();
        let stop = configure_break(stop);
        let [one, two, three] = [channels.ch1, channels.ch2, channels.ch3].map(|mut channel| {
            channel.set_duty_cycle(0);
            channel.enable();
            channel
        });
        let motors = [
            Bridge::new(one, low(direction.0), low(wake.0))?,
            Bridge::new(two, low(direction.1), low(wake.1))?,
            Bridge::new(three, low(direction.2), low(wake.2))?,
        ];
        power::start(motors, CurrentLoop::new(motor));
        Ok(Self {
            faults: [
                Input::new(fault.0, Pull::Up),
                Input::new(fault.1, Pull::Up),
                Input::new(fault.2, Pull::Up),
            ],
            stop,
            is_stop_told: false,
            was_idle: false,
        })
    }

    /// Makes the bridges do this until the next tick.
    pub fn apply(&mut self, drives: [Drive; 3], supply: Voltage) {
        power::set(&drives, supply);
        let is_idle = !drives
            .iter()
            .any(|drive| matches!(drive, Drive::Current(_)));
        if is_idle && self.was_idle {
            self.restore_outputs();
        }
        self.was_idle = is_idle;
    }

    /// Lets the timer drive its outputs again, which have been idle since the tick before, unless the
    /// stop line is asserted or was in a way that the vertebra does not know yet.
    fn restore_outputs(&mut self) {
        critical_section::with(|_| {
            let has_stopped = pac::TIM1.sr().read().bif(0);
            if self.stop.is_high() || (has_stopped && !self.is_stop_told) {
                return;
            }
            if has_stopped {
                // Only bits written as 0 are cleared.
                pac::TIM1.sr().write(|flags| {
                    flags.0 = u32::MAX;
                    flags.set_bif(0, false);
                });
            }
            pac::TIM1.bdtr().modify(|outputs| outputs.set_moe(true));
        });
    }

    /// Tells which bridges report a fault.
    pub fn faults(&self) -> [bool; 3] {
        self.faults.each_ref().map(Input::is_low)
    }

    /// Tells whether the emergency stop line is asserted, or was since the timer last drove its
    /// outputs. Changes nothing: [`apply`](Self::apply) ends the stop of the timer, once the vertebra
    /// has latched its own.
    pub fn take_emergency_stop(&mut self) -> bool {
        self.is_stop_told = self.stop.is_high() || pac::TIM1.sr().read().bif(0);
        self.is_stop_told
    }
}

/// Makes an output that starts low.
fn low(pin: Peri<'static, impl embassy_stm32::gpio::Pin>) -> Pin<'static> {
    Pin::new(pin, Level::Low, Speed::Low)
}

/// Lets the emergency stop line, a CPU that is locked up, an error of the flash that can't be corrected
/// and a crystal that stopped force the PWM low, and the timer trigger the ADC once per period.
fn configure_break(pin: Peri<'static, PB12>) -> Flex<'static> {
    let function = BreakInputPin::<TIM1, BkIn1>::af_num(&*pin);
    let mut line = Flex::new(pin);
    line.set_as_af_unchecked(function, AfType::input(Pull::Up));
    pac::SYSCFG.cfgr2().modify(|causes| {
        causes.set_cll(true);
        causes.set_eccl(true);
    });
    pac::TIM1.bdtr().modify(|outputs| {
        outputs.set_ossr(Ossr::IDLE_LEVEL);
        outputs.set_ossi(Ossi::IDLE_LEVEL);
        outputs.set_bkp(0, Bkp::ACTIVE_HIGH);
        outputs.set_bke(0, true);
    });
    pac::TIM1.bdtr().modify(|outputs| outputs.set_moe(true));
    // Centre-aligned, the timer updates twice per period; every second update is enough.
    pac::TIM1.rcr().write(|repetition| repetition.set_rep(1));
    pac::TIM1
        .cr2()
        .modify(|control| control.set_mms2(Mms2::UPDATE));
    line
}

/// Switches all bridges off whatever state the program is in: PWM low, wake pins low.
pub fn force_off() {
    critical_section::with(|_| {
        pac::TIM1.bdtr().modify(|outputs| outputs.set_moe(false));
        pac::GPIOC.bsrr().write(|pins| {
            for wake in [8, 9, 10] {
                pins.set_br(wake, true);
            }
        });
    });
}
