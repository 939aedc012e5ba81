//! What the plant tells about itself.

use super::Plant;
use super::algebra::{Mat3, Vec3, pose_of, pose_rate_matrix};
use super::body::{BODIES, JOINTS};
use super::config::Config;

/// One body's place and motion in the world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    /// Position of the frame's origin, m.
    pub position: [f64; 3],
    /// Rotation from the body's frame to the world's, by rows.
    pub rotation: [[f64; 3]; 3],
    /// Velocity of the origin, m/s.
    pub velocity: [f64; 3],
    /// Angular velocity, rad/s.
    pub spin: [f64; 3],
}

impl Plant {
    /// Returns the time since the start, s.
    pub fn time_s(&self) -> f64 {
        self.steps as f64 * self.config.step_s
    }

    /// Returns the configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Returns yaw, pitch and roll of a joint, rad.
    pub fn joint_pose(&self, joint: usize) -> [f64; 3] {
        pose_of(&self.state.joints[joint].matrix())
    }

    /// Returns the rates of yaw, pitch and roll of a joint, rad/s.
    pub fn joint_rate(&self, joint: usize) -> [f64; 3] {
        let rotation = self.state.joints[joint].matrix();
        (pose_rate_matrix(&rotation) * self.state.rates[joint]).0
    }

    /// Returns the moment that the drive train of a joint passed to the bodies in the last step,
    /// after friction and rotor inertia, in the tail-side frame, N·m.
    pub fn joint_moment(&self, joint: usize) -> [f64; 3] {
        self.moments[joint].0
    }

    /// Returns the electrical torques of a joint's motors, N·m.
    pub fn motor_torque(&self, joint: usize) -> [f64; 3] {
        self.wrists[joint].torques(&self.config.motor)
    }

    /// Returns the currents of a joint's motors, A.
    pub fn motor_current_a(&self, joint: usize) -> [f64; 3] {
        std::array::from_fn(|i| self.wrists[joint].motors()[i].current_a)
    }

    /// Returns the true angles of a joint's motors, rad.
    pub fn motor_angle(&self, joint: usize) -> [f64; 3] {
        self.wrists[joint].angles(&self.state.joints[joint].matrix())
    }

    /// Returns the winding temperatures of a joint's motors, °C.
    pub fn winding_c(&self, joint: usize) -> [f64; 3] {
        std::array::from_fn(|i| self.wrists[joint].motors()[i].winding_c)
    }

    /// Returns the voltage at the bridges, V.
    pub fn supply_v(&self) -> f64 {
        self.supply_v
    }

    /// Returns the mechanical power of all joints in the last step: moment × mid-step rate, W.
    pub fn joint_power_w(&self) -> f64 {
        self.power_w
    }

    /// Returns the work of all joints since the start, J.
    pub fn joint_energy_j(&self) -> f64 {
        self.energy_j
    }

    /// Returns the kinetic energy of eel and carried water, relative to the water, J.
    pub fn kinetic_energy_j(&self) -> f64 {
        self.chain.kinetic_energy(&self.chain.motion(&self.state))
    }

    /// Returns the power that drag and the shed momentum take from the eel, W.
    pub fn water_power_w(&self) -> f64 {
        self.chain.water_power(&self.chain.motion(&self.state))
    }

    /// Returns the momentum of eel and carried water in the world frame, N·s.
    pub fn momentum(&self) -> [f64; 3] {
        self.chain.momentum(&self.chain.motion(&self.state)).0
    }

    /// Returns the mass of the eel without the water's, kg.
    pub fn mass_kg(&self) -> f64 {
        self.chain.bodies.iter().map(|body| body.mass_kg).sum()
    }

    /// Returns place and motion of every body in the world frame, from head to tail.
    pub fn bodies(&self) -> [BodyState; BODIES] {
        let motion = self.chain.motion(&self.state);
        let mut position = self.state.position + self.carried;
        let mut attitude = Mat3::IDENTITY;
        std::array::from_fn(|k| {
            if k > 0 {
                position += attitude * Vec3::new(0.0, 0.0, self.chain.bodies[k - 1].length_m);
            }
            attitude = attitude * motion.rotations[k];
            BodyState {
                position: position.0,
                rotation: attitude.0,
                velocity: (attitude * motion.velocities[k] + self.stream).0,
                spin: (attitude * motion.spins[k]).0,
            }
        })
    }

    /// Returns the centre of mass in the world frame, m.
    pub fn centre_of_mass(&self) -> [f64; 3] {
        let mut sum = Vec3::ZERO;
        for (body, place) in self.chain.bodies.iter().zip(self.bodies()) {
            let centre = Vec3(place.position) + Mat3(place.rotation) * body.centre_of_mass;
            sum += centre * body.mass_kg;
        }
        (sum * (1.0 / self.mass_kg())).0
    }

    /// Returns the tip of the nose in the world frame, m.
    pub fn nose(&self) -> [f64; 3] {
        (self.state.position + self.carried).0
    }

    /// Returns the middle of the trailing edge in the world frame, m.
    pub fn tail_edge(&self) -> [f64; 3] {
        self.spine_points()[JOINTS + 1]
    }

    /// Returns nose, ten joints and the middle of the trailing edge in the world frame, m.
    pub fn spine_points(&self) -> [[f64; 3]; JOINTS + 2] {
        let bodies = self.bodies();
        let mut points = [[0.0; 3]; JOINTS + 2];
        for (point, body) in points.iter_mut().zip(&bodies) {
            *point = body.position;
        }
        let last = &bodies[BODIES - 1];
        let edge =
            Mat3(last.rotation) * Vec3::new(0.0, 0.0, self.chain.bodies[BODIES - 1].length_m);
        points[JOINTS + 1] = (Vec3(last.position) + edge).0;
        points
    }

    /// Returns 64 bits that differ when any bit of the state does (FNV-1a).
    pub fn fingerprint(&self) -> u64 {
        let state = &self.state;
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut eat = |values: &[f64]| {
            for byte in values
                .iter()
                .flat_map(|value| value.to_bits().to_le_bytes())
            {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        };
        eat(&state.position.0);
        eat(&state.attitude.0);
        eat(&state.spin.0);
        eat(&state.velocity.0);
        for joint in 0..JOINTS {
            eat(&state.joints[joint].0);
            eat(&state.rates[joint].0);
            eat(&self.motor_current_a(joint));
        }
        hash
    }
}
