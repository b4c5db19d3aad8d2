//! What a solver was told of a graph.

use rustc_hash::FxHashMap;
use rustsat::types::Lit as SatLit;

use super::Sat;
use crate::logic::{Graph, Lit, Node};

/// The solver's literals of the nodes that it was told of.
#[derive(Debug, Default)]
pub(crate) struct Told(FxHashMap<u32, SatLit>);

impl Told {
    /// Of how many nodes it was told.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// The solver's literal of a node; `None` if it was not told of it.
    pub(crate) fn node(&self, node: u32) -> Option<SatLit> {
        self.0.get(&node).copied()
    }

    fn literal(&self, lit: Lit) -> Option<SatLit> {
        self.node(lit.node()).map(|it| if lit.is_complement() { !it } else { it })
    }

    /// Tells a solver of a literal of the graph, and of all that it depends on.
    pub(crate) fn tell(&mut self, sat: &mut Sat, graph: &Graph, lit: Lit) -> SatLit {
        let mut open = vec![lit.node()];
        while let Some(&node) = open.last() {
            if self.0.contains_key(&node) {
                open.pop();
                continue;
            }
            let made = match graph.node(node) {
                Node::False => {
                    let it = sat.variable();
                    sat.add(&[!it]);
                    it
                }
                Node::Input => sat.variable(),
                Node::And(a, b) => match (self.literal(a), self.literal(b)) {
                    (Some(x), Some(y)) => {
                        let it = sat.variable();
                        sat.define_and(it, x, y);
                        it
                    }
                    (x, y) => {
                        if x.is_none() {
                            open.push(a.node());
                        }
                        if y.is_none() {
                            open.push(b.node());
                        }
                        continue;
                    }
                },
            };
            self.0.insert(node, made);
        }
        self.literal(lit).unwrap_or_else(|| sat.variable())
    }
}
