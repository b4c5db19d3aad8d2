//! An and-inverter graph: truth values as inputs, conjunctions and complements, each conjunction kept once.

use rustc_hash::FxHashMap;

/// A node of a graph, or its complement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Lit(u32);

/// The literal that is always false.
pub const FALSE: Lit = Lit(0);

/// The literal that is always true.
pub const TRUE: Lit = Lit(1);

impl Lit {
    /// The literal of a node.
    pub fn of_node(node: u32) -> Self {
        Self(node << 1)
    }

    /// Its node.
    pub fn node(self) -> u32 {
        self.0 >> 1
    }

    /// Whether it is the complement of its node.
    pub fn is_complement(self) -> bool {
        self.0 & 1 == 1
    }

    /// The literal, complemented where `complement` says so.
    pub fn complement_if(self, complement: bool) -> Self {
        Self(self.0 ^ u32::from(complement))
    }

    /// A constant.
    pub fn constant(value: bool) -> Self {
        if value { TRUE } else { FALSE }
    }

    /// Its value, if it is a constant.
    pub fn value(self) -> Option<bool> {
        (self.node() == 0).then_some(self == TRUE)
    }
}

impl std::ops::Not for Lit {
    type Output = Self;

    fn not(self) -> Self {
        Self(self.0 ^ 1)
    }
}

/// What a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Node {
    /// Always false; node 0 alone.
    False,
    /// Something that comes from outside.
    Input,
    /// True if both are.
    And(Lit, Lit),
}

/// The graph. The operands of a node have lower numbers than the node itself.
#[derive(Clone, Debug)]
pub struct Graph {
    nodes: Vec<Node>,
    known: FxHashMap<(Lit, Lit), u32>,
}

impl Default for Graph {
    fn default() -> Self {
        Self { nodes: vec![Node::False], known: FxHashMap::default() }
    }
}

impl Graph {
    /// How many nodes there are.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there is nothing but the constant.
    pub fn is_empty(&self) -> bool {
        self.nodes.len() <= 1
    }

    /// Whether another graph has the same nodes.
    pub fn is(&self, other: &Self) -> bool {
        self.nodes == other.nodes
    }

    /// What a node is.
    pub fn node(&self, node: u32) -> Node {
        self.nodes.get(node as usize).copied().unwrap_or(Node::False)
    }

    /// A new input.
    pub fn input(&mut self) -> Lit {
        self.push(Node::Input)
    }

    /// New inputs.
    pub fn inputs(&mut self, count: usize) -> Vec<Lit> {
        (0..count).map(|_| self.input()).collect()
    }

    fn push(&mut self, node: Node) -> Lit {
        let number = self.nodes.len() as u32;
        self.nodes.push(node);
        Lit::of_node(number)
    }

    /// Whether both are true.
    pub fn and(&mut self, a: Lit, b: Lit) -> Lit {
        if a == FALSE || b == FALSE || a == !b {
            return FALSE;
        }
        if a == TRUE || a == b {
            return b;
        }
        if b == TRUE {
            return a;
        }
        let (a, b) = if a < b { (a, b) } else { (b, a) };
        // One operand may decide about the other: a & (a & c) and a & !(!a & c) and the like.
        for (one, other) in [(a, b), (b, a)] {
            let Node::And(c, d) = self.node(other.node()) else { continue };
            if other.is_complement() {
                if c == !one || d == !one {
                    return one;
                }
                if c == one {
                    return self.and(one, !d);
                }
                if d == one {
                    return self.and(one, !c);
                }
            } else {
                if c == one || d == one {
                    return other;
                }
                if c == !one || d == !one {
                    return FALSE;
                }
            }
        }
        if let Some(known) = self.of_two_conjunctions(a, b) {
            return known;
        }
        if let Some(&node) = self.known.get(&(a, b)) {
            return Lit::of_node(node);
        }
        let lit = self.push(Node::And(a, b));
        self.known.insert((a, b), lit.node());
        lit
    }

    /// Whether two literals are what a condition has divided, so that one of them is true where what was divided is.
    pub fn divided(&self, a: Lit, b: Lit) -> bool {
        a == !b || a.value().or(b.value()).is_some() || self.of_two_conjunctions(!a, !b).is_some()
    }

    /// Whether both are true, where each is a conjunction or the complement of one and a factor of one decides about the other. So what comes
    /// together on the ways that a condition has divided depends no more on the condition: (a & c) or (a & !c) is a.
    fn of_two_conjunctions(&self, a: Lit, b: Lit) -> Option<Lit> {
        let (Node::And(c, d), Node::And(e, f)) = (self.node(a.node()), self.node(b.node())) else {
            return None;
        };
        let excluded = c == !e || c == !f || d == !e || d == !f;
        match (a.is_complement(), b.is_complement()) {
            (false, false) => excluded.then_some(FALSE),
            (false, true) => excluded.then_some(a),
            (true, false) => excluded.then_some(b),
            (true, true) if c == e && d == !f || c == f && d == !e => Some(!c),
            (true, true) if d == e && c == !f || d == f && c == !e => Some(!d),
            (true, true) => None,
        }
    }

    /// Whether at least one is true.
    pub fn or(&mut self, a: Lit, b: Lit) -> Lit {
        !self.and(!a, !b)
    }

    /// Whether they differ.
    pub fn xor(&mut self, a: Lit, b: Lit) -> Lit {
        if let Some(value) = a.value() {
            return b.complement_if(value);
        }
        if let Some(value) = b.value() {
            return a.complement_if(value);
        }
        // Complements of operands are one of the result, so that equal differences are the same node.
        let is_inverted = a.is_complement() != b.is_complement();
        let (a, b) = (Lit::of_node(a.node()), Lit::of_node(b.node()));
        let (only_a, only_b) = (self.and(a, !b), self.and(!a, b));
        self.or(only_a, only_b).complement_if(is_inverted)
    }

    /// `a` where `cond` is true, else `b`.
    pub fn choose(&mut self, cond: Lit, a: Lit, b: Lit) -> Lit {
        if a == b || cond == TRUE {
            return a;
        }
        if cond == FALSE {
            return b;
        }
        if a == !b {
            return !self.xor(cond, a);
        }
        let (cond, a, b) = if cond.is_complement() { (!cond, b, a) } else { (cond, a, b) };
        // The complement of a choice is one of complements.
        let is_inverted = a.is_complement();
        let (a, b) = (a.complement_if(is_inverted), b.complement_if(is_inverted));
        let (then, otherwise) = (self.and(cond, a), self.and(!cond, b));
        self.or(then, otherwise).complement_if(is_inverted)
    }

    /// Whether all are true.
    pub fn all(&mut self, lits: impl IntoIterator<Item = Lit>) -> Lit {
        lits.into_iter().fold(TRUE, |all, lit| self.and(all, lit))
    }

    /// Whether at least one is true.
    pub fn any(&mut self, lits: impl IntoIterator<Item = Lit>) -> Lit {
        lits.into_iter().fold(FALSE, |any, lit| self.or(any, lit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_that_a_condition_divides_come_together_without_it() {
        let mut graph = Graph::default();
        let [running, outer, inner] = [graph.input(), graph.input(), graph.input()];
        let outer = graph.and(running, outer);
        let (then, otherwise) = (graph.and(outer, inner), graph.and(outer, !inner));
        assert_eq!(graph.or(then, otherwise), outer);
        assert_eq!(graph.and(then, otherwise), FALSE);
        assert_eq!(graph.and(then, !otherwise), then);
        let both = graph.and(!then, !otherwise);
        assert_eq!(both, !outer);
    }

    /// All conjunctions of two, of what four inputs are conjunctions of, have the values that they ought to have.
    #[test]
    fn each_simplification_keeps_the_values() {
        let mut graph = Graph::default();
        let words: [u16; 4] = [0xAAAA, 0xCCCC, 0xF0F0, 0xFF00];
        let mut all: Vec<(Lit, u16)> = words.map(|word| (graph.input(), word)).to_vec();
        for round in 0..2 {
            let known = all.clone();
            for (at, &(a, x)) in known.iter().enumerate() {
                for &(b, y) in known.iter().take(at) {
                    for (inverted_a, inverted_b) in
                        [(false, false), (false, true), (true, false), (true, true)]
                    {
                        let lit =
                            graph.and(a.complement_if(inverted_a), b.complement_if(inverted_b));
                        let word =
                            (if inverted_a { !x } else { x }) & (if inverted_b { !y } else { y });
                        all.push((lit, word));
                    }
                }
            }
            if round == 0 {
                all.dedup();
            }
        }
        let mut values = vec![0_u16; graph.len()];
        let get = |values: &[u16], lit: Lit| {
            let value = values.get(lit.node() as usize).copied().unwrap_or(0);
            if lit.is_complement() { !value } else { value }
        };
        for node in 1..graph.len() as u32 {
            let value = match graph.node(node) {
                Node::And(a, b) => get(&values, a) & get(&values, b),
                _ => words.get(node as usize - 1).copied().unwrap_or(0),
            };
            if let Some(slot) = values.get_mut(node as usize) {
                *slot = value;
            }
        }
        for (lit, word) in all {
            assert_eq!(get(&values, lit), word);
        }
    }
}
