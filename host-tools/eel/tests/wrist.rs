//! `eel wrist` as its users call it: golden vectors, the paper's figures, refusals.

mod common;

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::fs;
use std::path::Path;

use common::{eel, json, numbers};
use serde_json::Value;

const ARCHITECTURES: [&str; 3] = ["parallel-axes", "orthogonal-axes", "parallel-actuators"];
const FIG_13: [&str; 6] = [
    "--theta3",
    "0.7853981633974483",
    "--phi",
    "0.2617993877991494",
    "--psi",
    "0.2617993877991494",
];

fn assert_close(found: &Value, wanted: &[f64], tolerance: f64) {
    let found = match found {
        Value::Array(_) => numbers(found),
        one => vec![one.as_f64().unwrap()],
    };
    assert_eq!(found.len(), wanted.len());
    for (found, wanted) in found.iter().zip(wanted) {
        let off = (found - wanted).abs();
        assert!(off <= tolerance, "{found} instead of {wanted}");
    }
}

/// Rows of a file of golden vectors, with the texts of their first three columns.
fn golden(architecture: &str) -> Vec<(Vec<String>, Vec<f64>)> {
    let path = format!("../../tests/golden/wrist-{architecture}.csv");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    let text = fs::read_to_string(path).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        let numbers = cells.iter().map(|cell| cell.parse().unwrap()).collect();
        (cells[..3].to_vec(), numbers)
    });
    rows.collect()
}

#[test]
fn golden_vectors_of_each_architecture_come_through() {
    for architecture in ARCHITECTURES {
        let rows = golden(architecture);
        assert_eq!(rows.len(), 64);
        // The files have 15 digits.
        let tolerance = if architecture == "parallel-actuators" {
            3e-8
        } else {
            1e-12
        };
        for (texts, row) in rows.iter().step_by(13) {
            let pose = [
                "--yaw", &texts[0], "--pitch", &texts[1], "--roll", &texts[2],
            ];
            let which = ["--architecture", architecture];
            let ask = |question: &[&str]| json(&[question, &which, &pose].concat());
            let ik = ask(&["ik"]);
            assert_eq!(ik["architecture"], architecture);
            assert_close(&ik["theta"], &row[3..6], tolerance);
            assert_close(&ik["theta_f64"], &row[3..6], 1e-12);
            assert_close(&ik["det_a"], &row[8..9], 1e-12);
            assert_close(&ik["b"], &row[9..12], 1e-12);
            let theta: Vec<String> = row[3..6].iter().map(f64::to_string).collect();
            let fk = json(&[
                "fk",
                "--architecture",
                architecture,
                "--theta",
                &theta.join(","),
            ]);
            for (key, column) in [
                ("yaw", 0),
                ("pitch", 1),
                ("roll", 2),
                ("phi", 6),
                ("psi", 7),
            ] {
                assert_close(&fk[key], &row[column..=column], tolerance);
                assert_close(&fk["f64"][key], &row[column..=column], 1e-12);
            }
            for (axis, moment) in ["1,0,0", "0,1,0", "0,0,1"].iter().enumerate() {
                let torque = ask(&["torque", "--moment", moment]);
                let wanted = &row[12 + 3 * axis..15 + 3 * axis];
                assert_close(&torque["tau_f64"], wanted, 1e-12);
                assert_close(&torque["tau"], wanted, 2.5e-7);
            }
        }
    }
}

#[test]
fn figure_12_has_its_four_platforms() {
    let theta = format!("0.1,0.2,{FRAC_PI_4}");
    let fk = json(&["fk", "--theta", &theta, "--all"]);
    assert_eq!(fk["kernel"], "fixed");
    assert_close(&fk["phi"], &[-0.070_649], 1e-6);
    assert_close(&fk["psi"], &[0.141_301], 1e-6);
    let solutions = fk["solutions"].as_array().unwrap();
    assert_eq!(solutions[0]["assembly_mode"], "home");
    let mut found: Vec<[f64; 2]> = solutions
        .iter()
        .map(|one| [one["phi"].as_f64().unwrap(), one["psi"].as_f64().unwrap()])
        .collect();
    found.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let wanted = [
        [-0.070_649, -1.567_916],
        [-0.070_649, 0.141_301],
        [FRAC_PI_2, -0.529_444],
        [FRAC_PI_2, 0.509_311],
    ];
    assert_eq!(found.len(), 4);
    for (found, wanted) in found.iter().zip(wanted) {
        assert!((found[0] - wanted[0]).abs() < 1e-6 && (found[1] - wanted[1]).abs() < 1e-6);
    }
}

#[test]
fn figure_13_has_its_motor_angles() {
    let ik = json(&[&["ik", "--all"], &FIG_13[..]].concat());
    assert_close(&ik["theta"], &[-0.373_828, 0.369_056, FRAC_PI_4], 1e-6);
    assert_eq!(ik["theta_fixed"], ik["theta"]);
    let solutions = ik["solutions"].as_array().unwrap();
    assert_eq!(solutions.len(), 4);
    assert_close(&solutions[0], &numbers(&ik["theta_f64"]), 0.0);
    assert_close(&solutions[3], &[2.026_265, 1.714_940, FRAC_PI_4], 1e-6);
    assert_eq!(ik["working_modes"][0], "++");
}

#[test]
fn degrees_are_radians() {
    let pose = [0.4f64, -0.2, 0.05];
    let texts = |scale: fn(f64) -> f64| pose.map(|angle| scale(angle).to_string());
    let ask = |[yaw, pitch, roll]: [String; 3], more: &[&str]| {
        json(
            &[
                &["ik", "--yaw", &yaw, "--pitch", &pitch, "--roll", &roll],
                more,
            ]
            .concat(),
        )
    };
    let radians = ask(texts(|a| a), &[]);
    let degrees = ask(texts(f64::to_degrees), &["--degrees"]);
    let wanted: Vec<f64> = numbers(&radians["theta_f64"])
        .iter()
        .map(|a| a.to_degrees())
        .collect();
    assert_close(&degrees["theta_f64"], &wanted, 1e-11);
    assert_close(&degrees["theta"], &wanted, 1e-5);
    assert_close(&degrees["pose"]["yaw"], &[pose[0].to_degrees()], 1e-12);
    assert_eq!(
        (&radians["unit"], &degrees["unit"]),
        (&"rad".into(), &"deg".into())
    );
    let theta = wanted
        .iter()
        .map(f64::to_string)
        .collect::<Vec<_>>()
        .join(",");
    let back = json(&["fk", "--degrees", "--theta", &theta]);
    assert_close(&back["f64"]["yaw"], &[pose[0].to_degrees()], 1e-10);
    assert_close(&back["f64"]["pitch"], &[pose[1].to_degrees()], 1e-10);
}

#[test]
fn each_kernel_can_be_asked_for() {
    let exact = json(&["ik", "--yaw", "0.3", "--kernel", "f64"]);
    assert_eq!(
        (&exact["kernel"], &exact["theta"]),
        (&"f64".into(), &exact["theta_f64"])
    );
    let fixed = json(&["ik", "--yaw", "0.3", "--kernel", "fixed"]);
    assert_eq!(
        (&fixed["kernel"], &fixed["theta"]),
        (&"fixed".into(), &fixed["theta_fixed"])
    );
    // Pure yaw turns both cranks by as much.
    assert_close(
        &fixed["theta"],
        &[0.3, 0.3, numbers(&exact["theta"])[2]],
        3e-8,
    );
}

#[test]
fn where_the_kernel_refuses_the_model_answers_and_says_why() {
    let pose = ["--yaw", "0", "--pitch", "0", "--roll", "0.78"];
    let ik = json(&[&["ik"], &pose[..]].concat());
    assert_eq!(ik["kernel"], "f64");
    let refusal = ik["fixed_refusal"].as_str().unwrap();
    assert!(
        refusal.contains("range") && refusal.contains("roll ±0.5 rad"),
        "{refusal}"
    );
    assert!(ik["theta_fixed"].is_null());
    // What it reaches instead: as much roll as its range allows.
    let nearest = &ik["nearest"];
    assert_eq!(nearest["obstacle"], "range");
    assert_close(&nearest["yaw"], &[0.0], 1e-3);
    assert_close(&nearest["roll"], &[0.489], 1e-3);
    let (code, _, err) = eel(&[&["ik", "--kernel", "fixed"], &pose[..]].concat());
    assert_eq!(code, 2);
    assert!(err.contains("--kernel f64 answers"), "{err}");
}

#[test]
fn what_no_leg_reaches_is_refused_with_the_nearest_pose() {
    let pose = ["--yaw", "40", "--pitch", "-20", "--roll", "3", "--degrees"];
    let (code, _, err) = eel(&[&["ik"], &pose[..]].concat());
    assert_eq!(code, 2);
    let (_, tail) = err
        .split_once("yaw, pitch, roll = ")
        .expect("the nearest pose");
    let (angles, _) = tail.split_once(" deg (").expect("the workspace after it");
    let angles: Vec<&str> = angles.split(", ").collect();
    let again = json(&[
        "ik",
        "--degrees",
        "--yaw",
        angles[0],
        "--pitch",
        angles[1],
        "--roll",
        angles[2],
    ]);
    assert_eq!(again["kernel"], "fixed", "{err}");
}

#[test]
fn torques_keep_their_bounds_and_yaw_comes_first() {
    let ask = |limits: &str, kernel: &str| {
        let moment = ["--moment", "-2,0.5,0", "--yaw", "0.3", "--pitch", "0.1"];
        let all = ["torque", "--limits", limits, "--kernel", kernel];
        json(&[&all, &moment[..]].concat())
    };
    for kernel in ["fixed", "f64"] {
        let all = ask("-0.6,0.6", kernel);
        let pairs = ask("-0.6,0.6,-0.6,0.6,-0.6,0.6", kernel);
        assert_eq!(all, pairs);
        let (tau, achieved) = (numbers(&all["tau"]), numbers(&all["achieved"]));
        assert!(tau.iter().all(|torque| torque.abs() <= 0.6), "{tau:?}");
        // Yaw as large as the bound allows: some motor is at it.
        assert!(
            tau.iter().any(|torque| (torque + 0.6).abs() < 1e-5),
            "{tau:?}"
        );
        assert!(achieved[0] < -1.0 && achieved[0] > -2.0, "{achieved:?}");
        for (axis, asked) in [-2.0, 0.5, 0.0].iter().enumerate() {
            let missing = numbers(&all["unallocated"])[axis];
            assert!((achieved[axis] + missing - asked).abs() < 1e-6);
        }
        assert!(all["bound"].as_array().unwrap().contains(&"low".into()));
        let uneven = ask("-0.6,0.6,-2,2,-2,2", kernel);
        assert_eq!(uneven["bound"][0], "low");
    }
    let (fixed, exact) = (ask("-0.6,0.6", "fixed"), ask("-0.6,0.6", "f64"));
    assert_close(&fixed["tau"], &numbers(&exact["tau"]), 1e-5);
    let free = json(&["torque", "--moment", "1,0,0"]);
    assert_close(&free["tau"], &[0.5, 0.5, 0.0], 1e-6);
    assert_eq!(free["bound"], serde_json::json!([null, null, null]));
}

#[test]
fn a_moment_keeps_its_direction_where_that_is_asked() {
    for kernel in ["fixed", "f64"] {
        let ask = |policy: &str| {
            json(&[
                "torque",
                "--moment",
                "-2,0.5,0.2",
                "--yaw",
                "0.3",
                "--limits",
                "-0.6,0.6",
                "--kernel",
                kernel,
                "--policy",
                policy,
            ])
        };
        let kept = ask("keep-direction");
        assert_eq!(kept["policy"], "keep-direction");
        let achieved = numbers(&kept["achieved"]);
        let fraction = achieved[0] / -2.0;
        assert!(fraction > 0.3 && fraction < 0.9, "{achieved:?}");
        assert_close(
            &kept["achieved"],
            &[-2.0, 0.5, 0.2].map(|m| m * fraction),
            1e-6,
        );
        // Yaw first gives more yaw.
        let first = numbers(&ask("yaw-first")["achieved"]);
        assert!(first[0] < achieved[0] - 0.05, "{first:?} {achieved:?}");
    }
    let (code, _, err) = eel(&["torque", "--moment", "1,0,0", "--policy", "clip"]);
    assert_eq!(code, 2);
    assert!(
        err.contains("yaw-first") && err.contains("keep-direction"),
        "{err}"
    );
}

#[test]
fn the_jacobian_makes_the_motors_rates_and_the_two_torque_maps_agree() {
    let at = |yaw: &str| json(&["jacobian", "--yaw", yaw, "--pitch", "0.1"]);
    let (here, less, more) = (at("0.4"), at("0.39999"), at("0.40001"));
    // ω for a yaw rate of 1 is eₓ: the first column of B⁻¹A.
    for motor in 0..3 {
        let theta = |answer: &Value| answer["theta"][motor].as_f64().unwrap();
        let slope = (theta(&more) - theta(&less)) / 2e-5;
        assert_close(&here["rate_map"][motor][0], &[slope], 1e-8);
        let exact = numbers(&here["torque_map"][motor]);
        assert_close(&here["torque_map_fixed"][motor], &exact, 2e-7);
    }
    let home = json(&["jacobian"]);
    assert_close(&home["condition"], &[1.0], 1e-12);
    assert_close(&home["condition_of_rates"], &[2f64.sqrt()], 1e-12);
}

#[test]
fn margins_are_one_at_home_and_vanish_at_the_singularity() {
    for architecture in ARCHITECTURES {
        let home = json(&["margin", "--architecture", architecture]);
        assert_close(&home["serial"], &[1.0; 3], 1e-12);
        assert_close(&home["assembly"], &[1.0], 1e-12);
        assert_close(&home["least"], &[1.0], 1e-12);
        assert_close(&home["margin"], &[1.0], 1e-8);
    }
    // Leg 1 lines up where pure roll brings C1 onto y: x = 0, y = 1, z = 0 make D = 0.
    let at = |roll: &str| {
        json(&["margin", "--roll", roll])["margin"]
            .as_f64()
            .unwrap()
    };
    assert!(at("0.4") > at("0.7") && at("0.7") > at("0.7853") && at("0.7853") > 0.0);
    assert!(at("0.7853") < 0.02);
    assert_eq!(eel(&["margin", "--roll", "0.7855"]).0, 2);
}

#[test]
fn the_papers_claims_hold_or_are_named_errata() {
    let claims = json(&["paper"]);
    let claims = claims.as_array().unwrap();
    let (code, text, _) = eel(&["paper"]);
    assert_eq!(code, 0);
    for claim in claims {
        assert_ne!(claim["verdict"], "fails", "{claim}");
        assert_eq!(
            claim["verdict"] == "erratum",
            claim["erratum"].is_u64(),
            "{claim}"
        );
        assert!(text.contains(claim["claim"].as_str().unwrap()), "{claim}");
    }
    for number in 1..=5 {
        assert!(claims.iter().any(|claim| claim["erratum"] == number));
    }
    let count = |source: &str| {
        claims
            .iter()
            .filter(|claim| claim["source"] == source)
            .count()
    };
    assert_eq!(
        (
            count("at home"),
            count("Fig. 12"),
            count("Fig. 13"),
            count("workspace")
        ),
        (21, 5, 2, 1)
    );
    for wanted in [
        "109.471221",
        "-1.567916",
        "1.714940",
        "1.414214, 0.000000, 0.000000",
    ] {
        assert!(text.contains(wanted), "{wanted} is missing");
    }
}

#[test]
fn what_has_no_answer_exits_with_2_and_names_the_cure() {
    let cases: [(&[&str], &str); 15] = [
        (
            &["ik", "--yaw", "0.5", "--pitch", "1"],
            "are still in reach",
        ),
        (&["ik", "--phi", "2"], "--phi must be within"),
        (&["ik", "--phi", "1.5707963267948966"], "out of reach"),
        (&["ik", "--yaw", "nan"], "expected a number within"),
        (
            &["ik", "--yaw", "0.1", "--psi", "0.1"],
            "cannot be used with",
        ),
        (&["ik", "--architecture", "serial"], "parallel-axes"),
        (
            &["ik", "--architecture", "parallel-axes", "--kernel", "fixed"],
            "--kernel f64",
        ),
        (&["fk", "--theta", "0.1,0.2"], "takes three angles"),
        (&["ik", "--yaw", "20"], "with --degrees in degrees"),
        (&["fk", "--theta", "20,20,45"], "with --degrees in degrees"),
        (
            &["torque", "--moment", "1e300,0,0"],
            "expected a number within",
        ),
        (&["fk", "--theta", "3,1,1"], "bring theta nearer to home"),
        (&["torque", "--moment", "1,2"], "takes three numbers"),
        (
            &["torque", "--moment", "1,0,0", "--limits", "0.1,1"],
            "LOW ≤ 0 ≤ HIGH",
        ),
        (
            &["torque", "--moment", "1,0,0", "--limits", "-1,1,-1"],
            "three such pairs",
        ),
    ];
    for (arguments, cure) in cases {
        let (code, out, err) = eel(arguments);
        assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}: {err}");
        assert!(err.contains(cure), "{arguments:?}: {err}");
    }
}

#[test]
fn help_names_the_json_keys_and_the_order_of_angles() {
    let (code, out, _) = eel(&["--help"]);
    assert_eq!(code, 0);
    assert!(out.contains("Rx(yaw) Ry(pitch) Rz(roll) Rz(π/4)") && out.contains("radians"));
    for (question, key) in [("ik", "det_a"), ("fk", "psi"), ("torque", "unallocated")] {
        let (code, out, _) = eel(&[question, "--help"]);
        assert!(
            code == 0 && out.contains("--json") && out.contains(key),
            "{out}"
        );
    }
}
