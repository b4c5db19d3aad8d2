//! What each word is, for its colour.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use gen_lsp_types::{
    SemanticToken, SemanticTokens, SemanticTokensDelta, SemanticTokensDeltaResponse,
    SemanticTokensEdit, SemanticTokensLegend,
};
use plcc_diag::Span;
use plcc_frontend::common::words::{Appearance, Word, WordKind};
use serde_json::{Map, Value};

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
    let (sources, encoding) = (&at.program.sources, at.program.encoding);
    let is_shown =
        |span: Span| part.is_none_or(|part| span.start < part.end && part.start < span.end);
    let text = sources.text(at.file);
    let between = |from: u32, to: u32| text.get(from as usize..to as usize).unwrap_or_default();
    let (mut line, mut column, mut offset) = (0, 0, 0);
    let mut data = vec![];
    for word in at.program.words.of_file(at.file).iter().filter(|word| is_shown(word.span)) {
        for_each_line(sources.slice(word.span), word.span, |span| {
            let gap = between(offset, span.start);
            let (to_line, to_column) = if gap.contains(ENDS_OF_LINES) {
                let start = encoding.position(sources, at.file, span.start);
                (start.line, start.character)
            } else {
                (line, column + encoding.length(gap))
            };
            data.push(SemanticToken {
                delta_line: to_line - line,
                delta_start: if to_line == line { to_column - column } else { to_column },
                length: encoding.length(sources.slice(span)),
                token_type: type_of(word.kind),
                token_modifiers_bitset: modifiers_of(word),
            });
            (line, column, offset) = (to_line, to_column, span.start);
        });
    }
    SemanticTokens { result_id: None, data }
}

const ENDS_OF_LINES: [char; 2] = ['\r', '\n'];

/// Calls `each` with the parts of a word that lie in one line each, since tokens of the protocol may not reach over lines.
fn for_each_line(text: &str, span: Span, mut each: impl FnMut(Span)) {
    let mut start = span.start;
    for line in text.split_inclusive(ENDS_OF_LINES) {
        let end = start + line.trim_end_matches(ENDS_OF_LINES).len() as u32;
        if start < end {
            each(Span { start, end, ..span });
        }
        start += line.len() as u32;
    }
}

/// The tokens of whole documents that were sent last, so that an editor can be told what has changed in them.
#[derive(Default)]
pub(crate) struct SentTokens(HashMap<PathBuf, SemanticTokens>);

impl SentTokens {
    /// The tokens of a document with the number of this result, which are remembered.
    pub(crate) fn full(&mut self, at: At<'_>) -> SemanticTokens {
        let mut found = tokens(at, None);
        found.result_id = Some(result_id(&found.data));
        self.0.insert(at.program.path(at.file).to_owned(), found.clone());
        found
    }

    /// Forgets a document, which the editor has closed.
    pub(crate) fn forget(&mut self, path: &Path) {
        self.0.remove(path);
    }

    /// What has changed since the result with a number; all tokens, if that is not known.
    pub(crate) fn since(&mut self, previous: &str, at: At<'_>) -> SemanticTokensDeltaResponse {
        let known = self.0.remove(at.program.path(at.file));
        let known = known.filter(|known| known.result_id.as_deref() == Some(previous));
        let new = self.full(at);
        let Some(old) = known else { return new.into() };
        let pairs = old.data.iter().zip(&new.data);
        let before = pairs.take_while(|(old, new)| old == new).count();
        let rest = old.data.len().min(new.data.len()) - before;
        let pairs = old.data.iter().rev().zip(new.data.iter().rev()).take(rest);
        let after = pairs.take_while(|(old, new)| old == new).count();
        let changed = new.data.get(before..new.data.len() - after).unwrap_or_default();
        let removed = old.data.len() - before - after;
        let mut edits = vec![];
        if removed > 0 || !changed.is_empty() {
            edits.push(SemanticTokensEdit {
                start: (before * NUMBERS) as u32,
                delete_count: (removed * NUMBERS) as u32,
                data: Some(changed.iter().flat_map(numbers).collect()),
            });
        }
        SemanticTokensDelta { result_id: new.result_id, edits }.into()
    }
}

/// How many numbers a token is in the protocol.
const NUMBERS: usize = 5;

/// The numbers of a token.
fn numbers(token: &SemanticToken) -> [u32; NUMBERS] {
    let SemanticToken { delta_line, delta_start, length, token_type, token_modifiers_bitset } =
        *token;
    [delta_line, delta_start, length, token_type, token_modifiers_bitset]
}

/// The number of a result, which depends on the tokens alone.
fn result_id(data: &[SemanticToken]) -> String {
    // As rustc hashes, for which a program has too many tokens to take them byte by byte.
    let add = |hash: u64, number: u32| {
        (hash.rotate_left(5) ^ u64::from(number)).wrapping_mul(0x517c_c1b7_2722_0a95)
    };
    format!("{:016x}", data.iter().flat_map(numbers).fold(0, add))
}

/// The tokens in the protocol's form. It is made here since it is the longest of all answers: the general way moves its numbers
/// several times.
pub(crate) fn json(tokens: &SemanticTokens) -> Value {
    let mut data = Vec::with_capacity(tokens.data.len() * NUMBERS);
    data.extend(tokens.data.iter().flat_map(numbers).map(Value::from));
    let mut object = Map::new();
    object.insert("resultId".into(), tokens.result_id.clone().into());
    object.insert("data".into(), Value::Array(data));
    Value::Object(object)
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

    #[test]
    fn an_editor_is_told_what_has_changed_in_the_tokens() {
        let texts = ["P1=2\nP2=3\nP3=4\n", "P1=2\nP25=P7+3 ; é\nP3=4\n", "", "P3=4\n", "P3=4\n"];
        let mut sent = SentTokens::default();
        let (mut known, mut id): (Vec<u32>, _) = (vec![], String::new());
        for text in texts {
            let of = with_cursor(Dialect::Pmac, text);
            let all: Vec<u32> = tokens(at(&of), None).data.iter().flat_map(numbers).collect();
            match sent.since(&id, at(&of)) {
                SemanticTokensDeltaResponse::SemanticTokens(full) => {
                    assert!(id.is_empty(), "all are sent though the last result is known");
                    known = full.data.iter().flat_map(numbers).collect();
                    id = full.result_id.unwrap();
                }
                SemanticTokensDeltaResponse::SemanticTokensDelta(delta) => {
                    for edit in delta.edits {
                        let range = edit.start as usize..(edit.start + edit.delete_count) as usize;
                        known.splice(range, edit.data.unwrap());
                    }
                    id = delta.result_id.unwrap();
                }
            }
            assert_eq!(known, all, "{text}");
        }
        let of = with_cursor(Dialect::Pmac, "P1=1\n");
        let unknown = sent.since("of another server", at(&of));
        assert!(matches!(unknown, SemanticTokensDeltaResponse::SemanticTokens(_)));
    }
}
