//! Motor encoders on timers, crank encoders on SPI, thermistors.

use core::cell::RefCell;
use core::sync::atomic::{AtomicI32, Ordering};

use eel_drivers::{AbsoluteEncoder, WideCounter, thermistor};
use eel_units::{Angle, Temperature};
use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, AdcConfig, SampleTime};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::Blocking;
use embassy_stm32::peripherals::*;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, MODE_1, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::qei::{self, Qei};
use embedded_hal_bus::spi::{NoDelay, RefCellDevice};

/// Temperatures in tenths of a degree: the board, then the motors. Written slowly, read each tick;
/// until the first writing they are 150 °C, which keeps the motors off.
static TEMPERATURES: [AtomicI32; 4] = [const { AtomicI32::new(1_500) }; 4];

/// What the motor encoders are connected to.
pub struct CounterConnections {
    /// Motor 1.
    pub one: (Peri<'static, TIM2>, Peri<'static, PA0>, Peri<'static, PA1>),
    /// Motor 2.
    pub two: (Peri<'static, TIM3>, Peri<'static, PC6>, Peri<'static, PC7>),
    /// Motor 3.
    pub three: (Peri<'static, TIM4>, Peri<'static, PB6>, Peri<'static, PB7>),
}

/// Quadrature counters of the three motors.
pub struct Counters {
    one: Qei<'static, TIM2>,
    two: Qei<'static, TIM3>,
    three: Qei<'static, TIM4>,
    wide: [WideCounter; 3],
}

impl Counters {
    /// Starts the counters at 0.
    pub fn new(connections: CounterConnections) -> Self {
        let CounterConnections { one, two, three } = connections;
        let config = qei::Config::default();
        let one = Qei::new(one.0, one.1, one.2, config);
        let two = Qei::new(two.0, two.1, two.2, config);
        let three = Qei::new(three.0, three.1, three.2, config);
        let wide = [one.count(), two.count(), three.count()].map(WideCounter::new);
        Self {
            one,
            two,
            three,
            wide,
        }
    }

    /// Returns the counts since the start.
    pub fn read(&mut self) -> [i32; 3] {
        let narrow = [self.one.count(), self.two.count(), self.three.count()];
        let mut counts = [0; 3];
        for ((count, wide), narrow) in counts.iter_mut().zip(&mut self.wide).zip(narrow) {
            *count = wide.update(narrow);
        }
        counts
    }
}

/// What the crank encoders are connected to.
pub struct CrankConnections {
    /// The controller.
    pub spi: Peri<'static, SPI1>,
    /// Clock, from the encoders, to the encoders.
    pub lines: (Peri<'static, PA5>, Peri<'static, PA6>, Peri<'static, PA7>),
    /// Selects the encoder of each motor's crank.
    pub select: (
        Peri<'static, PB13>,
        Peri<'static, PB14>,
        Peri<'static, PB15>,
    ),
}

/// The SPI that the crank encoders share.
pub type CrankBus = RefCell<Spi<'static, Blocking, Master>>;
type CrankDevice<'bus> =
    RefCellDevice<'bus, Spi<'static, Blocking, Master>, Output<'static>, NoDelay>;

/// The absolute encoders of the three cranks.
pub struct Cranks<'bus> {
    encoders: [AbsoluteEncoder<CrankDevice<'bus>>; 3],
}

impl CrankConnections {
    /// Starts the SPI, and returns it with the pins that select an encoder.
    pub fn start(self) -> (CrankBus, [Output<'static>; 3]) {
        let mut config = Config::default();
        config.mode = MODE_1;
        // The HAL divides 170 MHz by a power of two, to the nearest: 5.3 MHz. The next, 10.6 MHz, is above
        // what an AS5047P takes.
        config.frequency = Hertz::mhz(5);
        let (clock, input, output) = self.lines;
        let spi = Spi::new_blocking(self.spi, clock, output, input, config);
        let select = [
            Output::new(self.select.0, Level::High, Speed::High),
            Output::new(self.select.1, Level::High, Speed::High),
            Output::new(self.select.2, Level::High, Speed::High),
        ];
        (RefCell::new(spi), select)
    }
}

impl<'bus> Cranks<'bus> {
    /// Makes the encoders of a bus; `None` where a pin can't be set, which these pins always can.
    pub fn new(bus: &'bus CrankBus, select: [Output<'static>; 3]) -> Option<Self> {
        let [one, two, three] = select.map(|select| RefCellDevice::new_no_delay(bus, select).ok());
        Some(Self {
            encoders: [
                AbsoluteEncoder::new(one?),
                AbsoluteEncoder::new(two?),
                AbsoluteEncoder::new(three?),
            ],
        })
    }

    /// Returns the angles that are valid.
    pub fn read(&mut self) -> [Option<Angle>; 3] {
        self.encoders.each_mut().map(|encoder| encoder.read().ok())
    }
}

/// What the thermistors are connected to.
pub struct ThermistorConnections {
    /// The converter.
    pub adc: Peri<'static, ADC2>,
    /// On the board.
    pub board: Peri<'static, PA4>,
    /// On the motors.
    pub motors: (Peri<'static, PC4>, Peri<'static, PC5>, Peri<'static, PB2>),
}

/// The thermistors.
pub struct Thermistors {
    adc: Adc<'static, ADC2>,
    board: Peri<'static, PA4>,
    motors: (Peri<'static, PC4>, Peri<'static, PC5>, Peri<'static, PB2>),
}

impl Thermistors {
    /// Takes the connections.
    pub fn new(connections: ThermistorConnections) -> Self {
        let ThermistorConnections { adc, board, motors } = connections;
        Self {
            adc: Adc::new(adc, AdcConfig::default()),
            board,
            motors,
        }
    }

    /// Measures all temperatures, for about 60 µs.
    pub fn measure(&mut self) {
        let time = SampleTime::CYCLES640_5;
        let readings = [
            self.adc.blocking_read(&mut self.board, time),
            self.adc.blocking_read(&mut self.motors.0, time),
            self.adc.blocking_read(&mut self.motors.1, time),
            self.adc.blocking_read(&mut self.motors.2, time),
        ];
        for (kept, reading) in TEMPERATURES.iter().zip(readings) {
            kept.store(thermistor(reading).to_decidegrees(), Ordering::Relaxed);
        }
    }
}

/// Returns the temperatures measured last: the board's, and the motors'.
pub fn temperatures() -> (Temperature, [Temperature; 3]) {
    let read =
        |index: usize| Temperature::from_decidegrees(TEMPERATURES[index].load(Ordering::Relaxed));
    (read(0), [read(1), read(2), read(3)])
}
