//! The hash of everything that the kernel answers, the same on every machine.

use eel_kinematics::{Bounds, Direct, Policy, Pose, PoseError, Rotation, Wrist};
use eel_units::{
    Angle, AngularVelocity, Torque, arctangents, multiply_high, multiply_high_add, quotient_q30,
    ratio_q30, root_near, root_q30,
};

/// How many poses are hashed.
const POSES: u32 = 20_000;
/// The seed of the hashed poses.
const SEED: u64 = 0x0EE1_0123_4567;

/// Numbers that are the same in every run: Vigna's xorshift64*.
pub struct Numbers(u64);

impl Numbers {
    /// Starts with a seed other than zero.
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Returns the next 32 bits.
    pub fn bits(&mut self) -> i32 {
        let Self(state) = self;
        *state ^= *state >> 12;
        *state ^= *state << 25;
        *state ^= *state >> 27;
        (state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32) as i32
    }
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

/// Hashes what the primitives and the kernel answer for seeded poses, in the workspace and beyond.
pub fn hash() -> u64 {
    let mut numbers = Numbers::new(SEED);
    let mut hash = Hash(0xCBF2_9CE4_8422_2325);
    for index in 0..POSES {
        let (x, y) = (numbers.bits(), numbers.bits());
        add_primitives(&mut hash, x, y);
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
        match answered {
            Ok(direct) => add_direct(&mut hash, &direct, [x, y, numbers.bits()]),
            Err(error) => hash.add_error(error),
        }
    }
    let Hash(state) = hash;
    state
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

fn add_direct(hash: &mut Hash, direct: &Direct, bits: [i32; 3]) {
    let Direct {
        rotation, jacobian, ..
    } = direct;
    hash.add_all(rotation.columns().iter().flatten().copied());
    hash.add_all([jacobian.det_a(), direct.margin()]);
    hash.add_all(jacobian.torque_rows().iter().flatten().copied());
    let moment = bits.map(|raw| Torque::from_q24(raw >> 4));
    let bounds = [Bounds {
        low: Torque::from_q24(-(1 << 25)),
        high: Torque::from_q24(1 << 26),
    }; 3];
    let shared = jacobian.share(&moment, &bounds, Policy::YawFirst);
    hash.add_all(shared.torque.map(Torque::to_q24));
    hash.add_all(shared.achieved.map(Torque::to_q24));
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
