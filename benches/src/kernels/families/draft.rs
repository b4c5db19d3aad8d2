//! A kernel in the making.

use plcc_random::Rng;

use super::{INPUTS, empty, number};
use crate::kernels::{Expr, Kernel, Language, Op, Stmt};

/// The number of array elements of a kernel that has an array.
pub(super) const ELEMENTS: usize = 64;

/// A kernel in the making, which hands out variables and contacts.
pub(super) struct Draft {
    pub(super) kernel: Kernel,
    pub(super) rng: Rng,
}

impl Draft {
    pub(super) fn new(
        name: &'static str,
        language: Language,
        input_words: usize,
        seed: u64,
    ) -> Self {
        let kernel = Kernel { input_words, words: input_words, ..empty(name, language) };
        Self { kernel, rng: Rng::new(seed) }
    }

    /// The kernel. Bits that nothing has assigned get an equation, since PMI has no others.
    pub(super) fn finish(mut self) -> Kernel {
        let mut assigned = vec![false; self.kernel.bits];
        note_assigned(&self.kernel.stmts, &mut assigned);
        for (bit, is_assigned) in assigned.into_iter().enumerate().skip(INPUTS) {
            if !is_assigned {
                let value = Expr::All(self.contacts(2));
                self.set(bit, value);
            }
        }
        self.kernel
    }

    /// A new bit.
    pub(super) fn bit(&mut self) -> usize {
        self.bits(1)
    }

    /// The first of several new bits.
    pub(super) fn bits(&mut self, count: usize) -> usize {
        self.kernel.bits += count;
        self.kernel.bits - count
    }

    /// A new word.
    pub(super) fn word(&mut self) -> usize {
        self.kernel.words += 1;
        self.kernel.words - 1
    }

    /// A new double.
    pub(super) fn real(&mut self) -> usize {
        self.kernel.reals += 1;
        self.kernel.reals - 1
    }

    /// An input bit.
    pub(super) fn input(&mut self) -> usize {
        self.rng.below(INPUTS)
    }

    /// A word that is an input.
    pub(super) fn input_word(&mut self) -> Expr {
        Expr::Word(self.rng.below(self.kernel.input_words))
    }

    /// A normally open or, less often, normally closed contact: of an input, or of a relay that there is already.
    pub(super) fn contact(&mut self) -> Expr {
        let relays = self.kernel.bits - INPUTS;
        let bit = match relays {
            0 => self.input(),
            _ if self.rng.chance(75) => self.input(),
            _ => INPUTS + self.rng.below(relays),
        };
        if self.rng.chance(25) { Expr::NotBit(bit) } else { Expr::Bit(bit) }
    }

    /// Different numbers below a limit, in ascending order.
    pub(super) fn numbers(&mut self, count: usize, limit: usize) -> Vec<usize> {
        let mut numbers: Vec<usize> = (0..count).map(|_| self.rng.below(limit)).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    }

    /// Some contacts.
    pub(super) fn contacts(&mut self, count: usize) -> Vec<Expr> {
        (0..count).map(|_| self.contact()).collect()
    }

    pub(super) fn push(&mut self, stmt: Stmt) {
        self.kernel.stmts.push(stmt);
    }

    pub(super) fn set(&mut self, bit: usize, value: Expr) {
        self.push(Stmt::SetBit(bit, value));
    }

    /// Statements under several conditions. NCT combines bits only, so that a comparison is a condition of its own
    /// there.
    pub(super) fn when(&self, conditions: Vec<Expr>, then: Vec<Stmt>) -> Stmt {
        if self.kernel.language != Language::Nct {
            return Stmt::If(all(conditions), then, vec![]);
        }
        let mut groups: Vec<Vec<Expr>> = vec![];
        for condition in conditions {
            match groups.last_mut() {
                Some(last) if !condition.is_comparison() && !last[0].is_comparison() => {
                    last.push(condition);
                }
                _ => groups.push(vec![condition]),
            }
        }
        let nest = |then, group| vec![Stmt::If(all(group), then, vec![])];
        let mut nested = groups.into_iter().rev().fold(then, nest);
        nested.remove(0)
    }

    /// A bit becomes whether any of several groups of conditions holds. In NCT the bit is switched off, and on again
    /// under each of the groups, unless all conditions are bits.
    pub(super) fn decode(&mut self, bit: usize, groups: Vec<Vec<Expr>>) {
        let compares = groups.iter().flatten().any(Expr::is_comparison);
        if self.kernel.language == Language::Nct && compares {
            self.set(bit, Expr::Truth(false));
            for group in groups {
                let on = self.when(group, vec![Stmt::SetBit(bit, Expr::Truth(true))]);
                self.push(on);
            }
        } else {
            self.set(bit, any(groups.into_iter().map(all).collect()));
        }
    }

    /// A new bit that is on for one scan when an input comes. The bit after it remembers the input as it was.
    pub(super) fn edge(&mut self) -> usize {
        let (input, edge) = (self.input(), self.bits(2));
        let (now, before) = (Expr::Bit(input), edge + 1);
        self.set(edge, Expr::All(vec![now.clone(), Expr::NotBit(before)]));
        self.set(before, now);
        edge
    }
}

/// Enters the bits that statements assign.
fn note_assigned(stmts: &[Stmt], assigned: &mut [bool]) {
    for stmt in stmts {
        match stmt {
            Stmt::SetBit(bit, _) | Stmt::Toggle(bit) => assigned[*bit] = true,
            Stmt::If(_, then, otherwise) => {
                note_assigned(then, assigned);
                note_assigned(otherwise, assigned);
            }
            Stmt::SetWord(..) | Stmt::SetReal(..) | Stmt::SetElement(..) => {}
        }
    }
}

/// All of some conditions.
pub(super) fn all(mut parts: Vec<Expr>) -> Expr {
    if parts.len() == 1 { parts.remove(0) } else { Expr::All(parts) }
}

/// Any of some conditions.
pub(super) fn any(mut parts: Vec<Expr>) -> Expr {
    if parts.len() == 1 { parts.remove(0) } else { Expr::Any(parts) }
}

/// Whether a word is a number.
pub(super) fn is(word: usize, value: usize) -> Expr {
    Expr::op(Op::Eq, Expr::Word(word), number(value))
}

/// A word becomes a number.
pub(super) fn put(word: usize, value: usize) -> Stmt {
    Stmt::SetWord(word, number(value))
}

/// A bit is switched on or off.
pub(super) fn switch(bit: usize, on: bool) -> Stmt {
    Stmt::SetBit(bit, Expr::Truth(on))
}

/// A word is counted up.
pub(super) fn count_up(word: usize) -> Stmt {
    Stmt::SetWord(word, Expr::op(Op::Add, Expr::Word(word), number(1)))
}
