//! What the tests of `eel wrist` share: the command as its users call it, and what every drawing must have.
#![allow(dead_code, reason = "each test file uses its part")]

use std::process::Command;

use roxmltree::{Document, Node};
use serde_json::Value;

/// Runs `eel wrist`; returns its exit code, its output and its errors.
pub fn eel(arguments: &[&str]) -> (i32, String, String) {
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

/// Returns the JSON that is answered.
pub fn json(arguments: &[&str]) -> Value {
    let (code, out, err) = eel(&[arguments, &["--json"]].concat());
    assert_eq!(code, 0, "{arguments:?}: {err}");
    serde_json::from_str(&out).unwrap()
}

/// A drawing on standard output.
pub fn drawing(arguments: &[&str]) -> String {
    let (code, out, err) = eel(&[arguments, &["--out", "-"]].concat());
    assert_eq!(code, 0, "{arguments:?}: {err}");
    out
}

/// Returns the numbers of a list.
pub fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().unwrap_or_else(|| panic!("{value}"));
    list.iter().map(|number| number.as_f64().unwrap()).collect()
}

/// The texts of a drawing whose class begins so.
pub fn texts<'a>(document: &'a Document, class: &str) -> Vec<Node<'a, 'a>> {
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
pub fn check(text: &str) {
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

/// Asserts that each question is refused with exit code 2, no output, and an error that names its cure.
pub fn refuse(cases: &[(&[&str], &str)]) {
    for (arguments, cure) in cases {
        let (code, out, err) = eel(arguments);
        assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}: {err}");
        assert!(err.contains(cure), "{arguments:?}: {err}");
    }
}
