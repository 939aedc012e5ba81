//! The CAN bus: FDCAN1 at 1 Mbit/s, only the identifiers that concern this vertebra.
//!
//! Frames leave in the order in which they were made, or not at all: when the bus takes none for 20 ms,
//! or is off, everything that waits is dropped and counted, here and in the controller, so that what is
//! sent afterwards is of its time. The controller does not rejoin by itself after a bus-off but after
//! a pause, which grows while it happens again ([`Backoff`]). The first pause is longer than the time
//! without targets after which the vertebra stops.

use core::cell::Cell;
use core::num::{NonZeroU8, NonZeroU16};
use core::sync::atomic::{AtomicU32, Ordering};

use critical_section::Mutex;
use eel_drivers::Backoff;
use eel_protocol::{Cob, Frame};
use eel_units::Duration as Span;
use embassy_futures::select::{Either, select};
use embassy_stm32::can::config::{GlobalFilter, NominalBitTiming, TxBufferMode};
use embassy_stm32::can::filter::{Action, Filter, FilterType, StandardFilter};
use embassy_stm32::can::frame::Header;
use embassy_stm32::can::{Can, CanConfigurator, CanRx, CanTx, Frame as HalFrame, Properties};
use embassy_stm32::can::{IT0InterruptHandler, IT1InterruptHandler};
use embassy_stm32::peripherals::*;
use embassy_stm32::{Peri, bind_interrupts, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Instant, Timer};

use crate::liveness;

/// Frames that wait for the control tick.
pub const QUEUE: usize = 32;
/// Frames that wait for the bus: about what it carries in a tick. What finds no room waits in the node,
/// which knows what is urgent and what is old.
const SENDING: usize = 8;
/// Time between two signs of life.
const PULSE_MS: u64 = 5;
/// Signs of life for which a frame waits for the bus before it is dropped: 20 ms, two SYNCs.
const PATIENCE: u32 = 4;

/// Reads of a register after which a bit that was written must show.
const SETTLING: u32 = 1_000;

/// 85 MHz / 85 = 1 Mbit/s, sampled at 87 %.
const BIT_TIMING: NominalBitTiming = NominalBitTiming {
    prescaler: NonZeroU16::new(1).unwrap(),
    seg1: NonZeroU8::new(73).unwrap(),
    seg2: NonZeroU8::new(11).unwrap(),
    sync_jump_width: NonZeroU8::new(11).unwrap(),
};

bind_interrupts!(struct Interrupts {
    FDCAN1_IT0 => IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => IT1InterruptHandler<FDCAN1>;
});

/// Frames from the bus.
pub static RECEIVED: Channel<CriticalSectionRawMutex, Frame, QUEUE> = Channel::new();
/// Frames for the bus.
pub static TO_SEND: Channel<CriticalSectionRawMutex, Frame, SENDING> = Channel::new();
/// How often the bus went off.
static BUS_OFFS: AtomicU32 = AtomicU32::new(0);
/// When the newest SYNC came that the control tick has not asked for.
static SYNC: Mutex<Cell<Option<Instant>>> = Mutex::new(Cell::new(None));
static RECEIVE_OVERRUNS: AtomicU32 = AtomicU32::new(0);
static TRANSMIT_OVERRUNS: AtomicU32 = AtomicU32::new(0);

/// What the bus is connected to.
pub struct Connections {
    /// The controller.
    pub can: Peri<'static, FDCAN1>,
    /// From the transceiver.
    pub receive: Peri<'static, PA11>,
    /// To the transceiver.
    pub transmit: Peri<'static, PA12>,
}

/// Starts the controller.
pub fn start(connections: Connections) -> Can<'static> {
    let Connections {
        can,
        receive,
        transmit,
    } = connections;
    let mut bus = CanConfigurator::new(can, receive, transmit, Interrupts);
    let config = bus
        .config()
        .set_nominal_bit_timing(BIT_TIMING)
        .set_global_filter(GlobalFilter::reject_all())
        // In priority mode frames with one identifier can overtake each other, as a new one takes the
        // lowest free buffer: segments of an SDO transfer and emergencies would change places.
        .set_tx_buffer_mode(TxBufferMode::Fifo)
        .set_automatic_bus_off_recovery(false);
    bus.set_config(config);
    bus.into_normal_mode()
}

/// Lets pass what the vertebra listens to; the controller drops everything else.
pub fn hear(controller: &Properties, identifiers: &[u16]) {
    let mut filters = [StandardFilter::disable(); 28];
    for (slot, identifier) in filters.iter_mut().zip(identifiers) {
        *slot = Filter {
            filter: FilterType::BitMask {
                filter: *identifier,
                mask: 0x7FF,
            },
            action: Action::StoreInFifo0,
        };
    }
    controller.set_standard_filters(&filters);
}

/// Counts a frame that is lost.
fn count(overruns: &AtomicU32) {
    overruns.fetch_add(1, Ordering::Relaxed);
}

/// Returns how many frames find room to wait for the bus.
pub fn room() -> usize {
    TO_SEND.free_capacity()
}

/// Queues a frame for the bus; counts it as lost where there is no room.
pub fn send(frame: Frame) {
    if TO_SEND.try_send(frame).is_err() {
        count(&TRANSMIT_OVERRUNS);
    }
}

/// Returns how long ago the newest SYNC came, where one has since the last call.
pub fn sync_age() -> Option<Span> {
    let at = critical_section::with(|section| SYNC.borrow(section).take());
    let micros = at?.elapsed().as_micros();
    Some(Span::from_micros(u32::try_from(micros).unwrap_or(u32::MAX)))
}

/// Returns how many frames were lost on the way in and on the way out.
pub fn overruns() -> (u32, u32) {
    let load = |counter: &AtomicU32| counter.load(Ordering::Relaxed);
    (load(&RECEIVE_OVERRUNS), load(&TRANSMIT_OVERRUNS))
}

/// Brings frames from the controller to the control tick.
#[embassy_executor::task]
pub async fn receive(mut bus: CanRx<'static>) {
    loop {
        match select(bus.read(), Timer::after_millis(PULSE_MS)).await {
            Either::First(Ok(envelope)) => {
                if let Some(frame) = from_hal(&envelope.frame) {
                    if frame.cob_id() == Some(Cob::Sync.id()) {
                        let now = Instant::now();
                        critical_section::with(|section| SYNC.borrow(section).set(Some(now)));
                    }
                    if RECEIVED.try_send(frame).is_err() {
                        count(&RECEIVE_OVERRUNS);
                    }
                }
            }
            // The error stays until the bus is well again, and would be read without a pause.
            Either::First(Err(_)) => Timer::after_millis(1).await,
            Either::Second(()) => {}
        }
        if pac::FDCAN1.ir().read().rfl(0) {
            // Cleared by writing 1, and only this one. Frames, of which it doesn't say how many, found
            // no room in the controller.
            pac::FDCAN1.ir().write(|flags| flags.set_rfl(0, true));
            count(&RECEIVE_OVERRUNS);
        }
        liveness::RECEIVE.advance();
    }
}

/// Where the controller stands on its bus.
enum Standing {
    /// It takes part.
    On,
    /// It was thrown off, and stays so.
    Off,
    /// It waits for the bus to be idle often enough.
    Rejoining,
}

/// Tells where the controller stands.
fn standing() -> Standing {
    let is_off = pac::FDCAN1.psr().read().bo();
    match (is_off, pac::FDCAN1.cccr().read().init()) {
        (false, _) => Standing::On,
        (true, true) => Standing::Off,
        (true, false) => Standing::Rejoining,
    }
}

/// Brings frames from the control tick to the controller, which sends them in their order.
#[embassy_executor::task]
pub async fn transmit(mut bus: CanTx<'static>) {
    let mut backoff = Backoff::default();
    loop {
        liveness::TRANSMIT.advance();
        match standing() {
            Standing::On => forward(&mut bus).await,
            Standing::Off => stay_away(&mut backoff).await,
            Standing::Rejoining => {
                drop_waiting();
                Timer::after_millis(PULSE_MS).await;
            }
        }
    }
}

/// Hands the next frame to the controller, if there is one soon.
async fn forward(bus: &mut CanTx<'static>) {
    let next = select(TO_SEND.receive(), Timer::after_millis(PULSE_MS)).await;
    let Either::First(frame) = next else { return };
    let Some(waiting) = to_hal(&frame) else {
        return;
    };
    for _ in 0..PATIENCE {
        liveness::TRANSMIT.advance();
        let written = select(bus.write(&waiting), Timer::after_millis(PULSE_MS)).await;
        // A FIFO never gives a frame back.
        if let Either::First(_) = written {
            return;
        }
    }
    count(&TRANSMIT_OVERRUNS);
    drop_waiting();
    if let Standing::On = standing() {
        leave();
        join();
    }
}

/// Stays off the bus for a while after a bus-off, and begins to rejoin.
async fn stay_away(backoff: &mut Backoff) {
    let now = eel_units::Instant::from_micros(Instant::now().as_micros());
    let pause = u64::from(backoff.pause(now).to_micros() / 1_000);
    let offs = BUS_OFFS.fetch_add(1, Ordering::Relaxed).wrapping_add(1);
    defmt::warn!("bus-off number {=u32}, {=u64} ms away", offs, pause);
    leave();
    for _ in 0..pause / PULSE_MS {
        drop_waiting();
        liveness::TRANSMIT.advance();
        Timer::after_millis(PULSE_MS).await;
    }
    join();
}

/// Drops and counts the frames that wait for the controller.
fn drop_waiting() {
    while TO_SEND.try_receive().is_ok() {
        count(&TRANSMIT_OVERRUNS);
    }
}

/// Takes the controller off the bus, counts the frames that it still had to send and makes it forget
/// them. It does so when CCE is set, which resets TXBRP, TXFQS and the fill levels of reception
/// (RM0440, FDCAN, software initialization); cancelling single frames is not meant for a FIFO.
fn leave() {
    let unsent = pac::FDCAN1.txbrp().read().0.count_ones();
    TRANSMIT_OVERRUNS.fetch_add(unsent, Ordering::Relaxed);
    pac::FDCAN1.cccr().modify(|control| control.set_init(true));
    // Takes some cycles of the controller's clock to cross over to it and back.
    for _ in 0..SETTLING {
        if pac::FDCAN1.cccr().read().init() {
            break;
        }
    }
    pac::FDCAN1.cccr().modify(|control| control.set_cce(true));
}

/// Lets the controller take part again, after 11 idle bits or, after a bus-off, 129 times as many.
fn join() {
    pac::FDCAN1.cccr().modify(|control| {
        control.set_cce(false);
        control.set_init(false);
    });
}

fn from_hal(frame: &HalFrame) -> Option<Frame> {
    let header = frame.header();
    if header.rtr() {
        return Frame::remote(*header.id(), header.len());
    }
    Frame::new(*header.id(), frame.data())
}

fn to_hal(frame: &Frame) -> Option<HalFrame> {
    let header = Header::new(frame.id(), frame.length(), frame.is_remote());
    HalFrame::new(header, frame.data()).ok()
}
