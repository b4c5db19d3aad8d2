//! Words, array elements and doubles, and timers.

use plcc_random::Rng;

use super::{INPUTS, empty, number};
use crate::kernels::{Expr, Kernel, Language, Op, Stmt, WordType};

/// Sums, products, remainders and comparisons of words, some of which are inputs.
pub(super) fn arithmetic(language: Language, count: usize, seed: u64) -> Kernel {
    let mut rng = Rng::new(seed);
    let name = if language == Language::Pmac { "integers in P" } else { "arith16" };
    let (input_words, words) = (8, 40);
    let mut kernel = Kernel { inputs: 0, bits: 0, input_words, words, ..empty(name, language) };
    for _ in 0..count {
        let mut any = || Expr::Word(rng.below(words));
        let (a, b, c) = (any(), any(), any());
        let to = input_words + rng.below(words - input_words);
        let (factor, bound) = (2 + rng.below(7), 100 + rng.below(900));
        let sum = Expr::op(Op::Add, Expr::op(Op::Mul, a, number(factor)), b);
        let stmt = match rng.below(4) {
            0 | 1 if language == Language::Nct => {
                Stmt::SetWord(to, Expr::op(Op::Mask, sum, number(0x3FF)))
            }
            0 if language.is_pmac() => Stmt::SetWord(to, Expr::op(Op::Mask, sum, number(0x3FF))),
            0 | 1 => Stmt::SetWord(to, Expr::op(Op::Rem, sum, number(bound))),
            2 => {
                let above = Expr::op(Op::Gt, c, number(bound));
                let more = Expr::op(Op::Add, Expr::Word(to), number(factor));
                Stmt::If(above, vec![Stmt::SetWord(to, number(0))], vec![Stmt::SetWord(to, more)])
            }
            _ => {
                let more = Expr::op(Op::Add, Expr::Word(to), number(1));
                let full = Expr::op(Op::Gt, Expr::Word(to), number(999));
                kernel.stmts.push(Stmt::SetWord(to, more));
                Stmt::If(full, vec![Stmt::SetWord(to, number(0))], vec![])
            }
        };
        kernel.stmts.push(stmt);
    }
    kernel
}

/// Counters that run while a contact is closed, and contacts that close when they are full.
pub(super) fn timers(language: Language, count: usize, seed: u64) -> Kernel {
    let mut rng = Rng::new(seed);
    let mut kernel = Kernel { bits: INPUTS + count, words: count, ..empty("timers", language) };
    for timer in 0..count {
        let (word, full) = (Expr::Word(timer), number(5 + rng.below(50)));
        let runs = Expr::Bit(rng.below(INPUTS));
        let more = Stmt::SetWord(timer, Expr::op(Op::Add, word.clone(), number(1)));
        let below = Expr::op(Op::Lt, word.clone(), full.clone());
        let clear = Stmt::SetWord(timer, number(0));
        kernel.stmts.push(Stmt::If(runs, vec![Stmt::If(below, vec![more], vec![])], vec![clear]));
        let output = INPUTS + timer;
        kernel.stmts.push(match language {
            Language::Pmi => Stmt::SetBit(output, Expr::op(Op::Eq, word, full)),
            _ => {
                // Kernels have no constant bits, so that the contact gets the value of an input.
                let on = Stmt::SetBit(output, Expr::Bit(0));
                let off = Stmt::SetBit(output, Expr::Bit(1));
                Stmt::If(Expr::op(Op::Eq, word, full), vec![on], vec![off])
            }
        });
    }
    kernel
}

/// Elements of an array at computed indices.
pub(super) fn arrays(language: Language, count: usize, seed: u64) -> Kernel {
    const ELEMENTS: usize = 64;
    let mut rng = Rng::new(seed);
    let (input_words, words) = (8, 24);
    let mut kernel = Kernel {
        inputs: 0,
        bits: 0,
        input_words,
        words,
        elements: ELEMENTS,
        ..empty("arrays", language)
    };
    for _ in 0..count {
        let mut index = || {
            let (word, step) = (rng.below(words), rng.below(50));
            let moved = Expr::op(Op::Add, Expr::Word(word), number(step));
            let length = if rng.chance(50) { ELEMENTS } else { ELEMENTS - 1 - rng.below(20) };
            Expr::op(Op::Rem, moved, number(length))
        };
        let (from, to) = (index(), index());
        let word = input_words + rng.below(words - input_words);
        let element = Expr::Element(Box::new(from));
        kernel.stmts.push(match rng.below(3) {
            0 => {
                let sum = Expr::op(Op::Add, element, Expr::Word(word));
                Stmt::SetElement(to, Expr::op(Op::Rem, sum, number(1000)))
            }
            1 => {
                let sum = Expr::op(Op::Add, element, Expr::Word(rng.below(input_words)));
                Stmt::SetWord(word, Expr::op(Op::Rem, sum, number(1000)))
            }
            _ => Stmt::SetElement(to, element),
        });
    }
    kernel
}

/// Products and sums of doubles that stay small.
pub(super) fn float(count: usize, seed: u64) -> Kernel {
    let mut rng = Rng::new(seed);
    let (input_words, words) = (8, 64);
    let mut kernel = Kernel {
        inputs: 0,
        bits: 0,
        input_words,
        words,
        word_type: WordType::Double,
        ..empty("floating point", Language::Pmac)
    };
    for _ in 0..count {
        let mut any = || Expr::Word(rng.below(words));
        let (a, b, c, d) = (any(), any(), any(), any());
        let to = input_words + rng.below(words - input_words);
        let part = |word, factor| Expr::op(Op::Mul, word, Expr::Number(factor));
        kernel.stmts.push(match rng.below(3) {
            0 => {
                let sum = Expr::op(Op::Add, part(a, 0.25), part(b, 0.25));
                Stmt::SetWord(to, Expr::op(Op::Sub, sum, part(c, 0.375)))
            }
            1 => {
                let product = Expr::op(Op::Mul, Expr::op(Op::Mul, a, b), Expr::Number(0.002));
                let product = Expr::op(Op::Sub, part(c, 0.5), part(product, 0.125));
                let small = Expr::op(Op::Lt, d.clone(), Expr::Number(50.0));
                Stmt::If(
                    small,
                    vec![Stmt::SetWord(to, product)],
                    vec![Stmt::SetWord(to, part(d, 0.5))],
                )
            }
            _ => {
                let above = Expr::op(Op::Gt, a, b);
                let half = Stmt::SetWord(to, part(c, 0.5));
                let other = Expr::op(Op::Add, part(Expr::Word(to), 0.5), part(d, 0.375));
                Stmt::If(above, vec![half], vec![Stmt::SetWord(to, other)])
            }
        });
    }
    kernel
}
