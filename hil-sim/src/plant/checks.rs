//! Numeric checks of the plant against answers that do not come from it; each gives a figure and
//! the bound it must keep, for a test and for `hil-sim check` to print.

use std::f64::consts::PI;

use eel_vertebra::Drive;
use serde::Serialize;

use super::Plant;
use super::algebra::{Quat, Vec3};
use super::body::{JOINTS, perimeter};
use super::chain::Push;
use super::config::{Ballast, Config, Shape};
use super::gait::{Wave, reference_swim};
use super::joint::Tracking;
use super::random::Random;

/// One check and its outcome.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// The check's number and what it looks at.
    pub name: &'static str,
    /// What came out.
    pub figure: f64,
    /// What may come out at most.
    pub bound: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Whether the figure keeps the bound.
    pub passed: bool,
}

impl Check {
    /// Judges a figure; one that is not a number fails.
    fn new(name: &'static str, figure: f64, bound: f64, unit: &'static str) -> Self {
        let passed = figure <= bound;
        Self {
            name,
            figure,
            bound,
            unit,
            passed,
        }
    }
}

/// Runs all checks.
pub fn all() -> Vec<Check> {
    vec![p1(), p2(), p3(), p4(), p5(), p6(), p7(), p8(), p9(), p10()]
}

/// P1: the dry free chain keeps its energy over 5 s (Runge–Kutta, 1 ms).
pub fn p1() -> Check {
    let config = Config {
        step_s: 1e-3,
        water: None,
        gravity_m_s2: 0.0,
        ..Config::default()
    };
    let mut plant = Plant::new(&config, 1);
    shake(&mut plant, 1);
    let start = plant.kinetic_energy_j();
    let mut drift: f64 = 0.0;
    for _ in 0..5000 {
        plant.step_free(0.0);
        drift = larger(drift, (plant.kinetic_energy_j() - start).abs() / start);
    }
    Check::new(
        "P1 energy drift of the dry free chain over 5 s",
        drift,
        1e-6,
        "1",
    )
}

/// Bends the eel a little and gives every joint and the head a rate.
fn shake(plant: &mut Plant, seed: u64) {
    let mut random = Random::new(seed, 0);
    let mut draw = |reach: f64| f64::from(random.within(1000)) * 1e-3 * reach;
    let state = plant.state_mut();
    for joint in 0..JOINTS {
        state.joints[joint] = Quat::from_pose([draw(0.3), draw(0.1), draw(0.03)]);
        state.rates[joint] = Vec3::new(draw(1.0), draw(0.5), draw(0.2));
    }
    state.spin = Vec3::new(draw(0.5), draw(0.5), draw(0.5));
    state.velocity = Vec3::new(draw(0.3), draw(0.3), draw(0.3));
}

/// P2: the dry free chain flies as MuJoCo's does, over 2 s; the other's places come from
/// `tests/python/mujoco_chain.py`.
pub fn p2() -> Check {
    const TABLE: &str = include_str!("mujoco-chain.csv");
    let config = Config {
        step_s: 0.5e-3,
        water: None,
        gravity_m_s2: 0.0,
        ..Config::bare()
    };
    let mut plant = Plant::new(&config, 1);
    let state = plant.state_mut();
    state.velocity = Vec3::new(0.05, -0.10, 0.15);
    state.spin = Vec3::new(0.2, -0.1, 0.3);
    for joint in 0..JOINTS {
        let k = joint as f64;
        state.joints[joint] = Quat::from_pose([
            0.2 * libm::sin(k + 1.0),
            0.08 * libm::cos(2.0 * k),
            0.03 * libm::sin(3.0 * k),
        ]);
        state.rates[joint] = Vec3::new(
            libm::cos(k),
            0.5 * libm::sin(2.0 * k),
            0.3 * libm::cos(3.0 * k),
        );
    }
    for _ in 0..4000 {
        plant.step_free(0.0);
    }
    let places: Vec<f64> = TABLE
        .lines()
        .filter(|line| line.starts_with(|first: char| first.is_ascii_digit()))
        .flat_map(|line| line.split(',').skip(1))
        .map(|number| number.parse().unwrap_or(f64::NAN))
        .collect();
    let points = plant.spine_points();
    let found = points.iter().flatten();
    let gap = if places.len() == 3 * points.len() {
        found
            .zip(&places)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, larger)
    } else {
        f64::NAN
    };
    Check::new(
        "P2 gap between the dry chain and MuJoCo's after 2 s",
        gap,
        1e-4,
        "m",
    )
}

/// Returns the larger of two figures; not a number when one is not.
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

/// P3: a locked eel answers a sudden force with a = F/(m + mₐ), mₐ from the integrals of ρπb²
/// (lateral), ρπa² (vertical) and nothing (along the body), done by hand for the bare outline.
pub fn p3() -> Check {
    let shape = Shape::default();
    let (nose, trunk, tail) = (
        shape.nose_m,
        shape.length_m - shape.nose_m - shape.tail_m,
        shape.tail_m,
    );
    // ∫ over the nose of 1 − (1 − x)² is 2/3; over the tail, of (p + (q − p) x)², (p² + pq + q²)/3.
    let added = |p: f64, q: f64| {
        1000.0 * PI * (p * p * (2.0 / 3.0 * nose + trunk) + (p * p + p * q + q * q) / 3.0 * tail)
    };
    let lateral = added(shape.vertical_m, shape.edge_vertical_m);
    let vertical = added(shape.lateral_m, shape.edge_lateral_m);
    let mass = Plant::new(&Config::bare(), 1).mass_kg();
    let axes = [
        (Vec3::new(1.0, 0.0, 0.0), mass + vertical),
        (Vec3::new(0.0, 1.0, 0.0), mass + lateral),
        (Vec3::new(0.0, 0.0, 1.0), mass),
    ];
    let error = |(axis, inertia): (Vec3, f64)| {
        let acceleration = sudden(axis, 2.0);
        (acceleration * inertia / 2.0 - 1.0).abs()
    };
    let worst = axes.map(error).into_iter().fold(0.0, larger);
    Check::new(
        "P3 error of F/(m + ma) of the locked eel, three axes",
        worst,
        1e-6,
        "1",
    )
}

/// Returns the acceleration along an axis that a force gives a locked eel at rest, m/s²; the force
/// acts where it turns nothing.
fn sudden(axis: Vec3, force_n: f64) -> f64 {
    let config = Config {
        locked: true,
        step_s: 1e-4,
        ..Config::bare()
    };
    let answer = |z: f64| {
        let mut plant = Plant::new(&config, 1);
        plant.set_pushes(&[Push {
            body: 0,
            point: Vec3::new(0.0, 0.0, z),
            force: axis * force_n,
        }]);
        plant.step(&[[Drive::Off; 3]; JOINTS]);
        let state = plant.state();
        let turn = state.spin.0[0].abs() + state.spin.0[1].abs();
        (state.velocity.dot(axis) / config.step_s, turn, state.spin)
    };
    // The turn is linear in the lever: two tries give the lever that turns nothing.
    let (at_zero, at_one) = (answer(0.0), answer(1.0));
    let change = at_one.2 - at_zero.2;
    let z = if change.norm() > 0.0 {
        -at_zero.2.dot(change) / change.dot(change)
    } else {
        0.0
    };
    answer(z).0
}

/// P4: a locked eel glides straight as U₀/(1 + k U₀ t), k from the wetted surface by a fine sum.
pub fn p4() -> Check {
    let config = Config {
        locked: true,
        ..Config::default()
    };
    let mut plant = Plant::new(&config, 1);
    let start = 1.0;
    plant.state_mut().velocity = Vec3::new(0.0, 0.0, -start);
    let slices = 30_000;
    let h = config.shape.length_m / f64::from(slices);
    let wetted: f64 = (0..slices)
        .map(|i| config.shape.half_axes((f64::from(i) + 0.5) * h))
        .map(|(a, b)| perimeter(a, b) * h)
        .sum();
    let k = 0.5 * 1000.0 * 0.008 * wetted / plant.mass_kg();
    let mut worst: f64 = 0.0;
    for _ in 0..20_000 {
        plant.step(&[[Drive::Off; 3]; JOINTS]);
        let expected = start / (1.0 + k * start * plant.time_s());
        worst = larger(worst, (-plant.state().velocity.0[2] / expected - 1.0).abs());
    }
    Check::new("P4 error of the straight glide over 10 s", worst, 5e-3, "1")
}

/// P5: the stride hardly depends on the frequency, 0.25 to 1.5 Hz: the spread over its mean.
pub fn p5() -> Check {
    let stride = |frequency_hz: f64| {
        let wave = Wave {
            frequency_hz,
            ..Wave::default()
        };
        let swim = reference_swim(&Config::default(), &wave, 30.0);
        swim.map_or(f64::NAN, |swim| swim.figures.stride_body_lengths)
    };
    let strides = [0.25, 0.5, 1.0, 1.5].map(stride);
    let most = strides.into_iter().fold(0.0, larger);
    let least = strides.into_iter().fold(f64::INFINITY, f64::min);
    let spread = (most - least) / (0.5 * (most + least));
    Check::new(
        "P5 spread of the stride over 0.25 to 1.5 Hz",
        spread,
        0.015,
        "1",
    )
}

/// P6: what the joints put in is what the water takes and the motion keeps, over a swim.
pub fn p6() -> Check {
    let (wave, tracking) = (
        Wave::default(),
        Tracking {
            inertia: 0.0,
            ..Tracking::default()
        },
    );
    let config = Config::default();
    let mut plant = Plant::new(&config, 1);
    let mut taken = 0.0;
    for _ in 0..12_000 {
        let targets = wave.targets(&config.shape, plant.time_s() + config.step_s);
        let before = plant.water_power_w();
        plant.step_tracking(&targets, &tracking);
        taken += 0.5 * (before + plant.water_power_w()) * config.step_s;
    }
    let put_in = plant.joint_energy_j();
    let error = (put_in - taken - plant.kinetic_energy_j()).abs() / put_in;
    Check::new("P6 energy balance of a swim of 6 s", error, 0.02, "1")
}

/// P7: halving the step and doubling the strips leaves the speed of the default swim.
pub fn p7() -> Check {
    let config = Config::default();
    let fine = Config {
        step_s: 0.25e-3,
        strips_per_body: 10,
        ..Config::default()
    };
    let speed = |config: &Config| {
        reference_swim(config, &Wave::default(), 9.0)
            .map_or(f64::NAN, |swim| swim.figures.speed_m_s)
    };
    let change = (speed(&fine) / speed(&config) - 1.0).abs();
    Check::new(
        "P7 change of speed with half the step, twice the strips",
        change,
        5e-3,
        "1",
    )
}

/// P8: the mirrored gait swims the mirrored path.
pub fn p8() -> Check {
    let path = |amplitude: f64| {
        let wave = Wave {
            amplitude_lengths: amplitude,
            ..Wave::default()
        };
        let mut plant = Plant::new(&Config::default(), 1);
        let mut points = Vec::new();
        for step in 0..8000 {
            let targets = wave.targets(
                &plant.config().shape,
                plant.time_s() + plant.config().step_s,
            );
            plant.step_tracking(&targets, &Tracking::default());
            if step % 100 == 0 {
                points.extend(plant.spine_points());
            }
        }
        points
    };
    let off = |(a, b): ([f64; 3], [f64; 3])| {
        (a[0] - b[0])
            .abs()
            .max((a[1] + b[1]).abs())
            .max((a[2] - b[2]).abs())
    };
    let worst = path(0.08)
        .into_iter()
        .zip(path(-0.08))
        .map(off)
        .fold(0.0, larger);
    Check::new(
        "P8 gap between the mirrored gait's path and the mirrored path",
        worst,
        1e-9,
        "m",
    )
}

/// P9: an eel at rest stays at rest for 60 s, bridges off, then shorted, then at no current.
pub fn p9() -> Check {
    let config = Config::default();
    let mut plant = Plant::new(&config, 1);
    let start = plant.spine_points();
    let counts: Vec<_> = (0..JOINTS)
        .map(|joint| plant.sample(joint).encoder_counts)
        .collect();
    let zero = Drive::Current(eel_vertebra::Setpoint::default());
    let mut worst: f64 = 0.0;
    for step in 0..120_000 {
        let drive = [Drive::Off, Drive::Brake, zero][step / 40_000];
        plant.step(&[[drive; 3]; JOINTS]);
        if step % 1000 == 0 {
            for (now, then) in plant.spine_points().iter().zip(&start) {
                worst = now
                    .iter()
                    .zip(then)
                    .map(|(a, b)| (a - b).abs())
                    .fold(worst, larger);
            }
        }
    }
    for (joint, counts) in counts.iter().enumerate() {
        if plant.sample(joint).encoder_counts != *counts {
            worst = f64::INFINITY;
        }
    }
    Check::new("P9 way of the eel at rest over 60 s", worst, 0.0, "m")
}

/// P10: a ballast of 0.5 kg pulls the eel down with 4.905 N.
pub fn p10() -> Check {
    let ballast = Ballast {
        mass_kg: 0.5,
        body: 5,
        position_m: [-0.03, 0.0, 0.05],
    };
    let config = Config {
        ballast: Some(ballast),
        ..Config::default()
    };
    let mut plant = Plant::new(&config, 1);
    plant.step(&[[Drive::Off; 3]; JOINTS]);
    let force = plant.momentum()[0] / plant.time_s();
    Check::new(
        "P10 error of the weight of 0.5 kg of ballast",
        (force + 4.905).abs(),
        1e-3,
        "N",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prints a check and demands that it passes.
    fn demand(check: &Check) {
        println!("{check:?}");
        assert!(check.passed, "{check:?}");
    }

    #[test]
    fn the_dry_free_chain_keeps_its_energy() {
        demand(&p1());
    }

    #[test]
    fn the_dry_chain_flies_as_mujocos_does() {
        demand(&p2());
    }

    #[test]
    fn a_sudden_force_meets_mass_and_added_mass() {
        demand(&p3());
    }

    #[test]
    fn a_straight_glide_slows_as_the_formula_says() {
        demand(&p4());
    }

    #[test]
    fn the_stride_hardly_depends_on_the_frequency() {
        demand(&p5());
    }

    #[test]
    fn the_energy_of_a_swim_adds_up() {
        demand(&p6());
    }

    #[test]
    fn step_and_strips_are_fine_enough() {
        demand(&p7());
    }

    #[test]
    fn a_mirrored_gait_swims_the_mirrored_path() {
        demand(&p8());
    }

    #[test]
    fn an_eel_at_rest_stays_at_rest() {
        demand(&p9());
    }

    #[test]
    fn a_ballast_weighs_what_it_weighs() {
        demand(&p10());
    }
}
