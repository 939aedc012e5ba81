//! docs/hardware.md says what the code says: pins, clocks, priorities, memory, parts and motors.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

#[path = "hardware/clocks.rs"]
mod clocks;
#[path = "hardware/motors.rs"]
mod motors;

const PAGE: &str = "docs/hardware.md";
const BOARD: &str = "firmware/board-stm32g474/src";

/// Pins that work without being named by the program: the crystal's and the debugger's.
const UNNAMED: [&str; 4] = ["PF0", "PF1", "PA13", "PA14"];
/// Functions in the pin table of main.rs.
const FUNCTIONS: usize = 16;

/// Returns a text of the repository.
fn text(path: &str) -> String {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Returns the code of the board, without its comments.
fn board_code() -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(BOARD);
    let mut code = String::new();
    for entry in fs::read_dir(folder).expect("the board's sources") {
        let source = fs::read_to_string(entry.expect("an entry").path()).expect("a text");
        for line in source.lines() {
            code.push_str(line.split("//").next().unwrap_or_default());
            code.push('\n');
        }
    }
    code
}

/// Returns the rows of the first table whose head begins like this, as cells.
fn table<'a>(text: &'a str, head: &str) -> Vec<Vec<&'a str>> {
    let rows: Vec<_> = text
        .lines()
        .map(|line| line.trim_start_matches("//! "))
        .skip_while(|line| !line.starts_with(head))
        .take_while(|line| line.starts_with('|'))
        .skip(2)
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    assert!(
        !rows.is_empty(),
        "no table begins with {head:?}: give it back its columns or change this test"
    );
    rows
}

/// Returns the names of pins in a text, in its order: PA0, PB13.
fn pins(text: &str) -> Vec<&str> {
    text.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_')
        .filter(|word| match word.as_bytes() {
            [b'P', port, number @ ..] => {
                (b'A'..=b'G').contains(port)
                    && (1..=2).contains(&number.len())
                    && number.iter().all(u8::is_ascii_digit)
            }
            _ => false,
        })
        .collect()
}

/// Returns what stands between the first backquotes.
fn quoted(cell: &str) -> Option<&str> {
    cell.split('`').nth(1)
}

/// Fails with one line for each thing found.
fn expect_none(found: &[String]) {
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// Returns the functions of a pin table in its order, each with its pins in theirs.
fn functions<'a>(rows: &[Vec<&'a str>]) -> Vec<(&'a str, Vec<&'a str>)> {
    let mut functions: Vec<(&str, Vec<&str>)> = Vec::new();
    for row in rows {
        let (function, named) = (row[0], pins(row[1]));
        match functions.iter_mut().find(|(name, _)| *name == function) {
            Some((_, all)) => all.extend(named),
            None => functions.push((function, named)),
        }
    }
    functions
}

#[test]
fn the_pin_map_is_that_of_the_board_s_main() {
    let (page, main) = (text(PAGE), text(&format!("{BOARD}/main.rs")));
    let here = functions(&table(&page, "| function | pin | LQFP64 |"));
    let there = functions(&table(&main, "| function | pins |"));
    assert_eq!(
        there.len(),
        FUNCTIONS,
        "main.rs has functions that this test does not know: change FUNCTIONS"
    );
    let mut found = Vec::new();
    for (name, pins) in &there {
        match here.iter().find(|(other, _)| other == name) {
            None => found.push(format!(
                "{PAGE} lacks \"{name}\" of main.rs, on {pins:?}: add its rows"
            )),
            Some((_, others)) if others != pins => found.push(format!(
                "\"{name}\" is on {pins:?} in main.rs and on {others:?} in {PAGE}: change the one that \
                 disagrees with start() in image.rs"
            )),
            Some(_) => {}
        }
    }
    for (name, pins) in &here {
        if !there.iter().any(|(other, _)| other == name) {
            found.push(format!(
                "main.rs lacks \"{name}\" of {PAGE}, on {pins:?}: add a line there or take the rows out"
            ));
        }
    }
    expect_none(&found);
}

#[test]
fn the_page_names_the_pins_that_the_board_uses_and_no_others() {
    let (page, code) = (text(PAGE), board_code());
    let used: BTreeSet<_> = pins(&code).into_iter().chain(UNNAMED).collect();
    let named: BTreeSet<_> = pins(&page).into_iter().collect();
    let mut found = Vec::new();
    for pin in used.difference(&named) {
        found.push(format!(
            "{pin} is used in {BOARD} and not in {PAGE}: add its row"
        ));
    }
    for pin in named.difference(&used) {
        found.push(format!(
            "{pin} is in {PAGE} and not used in {BOARD}: take it out"
        ));
    }
    let rows = table(&page, "| function | pin | LQFP64 |");
    for column in [1, 2] {
        let mut seen = BTreeSet::new();
        for row in &rows {
            if row[column] != "–" && !seen.insert(row[column]) {
                let cell = row[column];
                found.push(format!(
                    "{cell} stands twice in the pin map of {PAGE}: one is wrong"
                ));
            }
        }
    }
    let picture = text("docs/images/hardware-blocks.svg");
    for pin in pins(&picture) {
        if !named.contains(pin) {
            found.push(format!(
                "{pin} is in hardware-blocks.svg and not in {PAGE}: mend the picture"
            ));
        }
    }
    expect_none(&found);
}

/// Returns the number that follows a text in the code of a file.
fn number_after(path: &str, before: &str) -> u64 {
    let source = text(path);
    let Some((_, rest)) = source.split_once(before) else {
        panic!("{path} has no {before:?} any more: change this test")
    };
    let digits: String = rest
        .chars()
        .filter(|letter| *letter != '_')
        .take_while(char::is_ascii_digit)
        .collect();
    digits
        .parse()
        .unwrap_or_else(|_| panic!("{path}: no number after {before:?}"))
}

/// Returns the regions of memory.x: name, start and length as it writes them.
fn regions(script: &str) -> Vec<(String, String, String)> {
    let field = |line: &str, name: &str| {
        let (_, rest) = line.split_once(name)?;
        let value = rest.trim_start_matches([' ', '=']);
        let end = value.find([',', ' ']).unwrap_or(value.len());
        Some(value[..end].to_owned())
    };
    script
        .lines()
        .filter_map(|line| {
            let name = line.split(':').next()?.trim().to_owned();
            Some((name, field(line, "ORIGIN")?, field(line, "LENGTH")?))
        })
        .collect()
}

#[test]
fn the_memory_is_that_of_the_linker_and_of_the_storage() {
    let (page, script) = (text(PAGE), text("memory.x"));
    let mut expected = regions(&script);
    assert_eq!(expected.len(), 2, "memory.x: {expected:?}");
    let bytes = 2 * number_after(&format!("{BOARD}/storage.rs"), "const PAGE: usize = ");
    // The STM32G474RE has 512 KB.
    let start = 0x0800_0000 + 512 * 1_024 - bytes;
    expected.push((
        "STORED".to_owned(),
        format!("{start:#010X}").replace("0X", "0x"),
        format!("{}K", bytes / 1_024),
    ));
    let rows = table(&page, "| region | start |");
    let named: Vec<_> = rows
        .iter()
        .filter_map(|row| {
            Some((
                quoted(row[0])?.to_owned(),
                row[1].to_owned(),
                row[2].to_owned(),
            ))
        })
        .collect();
    let mut found = Vec::new();
    for region in &expected {
        if !named.contains(region) {
            found.push(format!(
                "{PAGE} lacks {region:?} of memory.x or storage.rs: mend its row under Memory"
            ));
        }
    }
    for region in &named {
        if !expected.contains(region) {
            found.push(format!(
                "{PAGE} has {region:?}, memory.x and storage.rs have not: mend or drop the row"
            ));
        }
    }
    expect_none(&found);
}

#[test]
fn the_parts_stand_in_the_code_as_the_page_quotes_them() {
    let page = text(PAGE);
    let mut found = Vec::new();
    let mut held = 0;
    for row in table(&page, "| part | for each vertebra |") {
        let (Some(words), Some(path)) = (quoted(row[2]), quoted(row[3])) else {
            continue;
        };
        held += 1;
        if !text(path).contains(words) {
            found.push(format!(
                "{}: {path} no longer says \"{words}\": quote in {PAGE} what it says now",
                row[0]
            ));
        }
    }
    assert!(held >= 15, "only {held} parts are held to the code");
    expect_none(&found);
}
