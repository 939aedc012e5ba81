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
nothing and may be used before every start.

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

/// What the line tells.
#[derive(Debug, Default, PartialEq, Eq)]
struct Order {
    /// Node ids from head to tail.
    chain: Vec<u8>,
    /// Those that are on the bus and not in it.
    unreached: Vec<u8>,
}

impl Order {
    /// Follows the line from the vertebrae whose IN is high while every OUT is low; `raised` says whose IN
    /// each one's OUT raises.
    fn new(nodes: &[u8], first: &[u8], raised: &[(u8, Vec<u8>)]) -> Self {
        let mut chain = Vec::new();
        let mut next = match first {
            [one] => Some(*one),
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
        let found = client.find_nodes(1..=VERTEBRAE, HEARD)?;
        let nodes: Vec<u8> = (found.iter().map(|found| found.node))
            .filter(|node| *node <= VERTEBRAE)
            .collect();
        if nodes.is_empty() {
            eprintln!("eel: no vertebra is heard: those without an id get one by `eel lss assign`");
            return Ok(1);
        }
        let order = look(&mut client, &nodes);
        // Whatever happened, each line is left to its vertebra.
        for node in &nodes {
            let _ = set(&mut client, *node, AUTO);
        }
        let order = order?;
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

/// Lowers every OUT and raises one after the other.
fn look(client: &mut Client<AnyBus>, nodes: &[u8]) -> Result<Order, ClientError> {
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
    Ok(Order::new(nodes, &first, &raised))
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

    #[test]
    fn the_line_is_followed_from_head_to_tail() {
        let order = Order::new(&[1, 2, 3], &[1], &[(1, vec![2]), (2, vec![3]), (3, vec![])]);
        assert_eq!(order.chain, [1, 2, 3]);
        assert!(order.is_in_order());
        let order = Order::new(&[1, 2, 3], &[2], &[(1, vec![]), (2, vec![3]), (3, vec![1])]);
        assert_eq!(order.chain, [2, 3, 1]);
        assert!(order.unreached.is_empty() && !order.is_in_order());
    }

    #[test]
    fn a_line_that_is_cut_or_a_ring_ends_and_names_who_is_left() {
        let order = Order::new(
            &[1, 2, 3],
            &[1, 3],
            &[(1, vec![2]), (2, vec![]), (3, vec![])],
        );
        assert_eq!(
            order,
            Order {
                chain: vec![],
                unreached: vec![1, 2, 3]
            }
        );
        let order = Order::new(&[1, 2, 3], &[1], &[(1, vec![2]), (2, vec![1]), (3, vec![])]);
        assert_eq!((order.chain, order.unreached), (vec![1, 2], vec![3]));
    }
}
