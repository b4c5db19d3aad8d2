//! What is there to be read and never is: `delayed-contact-never-read`, `input-never-read`.

use plcc_diag::Diagnostic;

use super::assigned;
use crate::pmi::ast::{Checked, Item, Meaning, Op};

/// Finds delayed contacts of timers that are started, and inputs, that no statement and no text reads.
pub(super) fn never_read(checked: &Checked, found: &mut Vec<Diagnostic>) {
    let mut read = vec![false; checked.symbols.len()];
    let mut started = vec![false; checked.symbols.len()];
    let loaded = checked.ops.iter().filter_map(|op| match *op {
        Op::Load(id) | Op::LoadAt(id, _) | Op::Element(id) => Some(id),
        Op::Const(_) | Op::Neg { .. } | Op::Not | Op::Binary(_) => None,
    });
    let texts = checked.faults.iter().chain(&checked.messages).flat_map(|text| &text.items);
    let shown = texts.filter_map(|item| match item {
        Item::Value(id) => Some(*id),
        Item::Text(_) => None,
    });
    for id in loaded.chain(shown) {
        read.get_mut(id.0 as usize).into_iter().for_each(|slot| *slot = true);
    }
    for id in checked.steps.iter().filter_map(|step| assigned(&step.action)) {
        started.get_mut(id.0 as usize).into_iter().for_each(|slot| *slot = true);
    }
    for timer in &checked.timers {
        let (control, delayed) = (timer.control.0 as usize, timer.delayed.0 as usize);
        if read.get(delayed) == Some(&false)
            && started.get(control) == Some(&true)
            && let Some(symbol) = checked.symbol(timer.delayed)
            && let Some(span) = symbol.declared
        {
            let message =
                format!("nothing reads {}, so the time of this timer changes nothing", symbol.name);
            let help = match checked.symbol(timer.control) {
                Some(control) if read.get(timer.control.0 as usize) == Some(&true) => {
                    format!("{} is read: is {} meant there?", control.name, symbol.name)
                }
                _ => format!("read {} where the time matters, or take the timer out", symbol.name),
            };
            found.push(Diagnostic::warning("PMI-W14", span, message).help(help));
        }
    }
    for (symbol, read) in checked.symbols.iter().zip(&read) {
        if let (Meaning::Input(_), Some(span), false) = (&symbol.meaning, symbol.declared, read) {
            let message = format!("nothing reads the input {}", symbol.name);
            found.push(
                Diagnostic::warning("PMI-W15", span, message)
                    .help("read it, or take its line out of $INPUT"),
            );
        }
    }
}
