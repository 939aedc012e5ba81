//! Times at which something is due, in microseconds.

/// The time that never comes.
pub(crate) const NEVER_US: u64 = u64::MAX;

/// Returns the time `us` after `now_us`.
#[inline(never)] // One copy in flash.
pub(crate) const fn after(now_us: u64, us: u32) -> u64 {
    now_us.saturating_add(us as u64)
}

/// Returns milliseconds in microseconds.
pub(crate) const fn micros(milliseconds: u16) -> u32 {
    milliseconds as u32 * 1_000
}
