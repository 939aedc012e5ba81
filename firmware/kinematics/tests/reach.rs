//! The nearest reachable pose, against a random search that knows nothing of how it was found.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use common::{Q30, Random, exact_rotation, pose_of, radians};
use eel_kinematics::design::Geometry;
use eel_kinematics::{Nearest, Obstacle, Pose, PoseError, Reach, Search, Wrist};
use eel_units::Angle;

fn angles(pose: &Pose) -> [f64; 3] {
    [pose.yaw, pose.pitch, pose.roll].map(radians)
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let squares: f64 = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum();
    squares.sqrt()
}

/// Tells whether the wrist may go there: the box, and the inverse with its margin.
fn is_allowed(wrist: &Wrist, reach: &Reach, pose: &[f64; 3]) -> bool {
    let range = angles(&reach.range);
    let inside = (0..3).all(|k| pose[k].abs() <= range[k]);
    let found = wrist.inverse(&pose_of(*pose));
    inside && found.is_ok_and(|inverse| inverse.margin() >= reach.margin)
}

/// The least distance that a random search finds: from many starts, with shrinking steps.
fn search(wrist: &Wrist, reach: &Reach, target: &[f64; 3], random: &mut Random) -> f64 {
    let range = angles(&reach.range);
    let mut best = f64::INFINITY;
    for start in 0..6 {
        let mut at = match start {
            0 => [0.0; 3],
            _ => [0, 1, 2].map(|k| range[k] * random.sign()),
        };
        if !is_allowed(wrist, reach, &at) {
            continue;
        }
        let mut step = 0.5;
        let mut last = distance(&at, target);
        while step > 1e-5 {
            let mut moved = false;
            for _ in 0..40 {
                let tried = [0, 1, 2].map(|k| {
                    let pulled = at[k] + (target[k] - at[k]) * step * 0.5;
                    pulled + step * random.sign()
                });
                if distance(&tried, target) < last && is_allowed(wrist, reach, &tried) {
                    last = distance(&tried, target);
                    at = tried;
                    moved = true;
                }
            }
            if !moved {
                step *= 0.7;
            }
        }
        best = best.min(last);
    }
    best
}

/// What is allowed, at random: a box about the paper's or the kernel's own, a margin.
fn some_reach(random: &mut Random) -> Reach {
    let margin = ((0.25 + 0.2 * random.sign().abs()) * Q30) as i32;
    if random.next().is_multiple_of(3) {
        return Reach {
            margin,
            ..Reach::kernel()
        };
    }
    let scale = 1.3 + 0.3 * random.sign();
    Reach {
        range: pose_of(common::WORKSPACE.map(|limit| limit * scale)),
        margin,
    }
}

#[test]
fn comes_as_near_as_a_search_does() {
    let mut random = Random::new(0x4EAC_4000_0000_0001);
    let (mut cases, mut worst) = (0, [0.0f64; 3]);
    let mut obstacles = [0; 3];
    while cases < 1_500 || obstacles.iter().any(|&count| count < 20) {
        let geometry = if cases % 3 == 0 {
            Geometry::PARALLEL_ACTUATORS
        } else {
            common::within_tolerance(&mut random)
        };
        let wrist = geometry.kernel().unwrap();
        let reach = some_reach(&mut random);
        // The kernel's range, farther away, and the box that is allowed.
        let is_far = cases % 5 == 0;
        let size = if is_far {
            [2.0, 2.0, 2.0]
        } else if cases < 700 {
            [0.9, 0.55, 0.3]
        } else {
            angles(&reach.range)
        };
        let target = pose_of(size.map(|limit| limit * random.sign()));
        let Nearest {
            pose,
            inverse,
            obstacle,
        } = wrist.nearest(&target, &reach).unwrap();
        assert!(
            is_allowed(&wrist, &reach, &angles(&pose)),
            "{target:?} {pose:?}"
        );
        assert_eq!(wrist.inverse(&pose), Ok(inverse));
        let exact = geometry.inverse(&exact_rotation(&pose)).unwrap();
        assert!((radians(inverse.joints.0[0]) - exact[0]).abs() < 1e-7);
        let Some(obstacle) = obstacle else {
            assert_eq!(pose, target);
            continue;
        };
        cases += 1;
        obstacles[obstacle as usize] += 1;
        let wanted = angles(&target);
        let found = distance(&angles(&pose), &wanted);
        let least = search(&wrist, &reach, &wanted, &mut random);
        // A box about the paper's, all that the kernel reaches, a target far beyond that.
        let (kind, allowance) = match (is_far, reach.range == Reach::kernel().range) {
            (true, _) => (2, 1.2),
            (false, true) => (1, 1.1),
            (false, false) => (0, 1.01),
        };
        assert!(
            found <= least * allowance + 1e-3,
            "{target:?}: {found} instead of {least}, {obstacle:?}, {reach:?}"
        );
        worst[kind] = worst[kind].max((found - 1e-3) / least);
    }
    println!(
        "{cases} targets, times as far as the search, less 1 mrad: {worst:.4?}; {obstacles:?}"
    );
}

#[test]
fn what_is_allowed_comes_back_unchanged() {
    let mut random = Random::new(0x4EAC_4000_0000_0002);
    let reach = Reach::kernel();
    for _ in 0..20_000 {
        let pose = pose_of(random.pose(1.0));
        let nearest = Wrist::PAPER.nearest(&pose, &reach).unwrap();
        assert_eq!((nearest.pose, nearest.obstacle), (pose, None));
    }
}

#[test]
fn says_what_is_in_the_way() {
    let wrist = Wrist::PAPER;
    let reach = Reach {
        range: pose_of(common::WORKSPACE.map(|limit| 1.4 * limit)),
        margin: (0.8 * Q30) as i32,
    };
    let obstacle = |angles| {
        let nearest = wrist.nearest(&pose_of(angles), &reach);
        nearest.unwrap().obstacle
    };
    assert_eq!(obstacle([0.8, 0.0, 0.0]), Some(Obstacle::Range));
    assert_eq!(obstacle([0.7, 0.36, 0.09]), Some(Obstacle::OutOfReach));
    assert_eq!(obstacle([0.45, -0.2, 0.05]), Some(Obstacle::Singular));
    assert_eq!(obstacle([0.2, 0.1, 0.02]), None);
}

#[test]
fn a_margin_that_home_does_not_have_is_refused() {
    let reach = Reach {
        margin: i32::MAX,
        ..Reach::kernel()
    };
    let found = Wrist::PAPER.nearest(&pose_of([0.1, 0.0, 0.0]), &reach);
    assert_eq!(found, Err(PoseError::Singular));
}

#[test]
fn every_input_is_survived() {
    let mut random = Random::new(0x4EAC_4000_0000_0003);
    let mut angle = || match random.next() % 4 {
        0 => Angle::from_q29([i32::MIN, i32::MAX, 0, -1][(random.next() % 4) as usize]),
        1 => Angle::from_q29(random.bits()),
        _ => Angle::from_q29(random.bits() >> (random.next() % 6)),
    };
    let mut answers = 0;
    let mut units = Random::new(0x4EAC_4000_0000_0004);
    let mut wrist = Wrist::PAPER;
    for round in 0..20_000 {
        if round % 50 == 49 {
            let geometry = common::within_tolerance(&mut units);
            wrist = geometry.kernel().unwrap();
        }
        let [yaw, pitch, roll] = [angle(), angle(), angle()];
        let target = Pose { yaw, pitch, roll };
        let [yaw, pitch, roll] = [angle(), angle(), angle()];
        let reach = Reach {
            range: Pose { yaw, pitch, roll },
            margin: angle().to_q29(),
        };
        if let Ok(nearest) = wrist.nearest(&target, &reach) {
            answers += 1;
            assert!(wrist.inverse(&nearest.pose) == Ok(nearest.inverse));
            assert!(nearest.inverse.margin() >= reach.margin);
            let inside = |angle: Angle, range: Angle| angle.abs() <= range.max(Angle::ZERO);
            let (pose, range) = (&nearest.pose, &reach.range);
            assert!(inside(pose.yaw, range.yaw) && inside(pose.pitch, range.pitch));
            assert!(inside(pose.roll, range.roll));
        }
    }
    assert!(answers > 1_000, "{answers}");
}

/// Searches to the end.
fn finish(search: &mut Search, wrist: &Wrist) -> Pose {
    let mut pieces = 0;
    while search.advance(wrist) {
        pieces += 1;
        assert!(pieces < 1_000, "a search without an end");
    }
    search.best().expect("home is allowed")
}

#[test]
fn a_search_that_goes_on_from_a_target_near_by_comes_as_near_as_a_new_one() {
    let mut random = Random::new(0x4EAC_4000_0000_0003);
    let (wrist, reach) = (Wrist::PAPER, Reach::kernel());
    let mut cases = 0;
    while cases < 300 {
        let one = [1.4, 0.9, 0.6].map(|limit| limit * random.sign());
        let other = one.map(|angle| angle + 0.02 * random.sign());
        let (one, other) = (pose_of(one), pose_of(other));
        if [one, other]
            .iter()
            .any(|it| is_allowed(&wrist, &reach, &angles(it)))
        {
            continue;
        }
        cases += 1;
        let mut search = Search::new(&one, &reach);
        finish(&mut search, &wrist);
        search.retarget(&other);
        assert_eq!(search.target(), other);
        assert!(
            search.best().is_some(),
            "what was found stays until there is better"
        );
        let again = finish(&mut search, &wrist);
        assert!(is_allowed(&wrist, &reach, &angles(&again)), "{other:?}");
        let fresh = finish(&mut Search::new(&other, &reach), &wrist);
        let far = |pose: &Pose| distance(&angles(pose), &angles(&other));
        assert!(
            far(&again) <= far(&fresh) * 1.2 + 1e-2,
            "{other:?}: {} instead of {}",
            far(&again),
            far(&fresh)
        );
    }
}

#[test]
fn a_search_that_has_found_nothing_yet_starts_anew_for_another_target() {
    let (wrist, reach) = (Wrist::PAPER, Reach::kernel());
    let [one, other] = [[1.5, 0.9, 0.0], [-1.5, 0.0, 0.6]].map(pose_of);
    let mut search = Search::new(&one, &reach);
    assert_eq!(search.best(), None);
    search.retarget(&other);
    let expected = finish(&mut Search::new(&other, &reach), &wrist);
    assert_eq!(finish(&mut search, &wrist), expected);
}
