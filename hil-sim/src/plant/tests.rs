//! The plant as a whole: motors, stops, sensors and the promise of equal bits.

use eel_units::{Current, Voltage};
use eel_vertebra::{Drive, Setpoint};

use super::algebra::{Quat, Vec3};
use super::body::JOINTS;
use super::chain::Push;
use super::gait::Wave;
use super::joint::Tracking;
use super::{Config, Plant};

/// Every bridge of the eel at one drive.
fn everywhere(drive: Drive) -> [[Drive; 3]; JOINTS] {
    [[drive; 3]; JOINTS]
}

/// Holds a current, A, at no back-EMF.
fn amps(current: f64) -> Drive {
    Drive::Current(Setpoint {
        current: Current::from_microamps((current * 1e6) as i32),
        emf: Voltage::from_millivolts(0),
    })
}

/// Drives motors back and forth, differently at every joint.
fn wriggle(plant: &mut Plant, steps: usize) {
    for step in 0..steps {
        let duty = |joint: usize, motor: usize| {
            let phase = step as f64 * 0.01 + joint as f64 - motor as f64 * 0.3;
            amps(0.75 * libm::sin(phase))
        };
        plant.step(&std::array::from_fn(|joint| {
            std::array::from_fn(|motor| duty(joint, motor))
        }));
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_in_every_profile() {
    let mut plant = Plant::new(&Config::default(), 7);
    wriggle(&mut plant, 2000);
    let mut again = Plant::new(&Config::default(), 7);
    wriggle(&mut again, 2000);
    assert_eq!(plant.fingerprint(), again.fingerprint());
    for joint in 0..JOINTS {
        assert_eq!(plant.sample(joint), again.sample(joint));
    }
    // Pinned: debug and release, and every machine, must come to this. It changes with the model.
    assert_eq!(plant.fingerprint(), 0x1c9a_7bb0_fdef_c479);
}

#[test]
fn another_seed_starts_the_encoders_elsewhere_and_moves_nothing() {
    let (mut one, mut other) = (
        Plant::new(&Config::default(), 1),
        Plant::new(&Config::default(), 2),
    );
    wriggle(&mut one, 200);
    wriggle(&mut other, 200);
    assert_eq!(one.fingerprint(), other.fingerprint());
    for joint in 0..JOINTS {
        assert_ne!(
            one.sample(joint).encoder_counts,
            other.sample(joint).encoder_counts
        );
    }
}

#[test]
fn encoders_count_what_the_motors_turn() {
    let mut plant = Plant::new(&Config::default(), 3);
    let start: Vec<_> = (0..JOINTS).map(|joint| plant.sample(joint)).collect();
    let angles: Vec<_> = (0..JOINTS).map(|joint| plant.motor_angle(joint)).collect();
    wriggle(&mut plant, 300);
    let mut moved = 0.0_f64;
    for joint in 0..JOINTS {
        let (sample, now) = (plant.sample(joint), plant.motor_angle(joint));
        for motor in 0..3 {
            let turned = now[motor] - angles[joint][motor];
            moved = moved.max(turned.abs());
            let counts = sample.encoder_counts[motor] - start[joint].encoder_counts[motor];
            let expected = turned * 88_064.0 / std::f64::consts::TAU;
            assert!(
                (f64::from(counts) - expected).abs() <= 1.0,
                "{counts} {expected}"
            );
            let absolute = sample.absolute[motor].unwrap().to_q29();
            let error = f64::from(absolute) / f64::from(1 << 29) - now[motor];
            // One step of rounding down, one of noise.
            assert!(
                error.abs() <= 2.001 * std::f64::consts::TAU / 16_384.0,
                "{error}"
            );
        }
    }
    assert!(moved > 0.05, "{moved} rad");
}

#[test]
fn the_measured_current_is_the_mean_since_the_last_sample() {
    let mut plant = Plant::new(&Config::default(), 4);
    let mut measure = |halves: [f64; 2]| {
        for amps_wanted in halves {
            // Long enough for the loop's milliseconds not to count.
            for _ in 0..200 {
                plant.step(&everywhere(amps(amps_wanted)));
            }
        }
        plant.sample(5).current
    };
    for halves in [[0.3, 0.3], [0.5, 0.1], [0.1, 0.5], [-0.4, 0.2]] {
        let mean = 0.5 * (halves[0] + halves[1]);
        for measured in measure(halves) {
            let error = f64::from(measured.to_microamps()) * 1e-6 - mean;
            assert!(error.abs() <= 0.012, "{error} A of {mean} A");
        }
    }
}

#[test]
fn stops_hold_a_joint_that_its_motors_push_against_them() {
    let config = Config {
        water: None,
        gravity_m_s2: 0.0,
        ..Config::default()
    };
    let mut plant = Plant::new(&config, 5);
    let mut drives = everywhere(Drive::Brake);
    let push = amps(2.0);
    drives[4] = [push, push, Drive::Brake];
    for _ in 0..4000 {
        plant.step(&drives);
    }
    let [yaw, pitch, roll] = plant.joint_pose(4);
    let beyond = yaw - config.stops_rad[0];
    // 2 · k i against 2000 N·m/rad.
    let expected = 2.0 * 1.488 * 2.0 / 2000.0;
    assert!(
        (beyond - expected).abs() < 0.2 * expected,
        "{beyond} {expected}"
    );
    // Away from home equal torques also pitch the joint: those stops hold too.
    assert!(pitch.abs() < config.stops_rad[1] + 0.005, "{pitch}");
    assert!(roll.abs() < config.stops_rad[2] + 0.005, "{roll}");
    assert!(plant.joint_rate(4)[0].abs() < 0.01);
}

#[test]
fn brakes_hold_better_than_open_bridges() {
    let bend = |drive: Drive| {
        let mut plant = Plant::new(&Config::default(), 6);
        let force = Vec3::new(0.0, 3.0, 0.0);
        plant.set_pushes(&[Push {
            body: 10,
            point: Vec3::new(0.0, 0.0, 0.3),
            force,
        }]);
        for _ in 0..1000 {
            plant.step(&everywhere(drive));
        }
        (0..JOINTS)
            .map(|joint| plant.joint_pose(joint)[0].abs())
            .fold(0.0, f64::max)
    };
    let (braked, open) = (bend(Drive::Brake), bend(Drive::Off));
    assert!(open > 2.0 * braked && braked > 0.0, "{open} {braked}");
}

#[test]
fn a_stream_carries_a_passive_eel() {
    let mut config = Config::default();
    let stream = [0.0, 0.1, 0.2];
    if let Some(water) = &mut config.water {
        water.stream_m_s = stream;
    }
    let mut plant = Plant::new(&config, 1);
    for _ in 0..2000 {
        plant.step(&everywhere(Drive::Off));
    }
    for (place, speed) in plant.nose().into_iter().zip(stream) {
        assert!((place - speed * plant.time_s()).abs() < 1e-9);
    }
    assert_eq!(plant.bodies()[7].velocity, stream);
}

#[test]
fn a_low_centre_of_mass_rights_the_eel() {
    let mut plant = Plant::new(&Config::default(), 1);
    plant.state_mut().attitude = Quat::from_pose([0.0, 0.0, 0.5]);
    for _ in 0..60_000 {
        plant.step(&everywhere(Drive::Brake));
    }
    // Up of the head in the world: its x axis.
    let up = plant.bodies()[0].rotation[0][0];
    assert!(up > libm::cos(0.1), "{up}");
}

#[test]
fn the_supply_sags_under_load() {
    let mut plant = Plant::new(&Config::default(), 1);
    assert_eq!(plant.sample(0).supply.to_millivolts(), 24_000);
    for _ in 0..20 {
        plant.step(&everywhere(amps(1.0)));
    }
    let sagged = plant.sample(0).supply.to_millivolts();
    assert!((23_000..23_990).contains(&sagged), "{sagged} mV");
}

#[test]
fn fins_and_a_low_centre_of_mass_keep_a_disturbed_swim_level() {
    let tilt = |config: &Config| {
        let mut plant = Plant::new(config, 1);
        let (wave, tracking) = (Wave::default(), Tracking::default());
        let mut worst: f64 = 0.0;
        for step in 0..56_000 {
            let mut targets = wave.targets(&config.shape, plant.time_s() + config.step_s);
            if step < 2000 {
                targets[3].pose[1] = 1e-3;
            }
            plant.step_tracking(&targets, &tracking);
            if step % 100 == 0 {
                // How far the head points up or down.
                worst = worst.max(plant.bodies()[0].rotation[0][2].abs());
            }
        }
        worst
    };
    let (level, bare) = (tilt(&Config::default()), tilt(&Config::bare()));
    assert!(level < 0.02, "{level}");
    assert!(bare > 0.1, "{bare}");
}
