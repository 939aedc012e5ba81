//! The few instructions that everything else is made of.
//!
//! A multiplication keeps the high half of the product, rounded down: SMMUL or SMMLA on Armv7E-M, where
//! the compiler makes three or four instructions of a factor that it knows to be positive; SMULL on
//! Armv7-M, which it finds. A division is SDIV or UDIV, which give zero for a divisor of zero where
//! Rust would have to ask first. Elsewhere plain Rust gives the same bits.

/// Returns `a · b / 2³²`, rounded down.
///
/// Qm times Qn gives Q(m + n − 32). No input overflows.
#[inline(always)]
pub fn multiply_high(a: i32, b: i32) -> i32 {
    #[cfg(eel_dsp)]
    {
        let high: i32;
        // SAFETY: one register-to-register multiply; no memory, no flags, no stack.
        #[expect(unsafe_code, reason = "one instruction where the compiler makes three")]
        unsafe {
            core::arch::asm!(
                "smmul {high}, {a}, {b}",
                high = lateout(reg) high, a = in(reg) a, b = in(reg) b,
                options(pure, nomem, nostack, preserves_flags)
            );
        }
        high
    }
    #[cfg(not(eel_dsp))]
    {
        ((a as i64 * b as i64) >> 32) as i32
    }
}

/// Returns `sum + a · b / 2³²`, the product rounded down, the sum modulo 2³².
#[inline(always)]
pub fn multiply_high_add(sum: i32, a: i32, b: i32) -> i32 {
    #[cfg(eel_dsp)]
    {
        let high: i32;
        // SAFETY: one register-to-register multiply; no memory, no flags, no stack.
        #[expect(unsafe_code, reason = "one instruction where the compiler makes four")]
        unsafe {
            core::arch::asm!(
                "smmla {high}, {a}, {b}, {sum}",
                high = lateout(reg) high, a = in(reg) a, b = in(reg) b, sum = in(reg) sum,
                options(pure, nomem, nostack, preserves_flags)
            );
        }
        high
    }
    #[cfg(not(eel_dsp))]
    {
        sum.wrapping_add(multiply_high(a, b))
    }
}

/// Returns `number / divisor` rounded towards zero; zero for a divisor of zero.
///
/// The one overflow, `i32::MIN / −1`, gives `i32::MIN`.
#[inline(always)]
pub fn divide(number: i32, divisor: i32) -> i32 {
    #[cfg(target_arch = "arm")]
    {
        let quotient: i32;
        // SAFETY: one register-to-register division, which Armv7-M and Armv7E-M have; the trap for a
        // divisor of zero is off after reset and never turned on. No memory, no flags, no stack.
        #[expect(unsafe_code, reason = "a division that needs no check")]
        unsafe {
            core::arch::asm!(
                "sdiv {quotient}, {number}, {divisor}",
                quotient = lateout(reg) quotient, number = in(reg) number, divisor = in(reg) divisor,
                options(pure, nomem, nostack, preserves_flags)
            );
        }
        quotient
    }
    #[cfg(not(target_arch = "arm"))]
    {
        match divisor {
            0 => 0,
            _ => number.wrapping_div(divisor),
        }
    }
}

/// Returns `number / divisor` rounded down; zero for a divisor of zero.
#[inline(always)]
pub fn divide_unsigned(number: u32, divisor: u32) -> u32 {
    #[cfg(target_arch = "arm")]
    {
        let quotient: u32;
        // SAFETY: as in `divide`.
        #[expect(unsafe_code, reason = "a division that needs no check")]
        unsafe {
            core::arch::asm!(
                "udiv {quotient}, {number}, {divisor}",
                quotient = lateout(reg) quotient, number = in(reg) number, divisor = in(reg) divisor,
                options(pure, nomem, nostack, preserves_flags)
            );
        }
        quotient
    }
    #[cfg(not(target_arch = "arm"))]
    {
        number.checked_div(divisor).unwrap_or(0)
    }
}

/// Returns a table from a place that the compiler does not know.
///
/// It then loads each number with one instruction instead of making it with two.
#[inline(always)]
pub(crate) fn from_memory<Table>(table: &'static Table) -> &'static Table {
    #[cfg(target_arch = "arm")]
    {
        let mut place: *const Table = table;
        // SAFETY: no instruction at all: the address of a static comes back as it went in.
        #[expect(unsafe_code, reason = "hides where the address comes from")]
        unsafe {
            core::arch::asm!(
                "/* {place} */",
                place = inlateout(reg) place,
                options(pure, nomem, nostack, preserves_flags)
            );
            &*place
        }
    }
    #[cfg(not(target_arch = "arm"))]
    {
        table
    }
}
