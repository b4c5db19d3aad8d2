//! What stands beside names and numbers without being written: where an input or output lies, what a name of a `#define` stands
//! for, a hexadecimal number in decimal.

use gen_lsp_types::{InlayHint, InlayHintKind, Label};
use plcc_diag::Span;
use plcc_frontend::common::words::{Appearance, DeclarationKind, Word, WordKind};

use super::hover::number;
use crate::program::At;

/// The hints in a part of a document.
pub(crate) fn inlay_hints(at: At<'_>, part: Span) -> Vec<InlayHint> {
    let words = at.program.words.of_file(at.file).iter();
    let shown = words.filter(|word| part.start <= word.span.start && word.span.end <= part.end);
    shown
        .filter_map(|word| {
            let label = hint(at, word)?;
            let position = at.program.range(word.span).end;
            Some(InlayHint {
                position,
                label: Label::String(label),
                kind: Some(InlayHintKind::Type),
                text_edits: None,
                tooltip: None,
                padding_left: Some(true),
                padding_right: None,
                data: None,
            })
        })
        .collect()
}

fn hint(at: At<'_>, word: &Word) -> Option<String> {
    let text = at.text(word);
    if word.kind == WordKind::Number && text.starts_with(['$', '.']) {
        return number(text).map(|number| number.trim_end_matches(" decimal").to_owned());
    }
    if word.appearance == Some(Appearance::Declared) {
        return None;
    }
    let declaration = *at.program.words.declarations_of(word).first()?;
    match declaration.kind {
        DeclarationKind::Input | DeclarationKind::Output => {
            // `LOGICAL input, port 1, bit 0`
            let (_, place) = declaration.detail.split_once("port ")?;
            Some(place.replace(", bits ", "/").replace(", bit ", "/").replace(" to ", "-"))
        }
        DeclarationKind::Definition => {
            let rest = declaration.detail.split_once(declaration.name.as_str())?.1.trim();
            (!rest.is_empty() && rest.len() <= 40).then(|| format!("= {rest}"))
        }
        DeclarationKind::Constant => {
            let (_, value) = declaration.detail.split_once(" = ")?;
            (!value.contains(',')).then(|| format!("= {value}"))
        }
        DeclarationKind::Variable
        | DeclarationKind::Contact
        | DeclarationKind::Announcement
        | DeclarationKind::Key
        | DeclarationKind::Label
        | DeclarationKind::Program => None,
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    fn labels(dialect: Dialect, text: &str) -> Vec<String> {
        let of = with_cursor(dialect, text);
        let part = Span { file: plcc_diag::FileId(0), start: 0, end: u32::MAX };
        let hints = inlay_hints(at(&of), part).into_iter();
        hints
            .map(|it| if let Label::String(text) = it.label { text } else { String::new() })
            .collect()
    }

    #[test]
    fn places_values_and_numbers_are_hinted() {
        let text =
            "$INPUT\nPOS = 2/0-3/BCD\nDOOR = 1/7\n$INTEGER\nC = 5\n$END\nA = POS > C & DOOR\n";
        assert_eq!(labels(Dialect::Pmi, text), ["2/0-3, BCD", "= 5", "1/7"]);
        let text = "#define DOOR M11\nOPEN PLC1 CLEAR\nP1=DOOR&$1F\nCLOSE";
        assert_eq!(labels(Dialect::Pmac, text), ["= M11", "31"]);
    }
}
