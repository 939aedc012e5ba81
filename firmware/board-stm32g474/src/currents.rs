//! Motor currents and supply: four conversions per PWM period, for the current loop, and summed until
//! the control tick.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::DWT;
use critical_section::Mutex;
use eel_units::{Current, Voltage};
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig, InjectedAdc, SampleTime};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac;
use embassy_stm32::pac::adc::vals::Exten;
use embassy_stm32::peripherals::*;
use embassy_stm32::triggers::TIM1_TRGO2;
use embassy_stm32::{Peri, interrupt as handler};

use crate::{bridges, liveness, power};

/// nA per step of the ADC: 3.3 V / 4096 over 5 mΩ · 50. The range is ±6.6 A: beyond 4.1 A, which the
/// supply drives through a stalled motor, and 3.75 A, at which the vertebra sees an over-current.
pub const NANOAMPS_PER_STEP: i64 = 3_222_656;
/// mV at the end of the ADC's range: 3.3 V · 11.
const SUPPLY_RANGE: u32 = 36_300;
const STEPS: u32 = 4_096;
/// Ticks over which the offsets are averaged after power-up.
const OFFSET_TICKS: u32 = 256;
/// How far an offset may lie from the middle of the range, in steps: 160 mA.
const OFFSET_WINDOW: i64 = 50;
/// How near a mean may come to an end of the range, in steps; nearer, no amplifier is at work.
const RAIL: i64 = 16;
/// Conversions without a control tick after which the bridges are switched off: 5 ms.
const STALLED: u32 = 100;

/// Sums of the conversions since they were last taken.
#[derive(Clone, Copy)]
struct Sums {
    readings: [u32; 4],
    count: u32,
}

impl Sums {
    const NONE: Self = Self {
        readings: [0; 4],
        count: 0,
    };
}

/// Clocks of the last and of the longest turn of the interrupt.
static TURN: AtomicU32 = AtomicU32::new(0);
static LONGEST_TURN: AtomicU32 = AtomicU32::new(0);
/// Clocks in a microsecond.
const CLOCK_MHZ: u32 = 170;

static SUMS: Mutex<Cell<Sums>> = Mutex::new(Cell::new(Sums::NONE));

/// What the currents are measured with.
pub struct Connections {
    /// The converter.
    pub adc: Peri<'static, ADC1>,
    /// The current amplifiers of the motors.
    pub currents: (Peri<'static, PC0>, Peri<'static, PC1>, Peri<'static, PC2>),
    /// The divider of the supply.
    pub supply: Peri<'static, PC3>,
}

/// What one control tick learns.
#[derive(Clone, Copy)]
pub struct Measurement {
    /// Mean current of each motor.
    pub currents: [Current; 3],
    /// Mean supply voltage.
    pub supply: Voltage,
    /// Whether a channel's offset is out of its window or its mean at an end of the range, there is
    /// nothing to average, or the control tick came so late that the bridges were switched off.
    pub is_faulty: [bool; 3],
}

/// Turns sums of conversions into amperes, once it knows the offsets.
pub struct Currents {
    _adc: InjectedAdc<'static, ADC1, 4>,
    offsets: Sums,
    ticks: u32,
}

impl Currents {
    /// Starts conversions at the middle of the PWM.
    pub fn new(connections: Connections) -> Self {
        let Connections {
            adc,
            currents,
            supply,
        } = connections;
        let time = SampleTime::CYCLES24_5;
        let sequence = [
            (currents.0.degrade_adc(), time),
            (currents.1.degrade_adc(), time),
            (currents.2.degrade_adc(), time),
            (supply.degrade_adc(), time),
        ];
        let adc = Adc::new(adc, AdcConfig::default());
        let adc = adc.setup_injected_conversions(sequence, TIM1_TRGO2, Exten::RISING_EDGE, true);
        interrupt::ADC1_2.set_priority(Priority::P4);
        // SAFETY: the handler below is ready for it, and no critical section relies on it masked.
        unsafe { interrupt::ADC1_2.enable() };
        Self {
            _adc: adc,
            offsets: Sums::NONE,
            ticks: 0,
        }
    }

    /// Tells whether the offsets are known.
    pub const fn has_offsets(&self) -> bool {
        self.ticks >= OFFSET_TICKS
    }

    /// Tells the current loop the offsets.
    fn hand_over_offsets(&self) {
        let count = u64::from(self.offsets.count.max(1));
        let [one, two, three, _] = self.offsets.readings;
        power::set_offsets([one, two, three].map(|sum| {
            let sixteenths = u64::from(sum) * u64::from(power::FRACTIONS) / count;
            sixteenths as u32
        }));
    }

    /// Returns the means since the last call. The first 256 calls average the offsets instead: the
    /// bridges must be off, and every channel counts as faulty.
    pub fn take(&mut self) -> Measurement {
        let sums = critical_section::with(|section| SUMS.borrow(section).replace(Sums::NONE));
        let supply = SUPPLY_RANGE * (sums.readings[3] / sums.count.max(1)) / STEPS;
        let mut measurement = Measurement {
            currents: [Current::ZERO; 3],
            supply: Voltage::from_millivolts(supply as i32),
            is_faulty: [true; 3],
        };
        if !self.has_offsets() {
            for (offset, reading) in self.offsets.readings.iter_mut().zip(sums.readings) {
                *offset += reading;
            }
            self.offsets.count += sums.count;
            self.ticks += 1;
            if self.has_offsets() {
                self.hand_over_offsets();
            }
            return measurement;
        }
        for motor in 0..3 {
            // Sums times counts: the means' difference without a rounding of its own.
            let (sum, count) = (i64::from(sums.readings[motor]), i64::from(sums.count));
            let (zero, zeros) = (
                i64::from(self.offsets.readings[motor]),
                i64::from(self.offsets.count),
            );
            if count == 0 || zeros == 0 {
                continue;
            }
            let microamps =
                (sum * zeros - zero * count) * NANOAMPS_PER_STEP / (1_000 * count * zeros);
            let middle = i64::from(STEPS / 2);
            measurement.currents[motor] = Current::from_microamps(microamps as i32);
            let has_offset = (zero / zeros - middle).abs() <= OFFSET_WINDOW;
            let is_in_range = (RAIL..i64::from(STEPS) - RAIL).contains(&(sum / count));
            measurement.is_faulty[motor] = !has_offset || !is_in_range || sums.count >= STALLED;
        }
        measurement
    }
}

#[handler]
fn ADC1_2() {
    if !pac::ADC1.isr().read().jeos() {
        return;
    }
    // Cleared by writing 1, and only this one.
    pac::ADC1.isr().write(|flags| flags.set_jeos(true));
    let start = DWT::cycle_count();
    let readings = [0, 1, 2, 3].map(|rank| pac::ADC1.jdr(rank).read().jdata());
    let is_stalled = critical_section::with(|section| {
        let cell = SUMS.borrow(section);
        let mut sums = cell.get();
        for (sum, reading) in sums.readings.iter_mut().zip(readings) {
            *sum = sum.wrapping_add(u32::from(reading));
        }
        sums.count = sums.count.wrapping_add(1);
        cell.set(sums);
        sums.count >= STALLED
    });
    if is_stalled {
        // Nobody controls the currents any more; the watchdog needs ten times as long.
        power::stop();
        bridges::force_off();
    } else {
        let [one, two, three, _] = readings;
        power::convert([one, two, three]);
    }
    liveness::CURRENT.advance();
    let cycles = DWT::cycle_count().wrapping_sub(start);
    TURN.store(cycles, Ordering::Relaxed);
    LONGEST_TURN.fetch_max(cycles, Ordering::Relaxed);
}

/// Returns the time that the last and the longest turn of the interrupt took, in ns.
pub fn turn_ns() -> (u32, u32) {
    let ns = |cycles: &AtomicU32| cycles.load(Ordering::Relaxed).saturating_mul(1_000) / CLOCK_MHZ;
    (ns(&TURN), ns(&LONGEST_TURN))
}
