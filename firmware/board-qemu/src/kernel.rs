//! The wrist's kernel alone, linked for the target: `cargo xtask cycles` weighs it against `bare`.
//!
//! It is never run. Its functions are there once each, out of line, and nothing calls them: the image
//! has no more than `bare` has, their addresses, and what they need.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod image {
    use core::hint::black_box;
    use core::panic::PanicInfo;

    use eel_kinematics::{
        Bounds, Direct, Inverse, Jacobian, Joints, Policy, Pose, PoseError, Shared, Wrist,
    };
    use eel_units::Torque;

    /// Everything that a control tick asks of the kernel.
    #[expect(dead_code, reason = "only linked")]
    struct Kernel {
        wrist: Wrist,
        inverse: fn(&Wrist, &Pose) -> Result<Inverse, PoseError>,
        direct: fn(&Wrist, &Joints) -> Result<Direct, PoseError>,
        share: fn(&Jacobian, &[Torque; 3], &[Bounds; 3], Policy) -> Shared,
    }

    static KERNEL: Kernel = Kernel {
        wrist: Wrist::PAPER,
        inverse,
        direct,
        share,
    };

    #[cortex_m_rt::entry]
    fn main() -> ! {
        loop {
            black_box(&KERNEL);
        }
    }

    #[inline(never)]
    fn inverse(wrist: &Wrist, pose: &Pose) -> Result<Inverse, PoseError> {
        wrist.inverse(pose)
    }

    #[inline(never)]
    fn direct(wrist: &Wrist, joints: &Joints) -> Result<Direct, PoseError> {
        wrist.direct(joints)
    }

    #[inline(never)]
    fn share(
        jacobian: &Jacobian,
        moment: &[Torque; 3],
        bounds: &[Bounds; 3],
        policy: Policy,
    ) -> Shared {
        jacobian.share(moment, bounds, policy)
    }

    #[panic_handler]
    fn panic(_: &PanicInfo) -> ! {
        cortex_m::asm::udf();
    }
}

/// Says what this is for: it is only linked.
#[cfg(not(target_os = "none"))]
fn main() {
    println!("cargo xtask cycles");
}
