//! An image's functions: frames from the compiler, calls from the disassembly, addresses that it keeps.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

use super::disassembly::{self, Body};
use super::graph::{Function, Graph};
use super::tables::{Indirect, Plan};
use crate::image::RAM;
use crate::llvm;
use crate::process::{command, output};

/// The fewest functions that an image has.
const LEAST_FUNCTIONS: usize = 100;

/// What the search needs of an image.
pub struct Code {
    bodies: BTreeMap<u64, Body>,
    /// What the compiler says of each function's frame; of one in assembly it says nothing.
    frames: BTreeMap<u64, u64>,
    /// The functions whose address is in data, or made by code.
    kept: BTreeSet<u64>,
    /// Mangled names, for one address often several.
    names: BTreeMap<u64, Vec<String>>,
    /// The functions of the vector table without the first, by their place.
    pub vectors: Vec<u64>,
    /// The bytes of RAM from the last variable to where the stack begins.
    pub room: u64,
}

impl Code {
    /// Reads and disassembles an ELF file.
    ///
    /// # Errors
    /// When it lacks what the compiler says of frames, or can't be followed.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("no {}", path.display()))?;
        let file = object::File::parse(bytes.as_slice())?;
        let mut objdump = command(llvm::tool("llvm-objdump")?);
        objdump.args(["--disassemble", "--demangle", "--no-show-raw-insn"]);
        let (mut names, mut sizes) = (BTreeMap::<u64, Vec<String>>::new(), BTreeMap::new());
        for symbol in file.symbols().filter(|it| it.kind() == SymbolKind::Text) {
            let address = symbol.address() & !1;
            names
                .entry(address)
                .or_default()
                .push(symbol.name()?.to_owned());
            if symbol.size() > 0 {
                let size = sizes.entry(address).or_insert(symbol.size());
                *size = symbol.size().max(*size);
            }
        }
        let bodies = disassembly::read(&output(objdump.arg(path))?, &sizes)?;
        let frames = read_frames(section(&file, ".stack_sizes")?)?;
        ensure!(
            bodies.len() > LEAST_FUNCTIONS && frames.len() > LEAST_FUNCTIONS,
            "only {} functions and {} frames: the check proves nothing",
            bodies.len(),
            frames.len()
        );
        let vectors = words(section(&file, ".vector_table")?);
        let (top, vectors) = vectors.split_first().context("no vector table")?;
        let in_ram = file.sections().filter(|it| RAM.contains(&it.address()));
        let bottom = in_ram.map(|it| it.address() + it.size()).max();
        let kept = kept(&file, &bodies)?;
        Ok(Self {
            bodies,
            frames,
            kept,
            names,
            vectors: vectors.iter().map(|vector| vector & !1).collect(),
            room: top - bottom.unwrap_or(RAM.start),
        })
    }

    /// Returns all names of a function.
    pub fn names(&self, address: u64) -> impl Iterator<Item = &str> {
        let mangled = self.names.get(&address).into_iter().flatten();
        let demangled = self.bodies.get(&address).map(|body| body.name.as_str());
        demangled.into_iter().chain(mangled.map(String::as_str))
    }

    /// Puts calls together: direct ones, jumps into others, and what the plan says of indirect ones.
    ///
    /// # Errors
    /// When the plan has nothing on an indirect call, or on a function whose address is kept, or more
    /// than there is.
    pub fn graph(&self, plan: &Plan) -> Result<Graph> {
        let mut graph = Graph::new();
        let mut complaints = Vec::new();
        for (address, body) in &self.bodies {
            let mut calls = self.direct(*address, body)?;
            if body.calls_indirectly {
                match plan.calls.iter().find(|entry| entry.is_from(&body.name)) {
                    Some(entry) => calls.extend(self.targets(entry)),
                    None => complaints.push(format!("{} calls by a pointer", body.name)),
                }
            }
            let function = Function {
                name: body.name.clone(),
                frame: self.frame(*address, body),
                calls,
            };
            graph.insert(*address, function);
        }
        complaints.extend(self.complaints(plan));
        if !complaints.is_empty() {
            bail!(
                "{}.\nhost-tools/xtask/src/stack/tables.rs has to say who is called by a pointer, \
                 and no more than that",
                complaints.join("\n")
            );
        }
        Ok(graph)
    }

    /// Returns where a function calls and where it ends with a jump into another.
    fn direct(&self, address: u64, body: &Body) -> Result<BTreeSet<u64>> {
        let mut calls = body.calls.clone();
        for jump in &body.jumps {
            let into = self.bodies.range(..=*jump).next_back();
            let into = into.map(|(start, _)| *start);
            if into != Some(address) {
                calls.insert(*jump);
            }
        }
        if body.falls_through {
            let next = self.bodies.range(address + 1..).next();
            calls.extend(next.map(|(start, _)| *start));
        }
        for callee in &calls {
            ensure!(
                self.bodies.contains_key(callee),
                "{} goes to {callee:#010x}, where no function begins",
                body.name
            );
        }
        Ok(calls)
    }

    /// Returns a function's frame: what the compiler says, and no less than its pushes take.
    fn frame(&self, address: u64, body: &Body) -> u64 {
        let said = self.frames.get(&address).copied();
        said.unwrap_or_default().max(body.pushed)
    }

    /// Returns whom an indirect call can reach.
    fn targets(&self, entry: &Indirect) -> impl Iterator<Item = u64> {
        let fits = |name: &str| entry.to.iter().any(|part| name.contains(part));
        let kept = self.kept.iter().copied();
        kept.filter(move |address| self.names(*address).any(fits))
    }

    /// Says which function is called by nobody although its address is kept, and which part of the
    /// plan fits nothing.
    fn complaints(&self, plan: &Plan) -> Vec<String> {
        let mut complaints = Vec::new();
        let said: BTreeSet<_> = plan.calls.iter().flat_map(|it| self.targets(it)).collect();
        let idle = |address: u64| {
            let mut names = self.names(address);
            names.any(|name| plan.idle.iter().any(|part| name.contains(part)))
        };
        for address in self.kept.difference(&said).filter(|it| !idle(**it)) {
            let name = self.names(*address).next().unwrap_or_default();
            complaints.push(format!("{name} has its address kept, and nobody calls it"));
        }
        let kept: Vec<_> = self.kept.iter().flat_map(|it| self.names(*it)).collect();
        let parts = plan.calls.iter().flat_map(|entry| entry.to);
        for part in parts.chain(plan.idle) {
            if !kept.iter().any(|name| name.contains(part)) {
                complaints.push(format!("no address of a {part:?} is kept"));
            }
        }
        for entry in plan.calls {
            let mut callers = self.bodies.values().filter(|it| it.calls_indirectly);
            if !callers.any(|body| entry.is_from(&body.name)) {
                complaints.push(format!("no {:?} calls by a pointer", entry.from));
            }
        }
        complaints
    }
}

fn section<'a>(file: &object::File<'a>, name: &str) -> Result<&'a [u8]> {
    let section = file.section_by_name(name);
    let section = section.with_context(|| format!("the image has no section {name}"))?;
    Ok(section.data()?)
}

/// Reads little-endian words.
fn words(bytes: &[u8]) -> Vec<u64> {
    let (words, _) = bytes.as_chunks::<4>();
    words
        .iter()
        .map(|it| u64::from(u32::from_le_bytes(*it)))
        .collect()
}

/// Reads what the compiler says of frames: the function's address, and the size in LEB128.
fn read_frames(mut bytes: &[u8]) -> Result<BTreeMap<u64, u64>> {
    let mut frames = BTreeMap::new();
    while let Some((address, rest)) = bytes.split_first_chunk::<4>() {
        bytes = rest;
        let mut size = 0;
        for shift in (0..64).step_by(7) {
            let (byte, rest) = bytes.split_first().context("a frame without a size")?;
            bytes = rest;
            size |= u64::from(byte & 0x7F) << shift;
            if *byte < 0x80 {
                break;
            }
        }
        let address = u64::from(u32::from_le_bytes(*address)) & !1;
        let largest = frames.entry(address).or_insert(size);
        *largest = size.max(*largest);
    }
    ensure!(bytes.is_empty(), "a frame without an address");
    Ok(frames)
}

/// Returns the functions whose address is in data, or in code but not in a branch.
fn kept(file: &object::File<'_>, bodies: &BTreeMap<u64, Body>) -> Result<BTreeSet<u64>> {
    let mut all: BTreeSet<u64> = bodies
        .values()
        .flat_map(|body| body.words.iter().copied())
        .collect();
    for section in file.sections() {
        let is_data = matches!(
            section.kind(),
            SectionKind::Data | SectionKind::ReadOnlyData | SectionKind::ReadOnlyString
        );
        if is_data && section.address() != 0 && section.name()? != ".vector_table" {
            all.extend(words(section.data()?));
        }
    }
    // A function's address is odd, as the processor has no other instructions than Thumb.
    let odd = all.iter().filter(|word| *word & 1 == 1);
    let functions = odd.map(|word| word & !1);
    Ok(functions.filter(|it| bodies.contains_key(it)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two functions that call by a pointer and two whose address is kept.
    fn code() -> Code {
        let body = |name: &str, calls_indirectly, jumps: &[u64]| Body {
            name: name.to_owned(),
            calls_indirectly,
            jumps: jumps.iter().copied().collect(),
            pushed: 8,
            ..Body::default()
        };
        Code {
            bodies: BTreeMap::from([
                (0x100, body("executor", true, &[0x110, 0x200])),
                (0x200, body("node", true, &[])),
                (0x300, body("task::poll", false, &[])),
                (0x400, body("waker::wake", false, &[])),
            ]),
            frames: BTreeMap::from([(0x100, 24), (0x300, 4)]),
            kept: BTreeSet::from([0x300, 0x400]),
            names: BTreeMap::new(),
            vectors: Vec::new(),
            room: 1_000,
        }
    }

    const COMPLETE: Plan = Plan {
        calls: &[
            Indirect {
                from: "executor",
                to: &["::poll"],
            },
            Indirect {
                from: "node",
                to: &["waker::"],
            },
        ],
        idle: &[],
        recursions: &[],
    };

    #[test]
    fn puts_frames_jumps_and_pointers_together() {
        let graph = code().graph(&COMPLETE).unwrap();
        assert_eq!(graph[&0x100].frame, 24);
        assert_eq!(graph[&0x100].calls, BTreeSet::from([0x200, 0x300]));
        assert_eq!(graph[&0x200].calls, BTreeSet::from([0x400]));
        // Its pushes take more than the compiler says.
        assert_eq!(graph[&0x300].frame, 8);
    }

    #[test]
    fn refuses_a_plan_that_says_too_little_or_too_much() {
        let error = |plan: &Plan| code().graph(plan).unwrap_err().to_string();
        let plan = Plan {
            calls: &COMPLETE.calls[..1],
            idle: &["waker::"],
            ..COMPLETE
        };
        assert!(error(&plan).starts_with("node calls by a pointer."));
        let plan = Plan {
            calls: &[
                Indirect {
                    from: "executor",
                    to: &["::poll"],
                },
                Indirect {
                    from: "node",
                    to: &["::poll"],
                },
            ],
            ..COMPLETE
        };
        assert!(error(&plan).starts_with("waker::wake has its address kept"));
        let plan = Plan {
            idle: &["gone"],
            ..COMPLETE
        };
        assert!(error(&plan).starts_with("no address of a \"gone\" is kept"));
        let mut without = code();
        without.bodies.remove(&0x200);
        without.bodies.insert(0x200, Body::default());
        let complaints = without.graph(&COMPLETE).unwrap_err().to_string();
        assert!(complaints.starts_with("no \"node\" calls by a pointer"));
    }

    #[test]
    fn refuses_a_jump_into_the_midst_of_another_function() {
        let mut code = code();
        let body = code.bodies.get_mut(&0x200).unwrap();
        body.jumps.insert(0x304);
        let error = code.graph(&COMPLETE).unwrap_err().to_string();
        assert!(error.contains("goes to 0x00000304"), "{error}");
    }

    #[test]
    fn reads_the_compiler_s_frames() {
        let bytes = [0x01, 0x10, 0, 0x08, 0xE8, 0x79, 0x41, 0x10, 0, 0x08, 0x18];
        let frames = read_frames(&bytes).unwrap();
        assert_eq!(
            frames,
            BTreeMap::from([(0x0800_1000, 15_592), (0x0800_1040, 24)])
        );
        assert!(read_frames(&bytes[..5]).is_err());
        assert!(read_frames(&bytes[..9]).is_err());
    }
}
