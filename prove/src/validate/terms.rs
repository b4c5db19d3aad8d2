//! What is not computed bit by bit: functions of which only equal operands are known to give equal results, and what happens
//! in the order of the program, as calls of the host.

use std::rc::Rc;

use plcc_abi::HostFn;
use plcc_abi::pmac::pure_functions;
use plcc_ir::{BinaryOp, Type, UnaryOp, eval};
use rustc_hash::FxHashMap;

use crate::logic::{Graph, Lit, Node};

/// How many literals a conjunction has at most that is found again in another order.
const MOST_FACTORS: usize = 128;

/// What is applied to operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Function {
    /// An operation on a double.
    Unary(UnaryOp),
    /// An operation on two doubles.
    Binary(BinaryOp),
    /// A host function that depends on its arguments alone.
    Pure(HostFn),
    /// The product of integers with this number of bits.
    Multiply(u8, u8),
    /// The quotient of an integer with this number of bits by a constant, rounded towards 0.
    Quotient(u8, i64),
    /// A call of the host.
    Call(HostFn),
    /// The question whether the scan is late.
    Late,
    /// A volatile load: the offset of the first element, the distance of elements and their number.
    Read(usize, u32, u32),
    /// A volatile store.
    Write(usize, u32, u32),
}

impl Function {
    /// Whether it happens in the order of the program.
    pub(super) fn is_event(self) -> bool {
        matches!(self, Self::Call(_) | Self::Late | Self::Read(..) | Self::Write(..))
    }

    /// What it gives for operands that are known; `None` for what happens.
    pub(super) fn value(self, operands: &[u64]) -> Option<u64> {
        let word = |number: usize| operands.get(number).copied().unwrap_or(0);
        match self {
            Self::Unary(op) => Some(eval::unary(op, Type::F64, word(0) as i64) as u64),
            Self::Binary(op) => {
                Some(eval::binary(op, Type::F64, word(0) as i64, word(1) as i64) as u64)
            }
            Self::Pure(function) => {
                pure_functions::call(function, [word(0), word(1), word(2), word(3)])
            }
            Self::Multiply(a, b) => {
                Some(signed(word(0), a).wrapping_mul(signed(word(1), b)) as u64)
            }
            Self::Quotient(a, by) => signed(word(0), a).checked_div(by).map(|it| it as u64),
            Self::Call(_) | Self::Late | Self::Read(..) | Self::Write(..) => None,
        }
    }

    /// How wide its operands are, for those whose value is known.
    pub(super) fn widths(self) -> Vec<usize> {
        match self {
            Self::Unary(_) => vec![64],
            Self::Binary(_) => vec![64, 64],
            Self::Multiply(a, b) => vec![a.into(), b.into()],
            Self::Quotient(a, _) => vec![a.into()],
            Self::Pure(function) => {
                let width = |ty: &plcc_abi::HostType| match ty {
                    plcc_abi::HostType::I32 => 32,
                    plcc_abi::HostType::I64 | plcc_abi::HostType::F64 => 64,
                };
                function.signature().0.iter().map(width).collect()
            }
            Self::Call(_) | Self::Late | Self::Read(..) | Self::Write(..) => vec![],
        }
    }
}

/// The number that some low bits are, in two's complement.
fn signed(word: u64, bits: u8) -> i64 {
    let spare = 64 - u32::from(bits).clamp(1, 64);
    (word as i64).wrapping_shl(spare).wrapping_shr(spare)
}

/// A function with its operands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Application {
    pub(super) function: Function,
    pub(super) operands: Rc<[Lit]>,
    /// Inputs of the graph that stand for the result.
    pub(super) results: Vec<Lit>,
}

/// The functions that are not computed, with their operands.
#[derive(Debug, Default)]
pub(super) struct Terms {
    pub(super) list: Vec<Application>,
    known: FxHashMap<(Function, Rc<[Lit]>), usize>,
    /// Conjunctions by what they are made of.
    conjunctions: FxHashMap<Vec<Lit>, Lit>,
    /// How many operands and results there are.
    pub(super) size: usize,
    /// Doubles of which it is known when they are integers, and which.
    pub(super) views: FxHashMap<Vec<Lit>, super::float::View>,
    /// What doubles may be besides finite numbers that are not -0.
    pub(super) special: FxHashMap<Vec<Lit>, super::special::Special>,
    /// Integers that are products with constants, or quotients by them.
    pub(super) integers: super::divide::Integers,
    /// Whether operations on doubles are computed bit by bit.
    pub(super) exact: bool,
}

impl Terms {
    /// No functions yet; `exact` says that operations on doubles are computed bit by bit.
    pub(super) fn new(exact: bool) -> Self {
        Self { exact, ..Self::default() }
    }

    /// The literal that stands for a truth value: the first one that was a conjunction, or disjunction, of the same literals. So
    /// conditions are the same in both versions where a pass has put them together in another order.
    pub(super) fn truth(&mut self, graph: &Graph, lit: Lit) -> Lit {
        let known = |this: &mut Self, lit: Lit| {
            let (mut open, mut all) = (vec![lit], vec![]);
            while let Some(lit) = open.pop() {
                match graph.node(lit.node()) {
                    _ if all.len() + open.len() > MOST_FACTORS => return None,
                    Node::And(a, b) if !lit.is_complement() => open.extend([a, b]),
                    _ => all.push(lit),
                }
            }
            all.sort_unstable();
            all.dedup();
            Some(*this.conjunctions.entry(all).or_insert(lit))
        };
        match lit.is_complement() {
            false => known(self, lit).unwrap_or(lit),
            true => known(self, !lit).map_or(lit, |it| !it),
        }
    }

    /// The result of a function, and the number of the application.
    pub(super) fn apply(
        &mut self,
        graph: &mut Graph,
        function: Function,
        operands: Vec<Lit>,
        width: usize,
    ) -> (Vec<Lit>, usize) {
        let key = (function, Rc::from(operands));
        if let Some(&known) = self.known.get(&key) {
            let results = self.list.get(known).map(|it| it.results.clone());
            return (results.unwrap_or_default(), known);
        }
        let results = graph.inputs(width);
        let number = self.list.len();
        let operands = Rc::clone(&key.1);
        self.size += operands.len() + results.len();
        self.list.push(Application { function, operands, results: results.clone() });
        self.known.insert(key, number);
        (results, number)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// The number that some bits are where inputs have values, and functions what they give for their operands.
    pub(in crate::validate) fn value(
        graph: &Graph,
        terms: &Terms,
        inputs: &[(&[Lit], u64)],
        lits: &[Lit],
    ) -> u64 {
        let mut values = vec![false; graph.len()];
        let get = |values: &[bool], lit: Lit| values[lit.node() as usize] != lit.is_complement();
        let number = |values: &[bool], lits: &[Lit]| {
            let bits = lits.iter().enumerate();
            bits.fold(0_u64, |all, (at, &lit)| all | u64::from(get(values, lit)) << at)
        };
        for (lits, number) in inputs {
            for (at, lit) in lits.iter().enumerate() {
                values[lit.node() as usize] = number >> at & 1 == 1;
            }
        }
        let mut next = terms.list.iter().peekable();
        for node in 0..graph.len() as u32 {
            if let Some(it) = next.next_if(|it| it.results[0].node() == node) {
                let mut rest = it.operands.as_ref();
                let operands = it.function.widths().into_iter().map(|width| {
                    let (own, others) = rest.split_at(width);
                    rest = others;
                    number(&values, own)
                });
                let result = it.function.value(&operands.collect::<Vec<_>>()).unwrap();
                for (at, lit) in it.results.iter().enumerate() {
                    values[lit.node() as usize] = result >> at & 1 == 1;
                }
            }
            if let Node::And(a, b) = graph.node(node) {
                values[node as usize] = get(&values, a) && get(&values, b);
            }
        }
        number(&values, lits)
    }

    #[test]
    fn a_conjunction_in_another_order_is_the_same_truth_value() {
        let mut graph = Graph::default();
        let mut terms = Terms::new(false);
        let [a, b, c] = [0, 1, 2].map(|_| graph.input());
        let (ab, bc) = (graph.and(a, !b), graph.and(!b, c));
        let (one, other) = (graph.and(ab, c), graph.and(a, bc));
        assert_ne!(one, other);
        let [one, other, not] = [one, other, !other].map(|it| terms.truth(&graph, it));
        assert_eq!((one, other, not), (one, one, !one));
        assert_ne!(terms.truth(&graph, ab), one);
        assert_eq!([a, !a].map(|it| terms.truth(&graph, it)), [a, !a]);
    }
}
