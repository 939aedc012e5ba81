//! The two rounding multiplies that everything else is made of.
//!
//! On Armv7E-M each is one instruction that the compiler does not find by itself; elsewhere it is
//! plain Rust. Both forms give the same bits for every input.

/// Returns `a · b / 2³²`, rounded to nearest (halves upwards).
///
/// Qm times Qn gives Q(m + n − 32). No input overflows.
#[inline(always)]
pub fn multiply_high(a: i32, b: i32) -> i32 {
    #[cfg(eel_dsp)]
    {
        let high: i32;
        // SAFETY: one register-to-register multiply (SMMULR); no memory, no flags, no stack.
        #[expect(unsafe_code, reason = "one multiply instruction that has no intrinsic")]
        unsafe {
            core::arch::asm!(
                "smmulr {high}, {a}, {b}",
                high = lateout(reg) high, a = in(reg) a, b = in(reg) b,
                options(pure, nomem, nostack, preserves_flags)
            );
        }
        high
    }
    #[cfg(not(eel_dsp))]
    {
        multiply_high_portable(a, b)
    }
}

/// Returns `sum + a · b / 2³²`, the product rounded to nearest, the sum modulo 2³².
#[inline(always)]
pub fn multiply_high_add(sum: i32, a: i32, b: i32) -> i32 {
    #[cfg(eel_dsp)]
    {
        let high: i32;
        // SAFETY: one register-to-register multiply (SMMLAR); no memory, no flags, no stack.
        #[expect(unsafe_code, reason = "one multiply instruction that has no intrinsic")]
        unsafe {
            core::arch::asm!(
                "smmlar {high}, {a}, {b}, {sum}",
                high = lateout(reg) high, a = in(reg) a, b = in(reg) b, sum = in(reg) sum,
                options(pure, nomem, nostack, preserves_flags)
            );
        }
        high
    }
    #[cfg(not(eel_dsp))]
    {
        sum.wrapping_add(multiply_high_portable(a, b))
    }
}

/// The portable form; |a · b| ≤ 2⁶², so that the rounding constant can't overflow.
#[cfg(not(eel_dsp))]
#[inline(always)]
const fn multiply_high_portable(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64 + (1 << 31)) >> 32) as i32
}
