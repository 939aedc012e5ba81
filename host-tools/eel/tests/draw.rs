//! `eel wrist draw`: the paper's figures, poses and solutions as its users ask for them.

mod common;

use std::f64::consts::{FRAC_PI_4, PI};
use std::fs;
use std::path::{Path, PathBuf};

use common::{check, drawing, eel, json, numbers, refuse, texts};
use roxmltree::Document;

const FIGURES: [&str; 4] = ["4", "10", "12", "13"];

fn images() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/images")
}

#[test]
fn the_pictures_in_the_documentation_are_what_the_command_draws() {
    let figures = FIGURES.map(|number| {
        (
            format!("wrist-figure-{number}.svg"),
            drawing(&["draw", "--figure", number]),
            format!("draw --figure {number}"),
        )
    });
    let map = (
        "wrist-workspace.svg".to_owned(),
        drawing(&["workspace"]),
        "workspace".to_owned(),
    );
    for (name, text, command) in figures.into_iter().chain([map]) {
        check(&text);
        assert!(text.len() < 150_000, "{name} has {} bytes", text.len());
        let kept = fs::read_to_string(images().join(&name)).unwrap_or_default();
        assert!(
            kept == text,
            "docs/images/{name} is stale; run: eel wrist {command} --out docs/images/{name}"
        );
    }
}

#[test]
fn figures_12_and_13_show_the_paper_s_numbers() {
    let twelve = drawing(&["draw", "--figure", "12"]);
    for wanted in [
        "φ = −0.070649, ψ = 0.141301 rad",
        "φ = −0.070649, ψ = −1.567916 rad",
        "φ = 1.570796, ψ = −0.529444 rad",
        "φ = 1.570796, ψ = 0.509311 rad",
        "θ = (0.100000, 0.200000, 0.785398) rad",
    ] {
        assert!(twelve.contains(wanted), "{wanted}");
    }
    let document = Document::parse(&twelve).unwrap();
    let modes: Vec<_> = texts(&document, "mode")
        .iter()
        .map(|node| node.text().unwrap())
        .collect();
    assert_eq!(modes, ["home", "other-psi", "other-phi", "other-both"]);
    let thirteen = drawing(&["draw", "--figure", "13"]);
    for wanted in [
        "θ = (−0.373828, 0.369056, 0.785398) rad",
        "θ = (−0.373828, 1.714940, 0.785398) rad",
        "θ = (2.026265, 0.369056, 0.785398) rad",
        "θ = (2.026265, 1.714940, 0.785398) rad",
    ] {
        assert!(thirteen.contains(wanted), "{wanted}");
    }
    for mode in ["++", "+-", "-+", "--"] {
        assert!(thirteen.contains(&format!(">working mode {mode}<")));
    }
    let ten = drawing(&["draw", "--figure", "10"]);
    assert!(ten.contains("b = (0.7071, 0.7071, 1.0000)"));
    let four = drawing(&["draw", "--figure", "4", "--degrees"]);
    assert_eq!(four.matches("b = (1.0000, 1.0000, 1.0000)").count(), 2);
    assert!(four.contains("θ = (0.0000, 0.0000, 45.0000) deg"));
}

#[test]
fn a_figure_is_the_same_as_asking_for_its_pose() {
    let theta = format!("0.1,0.2,{FRAC_PI_4}");
    let figure = json(&["draw", "--figure", "12"]);
    let asked = json(&["draw", "--theta", &theta, "--all"]);
    assert_eq!(figure["panels"], asked["panels"]);
    let (third, other) = (FRAC_PI_4.to_string(), (PI / 12.0).to_string());
    let pose = ["--theta3", &third, "--phi", &other, "--psi", &other];
    let figure = json(&["draw", "--figure", "13"]);
    let asked = json(&[&["draw", "--all"], &pose[..]].concat());
    for (one, other) in figure["panels"]
        .as_array()
        .unwrap()
        .iter()
        .zip(asked["panels"].as_array().unwrap())
    {
        assert_eq!(one["working_mode"], other["working_mode"]);
        for (a, b) in numbers(&one["theta"]).iter().zip(numbers(&other["theta"])) {
            assert!((a - b).abs() < 1e-12);
        }
    }
}

#[test]
fn every_part_has_its_name_and_no_two_names_overlap() {
    let cases: [&[&str]; 6] = [
        &["--figure", "4"],
        &["--figure", "10"],
        &["--figure", "12"],
        &["--figure", "13"],
        &["--yaw", "-0.5", "--pitch", "0.2", "--all"],
        &["--theta", "0.3,-0.2,0.8", "--architecture", "parallel-axes"],
    ];
    for case in cases {
        let text = drawing(&[&["draw"], case].concat());
        check(&text);
        let document = Document::parse(&text).unwrap();
        let names = texts(&document, "name");
        let panels = texts(&document, "mode").len();
        assert!(panels == 1 || panels == 2 || panels == 4);
        for name in ["O", "B₁", "B₂", "C₁", "C₂", "motor 1", "motor 2", "motor 3"] {
            let count = names
                .iter()
                .filter(|node| {
                    let text = node.text().unwrap();
                    text == name || name == "O" && text == "O = A₁ = A₂"
                })
                .count();
            assert_eq!(count, panels, "{name} in {case:?}");
        }
        // Letters of 14 px: about 8.6 wide, 11 high.
        let boxes: Vec<[f64; 4]> = names
            .iter()
            .map(|node| {
                let at = |name: &str| node.attribute(name).unwrap().parse::<f64>().unwrap();
                let half = 4.3 * node.text().unwrap().chars().count() as f64;
                [at("x") - half, at("y") - 11.0, at("x") + half, at("y")]
            })
            .collect();
        for (k, a) in boxes.iter().enumerate() {
            for (b, other) in boxes[k + 1..].iter().zip(&names[k + 1..]) {
                let apart = a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
                assert!(
                    apart,
                    "{:?} and {:?} in {case:?}",
                    names[k].text(),
                    other.text()
                );
            }
        }
    }
}

#[test]
fn a_drawing_s_points_close_the_mechanism() {
    let cases: [(&str, f64); 3] = [
        ("parallel-axes", 1.0),
        ("orthogonal-axes", 2f64.sqrt()),
        ("parallel-actuators", 0.5f64.sqrt()),
    ];
    for (architecture, crank) in cases {
        let pose = ["draw", "--all", "--yaw", "0.3", "--pitch", "-0.1"];
        let answer = json(&[&pose[..], &["--architecture", architecture]].concat());
        let panels = answer["panels"].as_array().unwrap();
        let modes: Vec<_> = panels
            .iter()
            .map(|panel| panel["working_mode"].clone())
            .collect();
        assert_eq!(modes, ["++", "+-", "-+", "--"]);
        for panel in panels {
            for leg in 0..2 {
                let [a, b, c] = ["a", "b", "c"].map(|name| numbers(&panel["points"][name][leg]));
                let distance = |p: &[f64], q: &[f64]| {
                    let square: f64 = p.iter().zip(q).map(|(p, q)| (p - q) * (p - q)).sum();
                    square.sqrt()
                };
                assert!((distance(&a, &b) - crank).abs() < 1e-12);
                assert!((distance(&b, &c) - 1.0).abs() < 1e-12);
                assert!((distance(&c, &[0.0; 3]) - 1.0).abs() < 1e-12);
            }
            assert!((panel["yaw"].as_f64().unwrap() - 0.3).abs() < 1e-12);
        }
    }
}

#[test]
fn what_can_t_be_drawn_is_refused() {
    refuse(&[
        (&["draw", "--json", "--out", "-"], "name a file with --out"),
        (&["draw", "--figure", "5"], "possible values: 4, 10, 12, 13"),
        (
            &["draw", "--figure", "12", "--yaw", "0.1"],
            "cannot be used with",
        ),
        (&["draw", "--theta", "1,2"], "takes three angles"),
        (
            &["draw", "--theta", "0,0,0", "--yaw", "1"],
            "cannot be used with",
        ),
        (
            &["draw", "--theta", "20,20,45"],
            "with --degrees in degrees",
        ),
        (
            &["draw", "--yaw", "0.5", "--pitch", "1"],
            "are still in reach",
        ),
    ]);
    let (code, _, err) = eel(&["draw", "--out", "/nowhere/at/all.svg"]);
    assert!(
        code == 3 && err.contains("in a folder that exists"),
        "{err}"
    );
    let (code, out, _) = eel(&["draw", "--help"]);
    assert!(code == 0 && out.contains("--json") && out.contains("assembly_mode"));
}
