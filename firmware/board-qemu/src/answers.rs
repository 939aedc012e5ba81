//! The hash of everything that the kernel answers, the same on every machine.
//!
//! `cargo xtask cycles` runs this program on the Cortex-M4 and the Cortex-M3 in QEMU, where it prints the
//! hash over semihosting, and on the host; all three must print the same.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod console;
#[expect(dead_code, reason = "draws its own poses")]
mod numbers;

use eel_kinematics::{Bounds, Direct, Policy, Pose, PoseError, Rotation, Side, Wrist};
use eel_units::{
    Angle, AngularVelocity, Torque, arctangents, multiply_high, multiply_high_add, quotient_q30,
    ratio_q30, root_near, root_q30,
};

use crate::numbers::Numbers;

/// How many poses are hashed.
const POSES: u32 = 1_000_000;
/// Of how many poses one is hashed with all that can be made of it, and primitives beside it; of the
/// others the inverse, the orientation, the margins and the map of torques.
const WHOLE: u32 = 16;
/// The seed of the hashed poses.
const SEED: u64 = 0x0EE1_0123_4567;

/// Prints the hash and ends QEMU.
#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    let (answered, hash) = hash();
    console::say(format_args!(
        "poses\t{POSES}\nanswered\t{answered}\nhash\t{hash:016x}"
    ));
    console::leave(cortex_m_semihosting::debug::EXIT_SUCCESS)
}

/// Prints the hash.
#[cfg(not(target_os = "none"))]
fn main() {
    let (answered, hash) = hash();
    println!("poses\t{POSES}\nanswered\t{answered}\nhash\t{hash:016x}");
}

/// FNV-1a over 32-bit words, with a shift so that high bits reach low ones.
struct Hash(u64);

impl Hash {
    fn add(&mut self, word: i32) {
        let Self(state) = self;
        *state = (*state ^ u64::from(word as u32)).wrapping_mul(0x0000_0100_0000_01B3);
        *state ^= *state >> 29;
    }

    fn add_all(&mut self, words: impl IntoIterator<Item = i32>) {
        words.into_iter().for_each(|word| self.add(word));
    }

    fn add_error(&mut self, error: PoseError) {
        self.add(match error {
            PoseError::OutOfReach => 1,
            PoseError::Singular => 2,
        });
    }
}

/// Hashes what the kernel answers for seeded poses, in the workspace and beyond.
///
/// Returns how many it answers, and the hash.
fn hash() -> (u32, u64) {
    let mut numbers = Numbers::new(SEED);
    let mut hash = Hash(0xCBF2_9CE4_8422_2325);
    let mut answers = 0;
    for index in 0..POSES {
        // Yaw within ±1, ±½ and ±¼ rad in turn.
        let scale = 2 + index % 3;
        let pose = Pose {
            yaw: Angle::from_q29(numbers.bits() >> scale),
            pitch: Angle::from_q29(numbers.bits() >> (scale + 1)),
            roll: Angle::from_q29(numbers.bits() >> (scale + 3)),
        };
        let answered = Wrist::PAPER.inverse(&pose).and_then(|inverse| {
            hash.add_all(inverse.joints.0.map(Angle::to_q29));
            hash.add(inverse.margin());
            Wrist::PAPER.direct(&inverse.joints)
        });
        match &answered {
            Ok(direct) => {
                answers += 1;
                add_direct(&mut hash, direct);
            }
            Err(error) => hash.add_error(*error),
        }
        if index % WHOLE == 0 {
            let bits = [0; 3].map(|_| numbers.bits());
            add_primitives(&mut hash, bits[0], bits[1]);
            if let Ok(direct) = &answered {
                add_shared(&mut hash, direct, bits, Policy::YawFirst);
                add_shared(&mut hash, direct, bits, Policy::KeepDirection);
                add_maps(&mut hash, direct, bits);
            }
        }
    }
    let Hash(state) = hash;
    (answers, state)
}

fn add_primitives(hash: &mut Hash, x: i32, y: i32) {
    let (sine, cosine) = Angle::from_q29(x).sin_cos();
    hash.add_all([sine, cosine]);
    hash.add_all([multiply_high(x, y), multiply_high_add(y, x, y)]);
    hash.add_all([root_q30(x as u32), root_near(y), ratio_q30(x, y)]);
    hash.add_all(arctangents([x, y]));
    hash.add(quotient_q30(x >> 2, y));
    hash.add(Angle::from_sides(y, x).to_q29());
}

fn add_direct(hash: &mut Hash, direct: &Direct) {
    let Direct {
        rotation, jacobian, ..
    } = direct;
    hash.add_all(rotation.columns().iter().flatten().copied());
    hash.add_all([jacobian.det_a(), direct.margin()]);
    hash.add_all(jacobian.torque_rows().iter().flatten().copied());
}

fn add_shared(hash: &mut Hash, direct: &Direct, bits: [i32; 3], policy: Policy) {
    let moment = bits.map(|raw| Torque::from_q24(raw >> 4));
    let bounds = [Bounds {
        low: Torque::from_q24(-(1 << 25)),
        high: Torque::from_q24(1 << 26),
    }; 3];
    let shared = direct.jacobian.share(&moment, &bounds, policy);
    hash.add_all(shared.torque.map(Torque::to_q24));
    hash.add_all(shared.achieved.map(Torque::to_q24));
    hash.add_all(shared.unallocated.map(Torque::to_q24));
    hash.add_all(shared.bound.map(|side| match side {
        None => 0,
        Some(Side::Low) => 1,
        Some(Side::High) => 2,
    }));
}

fn add_maps(hash: &mut Hash, direct: &Direct, bits: [i32; 3]) {
    let Direct {
        rotation, jacobian, ..
    } = direct;
    let moment = bits.map(|raw| Torque::from_q24(raw >> 4));
    hash.add_all(jacobian.torques(moment).map(Torque::to_q24));
    hash.add_all(jacobian.moment(moment).map(Torque::to_q24));
    let rates = bits.map(AngularVelocity::from_q24);
    hash.add_all(jacobian.motor_rates(rates).map(AngularVelocity::to_q24));
    let velocity = jacobian.angular_velocity(rates);
    hash.add_all(velocity.map(AngularVelocity::to_q24));
    let pose = rotation.to_pose();
    hash.add_all([pose.yaw, pose.pitch, pose.roll].map(Angle::to_q29));
    let error = Rotation::default().error_to(rotation);
    hash.add_all(error.map(Angle::to_q29));
}
