//! What happens when the program fails: bridges off, a note for the next start, reset; and how the
//! next start tells a failure from a start that was ordered.

use core::cell::UnsafeCell;
use core::panic::PanicInfo;
use core::ptr;

use cortex_m_rt::{ExceptionFrame, exception};
use eel_vertebra::{KEEPSAKE_BYTES, Keepsake};
use embassy_stm32::pac;

use crate::bridges;

const MAGIC: u32 = 0x0EE1_DEAD;
/// Number of the NMI.
pub const NMI: i16 = -14;

/// What led to this start.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// Power, the reset pin, or option bytes that were written.
    Ordered,
    /// The program or its clock failed: a watchdog, a panic, a fault of the CPU, an interrupt that
    /// nobody expects, a software reset. A programmer that starts the chip by a software reset counts
    /// too, as it can't be told from the others.
    Failed,
}

/// Where a program failed: a line of the source, or an address for a fault of the CPU.
#[derive(Clone, Copy)]
struct Note {
    magic: u32,
    /// Line of the panic; 0 for a fault of the CPU.
    line: u32,
    /// Address of the instruction that faulted, or the number of an interrupt that nobody expects;
    /// 0 for a panic.
    address: u32,
}

/// Memory that start-up leaves alone.
struct Kept<T>(UnsafeCell<T>);

// SAFETY: both are read once before interrupts are on. The note is written with interrupts off just before a
// reset, what the vertebra wants to be remembered by the control tick alone.
unsafe impl<T> Sync for Kept<T> {}

// SAFETY: a static that start-up leaves alone may hold any bits, and any are a valid `Note`.
#[unsafe(link_section = ".uninit.failure")]
static KEPT: Kept<Note> = Kept(UnsafeCell::new(Note {
    magic: 0,
    line: 0,
    address: 0,
}));

/// What the vertebra wants to be remembered.
// SAFETY: a static that start-up leaves alone may hold any bits, and any are bytes.
#[unsafe(link_section = ".uninit.keepsake")]
static REMEMBERED: Kept<[u8; KEEPSAKE_BYTES]> = Kept(UnsafeCell::new([0; KEEPSAKE_BYTES]));

/// Returns what the vertebra remembers; call it before the control tick runs.
pub fn remembered() -> Keepsake {
    // SAFETY: any bits are bytes, and nothing else runs yet.
    Keepsake::from_bytes(unsafe { ptr::read_volatile(REMEMBERED.0.get()) })
}

/// Remembers this from now on; only the control tick may call it.
pub fn remember(keepsake: &Keepsake) {
    // SAFETY: nobody else touches it while interrupts are on. A failure meanwhile spoils its check.
    unsafe { ptr::write_volatile(REMEMBERED.0.get(), *keepsake.as_bytes()) };
}

/// Finds out and logs what led to this start, and clears the signs of it.
///
/// A failure is never missed for another cause: its flag or note stays until it is read here, and
/// outweighs the reset pin, which every reset of the chip also moves.
pub fn take_start() -> Start {
    let note = take_note();
    if let Some(note) = note {
        defmt::error!(
            "failed before: line {=u32}, address {=u32:#010x}",
            note.line,
            note.address
        );
    }
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|flags| flags.set_rmvf(true));
    let by_watchdog = flags.iwdgrstf() || flags.wwdgrstf();
    if by_watchdog {
        defmt::error!("reset by the watchdog");
    }
    // The last is a stop mode that the program never asks for.
    let failed = note.is_some() || by_watchdog || flags.sftrstf() || flags.lpwrrstf();
    if failed {
        Start::Failed
    } else {
        Start::Ordered
    }
}

/// Returns the note of a failure before this start, and forgets it.
fn take_note() -> Option<Note> {
    // SAFETY: any bits are a valid `Note`, and nothing else runs yet.
    let note = unsafe { ptr::read_volatile(KEPT.0.get()) };
    keep(0, 0, 0);
    (note.magic == MAGIC).then_some(note)
}

fn keep(magic: u32, line: u32, address: u32) {
    // SAFETY: nothing else runs: before the start, or with interrupts off before a reset.
    unsafe {
        ptr::write_volatile(
            KEPT.0.get(),
            Note {
                magic,
                line,
                address,
            },
        )
    };
}

fn stop(line: u32, address: u32) -> ! {
    cortex_m::interrupt::disable();
    bridges::force_off();
    keep(MAGIC, line, address);
    cortex_m::peripheral::SCB::sys_reset()
}

/// Ends the program for an interrupt that nobody expects.
pub fn stop_for_interrupt(interrupt: i16) -> ! {
    stop(0, interrupt.unsigned_abs().into())
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    stop(info.location().map_or(0, core::panic::Location::line), 0)
}

// SAFETY: the handler touches no memory of the program but the note, and never returns.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    stop(0, frame.pc())
}

// SAFETY: as above.
#[exception]
unsafe fn DefaultHandler(interrupt: i16) -> ! {
    stop_for_interrupt(interrupt)
}
