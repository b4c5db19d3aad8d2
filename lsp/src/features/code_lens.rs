//! How often a declared name is read and written, above its declaration, and why it has its value in the run that is shown.

use std::collections::BTreeMap;

use gen_lsp_types::{CodeLens, Command, Range};
use plcc_frontend::common::words::{Declaration, DeclarationKind};
use serde_json::{Value, json};

use crate::program::At;

/// The most names of a line that have lenses of their own. With more the lenses would reach over the edge of the screen.
const MAX_ALONE: usize = 2;

/// The lenses of a document. `is_shown` says that the values of a run of its program are shown.
///
/// The extension of VS Code has the commands; in other editors the text alone is there.
pub(crate) fn code_lens(at: At<'_>, is_shown: bool) -> Vec<CodeLens> {
    let uri = at.documents.uri(at.program.path(at.file));
    let Some(Ok(uri)) = uri.map(serde_json::to_value) else { return vec![] };
    let own = at.program.words.declarations.iter().filter(|it| it.at.file == at.file);
    let mut lines: BTreeMap<u32, Vec<Told<'_>>> = BTreeMap::new();
    for told in own.filter_map(|declaration| told(at, declaration)) {
        lines.entry(told.range.start.line).or_default().push(told);
    }
    let of_line = |names: Vec<Told<'_>>| match names.len() {
        0..=MAX_ALONE => of_names(&names, &uri, is_shown),
        _ => of_list(&names, &uri, is_shown),
    };
    lines.into_values().flat_map(of_line).collect()
}

/// A declared name of which lenses tell.
struct Told<'p> {
    name: &'p str,
    range: Range,
    read: usize,
    written: usize,
    counts: String,
}

/// What lenses tell of a declaration; `None` if nothing.
fn told<'p>(at: At<'_>, declaration: &'p Declaration) -> Option<Told<'p>> {
    let (read, written) = at.program.words.uses_of(&declaration.name);
    let counts = match declaration.kind {
        DeclarationKind::Constant => count(read, "read"),
        // What the control itself calls would be said to have no calls.
        DeclarationKind::Label | DeclarationKind::Program if read == 0 => return None,
        DeclarationKind::Label | DeclarationKind::Program => count(read, "call"),
        DeclarationKind::Definition | DeclarationKind::Key => return None,
        DeclarationKind::Input
        | DeclarationKind::Output
        | DeclarationKind::Variable
        | DeclarationKind::Contact
        | DeclarationKind::Announcement => counts(read, written),
    };
    let range = at.program.range(declaration.at);
    Some(Told { name: &declaration.name, range, read, written, counts })
}

fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

fn counts(read: usize, written: usize) -> String {
    format!("{}, {}", count(read, "read"), count(written, "write"))
}

/// Lenses of their own for the names of a line. Of several names each says its own.
fn of_names(names: &[Told<'_>], uri: &Value, is_shown: bool) -> Vec<CodeLens> {
    let lenses = names.iter().flat_map(|told| {
        let of = |text: &str| match names.len() {
            1 => text.to_owned(),
            _ => format!("{}: {text}", told.name),
        };
        let arguments = vec![uri.clone(), json!(told.range.start)];
        let uses = lens(told.range, of(&told.counts), "plcc.showReferences", arguments);
        let why = || lens(told.range, of("why?"), "plcc.why", vec![told.name.into()]);
        [Some(uses), (is_shown && told.written > 0).then(why)]
    });
    lenses.flatten().collect()
}

/// Lenses that open a list of the names of a line: one for their uses, and one that asks why one of them has its value.
fn of_list(names: &[Told<'_>], uri: &Value, is_shown: bool) -> Vec<CodeLens> {
    let list = |names: &mut dyn Iterator<Item = &Told<'_>>| -> Value {
        names
            .map(|it| json!({"name": it.name, "uses": it.counts, "position": it.range.start}))
            .collect()
    };
    let Some(first) = names.first() else { return vec![] };
    let sum = |of: fn(&Told<'_>) -> usize| names.iter().map(of).sum();
    let title =
        format!("{} names: {}", names.len(), counts(sum(|it| it.read), sum(|it| it.written)));
    let all = list(&mut names.iter());
    let mut lenses =
        vec![lens(first.range, title, "plcc.showReferencesOf", vec![uri.clone(), all])];
    let mut written = names.iter().filter(|it| it.written > 0).peekable();
    if is_shown && written.peek().is_some() {
        let written = list(&mut written);
        lenses.push(lens(first.range, "why?".into(), "plcc.whyOf", vec![written]));
    }
    lenses
}

fn lens(range: Range, title: String, command: &str, arguments: Vec<Value>) -> CodeLens {
    let command =
        Command { title, tooltip: None, command: command.to_owned(), arguments: Some(arguments) };
    CodeLens { range, command: Some(command), data: None }
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    fn titles(lenses: Vec<CodeLens>) -> Vec<String> {
        lenses.into_iter().filter_map(|it| Some(it.command?.title)).collect()
    }

    #[test]
    fn lenses_of_two_names_in_a_line_say_the_names() {
        let of = with_cursor(
            Dialect::Pmi,
            "$INPUT\nDOOR = 1/0\n$INTEGER\nN, M\n$END\nN = M\nA = DOOR\n",
        );
        assert_eq!(
            titles(code_lens(at(&of), true)),
            [
                "1 read, 0 writes",
                "N: 0 reads, 1 write",
                "N: why?",
                "M: 1 read, 0 writes",
                "0 reads, 1 write",
                "why?",
            ]
        );
    }

    #[test]
    fn more_names_in_a_line_have_a_list() {
        let of = with_cursor(Dialect::Pmi, "$INTEGER\nA, B, C\n$END\nA = B + B\n");
        assert_eq!(titles(code_lens(at(&of), false)), ["3 names: 2 reads, 1 write"]);
        let lenses = code_lens(at(&of), true);
        let listed = |lens: &CodeLens| lens.command.clone().and_then(|it| it.arguments).unwrap();
        assert_eq!(
            listed(&lenses[0])[1][1],
            json!({"name": "B", "uses": "2 reads, 0 writes", "position": {"line": 1, "character": 3}})
        );
        assert_eq!(
            listed(&lenses[1]),
            [
                json!([{"name": "A", "uses": "0 reads, 1 write", "position": {"line": 1, "character": 0}}])
            ]
        );
    }
}
