//! Filters, ramps, limits, recipes and curves.

use super::draft::{Draft, ELEMENTS, switch};
use super::number;
use crate::kernels::{Expr, Kernel, Language, Op, Stmt};

/// Measured values: each is filtered and compared with limits, or approached by a ramp.
pub(super) fn filters(language: Language, count: usize, seed: u64) -> Kernel {
    let mut draft = Draft::new("filters", language, 8, seed);
    for at in 0..count {
        match at % 3 {
            0 => add_ramp(&mut draft),
            _ => add_filter(&mut draft),
        }
    }
    draft.finish()
}

/// Parameters that are read from the part of an array that a number chooses, and written there again.
pub(super) fn recipes(language: Language, count: usize, seed: u64) -> Kernel {
    let mut draft = Draft::new("recipes", language, 8, seed);
    enter_recipes(&mut draft);
    for _ in 0..count {
        add_recipe(&mut draft);
    }
    draft.finish()
}

/// Curves with corners in an array of doubles.
pub(super) fn curves(language: Language, count: usize, seed: u64) -> Kernel {
    let mut draft = Draft::new("curves", language, 8, seed);
    enter_curves(&mut draft);
    for _ in 0..count {
        add_curve(&mut draft);
    }
    draft.finish()
}

fn op(op: Op, a: Expr, b: Expr) -> Expr {
    Expr::op(op, a, b)
}

/// Adds a value that follows an input word slowly, as doubles in an interpreted PLC of a PMAC and else as integers,
/// and a contact that closes above a limit and opens below another one.
pub(super) fn add_filter(draft: &mut Draft) {
    let input = draft.input_word();
    let (high, low) = (60 + draft.rng.below(20), 20 + draft.rng.below(30));
    let value = match draft.kernel.language {
        Language::PmacMixed | Language::Pmac => {
            let real = draft.real();
            let scaled = op(Op::Add, op(Op::Mul, input, Expr::Number(0.75)), number(3));
            let error = op(Op::Sub, scaled, Expr::Real(real));
            let step = op(Op::Mul, error, Expr::Number(0.125));
            draft.push(Stmt::SetReal(real, op(Op::Add, Expr::Real(real), step)));
            Expr::Real(real)
        }
        language => {
            let word = draft.word();
            let value = Expr::Word(word);
            let sum = op(Op::Add, op(Op::Mul, value.clone(), number(7)), input.clone());
            let next = match language {
                Language::Nct => op(Op::Right, sum, number(3)),
                Language::Plcc => op(Op::Quot, sum, number(8)),
                _ => {
                    let error = op(Op::Sub, input, value.clone());
                    op(Op::Add, value.clone(), op(Op::Quot, error, number(8)))
                }
            };
            draft.push(Stmt::SetWord(word, next));
            value
        }
    };
    let contact = draft.bit();
    let above = op(Op::Gt, value.clone(), number(high));
    draft.push(Stmt::If(above, vec![switch(contact, true)], vec![]));
    let below = op(Op::Lt, value, number(low));
    draft.push(Stmt::If(below, vec![switch(contact, false)], vec![]));
}

/// Adds a value that approaches an input word in steps.
pub(super) fn add_ramp(draft: &mut Draft) {
    let (wanted, word) = (draft.input_word(), draft.word());
    // NCT's words have no sign.
    let step = match draft.kernel.language {
        Language::Nct => 1,
        _ => 1 + draft.rng.below(5),
    };
    let value = Expr::Word(word);
    let stop = Stmt::SetWord(word, wanted.clone());
    let more = Stmt::SetWord(word, op(Op::Add, value.clone(), number(step)));
    let less = Stmt::SetWord(word, op(Op::Sub, value.clone(), number(step)));
    let below = op(Op::Lt, value.clone(), wanted.clone());
    let above = op(Op::Gt, value, wanted);
    let up = vec![more, Stmt::If(above.clone(), vec![stop.clone()], vec![])];
    let down = vec![less, Stmt::If(below.clone(), vec![stop], vec![])];
    draft.push(Stmt::If(below, up, vec![Stmt::If(above, down, vec![])]));
}

/// Fills the array with integers.
pub(super) fn enter_recipes(draft: &mut Draft) {
    draft.kernel.elements = ELEMENTS;
    draft.kernel.start = (0..ELEMENTS).map(|_| draft.rng.below(100) as f64).collect();
}

/// Fills the array with doubles.
pub(super) fn enter_curves(draft: &mut Draft) {
    draft.kernel.elements = ELEMENTS;
    draft.kernel.real_elements = true;
    draft.kernel.start = (0..ELEMENTS).map(|_| draft.rng.below(400) as f64 * 0.25).collect();
}

/// Adds the parameters of the recipe whose number an input word chooses; a key stores one of them.
pub(super) fn add_recipe(draft: &mut Draft) {
    const LENGTH: usize = 8;
    let recipe = draft.word();
    let chosen = op(Op::Rem, draft.input_word(), number(ELEMENTS / LENGTH));
    draft.push(Stmt::SetWord(recipe, chosen));
    let place = |part: usize| {
        let start = op(Op::Mul, Expr::Word(recipe), number(LENGTH));
        if part == 0 { start } else { op(Op::Add, start, number(part)) }
    };
    let parameters = 2 + draft.rng.below(4);
    for _ in 0..parameters {
        let (word, part) = (draft.word(), draft.rng.below(LENGTH));
        draft.push(Stmt::SetWord(word, Expr::Element(Box::new(place(part)))));
    }
    let (key, part) = (draft.contact(), draft.rng.below(LENGTH));
    let value = draft.input_word();
    draft.push(Stmt::If(key, vec![Stmt::SetElement(place(part), value)], vec![]));
}

/// Adds the value of a curve of eight corners at a place between them.
pub(super) fn add_curve(draft: &mut Draft) {
    const CORNERS: usize = 8;
    const DISTANCE: f64 = 16.0;
    let (corner, at, result) = (draft.word(), draft.real(), draft.real());
    let first = CORNERS * draft.rng.below(ELEMENTS / CORNERS);
    let scaled =
        op(Op::Mul, draft.input_word(), Expr::Number(1.0 + draft.rng.below(6) as f64 / 64.0));
    draft.push(Stmt::SetReal(at, op(Op::Div, scaled, Expr::Number(DISTANCE))));
    draft.push(Stmt::SetWord(corner, Expr::Int(Box::new(Expr::Real(at)))));
    let element = |more: usize| {
        Expr::Element(Box::new(op(Op::Add, Expr::Word(corner), number(first + more))))
    };
    let rise = op(Op::Sub, element(1), element(0));
    let part = op(Op::Sub, Expr::Real(at), Expr::Word(corner));
    draft.push(Stmt::SetReal(result, op(Op::Add, element(0), op(Op::Mul, rise, part))));
}
