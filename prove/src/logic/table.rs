//! Operations on operands about which a few literals decide, as tables: such an operation has a result for each of their values,
//! which is computed as it is in the interpreter.

use rustc_hash::FxHashMap;

use super::{Graph, Lit};

/// How many literals may decide about the operands.
const MOST: usize = 5;

/// What a number is, by the values of some nodes: the first node is the lowest bit of the place.
#[derive(Clone, Debug)]
struct Table {
    nodes: Vec<u32>,
    values: Vec<u64>,
}

/// The tables of numbers, by their literals.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tables {
    known: FxHashMap<Vec<Lit>, Table>,
}

impl Tables {
    fn of(&self, bits: &[Lit]) -> Option<Table> {
        if let Some(known) = self.known.get(bits) {
            return Some(known.clone());
        }
        let mut nodes: Vec<u32> = vec![];
        for bit in bits.iter().filter(|bit| bit.value().is_none()) {
            if !nodes.contains(&bit.node()) {
                nodes.push(bit.node());
            }
            if nodes.len() > MOST {
                return None;
            }
        }
        let value = |row: usize| {
            bits.iter().enumerate().fold(0_u64, |value, (place, bit)| {
                let node = nodes.iter().position(|node| *node == bit.node());
                let node = node.is_some_and(|node| row >> node & 1 == 1);
                value | u64::from(node != bit.is_complement()) << place
            })
        };
        let values = (0..1_usize << nodes.len()).map(value).collect();
        Some(Table { nodes, values })
    }

    /// The result of an operation, of `width` bits; `None` where too many literals decide about the operands.
    pub(crate) fn operation(
        &mut self,
        graph: &mut Graph,
        operands: &[&[Lit]],
        width: usize,
        result: impl Fn(&[u64]) -> Option<u64>,
    ) -> Option<Vec<Lit>> {
        let tables: Option<Vec<Table>> = operands.iter().map(|bits| self.of(bits)).collect();
        let tables = tables?;
        let mut nodes: Vec<u32> = tables.iter().flat_map(|table| table.nodes.clone()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        if nodes.len() > MOST {
            return None;
        }
        let value = |table: &Table, row: usize| {
            let own = table.nodes.iter().enumerate().fold(0_usize, |own, (place, node)| {
                let at = nodes.iter().position(|it| it == node).unwrap_or(0);
                own | (row >> at & 1) << place
            });
            table.values.get(own).copied()
        };
        let mut values = vec![];
        for row in 0..1_usize << nodes.len() {
            let operands: Option<Vec<u64>> = tables.iter().map(|table| value(table, row)).collect();
            let mask = u64::MAX.checked_shr(64_u32.saturating_sub(width as u32)).unwrap_or(0);
            values.push(result(&operands?)? & mask);
        }
        let bits = (0..width).map(|place| {
            let mut column: Vec<Lit> =
                values.iter().map(|value| Lit::constant(value >> place & 1 == 1)).collect();
            for &node in &nodes {
                let pairs = column.chunks(2).map(|pair| match pair {
                    [low, high] => graph.choose(Lit::of_node(node), *high, *low),
                    _ => super::FALSE,
                });
                column = pairs.collect();
            }
            column.first().copied().unwrap_or(super::FALSE)
        });
        let bits: Vec<Lit> = bits.collect();
        self.known.insert(bits.clone(), Table { nodes, values });
        Some(bits)
    }
}
