//! One-shots, bits that are toggled, flip-flops and shift registers.

use super::draft::{Draft, count_up, put, switch};
use super::number;
use crate::kernels::{Expr, Kernel, Language, Op, Stmt};

/// Some of each.
pub(super) fn toggles(language: Language, count: usize, seed: u64) -> Kernel {
    let mut draft = Draft::new("toggles", language, 0, seed);
    for _ in 0..count {
        add_toggle(&mut draft);
    }
    for _ in 0..count.div_ceil(8) {
        add_shift_register(&mut draft, 16);
    }
    draft.finish()
}

/// Adds a bit that is toggled, or a flip-flop.
pub(super) fn add_toggle(draft: &mut Draft) {
    let bit = draft.bit();
    match draft.rng.below(5) {
        // A key toggles it: its opposite is assigned, or switched by a condition.
        0 => {
            let edge = draft.edge();
            draft.push(Stmt::If(Expr::Bit(edge), vec![Stmt::Toggle(bit)], vec![]));
        }
        1 => {
            let (key, before) = (draft.input(), draft.bit());
            let inverse =
                Stmt::If(Expr::Bit(bit), vec![switch(bit, false)], vec![switch(bit, true)]);
            let pressed = Expr::All(vec![Expr::Bit(key), Expr::NotBit(before)]);
            draft.push(Stmt::If(pressed, vec![inverse], vec![]));
            draft.set(before, Expr::Bit(key));
        }
        // It blinks while a contact is closed.
        2 => {
            let (time, limit) = (draft.word(), 4 + draft.rng.below(20));
            let over = Expr::op(Op::Gt, Expr::Word(time), number(limit));
            let turn = Stmt::If(over, vec![put(time, 0), Stmt::Toggle(bit)], vec![]);
            let contact = draft.contact();
            let off = vec![put(time, 0), switch(bit, false)];
            draft.push(Stmt::If(contact, vec![count_up(time), turn], off));
        }
        // A flip-flop takes an input when another one comes.
        3 => {
            let (edge, data) = (draft.edge(), draft.input());
            let take = vec![Stmt::SetBit(bit, Expr::Bit(data))];
            draft.push(Stmt::If(Expr::Bit(edge), take, vec![]));
        }
        // A flip-flop is set by one contact and reset by another.
        _ => {
            let (set, reset) = (draft.contact(), draft.contact());
            draft.push(Stmt::If(set, vec![switch(bit, true)], vec![]));
            draft.push(Stmt::If(reset, vec![switch(bit, false)], vec![]));
        }
    }
}

/// Adds a shift register: of bits in PMI, which has no operators on the bits of a word, and else of a word.
pub(super) fn add_shift_register(draft: &mut Draft, places: usize) {
    let (edge, data) = (draft.edge(), draft.input());
    if draft.kernel.language == Language::Pmi {
        let first = draft.bits(places);
        let shift = |bit| Stmt::SetBit(bit, Expr::Bit(bit - 1));
        let mut body: Vec<Stmt> = (first + 1..first + places).rev().map(shift).collect();
        body.push(Stmt::SetBit(first, Expr::Bit(data)));
        draft.push(Stmt::If(Expr::Bit(edge), body, vec![]));
        let (output, place) = (draft.bit(), first + draft.rng.below(places));
        let contact = draft.contact();
        draft.set(output, Expr::All(vec![Expr::Bit(place), contact]));
        return;
    }
    let word = draft.word();
    let twice = Expr::op(Op::Left, Expr::Word(word), number(1));
    let shifted = Expr::op(Op::Mask, twice, number((1 << places) - 1));
    let with_one = Expr::op(Op::Join, Expr::Word(word), number(1));
    let enter = Stmt::If(Expr::Bit(data), vec![Stmt::SetWord(word, with_one)], vec![]);
    draft.push(Stmt::If(Expr::Bit(edge), vec![Stmt::SetWord(word, shifted), enter], vec![]));
    let (output, place) = (draft.bit(), draft.rng.below(places));
    let masked = Expr::op(Op::Mask, Expr::Word(word), number(1 << place));
    draft.decode(output, vec![vec![Expr::op(Op::Gt, masked, number(0))]]);
}
