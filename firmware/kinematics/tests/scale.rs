//! Scale and travel: a mechanism of another size turns by the same angles, within its limits.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use common::{ARCHITECTURES, Random};
use eel_kinematics::Side;
use eel_kinematics::design::{self, Coordinate, Geometry, Matrix3, Range, Travel, WorkingMode};

#[test]
fn angles_margins_and_conditions_do_not_depend_on_the_scale() {
    let mut random = Random::new(0x5CA1_E000_0000_0001);
    for unit in ARCHITECTURES {
        for arm in [0.01, 0.03, 1.0, 47.0] {
            let scaled = unit.scaled(arm).unwrap();
            assert_eq!(scaled.arm, arm);
            for _ in 0..500 {
                let [yaw, pitch, roll] = random.pose(1.2);
                let rotation = design::rotation(yaw, pitch, roll);
                let (all, of_scaled) = (unit.inverse_all(&rotation), scaled.inverse_all(&rotation));
                for (theta, other) in all.unwrap().iter().zip(&of_scaled.unwrap()) {
                    for k in 0..3 {
                        assert!((theta[k] - other[k]).abs() < 1e-12);
                    }
                }
                let theta = unit.inverse(&rotation).unwrap();
                let back = scaled.direct(&theta).unwrap();
                assert!((back - rotation).amax() < 1e-12);
                let (one, other) = (
                    unit.jacobians(&rotation, &theta),
                    scaled.jacobians(&rotation, &theta),
                );
                assert!((one.a - other.a).amax() < 1e-12 && (one.b - other.b).amax() < 1e-12);
                assert!((one.condition() - other.condition()).abs() < 1e-11);
                let margins = [&unit, &scaled].map(|g| g.margins(&rotation, &theta).unwrap());
                assert!((margins[0].least() - margins[1].least()).abs() < 1e-12);
            }
        }
    }
    for arm in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(Geometry::PARALLEL_ACTUATORS.scaled(arm), None);
    }
}

#[test]
fn with_units_rows_one_and_two_are_areas_and_the_maps_stay() {
    let geometry = Geometry::PARALLEL_ACTUATORS.scaled(0.03).unwrap();
    let rotation = design::rotation(0.3, -0.1, 0.05);
    let theta = geometry.inverse(&rotation).unwrap();
    let jacobians = geometry.jacobians(&rotation, &theta);
    let metres = jacobians.scaled(geometry.arm);
    for (k, leg) in geometry.legs.iter().enumerate() {
        let (c, end) = (geometry.point(&rotation, k), leg.end(theta[k]));
        let (l, r) = (end - leg.center, c - end);
        assert!((metres.a.row(k).transpose() - c.cross(&r)).amax() < 1e-16);
        assert!((metres.b[k] - l.cross(&r).dot(&leg.axis)).abs() < 1e-16);
    }
    assert_eq!(metres.a.row(2), jacobians.a.row(2));
    let maps = [jacobians, metres].map(|j| [j.rate_map(), j.torque_map().unwrap()]);
    assert!((maps[0][0] - maps[1][0]).amax() < 1e-12);
    assert!((maps[0][1] - maps[1][1]).amax() < 1e-12);
}

#[test]
fn the_rate_map_is_the_slope_of_the_inverse_in_every_working_mode() {
    let mut random = Random::new(0x5CA1_E000_0000_0002);
    let step = 1e-5;
    let mut worst = 0.0f64;
    for geometry in ARCHITECTURES.map(|geometry| geometry.scaled(0.03).unwrap()) {
        for _ in 0..300 {
            let [yaw, pitch, roll] = random.pose(1.0);
            let rotation = design::rotation(yaw, pitch, roll);
            for mode in WorkingMode::ALL {
                let theta = geometry.inverse_in(mode, &rotation).unwrap();
                let jacobians = geometry.jacobians(&rotation, &theta);
                let map = jacobians.rate_map();
                for axis in 0..3 {
                    let at = |angle: f64| {
                        let (s, c) = (angle.sin(), angle.cos());
                        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
                        let mut turn = Matrix3::identity();
                        (turn[(j, j)], turn[(k, k)]) = (c, c);
                        (turn[(k, j)], turn[(j, k)]) = (s, -s);
                        geometry.inverse_in(mode, &(turn * rotation)).unwrap()
                    };
                    let (more, less) = (at(step), at(-step));
                    for motor in 0..3 {
                        let slope = (more[motor] - less[motor]) / (2.0 * step);
                        worst = worst.max((map[(motor, axis)] - slope).abs());
                    }
                }
                // The other maps are its inverse, and their transposes; near a singularity of A, which
                // other working modes come to, roundings grow with the condition.
                let most = 1e-13 * jacobians.condition_of_rates();
                let one = jacobians.velocity_map().unwrap() * map;
                let torque = jacobians.torque_map().unwrap() * jacobians.moment_map().unwrap();
                assert!((one - Matrix3::identity()).amax() < most);
                assert!((torque - Matrix3::identity()).amax() < most);
            }
        }
    }
    println!("rate map against finite differences: {worst:.1e}");
    assert!(worst < 1e-7, "{worst:e}");
}

#[test]
fn a_unit_in_metres_has_the_same_kernel() {
    let wanted = Geometry::PARALLEL_ACTUATORS.kernel();
    assert!(wanted.is_some());
    // A power of two leaves every quotient exact.
    let scaled = Geometry::PARALLEL_ACTUATORS.scaled(1.0 / 32.0).unwrap();
    assert_eq!(scaled.kernel(), wanted);
    assert!(
        Geometry::PARALLEL_ACTUATORS
            .scaled(0.03)
            .unwrap()
            .kernel()
            .is_some()
    );
    // What is taken for an arm of 1 is out of tolerance.
    let forgotten = Geometry { arm: 1.0, ..scaled };
    assert_eq!(forgotten.kernel(), None);
}

#[test]
fn the_motors_ranges_are_what_the_paper_s_box_needs_to_the_next_degree() {
    for geometry in ARCHITECTURES {
        let mut needed = [Range::from_degrees(360.0, -360.0); 3];
        let steps = 24;
        let share = |k: i32| f64::from(k) / f64::from(steps);
        for (i, j, k) in (0..=steps)
            .flat_map(|i| (0..=steps).flat_map(move |j| (0..=steps).map(move |k| (i, j, k))))
        {
            let [yaw, pitch, roll] = Travel::PAPER;
            let pose = [yaw.at(share(i)), pitch.at(share(j)), roll.at(share(k))];
            let rotation = design::rotation(pose[0], pose[1], pose[2]);
            let theta = geometry.inverse(&rotation).unwrap();
            for (range, angle) in needed.iter_mut().zip(theta) {
                range.low = range.low.min(angle);
                range.high = range.high.max(angle);
            }
            // Rounding may put the box's own faces beyond themselves.
            let limit = geometry.travel.nearest(&rotation, &theta);
            assert!(limit.room > -1e-12, "{limit:?}");
        }
        for (range, needed) in geometry.travel.motors.iter().zip(needed) {
            assert!(range.low <= needed.low && range.high >= needed.high);
            let whole = |angle: f64| (angle.to_degrees() - angle.to_degrees().round()).abs() < 1e-9;
            assert!(whole(range.low) && whole(range.high));
            let slack = [needed.low - range.low, range.high - needed.high];
            assert!(slack.iter().all(|s| s.to_degrees() < 1.0), "{slack:?}");
        }
    }
}

#[test]
fn a_configuration_names_the_limit_that_it_passes() {
    let geometry = Geometry::PARALLEL_ACTUATORS;
    let ask = |pose: [f64; 3]| {
        let rotation = design::rotation(pose[0], pose[1], pose[2]);
        let theta = geometry.inverse(&rotation).unwrap();
        assert_eq!(
            geometry.is_within_travel(&rotation, &theta),
            !geometry.travel.nearest(&rotation, &theta).is_passed()
        );
        geometry.travel.nearest(&rotation, &theta)
    };
    let home = ask([0.0; 3]);
    assert_eq!(home.coordinate, Coordinate::Roll);
    assert!((home.room.to_degrees() - 4.0).abs() < 1e-9 && !home.is_passed());
    let yaw = ask([-0.6, 0.0, 0.0]);
    assert_eq!((yaw.coordinate, yaw.side), (Coordinate::Yaw, Side::Low));
    assert!((yaw.room - (30f64.to_radians() - 0.6)).abs() < 1e-12 && yaw.is_passed());
    let pitch = ask([0.0, 0.3, 0.0]);
    assert_eq!(
        (pitch.coordinate, pitch.side),
        (Coordinate::Pitch, Side::High)
    );
    assert!(pitch.is_passed());
    // In another working mode the pose is allowed and the motor is not.
    let rotation = design::rotation(0.0, 0.0, 0.0);
    let far = geometry
        .inverse_in(WorkingMode::MinusPlus, &rotation)
        .unwrap();
    let limit = geometry.travel.nearest(&rotation, &far);
    assert_eq!(
        (limit.coordinate, limit.side),
        (Coordinate::Motor1, Side::High)
    );
    assert_eq!(limit.coordinate.name(), "motor 1");
    assert!(!geometry.is_within_travel(&rotation, &far));
    assert!(!geometry.is_within_travel(&rotation, &[f64::NAN, 0.0, 0.785]));
}
