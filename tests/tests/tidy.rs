//! The project keeps its own rules: who imports whom, how long a file is, what logic may not do.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Which crate may import which of ours, as ARCHITECTURE.md says; nothing else may.
const IMPORTS: &[(&str, &[&str])] = &[
    ("eel-units", &[]),
    ("eel-kinematics", &["eel-units"]),
    ("eel-canopen", &[]),
    ("eel-protocol", &["eel-units", "eel-canopen"]),
    (
        "eel-vertebra",
        &["eel-kinematics", "eel-canopen", "eel-protocol", "eel-units"],
    ),
    (
        "eel-head",
        &["eel-kinematics", "eel-canopen", "eel-protocol", "eel-units"],
    ),
    ("eel-drivers", &["eel-units"]),
    (
        "board-stm32g474",
        &["eel-vertebra", "eel-drivers", "eel-protocol", "eel-units"],
    ),
    // Beside the vertebra it links every logic crate, so the head too, to look for panics, and counts
    // the instructions of the kinematics and of the CANopen node.
    (
        "board-qemu",
        &[
            "eel-canopen",
            "eel-vertebra",
            "eel-protocol",
            "eel-units",
            "eel-head",
            "eel-kinematics",
        ],
    ),
    ("eel-transport", &["eel-protocol"]),
    (
        "eel-client",
        &["eel-canopen", "eel-protocol", "eel-transport"],
    ),
    (
        "eel",
        &[
            "eel-client",
            "eel-transport",
            "eel-head",
            "eel-kinematics",
            "eel-protocol",
            "eel-units",
        ],
    ),
    (
        "hil-sim",
        &[
            "eel-vertebra",
            "eel-drivers",
            "eel-head",
            "eel-kinematics",
            "eel-protocol",
            "eel-units",
            "eel-transport",
        ],
    ),
    ("xtask", &[]),
    (
        "eel-fuzz",
        &["eel-canopen", "eel-protocol", "eel-units", "eel-vertebra"],
    ),
];
/// The crate that may import everything.
const TESTS: &str = "eel-tests";

/// Crates without a clock, a bus, an allocator, a float or an unsafe block.
const LOGIC: [&str; 7] = [
    "units",
    "kinematics",
    "canopen",
    "protocol",
    "vertebra",
    "head",
    "drivers",
];

/// The most lines of a file.
const LINES: usize = 500;

/// The one file outside the boards that may hold unsafe: four instructions of the target, beside safe
/// code that gives the same bits.
const INSTRUCTIONS: &str = "firmware/units/src/machine.rs";

/// The most unsafe places in the boards together.
const UNSAFE: usize = 20;

/// Returns the folder of the workspace.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("..")
        .canonicalize()
        .expect("the workspace")
}

/// Returns the path of every source file with its text.
fn sources() -> Vec<(String, String)> {
    let mut files = Vec::new();
    for folder in ["firmware", "host-tools", "hil-sim", "tests"] {
        collect(&root().join(folder), &mut files);
    }
    assert!(files.len() > 50, "only {} files found", files.len());
    files
        .into_iter()
        .map(|path| {
            let text = fs::read_to_string(&path).expect("a text");
            let name = path.strip_prefix(root()).expect("a path of ours");
            (name.display().to_string(), text)
        })
        .collect()
}

/// Adds the source files of a folder.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if path.is_dir() && !name.starts_with(['.', '_']) && !name.starts_with("target") {
            collect(&path, files);
        } else if name.ends_with(".rs") {
            files.push(path);
        }
    }
}

/// Fails with one line for each thing found.
fn expect_none(found: &[String]) {
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn crates_import_only_what_they_may() {
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--format-version",
            "1",
            "--no-deps",
            "--offline",
        ])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    let mut found = Vec::new();
    let mut seen = 0;
    for package in packages {
        let name = package["name"].as_str().expect("a name");
        if name == TESTS {
            continue;
        }
        let Some((_, allowed)) = IMPORTS.iter().find(|(importer, _)| *importer == name) else {
            found.push(format!("{name} is not in the table of ARCHITECTURE.md"));
            continue;
        };
        seen += 1;
        for dependency in package["dependencies"].as_array().expect("dependencies") {
            let imported = dependency["name"].as_str().expect("a name");
            // The kind of a normal dependency is null; tests and build scripts may use others.
            if dependency["path"].is_string()
                && dependency["kind"].is_null()
                && !allowed.contains(&imported)
            {
                found.push(format!("{name} may not import {imported}"));
            }
        }
    }
    expect_none(&found);
    assert_eq!(seen, IMPORTS.len(), "the table names crates that are gone");
}

#[test]
fn logic_has_no_std_no_unsafe_and_no_float() {
    let mut found = Vec::new();
    for name in LOGIC {
        let path = format!("firmware/{name}/src/lib.rs");
        let text = fs::read_to_string(root().join(&path)).expect("a library");
        // Where one file may hold unsafe, it can only be denied.
        let may_allow = INSTRUCTIONS.starts_with(&format!("firmware/{name}/"));
        let no_unsafe = if may_allow {
            "#![deny(unsafe_code)]"
        } else {
            "#![forbid(unsafe_code)]"
        };
        for attribute in [
            "#![no_std]",
            no_unsafe,
            "#![deny(clippy::float_arithmetic)]",
        ] {
            if !text.lines().any(|line| line == attribute) {
                found.push(format!("{path} lacks {attribute}"));
            }
        }
    }
    expect_none(&found);
}

#[test]
fn files_fit_in_a_head() {
    let mut found = Vec::new();
    for (path, text) in sources() {
        let lines = text.lines().count();
        if lines > LINES {
            found.push(format!("{path} has {lines} lines, more than {LINES}"));
        }
    }
    expect_none(&found);
}

#[test]
fn nothing_is_left_for_later() {
    // Written apart, or this file would find itself.
    let marks = [
        concat!("TO", "DO"),
        concat!("FIX", "ME"),
        concat!("to", "do!"),
        concat!("unimple", "mented!"),
        concat!("In the ", "making"),
    ];
    let mut found = Vec::new();
    for (path, text) in sources() {
        for (number, line) in text.lines().enumerate() {
            for mark in marks {
                if line.contains(mark) {
                    found.push(format!("{path}:{}: {mark}", number + 1));
                }
            }
        }
    }
    expect_none(&found);
}

/// The keyword, written apart, or this file would find itself.
const KEYWORD: &str = concat!("un", "safe");

/// Returns the lines, from 0, that hold the keyword, and whether each says why that is sound.
fn unsafe_lines(text: &str) -> Vec<(usize, bool)> {
    let lines: Vec<_> = text.lines().map(str::trim).collect();
    let places = (0..lines.len()).filter(|place| has_keyword(lines[*place]));
    places
        .map(|place| (place, is_explained(&lines[..place], lines[place])))
        .collect()
}

/// Tells whether a line's code has the keyword: of a block, function, implementation or attribute.
fn has_keyword(line: &str) -> bool {
    let mut code = line.split("//").next().unwrap_or_default().to_owned();
    let pieces: Vec<_> = code.split('"').collect();
    // An even number of quotation marks: whole texts, which are no code.
    if pieces.len() % 2 == 1 {
        code = pieces.iter().step_by(2).copied().collect();
    }
    code.split(|letter: char| !letter.is_alphanumeric() && letter != '_')
        .any(|word| word == KEYWORD)
}

/// Tells whether right above a line, but for attributes, is a comment that begins with `SAFETY: `, or
/// for a function documentation with a section `# Safety`.
fn is_explained(above: &[&str], line: &str) -> bool {
    let comment = above
        .iter()
        .rev()
        .skip_while(|line| line.starts_with("#[") && line.ends_with(']'))
        .take_while(|line| line.starts_with("//"));
    let is_function = line.contains(&format!("{KEYWORD} fn"));
    comment.into_iter().any(|line| {
        let reason = line.strip_prefix("// SAFETY: ");
        reason.is_some_and(|reason| !reason.is_empty()) || (is_function && *line == "/// # Safety")
    })
}

#[test]
fn unsafe_is_rare_explained_and_only_in_boards() {
    let mut found = Vec::new();
    let mut count = 0;
    for (path, text) in sources() {
        for (place, is_explained) in unsafe_lines(&text) {
            let is_board = path.starts_with("firmware/board-");
            count += usize::from(is_board);
            if !is_board && path != INSTRUCTIONS {
                found.push(format!("{path}:{}: unsafe outside the boards", place + 1));
            } else if !is_explained {
                found.push(format!("{path}:{}: no SAFETY line above", place + 1));
            }
        }
    }
    expect_none(&found);
    assert!(
        (1..=UNSAFE).contains(&count),
        "{count} unsafe places, at most {UNSAFE}"
    );
    println!("{count} unsafe places in the boards");
}

#[test]
fn an_unsafe_place_without_a_reason_right_above_is_found() {
    let explained = |text: &str| -> Vec<bool> {
        let lines = unsafe_lines(&text.replace("KEYWORD", KEYWORD));
        lines
            .iter()
            .map(|(_, is_explained)| *is_explained)
            .collect()
    };
    for sound in [
        "// SAFETY: it lives.\nlet a = KEYWORD { b() };",
        "// SAFETY: it lives,\n// and long.\n#[expect(it)]\nKEYWORD {",
        "/// Does it.\n///\n/// # Safety\n/// It must live.\n#[inline]\npub KEYWORD fn a() {}",
        "// SAFETY: any bits are valid.\n#[KEYWORD(link_section = \"a\")]",
    ] {
        assert_eq!(explained(sound), [true], "{sound}");
    }
    for bare in [
        "let a = KEYWORD { b() };",
        "// SAFETY: it lives.\n\nKEYWORD impl Sync for A {}",
        "// SAFETY: it lives.\nlet a = 1;\nlet b = KEYWORD { c() };",
        "// SAFETY: \nKEYWORD { c() }",
        "/// # Safety\n/// It must live.\nlet a = KEYWORD { b() };",
    ] {
        assert_eq!(explained(bare), [false], "{bare}");
    }
    for none in [
        "// KEYWORD {",
        "let a = \"KEYWORD {\";",
        "#![deny(KEYWORD_code)]",
    ] {
        assert!(explained(none).is_empty(), "{none}");
    }
}

#[test]
fn manifests_share_the_workspace_s_lints() {
    let mut found = Vec::new();
    for (importer, _) in IMPORTS {
        let output = fs::read_to_string(root().join(manifest_of(importer))).expect("a manifest");
        if !output.contains("[lints]\nworkspace = true") {
            found.push(format!("{importer} does not take the workspace's lints"));
        }
    }
    expect_none(&found);
}

/// Returns the path of a crate's manifest.
fn manifest_of(name: &str) -> String {
    let folder = match name {
        "hil-sim" => "hil-sim".to_owned(),
        "eel-fuzz" => "tests/fuzz".to_owned(),
        "eel" | "xtask" => format!("host-tools/{name}"),
        "eel-client" | "eel-transport" => {
            format!("host-tools/{}", name.trim_start_matches("eel-"))
        }
        _ => format!("firmware/{}", name.trim_start_matches("eel-")),
    };
    format!("{folder}/Cargo.toml")
}

/// What docs/bus.md says is shown by a test must be shown by one.
#[test]
fn the_conformance_list_names_tests_and_peers_that_exist() {
    let root = root();
    let list = fs::read_to_string(root.join("docs/bus.md")).unwrap();
    let mut tests = String::new();
    for entry in fs::read_dir(root.join("firmware/canopen/tests")).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            tests.push_str(&fs::read_to_string(path).unwrap());
        }
    }
    let rows = list.lines().filter(|line| line.starts_with("| "));
    let mut named = 0;
    for row in rows {
        let columns: Vec<&str> = row.trim_matches('|').split(" | ").collect();
        let [_, _, _, shown, peers] = columns[..] else {
            continue;
        };
        for name in quoted(shown) {
            assert!(tests.contains(&format!("fn {name}(")), "no test {name}");
            named += 1;
        }
        for script in quoted(peers) {
            assert!(
                root.join("tests/python").join(script).is_file(),
                "no {script}"
            );
        }
    }
    assert!(named > 40, "{named} tests are named");
}

/// Returns what stands between backquotes.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}
