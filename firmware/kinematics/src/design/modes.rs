//! Names for the solutions: which way each leg is bent, and which way the platform is joined.
//!
//! A working mode tells the four inverse solutions apart, an assembly mode the four direct ones. A
//! mode changes only at a singularity: the working mode where (l×r)·i vanishes on a leg, the assembly
//! mode where det A does.

use nalgebra::{Matrix3, Vector3};

use super::Geometry;

/// The signs of (l×r)·i on legs 1 and 2: which way each crank and its rod are bent.
///
/// The first two entries of B have these signs. Home of all three architectures has both positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkingMode {
    /// Both positive, as at home: `++`.
    PlusPlus,
    /// Leg 1 as at home, leg 2 bent the other way: `+-`.
    PlusMinus,
    /// Leg 1 bent the other way, leg 2 as at home: `-+`.
    MinusPlus,
    /// Both legs bent the other way: `--`.
    MinusMinus,
}

/// On which side of the platform the cranks' ends are: which way the platform is joined to them.
///
/// det A = (B1·z'')(B2·z_m) in arms, with z'' = x''×y' and z_m the platform's axis: leg 1 alone
/// makes the first factor zero, leg 2 the second. At home both are −1: the cranks' ends are below.
/// Of the two φ that leg 1 allows, home's has the greater cosine wherever B1 is below the plane z = 0:
/// always with parallel axes and with parallel actuators, for θ1 between −135° and 45° with
/// orthogonal axes. With parallel actuators one of the two is π/2, C1 at (0, 0, −1): the other one, as
/// long as home's has a positive cosine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssemblyMode {
    /// B1·z'' < 0 and B2·z_m < 0, so det A > 0.
    Home,
    /// Home's φ, the other ψ: B1·z'' < 0 and B2·z_m > 0, so det A < 0.
    OtherPsi,
    /// The other φ, with det A > 0 again: B1·z'' > 0 and B2·z_m > 0.
    OtherPhi,
    /// The other φ, with det A < 0: B1·z'' > 0 and B2·z_m < 0.
    OtherBoth,
}

impl WorkingMode {
    /// The mode of home.
    pub const HOME: Self = Self::PlusPlus;
    /// All four, home's first.
    pub const ALL: [Self; 4] = [
        Self::PlusPlus,
        Self::PlusMinus,
        Self::MinusPlus,
        Self::MinusMinus,
    ];

    /// Returns its name: the two signs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PlusPlus => "++",
            Self::PlusMinus => "+-",
            Self::MinusPlus => "-+",
            Self::MinusMinus => "--",
        }
    }

    /// Returns the mode with these signs of (l×r)·i; nothing where one is zero, at a serial
    /// singularity, on the border of two modes.
    pub fn of_signs(first: f64, second: f64) -> Option<Self> {
        Some(match (is_positive(first)?, is_positive(second)?) {
            (true, true) => Self::PlusPlus,
            (true, false) => Self::PlusMinus,
            (false, true) => Self::MinusPlus,
            (false, false) => Self::MinusMinus,
        })
    }

    /// Returns which of a leg's two solutions each leg takes.
    pub(super) const fn solutions(self) -> [usize; 2] {
        match self {
            Self::PlusPlus => [0, 0],
            Self::PlusMinus => [0, 1],
            Self::MinusPlus => [1, 0],
            Self::MinusMinus => [1, 1],
        }
    }
}

impl AssemblyMode {
    /// The mode of home.
    pub const HOME: Self = Self::Home;
    /// All four, home's first.
    pub const ALL: [Self; 4] = [Self::Home, Self::OtherPsi, Self::OtherPhi, Self::OtherBoth];

    /// Returns its name: what differs from home's solution.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Home => "home",
            Self::OtherPsi => "other-psi",
            Self::OtherPhi => "other-phi",
            Self::OtherBoth => "other-both",
        }
    }

    /// Returns whether the crank's end of leg 1 is below its plane, and that of leg 2.
    pub(super) const fn below(self) -> [bool; 2] {
        match self {
            Self::Home => [true, true],
            Self::OtherPsi => [true, false],
            Self::OtherPhi => [false, false],
            Self::OtherBoth => [false, true],
        }
    }
}

impl Geometry {
    /// Returns the working mode of a configuration; nothing at a serial singularity of leg 1 or 2.
    pub fn working_mode(&self, rotation: &Matrix3<f64>, theta: &[f64; 3]) -> Option<WorkingMode> {
        let b = self.jacobians(rotation, theta).b;
        WorkingMode::of_signs(b[0], b[1])
    }

    /// Returns the assembly mode of a configuration; nothing where det A vanishes.
    pub fn assembly_mode(&self, rotation: &Matrix3<f64>, theta: &[f64; 3]) -> Option<AssemblyMode> {
        let [first, second] = self.depths(rotation, theta);
        Some(match (is_positive(first)?, is_positive(second)?) {
            (true, true) => AssemblyMode::Home,
            (true, false) => AssemblyMode::OtherPsi,
            (false, false) => AssemblyMode::OtherPhi,
            (false, true) => AssemblyMode::OtherBoth,
        })
    }

    /// Returns how deep the cranks' ends are below the platform, −B1·z'' and −B2·z_m, in arms.
    ///
    /// Both are 1 at home of all three architectures; their product is det A.
    pub fn depths(&self, rotation: &Matrix3<f64>, theta: &[f64; 3]) -> [f64; 2] {
        let (s3, c3) = (libm::sin(theta[2]), libm::cos(theta[2]));
        let above = rotation.column(0).cross(&Vector3::new(-s3, c3, 0.0));
        let ends = [0, 1].map(|leg| self.legs[leg].end(theta[leg]) / self.arm);
        [-ends[0].dot(&above), -ends[1].dot(&rotation.column(2))]
    }
}

/// Returns whether a number is positive; nothing for zero and for what is no number.
fn is_positive(number: f64) -> Option<bool> {
    if number > 0.0 {
        Some(true)
    } else if number < 0.0 {
        Some(false)
    } else {
        None
    }
}
