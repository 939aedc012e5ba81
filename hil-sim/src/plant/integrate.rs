//! One step of time: semi-implicit for running, Runge–Kutta of fourth order for validation.

use super::algebra::{Quat, Vec3};
use super::body::JOINTS;
use super::chain::{Acceleration, Chain, Load, Motion, Push, State};

/// The rate of change of a state.
struct Slope {
    position: Vec3,
    attitude: Quat,
    joints: [Quat; JOINTS],
    acceleration: Acceleration,
}

/// Advances the state by `step` seconds, velocities first, and returns the accelerations used.
///
/// First order in the step; stable for any joint damping that is part of the loads' `implicit`.
pub fn semi_implicit(
    chain: &Chain,
    state: &mut State,
    motion: &Motion,
    loads: &[Load; JOINTS],
    pushes: &[Push],
    step: f64,
) -> Acceleration {
    let acceleration = chain.accelerations(motion, &state.rates, loads, pushes);
    state.spin += acceleration.spin * step;
    state.velocity += acceleration.velocity * step;
    for k in 0..JOINTS {
        state.rates[k] += acceleration.rates[k] * step;
        let rate = state.joints[k].rate(state.rates[k]);
        state.joints[k] = state.joints[k].plus_scaled(rate, step).normalised();
    }
    let before = state.attitude.matrix() * state.velocity;
    let turn = state.attitude.rate(state.spin);
    state.attitude = state.attitude.plus_scaled(turn, step).normalised();
    let after = state.attitude.matrix() * state.velocity;
    state.position += (before + after) * (0.5 * step);
    acceleration
}

/// Advances the state by `step` seconds with loads that do not change; error of order step⁴.
pub fn runge_kutta(
    chain: &Chain,
    state: &mut State,
    loads: &[Load; JOINTS],
    pushes: &[Push],
    step: f64,
) {
    let slope = |state: &State| {
        let motion = chain.motion(state);
        Slope {
            position: motion.rotations[0] * state.velocity,
            attitude: state.attitude.rate(state.spin),
            joints: std::array::from_fn(|k| state.joints[k].rate(state.rates[k])),
            acceleration: chain.accelerations(&motion, &state.rates, loads, pushes),
        }
    };
    let start = state.clone();
    let first = slope(&start);
    let second = slope(&moved(&start, &first, 0.5 * step));
    let third = slope(&moved(&start, &second, 0.5 * step));
    let fourth = slope(&moved(&start, &third, step));
    for (slope, weight) in [(first, 1.0), (second, 2.0), (third, 2.0), (fourth, 1.0)] {
        *state = moved(state, &slope, weight * step / 6.0);
    }
    state.attitude = state.attitude.normalised();
    for joint in &mut state.joints {
        *joint = joint.normalised();
    }
}

/// Returns the state moved along a slope.
fn moved(state: &State, slope: &Slope, step: f64) -> State {
    State {
        position: state.position + slope.position * step,
        attitude: state.attitude.plus_scaled(slope.attitude, step),
        spin: state.spin + slope.acceleration.spin * step,
        velocity: state.velocity + slope.acceleration.velocity * step,
        joints: std::array::from_fn(|k| state.joints[k].plus_scaled(slope.joints[k], step)),
        rates: std::array::from_fn(|k| state.rates[k] + slope.acceleration.rates[k] * step),
    }
}
