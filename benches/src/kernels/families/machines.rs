//! State machines in the styles in which people write them.

use plcc_random::Rng;

use super::draft::{Draft, all, count_up, is, put, switch};
use super::{INPUTS, empty, number};
use crate::kernels::{Expr, Kernel, Language, Op, Stmt};

/// Machines of 20 states; the states of one are numbers in a word. Half of them are written as
/// separate conditions, which may pass through several states in one scan, half as one chain.
pub(super) fn states(language: Language, machines: usize, seed: u64) -> Kernel {
    const STATES: usize = 20;
    let mut rng = Rng::new(seed);
    let mut kernel =
        Kernel { words: machines, bits: INPUTS + machines * 4, ..empty("states", language) };
    for machine in 0..machines {
        let mut chain = vec![];
        for state in (0..STATES).rev() {
            let is_here = Expr::op(Op::Eq, Expr::Word(machine), number(state));
            let go_on = if rng.chance(50) {
                Expr::Bit(rng.below(INPUTS))
            } else {
                Expr::All(vec![Expr::Bit(rng.below(INPUTS)), Expr::NotBit(rng.below(INPUTS))])
            };
            let next =
                number(if rng.chance(80) { (state + 1) % STATES } else { rng.below(STATES) });
            let output = INPUTS + machine * 4 + state % 4;
            let lamp = Expr::All(vec![Expr::Bit(rng.below(INPUTS)), Expr::Bit(rng.below(INPUTS))]);
            let work = vec![
                Stmt::SetBit(output, lamp),
                Stmt::If(go_on, vec![Stmt::SetWord(machine, next)], vec![]),
            ];
            if machine % 2 == 0 {
                chain.push(Stmt::If(is_here, work, vec![]));
            } else {
                chain = vec![Stmt::If(is_here, work, chain)];
            }
        }
        kernel.stmts.extend(chain);
    }
    kernel
}

/// How the transitions of a machine are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Style {
    /// A condition for each state, and in it one for each transition.
    Nested,
    /// The same, but the states are one chain with ELSEIF.
    Chain,
    /// One condition for each transition: the state, then the contacts.
    Flat,
    /// One condition for each transition: the contacts, then the state.
    ContactFirst,
}

/// Small machines in two styles.
pub(super) fn machines(
    name: &'static str,
    language: Language,
    styles: [Style; 2],
    count: usize,
    seed: u64,
) -> Kernel {
    let mut draft = Draft::new(name, language, 0, seed);
    for machine in 0..count {
        let states = 5 + draft.rng.below(4);
        add_machine(&mut draft, states, styles[machine % 2]);
    }
    draft.finish()
}

/// Machines of many states, each in another style.
pub(super) fn long_machines(language: Language, states: usize, seed: u64) -> Kernel {
    // Only PMI has ELSEIF; nobody nests fifty ELSE in the others.
    let third = if language == Language::Pmi { Style::Chain } else { Style::ContactFirst };
    let mut draft = Draft::new("long machines", language, 0, seed);
    for style in [Style::Nested, Style::Flat, third] {
        let states = states + draft.rng.below(states / 4 + 1);
        add_machine(&mut draft, states, style);
    }
    draft.finish()
}

/// A way out of a state: its contacts, and the state that it leads to.
type Exit = (Vec<Expr>, usize);

/// Adds a machine to a program.
pub(super) fn add_machine(draft: &mut Draft, states: usize, style: Style) {
    let (word, outputs) = (draft.word(), 1 + states / 3);
    let first_output = draft.bits(outputs);
    let mut chain = vec![];
    // A chain is built from its end.
    for at in 0..states {
        let state = if style == Style::Chain { states - 1 - at } else { at };
        let exits = exits(draft, state, states);
        match style {
            Style::Flat | Style::ContactFirst => {
                for (contacts, next) in exits {
                    let mut conditions = contacts;
                    let place = if style == Style::Flat { 0 } else { conditions.len() };
                    conditions.insert(place, is(word, state));
                    let stmt = draft.when(conditions, vec![put(word, next)]);
                    draft.push(stmt);
                }
            }
            Style::Nested => {
                let work = work(draft, word, exits, first_output, outputs);
                draft.push(Stmt::If(is(word, state), work, vec![]));
            }
            Style::Chain => {
                let work = work(draft, word, exits, first_output, outputs);
                chain = vec![Stmt::If(is(word, state), work, chain)];
            }
        }
    }
    draft.kernel.stmts.append(&mut chain);
    if matches!(style, Style::Flat | Style::ContactFirst) {
        for output in first_output..first_output + outputs {
            let shown = 1 + draft.rng.below(3);
            let shown = draft.numbers(shown, states).into_iter();
            let groups = shown.map(|state| vec![is(word, state)]).collect();
            draft.decode(output, groups);
        }
    }
}

/// The ways out of a state: mostly to the next one, and sometimes one more, such as that of a stop.
fn exits(draft: &mut Draft, state: usize, states: usize) -> Vec<Exit> {
    let contacts = 1 + draft.rng.below(2);
    let next = if draft.rng.chance(85) { state + 1 } else { draft.rng.below(states) };
    let mut exits = vec![(draft.contacts(contacts), next % states)];
    if draft.rng.chance(40) {
        let next = if draft.rng.chance(50) { 0 } else { draft.rng.below(states) };
        exits.push((draft.contacts(1), next));
    }
    exits
}

/// What a machine does in a state: outputs, and its transitions, which may also switch outputs.
fn work(
    draft: &mut Draft,
    word: usize,
    exits: Vec<Exit>,
    first_output: usize,
    outputs: usize,
) -> Vec<Stmt> {
    let mut work = vec![];
    let output = first_output + draft.rng.below(outputs);
    match draft.rng.below(3) {
        0 => work.push(switch(output, draft.rng.chance(60))),
        1 => work.push(Stmt::SetBit(output, all(draft.contacts(2)))),
        _ => {}
    }
    let is_alternative = draft.rng.chance(50);
    let mut others = vec![];
    for (contacts, next) in exits.into_iter().rev() {
        let mut then = vec![];
        if draft.rng.chance(30) {
            let output = first_output + draft.rng.below(outputs);
            then.push(switch(output, draft.rng.chance(50)));
        }
        then.push(put(word, next));
        let rest = if is_alternative { std::mem::take(&mut others) } else { vec![] };
        others.insert(0, Stmt::If(all(contacts), then, rest));
    }
    work.append(&mut others);
    if draft.rng.chance(15) {
        // The state lasts for some scans at most.
        let (time, limit) = (draft.word(), 5 + draft.rng.below(50));
        let over = Expr::op(Op::Gt, Expr::Word(time), number(limit));
        work.push(count_up(time));
        work.push(Stmt::If(over, vec![put(time, 0), put(word, 0)], vec![]));
    }
    work
}
