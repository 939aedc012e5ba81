//! What llvm-objdump prints: per function its calls, its pushes, and the addresses that it makes.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail, ensure};

/// Conditions that a branch can have in its name.
const CONDITIONS: [&str; 17] = [
    "eq", "ne", "hs", "cs", "lo", "cc", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le",
    "al",
];

/// A function as it is disassembled.
#[derive(Debug, Default)]
pub struct Body {
    /// Its demangled name, without the compiler's hash.
    pub name: String,
    /// Where it calls, and where it jumps, in itself or as the last thing that it does.
    pub calls: BTreeSet<u64>,
    pub jumps: BTreeSet<u64>,
    /// Whether it calls what is in a register.
    pub calls_indirectly: bool,
    /// What all its pushes and subtractions take from the stack.
    pub pushed: u64,
    /// Numbers that it makes or keeps and that can be addresses.
    pub words: BTreeSet<u64>,
    /// Whether its last instruction lets the processor go on with the next function.
    pub falls_through: bool,
}

/// One line of code.
struct Instruction<'a> {
    /// Without the suffix for its width.
    name: &'a str,
    operands: &'a str,
}

/// Reads the output of `llvm-objdump -d --demangle --no-show-raw-insn`.
///
/// `sizes` has those of functions in bytes, as far as they are known: what is behind is the linker's
/// filling.
///
/// # Errors
/// When a function does something to its stack or to the program counter that can't be followed.
pub fn read(text: &str, sizes: &BTreeMap<u64, u64>) -> Result<BTreeMap<u64, Body>> {
    let mut bodies = BTreeMap::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        let Some((address, name)) = read_label(line) else {
            continue;
        };
        let end = sizes.get(&address).map_or(u64::MAX, |size| address + size);
        let mut code = Vec::new();
        while let Some(line) = lines.next_if(|line| read_label(line).is_none()) {
            code.extend(read_instruction(line, end));
        }
        let body = read_body(&code).with_context(|| format!("in {name}"))?;
        bodies.insert(address, Body { name, ..body });
    }
    Ok(bodies)
}

/// Reads a line such as `08000230 <ADC1_2>:`.
fn read_label(line: &str) -> Option<(u64, String)> {
    let (address, name) = line.strip_suffix(">:")?.split_once(" <")?;
    let address = u64::from_str_radix(address, 16).ok()?;
    Some((address, without_hash(name).to_owned()))
}

/// Takes the hash away that the older mangling ends with.
fn without_hash(name: &str) -> &str {
    match name.rsplit_once("::h") {
        Some((name, hash)) if hash.len() == 16 && hash.bytes().all(|it| it.is_ascii_hexdigit()) => {
            name
        }
        _ => name,
    }
}

/// Reads a line before the function's end: address, colon, name and operands behind a tab each, and
/// maybe a comment behind `@`.
fn read_instruction(line: &str, end: u64) -> Option<Instruction<'_>> {
    let (address, rest) = line.split_once(':')?;
    if u64::from_str_radix(address.trim(), 16).ok()? >= end {
        return None;
    }
    let mut columns = rest.splitn(3, '\t').skip(1);
    let name = columns.next()?.trim();
    let operands = columns.next().unwrap_or_default();
    let operands = operands.split(" @").next().unwrap_or_default().trim();
    let name = name.strip_suffix(".w").unwrap_or(name);
    Some(Instruction { name, operands })
}

fn read_body(code: &[Instruction<'_>]) -> Result<Body> {
    let mut body = Body {
        falls_through: true,
        ..Body::default()
    };
    let mut halves = BTreeMap::new();
    for (place, it) in code.iter().enumerate() {
        if it.name.starts_with('.') {
            body.words.extend(number(it.operands));
            continue;
        }
        body.pushed += pushed(it).with_context(|| format!("at {} {}", it.name, it.operands))?;
        body.words.extend(join_halves(it, &mut halves));
        let flow = flow(it, &code[place + 1..])?;
        match flow {
            Flow::Call(target) => drop(body.calls.insert(target)),
            Flow::Jump(target) | Flow::Leap(target) => drop(body.jumps.insert(target)),
            Flow::Indirect => body.calls_indirectly = true,
            Flow::On | Flow::End => {}
        }
        if it.name != "nop" {
            // What ends in a call ends in one that never returns.
            body.falls_through = matches!(flow, Flow::On | Flow::Jump(_));
        }
    }
    Ok(body)
}

/// What comes after an instruction.
enum Flow {
    /// The next one, maybe.
    On,
    /// A function, and then the next.
    Call(u64),
    /// A place, or the next instruction.
    Jump(u64),
    /// A place.
    Leap(u64),
    /// A function whose address is in a register.
    Indirect,
    /// The caller, or nothing.
    End,
}

/// Tells what comes after an instruction; `rest` is what follows it in memory.
fn flow(it: &Instruction<'_>, rest: &[Instruction<'_>]) -> Result<Flow> {
    let (name, has_condition) = without_condition(it.name);
    let first = it.operands.split(',').next().unwrap_or_default();
    let flow = match name {
        "bl" => Flow::Call(target(it)?),
        "b" if has_condition => Flow::Jump(target(it)?),
        "b" => Flow::Leap(target(it)?),
        "cbz" | "cbnz" => Flow::Jump(target(it)?),
        "bx" if first == "lr" => Flow::End,
        "bx" | "blx" => Flow::Indirect,
        "pop" | "ldm" | "ldmia" | "ldmdb" if it.operands.contains("pc") => Flow::End,
        "ldr" if it.operands.starts_with("pc, [sp], ") => Flow::End,
        "tbb" | "tbh" | "udf" => Flow::End,
        // A table of branches, which stands right behind.
        "mov" if first == "pc" => {
            let next = rest.iter().find(|next| next.name != "nop");
            ensure!(
                next.is_some_and(|next| next.name == "b"),
                "mov {}: a jump that no table follows",
                it.operands
            );
            Flow::End
        }
        _ if first == "pc" && !name.starts_with("cmp") => Flow::Indirect,
        _ => Flow::On,
    };
    Ok(match flow {
        Flow::End if has_condition => Flow::On,
        flow => flow,
    })
}

/// Splits the condition from the name of a branch or of a return.
fn without_condition(name: &str) -> (&str, bool) {
    for stem in ["blx", "bx", "bl", "b", "pop"] {
        let condition = name.strip_prefix(stem);
        if condition.is_some_and(|condition| CONDITIONS.contains(&condition)) {
            return (stem, true);
        }
    }
    (name, false)
}

/// Returns the address that a branch names.
fn target(it: &Instruction<'_>) -> Result<u64> {
    let place = it.operands.split(" <").next().unwrap_or_default();
    let place = place.rsplit([' ', '\t']).next().unwrap_or_default();
    number(place).with_context(|| format!("{} {}: no address", it.name, it.operands))
}

/// Reads a number in either base, with or without `#`.
fn number(text: &str) -> Option<u64> {
    let text = text.trim().trim_start_matches('#');
    match text.strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

/// Returns how many bytes an instruction takes from the stack.
fn pushed(it: &Instruction<'_>) -> Result<u64> {
    let operands = it.operands;
    if let Some(list) = operands.split_once('{').map(|(_, list)| list) {
        let stores = it.name.starts_with("stmdb") && operands.starts_with("sp!");
        let pushes = it.name.starts_with("push") || it.name.starts_with("vpush");
        return if stores || pushes {
            size_of_list(list)
        } else {
            Ok(0)
        };
    }
    if it.name.starts_with("str") && operands.contains("[sp, #-") && operands.ends_with("]!") {
        let size = operands.split("[sp, #-").nth(1);
        let size = size.and_then(|text| number(text.trim_end_matches("]!")));
        return size.context("a store without an offset");
    }
    if operands.split(',').next() != Some("sp") || it.name.starts_with("cmp") {
        return Ok(0);
    }
    let last = operands.rsplit(", ").next().unwrap_or_default();
    match (it.name, number(last)) {
        ("sub" | "subw", Some(bytes)) if last.starts_with('#') => Ok(bytes),
        ("add" | "addw", Some(_)) if last.starts_with('#') => Ok(0),
        _ => bail!("the stack changes by a number that is not known"),
    }
}

/// Returns how many bytes the registers of a list such as `r4, r6-r8, lr}` take.
fn size_of_list(list: &str) -> Result<u64> {
    let mut size = 0;
    for range in list.trim_end_matches('}').split(',') {
        let (first, last) = range.trim().split_once('-').unwrap_or((range.trim(), ""));
        let index = |name: &str| name.get(1..).and_then(|digits| digits.parse::<u64>().ok());
        let count = match (index(first), index(last)) {
            (Some(first), Some(last)) => last.checked_sub(first).context("a range backwards")? + 1,
            _ if last.is_empty() => 1,
            _ => bail!("a range of registers that is not known: {range}"),
        };
        size += count * if first.starts_with('d') { 8 } else { 4 };
    }
    Ok(size)
}

/// Returns the number of which an instruction is the upper half; `halves` keeps the lower ones.
fn join_halves<'a>(it: &Instruction<'a>, halves: &mut BTreeMap<&'a str, u64>) -> Option<u64> {
    let (register, half) = it.operands.split_once(", ")?;
    let half = number(half)?;
    if it.name.starts_with("movw") {
        halves.insert(register, half);
        return None;
    }
    let low = halves
        .get(register)
        .filter(|_| it.name.starts_with("movt"))?;
    Some(half << 16 | low)
}

#[cfg(test)]
#[path = "disassembly_tests.rs"]
mod tests;
