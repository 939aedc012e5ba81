//! What is slow: temperatures, and the watchdog.

use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::{Duration, Ticker};

use crate::liveness::Watch;
use crate::sensors::Thermistors;

/// Between two looks at the other tasks.
const PERIOD: Duration = Duration::from_millis(10);
/// Looks between two measurements of the temperatures.
const LOOKS: u32 = 10;

/// Measures temperatures at 10 Hz, and feeds the watchdog when every task has moved in 10 ms; it runs
/// already.
#[embassy_executor::task]
pub async fn run(mut thermistors: Thermistors, mut watchdog: IndependentWatchdog<'static, IWDG>) {
    let mut watch = Watch::default();
    let mut ticker = Ticker::every(PERIOD);
    loop {
        thermistors.measure();
        for _ in 0..LOOKS {
            ticker.next().await;
            if watch.all_advanced() {
                watchdog.pet();
            }
        }
    }
}
