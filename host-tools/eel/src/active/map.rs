//! `eel map`: in which order the line beside the bus goes through the vertebrae.

use std::collections::BTreeSet;
use std::io::{Write, stdout};
use std::thread::sleep;
use std::time::Duration;

use anyhow::Result;
use clap::Args;
use eel_client::{Client, ClientError, Method, Multiplexor};
use eel_protocol::VERTEBRAE;
use serde_json::json;

use super::bus::{AnyBus, BusOption};

const IN: Multiplexor = Multiplexor::new(0x2070, 1);
const OUT: Multiplexor = Multiplexor::new(0x2070, 2);
/// What OUT does.
const AUTO: u8 = 0;
const LOW: u8 = 1;
const HIGH: u8 = 2;
/// How long heartbeats are awaited.
const HEARD: Duration = Duration::from_millis(600);
/// Time in which a level reaches the next vertebra's control tick, with time to spare.
const SETTLED: Duration = Duration::from_millis(10);

const AFTER: &str = "\
Each vertebra has a line IN and a line OUT beside the bus, OUT of one leading to IN of the next. OUT is
high once a vertebra has a node id, and a vertebra without one takes part in a search only while its IN is
high: so `eel lss assign 1 2 3 4 5 6 7 8 9 10 --store` numbers a new spine from head to tail by itself.

map checks that: it lowers every OUT, raises one after the other, and looks whose IN follows. It moves
nothing. `eel head` does the same before each start, and refuses to lead a spine whose ids fall somewhere.

--json: one object: chain (array of {place, node, serial (numbers)}, from head to tail), ordered (boolean:
node ids rise without a gap), unreached (array of node ids whose IN nobody raised).

Exit codes: 0 the ids are 1, 2, 3 … from head to tail; 1 they are not, or a vertebra refuses or is silent;
2 wrong usage; 3 the bus failed.

Examples:
  eel map
  eel map && eel head can0 --gait swim --yes";

/// Show in which order vertebrae are connected, and check it against their node ids
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Map {
    #[command(flatten)]
    bus: BusOption,
    /// Write one JSON object (schema below)
    #[arg(long)]
    json: bool,
}

/// What raising one OUT after the other showed.
#[derive(Debug)]
struct Levels {
    /// Whose IN is high while every OUT is low.
    first: Vec<u8>,
    /// Whose IN each one's OUT raises.
    raised: Vec<(u8, Vec<u8>)>,
}

/// What the line tells.
#[derive(Debug, Default, PartialEq, Eq)]
struct Order {
    /// Node ids from head to tail.
    chain: Vec<u8>,
    /// Those that are on the bus and not in it.
    unreached: Vec<u8>,
}

impl Order {
    /// Follows the line from the vertebra whose IN is high while every OUT is low.
    fn new(nodes: &[u8], levels: &Levels) -> Self {
        let Levels { first, raised } = levels;
        let mut chain = Vec::new();
        let mut next = match first[..] {
            [one] => Some(one),
            _ => None,
        };
        let mut seen = BTreeSet::new();
        while let Some(node) = next.filter(|node| seen.insert(*node)) {
            chain.push(node);
            let follower = raised.iter().find(|(other, _)| *other == node);
            next = match follower.map(|(_, followers)| &followers[..]) {
                Some([one]) => Some(*one),
                _ => None,
            };
        }
        let others = nodes.iter().filter(|node| !seen.contains(node));
        Self {
            unreached: others.copied().collect(),
            chain,
        }
    }

    /// Tells whether ids rise from 1 on without a gap, and nobody is left out.
    fn is_in_order(&self) -> bool {
        self.unreached.is_empty() && self.chain.iter().copied().eq(1..=self.chain.len() as u8)
    }
}

impl Map {
    /// Looks, and returns 1 where the order is not that of the ids.
    pub fn run(&self) -> Result<u64> {
        let mut client = self.bus.client()?;
        let nodes = find_vertebrae(&mut client)?;
        if nodes.is_empty() {
            eprintln!("eel: no vertebra is heard: those without an id get one by `eel lss assign`");
            return Ok(1);
        }
        let order = Order::new(&nodes, &look(&mut client, &nodes)?);
        let mut rows = Vec::new();
        for (place, node) in order.chain.iter().enumerate() {
            let serial = client.identify(*node)?.address.serial;
            rows.push((place + 1, *node, serial));
        }
        let is_in_order = order.is_in_order();
        if self.json {
            let rows: Vec<_> = rows
                .iter()
                .map(
                    |(place, node, serial)| json!({"place": place, "node": node, "serial": serial}),
                )
                .collect();
            let all = json!({"chain": rows, "ordered": is_in_order, "unreached": order.unreached});
            writeln!(stdout(), "{all}")?;
        } else {
            self.show(&rows, &order)?;
        }
        Ok(u64::from(!is_in_order))
    }

    fn show(&self, rows: &[(usize, u8, u32)], order: &Order) -> Result<()> {
        let mut out = stdout().lock();
        writeln!(out, "place  node  serial")?;
        for (place, node, serial) in rows {
            let wrong = if *place == usize::from(*node) {
                ""
            } else {
                "  not its place"
            };
            writeln!(out, "{place:>5}  {node:>4}  0x{serial:08X}{wrong}")?;
        }
        if !order.unreached.is_empty() {
            let ids: Vec<String> = order.unreached.iter().map(u8::to_string).collect();
            writeln!(
                out,
                "the line does not reach {}: check IN and OUT between it and the vertebra before",
                ids.join(", ")
            )?;
        } else if !order.is_in_order() {
            writeln!(
                out,
                "give each its place: `eel lss assign PLACE --from NODE --store`, then \
                 `eel nmt NODE reset-communication`"
            )?;
        }
        Ok(())
    }
}

/// Looks whether ids rise along the line, as far as there is one, and returns the first two that don't, the
/// one towards the head first. An open IN is high whatever happens, and tells nothing.
pub(super) fn find_fall(client: &mut Client<AnyBus>) -> Result<Option<(u8, u8)>, ClientError> {
    let nodes = find_vertebrae(client)?;
    let fall = look(client, &nodes)?.fall();
    // A vertebra that starts meanwhile raises its OUT by itself: what is no fall twice is none.
    match fall {
        Some(_) if look(client, &nodes)?.fall() != fall => Ok(None),
        _ => Ok(fall),
    }
}

/// Returns the ids of the vertebrae that are heard.
fn find_vertebrae(client: &mut Client<AnyBus>) -> Result<Vec<u8>, ClientError> {
    let found = client.find_nodes(1..=VERTEBRAE, HEARD)?;
    let heard = found.iter().map(|found| found.node);
    Ok(heard.filter(|node| *node <= VERTEBRAE).collect())
}

impl Levels {
    /// Returns the first two that follow one another although their ids don't rise.
    fn fall(&self) -> Option<(u8, u8)> {
        let mut links = self
            .raised
            .iter()
            .flat_map(|(node, followers)| followers.iter().map(|follower| (*node, *follower)));
        links.find(|(node, follower)| follower <= node)
    }
}

/// Lowers every OUT, raises one after the other, and leaves each to its vertebra, whatever happens.
fn look(client: &mut Client<AnyBus>, nodes: &[u8]) -> Result<Levels, ClientError> {
    let levels = raise_each(client, nodes);
    for node in nodes {
        let _ = set(client, *node, AUTO);
    }
    levels
}

fn raise_each(client: &mut Client<AnyBus>, nodes: &[u8]) -> Result<Levels, ClientError> {
    for node in nodes {
        set(client, *node, LOW)?;
    }
    let first = high(client, nodes)?;
    let mut raised = Vec::new();
    for node in nodes {
        set(client, *node, HIGH)?;
        let now = high(client, nodes)?;
        let followers = now.into_iter().filter(|other| !first.contains(other));
        raised.push((*node, followers.collect()));
        set(client, *node, LOW)?;
    }
    Ok(Levels { first, raised })
}

fn set(client: &mut Client<AnyBus>, node: u8, out: u8) -> Result<(), ClientError> {
    client.download(node, OUT, &[out], Method::Automatic, &mut |_| ())
}

/// Returns whose IN is high.
fn high(client: &mut Client<AnyBus>, nodes: &[u8]) -> Result<Vec<u8>, ClientError> {
    sleep(SETTLED);
    let mut found = Vec::new();
    for node in nodes {
        if client.upload(*node, IN, Method::Automatic, &mut |_| ())? == [1] {
            found.push(*node);
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of three vertebrae: whose IN is high by itself, and whose follows each one's OUT.
    fn levels(first: &[u8], followers: [&[u8]; 3]) -> Levels {
        Levels {
            first: first.to_vec(),
            raised: (1..).zip(followers.map(<[u8]>::to_vec)).collect(),
        }
    }

    #[test]
    fn the_line_is_followed_from_head_to_tail() {
        let straight = levels(&[1], [&[2], &[3], &[]]);
        let order = Order::new(&[1, 2, 3], &straight);
        assert_eq!(order.chain, [1, 2, 3]);
        assert!(order.is_in_order());
        assert_eq!(straight.fall(), None);
        let turned = levels(&[2], [&[], &[3], &[1]]);
        assert_eq!(turned.fall(), Some((3, 1)));
        let order = Order::new(&[1, 2, 3], &turned);
        assert_eq!(order.chain, [2, 3, 1]);
        assert!(order.unreached.is_empty() && !order.is_in_order());
    }

    #[test]
    fn a_line_that_is_cut_or_a_ring_ends_and_names_who_is_left() {
        let cut = levels(&[1, 3], [&[2], &[], &[]]);
        assert_eq!(cut.fall(), None);
        let order = Order::new(&[1, 2, 3], &cut);
        assert_eq!(
            order,
            Order {
                chain: vec![],
                unreached: vec![1, 2, 3]
            }
        );
        let ring = levels(&[1], [&[2], &[1], &[]]);
        assert_eq!(ring.fall(), Some((2, 1)));
        let order = Order::new(&[1, 2, 3], &ring);
        assert_eq!((order.chain, order.unreached), (vec![1, 2], vec![3]));
    }
}
