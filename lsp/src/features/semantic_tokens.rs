//! What each word is, for its colour.

use gen_lsp_types::{SemanticToken, SemanticTokens, SemanticTokensLegend};
use plcc_diag::Span;
use plcc_frontend::common::words::{Appearance, Word, WordKind};

use crate::program::At;

/// The types, in the order of their numbers.
const TYPES: [&str; 9] = [
    "comment",
    "keyword",
    "macro",
    "variable",
    "enumMember",
    "function",
    "number",
    "string",
    "operator",
];
/// The modifiers, in the order of their bits.
const MODIFIERS: [&str; 3] = ["declaration", "readonly", "modification"];

/// What the numbers of types and modifiers mean.
pub(crate) fn legend() -> SemanticTokensLegend {
    SemanticTokensLegend {
        token_types: TYPES.map(str::to_owned).to_vec(),
        token_modifiers: MODIFIERS.map(str::to_owned).to_vec(),
    }
}

fn type_of(kind: WordKind) -> u32 {
    match kind {
        WordKind::Comment => 0,
        WordKind::Keyword => 1,
        WordKind::Directive => 2,
        WordKind::Variable => 3,
        WordKind::Constant => 4,
        WordKind::Label => 5,
        WordKind::Number => 6,
        WordKind::Text => 7,
        WordKind::Operator => 8,
    }
}

fn modifiers_of(word: &Word) -> u32 {
    let declaration = word.appearance == Some(Appearance::Declared);
    let readonly = word.kind == WordKind::Constant;
    let modification = word.appearance == Some(Appearance::Written);
    u32::from(declaration) | u32::from(readonly) << 1 | u32::from(modification) << 2
}

/// The tokens of a document, or of a part of it.
pub(crate) fn tokens(at: At<'_>, part: Option<Span>) -> SemanticTokens {
    let program = at.program;
    let is_shown =
        |span: Span| part.is_none_or(|part| span.start < part.end && part.start < span.end);
    let (mut line, mut column) = (0, 0);
    let mut data = vec![];
    for word in program.words.of_file(at.file).iter().filter(|word| is_shown(word.span)) {
        for span in lines_of(at, word.span) {
            let start = program.encoding.position(&program.sources, at.file, span.start);
            let length = program.encoding.length(program.sources.slice(span));
            let delta_start =
                if start.line == line { start.character - column } else { start.character };
            data.push(SemanticToken {
                delta_line: start.line - line,
                delta_start,
                length,
                token_type: type_of(word.kind),
                token_modifiers_bitset: modifiers_of(word),
            });
            (line, column) = (start.line, start.character);
        }
    }
    SemanticTokens { result_id: None, data }
}

/// The parts of a span that lie in one line each, since tokens of the protocol may not reach over lines.
fn lines_of(at: At<'_>, span: Span) -> impl Iterator<Item = Span> {
    let text = at.program.sources.slice(span);
    let mut start = span.start;
    let parts: Vec<Span> = text
        .split_inclusive(['\r', '\n'])
        .filter_map(|line| {
            let from = start;
            start += line.len() as u32;
            let end = from + line.trim_end_matches(['\r', '\n']).len() as u32;
            (from < end).then_some(Span { start: from, end, ..span })
        })
        .collect();
    parts.into_iter()
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    #[test]
    fn tokens_follow_each_other_in_lines() {
        let of = with_cursor(Dialect::Pmac, "/* a\nb */P1=2");
        let found = tokens(at(&of), None).data;
        let rows: Vec<[u32; 4]> = found
            .iter()
            .map(|it| [it.delta_line, it.delta_start, it.length, it.token_type])
            .collect();
        assert_eq!(rows, [[0, 0, 4, 0], [1, 0, 4, 0], [0, 4, 2, 3], [0, 2, 1, 8], [0, 1, 1, 6]]);
        let part = Span { file: plcc_diag::FileId(0), start: 9, end: 11 };
        assert_eq!(tokens(at(&of), Some(part)).data.len(), 1);
    }
}
