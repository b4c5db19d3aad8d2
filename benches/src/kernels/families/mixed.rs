//! Programs with a bit of everything, as those of machines are.

use super::chains::add_chain;
use super::codes::{add_decoder, add_encoder};
use super::draft::{Draft, all, any};
use super::machines::{Style, add_machine};
use super::motors::{add_alarms, add_pair};
use super::toggles::{add_shift_register, add_toggle};
use super::values::{add_curve, add_filter, add_ramp, add_recipe, enter_curves, enter_recipes};
use crate::kernels::{Kernel, Language};

/// A machine's program: a number of pieces of all kinds in random order.
pub(super) fn mixed(language: Language, pieces: usize, seed: u64) -> Kernel {
    let mut draft = Draft::new("machine", language, 8, seed);
    match language {
        Language::Pmi => enter_recipes(&mut draft),
        Language::PmacMixed | Language::Pmac => enter_curves(&mut draft),
        Language::Nct | Language::Plcc => {}
    }
    for piece in order(&mut draft, pieces) {
        add_piece(&mut draft, piece);
    }
    draft.finish()
}

/// The kinds of the pieces, with each kind about equally often, in random order.
fn order(draft: &mut Draft, pieces: usize) -> Vec<usize> {
    const KINDS: usize = 12;
    let mut order: Vec<usize> = (0..pieces).map(|piece| piece % KINDS).collect();
    for at in (1..order.len()).rev() {
        order.swap(at, draft.rng.below(at + 1));
    }
    order
}

fn add_piece(draft: &mut Draft, kind: usize) {
    let style = *draft.rng.pick(&[Style::Nested, Style::Chain, Style::Flat, Style::ContactFirst]);
    let some = draft.rng.below(5);
    match kind {
        0 => add_machine(draft, 5 + some, style),
        1 => add_chain(draft, 6 + some, some.is_multiple_of(2)),
        2 => add_decoder(draft, 4 + some),
        3 => add_encoder(draft, 6 + some),
        4 => add_pair(draft, some.is_multiple_of(2)),
        5 => add_alarms(draft, 6 + some),
        6 => add_toggle(draft),
        7 => add_shift_register(draft, 12 + some),
        8 => add_filter(draft),
        9 => add_ramp(draft),
        10 => match draft.kernel.language {
            Language::Pmi => add_recipe(draft),
            Language::PmacMixed | Language::Pmac => add_curve(draft),
            Language::Nct | Language::Plcc => add_filter(draft),
        },
        _ => (0..4 + some).for_each(|_| add_equation(draft)),
    }
}

/// Adds an equation of relay logic.
fn add_equation(draft: &mut Draft) {
    let mut parts = vec![];
    for _ in 0..1 + draft.rng.below(3) {
        let contacts = 1 + draft.rng.below(3);
        parts.push(any(draft.contacts(contacts)));
    }
    let relay = draft.bit();
    draft.set(relay, all(parts));
}
