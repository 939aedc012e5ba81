//! Margins: one at home, zero where det A or D vanishes, continuous on the way.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use core::f64::consts::FRAC_PI_4;

use common::{ARCHITECTURES, Random};
use eel_kinematics::design::{self, Geometry, Margins, Matrix3, Travel};

/// Every margin that is smooth in the configuration.
fn smooth(margins: &Margins) -> [f64; 7] {
    let [a, b, c] = margins.serial;
    let [d, e] = margins.depths;
    [a, b, c, margins.parallel, d, e, margins.least_singular]
}

#[test]
fn margins_are_one_at_home_also_of_a_unit_that_errs() {
    let mut random = Random::new(0x3A26_1400_0000_0001);
    for ideal in ARCHITECTURES {
        let mut unit = ideal;
        for leg in &mut unit.legs {
            leg.crank *= 1.0 + 0.02 * random.sign();
            leg.rod *= 1.0 + 0.02 * random.sign();
        }
        for geometry in [ideal, unit] {
            let rotation = design::rotation(0.0, 0.0, 0.0);
            let theta = geometry.inverse(&rotation).unwrap();
            let margins = geometry.margins(&rotation, &theta).unwrap();
            for margin in &smooth(&margins)[..6] {
                assert!((margin - 1.0).abs() < 1e-12, "{margins:?}");
            }
            assert!((margins.least() - 1.0).abs() < 1e-12);
            assert!((margins.legs() - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn margins_change_no_faster_than_the_configuration() {
    // Random paths of the motors, each followed in each assembly mode, through serial singularities
    // and up to parallel ones.
    const SLOPE: f64 = 2.0;
    let mut random = Random::new(0x3A26_1400_0000_0002);
    let (mut steepest, mut crossed, mut near) = (0.0f64, 0u32, 0u32);
    for geometry in ARCHITECTURES {
        for _ in 0..60 {
            let (from, way) = (random.vector(0.4), random.vector(1.5));
            let at = |step: u32| {
                let share = f64::from(step) / 4_000.0;
                [0, 1, 2].map(|k| from[k] + way[k] * share + if k == 2 { FRAC_PI_4 } else { 0.0 })
            };
            for mode in design::AssemblyMode::ALL {
                let mut before: Option<(Matrix3<f64>, [f64; 3], Margins)> = None;
                for step in 0..=4_000 {
                    let theta = at(step);
                    let Some(rotation) = geometry.direct_in(mode, &theta) else {
                        near += u32::from(before.is_some_and(|(.., m)| m.parallel.abs() < 0.05));
                        before = None;
                        continue;
                    };
                    let margins = geometry.margins(&rotation, &theta).unwrap();
                    if let Some((old, joints, margins_before)) = before {
                        let moved = (rotation - old).norm()
                            + (0..3)
                                .map(|k| (theta[k] - joints[k]).abs())
                                .fold(0.0, f64::max);
                        let (new, was) = (smooth(&margins), smooth(&margins_before));
                        for k in 0..7 {
                            steepest = steepest.max((new[k] - was[k]).abs() / moved);
                        }
                        let is_crossed = |k: usize| new[k] * was[k] < -1e-12;
                        crossed += u32::from(is_crossed(0) || is_crossed(1));
                    }
                    before = Some((rotation, theta, margins));
                }
            }
        }
    }
    println!("steepest {steepest:.2}, serial singularities crossed {crossed}, parallel met {near}");
    assert!(steepest < SLOPE, "{steepest}");
    assert!(crossed > 20 && near > 20, "{crossed} {near}");
}

#[test]
fn the_least_margin_is_continuous_over_poses_across_the_end_of_reach() {
    // At the end of reach margins fall like the root of the distance, so a step may change them by
    // a multiple of its root: a sixteenth of the step, a quarter of the change.
    const CONSTANT: f64 = 4.0;
    let mut random = Random::new(0x3A26_1400_0000_0003);
    let (mut largest, mut left) = ([0.0f64; 2], 0u32);
    for geometry in ARCHITECTURES {
        for _ in 0..100 {
            let end = random.vector(1.2);
            let margin = |share: f64| {
                let [yaw, pitch, roll] = end.map(|angle| angle * share);
                let rotation = design::rotation(yaw, pitch, roll);
                geometry.least_margin(&rotation).unwrap()
            };
            for (index, steps) in [500u32, 8_000].into_iter().enumerate() {
                let mut before = margin(0.0);
                for step in 1..=steps {
                    let here = margin(f64::from(step) / f64::from(steps));
                    largest[index] =
                        largest[index].max((here - before).abs() * f64::from(steps).sqrt());
                    left += u32::from(before > 0.0 && here <= 0.0);
                    before = here;
                }
            }
        }
    }
    println!("largest change over the root of the step {largest:.2?}, borders crossed {left}");
    assert!(
        largest.iter().all(|one| *one < CONSTANT) && left > 50,
        "{largest:?} {left}"
    );
}

#[test]
fn serial_margins_vanish_where_the_discriminant_does() {
    let mut random = Random::new(0x3A26_1400_0000_0004);
    let mut found = 0;
    for geometry in ARCHITECTURES {
        for _ in 0..500 {
            let end = random.vector(1.6);
            let at = |share: f64| {
                let [yaw, pitch, roll] = end.map(|angle| angle * share);
                design::rotation(yaw, pitch, roll)
            };
            if geometry.inverse(&at(1.0)).is_some() {
                continue;
            }
            // The last orientation in reach, to the last bit.
            let (mut low, mut high) = (0.0f64, 1.0);
            while (low + high) / 2.0 > low && (low + high) / 2.0 < high {
                let middle = (low + high) / 2.0;
                if geometry.inverse(&at(middle)).is_some() {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let rotation = at(low);
            let theta = geometry.inverse(&rotation).unwrap();
            let margins = geometry.margins(&rotation, &theta).unwrap();
            assert!(margins.legs().abs() < 1e-7, "{margins:?}");
            let reach = geometry.reach(&rotation);
            assert!(reach[0].min(reach[1]).abs() < 1e-14);
            assert!(geometry.least_margin(&at(high)).unwrap() < 1e-7);
            found += 1;
        }
    }
    println!("{found} ends of reach");
    assert!(found > 100);
}

#[test]
fn reach_is_the_square_of_b_and_margins_have_the_signs_of_their_factors() {
    let mut random = Random::new(0x3A26_1400_0000_0005);
    for geometry in ARCHITECTURES.map(|geometry| geometry.scaled(0.21).unwrap()) {
        for _ in 0..3_000 {
            let [yaw, pitch, roll] = random.vector(1.2);
            let rotation = design::rotation(yaw, pitch, roll);
            let reach = geometry.reach(&rotation);
            for theta in geometry.inverse_all(&rotation).into_iter().flatten() {
                let jacobians = geometry.jacobians(&rotation, &theta);
                let margins = geometry.margins(&rotation, &theta).unwrap();
                for (leg, square) in reach.into_iter().enumerate() {
                    assert!((jacobians.b[leg] * jacobians.b[leg] - square).abs() < 1e-12);
                    assert_eq!(margins.serial[leg] > 0.0, jacobians.b[leg] > 0.0);
                }
                assert_eq!(margins.parallel > 0.0, jacobians.det_a() > 0.0);
                let [first, second] = margins.depths;
                assert!((margins.parallel - first * second).abs() < 1e-9);
                // The volume is at most the least singular value times the two others.
                assert!(margins.least_singular <= 1.6 && margins.least_singular >= 0.0);
                let least = margins.least();
                assert!(least <= margins.serial[2] && least <= margins.legs());
                assert!(least <= 0.0 || least <= margins.parallel);
            }
        }
    }
}

#[test]
fn at_a_parallel_singularity_both_parallel_measures_vanish() {
    // Two direct solutions meet where the motors can just be joined: there det A = 0.
    let mut random = Random::new(0x3A26_1400_0000_0006);
    let mut factors = [0u32; 2];
    for geometry in ARCHITECTURES {
        for _ in 0..300 {
            let way = random.vector(2.5);
            let theta = |share: f64| {
                [0, 1, 2].map(|k| way[k] * share + if k == 2 { FRAC_PI_4 } else { 0.0 })
            };
            let at = |share: f64| geometry.direct_in(design::AssemblyMode::HOME, &theta(share));
            let (mut low, mut high) = (0.0f64, 1.0);
            if at(high).is_some() {
                continue;
            }
            while (low + high) / 2.0 > low && (low + high) / 2.0 < high {
                let middle = (low + high) / 2.0;
                if at(middle).is_some() {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let margins = geometry.margins(&at(low).unwrap(), &theta(low)).unwrap();
            assert!(margins.parallel.abs() < 1e-6, "{margins:?}");
            assert!(margins.least_singular < 1e-6, "{margins:?}");
            let [first, second] = margins.depths.map(f64::abs);
            assert!(first.min(second) < 1e-6, "{margins:?}");
            factors[usize::from(second < first)] += 1;
        }
    }
    println!("det A vanished by leg 1 and by leg 2: {factors:?}");
    assert!(factors.iter().all(|count| *count > 10), "{factors:?}");
}

#[test]
fn the_box_of_the_paper_may_grow_before_it_meets_a_singularity() {
    for (geometry, wanted) in ARCHITECTURES.into_iter().zip([1.9198, 2.1353, 1.2581]) {
        let factor = geometry.largest_box(&Travel::PAPER);
        assert!((factor - wanted).abs() < 1e-4, "{factor}");
        let scaled = geometry.scaled(0.03).unwrap();
        assert!((scaled.largest_box(&Travel::PAPER) - factor).abs() < 1e-9);
    }
    let mut broken = Geometry::PARALLEL_ACTUATORS;
    broken.legs[0].rod = 0.1;
    assert_eq!(broken.largest_box(&Travel::PAPER), 0.0);
    assert_eq!(broken.least_margin(&design::rotation(0.0, 0.0, 0.0)), None);
}
