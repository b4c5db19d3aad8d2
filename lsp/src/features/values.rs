//! The value that each variable has in the run that is shown, after its name.

use std::collections::BTreeSet;

use gen_lsp_types::{InlayHint, Label, Tooltip};
use plcc_diag::Span;
use plcc_frontend::common::words::{Word, WordKind};

use super::inline_values::MAX_SHOWN;
use crate::program::At;
use crate::run::ShownRun;

/// The values in a part of a document.
pub(crate) fn values(at: At<'_>, part: Span, run: &mut ShownRun) -> Vec<InlayHint> {
    let words: Vec<(&Word, &String)> = at
        .program
        .words
        .of_file(at.file)
        .iter()
        .filter(|word| part.start <= word.span.start && word.span.end <= part.end)
        .filter(|word| word.kind == WordKind::Variable)
        .filter_map(|word| Some((word, word.name.as_ref()?)))
        .take(MAX_SHOWN)
        .collect();
    let names: BTreeSet<&String> = words.iter().map(|(_, name)| *name).collect();
    let names: Vec<String> = names.into_iter().cloned().collect();
    let (tick, values) = run.values(&names);
    let hint = |(word, name): (&Word, &String)| {
        let value = values.get(name)?;
        let mut tooltip = format!("{name} at the end of tick {tick}");
        if let Some(note) = &value.note {
            tooltip.push_str(&format!("; {note}"));
        }
        Some(InlayHint {
            position: at.program.range(word.span).end,
            label: Label::String(value.label()),
            kind: None,
            text_edits: None,
            tooltip: Some(Tooltip::String(tooltip)),
            padding_left: Some(true),
            padding_right: Some(true),
            data: None,
        })
    };
    words.into_iter().filter_map(hint).collect()
}
