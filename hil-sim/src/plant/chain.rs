//! The chain of eleven bodies: its state, and its accelerations by the articulated-body algorithm
//! (Featherstone, *Rigid Body Dynamics Algorithms*, table 7.1) with spherical joints.
//!
//! A joint's rates are the angular velocity of the tail-side body relative to the head-side one,
//! in the tail-side frame. Velocities are relative to the water, which makes a uniform stream a
//! moving frame and nothing else.

use super::algebra::{Mat3, Quat, Vec3};
use super::body::{BODIES, Body, Edge, Inertia, JOINTS};
use super::water::{self, Wrench};

/// Where the chain is and how it moves.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Position of the nose in the world, m.
    pub position: Vec3,
    /// Attitude of the head body: from its frame to the world's.
    pub attitude: Quat,
    /// Angular velocity of the head body in its own frame, rad/s.
    pub spin: Vec3,
    /// Velocity of the nose in the head body's frame, m/s.
    pub velocity: Vec3,
    /// Rotations of the joints: from the tail-side frame to the head-side one.
    pub joints: [Quat; JOINTS],
    /// Rates of the joints, rad/s.
    pub rates: [Vec3; JOINTS],
}

/// Accelerations of the chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Acceleration {
    /// Of the head body's angular velocity, rad/s².
    pub spin: Vec3,
    /// Of the head body's velocity, component by component in its own frame, m/s².
    pub velocity: Vec3,
    /// Of the joints' rates, rad/s².
    pub rates: [Vec3; JOINTS],
}

/// What acts at one joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Moment on the tail-side body in its frame, without the part in `implicit`, N·m.
    pub moment: Vec3,
    /// What the joint's acceleration itself costs: rotor inertia and, where a step treats it
    /// implicitly, step × damping, kg·m².
    pub implicit: Mat3,
}

/// A force from outside on one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// The body pushed, 0 (head) to 10 (tail).
    pub body: usize,
    /// Where, in the body's frame, m.
    pub point: Vec3,
    /// The force in the world frame, N.
    pub force: Vec3,
}

/// The chain's constants.
#[derive(Clone, Debug)]
pub struct Chain {
    /// Its bodies.
    pub bodies: [Body; BODIES],
    /// Its trailing edge.
    pub edge: Edge,
    /// Whether the joints are rigid.
    pub locked: bool,
}

/// Rotations to the head-side frame and velocities of all bodies.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// From each body's frame to its head-side neighbour's; the head's to the world's.
    pub rotations: [Mat3; BODIES],
    /// Angular velocities in the body frames, rad/s.
    pub spins: [Vec3; BODIES],
    /// Velocities of the origins in the body frames, relative to the water, m/s.
    pub velocities: [Vec3; BODIES],
}

/// What the way to the head leaves behind for the way back.
#[derive(Clone, Copy, Default)]
struct Hinge {
    angular: Mat3,
    coupling: Mat3,
    inverse: Mat3,
    moment: Vec3,
}

impl State {
    /// A straight eel at rest with its nose at the origin.
    pub const REST: Self = Self {
        position: Vec3::ZERO,
        attitude: Quat::IDENTITY,
        spin: Vec3::ZERO,
        velocity: Vec3::ZERO,
        joints: [Quat::IDENTITY; JOINTS],
        rates: [Vec3::ZERO; JOINTS],
    };
}

impl Chain {
    /// Returns where every body points and how it moves.
    pub fn motion(&self, state: &State) -> Motion {
        let mut motion = Motion {
            rotations: [state.attitude.matrix(); BODIES],
            spins: [state.spin; BODIES],
            velocities: [state.velocity; BODIES],
        };
        for k in 1..BODIES {
            let rotation = state.joints[k - 1].matrix();
            let (spin, velocity) = (motion.spins[k - 1], motion.velocities[k - 1]);
            let lever = self.bodies[k - 1].length_m;
            let origin = velocity + swept(spin, lever);
            motion.rotations[k] = rotation;
            motion.spins[k] = rotation.transpose_mul(spin) + state.rates[k - 1];
            motion.velocities[k] = rotation.transpose_mul(origin);
        }
        motion
    }

    /// Returns the accelerations under the loads of the joints and pushes from outside.
    pub fn accelerations(
        &self,
        motion: &Motion,
        rates: &[Vec3; JOINTS],
        loads: &[Load; JOINTS],
        pushes: &[Push],
    ) -> Acceleration {
        let mut biases = self.biases(motion);
        for push in pushes {
            push_back(&mut biases, motion, push);
        }
        let mut hinges = [Hinge::default(); JOINTS];
        let mut inertia = self.bodies[BODIES - 1].inertia;
        for k in (1..BODIES).rev() {
            let load = &loads[k - 1];
            let drift = self.drift(motion, rates, k);
            let mut bias = biases[k];
            if self.locked {
                let (angular, linear) = inertia.momentum(drift.0, drift.1);
                bias.moment += angular;
                bias.force += linear;
            } else {
                let hinge = Hinge {
                    angular: inertia.angular,
                    coupling: inertia.coupling,
                    inverse: (inertia.angular + load.implicit).inverse_symmetric(),
                    moment: load.moment - bias.moment,
                };
                hinges[k - 1] = hinge;
                free(&mut inertia, &mut bias, &hinge, drift);
            }
            let (rotation, lever) = (motion.rotations[k], self.bodies[k - 1].length_m);
            let mut head_side = self.bodies[k - 1].inertia;
            carry(&mut head_side, &inertia, &rotation, lever);
            inertia = head_side;
            let force = rotation * bias.force;
            biases[k - 1].force += force;
            biases[k - 1].moment += rotation * bias.moment + swept(force, -lever);
        }
        let (spin, velocity) = solve(&inertia, &biases[0]);
        let mut result = Acceleration {
            spin,
            velocity,
            rates: [Vec3::ZERO; JOINTS],
        };
        if !self.locked {
            self.to_the_tail(motion, rates, &hinges, &mut result);
        }
        result
    }

    /// Returns the bias of every body: its inertia's own, less the forces of water and gravity.
    fn biases(&self, motion: &Motion) -> [Wrench; BODIES] {
        let mut biases = [Wrench::default(); BODIES];
        let mut up = Vec3::new(1.0, 0.0, 0.0);
        for (k, body) in self.bodies.iter().enumerate() {
            let (spin, velocity) = (motion.spins[k], motion.velocities[k]);
            up = motion.rotations[k].transpose_mul(up);
            let drag = water::drag(body, spin, velocity);
            let mut bias = water::bias(body, spin, velocity);
            bias.force -= drag.force + up * body.lift_n;
            bias.moment -= drag.moment + body.righting.cross(up);
            biases[k] = bias;
        }
        let last = BODIES - 1;
        let shed = water::shed(&self.edge, motion.spins[last], motion.velocities[last]);
        biases[last].force -= shed.force;
        biases[last].moment -= shed.moment;
        biases
    }

    /// Returns the acceleration of body `k` that its joint's rates alone cause.
    #[inline(always)]
    fn drift(&self, motion: &Motion, rates: &[Vec3; JOINTS], k: usize) -> (Vec3, Vec3) {
        let rate = rates[k - 1];
        (
            motion.spins[k].cross(rate),
            motion.velocities[k].cross(rate),
        )
    }

    /// Fills in the joints' accelerations, from the head to the tail.
    fn to_the_tail(
        &self,
        motion: &Motion,
        rates: &[Vec3; JOINTS],
        hinges: &[Hinge; JOINTS],
        result: &mut Acceleration,
    ) {
        let (mut spin, mut velocity) = (result.spin, result.velocity);
        for k in 1..BODIES {
            let (rotation, hinge) = (&motion.rotations[k], &hinges[k - 1]);
            let origin = velocity + swept(spin, self.bodies[k - 1].length_m);
            let drift = self.drift(motion, rates, k);
            spin = rotation.transpose_mul(spin) + drift.0;
            velocity = rotation.transpose_mul(origin) + drift.1;
            let rest = hinge.moment - hinge.angular * spin - hinge.coupling * velocity;
            result.rates[k - 1] = hinge.inverse * rest;
            spin += result.rates[k - 1];
        }
    }

    /// Returns the kinetic energy of eel and carried water, J.
    pub fn kinetic_energy(&self, motion: &Motion) -> f64 {
        let energy = |(k, body): (usize, &Body)| {
            let (spin, velocity) = (motion.spins[k], motion.velocities[k]);
            let (angular, linear) = body.inertia.momentum(spin, velocity);
            0.5 * (spin.dot(angular) + velocity.dot(linear))
        };
        self.bodies.iter().enumerate().map(energy).sum()
    }

    /// Returns the momentum of eel and carried water in the world frame, N·s.
    pub fn momentum(&self, motion: &Motion) -> Vec3 {
        let mut attitude = Mat3::IDENTITY;
        let mut total = Vec3::ZERO;
        for (k, body) in self.bodies.iter().enumerate() {
            attitude = attitude * motion.rotations[k];
            let (_, linear) = body.inertia.momentum(motion.spins[k], motion.velocities[k]);
            total += attitude * linear;
        }
        total
    }

    /// Returns the power that drag and the shed momentum take from the eel, W.
    pub fn water_power(&self, motion: &Motion) -> f64 {
        let mut power = 0.0;
        for (k, body) in self.bodies.iter().enumerate() {
            let (spin, velocity) = (motion.spins[k], motion.velocities[k]);
            let mut wrench = water::drag(body, spin, velocity);
            if k == BODIES - 1 {
                wrench.add(water::shed(&self.edge, spin, velocity));
            }
            power -= wrench.power(spin, velocity);
        }
        power
    }
}

/// Returns v × (0, 0, lever).
#[inline(always)]
fn swept(v: Vec3, lever: f64) -> Vec3 {
    Vec3::new(v.0[1] * lever, -v.0[0] * lever, 0.0)
}

/// Takes a push from outside off the bias of its body.
fn push_back(biases: &mut [Wrench; BODIES], motion: &Motion, push: &Push) {
    let mut force = push.force;
    for rotation in &motion.rotations[..=push.body] {
        force = rotation.transpose_mul(force);
    }
    biases[push.body].force -= force;
    biases[push.body].moment -= push.point.cross(force);
}

/// Lets a joint turn freely: what is left of inertia and bias is what its head side feels.
#[inline(always)]
fn free(inertia: &mut Inertia, bias: &mut Wrench, hinge: &Hinge, drift: (Vec3, Vec3)) {
    let (angular, coupling) = (hinge.angular, hinge.coupling);
    let by_angular = hinge.inverse * angular;
    let by_coupling = hinge.inverse * coupling;
    inertia.angular = angular - angular * by_angular;
    inertia.coupling = coupling - angular * by_coupling;
    inertia.linear = inertia.linear - coupling.transpose() * by_coupling;
    let (from_angular, from_linear) = inertia.momentum(drift.0, drift.1);
    let turned = hinge.inverse * hinge.moment;
    bias.moment += from_angular + angular * turned;
    bias.force += from_linear + coupling.transpose_mul(turned);
}

/// Adds a tail-side inertia to the head-side body's: turned, then moved by the lever along z.
#[inline(always)]
fn carry(onto: &mut Inertia, inertia: &Inertia, rotation: &Mat3, lever: f64) {
    let back = rotation.transpose();
    let linear = *rotation * inertia.linear * back;
    let turned = *rotation * inertia.coupling * back;
    let angular = *rotation * inertia.angular * back;
    let coupling = turned + lever_left(&linear, lever);
    onto.linear += linear;
    onto.coupling += coupling;
    onto.angular +=
        angular - lever_right(&turned, lever) + lever_left(&coupling.transpose(), lever);
}

/// Returns [r×] · m for r = (0, 0, lever).
#[inline(always)]
fn lever_left(m: &Mat3, lever: f64) -> Mat3 {
    let [[a, b, c], [d, e, f], _] = m.0;
    Mat3([
        [-lever * d, -lever * e, -lever * f],
        [lever * a, lever * b, lever * c],
        [0.0; 3],
    ])
}

/// Returns m · [r×] for r = (0, 0, lever).
#[inline(always)]
fn lever_right(m: &Mat3, lever: f64) -> Mat3 {
    let row = |r: [f64; 3]| [lever * r[1], -lever * r[0], 0.0];
    Mat3([row(m.0[0]), row(m.0[1]), row(m.0[2])])
}

/// Solves inertia · acceleration = −bias.
fn solve(inertia: &Inertia, bias: &Wrench) -> (Vec3, Vec3) {
    let inverse = inertia.linear.inverse_symmetric();
    let to_angular = inertia.coupling * inverse;
    let angular = inertia.angular - to_angular * inertia.coupling.transpose();
    let spin = angular.inverse_symmetric() * (to_angular * bias.force - bias.moment);
    let rest = -bias.force - inertia.coupling.transpose_mul(spin);
    (spin, inverse * rest)
}
