//! Claims that hold: numbers of the paper, computed again.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4, PI, SQRT_2};

use eel_kinematics::design::{self, Travel, Vector3};

use super::super::args::Architecture;
use super::super::direct::phi_psi;
use super::super::number::plain;
use super::super::place::at_home;
use super::{Claim, Verdict};

/// The three wrists.
pub const ARCHITECTURES: [Architecture; 3] = [
    Architecture::ParallelAxes,
    Architecture::OrthogonalAxes,
    Architecture::ParallelActuators,
];

/// Steps of the workspace's grid on each side of home; its corners are on it.
const STEPS: i32 = 8;

/// Returns every claim that should hold.
pub fn all() -> Vec<Claim> {
    let mut claims = Vec::new();
    for architecture in ARCHITECTURES {
        claims.extend(home(architecture));
    }
    claims.extend(figure_12());
    claims.extend(figure_13());
    claims.push(workspace());
    claims
}

/// Every orientation of a grid over the workspace.
pub fn grid() -> impl Iterator<Item = design::Matrix3<f64>> {
    let side = -STEPS..=STEPS;
    let share = |step: i32| f64::from(step) / f64::from(STEPS);
    side.clone().flat_map(move |i| {
        let side = side.clone();
        side.clone().flat_map(move |j| {
            side.clone().map(move |k| {
                let [yaw, pitch, roll] = Travel::PAPER.map(|range| range.high);
                design::rotation(yaw * share(i), pitch * share(j), roll * share(k))
            })
        })
    })
}

/// Makes a claim about numbers, which holds where all agree to a tolerance.
fn numbers(
    source: &'static str,
    claim: String,
    printed: &[f64],
    computed: &[f64],
    tolerance: f64,
) -> Claim {
    let text = |numbers: &[f64]| {
        let cells: Vec<String> = numbers.iter().map(|n| plain(*n, 6)).collect();
        cells.join(", ")
    };
    let holds = printed.len() == computed.len()
        && printed
            .iter()
            .zip(computed)
            .all(|(a, b)| (a - b).abs() <= tolerance);
    Claim {
        source,
        claim,
        printed: text(printed),
        computed: text(computed),
        verdict: if holds {
            Verdict::Holds
        } else {
            Verdict::Fails
        },
        erratum: None,
    }
}

/// What the paper says of home.
fn home(architecture: Architecture) -> Vec<Claim> {
    let name = architecture.name();
    let geometry = architecture.geometry();
    let jacobians = at_home(&geometry);
    let is_prototype = architecture == Architecture::ParallelActuators;
    let (gear, yaw, torque, other) = if is_prototype {
        (FRAC_1_SQRT_2, 1.0, 0.5, 109.471_220_634_5)
    } else {
        (1.0, SQRT_2, FRAC_1_SQRT_2, 90.0)
    };
    let exact = |claim: &str, printed: &[f64], computed: &[f64]| {
        numbers(
            "at home",
            format!("{name}: {claim}"),
            printed,
            computed,
            1e-9,
        )
    };
    let rates = Vector3::new(1.0, 1.0, 0.0);
    let moment = Vector3::new(1.0, 0.0, 0.0);
    let omega = jacobians.angular_velocity(&rates).unwrap_or_default();
    let torques = jacobians.torques(&moment).unwrap_or_default();
    let solutions = geometry.inverse_all(&design::rotation(0.0, 0.0, 0.0));
    let legs: Vec<f64> = solutions.map_or_else(Vec::new, |all| {
        let (near, far) = (all[0], all[3]);
        [near[0], far[0], near[1], far[1]]
            .map(f64::to_degrees)
            .to_vec()
    });
    // The paper: A is the identity up to a turn.
    let off_turn = (jacobians.a * jacobians.a.transpose() - design::Matrix3::identity()).amax();
    vec![
        exact("A Aᵀ = 1, largest difference", &[0.0], &[off_turn]),
        exact("det A", &[1.0], &[jacobians.det_a()]),
        exact("condition of A", &[1.0], &[jacobians.condition()]),
        exact("B", &[gear, gear, 1.0], jacobians.b.as_slice()),
        exact(
            "omega for motor rates (1, 1, 0)",
            &[yaw, 0.0, 0.0],
            omega.as_slice(),
        ),
        exact(
            "torques for moment (1, 0, 0)",
            &[torque, torque, 0.0],
            torques.as_slice(),
        ),
        exact(
            "both solutions of legs 1, 2 (deg)",
            &[0.0, other, 0.0, other],
            &legs,
        ),
    ]
}

/// Fig. 12: the direct solutions for θ = (0.1, 0.2, π/4).
fn figure_12() -> Vec<Claim> {
    const PRINTED: [[f64; 2]; 4] = [
        [-0.070_649, 0.141_301],
        [-0.070_649, -1.567_916],
        [FRAC_PI_2, -0.529_444],
        [FRAC_PI_2, 0.509_311],
    ];
    let theta = [0.1, 0.2, FRAC_PI_4];
    let found = Architecture::ParallelActuators
        .geometry()
        .direct_all(&theta);
    let found: Vec<[f64; 2]> = found
        .into_iter()
        .flatten()
        .map(|rotation| phi_psi(&rotation, theta[2]))
        .collect();
    let distance = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    let rows = PRINTED.iter().enumerate().map(|(k, printed)| {
        let nearest = found
            .iter()
            .min_by(|a, b| distance(a, printed).total_cmp(&distance(b, printed)));
        // The first must be home's, which the model gives first.
        let computed = if k == 0 { found.first() } else { nearest };
        let mode = if k == 0 {
            "home's solution"
        } else {
            "another solution"
        };
        let computed = computed.map_or(&[][..], |pair| &pair[..]);
        let claim = format!("theta (0.1, 0.2, π/4): (phi, psi), {mode}");
        numbers("Fig. 12", claim, printed, computed, 1e-6)
    });
    let mut rows: Vec<Claim> = rows.collect();
    let claim = "theta (0.1, 0.2, π/4): number of solutions".to_owned();
    rows.push(numbers(
        "Fig. 12",
        claim,
        &[4.0],
        &[found.len() as f64],
        0.0,
    ));
    rows
}

/// Fig. 13: the inverse solutions for (θ3, φ, ψ) = (π/4, π/12, π/12).
fn figure_13() -> Vec<Claim> {
    const PRINTED: [[f64; 2]; 2] = [[-0.373_828, 2.026_265], [0.369_056, 1.714_940]];
    let rotation = design::rotation_from_platform(FRAC_PI_4, PI / 12.0, PI / 12.0);
    let found = Architecture::ParallelActuators
        .geometry()
        .inverse_all(&rotation);
    let rows = PRINTED.iter().enumerate().map(|(leg, printed)| {
        let computed = found.map_or_else(Vec::new, |all| vec![all[0][leg], all[3][leg]]);
        let claim = format!("(π/4, π/12, π/12): theta{}, home's and the other", leg + 1);
        numbers("Fig. 13", claim, printed, &computed, 1e-6)
    });
    rows.collect()
}

/// No singularity in the workspace of the prototype.
fn workspace() -> Claim {
    let geometry = Architecture::ParallelActuators.geometry();
    let mut least = [f64::INFINITY; 3];
    for rotation in grid() {
        let Some(theta) = geometry.inverse(&rotation) else {
            least = [f64::NEG_INFINITY; 3];
            break;
        };
        let jacobians = geometry.jacobians(&rotation, &theta);
        let values = [
            jacobians.det_a(),
            jacobians.b[0].min(jacobians.b[1]),
            jacobians.b[2],
        ];
        least = [0, 1, 2].map(|k| least[k].min(values[k]));
    }
    let [det_a, b, cosine] = least;
    Claim {
        source: "workspace",
        claim: "parallel-actuators: yaw ±30°, pitch ±15°, roll ±4° without singularity".to_owned(),
        printed: "none inside".to_owned(),
        computed: format!("det A ≥ {det_a:.3}, b1, b2 ≥ {b:.3}, cos phi ≥ {cosine:.3}"),
        verdict: if det_a > 0.1 && b > 0.1 && cosine > 0.1 {
            Verdict::Holds
        } else {
            Verdict::Fails
        },
        erratum: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_fails_where_a_number_is_off_or_missing() {
        let verdict =
            |computed: &[f64]| numbers("", String::new(), &[1.0, 2.0], computed, 1e-6).verdict;
        assert_eq!(verdict(&[1.0, 2.000_000_5]), Verdict::Holds);
        assert_eq!(verdict(&[1.0, 2.000_002]), Verdict::Fails);
        assert_eq!(verdict(&[1.0, f64::NAN]), Verdict::Fails);
        assert_eq!(verdict(&[1.0]), Verdict::Fails);
    }
}
