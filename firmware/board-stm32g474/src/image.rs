//! Start-up: who this is, why it started, and who runs where.

use defmt_rtt as _;
use eel_protocol::NodeId;
use eel_vertebra::{Calibration, Settings};
use embassy_executor::{InterruptExecutor, SendSpawner, SpawnError, SpawnToken};
use embassy_stm32::gpio::{Input, Pull};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::peripherals::*;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, Peripherals, interrupt as handler, uid};

use crate::sensors::{CounterConnections, CrankConnections, ThermistorConnections, Thermistors};
use crate::storage::Storage;
use crate::{bridges, bus, clocks, control, currents, failure, slow};

/// Time without a sign of life after which the chip resets, by a clock that is right to 10 %.
const WATCHDOG_US: u32 = 40_000;

static BUS: InterruptExecutor = InterruptExecutor::new();
static CONTROL: InterruptExecutor = InterruptExecutor::new();
static SLOW: InterruptExecutor = InterruptExecutor::new();

// SAFETY: only the interrupt calls it.
#[handler]
unsafe fn UART4() {
    // SAFETY: called from the interrupt that the executor was started on.
    unsafe { BUS.on_interrupt() }
}

// SAFETY: only the interrupt calls it.
#[handler]
unsafe fn UART5() {
    // SAFETY: called from the interrupt that the executor was started on.
    unsafe { CONTROL.on_interrupt() }
}

// SAFETY: only the interrupt calls it.
#[handler]
unsafe fn LPUART1() {
    // SAFETY: called from the interrupt that the executor was started on.
    unsafe { SLOW.on_interrupt() }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    bridges::force_off();
    let cause = failure::take_start();
    let peripherals = embassy_stm32::init(clocks::configuration());
    clocks::guard();
    if let Some(mut core) = cortex_m::Peripherals::take() {
        // It times the current loop.
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
    let mut storage = start(peripherals, cause);
    loop {
        storage.serve();
        cortex_m::asm::wfi();
    }
}

/// Starts every task and returns what the main thread does.
fn start(p: Peripherals, cause: failure::Start) -> Storage {
    let mut storage = Storage::new(p.FLASH);
    let stored = storage.load();
    let settings = Settings {
        node: read_node(p.PA2, p.PA3, p.PB9, p.PB11),
        // Nothing is known of this unit before it is calibrated.
        calibration: Calibration::NONE,
        ..Settings::unconfigured(serial())
    };
    // What LSS has stored outranks the switches.
    let node = stored.node().or(settings.node);
    defmt::info!(
        "vertebra {=u8}, serial {=u32:#010x}",
        node.map_or(0, NodeId::get),
        settings.serial
    );

    // What only wakes a task waits for the current loop, which has 4.
    interrupt::FDCAN1_IT0.set_priority(Priority::P5);
    interrupt::FDCAN1_IT1.set_priority(Priority::P5);
    interrupt::TIM5.set_priority(Priority::P5);
    interrupt::UART4.set_priority(Priority::P5);
    interrupt::UART5.set_priority(Priority::P6);
    interrupt::LPUART1.set_priority(Priority::P7);
    let bus = BUS.start(interrupt::UART4);
    let control = CONTROL.start(interrupt::UART5);
    let slow = SLOW.start(interrupt::LPUART1);

    // The converters share a clock and a reset: this one starts before the other is set up.
    let thermistors = Thermistors::new(ThermistorConnections {
        adc: p.ADC2,
        board: p.PA4,
        motors: (p.PC4, p.PC5, p.PB2),
    });
    let can = bus::Connections {
        can: p.FDCAN1,
        receive: p.PA11,
        transmit: p.PA12,
    };
    let (transmit, receive, filters) = bus::start(can).split();
    spawn(&bus, bus::receive(receive));
    spawn(&bus, bus::transmit(transmit));
    let hardware = control::Hardware {
        bridges: bridges::Connections {
            timer: p.TIM1,
            pwm: (p.PA8, p.PA9, p.PA10),
            direction: (p.PB0, p.PB1, p.PB10),
            wake: (p.PC8, p.PC9, p.PC10),
            fault: (p.PC11, p.PC12, p.PD2),
            stop: p.PB12,
        },
        currents: currents::Connections {
            adc: p.ADC1,
            currents: (p.PC0, p.PC1, p.PC2),
            supply: p.PC3,
        },
        counters: CounterConnections {
            one: (p.TIM2, p.PA0, p.PA1),
            two: (p.TIM3, p.PC6, p.PC7),
            three: (p.TIM4, p.PB6, p.PB7),
        },
        cranks: CrankConnections {
            spi: p.SPI1,
            lines: (p.PA5, p.PA6, p.PA7),
            select: (p.PB13, p.PB14, p.PB15),
        },
        chain: (p.PB5, p.PB3),
        filters,
    };
    // From here on, so that no task can hang unseen before the one that feeds it has begun.
    let mut watchdog = IndependentWatchdog::new(p.IWDG, WATCHDOG_US);
    watchdog.unleash();
    let birth = control::Birth {
        settings,
        stored,
        cause,
        kept: failure::remembered(),
    };
    spawn(&control, control::run(hardware, birth));
    spawn(&slow, slow::run(thermistors, watchdog));
    storage
}

/// Spawns a task, each of which is spawned once and so always has room.
fn spawn<S: Send>(spawner: &SendSpawner, task: Result<SpawnToken<S>, SpawnError>) {
    match task {
        Ok(token) => spawner.spawn(token),
        Err(_) => defmt::error!("a task was spawned twice"),
    }
}

/// Reads the node number from the switches, which are closed for 1; `None` for 0 and above 10, where the
/// vertebra waits for LSS.
fn read_node(
    one: Peri<'static, PA2>,
    two: Peri<'static, PA3>,
    four: Peri<'static, PB9>,
    eight: Peri<'static, PB11>,
) -> Option<NodeId> {
    let switches = [
        Input::new(one, Pull::Up),
        Input::new(two, Pull::Up),
        Input::new(four, Pull::Up),
        Input::new(eight, Pull::Up),
    ];
    // Pull-ups of 40 kΩ charge the lines within microseconds.
    cortex_m::asm::delay(17_000);
    let number = switches
        .iter()
        .zip([1, 2, 4, 8])
        .filter(|(switch, _)| switch.is_low())
        .fold(0, |number, (_, weight)| number + weight);
    NodeId::new(number)
}

/// Folds the chip's unique number of 96 bits into the serial number of 32.
fn serial() -> u32 {
    uid::uid()
        .chunks_exact(4)
        .filter_map(|word| word.try_into().ok().map(u32::from_le_bytes))
        .fold(0, |serial, word| serial.rotate_left(7) ^ word)
}
