//! Time as an argument: microseconds since an arbitrary start that the platform chooses.

use core::ops::{Add, Sub};

/// A moment, in microseconds since the platform's start; lasts 584 000 years.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Instant(u64);

/// A span of time in microseconds, up to 71 minutes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Duration(u32);

impl Instant {
    /// The platform's start.
    pub const ZERO: Self = Self(0);

    /// Makes a moment from microseconds since the start.
    #[inline]
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros)
    }

    /// Returns microseconds since the start.
    #[inline]
    pub const fn to_micros(self) -> u64 {
        self.0
    }

    /// Returns the time since `earlier`: none where `earlier` is later, at most 71 minutes.
    #[inline]
    pub const fn since(self, earlier: Self) -> Duration {
        let span = self.0.saturating_sub(earlier.0);
        if span > u32::MAX as u64 {
            Duration(u32::MAX)
        } else {
            Duration(span as u32)
        }
    }
}

impl Duration {
    /// No time.
    pub const ZERO: Self = Self(0);

    /// Makes a span from microseconds.
    #[inline]
    pub const fn from_micros(micros: u32) -> Self {
        Self(micros)
    }

    /// Makes a span from milliseconds; saturates beyond 71 minutes.
    #[inline]
    pub const fn from_millis(millis: u32) -> Self {
        Self(millis.saturating_mul(1_000))
    }

    /// Returns microseconds.
    #[inline]
    pub const fn to_micros(self) -> u32 {
        self.0
    }
}

impl Add<Duration> for Instant {
    type Output = Self;
    #[inline]
    fn add(self, span: Duration) -> Self {
        Self(self.0.saturating_add(span.0 as u64))
    }
}

impl Sub<Instant> for Instant {
    type Output = Duration;
    #[inline]
    fn sub(self, earlier: Instant) -> Duration {
        self.since(earlier)
    }
}
