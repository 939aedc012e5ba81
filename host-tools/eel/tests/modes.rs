//! Working and assembly modes by name.

mod common;

use std::f64::consts::FRAC_PI_4;

use common::{eel, json, numbers, refuse};

#[test]
fn modes_are_chosen_by_name() {
    let pose = ["--yaw", "0.2", "--pitch", "0.1"];
    let ask = |mode: &str| json(&[&["ik", "--all", "--working-mode", mode], &pose[..]].concat());
    for (index, mode) in ["++", "+-", "-+", "--"].into_iter().enumerate() {
        let answer = ask(mode);
        assert_eq!(answer["working_mode"], mode);
        assert_eq!(answer["working_modes"][index], mode);
        assert_eq!(answer["solutions"][index], answer["theta_f64"]);
        let signs: Vec<bool> = numbers(&answer["b"])[..2]
            .iter()
            .map(|b| *b > 0.0)
            .collect();
        let wanted: Vec<bool> = mode.chars().map(|sign| sign == '+').collect();
        assert_eq!(signs, wanted);
        assert_eq!(answer["kernel"], if mode == "++" { "fixed" } else { "f64" });
        assert_eq!(answer["travel"]["within"], mode == "++");
        // The direct kinematics in that configuration's assembly mode leads back.
        let theta: Vec<String> = numbers(&answer["theta_f64"])
            .iter()
            .map(f64::to_string)
            .collect();
        let back = json(&[
            "fk",
            "--theta",
            &theta.join(","),
            "--kernel",
            "f64",
            "--assembly-mode",
            answer["assembly_mode"].as_str().unwrap(),
        ]);
        assert_eq!(back["assembly_mode"], answer["assembly_mode"]);
        assert!((back["yaw"].as_f64().unwrap() - 0.2).abs() < 1e-9);
        assert!((back["pitch"].as_f64().unwrap() - 0.1).abs() < 1e-9);
    }
    let theta = format!("0.1,0.2,{FRAC_PI_4}");
    for mode in ["home", "other-psi", "other-phi", "other-both"] {
        let one = json(&["fk", "--theta", &theta, "--assembly-mode", mode]);
        let all = one["solutions"].as_array().unwrap();
        let same = all.iter().find(|one| one["assembly_mode"] == mode).unwrap();
        assert_eq!(one["f64"]["psi"], same["psi"]);
        assert_eq!(
            one["det_a"].as_f64().unwrap() > 0.0,
            mode == "home" || mode == "other-phi"
        );
        let panel = json(&["draw", "--theta", &theta, "--assembly-mode", mode]);
        assert_eq!(panel["panels"][0]["psi"], same["psi"]);
    }
    let (_, text, _) = eel(&["ik", "--yaw", "40", "--degrees", "--working-mode", "-+"]);
    assert!(text.contains("working mode -+, assembly mode "), "{text}");
    assert!(text.contains("beyond travel: motor 1 is "), "{text}");
    let (_, text, _) = eel(&["margin", "--yaw", "10", "--degrees"]);
    assert!(
        text.contains("within travel: roll has 4.0000 deg left"),
        "{text}"
    );
}

#[test]
fn a_mode_that_is_none_or_has_no_answer_is_refused() {
    refuse(&[
        (&["ik", "--working-mode", "+"], "++ (home), +-, -+ or --"),
        (
            &["ik", "--working-mode", "-+", "--kernel", "fixed"],
            "knows home's modes only, not -+",
        ),
        (
            &["fk", "--theta", "0,0,0.8", "--assembly-mode", "far"],
            "expected one of home, other-psi",
        ),
        (
            &[
                "fk",
                "--theta",
                "2.1,-1.2,0.785",
                "--assembly-mode",
                "other-phi",
            ],
            "--assembly-mode home or other-psi",
        ),
        (
            &[
                "draw",
                "--theta",
                "2.1,-1.2,0.785",
                "--assembly-mode",
                "other-phi",
            ],
            "--assembly-mode home or other-psi",
        ),
        (&["draw", "--assembly-mode", "home"], "--theta <A,B,C>"),
        (
            &["draw", "--working-mode", "++", "--all"],
            "cannot be used with",
        ),
    ]);
}
