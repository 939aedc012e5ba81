//! The bridges under their current loop, which runs in the interrupt of the converter.

use core::cell::RefCell;

use critical_section::Mutex;
use eel_drivers::{Bridge, Output};
use eel_units::{Current, Voltage, multiply_high};
use eel_vertebra::{CurrentLoop, Drive, Switching};
use embassy_stm32::gpio::Output as Pin;
use embassy_stm32::peripherals::TIM1;
use embassy_stm32::timer::simple_pwm::SimplePwmChannel;

use crate::bridges;
use crate::currents::NANOAMPS_PER_STEP;

/// One bridge.
pub type Motor = Bridge<SimplePwmChannel<'static, TIM1>, Pin<'static>, Pin<'static>>;

/// µA per sixteenth of a step of the converter, Q20.
const MICROAMPS_Q20: i32 = ((NANOAMPS_PER_STEP << 16) / 1_000) as i32;
/// Sixteenths of a step.
pub const FRACTIONS: u32 = 16;

/// What the interrupt drives.
struct Power {
    motors: [Motor; 3],
    current_loop: CurrentLoop,
    /// Conversions at no current, in sixteenths of a step.
    offsets: [i32; 3],
}

static POWER: Mutex<RefCell<Option<Power>>> = Mutex::new(RefCell::new(None));

/// Hands bridges that are off over to the interrupt.
pub fn start(motors: [Motor; 3], current_loop: CurrentLoop) {
    critical_section::with(|section| {
        if let Ok(mut power) = POWER.borrow(section).try_borrow_mut() {
            *power = Some(Power {
                motors,
                current_loop,
                offsets: [0; 3],
            });
        }
    });
}

/// Sets what the converter reads at no current, in sixteenths of a step.
pub fn set_offsets(offsets: [u32; 3]) {
    with(|power| power.offsets = offsets.map(|offset| offset as i32));
}

/// Makes the bridges do this until the next control tick.
pub fn set(drives: &[Drive; 3], supply: Voltage) {
    with(|power| power.set(drives, supply));
}

/// Tells which bridges the loop has switched off.
pub fn tripped() -> [bool; 3] {
    let mut tripped = [false; 3];
    with(|power| tripped = power.current_loop.tripped());
    tripped
}

/// Lets go of the bridges, whose control tick is missing.
pub fn stop() {
    with(|power| power.set(&[Drive::Off; 3], Voltage::from_millivolts(0)));
}

/// Takes three conversions and lets the loop act on them.
pub fn convert(readings: [u16; 3]) {
    with(|power| power.convert(readings));
}

fn with(act: impl FnOnce(&mut Power)) {
    critical_section::with(|section| {
        // Nobody else can hold it: whoever does can't be interrupted.
        if let Ok(mut power) = POWER.borrow(section).try_borrow_mut()
            && let Some(power) = power.as_mut()
        {
            act(power);
        }
    });
}

impl Power {
    fn set(&mut self, drives: &[Drive; 3], supply: Voltage) {
        self.current_loop.set(drives, supply);
        for (motor, drive) in self.motors.iter_mut().zip(drives) {
            let output = match drive {
                Drive::Off => Output::Off,
                Drive::Brake => Output::Brake,
                // The next conversion drives it.
                Drive::Current(_) => continue,
            };
            if motor.apply(output).is_err() {
                bridges::force_off();
            }
        }
    }

    fn convert(&mut self, readings: [u16; 3]) {
        let [a, b, c] = readings;
        let [x, y, z] = self.offsets;
        let measured = [current(a, x), current(b, y), current(c, z)];
        let decided = self.current_loop.update(measured);
        let motors = self.motors.iter_mut().zip(decided);
        let tripped = self.current_loop.tripped();
        for ((motor, switching), tripped) in motors.zip(tripped) {
            let output = match switching {
                Switching::Duty(duty) => Output::Duty(duty),
                Switching::Off if tripped => Output::Off,
                // The others are as the control tick left them.
                Switching::Off | Switching::Brake => continue,
            };
            if motor.apply(output).is_err() {
                bridges::force_off();
            }
        }
    }
}

/// Returns the current of a conversion.
fn current(reading: u16, offset: i32) -> Current {
    let sixteenths = i32::from(reading) * FRACTIONS as i32 - offset;
    Current::from_microamps(multiply_high(sixteenths << 12, MICROAMPS_Q20))
}
