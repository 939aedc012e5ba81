//! The CAN bus: FDCAN1 at 1 Mbit/s, only the identifiers that concern this vertebra.

use core::num::{NonZeroU8, NonZeroU16};
use core::sync::atomic::{AtomicU32, Ordering};

use eel_protocol::{Cob, Frame, HEAD_NODE, NodeId};
use embassy_futures::select::{Either, select};
use embassy_stm32::can::config::{GlobalFilter, NominalBitTiming, TxBufferMode};
use embassy_stm32::can::filter::{Action, Filter, FilterType, StandardFilter};
use embassy_stm32::can::frame::Header;
use embassy_stm32::can::{Can, CanConfigurator, CanRx, CanTx, Frame as HalFrame};
use embassy_stm32::can::{IT0InterruptHandler, IT1InterruptHandler};
use embassy_stm32::peripherals::*;
use embassy_stm32::{Peri, bind_interrupts};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::Timer;

use crate::liveness;

/// Frames that wait for the control tick, and frames that wait for the bus.
pub const QUEUE: usize = 32;
/// Time between two signs of life.
const PULSE_MS: u64 = 5;
/// Signs of life for which a frame waits for the bus before it is dropped: 20 ms, two SYNCs.
const PATIENCE: u32 = 4;

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
pub static TO_SEND: Channel<CriticalSectionRawMutex, Frame, QUEUE> = Channel::new();
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
pub fn start(connections: Connections, node: NodeId) -> Can<'static> {
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
        .set_automatic_bus_off_recovery(true);
    bus.set_config(config);
    bus.properties().set_standard_filters(&filters(node));
    bus.into_normal_mode()
}

/// Lists what this vertebra hears; everything else stays in the controller.
fn filters(node: NodeId) -> [StandardFilter; 28] {
    let exact = |cob: Cob| Filter {
        filter: FilterType::BitMask {
            filter: cob.id(),
            mask: 0x7FF,
        },
        action: Action::StoreInFifo0,
    };
    let node = node.get();
    let mut filters = [StandardFilter::disable(); 28];
    let heard = [
        Cob::Nmt,
        Cob::Sync,
        Cob::Time,
        Cob::Target(node),
        Cob::Moment(node),
        Cob::SdoRequest(node),
        Cob::Heartbeat(HEAD_NODE),
        Cob::LssRequest,
        // Its own, which no other node may send.
        Cob::Heartbeat(node),
    ];
    for (slot, cob) in filters.iter_mut().zip(heard) {
        *slot = exact(cob);
    }
    filters
}

/// Counts a frame that found no room.
fn count(overruns: &AtomicU32) {
    overruns.fetch_add(1, Ordering::Relaxed);
}

/// Queues a frame for the bus; counts it as lost where there is no room.
pub fn send(frame: Frame) {
    if TO_SEND.try_send(frame).is_err() {
        count(&TRANSMIT_OVERRUNS);
    }
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
                if let Some(frame) = from_hal(&envelope.frame)
                    && RECEIVED.try_send(frame).is_err()
                {
                    count(&RECEIVE_OVERRUNS);
                }
            }
            // The error stays until the bus is well again, and would be read without a pause.
            Either::First(Err(_)) => Timer::after_millis(1).await,
            Either::Second(()) => {}
        }
        liveness::RECEIVE.advance();
    }
}

/// Brings frames from the control tick to the controller, which sends them in their order.
#[embassy_executor::task]
pub async fn transmit(mut bus: CanTx<'static>) {
    loop {
        liveness::TRANSMIT.advance();
        let next = select(TO_SEND.receive(), Timer::after_millis(PULSE_MS)).await;
        let Either::First(frame) = next else { continue };
        let Some(waiting) = to_hal(&frame) else {
            continue;
        };
        let mut patience = PATIENCE;
        while patience > 0 {
            liveness::TRANSMIT.advance();
            match select(bus.write(&waiting), Timer::after_millis(PULSE_MS)).await {
                // A FIFO never gives a frame back.
                Either::First(_) => break,
                Either::Second(()) => patience -= 1,
            }
        }
        if patience == 0 {
            count(&TRANSMIT_OVERRUNS);
        }
    }
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
