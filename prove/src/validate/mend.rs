//! Functions that are not computed may give a solver anything at first. Where the results that it has chosen are wrong, it is told more of
//! them: that equal operands give equal results, what the function is, or what it gives for these operands.

use std::collections::BTreeSet;

use rustc_hash::FxHashMap;

use super::simulate::Simulation;
use super::sweep::Sweep;
use super::terms::{Application, Function};
use crate::logic::{FALSE, Graph, Lit, TRUE};

/// How many wrong results are looked at, at once.
const MOST: usize = 8;

/// How many gates a product takes at most where the solver is told what it is.
const MOST_OF_PRODUCT: usize = 600;

impl Sweep<'_, '_, '_> {
    /// Tells the solver more of functions whose results it has chosen wrongly; says of how many.
    pub(super) fn mend(&mut self) -> usize {
        let list = self.subject.list;
        let mut run = Simulation::new(self.graph, list);
        for (node, value) in self.all_values() {
            run.set(Lit::of_node(node), if value { u64::MAX } else { 0 });
        }
        // All values, with the results as the solver has chosen them.
        run.keep_all();
        let mut seen: FxHashMap<(Function, Vec<bool>), usize> = FxHashMap::default();
        let (mut pairs, mut wrong) = (vec![], vec![]);
        for number in self.applications.values().copied().collect::<BTreeSet<_>>() {
            let Some(it) = list.get(number) else { continue };
            let of = |lits: &[Lit]| lits.iter().map(|&lit| run.get(lit) & 1 == 1).collect();
            let operands: Vec<bool> = of(&it.operands);
            let results: Vec<bool> = of(&it.results);
            match seen.get(&(it.function, operands.clone())) {
                None => {
                    seen.insert((it.function, operands), number);
                }
                Some(&other) => {
                    let other_results = list.get(other).map(|it| of(&it.results));
                    if other_results.is_some_and(|other| other != results) {
                        pairs.push((other, number));
                    }
                }
            }
            let is_defined = || {
                let first = it.results.first().and_then(|&lit| self.made(lit));
                first.is_some_and(|it| self.known.whole.defined.contains(&it))
            };
            if !it.function.is_event() && !is_defined() {
                let operands = it.numbers(&run);
                let real = it.function.value(&operands);
                let chosen = |real: &u64| {
                    let bits = results.iter().enumerate();
                    bits.fold(true, |same, (at, &bit)| same && bit == (real >> at.min(63) & 1 == 1))
                };
                if let Some(real) = real.filter(|real| !chosen(real)) {
                    wrong.push((number, operands, real));
                }
            }
        }
        pairs.truncate(MOST);
        wrong.truncate(MOST);
        for &(one, other) in &pairs {
            self.agree(one, other);
        }
        for (number, operands, real) in &wrong {
            self.correct(*number, operands, *real);
        }
        pairs.len() + wrong.len()
    }

    fn made_all(&self, lits: &[Lit]) -> Vec<Lit> {
        lits.iter().filter_map(|&lit| self.made(lit)).collect()
    }

    /// Equal operands give equal results.
    fn agree(&mut self, one: usize, other: usize) {
        let list = self.subject.list;
        let (Some(a), Some(b)) = (list.get(one), list.get(other)) else { return };
        let (x, y) = (self.made_all(&a.operands), self.made_all(&b.operands));
        let differ = !self.known.graph.equal(&x, &y);
        let differ = self.known.whole.tell(&self.known.graph, differ);
        for (&x, &y) in a.results.iter().zip(&b.results) {
            if let (Some(x), Some(y)) = (self.made(x), self.made(y)) {
                let (x, y) = (
                    self.known.whole.tell(&self.known.graph, x),
                    self.known.whole.tell(&self.known.graph, y),
                );
                self.known.whole.sat.add(&[differ, !x, y]);
                self.known.whole.sat.add(&[differ, x, !y]);
            }
        }
    }

    /// What an application is, if that takes few gates, or what it gives for some operands.
    fn correct(&mut self, number: usize, operands: &[u64], real: u64) {
        let Some(it) = self.subject.list.get(number) else { return };
        let (own, results) = (self.made_all(&it.operands), self.made_all(&it.results));
        if let Some(holds) = definition(&mut self.known.graph, it.function, &own, &results) {
            let holds = self.known.whole.tell(&self.known.graph, holds);
            self.known.whole.sat.add(&[holds]);
            self.known.whole.defined.extend(results.first());
            return;
        }
        let mut differ = FALSE;
        let mut rest = own.as_slice();
        for (width, &value) in it.function.widths().into_iter().zip(operands) {
            let (lits, others) = rest.split_at(width.min(rest.len()));
            rest = others;
            let value = self.known.graph.number(lits.len(), value as i64);
            let same = self.known.graph.equal(lits, &value);
            differ = self.known.graph.or(differ, !same);
        }
        let differ = self.known.whole.tell(&self.known.graph, differ);
        for (at, &lit) in results.iter().enumerate() {
            let lit = self.known.whole.tell(&self.known.graph, lit);
            let lit = if real >> at.min(63) & 1 == 1 { lit } else { !lit };
            self.known.whole.sat.add(&[differ, lit]);
        }
    }
}

impl Application {
    /// Its operands in the first of the simulated runs.
    fn numbers(&self, run: &Simulation<'_>) -> Vec<u64> {
        let mut rest = self.operands.as_ref();
        let mut all = vec![];
        for width in self.function.widths() {
            let (own, others) = rest.split_at(width.min(rest.len()));
            all.push(run.number(own, 0));
            rest = others;
        }
        all
    }
}

/// Whether some results are those of a function: a literal, for functions that take few gates.
fn definition(
    graph: &mut Graph,
    function: Function,
    operands: &[Lit],
    results: &[Lit],
) -> Option<Lit> {
    match function {
        Function::Quotient(_, by) => {
            // The rest is between 0 and the divisor, with the sign of the dividend.
            let width = operands.len().max(results.len()) + 66 - by.leading_zeros() as usize;
            let (a, q) =
                (graph.resize_signed(operands, width), graph.resize_signed(results, width));
            let divisor = graph.number(width, by);
            let product = graph.multiply(&q, &divisor);
            let rest = graph.subtract(&a, &product).0;
            let is_negative = a.last().copied().unwrap_or(FALSE);
            let size = graph.negate_if(is_negative, &rest);
            let zero = graph.number(width, 0);
            let is_below = graph.less_signed(&size, &zero);
            let is_small = graph.less_signed(&size, &divisor);
            Some(graph.and(!is_below, is_small))
        }
        Function::Multiply(a, b) if usize::from(a) * usize::from(b) <= MOST_OF_PRODUCT => {
            let (x, y) = operands.split_at(usize::from(a).min(operands.len()));
            let width = results.len();
            let (x, y) = (graph.resize_signed(x, width), graph.resize_signed(y, width));
            let product = graph.multiply(&x, &y);
            let same = graph.equal(&product, results);
            (same != TRUE).then_some(same)
        }
        _ => None,
    }
}
