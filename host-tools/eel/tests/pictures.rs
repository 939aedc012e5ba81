//! `eel wrist workspace` and `eel wrist draw` as their users call them, and the modes by name.

use std::f64::consts::{FRAC_PI_4, PI};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use roxmltree::{Document, Node};
use serde_json::Value;

const FIGURES: [&str; 4] = ["4", "10", "12", "13"];

fn eel(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_eel"))
        .arg("wrist")
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (
        output.status.code().unwrap(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

fn json(arguments: &[&str]) -> Value {
    let (code, out, err) = eel(&[arguments, &["--json"]].concat());
    assert_eq!(code, 0, "{arguments:?}: {err}");
    serde_json::from_str(&out).unwrap()
}

/// A drawing on standard output.
fn drawing(arguments: &[&str]) -> String {
    let (code, out, err) = eel(&[arguments, &["--out", "-"]].concat());
    assert_eq!(code, 0, "{arguments:?}: {err}");
    out
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().unwrap_or_else(|| panic!("{value}"));
    list.iter().map(|number| number.as_f64().unwrap()).collect()
}

/// The texts of a drawing whose class begins so.
fn texts<'a>(document: &'a Document, class: &str) -> Vec<Node<'a, 'a>> {
    let all = document
        .descendants()
        .filter(|node| node.has_tag_name("text"));
    all.filter(|node| {
        node.attribute("class")
            .unwrap_or_default()
            .starts_with(class)
    })
    .collect()
}

/// Asserts what every drawing must have: well-formed, a white ground, finite numbers within its frame,
/// a colour for every class.
fn check(text: &str) {
    let document = Document::parse(text).unwrap();
    let root = document.root_element();
    assert!(root.has_tag_name("svg") && root.attribute("role") == Some("img"));
    let size =
        ["width", "height"].map(|side| root.attribute(side).unwrap().parse::<f64>().unwrap());
    let ground = root
        .children()
        .find(|node| node.has_tag_name("rect"))
        .unwrap();
    assert_eq!(ground.attribute("fill"), Some("#ffffff"));
    assert_eq!(ground.attribute("width"), root.attribute("width"));
    assert!(!text.contains("NaN") && !text.contains("inf"));
    let style = root
        .children()
        .find(|node| node.has_tag_name("style"))
        .unwrap();
    let style = style.text().unwrap();
    for node in root.descendants() {
        if let Some(class) = node.attribute("class") {
            assert!(style.contains(&format!(".{class}")), "{class} has no style");
        }
        if node.has_tag_name("text") {
            for (side, name) in size.iter().zip(["x", "y"]) {
                let at: f64 = node.attribute(name).unwrap().parse().unwrap();
                assert!((0.0..=*side).contains(&at), "{node:?}");
            }
        }
    }
    for name in ["title", "desc"] {
        let node = root
            .children()
            .find(|node| node.has_tag_name(name))
            .unwrap();
        assert!(!node.text().unwrap().is_empty());
    }
}

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
                .filter(|node| node.text() == Some(name))
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
    let (code, text, _) = eel(&["workspace", "--cells", "8", "--out", "/dev/null"]);
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
fn what_can_t_be_drawn_exits_with_2_and_names_the_cure() {
    let cases: [(&[&str], &str); 21] = [
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
            &["draw", "--yaw", "0.5", "--pitch", "1"],
            "are still in reach",
        ),
        (&["draw", "--assembly-mode", "home"], "--theta <A,B,C>"),
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
        (&["ik", "--working-mode", "+"], "++ (home), +-, -+ or --"),
        (
            &["ik", "--working-mode", "-+", "--kernel", "fixed"],
            "knows home's modes only, not -+",
        ),
    ];
    for (arguments, cure) in cases {
        let (code, out, err) = eel(arguments);
        assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}: {err}");
        assert!(err.contains(cure), "{arguments:?}: {err}");
    }
    let nowhere = ["draw", "--out", "/nowhere/at/all.svg"];
    let (code, _, err) = eel(&nowhere);
    assert!(
        code == 3 && err.contains("in a folder that exists"),
        "{err}"
    );
    for (question, key) in [("workspace", "largest_box"), ("draw", "assembly_mode")] {
        let (code, out, _) = eel(&[question, "--help"]);
        assert!(
            code == 0 && out.contains("--json") && out.contains(key),
            "{out}"
        );
    }
}
