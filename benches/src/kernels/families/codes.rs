//! Decoders and encoders.

use super::draft::{Draft, is, put};
use super::number;
use crate::kernels::{Expr, Kernel, Language, Op, Stmt};

/// Several decoders and encoders.
pub(super) fn codes(language: Language, count: usize, seed: u64) -> Kernel {
    let mut draft = Draft::new("codes", language, 4, seed);
    for at in 0..count {
        add_decoder(&mut draft, 8);
        if at % 2 == 0 {
            add_encoder(&mut draft, 10);
        }
    }
    draft.finish()
}

/// Adds outputs each of which is on for some numbers: those of a place, or of a function that the control sends.
pub(super) fn add_decoder(draft: &mut Draft, outputs: usize) {
    let (input, is_place) = (draft.input_word(), draft.rng.chance(60));
    let (word, numbers) = (draft.word(), if is_place { 24 } else { 100 });
    let value = match (is_place, draft.kernel.language) {
        (true, Language::Nct) => Expr::op(Op::Mask, input, number(15)),
        (true, _) => Expr::op(Op::Rem, input, number(numbers)),
        (false, _) => input,
    };
    draft.push(Stmt::SetWord(word, value));
    for _ in 0..outputs {
        let output = draft.bit();
        let several = if is_place { 2 + draft.rng.below(4) } else { 1 + draft.rng.below(3) };
        let groups = if draft.rng.chance(15) {
            let (low, high) = (draft.rng.below(numbers / 2 - 1), numbers / 2 + draft.rng.below(9));
            let above = Expr::op(Op::Gt, Expr::Word(word), number(low));
            let below = Expr::op(Op::Lt, Expr::Word(word), number(high));
            vec![vec![above, below]]
        } else {
            let shown = draft.numbers(several, numbers).into_iter();
            shown.map(|number| vec![is(word, number)]).collect()
        };
        draft.decode(output, groups);
    }
}

/// Adds a word that holds the number of the first or the last contact that is closed, or 0.
pub(super) fn add_encoder(draft: &mut Draft, contacts: usize) {
    let word = draft.word();
    let inputs = draft.contacts(contacts);
    if draft.rng.chance(50) {
        let choose = |rest, (at, contact)| vec![Stmt::If(contact, vec![put(word, at + 1)], rest)];
        let numbered = inputs.into_iter().enumerate().rev();
        let mut chain = numbered.fold(vec![put(word, 0)], choose);
        draft.kernel.stmts.append(&mut chain);
    } else {
        draft.push(put(word, 0));
        for (contact, number) in inputs.into_iter().zip(1..) {
            draft.push(Stmt::If(contact, vec![put(word, number)], vec![]));
        }
    }
}
