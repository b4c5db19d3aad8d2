//! Step chains: a bit for each step, which is set by the one before it and a contact.

use super::draft::{Draft, all, any, switch};
use crate::kernels::{Expr, Kernel, Language, Stmt};

/// Several chains, half of them written as equations and half as conditions that set and reset.
pub(super) fn chains(language: Language, count: usize, seed: u64) -> Kernel {
    let mut draft = Draft::new("step chains", language, 0, seed);
    for chain in 0..count {
        let steps = 6 + draft.rng.below(9);
        add_chain(&mut draft, steps, chain % 2 == 0);
    }
    draft.finish()
}

/// Adds a chain to a program.
pub(super) fn add_chain(draft: &mut Draft, steps: usize, is_equations: bool) {
    let (first, reset) = (draft.bits(steps), draft.input());
    if is_equations {
        equations(draft, first, steps, reset);
    } else {
        set_and_reset(draft, first, steps, reset);
    }
    for _ in 0..steps / 3 {
        let output = draft.bit();
        let shown = 1 + draft.rng.below(3);
        let shown = draft.numbers(shown, steps).into_iter();
        let on = any(shown.map(|step| Expr::Bit(first + step)).collect());
        let value = match draft.rng.below(2) {
            0 => on,
            _ => Expr::All(vec![on, draft.contact()]),
        };
        draft.set(output, value);
    }
}

/// Each step holds itself until the next one or the reset.
fn equations(draft: &mut Draft, first: usize, steps: usize, reset: usize) {
    for step in 0..steps {
        let bit = first + step;
        let mut start = match step {
            0 => vec![],
            _ => vec![Expr::Bit(bit - 1)],
        };
        start.push(draft.contact());
        let mut parts = vec![Expr::Any(vec![all(start), Expr::Bit(bit)])];
        if step + 1 < steps {
            parts.push(Expr::NotBit(bit + 1));
        }
        parts.push(Expr::NotBit(reset));
        draft.set(bit, Expr::All(parts));
    }
}

/// Each step is set by a condition that resets the one before; the reset clears all.
fn set_and_reset(draft: &mut Draft, first: usize, steps: usize, reset: usize) {
    let last = first + steps - 1;
    let start = draft.contact();
    let idle = Expr::NotBit(last);
    draft.push(Stmt::If(Expr::All(vec![start, idle]), vec![switch(first, true)], vec![]));
    for bit in first + 1..=last {
        let go_on = Expr::All(vec![Expr::Bit(bit - 1), draft.contact()]);
        draft.push(Stmt::If(go_on, vec![switch(bit, true), switch(bit - 1, false)], vec![]));
    }
    let clear = (first..=last).map(|bit| switch(bit, false)).collect();
    draft.push(Stmt::If(Expr::Bit(reset), clear, vec![]));
}
