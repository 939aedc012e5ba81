//! What the CANopen node costs on the target: instructions of each kind of frame, bytes of flash and RAM.

use std::fmt;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Map, Value, json};

use crate::cross;
use crate::cycles::Core;
use crate::image::{Image, Size};
use crate::process::{clean_root, run};

/// The frame that has a bound of its own: SYNC, upon which a vertebra applies a target and sends two TPDOs.
const SYNC: &str = "sync_two_tpdos";
/// What begins the names of what no frame of a vertebra's bus demands: time alone, calls of the platform,
/// and a node with more PDOs than a vertebra has.
const BESIDE: [&str; 3] = ["tick_", "call_", "four_pdos_"];
/// The fewest kinds of frames that are worth a maximum.
const LEAST_KINDS: usize = 20;
/// The parts of the node, each with what its functions' mangled names hold; the first that fits counts.
const PARTS: [(&str, &str); 8] = [
    ("SDO", "11eel_canopen3sdo"),
    ("LSS", "11eel_canopen3lss"),
    ("PDO", "11eel_canopen3pdo"),
    ("objects", "11eel_canopen7objects"),
    ("storing", "11eel_canopen6stored"),
    ("emergencies", "11eel_canopen9emergency"),
    ("rest of the node", "11eel_canopen"),
    ("dictionary", "12eel_protocol"),
];

/// Instructions for one kind of frame.
struct Cost {
    name: String,
    instructions: f64,
}

/// The figures of the node.
pub struct Node {
    costs: Vec<Cost>,
    /// What the image with node and dictionary has more than one without.
    size: Size,
    parts: Vec<(&'static str, u64)>,
}

impl Node {
    /// Builds the images for a processor, runs the measuring one and weighs the other.
    ///
    /// # Errors
    /// When an image can't be built or fails, or prints something else than costs.
    pub fn measure(core: &Core, emulator: &Path) -> Result<Self> {
        let mut build = cross::build_command()?;
        build.args(["-p", "board-qemu"]);
        for binary in ["frames", "node", "bare"] {
            build.args(["--bin", binary]);
        }
        run(&mut build)?;
        let printed = core.run(emulator, "frames", &["-icount", "shift=0,sleep=off"])?;
        let (size, parts) = weigh()?;
        Ok(Self {
            costs: read_costs(core, &printed)?,
            size,
            parts,
        })
    }

    /// Returns the dearest frame.
    fn dearest(&self) -> Option<&Cost> {
        let is_frame = |cost: &&Cost| !BESIDE.iter().any(|mark| cost.name.starts_with(mark));
        let frames = self.costs.iter().filter(is_frame);
        frames.max_by(|a, b| a.instructions.total_cmp(&b.instructions))
    }

    /// Returns what exceeds its bound in firmware/canopen/budget.json.
    ///
    /// # Errors
    /// When that can't be read.
    pub fn complaints(&self) -> Result<Vec<String>> {
        let path = clean_root().join("firmware/canopen/budget.json");
        let text = fs::read_to_string(&path)
            .with_context(|| format!("could not read {}", path.display()))?;
        let budget: Value = serde_json::from_str(&text)
            .with_context(|| format!("{} is no JSON", path.display()))?;
        Ok(self.complaints_about(&budget))
    }

    fn complaints_about(&self, budget: &Value) -> Vec<String> {
        let mut complaints = Vec::new();
        let mut hold =
            |what: &str, figure: Option<f64>, key: &str| match (figure, budget[key].as_f64()) {
                (Some(figure), Some(limit)) if figure <= limit => {}
                (Some(figure), Some(limit)) => {
                    complaints.push(format!("the node: {what} takes {figure}, budget {limit}"));
                }
                (None, _) => complaints.push(format!("the node: {what} is not measured")),
                (_, None) => complaints.push(format!("the node: {key} has no budget")),
            };
        let sync = self.costs.iter().find(|cost| cost.name == SYNC);
        hold("SYNC to two TPDOs", sync.map(|it| it.instructions), SYNC);
        let dearest = self.dearest();
        let name = dearest.map_or("a frame", |cost| &cost.name);
        hold(name, dearest.map(|it| it.instructions), "any_frame");
        hold("its flash", Some(self.size.flash as f64), "flash");
        hold("its RAM", Some(self.size.ram as f64), "ram");
        complaints
    }

    /// Returns all figures.
    pub fn to_json(&self) -> Value {
        let mut instructions = Map::new();
        for Cost {
            name,
            instructions: count,
        } in &self.costs
        {
            instructions.insert(name.clone(), json!(*count as i64));
        }
        let parts: Map<_, _> = self
            .parts
            .iter()
            .map(|(name, size)| ((*name).to_owned(), json!(size)))
            .collect();
        json!({
            "instructions": instructions,
            "dearest_frame": self.dearest().map(|cost| &cost.name),
            "flash": self.size.flash,
            "ram": self.size.ram,
            "flash_of_functions": parts,
        })
    }
}

impl fmt::Display for Node {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "instructions of the CANopen node for one frame")?;
        for Cost { name, instructions } in &self.costs {
            writeln!(out, "{name:<30}{instructions:>7}")?;
        }
        if let Some(Cost { name, instructions }) = self.dearest() {
            writeln!(out, "the dearest frame is {name}: {instructions}")?;
        }
        let parts = self
            .parts
            .iter()
            .map(|(name, size)| format!("{name} {size}"));
        let Size { flash, ram } = self.size;
        let known: u64 = self.parts.iter().map(|(_, size)| size).sum();
        write!(
            out,
            "node and dictionary: flash {flash} bytes ({}, tables and the rest {}), RAM {ram} bytes",
            parts.collect::<Vec<_>>().join(", "),
            flash.saturating_sub(known)
        )
    }
}

/// Reads the image's output: what nothing takes, then ticks of each kind of frame.
fn read_costs(core: &Core, text: &str) -> Result<Vec<Cost>> {
    let mut nothing = None;
    let mut costs = Vec::new();
    for line in text.lines() {
        let words: Vec<_> = line.split('\t').collect();
        match words[..] {
            ["nothing", ticks] => nothing = Some(ticks.parse::<f64>()?),
            ["failed", what] => bail!("the node does not do what is measured: {what}"),
            ["cost", name, ticks] => {
                let ticks = ticks.parse::<f64>()? - nothing.context("nothing was not measured")?;
                costs.push(Cost {
                    name: name.to_owned(),
                    // A tick is six instructions: at most so many.
                    instructions: ((ticks + 1.0) * 1_000.0 / core.ticks).ceil(),
                });
            }
            _ => bail!("unexpected: {line}"),
        }
    }
    ensure!(costs.len() >= LEAST_KINDS, "only {} frames", costs.len());
    Ok(costs)
}

/// Compares the image with the node and the one without it.
fn weigh() -> Result<(Size, Vec<(&'static str, u64)>)> {
    let (node, bare) = (
        Image::read(&cross::built("node"))?,
        Image::read(&cross::built("bare"))?,
    );
    let mut parts: Vec<_> = PARTS.iter().map(|(name, _)| (*name, 0)).collect();
    for (symbol, size) in node.functions()? {
        let fits = PARTS.iter().position(|(_, mark)| symbol.contains(mark));
        if let Some((_, sum)) = fits.and_then(|place| parts.get_mut(place)) {
            *sum += size;
        }
    }
    let (with, without) = (node.size()?, bare.size()?);
    let more = |with: u64, without: u64| {
        with.checked_sub(without)
            .context("an image with the node is smaller than one without")
    };
    let size = Size {
        flash: more(with.flash, without.flash)?,
        ram: more(with.ram, without.ram)?,
    };
    let sum: u64 = parts.iter().map(|(_, size)| size).sum();
    ensure!(
        sum > 0 && sum <= size.flash,
        "the functions of the node aren't in its image"
    );
    Ok((size, parts))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycles::CORES;

    fn printed(sync: u32, worst: u32) -> String {
        let mut text = format!("nothing\t2\ncost\t{SYNC}\t{sync}\ncost\ttick_late\t9999");
        for kind in 0..30 {
            text.push_str(&format!("\ncost\tframe_{kind}\t{}", worst - kind));
        }
        text
    }

    fn node(sync: u32, worst: u32) -> Node {
        Node {
            costs: read_costs(&CORES[0], &printed(sync, worst)).expect("well formed"),
            size: Size {
                flash: 16_000,
                ram: 3_000,
            },
            parts: Vec::new(),
        }
    }

    fn complaints(node: &Node) -> usize {
        let budget =
            json!({ "sync_two_tpdos": 1_500, "any_frame": 4_000, "flash": 16_384, "ram": 3_072 });
        node.complaints_about(&budget).len()
    }

    #[test]
    fn names_the_dearest_frame_but_no_tick() {
        let node = node(200, 600);
        let dearest = node.dearest().expect("frames");
        // 599 ticks at most, 168 in 1 000 instructions.
        assert_eq!(
            (dearest.name.as_str(), dearest.instructions),
            ("frame_0", 3_566.0)
        );
    }

    #[test]
    fn complains_of_each_figure_above_its_bound() {
        assert_eq!(complaints(&node(253, 673)), 0);
        assert_eq!(complaints(&node(254, 673)), 1);
        assert_eq!(complaints(&node(253, 674)), 1);
        let mut large = node(253, 673);
        large.size = Size {
            flash: 16_385,
            ram: 3_073,
        };
        assert_eq!(complaints(&large), 2);
        assert_eq!(node(1, 600).complaints_about(&json!({})).len(), 4);
    }

    #[test]
    fn refuses_an_output_that_was_cut_or_tells_of_a_failure() {
        let text = printed(200, 600);
        let core = &CORES[0];
        assert!(read_costs(core, text.get(..200).expect("long")).is_err());
        assert!(read_costs(core, &format!("{text}\nfailed\tstored")).is_err());
    }
}
