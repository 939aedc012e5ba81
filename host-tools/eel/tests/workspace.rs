//! `eel wrist workspace`: the map, its numbers and its options.

mod common;

use std::fs;
use std::path::Path;
use std::process::Command;

use common::{check, drawing, eel, json, numbers, refuse, texts};
use roxmltree::{Document, Node};
use serde_json::Value;

#[test]
fn the_map_has_axes_in_degrees_a_legend_and_labels() {
    for architecture in ["parallel-axes", "orthogonal-axes", "parallel-actuators"] {
        let all = [
            "margin,serial,parallel,isotropy,isotropy-of-a,condition,condition-of-a,manipulability",
            "condition",
        ];
        for of in all {
            let text = drawing(&[
                "workspace",
                "--architecture",
                architecture,
                "--of",
                of,
                "--cells",
                "40",
                "--roll",
                "-0.05",
            ]);
            check(&text);
            let document = Document::parse(&text).unwrap();
            let panels = of.split(',').count();
            assert_eq!(texts(&document, "panel").len(), panels);
            assert!(texts(&document, "label").len() >= 2 * panels);
            let words: Vec<_> = texts(&document, "").iter().filter_map(Node::text).collect();
            for wanted in ["−30°", "30°", "0°", "yaw", "pitch", "out of reach"] {
                assert!(words.contains(&wanted), "{wanted}");
            }
            assert!(text.contains(&architecture.replace('-', " ")));
            assert!(text.contains("roll −2.9°"), "the roll is named");
        }
    }
}

#[test]
fn the_summary_and_the_grid_agree_with_margin_and_ik() {
    let answer = json(&["workspace", "--cells", "20", "--of", "margin,condition"]);
    let (yaw, pitch) = (numbers(&answer["yaw"]), numbers(&answer["pitch"]));
    assert_eq!((yaw.len(), pitch.len()), (21, 21));
    let (mut in_reach, mut beyond) = (0, 0);
    for (j, y) in pitch.iter().enumerate().step_by(5) {
        for (i, x) in yaw.iter().enumerate().step_by(4) {
            let (x, y) = (x.to_string(), y.to_string());
            let (margin, condition) = (
                &answer["of"]["margin"][j][i],
                &answer["of"]["condition"][j][i],
            );
            let reached = answer["reach"][j][i].as_bool().unwrap();
            let (code, out, _) = eel(&["margin", "--yaw", &x, "--pitch", &y, "--json"]);
            assert_eq!(code == 0, reached);
            assert_eq!(margin.is_null(), !reached);
            if reached {
                let wanted: Value = serde_json::from_str(&out).unwrap();
                let off = wanted["least"].as_f64().unwrap() - margin.as_f64().unwrap();
                assert!(off.abs() < 1e-12);
                let ik = json(&["ik", "--yaw", &x, "--pitch", &y]);
                let wanted = ik["condition_of_rates"].as_f64().unwrap();
                assert!((condition.as_f64().unwrap() / wanted - 1.0).abs() < 1e-9);
                in_reach += 1;
            } else {
                beyond += 1;
            }
        }
    }
    assert!(in_reach > 5 && beyond > 5, "{in_reach} {beyond}");
    let summary = &answer["summary"];
    let near = |value: &Value, wanted: f64| (value.as_f64().unwrap() - wanted).abs() < 1e-3;
    assert!(near(&summary["largest_box"], 1.258));
    assert!(near(&summary["any_roll"]["least_margin"]["value"], 0.5748));
    assert!(near(
        &summary["any_roll"]["worst_condition"]["value"],
        2.3575
    ));
    assert!(near(&summary["global_isotropy"], 0.8064));
    assert!(near(&summary["box"]["roll"][1], 4f64.to_radians()));
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("summary.svg");
    let (code, text, _) = eel(&["workspace", "--cells", "8", "--out", file.to_str().unwrap()]);
    assert_eq!(code, 0);
    for wanted in ["least margin", "0.5748", "may grow 1.258 times", "2.3575"] {
        assert!(text.contains(wanted), "{wanted}: {text}");
    }
}

#[test]
fn ranges_and_the_file_are_as_asked() {
    let answer = json(&[
        "workspace",
        "--degrees",
        "--yaw-range",
        "-10,40",
        "--pitch-range",
        "20",
        "--cells",
        "4",
    ]);
    let close = |found: &Value, wanted: [f64; 5]| {
        let off = numbers(found)
            .into_iter()
            .zip(wanted)
            .map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-9, "{found}");
    };
    close(&answer["yaw"], [-10.0, 2.5, 15.0, 27.5, 40.0]);
    close(&answer["pitch"], [-20.0, -10.0, 0.0, 10.0, 20.0]);
    assert_eq!(answer["unit"], "deg");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    for (question, name) in [("workspace", "workspace.svg"), ("draw", "wrist.svg")] {
        // Without --out the drawing goes to a file in the folder.
        let output = Command::new(env!("CARGO_BIN_EXE_eel"))
            .args(["wrist", question])
            .current_dir(folder)
            .output()
            .unwrap();
        assert!(output.status.success());
        assert!(String::from_utf8_lossy(&output.stdout).contains(&format!("wrote {name}")));
        check(&fs::read_to_string(folder.join(name)).unwrap());
    }
    // A map beside the box draws no box and still is well-formed.
    let beside = drawing(&[
        "workspace",
        "--yaw-range",
        "0.9,1.1",
        "--pitch-range",
        "0.2",
    ]);
    check(&beside);
    assert!(!beside.contains("class=\"paper\"") && !beside.contains("class=\"least\" cx"));
}

#[test]
fn a_map_of_nothing_is_refused() {
    refuse(&[
        (
            &["workspace", "--yaw-range", "30"],
            "with --degrees in degrees",
        ),
        (
            &["workspace", "--yaw-range", "0.5,-0.5"],
            "needs LOW below HIGH",
        ),
        (
            &["workspace", "--yaw-range", "1,2,3"],
            "takes LOW,HIGH or one number",
        ),
        (
            &["workspace", "--pitch-range", "100", "--degrees"],
            "within ±90°",
        ),
        (&["workspace", "--pitch-range", "a"], "expected a number"),
        (&["workspace", "--roll", "4.1e9"], "expected a number"),
        (&["workspace", "--roll", "40"], "with --degrees in degrees"),
        (&["workspace", "--of", "colour"], "possible values: margin"),
        (&["workspace", "--cells", "1"], "4..=2000"),
        (
            &["workspace", "--json", "--out", "-"],
            "name a file with --out",
        ),
    ]);
    let (code, out, _) = eel(&["workspace", "--help"]);
    assert!(code == 0 && out.contains("--json") && out.contains("largest_box"));
}
