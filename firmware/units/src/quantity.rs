//! Newtypes over integers, each with one unit.

use core::ops::{Add, AddAssign, Neg, Sub, SubAssign};

use crate::arithmetic::saturate;

/// Defines a saturating quantity over `i32` with one raw constructor and one raw accessor.
macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $from:ident, $to:ident, $unit:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(i32);

        impl $name {
            /// Nothing of it.
            pub const ZERO: Self = Self(0);
            /// The largest value.
            pub const MAX: Self = Self(i32::MAX);
            /// The most negative value that has an opposite.
            pub const MIN: Self = Self(-i32::MAX);

            #[doc = concat!("Makes the quantity from ", $unit, ".")]
            #[inline]
            pub const fn $from(raw: i32) -> Self {
                Self(raw)
            }

            #[doc = concat!("Returns the quantity in ", $unit, ".")]
            #[inline]
            pub const fn $to(self) -> i32 {
                self.0
            }

            /// Returns the magnitude; that of the most negative value is the largest value.
            #[inline]
            pub const fn abs(self) -> Self {
                Self(self.0.saturating_abs())
            }

            /// Returns the value within `low..=high`; `low` wins where the two are crossed.
            #[inline]
            pub const fn bounded(self, low: Self, high: Self) -> Self {
                let held = if self.0 > high.0 { high } else { self };
                if held.0 < low.0 { low } else { held }
            }
        }

        impl Add for $name {
            type Output = Self;
            #[inline]
            fn add(self, other: Self) -> Self {
                Self(self.0.saturating_add(other.0))
            }
        }

        impl Sub for $name {
            type Output = Self;
            #[inline]
            fn sub(self, other: Self) -> Self {
                Self(self.0.saturating_sub(other.0))
            }
        }

        impl Neg for $name {
            type Output = Self;
            #[inline]
            fn neg(self) -> Self {
                Self(self.0.saturating_neg())
            }
        }

        impl AddAssign for $name {
            #[inline]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl SubAssign for $name {
            #[inline]
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }
    };
}

quantity! {
    /// An angle in Q29 radians: ±4 rad in steps of 1.86 nrad.
    Angle, from_q29, to_q29, "radians × 2²⁹"
}
quantity! {
    /// An angular velocity in Q24 rad/s: ±128 rad/s in steps of 60 nrad/s.
    AngularVelocity, from_q24, to_q24, "rad/s × 2²⁴"
}
quantity! {
    /// A torque, or one component of a moment, in Q24 N·m: ±128 N·m in steps of 60 nN·m.
    Torque, from_q24, to_q24, "N·m × 2²⁴"
}
quantity! {
    /// An electric current in µA: ±2147 A.
    Current, from_microamps, to_microamps, "microamperes"
}
quantity! {
    /// A voltage in mV.
    Voltage, from_millivolts, to_millivolts, "millivolts"
}
quantity! {
    /// A temperature in tenths of a degree Celsius.
    Temperature, from_decidegrees, to_decidegrees, "tenths of a degree Celsius"
}
quantity! {
    /// The share of the supply voltage a bridge applies, in Q15: ±32 767 is full voltage.
    Duty, from_q15, to_q15, "parts of 2¹⁵"
}

impl Angle {
    /// A quarter turn over two, π/4 rad, where the third motor stands at home.
    pub const FRAC_PI_4: Self = Self(421_657_428);
    /// A quarter turn, π/2 rad.
    pub const FRAC_PI_2: Self = Self(843_314_857);
    /// Half a turn, π rad.
    pub const PI: Self = Self(1_686_629_713);

    /// Makes an angle from the unit of the wire, 10⁻⁴ rad; wrong by at most 0.56 of a step (1.05 nrad).
    #[inline]
    pub const fn from_tenth_milliradians(raw: i16) -> Self {
        // 2²⁹ / 10⁴ = 53687.0912, kept with 16 more bits: 3 518 437 208.8832.
        Self(((raw as i64 * 3_518_437_209 + (1 << 15)) >> 16) as i32)
    }

    /// Returns the angle in the unit of the wire, 10⁻⁴ rad, rounded to nearest and saturated.
    #[inline]
    pub const fn to_tenth_milliradians(self) -> i16 {
        let rounded = (self.0 as i64 * 10_000 + (1 << 28)) >> 29;
        saturate_i16(rounded)
    }

    /// Makes an angle from milliradians; saturates beyond ±4 rad.
    pub const fn from_milliradians(raw: i32) -> Self {
        Self(saturate(((raw as i64) << 29) / 1_000))
    }

    /// Makes an angle from microradians, rounded to nearest; saturates beyond ±4 rad.
    pub const fn from_microradians(raw: i32) -> Self {
        let half = if raw < 0 { -500_000 } else { 500_000 };
        Self(saturate((((raw as i64) << 29) + half) / 1_000_000))
    }
}

impl AngularVelocity {
    /// Makes an angular velocity from mrad/s; saturates beyond ±128 rad/s.
    pub const fn from_milliradians_per_second(raw: i32) -> Self {
        Self(saturate(((raw as i64) << 24) / 1_000))
    }
}

impl Torque {
    /// Makes a torque from mN·m, the unit of the wire; saturates beyond ±128 N·m.
    pub const fn from_millinewton_metres(raw: i32) -> Self {
        Self(saturate((raw as i64 * 1_099_511_628 + (1 << 15)) >> 16))
    }

    /// Returns the torque in mN·m, the unit of the wire, rounded to nearest and saturated.
    #[inline]
    pub const fn to_millinewton_metres(self) -> i16 {
        saturate_i16((self.0 as i64 * 1_000 + (1 << 23)) >> 24)
    }
}

impl Current {
    /// Makes a current from mA; saturates beyond ±2147 A.
    pub const fn from_milliamps(raw: i32) -> Self {
        Self(raw.saturating_mul(1_000))
    }
}

impl Duty {
    /// Full voltage forward.
    pub const FULL: Self = Self(32_767);
}

/// Returns the nearest `i16`.
const fn saturate_i16(value: i64) -> i16 {
    if value > i16::MAX as i64 {
        i16::MAX
    } else if value < i16::MIN as i64 {
        i16::MIN
    } else {
        value as i16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wire_unit_of_angles_survives_the_way_there_and_back() {
        for raw in i16::MIN..=i16::MAX {
            let angle = Angle::from_tenth_milliradians(raw);
            assert_eq!(angle.to_tenth_milliradians(), raw);
            let exact = i64::from(raw) * (1 << 29);
            let error = (i64::from(angle.to_q29()) * 10_000 - exact).abs();
            assert!(error <= 5_600, "{raw}: {error} ten-thousandths of a step");
        }
    }

    #[test]
    fn the_wire_unit_of_torques_survives_the_way_there_and_back() {
        for raw in i16::MIN..=i16::MAX {
            let torque = Torque::from_millinewton_metres(i32::from(raw));
            assert_eq!(torque.to_millinewton_metres(), raw);
        }
    }

    #[test]
    fn sums_end_at_the_end_of_the_range() {
        assert_eq!(Angle::MAX + Angle::MAX, Angle::MAX);
        assert_eq!(-Angle::from_q29(i32::MIN), Angle::MAX);
        assert_eq!(Torque::from_millinewton_metres(i32::MAX), Torque::MAX);
    }

    #[test]
    fn crossed_bounds_leave_the_lower_one() {
        let (low, high) = (Torque::from_q24(5), Torque::from_q24(-5));
        assert_eq!(Torque::ZERO.bounded(low, high), low);
        assert_eq!(Torque::from_q24(9).bounded(high, low), low);
    }
}
