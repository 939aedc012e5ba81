//! The CAN bus in simulated time: bitwise arbitration, exact frame times, the STM32G474's queues.
//!
//! Time is an argument, in integer nanoseconds. Controllers are attached to a [`Bus`]; the owner
//! loads frames into their transmit buffers ([`Bus::enqueue`]), lets time pass ([`Bus::advance`])
//! and takes received frames out of their FIFOs ([`Bus::receive`]). The bus never looks at a clock,
//! never allocates once its controllers are attached, and the same calls give the same events.
//!
//! Precisely:
//! - The bus is idle from the end of a frame's intermission on. A frame starts at the later of that
//!   instant and the earliest loading of a pending frame. Every frame that was loaded at or before
//!   the start takes part in arbitration; one loaded a nanosecond later waits for the next.
//! - [`Bus::advance`] to `t` decides the starts before `t` and completes the frames that end by
//!   `t`. A node that loads a frame at `t`, after that call, thus still takes part in an
//!   arbitration at `t`.
//! - Lowest arbitration field wins, bit by bit: base identifier, RTR or SRR, IDE, the other 18
//!   bits, RTR.
//! - Frames are received and confirmed at the last bit of the end of frame, three bits before the
//!   bus is idle.
//! - Two frames with one arbitration field and different content are a bit error where they first
//!   differ: an active error frame, then both are sent again. Each error adds 8 to a transmitter's
//!   error counter and each success takes 1 off; from 128 on, its error flag is passive and no longer
//!   destroys the other's frame, so that the dominant one gets through on the 17th attempt. Equal
//!   frames are one frame with two senders, as on a real bus.
//! - A frame that nobody acknowledges ends in an error frame and is sent again.
//!
//! Deliberately absent here: the receive error counter, suspended transmission, bus-off by count (the
//! robot's faults take a controller off), random bit errors, oscillator drift and cable faults.

mod arbitration;
mod controller;
mod event;
mod statistics;
mod wire;

#[cfg(test)]
mod tests;

pub use arbitration::arbitration_field;
pub use controller::{
    ControllerConfig, ControllerId, EnqueueError, Fifo, Filter, FilterMatch, Overflow, TransmitMode,
};
pub use event::{BusErrorKind, Delivery, Event};
pub use statistics::{ControllerStatistics, Statistics};
pub use wire::{AttachError, BitRate, Bus};
