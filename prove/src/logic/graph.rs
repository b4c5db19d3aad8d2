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
        if let Some(&node) = self.known.get(&(a, b)) {
            return Lit::of_node(node);
        }
        let lit = self.push(Node::And(a, b));
        self.known.insert((a, b), lit.node());
        lit
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
