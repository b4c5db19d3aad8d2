//! The variables whose values the debugger shows beside the statements, of the tick at which it stands.

use gen_lsp_types::{InlineValue, InlineValueEvaluatableExpression};
use plcc_diag::Span;
use plcc_frontend::common::words::WordKind;

use crate::program::At;

/// The most values that are shown of a part of a document.
pub(super) const MAX_SHOWN: usize = 500;

/// The variables in a part of a document, each to be evaluated by the debugger.
pub(crate) fn inline_values(at: At<'_>, part: Span) -> Vec<InlineValue> {
    let words = at.program.words.of_file(at.file).iter();
    let shown = words.filter(|word| {
        let is_there = part.start <= word.span.start && word.span.start <= part.end;
        is_there && word.kind == WordKind::Variable
    });
    shown
        .filter_map(|word| {
            let expression = Some(word.name.clone()?);
            let range = at.program.range(word.span);
            Some(InlineValue::EvaluatableExpression(InlineValueEvaluatableExpression {
                range,
                expression,
            }))
        })
        .take(MAX_SHOWN)
        .collect()
}
