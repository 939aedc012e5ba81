//! How much stack the images can take: found in their code, held below half of what there is.
//!
//! The compiler says how large each function's frame is, the disassembly who calls whom, and `tables.rs`
//! who is called by a pointer. The main thread's deepest way and that of the worst handler of each
//! priority are taken to happen at once, each handler on top of an exception's frame.

mod code;
mod disassembly;
mod graph;
mod priorities;
mod tables;

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail};

use self::code::Code;
use self::graph::Depth;
use self::tables::Plan;
use crate::firmware::{self, Board};

/// What the processor pushes for an exception: 8 registers, 17 of the floating-point unit and a
/// reserved word, and one more word to align them.
const EXCEPTION: u64 = 8 * 4 + 18 * 4 + 4;
/// The most that the stack may take of its room, in percent.
const MOST: u64 = 50;
/// How many functions of a way are named.
const NAMED: usize = 3;

/// The deepest way of one handler, or of the main thread.
struct Row {
    name: String,
    /// What it can interrupt is of a higher number; the main thread has none.
    priority: Option<i32>,
    depth: Depth,
}

/// Builds both images, and holds the stack of each below its bound.
///
/// # Errors
/// When a build fails, the code can't be followed, or the stack can take too much.
pub fn check() -> Result<()> {
    firmware::build(None)?;
    let mut complaints = Vec::new();
    for board in Board::ALL {
        let name = board.package();
        let code = Code::read(&board.elf())?;
        let rows = rows(board, &code).with_context(|| format!("the stack of {name}"))?;
        let sum = sum(&rows);
        print(name, &rows, sum, code.room);
        if is_too_deep(sum, code.room) {
            complaints.push(format!(
                "the stack of {name} can take {sum} of {} bytes, more than {MOST} %",
                code.room
            ));
        }
    }
    if !complaints.is_empty() {
        bail!(
            "{}. The functions named above have the largest frames: keep large values in statics, \
             or pass them by reference",
            complaints.join("; ")
        );
    }
    Ok(())
}

/// Returns what is known of a board's image beside its code.
fn plan(board: Board) -> &'static Plan {
    match board {
        Board::Stm32g474 => &tables::STM32G474,
        Board::Qemu => &tables::QEMU,
    }
}

/// Finds the deepest way of the main thread and of each handler.
fn rows(board: Board, code: &Code) -> Result<Vec<Row>> {
    let plan = plan(board);
    let graph = code.graph(plan)?;
    let priorities = priorities::read(board)?;
    let mut rows = BTreeMap::new();
    for (place, address) in (1..).zip(&code.vectors) {
        let names: Vec<_> = code.names(*address).collect();
        let priority = priorities.of(place, &names);
        if *address == 0 || rows.contains_key(&(*address, priority)) {
            continue;
        }
        let name = priorities::name(place, &names);
        let depth = graph::deepest(&graph, *address, plan.recursions)?;
        rows.insert(
            (*address, priority),
            Row {
                name,
                priority,
                depth,
            },
        );
    }
    let mut rows: Vec<_> = rows.into_values().collect();
    rows.sort_by_key(|row| std::cmp::Reverse(row.priority.unwrap_or(i32::MAX)));
    priorities
        .complain_unless_used(&rows.iter().map(|row| row.name.as_str()).collect::<Vec<_>>())?;
    Ok(rows)
}

/// Adds the main thread and the worst handler of each priority, with the frame of its exception.
fn sum(rows: &[Row]) -> u64 {
    let mut worst: BTreeMap<Option<i32>, u64> = BTreeMap::new();
    for row in rows {
        let exception = if row.priority.is_some() { EXCEPTION } else { 0 };
        let bytes = worst.entry(row.priority).or_default();
        *bytes = (row.depth.bytes + exception).max(*bytes);
    }
    worst.values().sum()
}

fn is_too_deep(sum: u64, room: u64) -> bool {
    sum * 100 > room * MOST
}

/// Prints the deepest way of each handler, the sum, and the room.
fn print(board: &str, rows: &[Row], sum: u64, room: u64) {
    println!(
        "{board:<28}{:>8}{:>8}  largest frames on the deepest way",
        "priority", "bytes"
    );
    for row in rows {
        let priority = row.priority.map_or("–".to_owned(), |it| it.to_string());
        let mut frames = row.depth.path.clone();
        frames.sort_by_key(|(_, frame)| std::cmp::Reverse(*frame));
        let named = frames.iter().take(NAMED);
        let named: Vec<_> = named
            .map(|(name, frame)| format!("{frame} {}", shorten(name)))
            .collect();
        println!(
            "  {:<26}{priority:>8}{:>8}  {}",
            row.name,
            row.depth.bytes,
            named.join(", ")
        );
    }
    println!(
        "  main thread, the worst of each priority and {EXCEPTION} bytes for each exception: \
         {sum} of {room} bytes, {:.1} %",
        sum as f64 * 100.0 / room as f64
    );
}

/// Cuts a long name.
fn shorten(name: &str) -> String {
    const LONGEST: usize = 60;
    if name.chars().count() <= LONGEST {
        return name.to_owned();
    }
    let start: String = name.chars().take(LONGEST - 1).collect();
    format!("{start}…")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(priority: Option<i32>, bytes: u64) -> Row {
        Row {
            name: String::new(),
            priority,
            depth: Depth {
                bytes,
                path: Vec::new(),
            },
        }
    }

    #[test]
    fn adds_the_worst_of_each_priority_with_an_exception_each() {
        let rows = [
            row(None, 1_000),
            row(Some(7), 300),
            row(Some(0), 50),
            row(Some(0), 200),
        ];
        assert_eq!(sum(&rows), 1_000 + 300 + 200 + 2 * 108);
    }

    #[test]
    fn half_of_the_room_is_allowed_and_a_byte_more_is_not() {
        assert!(!is_too_deep(500, 1_000));
        assert!(is_too_deep(501, 1_000));
    }
}
