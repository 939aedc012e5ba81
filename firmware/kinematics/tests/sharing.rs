//! Torque sharing against an independent search in double precision.
#![expect(clippy::float_arithmetic, reason = "the oracle is in double precision")]

mod common;

use common::{Random, exact_joints, newton_metres, pose_of, torque};
use eel_kinematics::design::{Geometry, Matrix3, Vector3};
use eel_kinematics::{Bounds, Jacobian, Joints, Policy, Shared, Side, Wrist};
use eel_units::Torque;

/// What the kernel may pass a bound by, in N·m, and its step where it shares.
const SLACK: f64 = 16.0 / common::Q24;

/// The largest fraction of one component that keeps the bounds, widened by `margin`, by bisection.
fn search(case: &Case, granted: &Vector3<f64>, axis: usize, margin: f64) -> f64 {
    let feasible = |fraction: f64| {
        let mut tried = *granted;
        tried[axis] = case.moment[axis] * fraction;
        let torques = case.map * tried;
        (0..3).all(|k| {
            torques[k] >= case.bounds[k].0 - margin && torques[k] <= case.bounds[k].1 + margin
        })
    };
    if feasible(1.0) {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if feasible(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

struct Case {
    jacobian: Jacobian,
    map: Matrix3<f64>,
    moment: [f64; 3],
    bounds: [(f64, f64); 3],
}

impl Case {
    fn random(random: &mut Random) -> Self {
        let joints = Wrist::PAPER
            .inverse(&pose_of(random.pose(1.0)))
            .unwrap()
            .joints;
        let theta = exact_joints(&joints);
        let geometry = Geometry::PARALLEL_ACTUATORS;
        let rotation = geometry.direct(&theta).unwrap();
        Self {
            jacobian: Wrist::PAPER.direct(&joints).unwrap().jacobian,
            map: geometry.jacobians(&rotation, &theta).torque_map().unwrap(),
            moment: random.vector(2.0),
            bounds: [(); 3].map(|()| (-1.0 - 0.6 * random.sign(), 1.0 + 0.6 * random.sign())),
        }
    }

    fn share(&self) -> Shared {
        self.share_by(Policy::YawFirst)
    }

    fn share_by(&self, policy: Policy) -> Shared {
        let bounds = self.bounds.map(|(low, high)| Bounds {
            low: torque(low),
            high: torque(high),
        });
        self.jacobian
            .share(&self.moment.map(torque), &bounds, policy)
    }

    fn clipped(&self) -> Vector3<f64> {
        let mut torques = self.map * Vector3::from(self.moment);
        for k in 0..3 {
            torques[k] = torques[k].max(self.bounds[k].0).min(self.bounds[k].1);
        }
        self.map.try_inverse().unwrap() * torques
    }

    /// The fraction that keeps all three components in proportion.
    fn scale(&self) -> f64 {
        let torques = self.map * Vector3::from(self.moment);
        (0..3).fold(1.0, |scale, k| {
            let (low, high) = self.bounds[k];
            let bound = if torques[k] < 0.0 { low } else { high };
            f64::min(scale, bound / torques[k])
        })
    }

    fn is_saturated(&self) -> bool {
        let torques = self.map * Vector3::from(self.moment);
        (0..3).any(|k| torques[k] < self.bounds[k].0 || torques[k] > self.bounds[k].1)
    }
}

#[test]
fn sharing_finds_what_a_search_finds_and_never_flips_yaw() {
    let mut random = Random::new(0x5A7E_0000_0000_0001);
    let (mut cases, mut worst, mut worst_made) = (0, 0.0f64, 0.0f64);
    let (mut yaw_lost, mut clip_lost, mut scale_lost) = (0.0, 0.0, 0.0);
    let (mut flips, mut clip_flips) = (0, 0);
    while cases < 10_000 {
        let case = Case::random(&mut random);
        if !case.is_saturated() {
            continue;
        }
        cases += 1;
        let shared = case.share();
        let found = shared.achieved.map(newton_metres);
        let mut granted = Vector3::zeros();
        for k in 0..3 {
            // The torques of the kernel are known to three steps: between these two is its answer.
            // Each component before it may have left a motor the slack short of what was granted.
            let before = f64::from(k as u32) * SLACK;
            let least_slack = SLACK - before - 3.0 * SLACK;
            let least = search(&case, &granted, k, least_slack) * case.moment[k].abs();
            let most_slack = SLACK + before + 3.0 * SLACK;
            let most = search(&case, &granted, k, most_slack) * case.moment[k].abs();
            let given = found[k] * case.moment[k].signum();
            assert!(
                given >= least - 2e-7 && given <= most + 2e-7,
                "{least} {given} {most}"
            );
            if k == 0 {
                // Nothing before it: yaw has one answer.
                worst = worst
                    .max((given - search(&case, &granted, 0, 0.0) * case.moment[0].abs()).abs());
            }
            granted[k] = found[k];
            let rest = newton_metres(shared.unallocated[k]);
            assert!((found[k] + rest - case.moment[k]).abs() < 2e-7);
        }
        // What it says it achieved is what the torques make.
        let made = case.jacobian.moment(shared.torque).map(newton_metres);
        let off = (Vector3::from(made) - Vector3::from(found)).amax();
        assert!(off < 1e-5, "{off:e} {shared:?}");
        worst_made = worst_made.max(off);
        assert!(
            shared.bound.iter().any(Option::is_some),
            "saturated, yet nothing is bound"
        );
        for k in 0..3 {
            let given = newton_metres(shared.torque[k]);
            let (low, high) = case.bounds[k];
            assert!(given >= low - 6e-8 && given <= high + 6e-8);
            match shared.bound[k] {
                Some(Side::Low) => assert!(low < 0.0),
                Some(Side::High) => assert!(high > 0.0),
                None => {}
            }
        }
        let clipped = case.clipped();
        scale_lost += (case.scale() - 1.0).abs() * case.moment[0].abs() / 2.0;
        flips += usize::from(found[0] * case.moment[0] < 0.0);
        clip_flips += usize::from(clipped[0] * case.moment[0] < -1e-9);
        yaw_lost += (found[0] - case.moment[0]).abs() / 2.0;
        clip_lost += (clipped[0] - case.moment[0]).abs() / 2.0;
    }
    let count = f64::from(cases);
    println!(
        "{cases} saturated cases: mean yaw error {:.4} of the range, sign flips {flips} \
         (clipping each motor: {:.4}, {clip_flips}; scaling all: {:.4}, 0); \
         yaw against the search {worst:.1e} N·m, achieved against made {worst_made:.1e} N·m",
        yaw_lost / count,
        clip_lost / count,
        scale_lost / count,
    );
    assert_eq!(flips, 0);
    assert!(clip_flips > 0, "the comparison shows nothing");
    assert!(worst <= 8e-6, "{worst:e}");
}

#[test]
fn what_is_achieved_is_what_the_torques_make_however_large_the_moment() {
    let mut random = Random::new(0x5A7E_0000_0000_0004);
    let mut worst = 0.0f64;
    for round in 0..20_000 {
        let mut case = Case::random(&mut random);
        case.moment = random.vector(if round % 2 == 0 { 120.0 } else { 20.0 });
        for policy in [Policy::YawFirst, Policy::KeepDirection] {
            let shared = case.share_by(policy);
            let made = case.jacobian.moment(shared.torque).map(newton_metres);
            for (axis, made) in made.into_iter().enumerate() {
                let achieved = newton_metres(shared.achieved[axis]);
                worst = worst.max((made - achieved).abs());
                assert!(achieved * case.moment[axis] >= 0.0);
            }
            let missing = shared.unallocated.iter().any(|&rest| rest != Torque::ZERO);
            // A motor is named where something is missing.
            let is_named = shared.bound.iter().any(Option::is_some);
            assert!(is_named || !missing, "{shared:?}");
        }
    }
    println!("achieved against made, moments to 120 N·m: {worst:.1e} N·m");
    assert!(worst <= 1.2e-5, "{worst:e}");
}

#[test]
fn keeping_the_direction_grants_the_largest_common_fraction() {
    let mut random = Random::new(0x5A7E_0000_0000_0003);
    let (mut cases, mut worst, mut turned) = (0, 0.0f64, 0.0f64);
    while cases < 10_000 {
        let mut case = Case::random(&mut random);
        // Small and large moments: beyond 8 N·m the kernel counts in coarser steps.
        let size = if cases % 2 == 0 { 1.0 } else { 20.0 };
        case.moment = case.moment.map(|component| component * size);
        if !case.is_saturated() {
            continue;
        }
        cases += 1;
        let shared = case.share_by(Policy::KeepDirection);
        let achieved = Vector3::from(shared.achieved.map(newton_metres));
        let asked = Vector3::from(case.moment);
        let wanted = case.scale();
        worst = worst.max((achieved - asked * wanted).amax() / size);
        turned = turned.max(achieved.cross(&asked).norm() / asked.norm());
        for k in 0..3 {
            let given = newton_metres(shared.torque[k]);
            let (low, high) = case.bounds[k];
            assert!(given >= low - 6e-8 && given <= high + 6e-8);
            let rest = newton_metres(shared.unallocated[k]);
            assert!((achieved[k] + rest - asked[k]).abs() < 2e-7);
        }
        // The motor that bounds is at its bound, and it is the only one that is named.
        let named: Vec<usize> = (0..3).filter(|&k| shared.bound[k].is_some()).collect();
        let [motor] = named[..] else {
            panic!("{shared:?}");
        };
        let given = newton_metres(shared.torque[motor]);
        let (low, high) = case.bounds[motor];
        let bound = match shared.bound[motor] {
            Some(Side::Low) => low,
            _ => high,
        };
        assert!((given - bound).abs() < 2e-6, "{shared:?}");
    }
    println!(
        "{cases} saturated cases: against the exact fraction {worst:.1e} N·m per 2 N·m, \
         turned by {turned:.1e} N·m"
    );
    assert!(worst <= 8e-6 && turned <= 4e-6, "{worst:e} {turned:e}");
}

#[test]
fn what_is_within_the_bounds_is_granted_whole() {
    let mut random = Random::new(0x5A7E_0000_0000_0002);
    let mut cases = 0;
    while cases < 5_000 {
        let mut case = Case::random(&mut random);
        case.moment = case.moment.map(|component| component * 0.2);
        case.bounds = [(-2.0, 2.0); 3];
        cases += 1;
        let shared = case.share();
        assert_eq!(shared.achieved, case.moment.map(torque));
        assert_eq!(shared.unallocated, [Torque::ZERO; 3]);
        assert_eq!(shared.bound, [None; 3]);
        let plain = case.jacobian.torques(case.moment.map(torque));
        for (a, b) in shared.torque.into_iter().zip(plain) {
            assert!((a.to_q24() - b.to_q24()).abs() <= 2);
        }
    }
}

#[test]
fn yaw_is_served_before_pitch_and_pitch_before_roll() {
    let jacobian = Wrist::PAPER.direct(&Joints::HOME).unwrap().jacobian;
    let bounds = [Bounds {
        low: torque(-1.0),
        high: torque(1.0),
    }; 3];
    // At home τ1 = (yaw − pitch)/2, τ2 = (yaw + pitch)/2, τ3 = roll.
    let shared = jacobian.share(
        &[torque(1.5), torque(1.5), torque(3.0)],
        &bounds,
        Policy::YawFirst,
    );
    let achieved = shared.achieved.map(newton_metres);
    for (found, wanted) in achieved.into_iter().zip([1.5, 0.5, 1.0]) {
        assert!((found - wanted).abs() < 8e-6, "{achieved:?}");
    }
    assert_eq!(shared.bound, [None, Some(Side::High), Some(Side::High)]);
}

#[test]
fn a_motor_that_may_not_move_stops_what_needs_it() {
    let jacobian = Wrist::PAPER.direct(&Joints::HOME).unwrap().jacobian;
    let free = Bounds {
        low: torque(-1.0),
        high: torque(1.0),
    };
    let dead = Bounds {
        low: Torque::ZERO,
        high: Torque::ZERO,
    };
    let shared = jacobian.share(
        &[torque(1.0), torque(0.0), torque(0.5)],
        &[dead, free, free],
        Policy::YawFirst,
    );
    assert!(newton_metres(shared.achieved[0]).abs() < 4e-6);
    assert!((newton_metres(shared.achieved[2]) - 0.5).abs() < 1e-6);
    assert_eq!(shared.bound[0], Some(Side::High));
}

#[test]
fn bounds_that_exclude_zero_or_cross_count_as_zero_on_that_side() {
    let jacobian = Wrist::PAPER.direct(&Joints::HOME).unwrap().jacobian;
    let odd = Bounds {
        low: torque(0.3),
        high: torque(1.0),
    };
    let crossed = Bounds {
        low: torque(0.5),
        high: torque(-0.5),
    };
    let still = jacobian.share(&[Torque::ZERO; 3], &[odd, odd, crossed], Policy::YawFirst);
    assert_eq!(still.torque, [Torque::ZERO; 3]);
    let shared = jacobian.share(
        &[torque(1.0), Torque::ZERO, torque(1.0)],
        &[odd, odd, crossed],
        Policy::YawFirst,
    );
    assert!((newton_metres(shared.torque[0]) - 0.5).abs() < 2e-6);
    assert_eq!(shared.torque[2], Torque::ZERO);
    assert!(newton_metres(shared.achieved[2]).abs() < 4e-6);
}
