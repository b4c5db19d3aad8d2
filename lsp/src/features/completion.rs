//! What can be written at a place: names of the program, names and words of the language.

use std::collections::BTreeSet;

use gen_lsp_types::{
    CompletionItem, CompletionItemKind, CompletionItemTextEdit, CompletionList, CompletionResponse,
    Documentation, InsertTextFormat, Range, TextEdit,
};
use plcc_diag::Span;
use plcc_frontend::common::words::{DeclarationKind, Word, WordKind};
use plcc_frontend::language;

use crate::program::{At, Program};

/// The most names of the language that are proposed at a time.
const MAX_TOPICS: usize = 200;

/// What can be written at a place.
pub(crate) fn completion(at: At<'_>) -> CompletionResponse {
    let program = at.program;
    let text = program.sources.text(at.file);
    let before = text.get(..at.offset as usize).unwrap_or_default();
    let start = before.trim_end_matches(is_part_of_word).len();
    let prefix = before.get(start..).unwrap_or_default();
    let in_text = program.words.of_file(at.file).iter().any(|word| {
        let is_text = matches!(word.kind, WordKind::Comment | WordKind::Text);
        is_text && word.span.start < at.offset && at.offset <= word.span.end
    });
    if in_text {
        return CompletionResponse::CompletionItemList(vec![]);
    }
    let range = program.range(Span { file: at.file, start: start as u32, end: at.offset });
    let is_being_written = |word: &Word| word.span.file == at.file && word.span.end == at.offset;
    let mut items = names(program, prefix, range, is_being_written);
    let own = items.len();
    for (label, body, detail) in language(program.dialect).snippets() {
        if begins(label, prefix) && !prefix.is_empty() {
            let mut snippet = item(label, CompletionItemKind::Snippet, detail, None, range);
            snippet.insert_text_format = Some(InsertTextFormat::Snippet);
            snippet.text_edit = Some(edit(range, body));
            items.push(snippet);
        }
    }
    let mut known: BTreeSet<String> = items.iter().map(|it| it.label.clone()).collect();
    let topics = language(program.dialect).topics();
    for topic in topics.iter().filter(|topic| begins(&topic.name, prefix)) {
        if items.len() >= own + MAX_TOPICS {
            break;
        }
        let is_word = topic.name.starts_with(is_part_of_word);
        if is_word && known.insert(topic.name.clone()) {
            items.push(item(&topic.name, CompletionItemKind::Keyword, &topic.meaning, None, range));
        }
    }
    let is_incomplete = items.len() >= own + MAX_TOPICS;
    let list = CompletionList { is_incomplete, items, ..CompletionList::default() };
    CompletionResponse::CompletionList(list)
}

/// Whether a character is part of a word of any of the languages.
pub(crate) fn is_part_of_word(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '@' | '$' | ':')
}

/// The names of a program that begin so. A word that is just being written is none.
pub(crate) fn names(
    program: &Program,
    prefix: &str,
    range: Range,
    is_being_written: impl Fn(&Word) -> bool,
) -> Vec<CompletionItem> {
    let mut known = BTreeSet::new();
    let mut items: Vec<CompletionItem> = vec![];
    for declaration in &program.words.declarations {
        if !begins(&declaration.name, prefix) || !known.insert(declaration.name.clone()) {
            continue;
        }
        let kind = match declaration.kind {
            DeclarationKind::Constant | DeclarationKind::Definition | DeclarationKind::Key => {
                CompletionItemKind::Constant
            }
            DeclarationKind::Label | DeclarationKind::Program => CompletionItemKind::Function,
            DeclarationKind::Announcement => CompletionItemKind::Event,
            DeclarationKind::Input
            | DeclarationKind::Output
            | DeclarationKind::Variable
            | DeclarationKind::Contact => CompletionItemKind::Variable,
        };
        let comment = program.comment(declaration.at);
        let comment = comment.map(Documentation::String);
        items.push(item(&declaration.name, kind, &declaration.detail, comment, range));
    }
    // Names without a declaration, such as NCT's flags.
    for word in &program.words.words {
        let Some(name) = &word.name else { continue };
        let is_other = word.defined_as.is_none() && !is_being_written(word);
        if begins(name, prefix) && is_other && known.insert(name.clone()) {
            items.push(item(name, CompletionItemKind::Variable, "", None, range));
        }
    }
    items
}

/// Whether a name begins with what is written already, in letters of any case.
pub(super) fn begins(name: &str, prefix: &str) -> bool {
    name.get(..prefix.len()).is_some_and(|head| head.eq_ignore_ascii_case(prefix))
}

fn edit(range: Range, text: &str) -> CompletionItemTextEdit {
    CompletionItemTextEdit::TextEdit(TextEdit { range, new_text: text.to_owned() })
}

pub(super) fn item(
    name: &str,
    kind: CompletionItemKind,
    detail: &str,
    documentation: Option<Documentation>,
    range: Range,
) -> CompletionItem {
    CompletionItem {
        label: name.to_owned(),
        kind: Some(kind),
        detail: (!detail.is_empty()).then(|| detail.to_owned()),
        documentation,
        text_edit: Some(edit(range, name)),
        ..CompletionItem::default()
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    fn proposed(dialect: Dialect, text: &str) -> Vec<String> {
        match completion(at(&with_cursor(dialect, text))) {
            CompletionResponse::CompletionList(list) => {
                list.items.into_iter().map(|it| it.label).collect()
            }
            CompletionResponse::CompletionItemList(list) => {
                list.into_iter().map(|it| it.label).collect()
            }
        }
    }

    #[test]
    fn names_that_begin_so_are_proposed() {
        let text = "$LOGICAL\nDOOR, DOOROK, LAMP\n$END\nLAMP = DO|\n";
        assert_eq!(proposed(Dialect::Pmi, text), ["DOOR", "DOOROK"]);
        assert!(proposed(Dialect::Pmi, "$END\nA = @FR|\n").contains(&"@FRO".to_owned()));
        assert!(proposed(Dialect::Pmac, "OPEN PLC1 CLEAR\nEND|").contains(&"ENDIF".to_owned()));
    }

    #[test]
    fn nothing_is_proposed_in_comments() {
        assert_eq!(proposed(Dialect::Pmi, "$LOGICAL\nDOOR\n$END\nA = DOOR ? DO|\n"), [""; 0]);
    }
}
