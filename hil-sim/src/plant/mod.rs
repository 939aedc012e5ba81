//! The eel in water: eleven bodies, ten driven joints, thirty motors with their sensors.
//!
//! f64 throughout, one thread, `libm` for every function: the same configuration, seed and drives
//! give the same bits on every machine and in every profile.
//!
//! The world frame is the head's at the start: x up, y to the left, z from head to tail, so that
//! the eel swims towards −z. Deliberately absent: boundaries of the water, its waves, and the wake
//! beyond what the trailing edge sheds.

pub mod algebra;
pub mod body;
pub mod chain;
pub mod checks;
pub mod config;
mod defect;
pub mod gait;
pub mod integrate;
pub mod joint;
pub mod measures;
pub mod motor;
mod mounting;
mod power;
pub mod random;
#[cfg(test)]
mod tests;
pub mod transmission;
mod view;
pub mod water;
pub mod wrist;

use eel_vertebra::{Drive, Sample};

use algebra::{Mat3, Vec3};
use body::JOINTS;
use chain::{Chain, Load, Motion, Push, State};
pub use config::Config;
pub use defect::{Defect, Defects};
use joint::{Pull, Stops, Target, Tracking};
pub use mounting::Mounting;
pub use view::BodyState;
use wrist::Wrist;

/// How hands hold a joint: firmly, and without an inertia of their own.
const HANDS: Tracking = Tracking {
    stiffness: 100.0,
    damping: 10.0,
    inertia: 0.0,
};

/// The eel, its water and its motors at one moment.
#[derive(Clone, Debug)]
pub struct Plant {
    config: Config,
    chain: Chain,
    stops: Stops,
    state: State,
    wrists: [Wrist; JOINTS],
    pushes: Vec<Push>,
    stream: Vec3,
    /// How far the stream has carried the eel, m.
    carried: Vec3,
    supply_v: f64,
    /// Where somebody's hands hold a joint.
    hands: [Option<Target>; JOINTS],
    moments: [Vec3; JOINTS],
    power_w: f64,
    energy_j: f64,
    steps: u64,
}

impl Plant {
    /// Makes a straight eel at rest, its nose at the origin; the seed sets where the encoders
    /// start and the noise of the sensors.
    pub fn new(config: &Config, seed: u64) -> Self {
        Self {
            chain: Chain {
                bodies: body::cut(config),
                edge: body::trailing_edge(config),
                locked: config.locked,
            },
            stops: Stops::new(config),
            state: State::REST,
            wrists: std::array::from_fn(|joint| Wrist::new(config, seed, joint)),
            pushes: Vec::new(),
            stream: Vec3(config.water.map_or([0.0; 3], |water| water.stream_m_s)),
            carried: Vec3::ZERO,
            supply_v: config.supply_v,
            hands: [None; JOINTS],
            moments: [Vec3::ZERO; JOINTS],
            power_w: 0.0,
            energy_j: 0.0,
            steps: 0,
            config: config.clone(),
        }
    }

    /// Advances one step with what the bridges do.
    pub fn step(&mut self, drives: &[[Drive; 3]; JOINTS]) {
        let motion = self.chain.motion(&self.state);
        let mut loads = [Load::default(); JOINTS];
        for (joint, load) in loads.iter_mut().enumerate() {
            let (rotation, rate) = (&motion.rotations[joint + 1], self.state.rates[joint]);
            let (wrist, drives) = (&mut self.wrists[joint], &drives[joint]);
            *load = wrist.load(&self.config, drives, self.supply_v, rotation, rate);
            if let Some(target) = &self.hands[joint] {
                let (_, hand) = HANDS.load(target, rotation, rate, self.config.step_s);
                load.moment += hand.moment;
                load.implicit += hand.implicit;
            }
        }
        let accelerations = self.advance(&motion, &mut loads);
        let mut drawn_a = 0.0;
        for (joint, acceleration) in accelerations.into_iter().enumerate() {
            let (wrist, rate) = (&mut self.wrists[joint], self.state.rates[joint]);
            self.moments[joint] = wrist.settle(&self.config, rate, acceleration);
            drawn_a += wrist.supply_current_a();
        }
        self.supply_v = self.config.supply_v - self.config.supply_resistance_ohm * drawn_a;
        self.account(&accelerations);
    }

    /// Advances one step with ideal drives instead of motors: a strong spring and damper hold
    /// every joint at its target.
    pub fn step_tracking(&mut self, targets: &[Target; JOINTS], tracking: &Tracking) {
        let motion = self.chain.motion(&self.state);
        let mut loads = [Load::default(); JOINTS];
        let mut pulls = [Pull::default(); JOINTS];
        let step = self.config.step_s;
        for (joint, target) in targets.iter().enumerate() {
            let (rotation, rate) = (&motion.rotations[joint + 1], self.state.rates[joint]);
            (pulls[joint], loads[joint]) = tracking.load(target, rotation, rate, step);
        }
        let accelerations = self.advance(&motion, &mut loads);
        for (joint, acceleration) in accelerations.into_iter().enumerate() {
            self.moments[joint] = pulls[joint].settle(self.state.rates[joint], acceleration);
        }
        self.account(&accelerations);
    }

    /// Advances one step without drives by Runge–Kutta, for validation; the joints are free but
    /// for a constant inertia about each axis, kg·m².
    pub fn step_free(&mut self, joint_inertia: f64) {
        let free = Load {
            moment: Vec3::ZERO,
            implicit: Mat3::diagonal(joint_inertia, joint_inertia, joint_inertia),
        };
        let (loads, step) = ([free; JOINTS], self.config.step_s);
        integrate::runge_kutta(&self.chain, &mut self.state, &loads, &self.pushes, step);
        self.carried += self.stream * step;
        self.steps += 1;
    }

    /// Adds the stops to the loads and advances the state; returns the joints' accelerations.
    fn advance(&mut self, motion: &Motion, loads: &mut [Load; JOINTS]) -> [Vec3; JOINTS] {
        let step = self.config.step_s;
        for (joint, load) in loads.iter_mut().enumerate() {
            let (rotation, rate) = (&motion.rotations[joint + 1], self.state.rates[joint]);
            self.stops.add(load, rotation, rate, step);
        }
        let state = &mut self.state;
        let moved = integrate::semi_implicit(&self.chain, state, motion, loads, &self.pushes, step);
        self.carried += self.stream * step;
        self.steps += 1;
        moved.rates
    }

    /// Adds up the work of the joints: moment × rate at the middle of the step.
    fn account(&mut self, accelerations: &[Vec3; JOINTS]) {
        let half = 0.5 * self.config.step_s;
        self.power_w = 0.0;
        for (joint, acceleration) in accelerations.iter().enumerate() {
            let middle = self.state.rates[joint] - *acceleration * half;
            self.power_w += self.moments[joint].dot(middle);
        }
        self.energy_j += self.power_w * self.config.step_s;
    }

    /// Returns what vertebra `joint + 1` measures now; currents are means since the last sample.
    ///
    /// # Panics
    /// With a joint beyond 9.
    pub fn sample(&mut self, joint: usize) -> Sample {
        let rotation = self.state.joints[joint].matrix();
        self.wrists[joint].sample(&self.config, &rotation, self.supply_v)
    }

    /// Returns what is wrong with the hardware of vertebra `joint + 1`.
    ///
    /// # Panics
    /// With a joint beyond 9.
    pub fn defects_mut(&mut self, joint: usize) -> &mut Defects {
        self.wrists[joint].defects_mut()
    }

    /// Builds the motors of vertebra `joint + 1` in otherwise than ideally.
    ///
    /// # Panics
    /// With a joint beyond 9.
    pub fn set_mounting(&mut self, joint: usize, mounting: [Mounting; 3]) {
        self.wrists[joint].set_mounting(mounting);
    }

    /// Lets somebody's hands hold a joint, or let go of it.
    ///
    /// # Panics
    /// With a joint beyond 9.
    pub fn set_hands(&mut self, joint: usize, hold: Option<Target>) {
        self.hands[joint] = hold;
    }

    /// Sets the battery's voltage without load from now on, V.
    pub fn set_battery(&mut self, volts: f64) {
        self.config.supply_v = volts;
    }

    /// Sets the forces from outside that act from now on, in place of those before.
    pub fn set_pushes(&mut self, pushes: &[Push]) {
        self.pushes = pushes.to_vec();
    }

    /// Sets the velocity of the stream in the world frame, m/s. The water takes the eel with it
    /// at once, as it does a neutral body.
    pub fn set_stream(&mut self, stream_m_s: [f64; 3]) {
        self.stream = Vec3(stream_m_s);
    }

    /// Returns the state; velocities in it are relative to the water.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Returns the state for a test or a scenario to set.
    pub fn state_mut(&mut self) -> &mut State {
        &mut self.state
    }
}
