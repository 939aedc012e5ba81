//! Who calls whom with how large a frame, and how deep that goes at most.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail, ensure};

/// A function: its name, its frame in bytes, and the addresses of those that it may call.
#[derive(Clone, Debug, Default)]
pub struct Function {
    pub name: String,
    pub frame: u64,
    pub calls: BTreeSet<u64>,
}

/// All functions by their address.
pub type Graph = BTreeMap<u64, Function>;

/// Functions that call each other in a circle, and how often that can happen.
pub struct Recursion {
    /// What the name of each of them holds, or of some.
    pub parts: &'static [&'static str],
    /// How many frames of each are on the stack at most.
    pub times: u64,
}

/// The deepest way down from a function.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Depth {
    /// All frames together, in bytes.
    pub bytes: u64,
    /// Each function on the way with its frame, from the top.
    pub path: Vec<(String, u64)>,
}

/// Finds the deepest way down from a function.
///
/// # Errors
/// When a function is called that isn't there, or there is recursion without a bound.
pub fn deepest(graph: &Graph, start: u64, recursions: &[Recursion]) -> Result<Depth> {
    let mut search = Search {
        graph,
        recursions,
        known: BTreeMap::new(),
    };
    search.depth(start)
}

/// Returns every function that may run below a start, and the start.
///
/// # Errors
/// When a function is called that isn't there.
pub fn reachable(graph: &Graph, start: u64) -> Result<BTreeSet<u64>> {
    let (mut seen, mut waiting) = (BTreeSet::new(), vec![start]);
    while let Some(address) = waiting.pop() {
        if seen.insert(address) {
            waiting.extend(&get(graph, address)?.calls);
        }
    }
    Ok(seen)
}

fn get(graph: &Graph, address: u64) -> Result<&Function> {
    let function = graph.get(&address);
    function.with_context(|| format!("no function begins at {address:#010x}"))
}

/// A search that knows what it has found already.
struct Search<'a> {
    graph: &'a Graph,
    recursions: &'a [Recursion],
    known: BTreeMap<u64, Depth>,
}

impl Search<'_> {
    /// Finds the deepest way down from a function.
    fn depth(&mut self, address: u64) -> Result<Depth> {
        if let Some(depth) = self.known.get(&address) {
            return Ok(depth.clone());
        }
        let circle = self.circle(address)?;
        let mut depth = self.own(address, &circle)?;
        let mut below = Depth::default();
        for member in &circle {
            for callee in get(self.graph, *member)?.calls.difference(&circle) {
                let found = self.depth(*callee)?;
                if found.bytes > below.bytes {
                    below = found;
                }
            }
        }
        depth.bytes += below.bytes;
        depth.path.extend(below.path);
        for member in circle {
            self.known.insert(member, depth.clone());
        }
        Ok(depth)
    }

    /// Returns a function and those that it calls and that lead back to it.
    fn circle(&self, address: u64) -> Result<BTreeSet<u64>> {
        let mut circle = BTreeSet::from([address]);
        for other in reachable(self.graph, address)? {
            if reachable(self.graph, other)?.contains(&address) {
                circle.insert(other);
            }
        }
        Ok(circle)
    }

    /// Returns what the frames take of one function, or of a circle as often as its bound allows.
    fn own(&self, address: u64, circle: &BTreeSet<u64>) -> Result<Depth> {
        let function = get(self.graph, address)?;
        if circle.len() == 1 && !function.calls.contains(&address) {
            return Ok(Depth {
                bytes: function.frame,
                path: vec![(function.name.clone(), function.frame)],
            });
        }
        let members: Vec<_> = circle.iter().filter_map(|it| self.graph.get(it)).collect();
        let names: Vec<_> = members.iter().map(|it| it.name.as_str()).collect();
        let fits = |recursion: &&Recursion| {
            let mut names = names.iter();
            names.all(|name| recursion.parts.iter().any(|part| name.contains(part)))
        };
        let Some(recursion) = self.recursions.iter().find(fits) else {
            bail!(
                "recursion without a bound: {}. End it, or say in \
                 host-tools/xtask/src/stack/tables.rs how deep it goes and why",
                names.join(", ")
            );
        };
        ensure!(recursion.times > 0, "a recursion that never runs is none");
        let bytes = recursion.times * members.iter().map(|it| it.frame).sum::<u64>();
        let name = format!("{} × ({})", recursion.times, names.join(" + "));
        Ok(Depth {
            bytes,
            path: vec![(name, bytes)],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Functions with frames of 8, 16, 24, … bytes, and the calls between them.
    fn graph(calls: &[&[u64]]) -> Graph {
        let functions = calls.iter().zip(0..).map(|(calls, address)| {
            let function = Function {
                name: format!("f{address}"),
                frame: 8 * (address + 1),
                calls: calls.iter().copied().collect(),
            };
            (address, function)
        });
        functions.collect()
    }

    fn names(depth: &Depth) -> Vec<&str> {
        depth.path.iter().map(|(name, _)| name.as_str()).collect()
    }

    #[test]
    fn takes_the_deepest_of_several_ways() {
        // 0 → 1 → 3 is 8 + 16 + 32, 0 → 2 is 8 + 24; 4 stands alone.
        let graph = graph(&[&[1, 2], &[3], &[], &[], &[]]);
        let depth = deepest(&graph, 0, &[]).unwrap();
        assert_eq!(depth.bytes, 56);
        assert_eq!(names(&depth), ["f0", "f1", "f3"]);
        assert_eq!(deepest(&graph, 4, &[]).unwrap().bytes, 40);
    }

    #[test]
    fn a_function_called_by_two_counts_once_on_each_way() {
        let graph = graph(&[&[1, 2], &[3], &[3], &[]]);
        assert_eq!(deepest(&graph, 0, &[]).unwrap().bytes, 8 + 24 + 32);
    }

    #[test]
    fn refuses_recursion_without_a_bound() {
        for calls in [&[&[0][..]][..], &[&[1], &[2], &[1]]] {
            let error = deepest(&graph(calls), 0, &[]).unwrap_err().to_string();
            assert!(error.contains("recursion without a bound"), "{error}");
        }
        // One of the circle isn't in the table.
        let bounds = [Recursion {
            parts: &["f1"],
            times: 2,
        }];
        assert!(deepest(&graph(&[&[1], &[2], &[1]]), 0, &bounds).is_err());
    }

    #[test]
    fn recursion_with_a_bound_takes_all_its_frames_so_often() {
        // 0 → (1 ⇄ 2) → 3
        let graph = graph(&[&[1], &[2], &[1, 3], &[]]);
        let bounds = [Recursion {
            parts: &["f1", "f2"],
            times: 3,
        }];
        let depth = deepest(&graph, 0, &bounds).unwrap();
        assert_eq!(depth.bytes, 8 + 3 * (16 + 24) + 32);
        assert_eq!(names(&depth), ["f0", "3 × (f1 + f2)", "f3"]);
    }

    #[test]
    fn refuses_a_call_into_nowhere() {
        let error = deepest(&graph(&[&[7]]), 0, &[]).unwrap_err().to_string();
        assert!(error.contains("0x00000007"), "{error}");
    }
}
