//! The words of a program, for editors.

use plcc_abi::mini::Kind;
use plcc_diag::{FileId, SourceMap, Span};

use super::language::WORDS;
use super::read;
use crate::common::tokens::{Raw, raw};
use crate::common::words::{Appearance, Declaration, DeclarationKind, Word, WordKind, Words};

/// The words of a file.
pub(super) fn words(sources: &SourceMap, file: FileId) -> Words {
    let (code, _) = read::read(sources, file);
    let mut words = Words::default();
    let mut at = 0;
    for line in sources.text(file).split_inclusive('\n') {
        let text = line.split(';').next().unwrap_or("");
        let start = at;
        at += line.len();
        let span = |from: usize, to: usize| Span::new(file, start + from, start + to);
        let comment = line.trim_end().len();
        if text.len() < comment {
            words.words.push(plain(span(text.len(), comment), WordKind::Comment));
        }
        let upper = text.trim_start().to_uppercase();
        let declares = ["INPUT", "OUTPUT", "NUMBER"].iter().any(|word| upper.starts_with(word));
        let used = match (declares, upper.starts_with("IF")) {
            (true, _) => Appearance::Declared,
            (false, true) => Appearance::Tested,
            (false, false) => Appearance::Read,
        };
        let (mut from, mut is_first) = (0, true);
        for token in raw(text) {
            let to = from + token.text().len();
            let place = span(from, to);
            from = to;
            let kind = match token {
                Raw::Blank(_) => continue,
                Raw::Text(_) => WordKind::Text,
                Raw::Number(_) => WordKind::Number,
                Raw::Sign(_) => WordKind::Operator,
                Raw::Word(word) if WORDS.iter().any(|(known, _)| known.eq_ignore_ascii_case(word)) => {
                    WordKind::Keyword
                }
                Raw::Word(word) => {
                    let name = word.to_uppercase();
                    let used = if is_first { Appearance::Written } else { used };
                    if let Some(symbol) = code.symbols.iter().find(|it| declares && it.name == name) {
                        let (kind, detail) = match symbol.kind {
                            Kind::Input => (DeclarationKind::Input, "input"),
                            Kind::Output => (DeclarationKind::Output, "output"),
                            Kind::Number => (DeclarationKind::Variable, "number"),
                        };
                        let (name, extent) = (name.clone(), span(0, text.trim_end().len()));
                        let detail = detail.to_owned();
                        words.declarations.push(Declaration { name, at: place, extent, kind, detail });
                    }
                    let name = Some(name);
                    let appearance = Some(used);
                    words.words.push(Word { name, appearance, ..plain(place, WordKind::Variable) });
                    is_first = false;
                    continue;
                }
            };
            is_first = false;
            words.words.push(plain(place, kind));
        }
    }
    words.statements = code.steps.iter().map(|step| step.span).collect();
    words.sorted(sources)
}

/// A word that names nothing.
fn plain(span: Span, kind: WordKind) -> Word {
    Word { span, kind, name: None, defined_as: None, appearance: None }
}
